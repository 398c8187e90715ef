//! A cut made better piece by piece, after Kernighan & Lin (1970) as for multicuts (Keuper et al. 2015, "Efficient
//! decomposition of image and mesh graphs by lifted multicuts").
//!
//! Greedy contraction never takes back what it has joined: two plates in an angle hang together by their ends before the
//! crease between them counts. Here a region is split, and the border between two regions moved, by a row of moves of
//! single nodes, each the best that is left though it may be a loss; of the row so much is kept as gains most.

use super::affinity::Graph;
use super::cut::pair;
use super::queue::Queue;
use crate::error::{Result, try_filled, try_push, try_vec};
use crate::job::Job;
use crate::mesh::NONE;
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

/// Rounds over all regions; two or three are usual.
const ROUNDS: usize = 6;
/// A row of moves that parts a region goes on for this long at most.
const PART: usize = 600;
/// A row of moves between two regions is so many times as long as the smaller has nodes, at most, and a little more.
const ROW: (usize, usize) = (3, 32);
/// A gain that is smaller than this share of all attraction is none.
const SLIGHT: f64 = 1e-9;
/// Rows are tried so many at a time, side by side: most gain nothing.
const AHEAD: usize = 32;

/// The graph of pairs that attract or repel each other, each pair once, by rising node.
fn graph(n: usize, pulls: &[([u32; 2], f64)]) -> Result<Graph> {
    let mut all: Vec<([u32; 2], f64)> = try_vec(pulls.len(), "borders of patches")?;
    all.extend(pulls.iter().map(|&([a, b], w)| (pair(a, b), w)));
    // equal pairs stay as they were given: sums come out the same
    all.sort_by_key(|t| t.0);
    all.dedup_by(|next, first| {
        let same = next.0 == first.0;
        first.1 += if same { next.1 } else { 0.0 };
        same
    });
    Graph::new(n, &all)
}

/// What a row knows of a node.
#[derive(Clone, Copy)]
struct Seen {
    /// The row that this is of.
    row: u32,
    moved: bool,
    gain: f64,
}

/// Room for a row of moves.
struct Scratch {
    seen: Vec<Seen>,
    row: u32,
    /// What may be moved next.
    queue: Queue<()>,
    moves: Vec<u32>,
}

impl Scratch {
    fn new(n: usize) -> Result<Scratch> {
        let seen = try_filled(n, Seen { row: 0, moved: false, gain: 0.0 }, "regions")?;
        Ok(Scratch { seen, row: 0, queue: Queue::new(n)?, moves: try_vec(n, "regions")? })
    }
}

/// A row of moves to be tried.
#[derive(Clone, Copy)]
enum Try<'a> {
    /// What grows from these nodes of a region is parted from it.
    Part(&'a [u32]),
    /// The border between two regions is moved, or they are joined.
    Between([u32; 2]),
}

struct Cut<'a> {
    graph: Graph,
    region: &'a mut [u32],
    /// What parting a node from its region gains.
    parting: Vec<f64>,
    members: Vec<Vec<u32>>,
    /// Whether a region has changed since it was last looked at.
    open: Vec<bool>,
    /// Number of changes so far, and at the last one of every region.
    changes: u32,
    changed: Vec<u32>,
    /// No region below this is empty.
    full: usize,
    slight: f64,
    /// Room for rows that nobody uses now.
    rooms: Mutex<Vec<Scratch>>,
}

