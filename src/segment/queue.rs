//! Things in the order of what they are worth, which changes while they wait.

use crate::error::{Result, try_filled, try_vec};
use crate::mesh::NONE;

/// What is worth most comes out first; of equals the one with the lower name, which may change as well, or the lower
/// number. A heap of four branches that knows where in it everything is: what changes its worth moves, and nothing is in
/// it twice.
pub struct Queue<K> {
    heap: Vec<Entry<K>>,
    /// By number where it is, or [`NONE`].
    place: Vec<u32>,
}

/// Worth, name and number.
type Entry<K> = (f64, K, u32);

fn precedes<K: Ord>(a: &Entry<K>, b: &Entry<K>) -> bool {
    a.0 > b.0 || (a.0 == b.0 && (&a.1, a.2) < (&b.1, b.2))
}

impl<K: Copy + Ord> Queue<K> {
    /// An empty one for numbers below `n`.
    ///
    /// # Errors
    /// [`crate::error::Error::NoMemory`].
    pub fn new(n: usize) -> Result<Queue<K>> {
        Ok(Queue { heap: try_vec(n, "a queue")?, place: try_filled(n, NONE, "a queue")? })
    }

    /// Takes all out.
    pub fn clear(&mut self) {
        self.heap.iter().for_each(|h| self.place[h.2 as usize] = NONE);
        self.heap.clear();
    }

    /// Puts a number in, or where it belongs now.
    pub fn put(&mut self, number: u32, worth: f64, name: K) {
        let entry = (worth, name, number);
        let k = match self.place[number as usize] {
            NONE => {
                self.heap.push(entry);
                self.heap.len() - 1
            }
            k => k as usize,
        };
        self.settle(k, entry);
    }

    /// Takes out the first: its number and its name.
    pub fn pop(&mut self) -> Option<(u32, K)> {
        let &(_, name, number) = self.heap.first()?;
        self.remove(number);
        Some((number, name))
    }

    /// Takes out a number, if it is in.
    pub fn remove(&mut self, number: u32) {
        let k = std::mem::replace(&mut self.place[number as usize], NONE);
        if k != NONE
            && let Some(last) = self.heap.pop()
            && last.2 != number
        {
            self.settle(k as usize, last);
        }
    }

    /// Moves an entry that takes the place `k` to where it belongs.
    fn settle(&mut self, mut k: usize, entry: Entry<K>) {
        let from = k;
        while k > 0 && precedes(&entry, &self.heap[(k - 1) / 4]) {
            self.set(k, self.heap[(k - 1) / 4]);
            k = (k - 1) / 4;
        }
        // what has gone up need not go down
        while k >= from {
            let below = self.heap.get(4 * k + 1..).unwrap_or(&[]);
            let mut first = (k, entry);
            for (i, other) in below.iter().take(4).enumerate() {
                if precedes(other, &first.1) {
                    first = (4 * k + 1 + i, *other);
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

    fn set(&mut self, k: usize, entry: Entry<K>) {
        self.heap[k] = entry;
        self.place[entry.2 as usize] = k as u32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_worth_most_comes_first_whatever_changes() {
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
                            assert_eq!(queue.pop().map(|p| p.0), first.map(|v| v as u32));
                            first.into_iter().for_each(|v| worth[v] = None);
                        }
                        _ => {
                            worth[v] = Some(random(20) as f64);
                            queue.put(v as u32, worth[v].unwrap_or(0.0), ());
                        }
                    }
                }
                queue.clear();
                assert_eq!(queue.pop(), None);
            }
        }
    }
}
