//! Where to cut a graph of patches, the number of parts not being given: correlation clustering by greedy additive
//! edge contraction (Keuper et al. 2015, "Efficient decomposition of image and mesh graphs by lifted multicuts").
//!
//! Every border attracts or repels. The two regions that attract each other most are joined, their borders with others
//! add up, and so on until no two regions attract each other: a long concave crease outweighs the short flat border
//! around its end.

use super::queue::Queue;
use crate::error::{Error, Result, try_filled, try_push, try_vec};
use crate::mesh::NONE;
use hashbrown::HashMap;
use hashbrown::hash_map::Entry;

/// Two nodes, the lower first.
pub fn pair(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// What regions attract or repel each other.
struct Ties {
    /// By two regions that are neighbours: their tie.
    of: HashMap<[u32; 2], u32>,
    /// By tie: how much they attract each other.
    value: Vec<f64>,
    /// By region: how many neighbours it has, and the last link of a chain of all that it ever had.
    degree: Vec<u32>,
    last: Vec<u32>,
    /// A neighbour, and the link before.
    links: Vec<(u32, u32)>,
}

impl Ties {
    fn new(n: usize, pulls: &[([u32; 2], f64)]) -> Result<Ties> {
        let mut out = Ties {
            of: HashMap::new(),
            value: try_vec(pulls.len(), "regions")?,
            degree: try_filled(n, 0, "regions")?,
            last: try_filled(n, NONE, "regions")?,
            links: try_vec(2 * pulls.len(), "regions")?,
        };
        out.of.try_reserve(pulls.len()).map_err(|_| full())?;
        for &(regions, w) in pulls {
            let next = out.value.len() as u32;
            match out.tie(regions, next)? {
                None => out.value.push(w),
                Some(tie) => out.value[tie as usize] += w,
            }
        }
        Ok(out)
    }

    /// Makes two regions neighbours by a tie, unless they are: then by which.
    fn tie(&mut self, [a, b]: [u32; 2], tie: u32) -> Result<Option<u32>> {
        match self.of.entry(pair(a, b)) {
            Entry::Occupied(tie) => Ok(Some(*tie.get())),
            Entry::Vacant(new) => {
                new.insert(tie);
                for (a, b) in [(a, b), (b, a)] {
                    self.degree[a as usize] += 1;
                    try_push(&mut self.links, (b, self.last[a as usize]), "borders of regions")?;
                    self.last[a as usize] = self.links.len() as u32 - 1;
                }
                Ok(None)
            }
        }
    }

    /// No longer neighbours; returns the tie between them.
    fn untie(&mut self, a: u32, b: u32) -> Option<u32> {
        let tie = self.of.remove(&pair(a, b))?;
        [a, b].into_iter().for_each(|r| self.degree[r as usize] -= 1);
        Some(tie)
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
    let mut open = Queue::new(ties.value.len())?;
    for (&regions, &tie) in &ties.of {
        let value = ties.value[tie as usize];
        if counts(value) {
            open.put(tie, value, regions);
        }
    }
    let mut parent: Vec<u32> = try_vec(n, "regions")?;
    parent.extend(0..n as u32);
    let mut left = n;
    while let Some((_, [a, b])) = open.pop() {
        if count.is_some_and(|k| left <= k) {
            break;
        }
        // the one with fewer neighbours moves into the other
        let (keep, gone) = if ties.degree[a as usize] >= ties.degree[b as usize] { (a, b) } else { (b, a) };
        ties.untie(a, b);
        parent[gone as usize] = keep;
        left -= 1;
        let mut link = ties.last[gone as usize];
        while link != NONE {
            let (c, before) = ties.links[link as usize];
            link = before;
            // links to regions that went before are left over
            let Some(moved) = ties.untie(gone, c) else { continue };
            let tie = match ties.tie([keep, c], moved)? {
                None => moved,
                Some(tie) => {
                    ties.value[tie as usize] += ties.value[moved as usize];
                    open.remove(moved);
                    tie
                }
            };
            let value = ties.value[tie as usize];
            if counts(value) {
                open.put(tie, value, pair(keep, c));
            } else {
                open.remove(tie);
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
