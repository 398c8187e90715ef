//! D1: geodesic distances, and the farthest distance of every vertex ([`eccentricity`]).
//!
//! Two solvers make distance fields: [`heat`], the paper's, whose cost a source hardly depends on the shape, and
//! [`exact`], which needs no good triangles and is the faster of the two on the few thousand slivers of a CAD part.

pub mod eccentricity;
pub mod exact;
mod exact_fields;
pub mod heat;

pub use eccentricity::{Column, DistanceFields, Eccentricity, Mode, Targets, Ways, eccentricity};
pub use exact_fields::ExactFields;
pub use heat::{HeatOptions, HeatSolver};
