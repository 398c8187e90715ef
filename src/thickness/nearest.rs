//! Spheres among triangles: how far one can grow before it meets the surface; and what lies in a box.

use super::bvh::{RayMesh, along, dot, sub};
use super::contact::{Contact, Contacts, SQUARE};
use super::lanes::Lanes;
use super::tree::{LEAF, Stack, faces_of, sort_new, up};

/// Spheres about c + s v of radius r + s |v|^2, for s >= 0.
#[derive(Debug, Clone, Copy)]
pub(super) struct Growth {
    pub c: [f64; 3],
    pub r: f64,
    pub v: [f64; 3],
    /// |v|^2, at most 1. At 1 every sphere holds all smaller ones.
    pub g: f64,
}

impl Growth {
    #[inline(always)]
    pub fn at(&self, s: f64) -> ([f64; 3], f64) {
        (along(self.c, s, self.v), self.r + s * self.g)
    }

    /// The largest s at which the sphere touches `q` from outside, for a `q` that is outside at s = 0 and inside later:
    /// the smaller root of |c + s v - q|^2 = (r + s g)^2.
    #[inline(always)]
    fn touch(&self, q: [f64; 3]) -> f64 {
        let w = sub(self.c, q);
        let (a, b, k) = (self.g - self.g * self.g, dot(self.v, w) - self.r * self.g, dot(w, w) - self.r * self.r);
        let s = k / ((b * b - a * k).max(0.0).sqrt() - b);
        if s > 0.0 { s } else { 0.0 }
    }
}

/// Where a growing sphere stops.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stop {
    pub s: f64,
    /// The point of the surface that stops it, and its face; none if the surface did not need to shrink it.
    pub contact: Option<([f64; 3], u32)>,
    /// Radius up to which the sphere about the same centre is empty, as far as is known.
    pub clear: f64,
}

/// Passes over the tree for one growth. Two or three are usual.
const PASSES: usize = 32;

impl RayMesh {
    /// The largest s up to `s` for which the sphere of `growth` is empty but for surface that reaches less than the
    /// share `slack` of its radius into it: it shrinks to each point of the surface found in it (Ma, Bae & Choi 2012).
    #[inline(always)]
    pub(super) fn shrink<L: Lanes>(&self, lanes: L, stack: &mut Stack, growth: &Growth, s: f64, slack: f64) -> Stop {
        let mut stop = Stop { s, contact: None, clear: 0.0 };
        for _ in 0..PASSES {
            let before = stop.s;
            self.shrink_pass(lanes, stack, growth, slack, &mut stop);
            // A smaller sphere that is not within the larger one has to be looked at again.
            if stop.s == before || stop.s == 0.0 || growth.g > 1.0 - 1e-9 {
                break;
            }
        }
        stop
    }

    #[inline(always)]
    fn shrink_pass<L: Lanes>(&self, lanes: L, stack: &mut Stack, growth: &Growth, slack: f64, stop: &mut Stop) {
        let (mut c, mut r) = growth.at(stop.s);
        let (mut inner, mut outer) = (r * (1.0 - slack), r * (1.0 - slack / 2.0));
        stop.clear = outer;
        let mut d2 = [0.0f32; 8];
        let mut at = 0u32;
        stack.clear();
        loop {
            if at & LEAF == 0 {
                let Some(node) = self.tree.nodes.get(at as usize) else { return };
                let c32 = [c[0] as f32, c[1] as f32, c[2] as f32];
                let mut mask = lanes.distances(node, c32, up(outer * outer), &mut d2);
                let base = stack.len();
                while mask != 0 {
                    let k = (mask.trailing_zeros() & 7) as usize;
                    mask &= mask - 1;
                    stack.push((d2[k], node.child[k]));
                }
                sort_new(stack, base);
            } else {
                let Some(block) = self.tree.blocks.get((at & !LEAF) as usize) else { return };
                let heights = block.heights(c);
                for k in 0..4 {
                    if heights[k].abs() >= outer {
                        continue;
                    }
                    let corners = block.corners(k);
                    loop {
                        let q = closest_on_triangle(c, corners);
                        let w = sub(c, q);
                        let d = dot(w, w).sqrt();
                        if d >= inner {
                            stop.clear = stop.clear.min(d);
                            break;
                        }
                        let s = growth.touch(q);
                        stop.contact = Some((q, block.face[k]));
                        if !(s < stop.s * (1.0 - 1e-6)) {
                            break;
                        }
                        stop.s = s;
                        (c, r) = growth.at(s);
                        (inner, outer) = (r * (1.0 - slack), r * (1.0 - slack / 2.0));
                        stop.clear = outer;
                        if s == 0.0 {
                            return;
                        }
                    }
                }
            }
            at = match stack.pop() {
                Some((_, child)) => child,
                None => return,
            };
        }
    }

