//! From steps between neighbours to an affinity between all pairs (Eqs. 22 and 23).

use crate::error::{Result, try_filled, try_vec};
use crate::job::Job;
use rayon::prelude::*;
use std::collections::BinaryHeap;

/// The shares of the three distances in a step's weight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shares {
    /// α, of the geodesic distance.
    pub geodesic: f64,
    /// β, of the angular distance.
    pub angular: f64,
    /// γ, of the volumetric shape image's distance.
    pub volumetric: f64,
    /// ε in the angular distance of convex edges.
    pub epsilon: f64,
}

/// --- Eq. 22 with each term divided by its mean over the steps: lengths, angles and squared lengths cannot be added
/// otherwise, and the result would depend on the part's size. The slices have one number a step.
pub fn step_weights(geodesic: &[f64], angular: &[f64], volumetric: &[f64], shares: &Shares) -> Vec<f64> {
    let share = |share: f64, terms: &[f64]| {
        let mean = terms.iter().sum::<f64>() / terms.len().max(1) as f64;
        if mean > 0.0 { share / mean } else { 0.0 }
    };
    let (g, a) = (share(shares.geodesic, geodesic), share(shares.angular, angular));
    let v = share(shares.volumetric, volumetric);
    (0..geodesic.len()).map(|k| g * geodesic[k] + a * angular[k] + v * volumetric[k]).collect()
}

/// An undirected graph with weighted edges.
#[derive(Debug)]
pub struct Graph {
    first: Vec<u32>,
    around: Vec<(u32, f64)>,
}

impl Graph {
    /// A graph of `n` nodes.
    pub fn new(n: usize, edges: &[([u32; 2], f64)]) -> Result<Graph> {
        let mut first = try_filled(n + 1, 0u32, "a graph")?;
        for v in edges.iter().flat_map(|e| e.0) {
            first[v as usize + 1] += 1;
        }
        for v in 0..n {
            first[v + 1] += first[v];
        }
        let mut next = first.clone();
        let mut around = try_filled(2 * edges.len(), (0, 0.0), "a graph")?;
        for &([a, b], w) in edges {
            for (a, b) in [(a, b), (b, a)] {
                around[next[a as usize] as usize] = (b, w);
                next[a as usize] += 1;
            }
        }
        Ok(Graph { first, around })
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.first.len() - 1
    }

    /// Neighbours of a node and the weights of the edges to them.
    pub fn around(&self, node: u32) -> &[(u32, f64)] {
        &self.around[self.first[node as usize] as usize..self.first[node as usize + 1] as usize]
    }

    /// Shortest distances from `source` to all nodes; infinite where there is no way.
    pub fn distances(&self, source: u32, out: &mut [f64], heap: &mut BinaryHeap<Near>) {
        out.fill(f64::INFINITY);
        out[source as usize] = 0.0;
        heap.clear();
        heap.push(Near(0.0, source));
        self.settle(out, heap);
    }

    /// Lowers the distances `out` of all nodes by way of those on the heap, which it empties.
    pub fn settle(&self, out: &mut [f64], heap: &mut BinaryHeap<Near>) {
        while let Some(Near(d, v)) = heap.pop() {
            if d > out[v as usize] {
                continue;
            }
            for &(u, w) in self.around(v) {
                if d + w < out[u as usize] {
                    out[u as usize] = d + w;
                    heap.push(Near(d + w, u));
                }
            }
        }
    }
}

/// A heap entry: the nearest comes out first, the lower node of equals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Near(pub f64, pub u32);

impl Eq for Near {}

impl Ord for Near {
    fn cmp(&self, other: &Near) -> std::cmp::Ordering {
        other.0.total_cmp(&self.0).then(other.1.cmp(&self.1))
    }
}

impl PartialOrd for Near {
    fn partial_cmp(&self, other: &Near) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

/// Dist: shortest distances from every source to all nodes, a row of `graph.node_count()` numbers a source.
pub fn distances_from(graph: &Graph, sources: &[u32], job: &Job) -> Result<Vec<f64>> {
    let n = graph.node_count();
    let mut dist = try_filled(sources.len() * n, 0.0, "distances between faces")?;
    dist.par_chunks_mut(n.max(1)).zip(sources).try_for_each_init(BinaryHeap::new, |heap, (row, &source)| {
        graph.distances(source, row, heap);
        job.check()
    })?;
    Ok(dist)
}

/// --- Eq. 23, in place: W = exp(-Dist / 2σ²) where Dist is first divided by its mean, so that it has no unit and σ, its
/// mean, is 1; `width` scales σ. `dist` has rows of `n` numbers. Pairs without a way between them get 0.
pub fn affinity(dist: &mut [f64], n: usize, width: f64) -> Result<()> {
    let mut rows = try_vec(dist.len() / n.max(1), "affinities")?;
    dist.par_chunks(n.max(1))
        .map(|row| row.iter().filter(|d| d.is_finite()).fold((0.0, 0u64), |(s, k), d| (s + d, k + 1)))
        .collect_into_vec(&mut rows);
    let (sum, count) = rows.iter().fold((0.0, 0), |(s, k), r| (s + r.0, k + r.1));
    let mean = if sum > 0.0 { sum / count as f64 } else { 1.0 };
    let factor = -1.0 / (2.0 * width * width * mean);
    dist.par_iter_mut().for_each(|d| *d = (*d * factor).exp());
    Ok(())
}
