//! Volumetric shape images: what a part looks like from inside (Eqs. 17-21).
//!
//! The image of a face is taken from the centre of its inscribed sphere: the lengths of 50 chords through it, in
//! directions that are the same for all faces.

use crate::error::Result;
use crate::job::Job;
use crate::mesh::measure::{Vec3, add, scale};
use crate::thickness::bvh::RayMesh;
use crate::thickness::chords::chords;
use std::f64::consts::PI;

/// Chords a face: 100 rays in 50 opposite pairs.
pub const PAIRS: usize = 50;

/// Chord lengths by face, model units.
#[derive(Debug)]
pub struct Images {
    lengths: Vec<f32>,
}

/// Directions spread evenly over half a sphere; with their opposites they cover the sphere.
fn directions() -> [Vec3; PAIRS] {
    let golden = PI * (3.0 - 5f64.sqrt());
    std::array::from_fn(|k| {
        let z = 1.0 - (k as f64 + 0.5) / PAIRS as f64;
        let (r, phi) = ((1.0 - z * z).sqrt(), k as f64 * golden);
        [r * phi.cos(), r * phi.sin(), z]
    })
}

impl Images {
    /// Images of points on the surface: `centroid` and outward unit `normal` of faces, and the diameter `width` of the
    /// sphere that touches there (NaN: the surface is open; the image is taken from just below the face). Reports one
    /// unit a face to `job`.
    ///
    /// # Errors
    /// Those of [`chords`].
    pub fn new(rays: &RayMesh, centroid: &[Vec3], normal: &[Vec3], width: &[f64], job: &Job) -> Result<Images> {
        // --- r_i, the centre of the inscribed sphere
        let eyes: Vec<Vec3> = (0..centroid.len())
            .map(|i| {
                let depth = if width[i].is_finite() { 0.5 * width[i] } else { 0.0 };
                add(centroid[i], scale(normal[i], -depth))
            })
            .collect();
        // --- Eqs. 17 and 19: l^k = |S^(2k-1) - S^(2k)|
        Ok(Images { lengths: chords(rays, &eyes, &directions(), job)? })
    }

    /// The chords of face `i`.
    pub fn of(&self, i: usize) -> &[f32] {
        &self.lengths[i * PAIRS..(i + 1) * PAIRS]
    }

    /// Eqs. 18, 20 and 21: difference of two images, squared model units. Chords that leave an open surface are left
    /// out; 0 if none is left.
    pub fn distance(&self, i: usize, j: usize) -> f64 {
        let mut d = [0.0f64; PAIRS];
        let mut n = 0;
        for (a, b) in self.of(i).iter().zip(self.of(j)) {
            let difference = f64::from(a - b);
            if difference.is_finite() {
                d[n] = difference * difference; // Eq. 21
                n += 1;
            }
        }
        if n == 0 {
            return 0.0;
        }
        let mean = d[..n].iter().sum::<f64>() / n as f64;
        let variance = d[..n].iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n as f64;
        if variance <= 0.0 {
            return mean;
        }
        let (mut sum, mut weights) = (0.0, 0.0);
        for x in d[..n].iter().filter(|x| **x < mean + 2.0 * variance.sqrt()) {
            let w = (-(x - mean).powi(2) / (2.0 * variance)).exp(); // Eq. 20
            sum += w * x;
            weights += w;
        }
        sum / weights // Eq. 18; some d is at or below the mean, so weights > 0
    }
}
