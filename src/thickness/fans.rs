//! The faces around each vertex, and how their normals spread: where on the surface something inside can have its
//! nearest place. Inside a face that is where the face is met squarely. On an edge or a corner that is only so where the
//! solid is concave, and then in a direction between the normals of the faces there.

use super::bvh::{RayMesh, SAME_SURFACE, dot, sub};
use super::nearest::{Feature, closest_on_triangle};
use crate::error::{Result, try_vec};
use crate::mesh::around::VertexFaces;
use rayon::prelude::*;

/// An edge is concave if the faces there rise above each other's planes by more than this (the sine of the angle).
const CONCAVE: f64 = 1e-5;

/// A face is met squarely if the cosine of the angle to its normal is more than this (0.008 degrees).
const SQUARE: f64 = 1.0 - 1e-8;

/// The normals around a vertex that something may be nearest to: their mean, and the chord on the unit sphere that all
/// are within. Negative: the solid is convex there, so nothing inside is nearest to it.
type Spread = ([f32; 3], f32);

/// Fans of more faces than this are not compared face by face.
const MANY_PAIRS: usize = 256;

/// Nothing is known of a closed fan but its faces.
const MOST_WAYS: f32 = 1.99;

/// Nothing is known.
const ALL_WAYS: f32 = 2.0;

/// Faces around vertices.
#[derive(Debug, Default)]
pub(super) struct Fans {
    around: VertexFaces,
    spread: Vec<Spread>,
}

impl Fans {
    pub fn new(points: &[[f64; 3]], triangles: &[[u32; 3]], normals: &[[f64; 3]]) -> Result<Fans> {
        let around = VertexFaces::new(points.len(), triangles)?;
        let mut spread = try_vec(points.len(), "normals around vertices")?;
        (0..points.len() as u32)
            .into_par_iter()
            .map(|v| spread_at(v, around.of(v), points, triangles, normals))
            .collect_into_vec(&mut spread);
        Ok(Fans { around, spread })
    }

    #[inline(always)]
    fn chord(&self, vertex: u32) -> f32 {
        self.spread[vertex as usize].1
    }
}

