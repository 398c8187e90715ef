//! A field as a coloured PLY file.

use super::{Field, Quantity};
use crate::error::Result;
use crate::io::colour::colour_of;
use crate::io::{save_ply, write_ply};
use crate::mesh::TriMesh;
use std::path::Path;

impl Field {
    /// Writes welded vertices, kept faces, colours by `quantity` from its smallest to its largest value, and the scalars
    /// `d1`, `d2`, `ratio` and, under the name that MeshLab keeps, `quality` (= `quantity`) to a binary PLY file.
    pub fn save_ply(&self, mesh: &TriMesh, path: &Path, quantity: Quantity) -> Result<()> {
        let values = self.values(quantity);
        let finite = values.iter().copied().filter(|x| x.is_finite());
        let (lo, hi) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(x), hi.max(x)));
        let colours: Vec<[u8; 3]> = values.iter().map(|&x| colour_of(x, lo, hi)).collect();
        let scalars = [("d1", self.d1.as_slice()), ("d2", &self.d2), ("ratio", &self.ratio), ("quality", values)];
        save_ply(path, |out| write_ply(out, mesh.positions(), mesh.triangles(), Some(&colours), &scalars))
    }
}
