//! From labels on the analysis surface to segments of the input: connected, none too small, numbered by size.

use super::dual::Dual;
use crate::error::{Result, try_filled, try_vec};
use crate::mesh::NONE;
use crate::mesh::surface::AnalysisSurface;
use hashbrown::HashMap;

/// Turning, in radians, at which a border neither joins nor parts what lies on its two sides: 32 degrees.
pub const NEUTRAL: f64 = 0.55;

/// Every input face gets the label that most of its area has; of equals the one met first along the face.
pub fn vote(surface: &AnalysisSurface, area: &[f64], label: &[u32], faces: usize) -> Result<Vec<u32>> {
    let mut out = try_vec(faces, "labels")?;
    let mut sums: Vec<(u32, f64)> = Vec::new();
    for f in 0..faces {
        sums.clear();
        for child in surface.children(f) {
            match sums.iter_mut().find(|s| s.0 == label[child]) {
                Some(s) => s.1 += area[child],
                None => sums.push((label[child], area[child])),
            }
        }
        let best = sums.iter().copied().reduce(|a, b| if b.1 > a.1 * (1.0 + 1e-9) { b } else { a });
        out.push(best.map_or(0, |b| b.0));
    }
    Ok(out)
}

/// Regions of faces and their common borders.
struct Regions {
    parent: Vec<u32>,
    area: Vec<f64>,
    boundary: Vec<f64>,
    /// Lowest rank of a face.
    first: Vec<u32>,
    /// By neighbour: length of the common border, and how much it attracts.
    around: Vec<HashMap<u32, (f64, f64)>>,
    left: usize,
}

/// The segments of a surface: a label for every face, from 0, by falling area. `label` are wished-for parts; every
/// connected piece of one is a segment of its own, unless it is smaller than `min_area` or thinner than `min_width` and
/// so goes to the neighbour that attracts it most. With `count`, pieces are joined until at most that many are left (or
/// none are neighbours). `rank` decides between equals.
pub fn segments(
    dual: &Dual,
    label: &[u32],
    rank: &[u32],
    (min_area, min_width): (f64, f64),
    count: Option<usize>,
) -> Result<Vec<u32>> {
    let piece = pieces(dual, label)?;
    let n = piece.iter().map(|p| *p as usize + 1).max().unwrap_or(0);
    let mut regions = Regions::new(dual, &piece, rank, n)?;
    regions.absorb_small(min_area, min_width);
    if let Some(count) = count {
        regions.join_to(count);
    }
    let root: Vec<u32> = (0..n as u32).map(|p| regions.root(p)).collect();
    let mut order: Vec<u32> = (0..n as u32).filter(|&p| root[p as usize] == p).collect();
    // areas that agree but for rounding are ordered by position
    let total: f64 = dual.area.iter().sum();
    let key =
        |p: u32| (-(regions.area[p as usize] / total.max(f64::MIN_POSITIVE) * 1e7).round(), regions.first[p as usize]);
    order.sort_by(|&a, &b| key(a).0.total_cmp(&key(b).0).then(key(a).1.cmp(&key(b).1)));
    let mut number = try_filled(n, 0u32, "segments")?;
    order.iter().enumerate().for_each(|(k, &p)| number[p as usize] = k as u32);
    Ok(piece.iter().map(|&p| number[root[p as usize] as usize]).collect())
}

/// Connected pieces of equal label, numbered by first face.
fn pieces(dual: &Dual, label: &[u32]) -> Result<Vec<u32>> {
    let mut piece = try_filled(label.len(), NONE, "segments")?;
    let mut stack: Vec<u32> = Vec::new();
    let mut next = 0;
    for f in 0..label.len() as u32 {
        if piece[f as usize] != NONE {
            continue;
        }
        piece[f as usize] = next;
        stack.push(f);
        while let Some(f) = stack.pop() {
            for &(g, _) in dual.around(f) {
                if piece[g as usize] == NONE && label[g as usize] == label[f as usize] {
                    piece[g as usize] = next;
                    stack.push(g);
                }
            }
        }
        next += 1;
    }
    Ok(piece)
}

