//! Spheres among triangles: how far one can grow before it meets the surface; and what lies in a box.

use super::bvh::{RayMesh, SAME_SURFACE, along, cross, dot, sub};
use super::contact::{Contact, Contacts, HELD, MANY};
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

    /// The largest s at which `q` is no deeper in the sphere than the share `slack` of its radius, for a `q` that is
    /// outside at s = 0 and deeper later: the smaller root of |c + s v - q|^2 = (1 - slack)^2 (r + s g)^2.
    #[inline(always)]
    fn touch(&self, q: [f64; 3], slack: f64) -> f64 {
        let w = sub(self.c, q);
        let (r, g) = (self.r * (1.0 - slack), self.g * (1.0 - slack));
        let (a, b, k) = (self.g - g * g, dot(self.v, w) - r * g, dot(w, w) - r * r);
        let s = k / ((b * b - a * k).max(0.0).sqrt() - b);
        if s > 0.0 { s } else { 0.0 }
    }
}

/// Where a growing sphere stops.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stop {
    pub s: f64,
    /// Whether surface stops it.
    pub stopped: bool,
    /// Radius up to which the sphere about the same centre is empty, as far as is known.
    pub clear: f64,
}

/// Where a sphere touches.
#[derive(Debug, Clone, Copy)]
pub(super) struct Touch {
    /// Distance from its centre to the surface.
    pub d: f64,
    /// False if not all contacts were looked for, because some of them hold the sphere; it may then touch a little
    /// nearer.
    pub all: bool,
}

/// Passes over the tree for one growth. Two or three are usual.
const PASSES: usize = 32;

