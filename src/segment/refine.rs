//! A cut made better piece by piece, after Kernighan & Lin (1970) as for multicuts (Keuper et al. 2015, "Efficient
//! decomposition of image and mesh graphs by lifted multicuts").
//!
//! Greedy contraction never takes back what it has joined: two plates in an angle hang together by their ends before the
//! crease between them counts. Here a region is split, and the border between two regions moved, by a row of moves of
//! single nodes, each the best that is left though it may be a loss; of the row so much is kept as gains most.

use crate::error::{Result, try_filled, try_vec};
use crate::job::Job;
use std::cmp::Ordering;
use std::collections::{BTreeMap, BinaryHeap};

/// Rounds over all regions; two or three are usual.
const ROUNDS: usize = 6;
/// A row of moves that parts a region goes on for this long at most.
const PART: usize = 600;
/// A row of moves between two regions is so many times as long as the smaller has nodes, at most, and a little more.
const ROW: (usize, usize) = (3, 32);
/// A gain that is smaller than this share of all attraction is none.
const SLIGHT: f64 = 1e-9;

/// A graph whose edges attract or repel, by node.
struct Graph {
    first: Vec<u32>,
    around: Vec<(u32, f64)>,
}

impl Graph {
    fn new(n: usize, pulls: &[([u32; 2], f64)]) -> Result<Graph> {
        let mut all: Vec<(u32, u32, f64)> = try_vec(2 * pulls.len(), "borders of patches")?;
        all.extend(pulls.iter().flat_map(|&([a, b], w)| [(a, b, w), (b, a, w)]));
        // equal pairs stay as they were given: sums come out the same
        all.sort_by_key(|e| (e.0, e.1));
        let mut first = try_filled(n + 1, 0u32, "borders of patches")?;
        let mut around: Vec<(u32, f64)> = try_vec(all.len(), "borders of patches")?;
        for same in all.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            around.push((same[0].1, same.iter().map(|e| e.2).sum()));
            first[same[0].0 as usize + 1] += 1;
        }
        for v in 0..n {
            first[v + 1] += first[v];
        }
        Ok(Graph { first, around })
    }

    fn around(&self, v: u32) -> &[(u32, f64)] {
        &self.around[self.first[v as usize] as usize..self.first[v as usize + 1] as usize]
    }
}

/// A node and what moving it to the other side gains.
#[derive(PartialEq)]
struct Move {
    gain: f64,
    node: u32,
}

impl Eq for Move {}

impl Ord for Move {
    fn cmp(&self, other: &Move) -> Ordering {
        self.gain.total_cmp(&other.gain).then(other.node.cmp(&self.node))
    }
}

impl PartialOrd for Move {
    fn partial_cmp(&self, other: &Move) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

struct Cut<'a> {
    graph: Graph,
    region: &'a mut [u32],
    members: Vec<Vec<u32>>,
    /// Whether a region has changed since it was last looked at.
    open: Vec<bool>,
    gain: Vec<f64>,
    moved: Vec<bool>,
    slight: f64,
}

/// Betters a partition of `n` nodes by `region`, whose labels are below `n`: the sum of the `pulls` within regions grows.
/// Borders are moved and regions joined; regions are parted by what grows from one of the `seeds`, sets of nodes of which
/// those in the region of the first count.
///
/// # Errors
/// [`crate::error::Error::NoMemory`], [`crate::error::Error::Cancelled`].
pub fn refine(n: usize, pulls: &[([u32; 2], f64)], seeds: &[Vec<u32>], region: &mut [u32], job: &Job) -> Result<()> {
    let mut members: Vec<Vec<u32>> = try_filled(n, Vec::new(), "regions")?;
    region.iter().enumerate().for_each(|(v, &r)| members[r as usize].push(v as u32));
    let attraction: f64 = pulls.iter().map(|p| p.1.abs()).sum();
    let mut cut = Cut {
        graph: Graph::new(n, pulls)?,
        region,
        members,
        open: try_filled(n, true, "regions")?,
        gain: try_filled(n, 0.0, "regions")?,
        moved: try_filled(n, false, "regions")?,
        slight: SLIGHT * attraction,
    };
    for _ in 0..ROUNDS {
        job.check()?;
        let open = std::mem::replace(&mut cut.open, try_filled(n, false, "regions")?);
        let mut split = false;
        for seed in seeds {
            let Some(&first) = seed.first() else { continue };
            let own = cut.region[first as usize] as usize;
            split |= (open[own] || cut.open[own]) && cut.split(own as u32, seed);
        }
        let mut moved = false;
        for [a, b] in cut.pairs() {
            if open[a as usize] || open[b as usize] || cut.open[a as usize] || cut.open[b as usize] {
                moved |= cut.better(a, b);
            }
        }
        if !split && !moved {
            break;
        }
    }
    Ok(())
}

