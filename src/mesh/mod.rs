//! Triangle meshes: everything that only looks at triangles.
