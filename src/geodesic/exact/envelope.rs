//! Windows and the lower envelope that they form on every edge.
//!
//! A window is an interval of an edge that straight unfolded paths from one (pseudo-)source reach. In the frame of its
//! edge the source's image lies at (px, py), py >= 0 being its distance from the edge's line on the side the paths come
//! from, and `sigma` is the length already travelled when the source is a vertex that the path bends around.

use crate::error::{Error, Result};

/// Distances closer than this are the same (lengths are scaled to a model of size about 1).
pub(super) const TIE: f64 = 1e-13;
/// Windows narrower than this are dropped.
const SLIM: f64 = 1e-14;

#[derive(Debug, Clone, Copy)]
pub(super) struct Window {
    pub b0: f64,
    pub b1: f64,
    pub px: f64,
    pub py: f64,
    pub sigma: f64,
    pub edge: u32,
    /// The face that the paths come through; NONE for a source on the edge itself.
    pub face: u32,
    state: State,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum State {
    /// In its edge's list, waiting in the queue.
    Waiting,
    /// In its edge's list, already propagated.
    Done,
    /// Trimmed away while waiting: recycled when the queue gives it up.
    Dead,
}

impl Window {
    pub fn new(edge: u32, face: u32, interval: (f64, f64), source: (f64, f64), sigma: f64) -> Window {
        let ((b0, b1), (px, py)) = (interval, source);
        Window { b0, b1, px, py, sigma, edge, face, state: State::Waiting }
    }

    /// The same, marked as propagated already.
    pub fn done(self) -> Window {
        Window { state: State::Done, ..self }
    }

    /// Length of the path to the point at `x` on the edge.
    #[inline]
    pub fn at(&self, x: f64) -> f64 {
        let dx = x - self.px;
        self.sigma + (dx * dx + self.py * self.py).sqrt()
    }

    /// Length of the shortest path through the window to its edge.
    #[inline]
    pub fn least(&self) -> f64 {
        self.at(self.px.clamp(self.b0, self.b1))
    }
}

/// What the queue holds: a window or, with the top bit, a vertex.
pub(super) const VERTEX: u32 = 1 << 31;

/// An entry of an edge's list: where the window starts, and its index.
type Slot = (f64, u32);

/// Windows by edge, and the queue of what is to be propagated next.
#[derive(Debug, Default)]
pub(super) struct Envelope {
    pool: Vec<Window>,
    free: Vec<u32>,
    /// For each edge its windows, which do not overlap, in order.
    lists: Vec<Vec<Slot>>,
    /// What is to replace a stretch of a list.
    fresh: Vec<Slot>,
    pub queue: Queue,
    limit: usize,
    /// Windows made so far.
    pub made: usize,
}

/// Who is lower on an overlap: up to three stretches, each ending at `.0` and won by the new window if `.1`.
type Stretches = ([(f64, bool); 3], usize);

/// Decides between the window `old` in the list and the window `new` on `lo..hi`; ties go to `old`.
#[inline]
fn contest(old: &Window, new: &Window, lo: f64, hi: f64) -> Stretches {
    let (at_lo, at_hi) = (new.at(lo) - old.at(lo) + TIE, new.at(hi) - old.at(hi) + TIE);
    let (new_lo, new_hi) = (at_lo < 0.0, at_hi < 0.0);
    if new_lo != new_hi {
        let root = crossing(old, new, lo, hi, at_lo, at_hi);
        return ([(root, new_lo), (hi, new_hi), (hi, new_hi)], 2);
    }
    // Lengths have slopes within -1..1: far enough apart at both ends, they cannot meet in between.
    if at_lo.abs() + at_hi.abs() < 2.0 * (hi - lo) {
        if let Some((r0, r1)) = double_crossing(old, new, lo, hi) {
            let mid = 0.5 * (r0 + r1);
            if (new.at(mid) + TIE < old.at(mid)) != new_lo {
                return ([(r0, new_lo), (r1, !new_lo), (hi, new_lo)], 3);
            }
        }
    }
    ([(hi, new_lo); 3], 1)
}

/// Coefficients (a, b, c) of a t^2 + 2 b t + c = 0, which holds at x = lo + t where the two lengths are equal.
#[inline]
fn equal_lengths(old: &Window, new: &Window, lo: f64) -> (f64, f64, f64) {
    let (xo, xn) = (old.px - lo, new.px - lo);
    let d = new.sigma - old.sigma;
    // From |x - O| = |x - N| + d: p t + q = 2 d |t - N|, squared.
    let p = 2.0 * (xn - xo);
    let q = (xo - xn) * (xo + xn) + (old.py - new.py) * (old.py + new.py) - d * d;
    let d4 = 4.0 * d * d;
    (p * p - d4, p * q + d4 * xn, q * q - d4 * (xn * xn + new.py * new.py))
}

/// Both roots, if both lie inside lo..hi.
#[inline]
fn double_crossing(old: &Window, new: &Window, lo: f64, hi: f64) -> Option<(f64, f64)> {
    let (a, b, c) = equal_lengths(old, new, lo);
    let disc = b * b - a * c;
    // The extremum -b/a must lie inside.
    if disc <= 0.0 || b * a >= 0.0 || b.abs() >= a.abs() * (hi - lo) {
        return None;
    }
    let (root, mid) = (disc.sqrt() / a.abs(), -b / a);
    (mid - root > 0.0 && mid + root < hi - lo).then_some((lo + mid - root, lo + mid + root))
}

/// The point of lo..hi where the lengths are equal, given their difference at the ends (of opposite sign).
#[inline]
fn crossing(old: &Window, new: &Window, lo: f64, hi: f64, at_lo: f64, at_hi: f64) -> f64 {
    let (a, b, c) = equal_lengths(old, new, lo);
    let width = hi - lo;
    let secant = width * at_lo / (at_lo - at_hi);
    // Stable quadratic formula; squaring has added a false root, so test the one that is nearest to the secant's.
    let h = -(b + (b * b - a * c).max(0.0).sqrt().copysign(b));
    let (r0, r1) = (h / a, c / h);
    let near = |r: f64| if r >= 0.0 && r <= width { (r - secant).abs() } else { f64::MAX };
    let (first, second) = if near(r0) <= near(r1) { (r0, r1) } else { (r1, r0) };
    for root in [first, second] {
        let x = lo + root;
        if root >= 0.0 && root <= width && (new.at(x) - old.at(x)).abs() < 1e-12 {
            return x.min(hi);
        }
    }
    lo + bisect(old, new, lo, width, at_lo < 0.0)
}

/// Fallback for ill-conditioned quadratics.
#[cold]
fn bisect(old: &Window, new: &Window, lo: f64, width: f64, new_at_lo: bool) -> f64 {
    let (mut left, mut right) = (0.0, width);
    for _ in 0..40 {
        let mid = 0.5 * (left + right);
        let at_mid = new.at(lo + mid) - old.at(lo + mid) + TIE;
        if (at_mid < 0.0) == new_at_lo {
            left = mid
        } else {
            right = mid
        }
        if at_mid.abs() < TIE {
            break;
        }
    }
    0.5 * (left + right)
}

impl Envelope {
    /// Empties everything for a mesh of `edges` edges. At most about `limit` windows will be made.
    pub fn reset(&mut self, edges: usize, limit: usize) -> Result<()> {
        let no_memory = |_| Error::NoMemory("out of memory: exact geodesics: edges".into());
        self.lists.iter_mut().for_each(Vec::clear);
        if edges > self.lists.len() {
            self.lists.try_reserve(edges - self.lists.len()).map_err(no_memory)?;
            self.lists.resize(edges, Vec::new());
        }
        self.pool.clear();
        self.free.clear();
        self.queue.clear();
        (self.limit, self.made) = (limit.min(VERTEX as usize - 1), 0);
        Ok(())
    }