fn spread_at(v: u32, fan: &[u32], points: &[[f64; 3]], triangles: &[[u32; 3]], normals: &[[f64; 3]]) -> Spread {
    // In a closed fan each neighbour follows once and precedes once.
    let others = |f: u32| {
        let [a, b, c] = triangles[f as usize];
        if a == v {
            [b, c]
        } else if b == v {
            [c, a]
        } else {
            [a, b]
        }
    };
    let mixed = |v: u32| {
        let x = (v as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        (x ^ x >> 29).wrapping_mul(0xBF58_476D_1CE4_E5B9)
    };
    let balance = fan
        .iter()
        .map(|&f| others(f))
        .fold(0u64, |sum, [next, previous]| sum.wrapping_add(mixed(next)).wrapping_sub(mixed(previous)));
    if balance != 0 {
        return ([0.0; 3], ALL_WAYS);
    }
    let p = points[v as usize];
    let sum = fan.iter().fold([0.0; 3], |sum, &f| std::array::from_fn(|a| sum[a] + normals[f as usize][a]));
    let length = dot(sum, sum).sqrt();
    let axis = sum.map(|x| x / length);
    let rim = || fan.iter().map(|&f| sub(points[others(f)[0] as usize], p));
    let steep = |w: [f64; 3], rise: f64| rise * rise > CONCAVE * CONCAVE * dot(w, w);
    if fan.len() > MANY_PAIRS {
        // the middle of a round end face is flat
        let flat = length > 1e-6 && !rim().any(|w| steep(w, dot(w, axis)));
        return ([0.0; 3], if flat { -1.0 } else { MOST_WAYS });
    }
    let rises = |w: [f64; 3], rise: f64| rise > 0.0 && steep(w, rise);
    if !fan.iter().any(|&f| rim().any(|w| rises(w, dot(w, normals[f as usize])))) {
        return ([0.0; 3], -1.0);
    }
    if !(length > 1e-6) {
        return ([0.0; 3], ALL_WAYS);
    }
    let solid = fan.iter().map(|&f| normals[f as usize]).filter(|n| *n != [0.0; 3]);
    let chord2 = solid.map(|n| dot(sub(n, axis), sub(n, axis))).fold(0.0, f64::max);
    (axis.map(|x| x as f32), chord2.sqrt() as f32)
}

/// Whether a point is outside the box of a triangle by more than what counts as the same surface.
#[inline(always)]
fn is_beside(q: [f64; 3], [a, b, c]: [[f64; 3]; 3]) -> bool {
    (0..3).any(|k| {
        let (lo, hi) = (a[k].min(b[k]).min(c[k]), a[k].max(b[k]).max(c[k]));
        q[k] < lo - SAME_SURFACE || q[k] > hi + SAME_SURFACE
    })
}

impl RayMesh {
    /// The chord from `axis` within which are the directions from which something inside can be nearest to a place of
    /// the face, as directions of normals.
    pub(super) fn spread_about(&self, face: u32, axis: [f64; 3]) -> f64 {
        let off = |n: [f64; 3]| dot(sub(n, axis), sub(n, axis)).sqrt();
        self.triangles[face as usize].iter().fold(off(self.normals[face as usize]), |most, &v| {
            let (mean, chord) = self.fans.spread[v as usize];
            if chord < 0.0 { most } else { most.max(off(mean.map(f64::from)) + f64::from(chord)) }
        })
    }

    /// Whether the surface around `q`, the place of a face that is nearest to `c`, leads nowhere nearer: `q` lies on the
    /// given feature of the face, in the direction `up` and at the distance `d`.
    #[inline(always)]
    pub(super) fn is_nearest(
        &self,
        c: [f64; 3],
        (q, feature): ([f64; 3], Feature),
        face: u32,
        up: [f64; 3],
        d: f64,
    ) -> bool {
        if feature == Feature::Inside || dot(up, self.normals[face as usize]).abs() > SQUARE {
            return true;
        }
        let t = self.triangles[face as usize];
        let ends = match feature {
            Feature::Edge(k) => [t[k as usize], t[(k as usize + 1) % 3]],
            Feature::Corner(k) => [t[k as usize]; 2],
            Feature::Inside => return true,
        };
        let chords = ends.map(|v| self.fans.chord(v));
        if chords[0] < 0.0 || chords[1] < 0.0 {
            return false;
        }
        self.is_nearest_around(c, q, ends, (up, d), chords)
    }

    fn is_nearest_around(
        &self,
        c: [f64; 3],
        q: [f64; 3],
        ends: [u32; 2],
        (up, d): ([f64; 3], f64),
        chords: [f32; 2],
    ) -> bool {
        let limit = d * (1.0 - 1e-9);
        let leads_nearer = |face: u32| {
            let n = self.normals[face as usize];
            let corners = self.corners(face);
            // A face at the corner, or on the edge, leads nearer only if another of its corners is on the side of `c`.
            let t = self.triangles[face as usize];
            let meets = ends.iter().all(|end| t.contains(end));
            let is_ahead = |k: usize| !ends.contains(&t[k]) && dot(sub(corners[k], q), up) > 0.0;
            if meets && !(0..3).any(is_ahead) {
                return false;
            }
            if n == [0.0; 3] || dot(sub(q, corners[0]), n).abs() > SAME_SURFACE || is_beside(q, corners) {
                return false;
            }
            let away = sub(c, closest_on_triangle(c, corners));
            let off = sub(q, closest_on_triangle(q, corners));
            dot(away, away) < limit * limit && dot(off, off) < SAME_SURFACE * SAME_SURFACE
        };
        if chords[0] >= ALL_WAYS || chords[1] >= ALL_WAYS {
            return !self.any_face_at(q, leads_nearer);
        }
        // the faces on both sides of an edge are the likely ones
        let across = |&&f: &&u32| self.triangles[f as usize].contains(&ends[1]);
        if ends[0] != ends[1] && self.fans.around.of(ends[0]).iter().filter(across).any(|&f| leads_nearer(f)) {
            return false;
        }
        let count = if ends[0] == ends[1] { 1 } else { 2 };
        !ends[..count].iter().any(|&v| self.fans.around.of(v).iter().any(|&f| leads_nearer(f)))
    }
}
