//! A mesh of fewer faces that stands in for another, and where the other's vertices lie on it.
//!
//! D1 is a length across the whole part: it hardly changes when threads of a hole and facets of a fillet are cut down to
//! a few triangles, while the work does. The place of a vertex is looked for from the vertex that it went into, from
//! triangle to neighbouring triangle, and so never ends up on the other side of a thin wall.

use super::measure::{Vec3, corners};
use super::simplify::{Simplified, SimplifyOptions, nearest_in_triangle, simplify};
use super::NONE;
use crate::error::{Result, try_filled, try_vec};
use crate::job::Job;
use rayon::prelude::*;

/// Steps from triangle to triangle at most, on the way to the nearest.
const STEPS: usize = 64;

/// A point of a triangle mesh: a face and barycentric coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Index of the face; [`NONE`] for a vertex that no face used.
    pub face: u32,
    /// Barycentric coordinates, in the order of the face's corners.
    pub weights: [f64; 3],
}

/// The mesh that stands in.
#[derive(Debug, Clone, PartialEq)]
pub struct Proxy {
    /// Positions of its vertices, some of the original's.
    pub positions: Vec<Vec3>,
    /// Its triangles.
    pub triangles: Vec<[u32; 3]>,
    /// For each of its vertices that of the original.
    pub original: Vec<u32>,
    /// For each vertex of the original the vertex of this mesh that it went into; [`NONE`] if no face used it.
    pub onto: Vec<u32>,
}

impl Proxy {
    /// Simplifies a mesh; see [`simplify`].
    ///
    /// # Errors
    /// Those of [`simplify`].
    pub fn new(positions: &[Vec3], triangles: &[[u32; 3]], options: &SimplifyOptions, job: &Job) -> Result<Proxy> {
        let Simplified { triangles, onto } = simplify(positions, triangles, options, job)?;
        let mut number = try_filled(positions.len(), NONE, "proxy")?;
        let mut original = Vec::new();
        let mut used = try_filled(positions.len(), false, "proxy")?;
        triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
        for v in (0..positions.len() as u32).filter(|&v| used[v as usize]) {
            number[v as usize] = original.len() as u32;
            original.push(v);
        }
        Ok(Proxy {
            positions: original.iter().map(|&v| positions[v as usize]).collect(),
            triangles: triangles.iter().map(|t| t.map(|v| number[v as usize])).collect(),
            onto: onto.iter().map(|&v| number[v as usize]).collect(),
            original,
        })
    }
}

/// For every point its nearest place on a mesh as far as a walk from vertex `from[i]` of it finds it.
///
/// # Errors
/// [`crate::error::Error::NoMemory`], [`crate::error::Error::Cancelled`].
pub fn places(
    points: &[Vec3],
    from: &[u32],
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    job: &Job,
) -> Result<Vec<Place>> {
    // faces by vertex
    let mut first = try_filled(positions.len() + 1, 0u32, "proxy")?;
    triangles.iter().flatten().for_each(|&v| first[v as usize + 1] += 1);
    for v in 0..positions.len() {
        first[v + 1] += first[v];
    }
    let mut fill = try_vec(positions.len(), "proxy")?;
    fill.extend_from_slice(&first[..positions.len()]);
    let mut faces = try_filled(3 * triangles.len(), 0u32, "proxy")?;
    for (f, t) in triangles.iter().enumerate() {
        for &v in t {
            faces[fill[v as usize] as usize] = f as u32;
            fill[v as usize] += 1;
        }
    }
    let of = |v: u32| &faces[first[v as usize] as usize..first[v as usize + 1] as usize];
    let walk = |(&p, &start): (&Vec3, &u32)| {
        let mut best = (Place { face: NONE, weights: [0.0; 3] }, f64::INFINITY);
        if start == NONE {
            return best.0;
        }
        if let (true, Some(&face)) = (positions[start as usize] == p, of(start).first()) {
            return Place { face, weights: triangles[face as usize].map(|v| f64::from(u8::from(v == start))) };
        }
        let look = |best: &mut (Place, f64), v: u32| {
            for &face in of(v) {
                let (weights, squared) = nearest_in_triangle(corners(positions, triangles[face as usize]), p);
                if squared < best.1 {
                    *best = (Place { face, weights }, squared);
                }
            }
        };
        look(&mut best, start);
        let mut from = NONE;
        for _ in 0..STEPS {
            if best.0.face == from || best.0.face == NONE {
                break;
            }
            from = best.0.face;
            for v in triangles[from as usize] {
                look(&mut best, v);
            }
        }
        best.0
    };
    job.check()?;
    Ok(points.par_iter().zip(from).map(walk).collect())
}
