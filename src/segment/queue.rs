//! Nodes in the order of what they are worth, which changes while they wait.

use crate::error::{Result, try_filled, try_vec};
use crate::mesh::NONE;

/// The node that is worth most comes out first, the lower of equals. A heap of four branches that knows where in it every
/// node is: one whose worth changes moves, and none is in it twice.
pub struct Queue {
    heap: Vec<(f64, u32)>,
    /// By node where it is, or [`NONE`].
    place: Vec<u32>,
}

fn precedes(a: (f64, u32), b: (f64, u32)) -> bool {
    a.0 > b.0 || (a.0 == b.0 && a.1 < b.1)
}

impl Queue {
    /// An empty one for nodes below `n`.
    ///
    /// # Errors
    /// [`crate::error::Error::NoMemory`].
    pub fn new(n: usize) -> Result<Queue> {
        Ok(Queue { heap: try_vec(n, "a queue")?, place: try_filled(n, NONE, "a queue")? })
    }

    /// Takes all out.
    pub fn clear(&mut self) {
        self.heap.iter().for_each(|h| self.place[h.1 as usize] = NONE);
        self.heap.clear();
    }

    /// Puts a node in, or where it belongs now.
    pub fn put(&mut self, node: u32, worth: f64) {
        let k = match self.place[node as usize] {
            NONE => {
                self.heap.push((worth, node));
                self.heap.len() - 1
            }
            k => k as usize,
        };
        self.settle(k, (worth, node));
    }

    /// Takes out the first.
    pub fn pop(&mut self) -> Option<u32> {
        let node = self.heap.first()?.1;
        self.remove(node);
        Some(node)
    }

    /// Takes out a node, if it is in.
    pub fn remove(&mut self, node: u32) {
        let k = std::mem::replace(&mut self.place[node as usize], NONE);
        if k != NONE
            && let Some(last) = self.heap.pop()
            && last.1 != node
        {
            self.settle(k as usize, last);
        }
    }

    /// Moves an entry that takes the place `k` to where it belongs.
    fn settle(&mut self, mut k: usize, entry: (f64, u32)) {
        let from = k;
        while k > 0 && precedes(entry, self.heap[(k - 1) / 4]) {
            self.set(k, self.heap[(k - 1) / 4]);
            k = (k - 1) / 4;
        }
        // what has gone up need not go down
        while k >= from {
            let below = self.heap.get(4 * k + 1..).unwrap_or(&[]);
            let mut first = (k, entry);
            for (i, &other) in below.iter().take(4).enumerate() {
                if precedes(other, first.1) {
                    first = (4 * k + 1 + i, other);
                }
            }
            if first.0 == k {
                break;
            }
            self.set(k, first.1);
            k = first.0;
        }
        self.set(k, entry);
    }

    fn set(&mut self, k: usize, entry: (f64, u32)) {
        self.heap[k] = entry;
        self.place[entry.1 as usize] = k as u32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_most_worth_comes_first_whatever_changes() {
        let mut seed = 1u64;
        let mut random = |n: u64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) % n
        };
        for n in [1, 2, 7, 90] {
            let mut queue = Queue::new(n).unwrap();
            for _ in 0..3 {
                // by node what it is worth, beside the queue
                let mut worth: Vec<Option<f64>> = vec![None; n];
                for _ in 0..2000 {
                    let v = random(n as u64) as usize;
                    match random(8) {
                        0 => {
                            queue.remove(v as u32);
                            worth[v] = None;
                        }
                        1 => {
                            let most = worth.iter().flatten().copied().fold(f64::NEG_INFINITY, f64::max);
                            let first = worth.iter().position(|w| *w == Some(most));
                            assert_eq!(queue.pop(), first.map(|v| v as u32));
                            first.into_iter().for_each(|v| worth[v] = None);
                        }
                        _ => {
                            worth[v] = Some(random(20) as f64);
                            queue.put(v as u32, worth[v].unwrap_or(0.0));
                        }
                    }
                }
                queue.clear();
                assert_eq!(queue.pop(), None);
            }
        }
    }
}
