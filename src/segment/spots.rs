//! Places spread evenly over parts of a surface, where something is measured.

use crate::mesh::measure::{Vec3, area, distance};

/// The most places of one face.
const MOST: f64 = 4096.0;
/// Steps of the plane sequence that leaves no gaps (Roberts 2018, R2): powers of the plastic number.
const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
/// Places of a face keep so many spacings from its sides, about.
const MARGIN: f64 = 0.6;

/// Places on faces, and the areas that they stand for.
#[derive(Debug, Default)]
pub struct Spots {
    /// Where.
    pub points: Vec<Vec3>,
    /// On which face.
    pub faces: Vec<u32>,
    /// The area of each.
    pub areas: Vec<f64>,
}

impl Spots {
    /// Puts places on a face, one for every area of `every` that was passed with it; `passed` is what remained from the
    /// faces of the same part before. Where they lie depends on the face's shape, not on which corner is its first.
    pub fn put(&mut self, face: u32, corner: [Vec3; 3], every: f64, passed: &mut f64) {
        *passed += area(corner);
        // also false for a NaN
        if !(every > 0.0 && *passed >= every) {
            return;
        }
        let times = (*passed / every).floor();
        *passed -= times * every;
        let count = times.min(MOST);
        let [a, b, c] = from_longest(corner);
        let share = if count > 1.0 { 1.0 - MARGIN / count.sqrt() } else { 0.0 };
        for k in 0..count as usize {
            let [u, v] = STEPS.map(|s| (0.5 + k as f64 * s).fract());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let weights = [1.0 - u - v, u, v].map(|w| 1.0 / 3.0 + share * (w - 1.0 / 3.0));
            self.points.push(std::array::from_fn(|i| weights[0] * a[i] + weights[1] * b[i] + weights[2] * c[i]));
            self.faces.push(face);
            self.areas.push(times * every / count);
        }
    }
}

/// The corners, in their order, from where the longest side begins.
fn from_longest(corner: [Vec3; 3]) -> [Vec3; 3] {
    let side = |k: usize| distance(corner[k], corner[(k + 1) % 3]);
    let first = (1..3).fold(0, |k, i| if side(i) > side(k) { i } else { k });
    [0, 1, 2].map(|i| corner[(first + i) % 3])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::measure::{cross, dot, norm, sub};

    const CORNER: [Vec3; 3] = [[0.0, 0.0, 1.0], [4.0, 0.0, 1.0], [1.0, 3.0, 1.0]];

    fn spots(corner: [Vec3; 3], count: usize) -> Spots {
        let mut out = Spots::default();
        out.put(7, corner, area(corner) / count as f64 * (1.0 - 1e-12), &mut 0.0);
        out
    }

    #[test]
    fn places_are_even_and_inside_whichever_corner_is_first() {
        for count in [1, 2, 5, 40, 900] {
            let out = spots(CORNER, count);
            assert_eq!(out.points.len(), count);
            assert!((out.areas.iter().sum::<f64>() / area(CORNER) - 1.0).abs() < 1e-9);
            let mut other = spots([CORNER[2], CORNER[0], CORNER[1]], count).points;
            let mut these = out.points.clone();
            for points in [&mut these, &mut other] {
                points.sort_by(|a, b| a[0].total_cmp(&b[0]));
            }
            assert!(these.iter().zip(&other).all(|(p, q)| distance(*p, *q) < 1e-12), "{count}");
            for p in &out.points {
                assert!((p[2] - 1.0).abs() < 1e-12);
                for k in 0..3 {
                    let (a, b) = (CORNER[k], CORNER[(k + 1) % 3]);
                    let height = dot(cross(sub(b, a), sub(*p, a)), [0.0, 0.0, 1.0]) / norm(sub(b, a));
                    assert!(height > 0.1 * (area(CORNER) / count as f64).sqrt(), "{count}: {height}");
                }
            }
        }
        // no gap: the mean of a function that is not linear, x² over the triangle with corners at x = 0, 4, 1: 3.5
        let mean = spots(CORNER, 900).points.iter().map(|p| p[0] * p[0]).sum::<f64>() / 900.0;
        assert!((mean / 3.5 - 1.0).abs() < 0.02, "{mean}");
    }

    #[test]
    fn small_faces_share_places_and_none_come_of_nothing() {
        let mut out = Spots::default();
        let mut passed = 0.5;
        (0..100).for_each(|f| out.put(f, CORNER, 10.0 * area(CORNER), &mut passed));
        assert_eq!(out.points.len(), 10);
        assert!(out.points.iter().all(|p| distance(*p, [5.0 / 3.0, 1.0, 1.0]) < 1e-12));
        for every in [0.0, f64::NAN, -1.0] {
            out.put(0, CORNER, every, &mut passed);
        }
        assert_eq!(out.points.len(), 10);
    }
}
