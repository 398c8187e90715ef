//! # armesh
//!
//! Which features of a part are too slender to print, where, and by how much? `armesh` measures, at every vertex of a
//! triangle mesh, a length **D1** (the farthest geodesic distance), a width **D2** (the diameter of an inscribed sphere)
//! and their ratio, the *slenderness* D1/D2, after Ge & Flynn, "A computational method for detecting aspect ratio and
//! problematic features in additive manufacturing", J. Intell. Manuf. 33 (2022) 519-535.
//!
//! ## The data walk
//! raw buffers or a file ([`io`]) → [`mesh::TriMesh`], checked and welded → [`geodesic`] (D1) and [`thickness`] (D2),
//! which do not know each other → [`field`] (ratio, summary, histograms), [`segment`] → [`feature`] (findings, limits,
//! reports) → copied out by [`capi`], the C boundary.
//! Core modules never import `capi`, and every long step takes a [`job::Job`] (progress, cancel, threads, budget).
#![deny(unsafe_code, missing_docs)]

#[cfg(panic = "abort")]
compile_error!("armesh catches panics at its C boundary: build it with panic = \"unwind\"");

#[allow(unsafe_code)]
pub mod capi;
pub mod error;
pub mod feature;
pub mod field;
pub mod geodesic;
pub mod io;
pub mod job;
pub mod mesh;
pub mod segment;

pub mod sparse;
pub mod thickness;
