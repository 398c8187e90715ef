//! The analysis surface: the input with vertices added where it is too coarse to compute on.
//!
//! Printable parts out of CAD have slivers a thousand times longer than wide and no vertices inside flat faces.
//! Splitting every long edge would multiply such slivers; instead points are laid out over the *surface* at a spacing h
//! that follows from the wanted number of vertices, whatever the triangles ([`sites`]), and every input face that got
//! points is cut along them ([`split`]). The cut mesh is conforming and lies on the input to rounding, but its triangles
//! are still those of the input's slivers: finite elements use [`AnalysisSurface::intrinsic`], the intrinsic Delaunay
//! triangulation of the same vertices, in which slivers that lie beside each other no longer matter.
//!
//! The vertices of the input come first and are unchanged, so a per-vertex result is mapped back by taking its first
//! `input_vertices` entries; the children of an input face are contiguous ([`AnalysisSurface::children`]).

mod sites;
mod split;

use crate::error::{Error, Result, try_filled, try_vec};
use crate::job::Job;
use crate::mesh::intrinsic::IntrinsicMesh;
use crate::mesh::measure::{barycentric, corners, cross, norm, sub};
use rayon::prelude::*;
use std::ops::Range;

/// Margin of the triangle inequality in mean edges that zero-area triangles need to be flipped away.
const MOLLIFY_SLIVERS: f64 = 1e-11;
/// Margin of the triangle inequality in mean edges after the flips, for the sake of the linear solver.
pub const MOLLIFY: f64 = 1e-7;

/// How finely to refine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceOptions {
    /// The number of vertices that the spacing is chosen for: what a surface of this area has when covered evenly by
    /// equilateral triangles. Vertices of finely meshed regions come on top.
    pub target_vertices: usize,
    /// Spacing h of the vertices in model units, instead of one derived from `target_vertices`.
    pub edge_length: Option<f64>,
    /// At most this many vertices are added, whatever the input; a spacing that would need more is coarsened.
    pub max_added: usize,
}

impl Default for SurfaceOptions {
    fn default() -> Self {
        SurfaceOptions { target_vertices: 25_000, edge_length: None, max_added: 200_000 }
    }
}

/// The input mesh, refined. Children of a face tile it exactly; faces that share an edge share the points on it.
#[derive(Debug, Clone, PartialEq)]
pub struct AnalysisSurface {
    /// Vertex positions in model units, first those of the input, unchanged.
    pub positions: Vec<[f64; 3]>,
    /// Corners of the triangles, oriented as their parent, in the order of the parents.
    pub triangles: Vec<[u32; 3]>,
    /// For every triangle the input face that it is a part of.
    pub parent_face: Vec<u32>,
    /// For every added vertex (index minus `input_vertices`) one input face that it lies on.
    pub vertex_face: Vec<u32>,
    /// Number of vertices of the input.
    pub input_vertices: usize,
    /// The spacing h that the surface was refined to, in model units. Regions that the input meshes finer stay finer.
    pub spacing: f64,
    /// First triangle of every input face, and the number of triangles at the end.
    first_child: Vec<u32>,
}

impl AnalysisSurface {
    /// Refines a mesh: `positions` in model units, finite; `triangles` with three distinct valid indices each; any
    /// topology. A mesh that is nowhere coarser than the wanted spacing comes back as it is.
    ///
    /// # Errors
    /// [`Error::Argument`] for a spacing that is not positive, [`Error::Degenerate`] without any area,
    /// [`Error::NoMemory`], [`Error::Budget`], [`Error::Cancelled`].
    pub fn refine(
        positions: &[[f64; 3]],
        triangles: &[[u32; 3]],
        options: &SurfaceOptions,
        job: &Job,
    ) -> Result<AnalysisSurface> {
        let spacing = spacing(positions, triangles, options)?;
        let bytes =
            200 * (positions.len() + triangles.len() + options.max_added.min(2 * options.target_vertices)) as u64;
        job.afford(bytes, "refining the surface")?;
        let sites = sites::lay_out(positions, triangles, spacing, options.max_added, job)?;
        let mut out = AnalysisSurface::unrefined(positions, triangles)?;
        out.spacing = spacing;
        if sites.positions.is_empty() {
            return Ok(out);
        }
        out.positions.try_reserve_exact(sites.positions.len()).map_err(|_| no_memory())?;
        out.positions.extend_from_slice(&sites.positions);
        out.vertex_face = sites.faces.clone();
        out.cut(triangles, &sites, job)?;
        Ok(out)
    }

