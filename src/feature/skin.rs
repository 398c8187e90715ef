//! The surface that features are found on: the faces of a mesh, or these cut where a border crosses them.

use super::Features;
use crate::error::{Result, try_filled};
use crate::mesh::measure::Vec3;
use crate::mesh::{NONE, Topology, TriMesh};
use crate::segment::CutMesh;
use crate::segment::dual::Dual;

/// A surface, and how it lies on the kept faces of a mesh.
#[derive(Clone, Copy)]
pub struct Skin<'a> {
    /// Vertices, model units.
    pub positions: &'a [Vec3],
    /// Faces, oriented outward.
    pub triangles: &'a [[u32; 3]],
    /// The same with their corners in the order that `topology` knows.
    pub stored: &'a [[u32; 3]],
    /// Edges of `stored`.
    pub topology: &'a Topology,
    /// Neighbours.
    pub dual: &'a Dual,
    /// The mesh whose faces these are, if none is cut.
    pub whole: Option<&'a TriMesh>,
    cut: Option<&'a CutMesh>,
}

impl<'a> Skin<'a> {
    /// The faces of a mesh: `triangles` are its kept faces, oriented, and `dual` joins them.
    ///
    /// # Errors
    /// Those of [`TriMesh::topology`].
    pub fn of(mesh: &'a TriMesh, triangles: &'a [[u32; 3]], dual: &'a Dual) -> Result<Skin<'a>> {
        let (positions, stored, topology) = (mesh.positions(), mesh.triangles(), mesh.topology()?);
        Ok(Skin { positions, triangles, stored, topology, dual, whole: Some(mesh), cut: None })
    }

    /// A mesh with faces cut, with its edges and neighbours.
    pub fn cut(cut: &'a CutMesh, topology: &'a Topology, dual: &'a Dual) -> Skin<'a> {
        let (positions, triangles) = (&cut.positions[..], &cut.triangles[..]);
        Skin { positions, triangles, stored: triangles, topology, dual, whole: None, cut: Some(cut) }
    }

    /// The face of the mesh that face `f` is, or is a part of.
    pub fn parent(&self, f: u32) -> u32 {
        self.cut.map_or(f, |c| c.parent[f as usize])
    }

    /// The face at point `p` of face `f` of the mesh; [`NONE`] for [`NONE`].
    pub fn at(&self, f: u32, p: Vec3) -> u32 {
        match self.cut {
            Some(cut) if f != NONE => cut.at(f, p),
            _ => f,
        }
    }

    /// Features by the `faces` faces of the mesh: a face has the feature that most of it belongs to, but every feature
    /// has a face, if need be one of which another has more.
    ///
    /// # Errors
    /// [`crate::error::Error::NoMemory`].
    pub fn on_input(&self, found: Features, faces: usize) -> Result<Features> {
        let Some(cut) = self.cut else { return Ok(found) };
        let Features { face_feature: label, mut features } = found;
        let mut owner = try_filled(faces, 0u32, "features")?;
        let mut shares: Vec<(u32, f64)> = Vec::new();
        // the face that most of a feature lies on
        let mut largest = try_filled(features.len(), (0.0, NONE), "features")?;
        let mut f = 0;
        while f < label.len() {
            let parent = cut.parent[f];
            shares.clear();
            while f < label.len() && cut.parent[f] == parent {
                let area = self.dual.area[f];
                match shares.iter_mut().find(|s| s.0 == label[f]) {
                    Some(s) => s.1 += area,
                    None => shares.push((label[f], area)),
                }
                f += 1;
            }
            for &(l, area) in &shares {
                let most = &mut largest[l as usize];
                if most.1 == NONE || area > most.0 {
                    *most = (area, parent);
                }
            }
            let most = shares.iter().copied().reduce(|a, b| if b.1 > a.1 { b } else { a });
            owner[parent as usize] = most.map_or(0, |m| m.0);
        }
        let mut count = try_filled(features.len(), 0u32, "features")?;
        owner.iter().for_each(|&l| count[l as usize] += 1);
        for (k, &(_, f)) in largest.iter().enumerate() {
            if count[k] == 0 && f != NONE {
                let before = &mut owner[f as usize];
                if count[*before as usize] > 1 {
                    count[*before as usize] -= 1;
                    (*before, count[k]) = (k as u32, 1);
                }
            }
        }
        features.iter_mut().zip(count).for_each(|(feature, count)| feature.faces = count);
        Ok(Features { face_feature: owner, features })
    }
}
