//! The shape diameter function of Shapira, Shamir & Cohen-Or (2008) as CGAL 5.5 defines its raw values: a robust mean
//! of ray lengths. It reads walls too wide (see the inscribed sphere for a width); it is here to compare with others.

use super::bvh::{RayMesh, SAME_SURFACE, cross, dot};
use super::cone::turned;
use super::lanes::{Lanes, Work, with_best};
use super::tree::{Block, Stack, faces_of};
use crate::error::{Error, Result, try_filled, try_vec};
use crate::job::Job;
use rayon::prelude::*;
use std::f64::consts::PI;

/// CGAL's default number of rays.
pub const SDF_RAYS: usize = 25;

/// CGAL's default full cone angle in radians.
pub const SDF_ANGLE: f64 = 2.0 * PI / 3.0;

/// Rays whose length is further from the median than this many median absolute deviations are left out.
const DEVIATIONS: f64 = 1.5;

/// Blocks of four triangles in one piece of parallel work.
const CHUNK: usize = 64;

/// The raw shape diameter of every face: `rays` rays in a cone of the full angle `angle` (radians) about the inward
/// normal at the centroid, NaN where no ray was accepted. Neither smoothed nor normalised. Reports `mesh.face_count()`
/// units to `job`.
///
/// # Errors
/// [`Error::Argument`] unless 1 <= `rays` <= 4096 and 0 < `angle` < pi; [`Error::NoMemory`], [`Error::Cancelled`].
pub fn sdf_values(mesh: &RayMesh, rays: usize, angle: f64, job: &Job) -> Result<Vec<f64>> {
    if !((1..=4096).contains(&rays) && angle > 0.0 && angle < PI) {
        return Err(Error::Argument(format!("{rays} rays in a cone of {angle}: not 1..4096, or not between 0 and pi")));
    }
    let directions = vogel_cone(rays, angle);
    let mut values = try_filled(mesh.face_count(), f64::NAN, "shape diameters")?;
    let pieces: Result<Vec<Vec<(u32, f64)>>> = mesh
        .tree
        .blocks
        .par_chunks(CHUNK)
        .map(|blocks| {
            let mut out = try_vec(4 * blocks.len(), "shape diameters")?;
            with_best(Piece { mesh, directions: &directions, blocks, out: &mut out });
            job.advance(out.len() as u64)?;
            Ok(out)
        })
        .collect();
    for (face, d) in pieces?.into_iter().flatten() {
        values[face as usize] = mesh.to_length(d);
    }
    mesh.fill_copies(&mut values);
    Ok(values)
}

/// Vogel's spiral on the disk that the cone cuts out of the plane at cos(angle/2), radius i/n (denser in the middle, so
/// that all rays weigh the same), turned by the golden angle from point to point; unit vectors about +z.
fn vogel_cone(rays: usize, angle: f64) -> Vec<[f64; 3]> {
    let (height, radius) = ((angle / 2.0).cos(), (angle / 2.0).sin());
    let golden = PI * (3.0 - 5f64.sqrt());
    let direction = |i: usize| {
        let (r, q) = (radius * i as f64 / rays as f64, i as f64 * golden);
        let length = (r * r + height * height).sqrt();
        [r * q.cos() / length, r * q.sin() / length, height / length]
    };
    (0..rays).map(direction).collect()
}

/// Two unit vectors that complete the unit vector `n` to a frame, picked as CGAL picks the base of a plane (so that the
/// same rays are shot): a coordinate axis in the plane if there is one, else the vector in the coordinate plane that
/// leaves out the smallest component of `n`. Unlike the frame of the inscribed sphere it does not turn with the mesh.
fn axis_frame(n: [f64; 3]) -> [[f64; 3]; 2] {
    let [a, b, c] = n.map(f64::abs);
    let x = match n {
        [0.0, _, _] => [1.0, 0.0, 0.0],
        [_, 0.0, _] => [0.0, 1.0, 0.0],
        [_, _, 0.0] => [0.0, 0.0, 1.0],
        _ if a <= b && a <= c => [0.0, -n[2], n[1]],
        _ if b <= a && b <= c => [-n[2], 0.0, n[0]],
        _ => [-n[1], n[0], 0.0],
    };
    let length = dot(x, x).sqrt();
    let x = x.map(|v| v / length);
    [x, cross(n, x)]
}

struct Piece<'a> {
    mesh: &'a RayMesh,
    directions: &'a [[f64; 3]],
    blocks: &'a [Block],
    out: &'a mut Vec<(u32, f64)>,
}

impl Work for Piece<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let mut stack = Stack::new();
        let mut lengths = Vec::with_capacity(self.directions.len());
        for face in self.blocks.iter().flat_map(faces_of) {
            let corners = self.mesh.corners(face);
            let centroid = std::array::from_fn(|a| (corners[0][a] + corners[1][a] + corners[2][a]) / 3.0);
            let inward = self.mesh.normals[face as usize].map(|x| -x);
            let xy = axis_frame(inward);
            lengths.clear();
            for &d in self.directions {
                let ray = (centroid, turned(d, xy, inward));
                let hit = self.mesh.nearest_hit(lanes, &mut stack, ray, (SAME_SURFACE / d[2], f64::INFINITY), face);
                // A face met from its outward side is no wall of this solid.
                lengths.extend(hit.filter(|h| h.exit).map(|h| h.t));
            }
            self.out.push((face, robust_mean(&mut lengths)));
        }
    }
}

/// Mean of the lengths within [`DEVIATIONS`] median absolute deviations of the median; NaN if there are none.
fn robust_mean(lengths: &mut [f64]) -> f64 {
    if lengths.is_empty() {
        return f64::NAN;
    }
    lengths.sort_unstable_by(f64::total_cmp);
    let median = median_of_sorted(lengths);
    let mut deviation: Vec<f64> = lengths.iter().map(|l| (l - median).abs()).collect();
    deviation.sort_unstable_by(f64::total_cmp);
    let limit = DEVIATIONS * median_of_sorted(&deviation);
    let kept = lengths.iter().filter(|l| (*l - median).abs() <= limit);
    let (sum, n) = kept.fold((0.0, 0), |(s, n), l| (s + l, n + 1));
    if n > 0 { sum / n as f64 } else { median }
}

fn median_of_sorted(v: &[f64]) -> f64 {
    let half = v.len() / 2;
    if v.len() % 2 == 1 { v[half] } else { (v[half - 1] + v[half]) / 2.0 }
}