    /// The vertices that were added, in their order, as the face of the input (`positions`, `triangles`) that each lies in
    /// and its barycentric coordinates there.
    pub fn added(&self, positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> impl Iterator<Item = (u32, [f64; 3])> {
        let places = self.positions[self.input_vertices..].iter().zip(&self.vertex_face);
        places.map(|(&p, &face)| (face, barycentric(corners(positions, triangles[face as usize]), p)))
    }

    /// The mesh as given, as its own analysis surface; `spacing` is 0.
    ///
    /// # Errors
    /// [`Error::NoMemory`].
    pub fn unrefined(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<AnalysisSurface> {
        let copy = |from: &[[f64; 3]]| -> Result<Vec<[f64; 3]>> {
            let mut to = try_vec(from.len(), "surface")?;
            to.extend_from_slice(from);
            Ok(to)
        };
        let count = u32::try_from(triangles.len()).map_err(|_| Error::Argument("more than 2^32 triangles".into()))?;
        let mut faces = try_vec(triangles.len(), "surface")?;
        faces.extend_from_slice(triangles);
        Ok(AnalysisSurface {
            positions: copy(positions)?,
            triangles: faces,
            parent_face: (0..count).collect(),
            vertex_face: Vec::new(),
            input_vertices: positions.len(),
            spacing: 0.0,
            first_child: (0..=count).collect(),
        })
    }

    /// The triangles that the input face `face` was cut into.
    pub fn children(&self, face: usize) -> Range<usize> {
        self.first_child[face] as usize..self.first_child[face + 1] as usize
    }

    /// The surface as finite elements want it: flipped to intrinsic Delaunay, and no triangle flatter than
    /// [`MOLLIFY`] × mean edge. Vertices are those of this surface.
    ///
    /// # Errors
    /// Those of [`IntrinsicMesh::from_extrinsic`] and [`IntrinsicMesh::flip_to_delaunay`].
    pub fn intrinsic(&self, job: &Job) -> Result<IntrinsicMesh> {
        let mut mesh = IntrinsicMesh::from_extrinsic(&self.positions, &self.triangles)?;
        // A margin that is harmless to good triangles widens slivers, whose height goes with its root: bundles of them
        // would gain area. So before the flips only enough for zero-area triangles, and the rest when slivers are gone.
        mesh.mollify(MOLLIFY_SLIVERS);
        mesh.flip_to_delaunay(job)?;
        mesh.mollify(MOLLIFY);
        Ok(mesh)
    }

    /// Replaces the triangles by their children along `sites`.
    fn cut(&mut self, triangles: &[[u32; 3]], sites: &sites::Sites, job: &Job) -> Result<()> {
        // Faces are independent: blocks of them in parallel, joined in order.
        const BLOCK: usize = 256;
        let blocks: Vec<Vec<([u32; 3], u32)>> = (0..triangles.len().div_ceil(BLOCK))
            .into_par_iter()
            .map(|block| {
                job.check()?;
                let mut cutter = split::Cutter::default();
                let mut out = Vec::new();
                for f in block * BLOCK..triangles.len().min((block + 1) * BLOCK) {
                    cutter.cut(f, triangles[f], &self.positions, sites, &mut out)?;
                }
                Ok(out)
            })
            .collect::<Result<_>>()?;
        let total: usize = blocks.iter().map(Vec::len).sum();
        let total = u32::try_from(total).map_err(|_| Error::Argument("more than 2^32 triangles".into()))? as usize;
        self.triangles = try_vec(total, "surface")?;
        self.parent_face = try_vec(total, "surface")?;
        self.first_child = try_filled(triangles.len() + 1, 0, "surface")?;
        for (t, parent) in blocks.into_iter().flatten() {
            self.triangles.push(t);
            self.parent_face.push(parent);
            self.first_child[parent as usize + 1] += 1;
        }
        for f in 0..triangles.len() {
            self.first_child[f + 1] += self.first_child[f];
        }
        Ok(())
    }
}

fn no_memory() -> Error {
    Error::NoMemory("out of memory: refined surface".into())
}

/// The spacing of vertices that options and area call for.
fn spacing(positions: &[[f64; 3]], triangles: &[[u32; 3]], options: &SurfaceOptions) -> Result<f64> {
    let area: f64 = triangles.iter().map(|t| norm(normal(positions, t)) / 2.0).sum();
    if !(area > 0.0 && area.is_finite()) {
        return Err(Error::Degenerate(crate::error::Located {
            message: "no face has an area, or the total is not finite".into(),
            first: 0,
            count: triangles.len() as u64,
        }));
    }
    let wanted = options.edge_length.unwrap_or_else(|| even_spacing(area, options.target_vertices));
    if !(wanted > 0.0 && wanted.is_finite()) {
        return Err(Error::Argument(format!("edge length of the analysis surface must be positive, is {wanted}")));
    }
    Ok(wanted.max(even_spacing(area, options.max_added)))
}

/// Side of the equilateral triangles with which about `vertices` vertices cover `area`: sqrt(3)/2 h² of area a vertex.
fn even_spacing(area: f64, vertices: usize) -> f64 {
    (area / (0.75f64.sqrt() * vertices.max(1) as f64)).sqrt()
}

/// Normal of a triangle, twice its area long.
fn normal(positions: &[[f64; 3]], t: &[u32; 3]) -> [f64; 3] {
    let [a, b, c] = t.map(|v| positions[v as usize]);
    cross(sub(b, a), sub(c, a))
}

#[cfg(test)]
mod tests;
