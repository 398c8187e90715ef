//! k-means with k-means++ seeding from a fixed seed and restarts.

use crate::error::Result;
use crate::job::Job;
use rayon::prelude::*;

/// Independent starts, of which the best is kept.
const RESTARTS: u64 = 6;
/// Rounds of assigning points and moving centres.
const ROUNDS: usize = 40;

/// A partition of points.
#[derive(Debug, Clone, PartialEq)]
pub struct Clusters {
    /// Cluster of every point, below `k`; clusters may be empty when points coincide.
    pub label: Vec<u32>,
    /// Sum over points of weight × squared distance to the cluster's centre.
    pub inertia: f64,
    /// The clusters' centres, `dim` numbers each.
    pub centre: Vec<f64>,
}

/// Partitions the rows of `points` (`dim` numbers each, weighted by `weight`) into at most `k` clusters. The same on any
/// number of threads.
///
/// # Errors
/// [`crate::error::Error::Cancelled`].
pub fn kmeans(points: &[f64], dim: usize, weight: &[f64], k: usize, job: &Job) -> Result<Clusters> {
    let runs: Vec<Clusters> = (0..RESTARTS)
        .into_par_iter()
        .map(|seed| {
            job.check()?;
            Ok(run(points, dim, weight, k.max(1), seed))
        })
        .collect::<Result<_>>()?;
    let best = runs.into_iter().reduce(|a, b| if b.inertia < a.inertia { b } else { a });
    Ok(best.unwrap_or(Clusters { label: Vec::new(), inertia: 0.0, centre: Vec::new() }))
}

fn run(points: &[f64], dim: usize, weight: &[f64], k: usize, seed: u64) -> Clusters {
    let mut centres = plus_plus(points, dim, weight, k, seed);
    let mut label = vec![0u32; weight.len()];
    let mut inertia = f64::INFINITY;
    for _ in 0..ROUNDS {
        let mut sums = vec![0.0; centres.len()];
        let mut mass = vec![0.0; centres.len() / dim.max(1)];
        let mut total = 0.0;
        for ((p, &w), label) in points.chunks_exact(dim).zip(weight).zip(&mut label) {
            let (c, d) = nearest(&centres, dim, p);
            *label = c as u32;
            total += w * d;
            mass[c] += w;
            sums[c * dim..(c + 1) * dim].iter_mut().zip(p).for_each(|(s, x)| *s += w * x);
        }
        for ((centre, sum), &m) in centres.chunks_exact_mut(dim).zip(sums.chunks_exact(dim)).zip(&mass) {
            if m > 0.0 {
                centre.iter_mut().zip(sum).for_each(|(c, s)| *c = s / m);
            }
        }
        let settled = total >= inertia * (1.0 - 1e-7);
        inertia = total;
        if settled {
            break;
        }
    }
    Clusters { label, inertia, centre: centres }
}

/// The nearest centre and the squared distance to it.
pub fn nearest(centres: &[f64], dim: usize, p: &[f64]) -> (usize, f64) {
    let mut best = (0, f64::INFINITY);
    for (c, centre) in centres.chunks_exact(dim).enumerate() {
        let d = squared(centre, p);
        if d < best.1 {
            best = (c, d);
        }
    }
    best
}

fn squared(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum()
}

/// Arthur & Vassilvitskii 2007: the next centre is a point drawn with probability weight × squared distance to the
/// centres so far.
fn plus_plus(points: &[f64], dim: usize, weight: &[f64], k: usize, seed: u64) -> Vec<f64> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(0xA5A5_1234);
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut chance: Vec<f64> = weight.to_vec();
    let mut gap = vec![f64::INFINITY; weight.len()];
    let mut centres = Vec::with_capacity(k * dim);
    for _ in 0..k.min(weight.len()) {
        let total: f64 = chance.iter().sum();
        if !(total > 0.0) {
            break;
        }
        let mut left = uniform() * total;
        let last = chance.iter().rposition(|c| *c > 0.0).unwrap_or(0);
        let pick = chance.iter().position(|c| {
            left -= c;
            left < 0.0
        });
        let pick = pick.unwrap_or(last);
        centres.extend_from_slice(&points[pick * dim..(pick + 1) * dim]);
        let new = &points[pick * dim..(pick + 1) * dim];
        for ((p, gap), (chance, w)) in points.chunks_exact(dim).zip(&mut gap).zip(chance.iter_mut().zip(weight)) {
            *gap = gap.min(squared(new, p));
            *chance = w * *gap;
        }
    }
    if centres.is_empty() {
        centres.resize(dim, 0.0);
    }
    centres
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::CancelToken;

    #[test]
    fn separate_heaps_are_found_and_coinciding_points_do_no_harm() {
        let job = Job::new(1, None, CancelToken::default());
        let points: Vec<f64> =
            (0..60).flat_map(|i| [(i % 3) as f64 * 10.0 + (i as f64 * 0.7).sin(), (i as f64).cos()]).collect();
        let out = kmeans(&points, 2, &[1.0; 60], 3, &job).unwrap();
        assert!((0..60).all(|i| out.label[i] == out.label[i % 3]));
        assert!(out.label[0] != out.label[1] && out.label[1] != out.label[2] && out.label[0] != out.label[2]);
        let same = kmeans(&[1.0; 20], 2, &[1.0; 10], 4, &job).unwrap();
        assert!(same.inertia == 0.0 && same.label.iter().all(|l| *l == same.label[0]));
    }
}
