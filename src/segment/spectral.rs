//! Spectral embedding and the number of clusters.

use super::kmeans::{Clusters, kmeans};
use crate::error::{Result, try_filled};
use crate::job::Job;
use crate::sparse::eigen::{Eigenpairs, leading, multiply_dense};
use rayon::prelude::*;

/// The leading eigenpairs of D^-1/2 W D^-1/2, D being the row sums of the affinity `w` (n × n, weighted by the nodes'
/// `mass`): the symmetric normalisation of Liu & Zhang 2004. Destroys `w`.
pub fn embedding(w: &mut [f64], mass: &[f64], count: usize, job: &Job) -> Result<Eigenpairs> {
    let n = mass.len();
    let mut scale = try_filled(n, 0.0, "the embedding")?;
    scale.par_iter_mut().zip(w.par_chunks(n.max(1))).zip(mass).for_each(|((s, row), m)| {
        let degree: f64 = row.iter().zip(mass).map(|(w, m)| w * m).sum();
        // D^-1/2 M^1/2 W M^1/2 D^-1/2, symmetric for any masses
        *s = if degree > 0.0 { (m / degree).sqrt() } else { 0.0 };
    });
    w.par_chunks_mut(n.max(1)).zip(&scale).for_each(|(row, s)| {
        row.iter_mut().zip(&scale).for_each(|(w, t)| *w *= s * t);
    });
    leading(n, count, |x, width, y| Ok(multiply_dense(w, n, x, width, y)), job)
}

/// The first `dim` coordinates of every node, scaled to length 1.
pub fn directions(pairs: &Eigenpairs, dim: usize) -> Vec<f64> {
    let all = pairs.values.len();
    let dim = dim.min(all);
    let mut out = Vec::with_capacity(pairs.vectors.len() / all.max(1) * dim);
    for row in pairs.vectors.chunks_exact(all.max(1)) {
        let length = row[..dim].iter().map(|x| x * x).sum::<f64>().sqrt();
        out.extend(row[..dim].iter().map(|x| if length > 0.0 { x / length } else { 0.0 }));
    }
    out
}

/// k clusters of the nodes in the space of the first k eigenvectors.
pub fn cluster(pairs: &Eigenpairs, mass: &[f64], k: usize, job: &Job) -> Result<Clusters> {
    let dim = k.min(pairs.values.len()).max(1);
    kmeans(&directions(pairs, dim), dim, mass, k, job)
}
