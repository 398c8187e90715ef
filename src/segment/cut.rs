//! Where to cut a graph of patches, the number of parts not being given: correlation clustering by greedy additive
//! edge contraction (Keuper et al. 2015, "Efficient decomposition of image and mesh graphs by lifted multicuts").
//!
//! Every border attracts or repels. The two regions that attract each other most are joined, their borders with others
//! add up, and so on until no two regions attract each other: a long concave crease outweighs the short flat border
//! around its end.

use crate::error::{Error, Result, try_filled, try_vec};
use crate::mesh::NONE;
use hashbrown::HashMap;
use hashbrown::hash_map::Entry;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Something that is worth so much: the most comes first out of a heap, the lower of equals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Worth<K>(pub f64, pub K);

impl<K: Ord> Eq for Worth<K> {}

impl<K: Ord> Ord for Worth<K> {
    fn cmp(&self, other: &Worth<K>) -> Ordering {
        self.0.total_cmp(&other.0).then_with(|| other.1.cmp(&self.1))
    }
}

impl<K: Ord> PartialOrd for Worth<K> {
    fn partial_cmp(&self, other: &Worth<K>) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Two nodes, the lower first.
pub fn pair(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// What regions attract or repel each other.
struct Ties {
    /// By two regions that are neighbours: how much they attract each other.
    value: HashMap<[u32; 2], f64>,
    /// By region: how many neighbours it has, and the last link of a chain of all that it ever had.
    degree: Vec<u32>,
    last: Vec<u32>,
    /// A neighbour, and the link before.
    links: Vec<(u32, u32)>,
}

impl Ties {
    fn new(n: usize, pulls: &[([u32; 2], f64)]) -> Result<Ties> {
        let mut out = Ties {
            value: HashMap::new(),
            degree: try_filled(n, 0, "regions")?,
            last: try_filled(n, NONE, "regions")?,
            links: try_vec(2 * pulls.len(), "regions")?,
        };
        out.value.try_reserve(pulls.len()).map_err(|_| full())?;
        for &([a, b], w) in pulls {
            out.add(a, b, w)?;
        }
        Ok(out)
    }

    /// Lets two regions attract each other more by `w`; returns by how much they do now.
    fn add(&mut self, a: u32, b: u32, w: f64) -> Result<f64> {
        match self.value.entry(pair(a, b)) {
            Entry::Occupied(mut sum) => {
                *sum.get_mut() += w;
                Ok(*sum.get())
            }
            Entry::Vacant(new) => {
                new.insert(w);
                self.links.try_reserve(2).map_err(|_| full())?;
                for (a, b) in [(a, b), (b, a)] {
                    self.degree[a as usize] += 1;
                    self.links.push((b, self.last[a as usize]));
                    self.last[a as usize] = self.links.len() as u32 - 1;
                }
                Ok(w)
            }
        }
    }

    /// No longer neighbours; returns how much they attracted each other.
    fn remove(&mut self, a: u32, b: u32) -> Option<f64> {
        let w = self.value.remove(&pair(a, b))?;
        [a, b].into_iter().for_each(|r| self.degree[r as usize] -= 1);
        Some(w)
    }
}

fn full() -> Error {
    Error::NoMemory("out of memory: borders of regions".to_owned())
}

/// Region of every node of a graph with `n` nodes, named by one of its nodes. `pulls` are pairs of different nodes and how
/// much they attract (positive) or repel each other. Joins until nothing attracts, or, with `count`, until that many
/// regions are left or none are neighbours.
///
/// # Errors
/// [`Error::NoMemory`].
pub fn contract(n: usize, pulls: &[([u32; 2], f64)], count: Option<usize>) -> Result<Vec<u32>> {
    let mut ties = Ties::new(n, pulls)?;
    // what repels is joined only to get down to a number
    let counts = |value: f64| count.is_some() || value > 0.0;
    let mut open: Vec<Worth<[u32; 2]>> = try_vec(ties.value.len(), "borders of regions")?;
    open.extend(ties.value.iter().filter(|t| counts(*t.1)).map(|(&regions, &value)| Worth(value, regions)));
    let mut heap = BinaryHeap::from(open);
    let mut parent: Vec<u32> = try_vec(n, "regions")?;
    parent.extend(0..n as u32);
    let mut left = n;
    while let Some(Worth(value, [a, b])) = heap.pop() {
        // what was written before one of the two grew, or went, is out of date
        if ties.value.get(&[a, b]) != Some(&value) {
            continue;
        }
        if count.is_some_and(|k| left <= k) {
            break;
        }
        // the one with fewer neighbours moves into the other
        let (keep, gone) = if ties.degree[a as usize] >= ties.degree[b as usize] { (a, b) } else { (b, a) };
        ties.remove(a, b);
        parent[gone as usize] = keep;
        left -= 1;
        let mut link = ties.last[gone as usize];
        while link != NONE {
            let (c, before) = ties.links[link as usize];
            link = before;
            // links to regions that went before are left over
            let Some(w) = ties.remove(gone, c) else { continue };
            let value = ties.add(keep, c, w)?;
            if counts(value) {
                heap.try_reserve(1).map_err(|_| full())?;
                heap.push(Worth(value, pair(keep, c)));
            }
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