impl RayMesh {
    /// The largest s up to `s` for which the sphere of `growth` is empty but for surface that reaches no more than the
    /// share `slack` of its radius into it: it shrinks for each point of the surface found deeper in it (Ma, Bae & Choi
    /// 2012). In whichever order they are found, the end is the same.
    #[inline(always)]
    pub(super) fn shrink<L: Lanes>(&self, lanes: L, stack: &mut Stack, growth: &Growth, s: f64, slack: f64) -> Stop {
        let mut stop = Stop { s, stopped: false, clear: 0.0 };
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

    /// Where the largest empty sphere about `c` touches the surface: the places within the share `tolerance` of its
    /// radius from which the surface leads nowhere nearer. Its radius is known to lie between `low` and `high`; the faces
    /// of the places in `contacts` are looked at first.
    ///
    /// Of a sphere that touches at a great many places, such as one that fills a ball, only so many are found as hold it.
    #[inline(always)]
    pub(super) fn touching<L: Lanes>(
        &self,
        lanes: L,
        stack: &mut Stack,
        c: [f64; 3],
        (low, high): (f64, f64),
        tolerance: f64,
        contacts: &mut Contacts,
    ) -> Touch {
        let grown = 1.0 + tolerance;
        let best = contacts.list.drain(..).fold(high, |best, contact| {
            let away = sub(c, closest_on_triangle(c, self.corners(contact.face)));
            best.min(dot(away, away).sqrt())
        });
        let c32 = c.map(|x| x as f32);
        contacts.start();
        let mut finder =
            Finder { mesh: self, contacts, c, c32, best, grown, certain: low * grown, aim: Aim::First, full: false };
        self.tree.approach(lanes, stack, c, best * grown, &mut finder);
        let mut all = true;
        if finder.full {
            // --- one that lies opposite, for all to see
            let first = finder.contacts.list[0];
            finder.aim = Aim::Opposite(first);
            (finder.full, all) = (false, false);
            if first.d <= finder.certain {
                self.tree.approach(lanes, stack, c, finder.best * grown, &mut finder);
            }
            if !finder.full {
                // --- there is none: all after all
                all = true;
                finder.aim = Aim::All;
                finder.contacts.start();
                self.tree.approach(lanes, stack, c, finder.best * grown, &mut finder);
            }
        }
        let d = finder.best;
        contacts.settle(d * grown);
        Touch { d, all }
    }

    /// The faces that `p` (in units of the tree) lies on, in order.
    pub(super) fn faces_at(&self, p: [f64; 3]) -> Vec<u32> {
        let mut faces = Vec::new();
        self.any_face_at(p, |face| {
            faces.push(face);
            false
        });
        faces.sort_unstable();
        faces
    }

    /// Whether `is` holds for any of the faces that `p` lies on.
    pub(super) fn any_face_at(&self, p: [f64; 3], mut is: impl FnMut(u32) -> bool) -> bool {
        self.any_face_near(p.map(|x| x - SAME_SURFACE), p.map(|x| x + SAME_SURFACE), |face| {
            let away = sub(p, closest_on_triangle(p, self.corners(face)));
            dot(away, away) < SAME_SURFACE * SAME_SURFACE && is(face)
        })
    }

    /// Calls `visit` for the faces whose surroundings meet the box from `lo` to `hi` (units of the tree), and some near.
    pub(super) fn faces_near(&self, lo: [f64; 3], hi: [f64; 3], mut visit: impl FnMut(u32)) {
        self.any_face_near(lo, hi, |face| {
            visit(face);
            false
        });
    }

    /// The same until one `is` what is looked for; whether one was.
    fn any_face_near(&self, lo: [f64; 3], hi: [f64; 3], mut is: impl FnMut(u32) -> bool) -> bool {
        let meets = |lo2: [f64; 3], hi2: [f64; 3]| (0..3).all(|a| lo[a] <= hi2[a] && lo2[a] <= hi[a]);
        let mut stack = vec![0u32];
        while let Some(at) = stack.pop() {
            if at & LEAF == 0 {
                let Some(node) = self.tree.nodes.get(at as usize) else { return false };
                for k in 0..8 {
                    let bound = |a: usize| node.bounds[a][k] as f64;
                    if meets([bound(0), bound(1), bound(2)], [bound(3), bound(4), bound(5)]) {
                        stack.push(node.child[k]);
                    }
                }
            } else if let Some(block) = self.tree.blocks.get((at & !LEAF) as usize) {
                if faces_of(block).any(&mut is) {
                    return true;
                }
            }
        }
        false
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
    fn meet(&mut self, corners: [[f64; 3]; 3]) {
        loop {
            let q = closest_on_triangle(self.c, corners);
            let w = sub(self.c, q);
            let d = dot(w, w).sqrt();
            if d >= self.inner {
                self.see(d);
                break;
            }
            let s = self.growth.touch(q, self.slack);
            self.stop.stopped = true;
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
                    self.meet(block.corners(k));
                }
            }
        }
        (self.c, self.stop.clear.max(self.inner))
    }
}

/// Finds where a sphere touches.
struct Finder<'a> {
    mesh: &'a RayMesh,
    contacts: &'a mut Contacts,
    c: [f64; 3],
    c32: [f32; 3],
    /// Distance of the nearest surface seen.
    best: f64,
    grown: f64,
    certain: f64,
    aim: Aim,
    /// True when enough is found.
    full: bool,
}

/// What a search is for.
#[derive(Debug, Clone, Copy)]
enum Aim {
    /// Contacts, but not more than [`MANY`].
    First,
    /// One that holds the sphere together with this one.
    Opposite(Contact),
    All,
}

