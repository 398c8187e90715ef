//! Spectral clustering of faces (Liu & Zhang 2004) and the number of clusters.

use super::affinity::{Graph, affinity, distances_from};
use super::kmeans::{kmeans, nearest};
use crate::error::{Result, try_filled, try_vec};
use crate::job::Job;
use crate::sparse::eigen::{leading, multiply_dense};
use rayon::prelude::*;

/// Largest number of clusters that is tried when it is not given.
pub const MOST: usize = 24;

/// Nodes in the space of the leading eigenvectors.
#[derive(Debug)]
pub struct Embedding {
    /// Leading eigenvalues of the normalised affinity, falling from 1.
    pub values: Vec<f64>,
    /// `values.len()` coordinates a node.
    pub coordinates: Vec<f64>,
    /// The nodes that clusters are formed of, the others follow.
    pub samples: Vec<u32>,
    /// Weight of every sample.
    pub mass: Vec<f64>,
}

/// All nodes of `graph` by all pairs of distances: Eq. 23 and the leading `count` eigenvectors of D^-1/2 W D^-1/2, D
/// being the row sums of the affinity W. 8 n² bytes.
pub fn embed_all(graph: &Graph, count: usize, job: &Job) -> Result<Embedding> {
    let samples: Vec<u32> = (0..graph.node_count() as u32).collect();
    let mass = try_filled(samples.len(), 1.0, "the embedding")?;
    embed(graph, samples, mass, count, job)
}

/// The same from a sample of the nodes (Nyström): W between `samples` and all nodes stands for the whole of it, every
/// sample for the area `area` of the nodes nearest to it. Memory and time in proportion to samples × nodes.
pub fn embed_sampled(graph: &Graph, samples: Vec<u32>, area: &[f64], count: usize, job: &Job) -> Result<Embedding> {
    let n = graph.node_count();
    let dist = distances_from(graph, &samples, job)?;
    let mut mass = try_filled(samples.len(), 0.0, "the embedding")?;
    for v in 0..n {
        let near = (0..samples.len()).min_by(|&a, &b| dist[a * n + v].total_cmp(&dist[b * n + v]));
        mass[near.unwrap_or(0)] += area[v];
    }
    drop(dist);
    embed(graph, samples, mass, count, job)
}

fn embed(graph: &Graph, samples: Vec<u32>, mass: Vec<f64>, count: usize, job: &Job) -> Result<Embedding> {
    let (n, m) = (graph.node_count(), samples.len());
    let whole = m == n;
    // --- Eq. 23
    let mut w = distances_from(graph, &samples, job)?;
    affinity(&mut w, n, 1.0)?;
    let mut square = Vec::new();
    if !whole {
        square = try_vec(m * m, "affinities")?;
        w.chunks(n).for_each(|row| square.extend(samples.iter().map(|&s| row[s as usize])));
    }
    let among = if whole { &mut w } else { &mut square };

    // --- symmetric normalisation, S W S with S² = M / D
    let mut scale = try_filled(m, 0.0, "the embedding")?;
    scale.par_iter_mut().zip(among.par_chunks(m.max(1))).zip(&mass).for_each(|((s, row), m)| {
        let degree: f64 = row.iter().zip(&mass).map(|(w, m)| w * m).sum();
        *s = if degree > 0.0 && *m > 0.0 { (m / degree).sqrt() } else { 0.0 };
    });
    among.par_chunks_mut(m.max(1)).zip(&scale).for_each(|(row, s)| {
        row.iter_mut().zip(&scale).for_each(|(w, t)| *w *= s * t);
    });

    // --- leading eigenvectors
    let product = |x: &[f64], width, y: &mut [f64]| {
        multiply_dense(among, m, x, width, y);
        Ok(())
    };
    let pairs = leading(m, count, product, job)?;
    let dim = pairs.values.len();
    if whole {
        return Ok(Embedding { values: pairs.values, coordinates: pairs.vectors, samples, mass });
    }
    // --- the other nodes: ψ = D^-1 W M ψ / λ, up to a factor by node, with ψ = (D M)^-1/2 v, so M ψ = S v
    let mut moved = pairs.vectors;
    for (row, s) in moved.chunks_exact_mut(dim).zip(&scale) {
        row.iter_mut().zip(&pairs.values).for_each(|(x, value)| *x *= s / value.max(1e-9));
    }
    let mut coordinates = try_filled(n * dim, 0.0, "the embedding")?;
    coordinates.par_chunks_mut(dim).enumerate().for_each(|(v, row)| {
        for (k, from) in moved.chunks_exact(dim).enumerate() {
            let w = w[k * n + v];
            row.iter_mut().zip(from).for_each(|(x, y)| *x += w * y);
        }
    });
    Ok(Embedding { values: pairs.values, coordinates, samples, mass })
}