    /// True when the limit has been reached: windows may be missing.
    pub fn exhausted(&self) -> bool {
        self.made >= self.limit
    }

    /// A copy of a window from the queue, now marked as propagated; None if it was trimmed away since.
    pub fn take(&mut self, id: u32) -> Option<Window> {
        let w = &mut self.pool[id as usize];
        if w.state == State::Dead {
            self.free.push(id);
            return None;
        }
        w.state = State::Done;
        Some(*w)
    }

    /// The windows that make up the envelope of `edge`.
    pub fn windows(&self, edge: u32) -> impl Iterator<Item = &Window> {
        self.lists[edge as usize].iter().map(|slot| &self.pool[slot.1 as usize])
    }

    /// Puts a window into the pool and, unless it is done, into the queue.
    fn add(&mut self, w: Window) -> Slot {
        let id = self.free.pop().unwrap_or(self.pool.len() as u32);
        if w.state == State::Waiting {
            self.queue.push(w.least(), id);
        }
        self.made += 1;
        if id as usize == self.pool.len() {
            self.pool.push(w)
        } else {
            self.pool[id as usize] = w
        }
        (w.b0, id)
    }

    /// Forgets a window that has been trimmed to nothing.
    fn discard(&mut self, id: u32) {
        if self.pool[id as usize].state == State::Done {
            self.free.push(id);
        } else {
            self.pool[id as usize].state = State::Dead;
        }
    }

