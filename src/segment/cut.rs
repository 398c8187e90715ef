//! Where to cut a graph of patches, the number of parts not being given: correlation clustering by greedy additive
//! edge contraction (Keuper et al. 2015, "Efficient decomposition of image and mesh graphs by lifted multicuts").
//!
//! Every border attracts or repels. The two regions that attract each other most are joined, their borders with others
//! add up, and so on until no two regions attract each other: a long concave crease outweighs the short flat border
//! around its end.

use crate::error::{Result, try_vec};
use hashbrown::HashMap;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Two regions and how much they attract each other.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Pull {
    value: f64,
    regions: [u32; 2],
    /// Number of changes of the two regions when this was written: an older entry is out of date.
    stamp: [u32; 2],
}

impl Eq for Pull {}

impl Ord for Pull {
    fn cmp(&self, other: &Pull) -> Ordering {
        self.value.total_cmp(&other.value).then(other.regions.cmp(&self.regions))
    }
}

impl PartialOrd for Pull {
    fn partial_cmp(&self, other: &Pull) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Region of every node of a graph with `n` nodes, named by one of its nodes. `pulls` are pairs of nodes and how much
/// they attract (positive) or repel each other. Joins until nothing attracts, or, with `count`, until that many regions
/// are left or none are neighbours.
///
/// # Errors
/// [`crate::error::Error::NoMemory`].
pub fn contract(n: usize, pulls: &[([u32; 2], f64)], count: Option<usize>) -> Result<Vec<u32>> {
    let mut around: Vec<HashMap<u32, f64>> = try_vec(n, "regions")?;
    around.resize_with(n, HashMap::new);
    for &([a, b], w) in pulls {
        *around[a as usize].entry(b).or_insert(0.0) += w;
        *around[b as usize].entry(a).or_insert(0.0) += w;
    }
    let mut heap: BinaryHeap<Pull> = BinaryHeap::new();
    let mut stamp = vec![0u32; n];
    for a in 0..n as u32 {
        heap.extend(around[a as usize].iter().filter(|(b, _)| **b > a).map(|(&b, &w)| Pull {
            value: w,
            regions: [a, b],
            stamp: [0, 0],
        }));
    }
    let mut parent: Vec<u32> = (0..n as u32).collect();
    let mut left = n;
    while let Some(pull) = heap.pop() {
        let [a, b] = pull.regions;
        if pull.stamp != [stamp[a as usize], stamp[b as usize]] || around[a as usize].get(&b) != Some(&pull.value) {
            continue;
        }
        let enough = match count {
            Some(k) => left <= k,
            None => pull.value <= 0.0,
        };
        if enough {
            break;
        }
        // the one with fewer neighbours moves into the other
        let size = |r: u32| around[r as usize].len();
        let (keep, gone) = if size(a) >= size(b) { (a, b) } else { (b, a) };
        let moved = std::mem::take(&mut around[gone as usize]);
        parent[gone as usize] = keep;
        stamp[gone as usize] = u32::MAX;
        left -= 1;
        let mut moved: Vec<(u32, f64)> = moved.into_iter().filter(|m| m.0 != keep).collect();
        moved.sort_unstable_by_key(|m| m.0);
        around[keep as usize].remove(&gone);
        for (c, w) in moved {
            around[c as usize].remove(&gone);
            let value = {
                let sum = around[keep as usize].entry(c).or_insert(0.0);
                *sum += w;
                *sum
            };
            around[c as usize].insert(keep, value);
            let regions = [keep.min(c), keep.max(c)];
            heap.push(Pull { value, regions, stamp: regions.map(|r| stamp[r as usize]) });
        }
    }
    for v in 0..n {
        let mut root = v;
        while parent[root] as usize != root {
            root = parent[root] as usize;
        }
        let mut v = v;
        while parent[v] as usize != root {
            v = std::mem::replace(&mut parent[v], root as u32) as usize;
        }
    }
    Ok(parent)
}