impl Regions {
    fn new(dual: &Dual, piece: &[u32], rank: &[u32], n: usize) -> Result<Regions> {
        let mut out = Regions {
            parent: (0..n as u32).collect(),
            area: try_filled(n, 0.0, "segments")?,
            boundary: try_filled(n, 0.0, "segments")?,
            first: try_filled(n, NONE, "segments")?,
            around: try_vec(n, "segments")?,
            left: n,
        };
        out.around.resize_with(n, HashMap::new);
        for (f, &p) in piece.iter().enumerate() {
            out.area[p as usize] += dual.area[f];
            out.first[p as usize] = out.first[p as usize].min(rank[f]);
        }
        for step in &dual.steps {
            let [p, q] = step.faces.map(|f| piece[f as usize]);
            if p != q {
                let pull = step.length * (NEUTRAL - step.turn.max(0.0));
                for (a, b) in [(p, q), (q, p)] {
                    out.boundary[a as usize] += step.length;
                    let border = out.around[a as usize].entry(b).or_insert((0.0, 0.0));
                    *border = (border.0 + step.length, border.1 + pull);
                }
            }
        }
        Ok(out)
    }

    fn root(&self, mut p: u32) -> u32 {
        while self.parent[p as usize] != p {
            p = self.parent[p as usize];
        }
        p
    }

    /// The neighbour of a region that attracts it most.
    fn best_neighbour(&self, p: u32) -> Option<(u32, f64)> {
        let candidates = self.around[p as usize].iter().map(|(&q, &(_, pull))| (q, pull));
        candidates.max_by(|a, b| a.1.total_cmp(&b.1).then(self.first[b.0 as usize].cmp(&self.first[a.0 as usize])))
    }

    fn absorb_small(&mut self, min_area: f64, min_width: f64) {
        let mut queue: std::collections::BTreeSet<(u64, u32, u32)> = Default::default();
        let small = |r: &Regions, p: u32| {
            let (area, boundary) = (r.area[p as usize], r.boundary[p as usize]);
            area < min_area || 2.0 * area < min_width * boundary
        };
        // positive floats are ordered as their bits
        let entry = |r: &Regions, p: u32| (r.area[p as usize].to_bits(), r.first[p as usize], p);
        for p in 0..self.parent.len() as u32 {
            if small(self, p) && !self.around[p as usize].is_empty() {
                queue.insert(entry(self, p));
            }
        }
        while let Some((_, _, p)) = queue.pop_first() {
            let Some((q, _)) = self.best_neighbour(p) else { continue };
            queue.remove(&entry(self, q));
            let r = self.join(p, q);
            if small(self, r) && !self.around[r as usize].is_empty() {
                queue.insert(entry(self, r));
            }
        }
    }

    fn join_to(&mut self, count: usize) {
        while self.left > count.max(1) {
            // the pair with the greatest pull by length of border
            let mut best: Option<(f64, u32, u32, u32)> = None;
            for p in (0..self.parent.len() as u32).filter(|&p| self.parent[p as usize] == p) {
                for (&q, &(length, pull)) in &self.around[p as usize] {
                    let (a, b) = (self.first[p as usize], self.first[q as usize]);
                    let new = (pull / length.max(f64::MIN_POSITIVE), a, p, q);
                    if a < b && best.is_none_or(|old| new.0 > old.0 || (new.0 == old.0 && a < old.1)) {
                        best = Some(new);
                    }
                }
            }
            let Some((_, _, p, q)) = best else { return };
            self.join(p, q);
        }
    }

    /// Makes one region of two; returns the one that stands for it.
    fn join(&mut self, p: u32, q: u32) -> u32 {
        let more = |r: u32| self.around[r as usize].len();
        let (gone, keep) = if more(p) <= more(q) { (p, q) } else { (q, p) };
        let moved = std::mem::take(&mut self.around[gone as usize]);
        let common = self.around[keep as usize].remove(&gone).unwrap_or((0.0, 0.0));
        let mut moved: Vec<(u32, (f64, f64))> = moved.into_iter().filter(|m| m.0 != keep).collect();
        moved.sort_unstable_by_key(|m| m.0);
        for (r, (length, pull)) in moved {
            self.around[r as usize].remove(&gone);
            let border = self.around[keep as usize].entry(r).or_insert((0.0, 0.0));
            *border = (border.0 + length, border.1 + pull);
            let border = *border;
            self.around[r as usize].insert(keep, border);
        }
        let (g, k) = (gone as usize, keep as usize);
        self.area[k] += self.area[g];
        self.boundary[k] = (self.boundary[k] + self.boundary[g] - 2.0 * common.0).max(0.0);
        self.first[k] = self.first[k].min(self.first[g]);
        self.parent[g] = keep;
        self.left -= 1;
        keep
    }
}
