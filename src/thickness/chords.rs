//! Rays from places that are not the mesh's own centroids: widths at points of its faces; chords, how far the solid
//! reaches from a point inside along opposite directions; and the faces that such rays meet.

use super::bvh::{RayMesh, SAME_SURFACE, dot};
use super::cone::Cone;
use super::inscribed::Spheres;
use super::lanes::{Lanes, Work, with_best};
use super::tree::Stack;
use crate::error::{Result, try_filled};
use crate::job::Job;
use rayon::prelude::*;

/// Points in one piece of parallel work.
const CHUNK: usize = 16;

/// Distances between the two points where the line through `points[i]` along the unit vector `directions[k]` first meets
/// the surface on either side, `points.len()` rows of `directions.len()` numbers in the caller's unit; NaN where one
/// side meets nothing. Reports `points.len()` units to `job`.
///
/// # Errors
/// [`crate::error::Error::NoMemory`], [`crate::error::Error::Cancelled`].
pub fn chords(mesh: &RayMesh, points: &[[f64; 3]], directions: &[[f64; 3]], job: &Job) -> Result<Vec<f32>> {
    let width = directions.len().max(1);
    let mut out = try_filled(points.len() * width, f32::NAN, "chords")?;
    out.par_chunks_mut(CHUNK * width).zip(points.par_chunks(CHUNK)).try_for_each(|(rows, points)| {
        with_best(Piece { mesh, points, directions, rows });
        job.advance(points.len() as u64)
    })?;
    Ok(out)
}

struct Piece<'a> {
    mesh: &'a RayMesh,
    points: &'a [[f64; 3]],
    directions: &'a [[f64; 3]],
    rows: &'a mut [f32],
}

impl Work for Piece<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let mut stack = Stack::new();
        for (&point, row) in self.points.iter().zip(self.rows.chunks_mut(self.directions.len().max(1))) {
            let origin = self.mesh.to_unit(point);
            for (&d, chord) in self.directions.iter().zip(row) {
                // Written out twice: a closure would not be compiled for the instruction set of `lanes`.
                let ray = (origin, d);
                let ahead = self.mesh.nearest_hit(lanes, &mut stack, ray, (0.0, f64::INFINITY), u32::MAX);
                let ray = (origin, [-d[0], -d[1], -d[2]]);
                let behind = self.mesh.nearest_hit(lanes, &mut stack, ray, (0.0, f64::INFINITY), u32::MAX);
                if let (Some(a), Some(b)) = (ahead, behind) {
                    *chord = self.mesh.to_length(a.t + b.t) as f32;
                }
            }
        }
    }
}

/// D2 (Eqs. 10-13, see [`super::inscribed::face_widths`]) at `points[i]`, which lies on the face `faces[i]` of `mesh`; NaN
/// where no ray met anything and on faces without area. Reports `points.len()` units to `job`.
///
/// # Errors
/// [`crate::error::Error::NoMemory`], [`crate::error::Error::Cancelled`].
pub fn widths_at(mesh: &RayMesh, points: &[[f64; 3]], faces: &[u32], cone: &Cone, job: &Job) -> Result<Vec<f64>> {
    const CHUNK: usize = 256;
    let mut out = try_filled(points.len(), f64::NAN, "widths")?;
    let pieces = points.par_chunks(CHUNK).zip(faces.par_chunks(CHUNK));
    out.par_chunks_mut(CHUNK).zip(pieces).try_for_each(|(out, (points, faces))| {
        with_best(Widths { mesh, cone, points, faces, out });
        job.advance(points.len() as u64)
    })?;
    Ok(out)
}

struct Widths<'a> {
    mesh: &'a RayMesh,
    cone: &'a Cone,
    points: &'a [[f64; 3]],
    faces: &'a [u32],
    out: &'a mut [f64],
}

impl Work for Widths<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let mut spheres = Spheres::new(self.mesh, self.cone);
        for ((&point, &face), out) in self.points.iter().zip(self.faces).zip(self.out) {
            let normal = self.mesh.normals[face as usize];
            if normal == [0.0; 3] {
                continue;
            }
            let origin = self.mesh.to_unit(point);
            let sphere = spheres.at(lanes, (origin, face), f64::INFINITY, None);
            *out = sphere.map_or(f64::NAN, |s| self.mesh.to_length(s.diameter));
        }
    }
}

/// What a ray meets first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Met {
    /// The face; `u32::MAX` for none.
    pub face: u32,
    /// The distance to it, in the caller's unit; NaN for none.
    pub distance: f64,
}

impl Met {
    const NOTHING: Met = Met { face: u32::MAX, distance: f64::NAN };
}

/// What the ray from `points[i]` along `ways[i]` (of any length) meets first, other than the face `skip[i]` and what lies
/// in its plane; nothing where the way has no direction. Reports `points.len()` units to `job`.
///
/// # Errors
/// [`crate::error::Error::NoMemory`], [`crate::error::Error::Cancelled`].
pub fn first_met(
    mesh: &RayMesh,
    points: &[[f64; 3]],
    ways: &[[f64; 3]],
    skip: Option<&[u32]>,
    job: &Job,
) -> Result<Vec<Met>> {
    const CHUNK: usize = 256;
    let mut out = try_filled(points.len(), Met::NOTHING, "faces met by rays")?;
    out.par_chunks_mut(CHUNK).enumerate().try_for_each(|(k, out)| {
        with_best(Rays { mesh, points, ways, skip, start: k * CHUNK, out });
        job.advance(out.len() as u64)
    })?;
    Ok(out)
}

struct Rays<'a> {
    mesh: &'a RayMesh,
    points: &'a [[f64; 3]],
    ways: &'a [[f64; 3]],
    skip: Option<&'a [u32]>,
    start: usize,
    out: &'a mut [Met],
}

impl Work for Rays<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let mut stack = Stack::new();
        for (k, out) in self.out.iter_mut().enumerate() {
            let i = self.start + k;
            let way = self.ways[i];
            let length = dot(way, way).sqrt();
            // also false for a NaN
            if length > 0.0 {
                let (skip, from) = match self.skip {
                    Some(skip) => (skip[i], SAME_SURFACE),
                    None => (u32::MAX, 0.0),
                };
                let ray = (self.mesh.to_unit(self.points[i]), [way[0] / length, way[1] / length, way[2] / length]);
                if let Some(hit) = self.mesh.nearest_hit(lanes, &mut stack, ray, (from, f64::INFINITY), skip) {
                    *out = Met { face: hit.face, distance: self.mesh.to_length(hit.t) };
                }
            }
        }
    }
}
