//! Segmentation.

pub mod affinity;
pub mod creases;
pub mod cut;
pub mod dual;
pub mod kmeans;
pub mod patches;
pub mod spectral;
pub mod vsi;