    /// Where the largest empty sphere about `c` touches the surface: all places within the share `tolerance` of its
    /// radius, one for each few degrees of direction. That radius is known to lie between `low` and `high`; the places
    /// already in `contacts` are candidates. Returns the radius, unless two contacts are found to hold the sphere
    /// before it is known exactly; then nothing.
    #[inline(always)]
    pub(super) fn touching<L: Lanes>(
        &self,
        lanes: L,
        stack: &mut Stack,
        c: [f64; 3],
        (low, high): (f64, f64),
        tolerance: f64,
        contacts: &mut Contacts,
    ) -> Option<f64> {
        let grown = 1.0 + tolerance;
        let certain = low * grown;
        contacts.set_tolerance(tolerance);
        if contacts.look_from(self, c, high * grown, certain) {
            return None;
        }
        let c32 = [c[0] as f32, c[1] as f32, c[2] as f32];
        let mut best = contacts.list.first().map_or(high, |c| high.min(c.d));
        let mut d2 = [0.0f32; 8];
        let mut at = 0u32;
        stack.clear();
        loop {
            let reach = best * grown;
            if at & LEAF == 0 {
                let Some(node) = self.tree.nodes.get(at as usize) else { break };
                let mut mask = lanes.distances(node, c32, up(reach * reach), &mut d2);
                let base = stack.len();
                while mask != 0 {
                    let k = (mask.trailing_zeros() & 7) as usize;
                    mask &= mask - 1;
                    stack.push((d2[k], node.child[k]));
                }
                sort_new(stack, base);
            } else if let Some(block) = self.tree.blocks.get((at & !LEAF) as usize) {
                let heights = block.heights(c);
                for k in 0..4 {
                    let reach = best * grown;
                    let h = heights[k];
                    if h.abs() >= reach || contacts.cover(block.outward(k), h) {
                        continue;
                    }
                    let away = sub(c, closest_on_triangle(c, block.corners(k)));
                    let d = dot(away, away).sqrt();
                    if d < reach && d > 0.0 {
                        best = best.min(d);
                        let square = h.abs() > SQUARE * d;
                        if contacts.add(Contact { up: away.map(|x| x / d), face: block.face[k], d, square }, certain) {
                            return None;
                        }
                    }
                }
            }
            let reach = best * grown;
            at = loop {
                match stack.pop() {
                    Some((d2, child)) if d2 <= up(reach * reach) => break child,
                    Some(_) => {}
                    None => {
                        contacts.settle(reach);
                        return Some(best);
                    }
                }
            };
        }
        Some(best)
    }

    /// Calls `visit` for the faces whose surroundings meet the box from `lo` to `hi` (units of the tree), and some near.
    pub(super) fn faces_near(&self, lo: [f64; 3], hi: [f64; 3], mut visit: impl FnMut(u32)) {
        let meets = |lo2: [f64; 3], hi2: [f64; 3]| (0..3).all(|a| lo[a] <= hi2[a] && lo2[a] <= hi[a]);
        let mut stack = vec![0u32];
        while let Some(at) = stack.pop() {
            if at & LEAF == 0 {
                let Some(node) = self.tree.nodes.get(at as usize) else { return };
                for k in 0..8 {
                    let bound = |a: usize| node.bounds[a][k] as f64;
                    if meets([bound(0), bound(1), bound(2)], [bound(3), bound(4), bound(5)]) {
                        stack.push(node.child[k]);
                    }
                }
            } else if let Some(block) = self.tree.blocks.get((at & !LEAF) as usize) {
                faces_of(block).for_each(&mut visit);
            }
        }
    }
}

/// The point of a triangle nearest to `p` (Ericson, Real-Time Collision Detection, 5.1.5).
#[inline(always)]
pub(super) fn closest_on_triangle(p: [f64; 3], [a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    let (ab, ac, ap) = (sub(b, a), sub(c, a), sub(p, a));
    let (d1, d2) = (dot(ab, ap), dot(ac, ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = sub(p, b);
    let (d3, d4) = (dot(ab, bp), dot(ac, bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return along(a, share(d1, -d3), ab);
    }
    let cp = sub(p, c);
    let (d5, d6) = (dot(ab, cp), dot(ac, cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return along(a, share(d2, -d6), ac);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return along(b, share(d4 - d3, d5 - d6), sub(c, b));
    }
    let scale = 1.0 / (va + vb + vc);
    along(along(a, vb * scale, ab), vc * scale, ac)
}

/// `a / (a + b)` of two numbers that are not negative.
#[inline(always)]
fn share(a: f64, b: f64) -> f64 {
    if a > 0.0 { a / (a + b) } else { 0.0 }
}

/// The point of the segment from `a` to `b` nearest to the origin.
pub(super) fn closest_on_segment(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    let ab = sub(b, a);
    let t = share((-dot(a, ab)).max(0.0), dot(b, ab).max(0.0));
    along(a, t, ab)
}
