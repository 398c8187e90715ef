//! D2 as the paper has it: the diameter of the largest inscribed sphere that touches the surface at a face's centroid,
//! felt out by rays (Eqs. 10-13).

use super::bvh::{RayMesh, SAME_SURFACE};
use super::cone::{Cone, frame, turned};
use super::lanes::{Lanes, Work, with_best};
use super::tree::{Block, Stack, faces_of};
use crate::error::{Result, try_filled, try_vec};
use crate::job::Job;
use rayon::prelude::*;

/// Blocks of four triangles in one piece of parallel work. Fixed, so that results do not depend on the thread count.
const CHUNK: usize = 64;

/// Diameters by face.
#[derive(Debug, Clone)]
pub struct FaceWidths {
    /// Diameter of the inscribed sphere at each face's centroid; NaN where no ray met anything and on faces without area.
    pub width: Vec<f64>,
    /// Faces with an area whose rays met nothing: the surface is open in front of them.
    pub open_faces: u64,
    /// The first of them.
    pub first_open: Option<u32>,
}

/// D2 of every face, d_i = min_j l_j / cos(theta_j) over the rays of `cone` from the centroid about the inward normal
/// (Eqs. 10-13). Reports `mesh.face_count()` units to `job`.
///
/// # Errors
/// [`crate::error::Error::NoMemory`], [`crate::error::Error::Cancelled`].
pub fn face_widths(mesh: &RayMesh, cone: &Cone, job: &Job) -> Result<FaceWidths> {
    let mut width = try_filled(mesh.face_count(), f64::NAN, "face widths")?;
    let pieces: Result<Vec<Vec<(u32, f64)>>> = mesh
        .tree
        .blocks
        .par_chunks(CHUNK)
        .map(|blocks| {
            let mut out = try_vec(4 * blocks.len(), "face widths")?;
            with_best(Piece { mesh, cone, blocks, out: &mut out });
            job.advance(out.len() as u64)?;
            Ok(out)
        })
        .collect();
    for (face, d) in pieces?.into_iter().flatten() {
        width[face as usize] = mesh.to_length(d);
    }
    mesh.fill_copies(&mut width);
    let is_open = |&f: &u32| width[f as usize].is_nan() && mesh.normals[f as usize] != [0.0; 3];
    let mut open = (0..mesh.face_count() as u32).filter(is_open);
    let first_open = open.next();
    let open_faces = first_open.iter().count() as u64 + open.count() as u64;
    Ok(FaceWidths { width, open_faces, first_open })
}

/// D2 of every vertex: the plain mean over the faces that share it (the paper's rule), NaN if none of them has a value.
/// A face without a value is left out of the mean.
///
/// # Errors
/// [`crate::error::Error::NoMemory`].
pub fn vertex_means(vertex_count: usize, triangles: &[[u32; 3]], face_width: &[f64]) -> Result<Vec<f64>> {
    let mut sum = try_filled(vertex_count, (0.0f64, 0u32), "vertex widths")?;
    for (triangle, &d) in triangles.iter().zip(face_width) {
        if !d.is_nan() {
            for &v in triangle {
                let s = &mut sum[v as usize];
                *s = (s.0 + d, s.1 + 1);
            }
        }
    }
    let mut mean = try_vec(vertex_count, "vertex widths")?;
    mean.extend(sum.iter().map(|&(s, n)| if n > 0 { s / n as f64 } else { f64::NAN }));
    Ok(mean)
}

/// The faces of some blocks.
struct Piece<'a> {
    mesh: &'a RayMesh,
    cone: &'a Cone,
    blocks: &'a [Block],
    out: &'a mut Vec<(u32, f64)>,
}

impl Work for Piece<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let mut stack = Stack::new();
        let mut guess = f64::INFINITY;
        for face in self.blocks.iter().flat_map(faces_of) {
            // A sphere a little larger than the neighbour's: if a ray ends inside it, the minimum is in there; if none
            // does, nothing is known and the rays are shot again without bound. The result is the same.
            let mut d = face_width(lanes, self.mesh, self.cone, face, guess, &mut stack);
            if d.is_nan() && guess < f64::INFINITY {
                d = face_width(lanes, self.mesh, self.cone, face, f64::INFINITY, &mut stack);
            }
            guess = if d.is_nan() { f64::INFINITY } else { d * GUESS };
            self.out.push((face, d));
        }
    }
}

const GUESS: f64 = 1.05;

/// d_i of one face in units of the tree if it is at most `limit`, else NaN.
#[inline(always)]
fn face_width<L: Lanes>(lanes: L, mesh: &RayMesh, cone: &Cone, face: u32, limit: f64, stack: &mut Stack) -> f64 {
    let corners = mesh.corners(face);
    let centroid = std::array::from_fn(|a| (corners[0][a] + corners[1][a] + corners[2][a]) / 3.0);
    width_at(lanes, mesh, cone, (centroid, face), limit, stack)
}

/// The same at a point of a face.
#[inline(always)]
pub(super) fn width_at<L: Lanes>(
    lanes: L,
    mesh: &RayMesh,
    cone: &Cone,
    (origin, face): ([f64; 3], u32),
    limit: f64,
    stack: &mut Stack,
) -> f64 {
    let inward = mesh.normals[face as usize].map(|x| -x);
    let xy = frame(mesh.corners(face), inward);
    let (mut best, mut reach) = (f64::NAN, limit);
    for &d in cone.directions() {
        // --- Eqs. 10-12: ray and triangle. A ray that ends outside the sphere found so far cannot make it smaller.
        let ray = (origin, turned(d, xy, inward));
        let range = (SAME_SURFACE / d[2], reach * d[2]);
        if let Some(hit) = mesh.nearest_hit(lanes, stack, ray, range, face) {
            // --- Eq. 13
            let diameter = hit.t / d[2];
            if !(diameter >= best) {
                best = diameter;
                reach = diameter;
            }
        }
    }
    best
}
