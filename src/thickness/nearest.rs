//! Spheres among triangles: how far one can grow before it meets the surface; and what lies in a box.

use super::bvh::{RayMesh, SAME_SURFACE, along, cross, dot, sub};
use super::contact::{Contact, Contacts, SQUARE};
use super::lanes::Lanes;
use super::tree::{Block, LEAF, Node, Slab, Stack, Visitor, faces_of};

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
            let seen = self.shrink_pass(lanes, stack, growth, slack, &mut stop);
            // A smaller sphere that is not within what was seen has to be looked at again.
            if stop.s == before || stop.s == 0.0 || (seen && growth.g > 1.0 - 1e-9) {
                break;
            }
        }
        stop
    }

    /// One pass over the tree. True if all that may reach into the sphere at its end was seen if spheres that follow
    /// each other lie within each other.
    #[inline(always)]
    fn shrink_pass<L: Lanes>(&self, lanes: L, stack: &mut Stack, growth: &Growth, slack: f64, stop: &mut Stop) -> bool {
        let (c, r) = growth.at(stop.s);
        let mut shrinker = Shrinker { growth, slack, stop, c, inner: 0.0, full: f64::INFINITY, seen: true };
        shrinker.stop.clear = f64::INFINITY;
        shrinker.set(c, r);
        self.tree.approach(lanes, stack, c, shrinker.stop.clear, &mut shrinker);
        shrinker.seen
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
        let best = contacts.list.first().map_or(high, |c| high.min(c.d));
        contacts.start_search(c);
        let mut finder = Finder { contacts, c, best, grown, certain, held: false };
        self.tree.approach(lanes, stack, c, best * grown, &mut finder);
        let (best, held) = (finder.best, finder.held);
        if held {
            return None;
        }
        contacts.settle(best * grown);
        Some(best)
    }

    /// The faces that `p` (in units of the tree) lies on, in order.
    pub(super) fn faces_at(&self, p: [f64; 3]) -> Vec<u32> {
        let mut faces = Vec::new();
        self.faces_near(p.map(|x| x - SAME_SURFACE), p.map(|x| x + SAME_SURFACE), |face| {
            let away = sub(p, closest_on_triangle(p, self.corners(face)));
            if dot(away, away) < SAME_SURFACE * SAME_SURFACE {
                faces.push(face);
            }
        });
        faces.sort_unstable();
        faces
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

/// Shrinks a sphere until less than a share of its radius of any triangle is in it.
struct Shrinker<'a> {
    growth: &'a Growth,
    slack: f64,
    stop: &'a mut Stop,
    c: [f64; 3],
    /// Surface may come this near to the centre.
    inner: f64,
    /// What the clear radius was before any surface was found within it.
    full: f64,
    /// False if surface around an earlier, larger sphere was left out because nearer surface had been found.
    seen: bool,
}

/// The clear radius may be too small by this share of the slack: surfaces at nearly the same distance all around are
/// not all looked at.
const BLUR: f64 = 0.1;

impl Shrinker<'_> {
    #[inline(always)]
    fn set(&mut self, c: [f64; 3], r: f64) {
        self.seen &= self.stop.clear >= self.full;
        self.full = r * (1.0 - self.slack / 2.0);
        (self.c, self.inner, self.stop.clear) = (c, r * (1.0 - self.slack), self.full);
    }

    /// There is surface at the distance `d`.
    #[inline(always)]
    fn see(&mut self, d: f64) {
        self.stop.clear = self.stop.clear.min(d * (1.0 - BLUR * self.slack));
    }

    /// Shrinks to one triangle.
    #[inline(always)]
    fn meet(&mut self, corners: [[f64; 3]; 3], face: u32) {
        loop {
            let q = closest_on_triangle(self.c, corners);
            let w = sub(self.c, q);
            let d = dot(w, w).sqrt();
            if d >= self.inner {
                self.see(d);
                break;
            }
            let s = self.growth.touch(q);
            self.stop.contact = Some((q, face));
            if !(s < self.stop.s * (1.0 - 1e-6)) {
                break;
            }
            self.stop.s = s;
            let (c, r) = self.growth.at(s);
            self.set(c, r);
        }
    }
}

impl Visitor for Shrinker<'_> {
    #[inline(always)]
    fn visit(&mut self, block: &Block) -> ([f64; 3], f64) {
        let heights = block.heights(self.c);
        if heights.iter().all(|h| h.abs() >= self.inner) {
            self.see(heights.iter().fold(f64::INFINITY, |m, h| m.min(h.abs())));
        } else {
            let (d2, seen) = (block.distances2(self.c, &heights), self.c);
            for k in 0..4 {
                if seen == self.c && d2[k] >= self.inner * self.inner {
                    self.see(d2[k].sqrt());
                } else {
                    self.meet(block.corners(k), block.face[k]);
                }
            }
        }
        (self.c, self.stop.clear.max(self.inner))
    }
}

/// Small branches beyond this share of the tolerance are left out, so that what they hold is within it.
const EDGE: f64 = 0.95;

/// Finds where a sphere touches.
struct Finder<'a> {
    contacts: &'a mut Contacts,
    c: [f64; 3],
    /// Distance of the nearest surface seen.
    best: f64,
    grown: f64,
    certain: f64,
    held: bool,
}

impl Visitor for Finder<'_> {
    #[inline(always)]
    fn worth(&mut self, node: (&Node, &Slab), gaps: &[f32; 8], d2: &[f32; 8], mask: u32) -> u32 {
        let edge = self.best * (1.0 + EDGE * (self.grown - 1.0));
        self.contacts.edge2 = edge * edge;
        self.contacts.uncovered(node, gaps, d2, mask)
    }

    #[inline(always)]
    fn visit(&mut self, block: &Block) -> ([f64; 3], f64) {
        let heights = block.heights(self.c);
        let mut near = heights.map(|h| h.abs() < self.best * self.grown);
        if near != [false; 4] {
            self.contacts.cover(block, &heights, &mut near);
        }
        if near == [false; 4] {
            return (self.c, self.best * self.grown);
        }
        let d2 = block.distances2(self.c, &heights);
        for k in 0..4 {
            let reach = self.best * self.grown;
            if !near[k] || d2[k] >= reach * reach {
                continue;
            }
            let away = sub(self.c, closest_on_triangle(self.c, block.corners(k)));
            let d = dot(away, away).sqrt();
            if d < reach && d > 0.0 {
                self.best = self.best.min(d);
                let square = heights[k].abs() > SQUARE * d;
                let new = Contact { up: away.map(|x| x / d), face: block.face[k], d, square, local: false };
                if self.contacts.add(new, self.certain, self.c) {
                    self.held = true;
                    return (self.c, 0.0);
                }
            }
        }
        (self.c, self.best * self.grown)
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

/// Height of a triangle over its longest side.
pub(super) fn height([a, b, c]: [[f64; 3]; 3]) -> f64 {
    let n = cross(sub(b, a), sub(c, a));
    let longest = [sub(b, a), sub(c, b), sub(a, c)].map(|e| dot(e, e)).into_iter().fold(0.0, f64::max);
    if longest > 0.0 { dot(n, n).sqrt() / longest.sqrt() } else { 0.0 }
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
