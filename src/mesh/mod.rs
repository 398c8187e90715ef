//! Triangle meshes: everything that only looks at triangles.
//!
//! [`input`] turns raw buffers into a checked, welded [`TriMesh`], the only mesh type of the crate; [`topology`] finds
//! edges, shells and a consistent orientation; [`diagnostics`] says what is wrong and where; [`measure`] holds the small
//! formulas; [`simplify`] and [`proxy`] take it down to what D1 is solved on where it is large, [`surface`] adds vertices
//! to it, and [`intrinsic`] makes triangles of any
//! shape fit for that.

pub mod around;
pub mod corners;
pub mod diagnostics;
pub mod input;
pub mod intrinsic;
pub mod measure;
pub mod proxy;
pub mod sets;
pub mod simplify;
pub mod surface;
pub mod topology;
pub mod used;

#[cfg(test)]
pub mod shapes;

pub use diagnostics::{Diagnostics, Finding};
pub use input::{MeshOptions, MeshSource, TriMesh, Weld};
pub use topology::Topology;

/// "No such vertex, face or edge".
pub const NONE: u32 = u32::MAX;
