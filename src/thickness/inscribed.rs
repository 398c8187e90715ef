//! D2 as the paper has it: the diameter of the largest inscribed sphere that touches the surface at a face's centroid,
//! felt out by rays (Eqs. 10-13).

use super::bvh::{RayMesh, SAME_SURFACE, along, dot, sub};
use super::cone::{Cone, frame, turned};
use super::lanes::{Lanes, Work, with_best};
use super::shaft::{Front, Shaft};
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
pub(super) struct Piece<'a> {
    pub mesh: &'a RayMesh,
    pub cone: &'a Cone,
    pub blocks: &'a [Block],
    pub out: &'a mut Vec<(u32, f64)>,
}

impl Work for Piece<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let mut spheres = Spheres::new(self.mesh, self.cone);
        let mut guess: Option<Sphere> = None;
        for face in self.blocks.iter().flat_map(faces_of) {
            let corners = self.mesh.corners(face);
            let centroid = std::array::from_fn(|a| (corners[0][a] + corners[1][a] + corners[2][a]) / 3.0);
            // A sphere a little larger than the neighbour's: if a ray ends inside it, the minimum is in there; if none
            // does, nothing is known and the rays are shot again without bound. The result is the same.
            let limit = guess.map_or(f64::INFINITY, |s| s.diameter * GUESS);
            let ahead = guess.map(|s| s.contact);
            let mut sphere = spheres.at(lanes, (centroid, face), limit, ahead);
            if sphere.is_none() && limit < f64::INFINITY {
                sphere = spheres.at(lanes, (centroid, face), f64::INFINITY, None);
            }
            self.out.push((face, sphere.map_or(f64::NAN, |s| s.diameter)));
            guess = sphere;
        }
    }
}

/// Guesses that are too small cost more than guesses that are too large.
const GUESS: f64 = 1.15;

/// A sphere that touches the surface at the origin of the rays and where the shortest of them ends.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sphere {
    pub diameter: f64,
    contact: [f64; 3],
}

/// Finds spheres by the rays of a cone.
pub(super) struct Spheres<'a> {
    mesh: &'a RayMesh,
    cone: &'a Cone,
    /// Cosine and sine of the angle between the axis and the outermost ray, and a little more.
    edge: [f64; 2],
    front: Front,
    stack: Stack,
}

/// Shafts are wider than the outermost ray by this much in the cosine.
const WIDER: f64 = 1e-5;

impl<'a> Spheres<'a> {
    pub fn new(mesh: &'a RayMesh, cone: &'a Cone) -> Spheres<'a> {
        let cos = (cone.directions().iter().fold(1.0, |least: f64, d| least.min(d[2])) - WIDER).max(0.0);
        Spheres { mesh, cone, edge: [cos, (1.0 - cos * cos).sqrt()], front: Front::new(), stack: Stack::new() }
    }

    /// The smallest sphere that is no larger than `limit`, in units of the tree. A ray towards `ahead` goes first.
    #[inline(always)]
    pub fn at<L: Lanes>(
        &mut self,
        lanes: L,
        (origin, face): ([f64; 3], u32),
        limit: f64,
        ahead: Option<[f64; 3]>,
    ) -> Option<Sphere> {
        let inward = self.mesh.normals[face as usize].map(|x| -x);
        let [x, y] = frame(self.mesh.corners(face), inward);
        let first = ahead.map_or(0, |p| {
            let way = sub(p, origin);
            nearest_to(self.cone.directions(), [dot(way, x), dot(way, y), dot(way, inward)])
        });
        let (mut best, mut reach) = (None, limit);
        // --- all rays end in the sphere of the limit; without one, the first goes alone and the rest end in what it finds
        let alone = usize::from(limit == f64::INFINITY);
        let directions = self.cone.directions();
        for (k, d) in std::iter::once(directions[first]).chain(directions.iter().copied()).enumerate() {
            if k == alone {
                let [cos, sin] = self.edge;
                self.front.gather(
                    lanes,
                    &self.mesh.tree,
                    &Shaft { apex: origin, axis: inward, cos, sin, diameter: reach, face },
                );
            }
            if k == first + 1 {
                continue;
            }
            // --- Eqs. 10-12: ray and triangle. A ray that ends outside the sphere found so far cannot make it smaller.
            let way = turned(d, [x, y], inward);
            let range = (SAME_SURFACE / d[2], reach * d[2]);
            let roots = if k < alone { self.mesh.tree.root() } else { self.front.roots() };
            if let Some(hit) = self.mesh.nearest_hit_from(roots, lanes, &mut self.stack, (origin, way), range, face) {
                // --- Eq. 13
                let diameter = hit.t / d[2];
                if best.is_none_or(|s: Sphere| diameter < s.diameter) {
                    best = Some(Sphere { diameter, contact: along(origin, hit.t, way) });
                    reach = diameter;
                }
            }
        }
        best
    }
}

/// The direction that makes the smallest angle with `way`.
#[inline(always)]
fn nearest_to(directions: &[[f64; 3]], way: [f64; 3]) -> usize {
    let mut best = (f64::NEG_INFINITY, 0);
    for (k, d) in directions.iter().enumerate() {
        let cos = dot(*d, way);
        if cos > best.0 {
            best = (cos, k);
        }
    }
    best.1
}