impl Embedding {
    /// Number of nodes.
    fn len(&self) -> usize {
        self.coordinates.len() / self.values.len().max(1)
    }

    /// The first `dim` coordinates of a node, scaled to length 1.
    fn direction(&self, node: usize, dim: usize, out: &mut Vec<f64>) {
        let all = self.values.len();
        let row = &self.coordinates[node * all..node * all + dim];
        let length = row.iter().map(|x| x * x).sum::<f64>().sqrt();
        out.extend(row.iter().map(|x| if length > 0.0 { x / length } else { 0.0 }));
    }

    /// `k` clusters in the space of the first k eigenvectors: the cluster of every node.
    pub fn cluster(&self, k: usize, job: &Job) -> Result<Vec<u32>> {
        let dim = k.clamp(1, self.values.len().max(1));
        let mut points = try_vec(self.samples.len() * dim, "clusters")?;
        self.samples.iter().for_each(|&s| self.direction(s as usize, dim, &mut points));
        let found = kmeans(&points, dim, &self.mass, k, job)?;
        let label = |node: usize| {
            let mut p = Vec::with_capacity(dim);
            self.direction(node, dim, &mut p);
            nearest(&found.centre, dim, &p).0 as u32
        };
        Ok((0..self.len()).into_par_iter().map(label).collect())
    }

    /// Mean silhouette of the samples under a clustering of the nodes into `k`, by squared distances to centres
    /// ("simplified silhouette"); 0 for a single cluster.
    pub fn silhouette(&self, label: &[u32], k: usize) -> f64 {
        let dim = k.clamp(1, self.values.len().max(1));
        if k < 2 {
            return 0.0;
        }
        let mut points = Vec::new();
        self.samples.iter().for_each(|&s| self.direction(s as usize, dim, &mut points));
        let mut centre = vec![0.0; k * dim];
        let mut weight = vec![0.0; k];
        for ((p, &s), m) in points.chunks_exact(dim).zip(&self.samples).zip(&self.mass) {
            let c = label[s as usize] as usize;
            weight[c] += m;
            centre[c * dim..(c + 1) * dim].iter_mut().zip(p).for_each(|(c, x)| *c += m * x);
        }
        for (centre, w) in centre.chunks_exact_mut(dim).zip(&weight) {
            centre.iter_mut().for_each(|c| *c /= if *w > 0.0 { *w } else { 1.0 });
        }
        let gap = |p: &[f64], c: usize| -> f64 {
            centre[c * dim..(c + 1) * dim].iter().zip(p).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
        };
        let (mut sum, mut total) = (0.0, 0.0);
        for ((p, &s), m) in points.chunks_exact(dim).zip(&self.samples).zip(&self.mass) {
            let own = label[s as usize] as usize;
            let a = gap(p, own);
            let others = (0..k).filter(|&c| c != own && weight[c] > 0.0);
            let b = others.map(|c| gap(p, c)).fold(f64::INFINITY, f64::min);
            if b.is_finite() && a.max(b) > 0.0 {
                sum += m * (b - a) / a.max(b);
            }
            total += m;
        }
        if total > 0.0 { sum / total } else { 0.0 }
    }

    /// The number of clusters before the largest fall of the eigenvalues, at least 2 where there are so many: the first
    /// eigenvector is the trivial one, and the fall after it mostly the largest.
    pub fn eigengap(&self) -> usize {
        let fall = |k: usize| self.values[k - 1] - self.values[k];
        (2..self.values.len()).max_by(|&a, &b| fall(a).total_cmp(&fall(b)).then(b.cmp(&a))).unwrap_or(1)
    }
}
