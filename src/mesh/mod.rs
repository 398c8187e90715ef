//! Triangle meshes: everything that only looks at triangles.

pub mod intrinsic;
pub mod surface;
