//! Regions that a crease runs into without going around: a wall that stands flush with the side of its body, or the two
//! plates of an angle bracket.
//!
//! Contraction joins the two sides of such a crease around its ends, where the surface is flat, before it can know that
//! another cut would have been worth it. Here every region with creases inside is cut between the two sides of one of
//! them, where it is held together least (a minimum cut), and the cut stays if what it gains by the creases outweighs
//! the flat surface that it crosses.

use super::cut::contract;
use crate::error::{Result, try_filled, try_vec};
use crate::job::Job;
use hashbrown::HashMap;
use std::collections::{BTreeMap, VecDeque};

/// Two patches, and how much they attract each other (positive) or repel.
type Tie = ([u32; 2], f64);

/// A cut must gain this share more by the creases than it costs.
const MARGIN: f64 = 1.2;
/// Creases that repel less than this share of the strongest of a region are not tried.
const WEAK: f64 = 0.05;
/// Cuts tried in all.
const TRIES: usize = 200;

/// The regions of `region` (by patch, named by any numbers below the number of patches), cut further along creases inside.
///
/// # Errors
/// [`crate::error::Error::NoMemory`], [`crate::error::Error::Cancelled`].
pub fn cut_along_open_creases(ties: &[Tie], region: Vec<u32>, job: &Job) -> Result<Vec<u32>> {
    let mut members: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    region.iter().enumerate().for_each(|(p, &r)| members.entry(r).or_default().push(p as u32));
    let mut inside: BTreeMap<u32, Vec<Tie>> = BTreeMap::new();
    for t in ties.iter().filter(|t| region[t.0[0] as usize] == region[t.0[1] as usize]) {
        inside.entry(region[t.0[0] as usize]).or_default().push(*t);
    }
    let mut out = region;
    let mut left = TRIES;
    let mut todo: Vec<(Vec<u32>, Vec<Tie>)> = Vec::new();
    for (r, patches) in members {
        todo.push((patches, inside.remove(&r).unwrap_or_default()));
    }
    while let Some((patches, ties)) = todo.pop() {
        job.check()?;
        let Some(side) = split(&patches, &ties, &mut left, job)? else { continue };
        let [a, b] = [false, true].map(|s| -> Vec<u32> {
            patches.iter().enumerate().filter(|(k, _)| side[*k] == s).map(|(_, p)| *p).collect()
        });
        for part in [a, b] {
            part.iter().for_each(|&p| out[p as usize] = part[0]);
            let own: hashbrown::HashSet<u32> = part.iter().copied().collect();
            let ties = ties.iter().filter(|t| t.0.iter().all(|p| own.contains(p))).copied().collect();
            todo.push((part, ties));
        }
    }
    Ok(out)
}

/// Two sides of a region, if cutting between them gains anything.
fn split(patches: &[u32], ties: &[Tie], left: &mut usize, job: &Job) -> Result<Option<Vec<bool>>> {
    if !ties.iter().any(|t| t.1 < 0.0) {
        return Ok(None);
    }
    let local: HashMap<u32, u32> = patches.iter().enumerate().map(|(k, &p)| (p, k as u32)).collect();
    let ties: Vec<Tie> = ties.iter().map(|(t, w)| (t.map(|p| local[&p]), *w)).collect();
    // --- the sides of the creases: what hangs together along them
    let mut beside = try_filled(patches.len(), false, "creases")?;
    ties.iter().filter(|t| t.1 < 0.0).for_each(|t| t.0.iter().for_each(|&p| beside[p as usize] = true));
    let near: Vec<Tie> = ties.iter().filter(|t| t.0.iter().all(|&p| beside[p as usize])).copied().collect();
    let flank = contract(patches.len(), &near, None)?;
    let mut between: BTreeMap<[u32; 2], f64> = BTreeMap::new();
    for (t, w) in &near {
        let [p, q] = t.map(|p| flank[p as usize]);
        if p != q {
            *between.entry([p.min(q), p.max(q)]).or_insert(0.0) += w;
        }
    }
    let mut pairs: Vec<([u32; 2], f64)> = between.into_iter().filter(|p| p.1 < 0.0).collect();
    pairs.sort_by(|a, b| a.1.total_cmp(&b.1));
    let strongest = pairs.first().map_or(0.0, |p| p.1);
    for (pair, _) in pairs.into_iter().filter(|p| p.1 <= WEAK * strongest) {
        if *left == 0 {
            break;
        }
        *left -= 1;
        job.check()?;
        let side = Flow::new(patches.len(), &ties)?.minimum_cut(&flank, pair)?;
        let (mut cost, mut gain) = (0.0, 0.0);
        for (t, w) in ties.iter().filter(|t| side[t.0[0] as usize] != side[t.0[1] as usize]) {
            let _ = t;
            if *w > 0.0 { cost += w } else { gain -= w }
        }
        if gain > MARGIN * cost {
            return Ok(Some(side));
        }
    }
    Ok(None)
}