/// Betters a partition of `n` nodes by `region`, whose labels are below `n`: the sum of the `pulls` within regions grows.
/// Borders are moved and regions joined; regions are parted by what grows from one of the `seeds`, sets of nodes of which
/// those in the region of the first count. Between the regions in `apart`, lower label first, nothing is moved.
///
/// # Errors
/// [`crate::error::Error::NoMemory`], [`crate::error::Error::Cancelled`].
pub fn refine(
    n: usize,
    pulls: &[([u32; 2], f64)],
    seeds: &[Vec<u32>],
    apart: &BTreeSet<[u32; 2]>,
    region: &mut [u32],
    job: &Job,
) -> Result<()> {
    let mut members: Vec<Vec<u32>> = try_filled(n, Vec::new(), "regions")?;
    for (v, &r) in region.iter().enumerate() {
        try_push(&mut members[r as usize], v as u32, "regions")?;
    }
    let attraction: f64 = pulls.iter().map(|p| p.1.abs()).sum();
    let mut cut = Cut {
        graph: graph(n, pulls)?,
        region,
        parting: try_filled(n, 0.0, "regions")?,
        members,
        open: try_filled(n, true, "regions")?,
        changes: 0,
        changed: try_filled(n, 0, "regions")?,
        full: 0,
        slight: SLIGHT * attraction,
        rooms: Mutex::default(),
    };
    (0..n as u32).for_each(|v| cut.parting[v as usize] = cut.alone(v));
    let mut parts: Vec<Try<'_>> = try_vec(seeds.len(), "regions")?;
    parts.extend(seeds.iter().map(|s| Try::Part(s)));
    for _ in 0..ROUNDS {
        let open = std::mem::replace(&mut cut.open, try_filled(n, false, "regions")?);
        let split = cut.all(&parts, &open, job)?;
        let moved = cut.all(&cut.pairs(apart)?, &open, job)?;
        if !split && !moved {
            break;
        }
    }
    Ok(())
}