impl Cut<'_> {
    /// Regions that have a common border.
    fn pairs(&self) -> Vec<[u32; 2]> {
        let mut pairs: BTreeMap<[u32; 2], ()> = BTreeMap::new();
        for v in 0..self.region.len() as u32 {
            for &(u, _) in self.graph.around(v) {
                let (a, b) = (self.region[v as usize], self.region[u as usize]);
                if a < b {
                    pairs.insert([a, b], ());
                }
            }
        }
        pairs.into_keys().collect()
    }

    /// Parts what grows from a set of nodes from the rest of their region, if that gains.
    fn split(&mut self, own: u32, seed: &[u32]) -> bool {
        let seed: Vec<u32> = seed.iter().copied().filter(|&v| self.region[v as usize] == own).collect();
        let n = self.members[own as usize].len();
        let Some(new) = self.members.iter().position(Vec::is_empty).filter(|_| n > seed.len()) else { return false };
        self.row([own, new as u32], &seed, (seed.len() + PART).min(n - 1))
    }

    /// Joins two regions, or moves the border between them.
    fn better(&mut self, a: u32, b: u32) -> bool {
        let [n, m] = [a, b].map(|r| self.members[r as usize].len());
        if n == 0 || m == 0 {
            return false;
        }
        let (small, large) = if n <= m { (a, b) } else { (b, a) };
        let of = |v: &u32| self.graph.around(*v).iter().filter(|e| self.region[e.0 as usize] == large).map(|e| e.1);
        let between: f64 = self.members[small as usize].iter().flat_map(of).sum();
        if between > self.slight {
            let gone = std::mem::take(&mut self.members[small as usize]);
            gone.iter().for_each(|&v| self.region[v as usize] = large);
            self.members[large as usize].extend(gone);
            [small, large].into_iter().for_each(|r| self.open[r as usize] = true);
            return true;
        }
        self.row([a, b], &[], ROW.0 * n.min(m) + ROW.1)
    }

    /// A row of at most `most` moves between two regions, begun with those of `seed` from the first: so much of it as
    /// gains most is done.
    fn row(&mut self, [a, b]: [u32; 2], seed: &[u32], most: usize) -> bool {
        let nodes: Vec<u32> = [a, b].iter().flat_map(|&r| self.members[r as usize].iter().copied()).collect();
        let mut heap: BinaryHeap<Move> = BinaryHeap::new();
        for &v in &nodes {
            let own = self.region[v as usize];
            let other = if own == a { b } else { a };
            let (mut gain, mut border) = (0.0, false);
            for &(u, w) in self.graph.around(v) {
                let r = self.region[u as usize];
                gain += if r == other {
                    w
                } else if r == own {
                    -w
                } else {
                    0.0
                };
                border |= r == other;
            }
            self.gain[v as usize] = gain;
            self.moved[v as usize] = false;
            if border {
                heap.push(Move { gain, node: v });
            }
        }
        // --- one after the other, those of the seed whatever they gain
        let (mut sum, mut best, mut row) = (0.0, (self.slight, 0), Vec::new());
        let mut begin = seed.iter().copied();
        loop {
            let v = match begin.next() {
                Some(v) => v,
                None => match heap.pop() {
                    Some(m) if self.moved[m.node as usize] || m.gain != self.gain[m.node as usize] => continue,
                    Some(m) => m.node,
                    None => break,
                },
            };
            let gain = self.gain[v as usize];
            sum += gain;
            self.moved[v as usize] = true;
            let from = self.region[v as usize];
            let to = if from == a { b } else { a };
            self.region[v as usize] = to;
            row.push(v);
            if sum > best.0 {
                best = (sum, row.len());
            }
            if row.len() >= most {
                break;
            }
            for &(u, w) in self.graph.around(v) {
                let r = self.region[u as usize];
                if (r == a || r == b) && !self.moved[u as usize] {
                    self.gain[u as usize] += if r == to { -2.0 * w } else { 2.0 * w };
                    heap.push(Move { gain: self.gain[u as usize], node: u });
                }
            }
        }
        // --- back to where it was best
        for &v in &row[best.1..] {
            self.region[v as usize] = if self.region[v as usize] == a { b } else { a };
        }
        if best.1 == 0 {
            return false;
        }
        for r in [a, b] {
            self.members[r as usize] = nodes.iter().copied().filter(|&v| self.region[v as usize] == r).collect();
            self.open[r as usize] = true;
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is within regions.
    fn within(pulls: &[([u32; 2], f64)], region: &[u32]) -> f64 {
        pulls.iter().filter(|p| region[p.0[0] as usize] == region[p.0[1] as usize]).map(|p| p.1).sum()
    }

    #[test]
    fn a_chain_is_cut_where_it_repels_and_borders_move() {
        // two squares of four that repel each other along a side, but hang together by a fifth edge
        let square = |o: u32| [[o, o + 1], [o + 1, o + 2], [o + 2, o + 3], [o + 3, o]].map(|p| (p, 1.0));
        let mut pulls: Vec<([u32; 2], f64)> = [square(0), square(4)].concat();
        pulls.extend([([1, 4], -2.0), ([2, 7], -2.0), ([3, 6], 1.0)]);
        let mut region = vec![0; 8];
        refine(8, &pulls, &[vec![0], vec![5, 6]], &mut region, &Job::default()).unwrap();
        let of = |r: u32| (0..8).filter(|&v| region[v] == r).collect::<Vec<_>>();
        assert_eq!([of(region[0]), of(region[4])], [vec![0, 1, 2, 3], vec![4, 5, 6, 7]]);
        // one node on the wrong side, and one region too many
        let mut region = vec![0, 0, 0, 4, 4, 4, 6, 6];
        refine(8, &pulls, &[], &mut region, &Job::default()).unwrap();
        assert!(region[..4].iter().all(|r| *r == region[0]) && region[4..].iter().all(|r| *r == region[4]));
        assert_ne!(region[0], region[4]);
    }

    #[test]
    fn nothing_gets_worse() {
        let mut seed = 1u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as f64 / f64::from(1 << 31)
        };
        for n in [1u32, 2, 9, 60] {
            let pulls: Vec<([u32; 2], f64)> = (0..4 * n)
                .map(|_| ([0; 2].map(|_| (random() * f64::from(n)) as u32), random() - 0.5))
                .filter(|p| p.0[0] != p.0[1])
                .collect();
            for start in 0..3 {
                let mut region: Vec<u32> = (0..n).map(|v| [0, v, v / 2][start]).collect();
                let before = within(&pulls, &region);
                refine(n as usize, &pulls, &(0..n).map(|v| vec![v]).collect::<Vec<_>>(), &mut region, &Job::default())
                    .unwrap();
                assert!(within(&pulls, &region) >= before - 1e-9 && region.iter().all(|r| *r < n));
                let once = within(&pulls, &region);
                // nor does joining two regions
                for &[a, b] in &[[0, n / 2], [0, n - 1]] {
                    let joined: Vec<u32> =
                        region.iter().map(|&r| if r == region[a as usize] { region[b as usize] } else { r }).collect();
                    assert!(within(&pulls, &joined) <= once + 1e-6);
                }
            }
        }
    }
}