/// Flow through the attracting ties, by Dinic's algorithm.
struct Flow {
    /// Arcs by their start; arc k and arc k ^ 1 are the two ways of one tie.
    around: Vec<Vec<u32>>,
    to: Vec<u32>,
    room: Vec<f64>,
}

impl Flow {
    fn new(n: usize, ties: &[Tie]) -> Result<Flow> {
        let mut flow = Flow {
            around: try_filled(n + 2, Vec::new(), "cuts")?,
            to: try_vec(2 * ties.len(), "cuts")?,
            room: try_vec(2 * ties.len(), "cuts")?,
        };
        ties.iter().filter(|t| t.1 > 0.0).for_each(|&([p, q], w)| flow.tie(p, q, w));
        Ok(flow)
    }

    fn tie(&mut self, p: u32, q: u32, room: f64) {
        for (a, b) in [(p, q), (q, p)] {
            self.around[a as usize].push(self.to.len() as u32);
            self.to.push(b);
            self.room.push(room);
        }
    }

    /// Which patches are on the second flank's side when the two flanks are cut apart at least cost.
    fn minimum_cut(mut self, flank: &[u32], pair: [u32; 2]) -> Result<Vec<bool>> {
        let n = flank.len();
        let [source, sink] = [n as u32, n as u32 + 1];
        for (p, &f) in flank.iter().enumerate() {
            if f == pair[0] {
                self.tie(source, p as u32, 1e300);
            } else if f == pair[1] {
                self.tie(p as u32, sink, 1e300);
            }
        }
        let total: f64 = self.room.iter().filter(|r| **r < 1e299).sum();
        let enough = 1e-12 * total;
        let mut level = try_filled(n + 2, u32::MAX, "cuts")?;
        loop {
            self.levels(&mut level, source, enough);
            if level[sink as usize] == u32::MAX {
                break;
            }
            let mut next = try_filled(n + 2, 0usize, "cuts")?;
            while self.push(&level, &mut next, source, sink, enough) {}
        }
        Ok((0..n).map(|p| level[p] == u32::MAX).collect())
    }

    /// Steps from the source over arcs that have room.
    fn levels(&self, level: &mut [u32], source: u32, enough: f64) {
        level.fill(u32::MAX);
        level[source as usize] = 0;
        let mut queue = VecDeque::from([source]);
        while let Some(p) = queue.pop_front() {
            for &k in &self.around[p as usize] {
                let q = self.to[k as usize] as usize;
                if self.room[k as usize] > enough && level[q] == u32::MAX {
                    level[q] = level[p as usize] + 1;
                    queue.push_back(q as u32);
                }
            }
        }
    }

    /// One more way from source to sink filled; false if there is none.
    fn push(&mut self, level: &[u32], next: &mut [usize], source: u32, sink: u32, enough: f64) -> bool {
        let mut way: Vec<u32> = Vec::new();
        let mut p = source;
        while p != sink {
            let arcs = &self.around[p as usize];
            let open = |k: u32| {
                self.room[k as usize] > enough && level[self.to[k as usize] as usize] == level[p as usize].wrapping_add(1)
            };
            while next[p as usize] < arcs.len() && !open(arcs[next[p as usize]]) {
                next[p as usize] += 1;
            }
            if next[p as usize] < arcs.len() {
                let k = arcs[next[p as usize]];
                way.push(k);
                p = self.to[k as usize];
            } else if let Some(k) = way.pop() {
                p = self.to[(k ^ 1) as usize];
                next[p as usize] += 1;
            } else {
                return false;
            }
        }
        let amount = way.iter().map(|&k| self.room[k as usize]).fold(f64::INFINITY, f64::min);
        for k in way {
            self.room[k as usize] -= amount;
            self.room[(k ^ 1) as usize] += amount;
        }
        true
    }
}