impl Cut<'_> {
    /// Tries one after the other where a region is `open` or has changed in this round; true if any gained. A row that
    /// gains nothing as long as its regions are what they were need not be tried in its turn, so that many are tried at once.
    fn all(&mut self, tries: &[Try<'_>], open: &[bool], job: &Job) -> Result<bool> {
        let mut gained = false;
        for some in tries.chunks(AHEAD) {
            job.check()?;
            let due = |cut: &Cut<'_>, t: Try<'_>| {
                cut.regions(t).is_some_and(|of| of.iter().any(|&r| open[r as usize] || cut.open[r as usize]))
            };
            let before = self.changes;
            let this = &*self;
            let ahead = |&t: &Try<'_>| if due(this, t) { this.attempt(t).map(Some) } else { Ok(None) };
            let found: Vec<Option<Vec<u32>>> = some.par_iter().map(ahead).collect::<Result<_>>()?;
            for (&t, found) in some.iter().zip(found) {
                let Some(of) = self.regions(t) else { continue };
                if !due(self, t) {
                    continue;
                }
                let as_before = of.iter().all(|&r| self.changed[r as usize] <= before);
                let moves = match found {
                    Some(moves) if as_before => moves,
                    _ => self.attempt(t)?,
                };
                if !moves.is_empty() {
                    self.apply(t, &moves)?;
                    gained = true;
                }
            }
        }
        Ok(gained)
    }

    /// The regions that a row is about.
    fn regions(&self, t: Try<'_>) -> Option<[u32; 2]> {
        match t {
            Try::Part(seed) => seed.first().map(|&v| [self.region[v as usize]; 2]),
            Try::Between(pair) => Some(pair),
        }
    }

    /// Regions that have a common border, but for those.
    fn pairs(&self, apart: &BTreeSet<[u32; 2]>) -> Result<Vec<Try<'static>>> {
        let mut pairs: Vec<[u32; 2]> = Vec::new();
        for v in 0..self.region.len() as u32 {
            let a = self.region[v as usize];
            let from = pairs.len();
            let others = self.graph.around(v).iter().map(|e| self.region[e.0 as usize]);
            for b in others.filter(|&b| a < b) {
                if !pairs[from..].contains(&[a, b]) {
                    try_push(&mut pairs, [a, b], "borders of regions")?;
                }
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
        pairs.retain(|pair| !apart.contains(pair));
        let mut tries = try_vec(pairs.len(), "borders of regions")?;
        tries.extend(pairs.into_iter().map(Try::Between));
        Ok(tries)
    }

    /// The moves that gain something; none where nothing does.
    fn attempt(&self, t: Try<'_>) -> Result<Vec<u32>> {
        let rooms = || self.rooms.lock().unwrap_or_else(PoisonError::into_inner);
        let left = rooms().pop();
        let mut scratch = match left {
            Some(scratch) => scratch,
            None => Scratch::new(self.region.len())?,
        };
        self.moves(t, &mut scratch);
        let mut moves = try_vec(scratch.moves.len(), "regions")?;
        moves.extend(&scratch.moves);
        try_push(&mut rooms(), scratch, "regions")?;
        Ok(moves)
    }

    /// The same, left in the scratch.
    fn moves(&self, t: Try<'_>, scratch: &mut Scratch) {
        scratch.moves.clear();
        match t {
            Try::Part(seed) => {
                let Some(own) = seed.first().map(|&v| self.region[v as usize]) else { return };
                let n = self.members[own as usize].len();
                let begin = || seed.iter().copied().filter(|&v| self.region[v as usize] == own);
                let first = begin().count();
                if n > first {
                    self.row([own, NONE], begin(), &[], (first + PART).min(n - 1), scratch);
                }
            }
            Try::Between([a, b]) => {
                let [n, m] = [a, b].map(|r| self.members[r as usize].len());
                let (small, large) = if n <= m { (a, b) } else { (b, a) };
                let small = &self.members[small as usize];
                let of =
                    |v: &u32| self.graph.around(*v).iter().filter(|e| self.region[e.0 as usize] == large).map(|e| e.1);
                let joined = small.iter().flat_map(of).sum::<f64>();
                if !small.is_empty() {
                    let gain = self.row([a, b], std::iter::empty(), small, ROW.0 * n.min(m) + ROW.1, scratch);
                    if joined > gain {
                        scratch.moves.clear();
                        scratch.moves.extend(small);
                    }
                }
            }
        }
    }

    /// What parting a node from its region gains.
    fn alone(&self, v: u32) -> f64 {
        self.gain(v, [self.region[v as usize], NONE])
    }

    /// What moving a node to the other one of two regions gains.
    fn gain(&self, v: u32, [a, b]: [u32; 2]) -> f64 {
        let own = self.region[v as usize];
        let other = if own == a { b } else { a };
        let mut gain = 0.0;
        for &(u, w) in self.graph.around(v) {
            match self.region[u as usize] {
                r if r == other => gain += w,
                r if r == own => gain -= w,
                _ => {}
            }
        }
        gain
    }

    /// A row of at most `most` moves between two regions, begun with those of `seed` from the first and with what lies
    /// between them, `small` being the nodes of one: as many moves are left in the scratch as gain most. Returns that gain.
    fn row(
        &self,
        of: [u32; 2],
        mut seed: impl Iterator<Item = u32>,
        small: &[u32],
        most: usize,
        scratch: &mut Scratch,
    ) -> f64 {
        let Scratch { seen, row, queue, moves } = scratch;
        *row += 1;
        queue.clear();
        let row = *row;
        let meet = |v: u32, seen: &mut [Seen]| {
            if seen[v as usize].row == row {
                return false;
            }
            let gain = if of[1] == NONE { self.parting[v as usize] } else { self.gain(v, of) };
            seen[v as usize] = Seen { row, moved: false, gain };
            true
        };
        for &v in small {
            let other = if self.region[v as usize] == of[0] { of[1] } else { of[0] };
            let mut border = false;
            for &(u, _) in self.graph.around(v).iter().filter(|e| self.region[e.0 as usize] == other) {
                border = true;
                if meet(u, seen) {
                    queue.put(u, seen[u as usize].gain, ());
                }
            }
            if border && meet(v, seen) {
                queue.put(v, seen[v as usize].gain, ());
            }
        }
        // --- one after the other, those of the seed whatever they gain
        let (mut sum, mut best) = (0.0, (self.slight, 0));
        while let Some(v) = seed.next().inspect(|&v| queue.remove(v)).or_else(|| queue.pop().map(|p| p.0)) {
            meet(v, seen);
            sum += seen[v as usize].gain;
            seen[v as usize].moved = true;
            moves.push(v);
            if sum > best.0 {
                best = (sum, moves.len());
            }
            if moves.len() >= most {
                break;
            }
            let from = self.region[v as usize];
            for &(u, w) in self.graph.around(v) {
                let r = self.region[u as usize];
                if r == of[0] || r == of[1] {
                    meet(u, seen);
                    let there = &mut seen[u as usize];
                    if !there.moved {
                        there.gain += if r == from { 2.0 * w } else { -2.0 * w };
                        queue.put(u, there.gain, ());
                    }
                }
            }
        }
        // --- as far as it was best
        moves.truncate(best.1);
        best.0
    }

    /// Moves nodes to the other side.
    fn apply(&mut self, t: Try<'_>, moves: &[u32]) -> Result<()> {
        let Some([a, mut b]) = self.regions(t) else { return Ok(()) };
        if let Try::Part(_) = t {
            // as many labels as nodes: where one has two, another has none
            while self.full + 1 < self.members.len() && !self.members[self.full].is_empty() {
                self.full += 1;
            }
            b = self.full as u32;
        }
        let [mut nodes, mut others] = [a, b].map(|r| std::mem::take(&mut self.members[r as usize]));
        if nodes == moves {
            std::mem::swap(&mut nodes, &mut others);
        }
        moves.iter().for_each(|&v| self.region[v as usize] = if self.region[v as usize] == a { b } else { a });
        for r in [a, b] {
            let of = || nodes.iter().chain(&others).copied().filter(|&v| self.region[v as usize] == r);
            let mut members = try_vec(of().count(), "regions")?;
            members.extend(of());
            if members.is_empty() {
                self.full = self.full.min(r as usize);
            }
            self.members[r as usize] = members;
        }
        for &v in moves {
            self.parting[v as usize] = self.alone(v);
            for e in self.graph.around(v) {
                self.parting[e.0 as usize] = self.alone(e.0);
            }
        }
        self.changes += 1;
        for r in [a, b] {
            (self.open[r as usize], self.changed[r as usize]) = (true, self.changes);
        }
        Ok(())
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
        refine(8, &pulls, &[vec![0], vec![5, 6]], &BTreeSet::new(), &mut region, &Job::default()).unwrap();
        let of = |r: u32| (0..8).filter(|&v| region[v] == r).collect::<Vec<_>>();
        assert_eq!([of(region[0]), of(region[4])], [vec![0, 1, 2, 3], vec![4, 5, 6, 7]]);
        // one node on the wrong side, and one region too many
        let mut region = vec![0, 0, 0, 4, 4, 4, 6, 6];
        refine(8, &pulls, &[], &BTreeSet::new(), &mut region, &Job::default()).unwrap();
        assert!(region[..4].iter().all(|r| *r == region[0]) && region[4..].iter().all(|r| *r == region[4]));
        assert_ne!(region[0], region[4]);
    }

    #[test]
    fn part_of_a_region_moves_where_joining_gains_less_and_nothing_between_regions_kept_apart() {
        let pulls = [([0, 1], 0.5), ([1, 2], 3.0), ([0, 2], -2.0), ([2, 3], 5.0)];
        let moved = |apart: &[[u32; 2]]| {
            let mut region = vec![0, 0, 2, 2];
            refine(4, &pulls, &[], &apart.iter().copied().collect(), &mut region, &Job::default()).unwrap();
            region
        };
        assert_eq!(moved(&[]), [0, 2, 2, 2]);
        assert_eq!(moved(&[[0, 2]]), [0, 0, 2, 2]);
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
                refine(
                    n as usize,
                    &pulls,
                    &(0..n).map(|v| vec![v]).collect::<Vec<_>>(),
                    &BTreeSet::new(),
                    &mut region,
                    &Job::default(),
                )
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
