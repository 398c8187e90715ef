//! Disjoint sets of numbers, joined two at a time. The smallest number of a set stands for it, so that what is made of
//! them does not depend on the order in which they were joined.

use crate::error::{Result, try_vec};
use hashbrown::HashMap;

/// Sets of the numbers 0 .. n.
#[derive(Debug, Clone, Default)]
pub struct Sets(Vec<u32>);

impl Sets {
    /// `n` sets of one number each.
    ///
    /// # Errors
    /// [`crate::error::Error::NoMemory`].
    pub fn new(n: usize) -> Result<Sets> {
        let mut parent = try_vec(n, "disjoint sets")?;
        parent.extend(0..n as u32);
        Ok(Sets(parent))
    }

    /// The smallest number of the set that `v` is in.
    pub fn root(&mut self, mut v: u32) -> u32 {
        let parent = &mut self.0;
        while parent[v as usize] != v {
            parent[v as usize] = parent[parent[v as usize] as usize];
            v = parent[v as usize];
        }
        v
    }

    /// Makes the sets of two numbers one.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

/// Sets of a few numbers, of any size.
#[derive(Debug, Clone, Default)]
pub struct SparseSets(HashMap<u32, u32>);

impl SparseSets {
    /// The smallest number of the set that `v` is in, which is one of its own if it was not seen before.
    pub fn root(&mut self, v: u32) -> u32 {
        let mut root = *self.0.entry(v).or_insert(v);
        while self.0[&root] != root {
            root = self.0[&root];
        }
        let mut v = v;
        while v != root {
            v = self.0.insert(v, root).unwrap_or(root);
        }
        root
    }

    /// Makes the sets of two numbers one.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0.insert(a.max(b), a.min(b));
    }

    /// The numbers seen so far, in no particular order.
    pub fn members(&self) -> impl Iterator<Item = u32> + '_ {
        self.0.keys().copied()
    }

    /// Number of sets.
    pub fn count(&self) -> usize {
        self.0.iter().filter(|(v, root)| v == root).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chains_of_any_order_become_one_set_named_by_its_smallest() {
        let n = 200_000;
        for order in [false, true] {
            let (mut dense, mut sparse) = (Sets::new(n).unwrap(), SparseSets::default());
            for k in 1..n as u32 {
                let k = if order { k } else { n as u32 - k };
                if k != 7 {
                    dense.join(k, k - 1);
                    sparse.join(k, k - 1);
                }
            }
            assert_eq!(sparse.count(), 2);
            for v in 0..n as u32 {
                let smallest = if v < 7 { 0 } else { 7 };
                assert_eq!((dense.root(v), sparse.root(v)), (smallest, smallest));
            }
        }
    }
}
