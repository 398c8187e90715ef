//! D1: geodesic distances by the heat method ([`heat`]) and the farthest distance of every vertex ([`eccentricity`]).

pub mod eccentricity;
pub mod heat;

pub use eccentricity::{Eccentricity, Mode};
pub use heat::{HeatOptions, HeatSolver};
