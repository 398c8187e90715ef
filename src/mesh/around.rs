//! The faces around each vertex.

use crate::error::{Result, try_filled, try_vec};

/// The faces of a mesh by vertex, in rising order.
#[derive(Debug, Default)]
pub struct VertexFaces {
    /// Where each vertex's list starts, and the last ends.
    first: Vec<u32>,
    faces: Vec<u32>,
}

impl VertexFaces {
    /// Sorts `triangles` (valid indices below `vertices`) by vertex. O(vertices + faces).
    ///
    /// # Errors
    /// [`crate::error::Error::NoMemory`].
    pub fn new(vertices: usize, triangles: &[[u32; 3]]) -> Result<VertexFaces> {
        let mut first = try_filled(vertices + 1, 0u32, "faces around vertices")?;
        triangles.iter().flatten().for_each(|&v| first[v as usize + 1] += 1);
        for v in 0..vertices {
            first[v + 1] += first[v];
        }
        let mut fill = try_vec(vertices, "faces around vertices")?;
        fill.extend_from_slice(&first[..vertices]);
        let mut faces = try_filled(3 * triangles.len(), 0u32, "faces around vertices")?;
        for (f, t) in triangles.iter().enumerate() {
            for &v in t {
                faces[fill[v as usize] as usize] = f as u32;
                fill[v as usize] += 1;
            }
        }
        Ok(VertexFaces { first, faces })
    }

    /// The faces around a vertex.
    #[inline(always)]
    pub fn of(&self, v: u32) -> &[u32] {
        &self.faces[self.first[v as usize] as usize..self.first[v as usize + 1] as usize]
    }
}
