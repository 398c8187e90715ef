//! Directions: rays in a cone about the inward normal.

use super::bvh::{cross, dot, sub};
use crate::error::{Error, Result};
use std::f64::consts::PI;

/// Default number of rays (the paper's m).
pub const RAYS: usize = 20;

/// Default full opening angle in radians, 120 degrees (Shapira 2008; the paper does not state one).
pub const ANGLE: f64 = 2.0 * PI / 3.0;

/// Unit vectors in a cone about +z.
#[derive(Debug, Clone)]
pub struct Cone {
    directions: Vec<[f64; 3]>,
}

impl Cone {
    /// `count` directions within `angle`/2 of +z, spread evenly over the solid angle: the axis first, then for
    /// k = 1 .. count-1
    ///
    /// > cos(theta_k) = 1 - (1 - cos(angle/2)) (k + 1/2) / count, phi_k = k pi (3 - sqrt 5).
    ///
    /// # Errors
    /// [`Error::Argument`] unless 1 <= `count` <= 4096 and 0 < `angle` < pi.
    pub fn new(count: usize, angle: f64) -> Result<Cone> {
        if !(1..=4096).contains(&count) {
            return Err(Error::Argument(format!("number of rays {count} is not in 1..4096")));
        }
        if !(angle > 0.0 && angle < PI) {
            return Err(Error::Argument(format!("cone angle {angle} is not between 0 and pi")));
        }
        let cap = 1.0 - (angle / 2.0).cos();
        let golden = PI * (3.0 - 5f64.sqrt());
        let directions = (0..count).map(|k| {
            let z = if k == 0 { 1.0 } else { 1.0 - cap * (k as f64 + 0.5) / count as f64 };
            let r = (1.0 - z * z).max(0.0).sqrt();
            let phi = k as f64 * golden;
            [r * phi.cos(), r * phi.sin(), z]
        });
        Ok(Cone { directions: directions.collect() })
    }

    /// The directions, the axis first; z is the cosine of the angle to the axis.
    pub fn directions(&self) -> &[[f64; 3]] {
        &self.directions
    }
}

/// Two unit vectors that complete the unit vector `n` to a right-handed frame (x, y, n), x along the edge of the
/// triangle that its shape singles out: the longest, or the shortest when the two longest are nearly as long as each
/// other. So the frame turns with the triangle and does not depend on where its corner list begins (an equilateral
/// triangle, which singles out none, takes the first edge in the order of the coordinates).
pub(super) fn frame(corners: [[f64; 3]; 3], n: [f64; 3]) -> [[f64; 3]; 2] {
    let mut edges = [0, 1, 2].map(|k| {
        let e = sub(corners[(k + 1) % 3], corners[k]);
        (dot(e, e).sqrt(), e, corners[k])
    });
    // Lengths that agree but for rounding are ordered by position.
    let size = edges[0].0.max(edges[1].0).max(edges[2].0);
    edges.sort_by(|a, b| if (a.0 - b.0).abs() <= 1e-9 * size { lexicographic(a.2, b.2) } else { a.0.total_cmp(&b.0) });
    let [short, middle, long] = edges.map(|e| e.0);
    let x = if long - middle >= 0.37 * (middle - short) { edges[2].1 } else { edges[0].1 };
    let x = super::bvh::along(x, -dot(x, n), n);
    let length = dot(x, x).sqrt();
    let x = if length > 0.0 { x.map(|v| v / length) } else { any_normal_to(n) };
    [x, cross(n, x)]
}

/// Some unit vector normal to the unit vector `n`.
pub(super) fn any_normal_to(n: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = n.map(f64::abs);
    let a = if x <= y && x <= z {
        [1.0, 0.0, 0.0]
    } else if y <= z {
        [0.0, 1.0, 0.0]
    } else {
        [0.0, 0.0, 1.0]
    };
    let v = cross(n, a);
    let length = dot(v, v).sqrt();
    v.map(|c| c / length)
}

fn lexicographic(a: [f64; 3], b: [f64; 3]) -> std::cmp::Ordering {
    a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])).then(a[2].total_cmp(&b[2]))
}

/// `d` given in the frame (x, y, n), in world coordinates.
#[inline(always)]
pub(super) fn turned(d: [f64; 3], [x, y]: [[f64; 3]; 2], n: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|a| (d[0] * x[a] + d[1] * y[a]) + d[2] * n[a])
}
