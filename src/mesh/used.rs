//! The vertices that some triangles use, numbered anew.

use super::NONE;
use crate::error::{Result, try_filled, try_vec};

/// The vertices of some triangles of a mesh.
#[derive(Debug)]
pub struct Used {
    /// In rising order.
    pub vertices: Vec<u32>,
    /// By vertex of the mesh, its number among these; [`NONE`] for the others.
    pub number: Vec<u32>,
}

impl Used {
    /// Those of `triangles`, whose indices are below `count`. O(`count` + triangles). `what` they are for, should memory
    /// run out.
    ///
    /// # Errors
    /// [`crate::error::Error::NoMemory`].
    pub fn new(count: usize, triangles: impl Iterator<Item = [u32; 3]>, what: &str) -> Result<Used> {
        let mut number = try_filled(count, NONE, what)?;
        triangles.flatten().for_each(|v| number[v as usize] = 0);
        let mut vertices = try_vec(number.iter().filter(|n| **n != NONE).count(), what)?;
        for (number, v) in number.iter_mut().zip(0..).filter(|(n, _)| **n != NONE) {
            *number = vertices.len() as u32;
            vertices.push(v);
        }
        Ok(Used { vertices, number })
    }

    /// A triangle by the new numbers.
    pub fn triangle(&self, triangle: [u32; 3]) -> [u32; 3] {
        triangle.map(|v| self.number[v as usize])
    }
}