    /// Adds to the envelope those parts of `w` that are lower than what is there, trims what they undercut, and queues
    /// the parts.
    pub fn insert(&mut self, w: Window) {
        let mut list = std::mem::take(&mut self.lists[w.edge as usize]);
        let mut first = list.partition_point(|slot| slot.0 <= w.b0);
        if first > 0 && self.pool[list[first - 1].1 as usize].b1 > w.b0 {
            first -= 1;
        }
        self.fresh.clear();
        // `run` is the start of the stretch that `w` is winning.
        let mut run = w.b0;
        let mut last = first;
        while last < list.len() && list[last].0 < w.b1 {
            let slot = list[last];
            let old = self.pool[slot.1 as usize];
            let (lo, hi) = (old.b0.max(w.b0), old.b1.min(w.b1));
            let (stretches, count) = contest(&old, &w, lo, hi);
            if count == 1 && !stretches[0].1 {
                self.add_run(&w, run, lo);
                self.fresh.push(slot);
                run = hi;
            } else {
                run = self.recut(&w, slot.1, run, &stretches[..count], (lo, hi));
            }
            last += 1;
        }
        self.add_run(&w, run, w.b1);
        if let ([], [slot]) = (&list[first..last], &self.fresh[..]) {
            list.insert(first, *slot);
        } else if last - first == self.fresh.len() {
            list[first..last].copy_from_slice(&self.fresh);
        } else {
            list.splice(first..last, self.fresh.iter().copied());
        }
        self.lists[w.edge as usize] = list;
    }

    /// Adds the part `from..to` of `w`, unless it is too slim.
    #[inline]
    fn add_run(&mut self, w: &Window, from: f64, to: f64) {
        if to - from > SLIM {
            let slot = self.add(Window { b0: from, b1: to, ..*w });
            self.fresh.push(slot);
        }
    }

    /// Replaces window `id` by what the contest leaves of it, and what `w` has won before. Returns the start of the run
    /// of `w` that is open at the end.
    fn recut(&mut self, w: &Window, id: u32, mut run: f64, stretches: &[(f64, bool)], (lo, hi): (f64, f64)) -> f64 {
        let old = self.pool[id as usize];
        // The pieces that `old` keeps: what sticks out on the left joins a first stretch that it wins, and so on.
        let mut pieces = [(0.0, 0.0); 3];
        let mut count = 0;
        let mut keep = |from: f64, to: f64| {
            if count > 0 && pieces[count - 1].1 == from {
                pieces[count - 1].1 = to;
            } else if to - from > SLIM {
                pieces[count] = (from, to);
                count += 1;
            }
        };
        keep(old.b0, lo);
        let mut start = lo;
        for &(end, new_wins) in stretches {
            if !new_wins {
                keep(start, end);
            }
            start = end;
        }
        keep(hi, old.b1);
        for (k, &(from, to)) in pieces[..count].iter().enumerate() {
            self.add_run(w, run, from.min(w.b1));
            run = run.max(to);
            let slot = if k == 0 {
                (self.pool[id as usize].b0, self.pool[id as usize].b1) = (from, to);
                (from, id)
            } else {
                self.add(Window { b0: from, b1: to, ..old })
            };
            self.fresh.push(slot);
        }
        if count == 0 {
            self.discard(id);
        }
        run
    }
}

/// A monotone priority queue (a radix heap): what is pushed is not before what was popped last, or is treated as if it
/// were as late. Distances are rounded down to multiples of 2^-16; within one the order is fixed, but any.
#[derive(Debug)]
pub(super) struct Queue {
    /// Bucket k holds the keys that differ from `last` in bit k - 1 and not above; bucket 0 holds `last` itself.
    buckets: [Vec<(u32, u32)>; 33],
    last: u32,
}

impl Default for Queue {
    fn default() -> Self {
        Queue { buckets: std::array::from_fn(|_| Vec::new()), last: 0 }
    }
}

impl Queue {
    const STEP: f64 = 65536.0;

    fn clear(&mut self) {
        self.buckets.iter_mut().for_each(Vec::clear);
        self.last = 0;
    }

    /// The rounded form of a distance (saturating).
    pub fn key(distance: f64) -> u32 {
        (distance * Self::STEP) as u32
    }

    #[inline]
    fn bucket(&self, key: u32) -> usize {
        (32 - (key ^ self.last).leading_zeros()) as usize
    }

    pub fn push(&mut self, distance: f64, id: u32) {
        self.push_key(Self::key(distance), id);
    }

    /// Adds an entry by its rounded distance.
    pub fn push_key(&mut self, key: u32, id: u32) {
        let key = key.max(self.last);
        let bucket = self.bucket(key);
        self.buckets[bucket].push((key, id));
    }

    /// Takes an entry of the least rounded distance.
    pub fn pop(&mut self) -> Option<(u32, u32)> {
        if let Some(entry) = self.buckets[0].pop() {
            return Some(entry);
        }
        let k = self.buckets.iter().position(|b| !b.is_empty())?;
        let mut moved = std::mem::take(&mut self.buckets[k]);
        self.last = moved.iter().map(|e| e.0).min()?;
        for entry in moved.drain(..) {
            let bucket = self.bucket(entry.0);
            self.buckets[bucket].push(entry);
        }
        self.buckets[k] = moved;
        self.buckets[0].pop()
    }
}