impl Finder<'_> {
    /// Whether a contact would matter, if it is one.
    #[inline(always)]
    fn wants(&self, new: &Contact) -> bool {
        match self.aim {
            Aim::Opposite(first) => new.d <= self.certain && new.opposes(&first),
            Aim::First | Aim::All => true,
        }
    }

    /// Takes a contact that is wanted; true if that is enough.
    #[inline(always)]
    fn take(&mut self, new: Contact, reach: f64) -> bool {
        self.full = match self.aim {
            Aim::First => self.contacts.list.len() >= MANY,
            Aim::Opposite(_) => true,
            Aim::All => false,
        };
        self.contacts.add(new, reach);
        self.full
    }

    /// The children that may hold something opposite to a contact: all but those that are surely less than 115 degrees
    /// from it.
    #[inline(always)]
    fn opposite(&self, node: &Node, first: &Contact) -> u32 {
        let mut out = 0;
        for k in 0..8 {
            // Of the box the corner furthest on the other side.
            let along: f64 = (0..3)
                .map(|a| {
                    let ends =
                        [node.bounds[a][k], node.bounds[a + 3][k]].map(|x| (self.c[a] - f64::from(x)) * first.up[a]);
                    ends[0].min(ends[1])
                })
                .sum();
            out |= ((along <= HELD * self.certain / self.grown * (1.0 - 1e-3)) as u32) << k;
        }
        out
    }
}

impl Visitor for Finder<'_> {
    #[inline(always)]
    fn worth(&mut self, node: &Node, slab: &Slab, mask: u32) -> u32 {
        if mask == 0 {
            return 0;
        }
        let mask = mask & slab.facing(node, self.c32);
        if let Aim::Opposite(first) = self.aim { mask & self.opposite(node, &first) } else { mask }
    }

    #[inline(always)]
    fn visit(&mut self, block: &Block) -> ([f64; 3], f64) {
        let heights = block.heights(self.c);
        if heights.iter().all(|h| h.abs() >= self.best * self.grown) {
            return (self.c, self.best * self.grown);
        }
        let d2 = block.distances2(self.c, &heights);
        for k in 0..4 {
            let reach = self.best * self.grown;
            if !(d2[k] < reach * reach) {
                continue;
            }
            let (q, feature) = closest_feature(self.c, block.corners(k));
            let away = sub(self.c, q);
            let d = dot(away, away).sqrt();
            if !(d < reach && d > 0.0) {
                continue;
            }
            self.best = self.best.min(d);
            let mut new = Contact { up: away.map(|x| x / d), face: block.face[k], d, local: false };
            new.local = self.contacts.is_local(&new, self.c);
            // what the surface around it leads to is dear to find out
            if self.wants(&new)
                && self.mesh.is_nearest(self.c, (q, feature), new.face, new.up, d)
                && self.take(new, reach)
            {
                return (self.c, 0.0);
            }
        }
        (self.c, self.best * self.grown)
    }
}

/// Where on a triangle a point is: inside, on the edge from the corner of this number on, or at a corner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Feature {
    Inside,
    Edge(u8),
    Corner(u8),
}

/// The point of a triangle nearest to `p`.
#[inline(always)]
pub(super) fn closest_on_triangle(p: [f64; 3], corners: [[f64; 3]; 3]) -> [f64; 3] {
    closest_feature(p, corners).0
}

/// The point of a triangle nearest to `p`, and where it is (Ericson, Real-Time Collision Detection, 5.1.5).
#[inline(always)]
pub(super) fn closest_feature(p: [f64; 3], [a, b, c]: [[f64; 3]; 3]) -> ([f64; 3], Feature) {
    let (ab, ac, ap) = (sub(b, a), sub(c, a), sub(p, a));
    let (d1, d2) = (dot(ab, ap), dot(ac, ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (a, Feature::Corner(0));
    }
    let bp = sub(p, b);
    let (d3, d4) = (dot(ab, bp), dot(ac, bp));
    if d3 >= 0.0 && d4 <= d3 {
        return (b, Feature::Corner(1));
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (along(a, share(d1, -d3), ab), Feature::Edge(0));
    }
    let cp = sub(p, c);
    let (d5, d6) = (dot(ab, cp), dot(ac, cp));
    if d6 >= 0.0 && d5 <= d6 {
        return (c, Feature::Corner(2));
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (along(a, share(d2, -d6), ac), Feature::Edge(2));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return (along(b, share(d4 - d3, d5 - d6), sub(c, b)), Feature::Edge(1));
    }
    let scale = 1.0 / (va + vb + vc);
    (along(along(a, vb * scale, ab), vc * scale, ac), Feature::Inside)
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
