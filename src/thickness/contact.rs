//! Where an inscribed sphere touches the surface, whether that holds it, and where it can grow.

use super::bvh::{RayMesh, cross, dot, sub};
use super::nearest::{closest_on_segment, closest_on_triangle};
use super::tree::{Block, Node, Slab};

/// Cosine of the angle between two contacts, seen from the centre, from which on they hold the sphere: 115 degrees.
pub(super) const HELD: f64 = -0.422_618_261_740_699_44;

/// Cosine of the angle from which on two contacts hold the sphere even if they are not met squarely: what is nearer
/// around them is on opposite sides too.
const OPPOSITE: f64 = -0.866;

/// The tangent plane at a contact is taken to pass through a point if it is no further from it than this share of the
/// radius.
const TANGENT: f64 = 0.05;

/// Square of the size, as a share of its distance, below which the box of a branch is as good as a point (3 degrees).
const SMALL: f32 = 3e-3;

/// More contacts than this are not told apart; they would be on all sides.
const MOST: usize = 96;

/// One place where the sphere touches.
#[derive(Debug, Clone, Copy)]
pub(super) struct Contact {
    /// Unit vector from the contact to the centre.
    pub up: [f64; 3],
    pub face: u32,
    /// Distance from the centre.
    pub d: f64,
    /// True if the face is met squarely: no surface around can be nearer.
    pub square: bool,
    /// True if its tangent plane passes through the apex.
    pub local: bool,
}

impl Contact {
    /// Whether this and another hold the sphere: they lie on opposite sides, and are not both sides of one wedge.
    #[inline(always)]
    fn opposes(&self, other: &Contact) -> bool {
        dot(self.up, other.up) <= HELD && !(self.local && other.local)
    }
}

/// Cosine of the angle to the normal up to which a face is met squarely (2 degrees).
pub(super) const SQUARE: f64 = 0.9994;

/// Contacts side by side, in single precision.
#[derive(Debug, Clone)]
struct Seen {
    eights: [Eight; MOST.div_ceil(8)],
    /// How many of them are in use.
    full: usize,
}

#[derive(Debug, Clone, Copy)]
#[repr(align(32))]
struct Eight {
    /// As [`Contact::up`].
    up: [[f32; 8]; 3],
    /// Where they are.
    at: [[f32; 8]; 3],
    /// Surface this near or nearer does not count as further away than the contact; infinite where there is none.
    d: [f32; 8],
}

impl Eight {
    #[inline(always)]
    fn cosines(&self, up: [f32; 3]) -> [f32; 8] {
        let mut cos = [0.0; 8];
        for k in 0..8 {
            cos[k] = up[0] * self.up[0][k] + up[1] * self.up[1][k] + up[2] * self.up[2][k];
        }
        cos
    }

    const NONE: Eight = Eight { up: [[0.0; 8]; 3], at: [[0.0; 8]; 3], d: [f32::INFINITY; 8] };
}

impl Default for Seen {
    fn default() -> Seen {
        Seen { eights: [Eight::NONE; MOST.div_ceil(8)], full: 0 }
    }
}

impl Seen {
    /// Sets the contact number `i`; the numbers before it are taken.
    #[inline(always)]
    fn set(&mut self, i: usize, contact: &Contact, rough: f64, c: [f64; 3]) {
        if i / 8 >= self.full {
            self.full = i / 8 + 1;
            self.eights[i / 8] = Eight::NONE;
        }
        let eight = &mut self.eights[i / 8];
        for a in 0..3 {
            eight.up[a][i % 8] = contact.up[a] as f32;
            eight.at[a][i % 8] = (c[a] - contact.d * contact.up[a]) as f32;
        }
        eight.d[i % 8] = (contact.d * rough) as f32;
    }

    /// The first contact in nearly the same direction.
    #[inline(always)]
    fn along(&self, up: [f32; 3], same: f32) -> Option<usize> {
        for i in 0..self.full.min(self.eights.len()) {
            let cos = self.eights[i].cosines(up);
            let mut mask = 0u32;
            for k in 0..8 {
                mask |= ((cos[k] > same) as u32) << k;
            }
            if mask != 0 {
                return Some(8 * i + mask.trailing_zeros() as usize);
            }
        }
        None
    }

    /// Whether what lies beyond a plane at the distance `h`, with its normal `up` towards the centre, need not be seen.
    #[inline(always)]
    fn covers_plane(&self, up: [f32; 3], h: f32, sure: f32) -> bool {
        for i in 0..self.full.min(self.eights.len()) {
            let cos = self.eights[i].cosines(up);
            let mut any = false;
            for k in 0..8 {
                any |= (cos[k] > sure) & (h >= self.eights[i].d[k]);
            }
            if any {
                return true;
            }
        }
        false
    }

    /// Whether a box, whose nearest place is at the squared distance `d2`, need not be seen: all of it is about one
    /// contact, within the square root of `chord` times its distance.
    #[inline(always)]
    fn covers_box(&self, bounds: &[f32; 6], d2: f32, chord: f32) -> bool {
        for i in 0..self.full.min(self.eights.len()) {
            let eight = &self.eights[i];
            let mut far2 = [0.0f32; 8];
            for a in 0..3 {
                for k in 0..8 {
                    let (below, above) = (eight.at[a][k] - bounds[a], bounds[a + 3] - eight.at[a][k]);
                    let far = if below > above { below } else { above };
                    far2[k] += far * far;
                }
            }
            let mut any = false;
            for k in 0..8 {
                let own2 = eight.d[k] * eight.d[k];
                any |= (d2 >= own2) & (far2[k] < chord * own2);
            }
            if any {
                return true;
            }
        }
        false
    }
}

/// All of them.
#[derive(Debug, Clone, Default)]
pub(super) struct Contacts {
    pub list: Vec<Contact>,
    /// Cosine of the angle within which contacts are one.
    same: f64,
    /// The edge of a wedge from which the sphere slides out: its sides do not hold it.
    pub apex: Option<[f64; 3]>,
    /// Contacts this much nearer than a known one, as a share, do not matter.
    rough: f64,
    /// Small branches further than this (squared) are not looked at: they hardly reach into where contacts are.
    pub edge2: f64,
    /// Cosine of what is left of that angle beyond the disk.
    sure: f64,
    /// The list, for quick looks.
    seen: Seen,
}

impl Contacts {
    /// Sets how far from the sphere, as a share of its radius, surface still touches it. Where it touches a plane, that
    /// is a disk on the sphere; contacts less than one and a half times its radius apart are one.
    #[inline(always)]
    pub fn set_tolerance(&mut self, tolerance: f64) {
        let disk = (1.0 / (1.0 + tolerance)).acos();
        self.same = (1.5 * disk + 0.03).cos();
        self.rough = 1.0 - 0.1 * tolerance;
        self.sure = (0.5 * disk + 0.03).cos();
    }

    /// In which lanes of `block`, whose planes are at the signed `heights`, no look is needed: where a known contact is
    /// at hand, the triangle can only touch further away (or hardly nearer) and in nearly the same direction.
    #[inline(always)]
    pub fn cover(&self, block: &Block, heights: &[f64; 4], near: &mut [bool; 4]) {
        for k in 0..4 {
            if near[k] {
                let towards = if heights[k] > 0.0 { 1.0 } else { -1.0 };
                let up = std::array::from_fn(|a| (towards * block.normal[a][k]) as f32);
                near[k] = !self.seen.covers_plane(up, heights[k].abs() as f32, self.sure as f32);
            }
        }
    }

    /// As [`Contacts::cover`], for what lies in the boxes of a node and between its planes: at the signed distances
    /// `gaps`, and at the squared distances `d2` or further. Of the children in `mask`, those that need a look.
    #[inline(always)]
    pub fn uncovered(&self, (node, slab): (&Node, &Slab), gaps: &[f32; 8], d2: &[f32; 8], mask: u32) -> u32 {
        let (sure, chord) = (self.sure as f32, (2.0 - 2.0 * self.same) as f32);
        let edge = self.edge2 as f32;
        let (mut left, mut out) = (mask, 0);
        while left != 0 {
            let k = (left.trailing_zeros() & 7) as usize;
            left &= left - 1;
            let towards = if gaps[k] > 0.0 { 1.0 } else { -1.0 };
            let up = std::array::from_fn(|a| towards * slab.axis[a][k]);
            let mut bounds = std::array::from_fn(|a| node.bounds[a][k]);
            let (mut chord, mut size2) = (0.9 * chord, 0.0);
            for a in 0..3 {
                size2 += (bounds[a + 3] - bounds[a]) * (bounds[a + 3] - bounds[a]);
            }
            if size2 < SMALL * d2[k] {
                // So small that its middle tells: else all along the border of what is covered would be looked at.
                if d2[k] > edge {
                    continue;
                }
                for a in 0..3 {
                    let middle = (bounds[a] + bounds[a + 3]) / 2.0;
                    (bounds[a], bounds[a + 3]) = (middle, middle);
                }
                chord /= 0.9;
            }
            let covered =
                self.seen.covers_plane(up, gaps[k].abs(), sure) || self.seen.covers_box(&bounds, d2[k], chord);
            out |= (!covered as u32) << k;
        }
        out
    }

    /// Prepares for [`Contacts::cover`], [`Contacts::uncovered`] and [`Contacts::add`] about the centre `c`.
    pub fn start_search(&mut self, c: [f64; 3]) {
        self.seen.full = 0;
        for (i, contact) in self.list.iter().enumerate() {
            self.seen.set(i, contact, self.rough, c);
        }
    }

    /// Adds a contact, or moves a similar one closer. True if it surely holds the sphere together with another, both
    /// no further than `certain`.
    #[inline(always)]
    pub fn add(&mut self, mut new: Contact, certain: f64, c: [f64; 3]) -> bool {
        new.local = self.is_local(&new, c);
        let known = self.seen.along(new.up.map(|x| x as f32), self.same as f32);
        if let Some(other) = known.and_then(|i| self.list.get_mut(i)) {
            if new.d < other.d {
                *other = new;
                self.seen.set(known.unwrap_or(0), &new, self.rough, c);
            }
            return false;
        }
        let held = self.list.iter().any(|other| {
            new.opposes(other)
                && (dot(other.up, new.up) <= OPPOSITE || (new.square && other.square))
                && new.d <= certain
                && other.d <= certain
        });
        if self.list.len() < MOST {
            self.seen.set(self.list.len(), &new, self.rough, c);
        }
        self.push(new);
        held
    }

    /// Adds a contact, whatever else there is; false if there are too many.
    #[inline(always)]
    pub fn push(&mut self, new: Contact) -> bool {
        if self.list.len() < MOST {
            self.list.push(new);
        }
        self.list.len() < MOST
    }

    /// Whether the tangent plane at a contact of the sphere about `c` passes through the apex.
    #[inline(always)]
    fn is_local(&self, contact: &Contact, c: [f64; 3]) -> bool {
        self.apex.is_some_and(|apex| (dot(sub(c, apex), contact.up) - contact.d).abs() < TANGENT * contact.d)
    }

    /// Sees the contacts' faces from a new centre and keeps those met squarely within `reach`. True if two of them, both
    /// no further than `certain`, hold the sphere.
    #[inline(always)]
    pub fn look_from(&mut self, mesh: &RayMesh, c: [f64; 3], reach: f64, certain: f64) -> bool {
        let mut list = std::mem::take(&mut self.list);
        for contact in &mut list {
            let away = sub(c, closest_on_triangle(c, mesh.corners(contact.face)));
            contact.d = dot(away, away).sqrt();
            contact.up = away.map(|x| x / contact.d);
            contact.square = dot(contact.up, mesh.normals[contact.face as usize]).abs() > SQUARE;
            contact.local = self.is_local(contact, c);
        }
        list.retain(|contact| contact.d < reach && contact.d > 0.0);
        let opposite = |a: &Contact, b: &Contact| {
            a.d <= certain && b.d <= certain && dot(a.up, b.up) <= OPPOSITE && !(a.local && b.local)
        };
        let held = list.iter().enumerate().any(|(i, a)| list[..i].iter().any(|b| opposite(a, b)));
        list.retain(|contact| held || contact.square);
        self.list = list;
        if held {
            return true;
        }
        self.settle(reach);
        self.hold(certain)
    }

    /// Keeps the contacts within `reach`, and of similar ones the nearest.
    pub fn settle(&mut self, reach: f64) {
        self.list.retain(|contact| contact.d <= reach);
        self.list.sort_by(|a, b| a.d.total_cmp(&b.d));
        let mut kept = 0;
        for i in 0..self.list.len() {
            let contact = self.list[i];
            if self.list[..kept].iter().all(|other| dot(other.up, contact.up) <= self.same) {
                self.list[kept] = contact;
                kept += 1;
            }
        }
        self.list.truncate(kept);
    }

    /// Whether two contacts no further than `reach` lie on opposite sides.
    #[inline(always)]
    pub fn hold(&self, reach: f64) -> bool {
        let near: fn(&&Contact, f64) -> bool = |c, reach| c.d <= reach;
        let opposed = |(i, a): (usize, &Contact)| {
            a.d <= reach && self.list[..i].iter().filter(|b| near(b, reach)).any(|b| a.opposes(b))
        };
        self.list.iter().enumerate().any(opposed)
    }

    /// The two contacts that are most opposed: the cosine of the angle between them, and half the way between them,
    /// which is the radius of the sphere that they hold, to second order in how far this one is off.
    pub fn most_opposed(&self) -> (f64, f64) {
        let mut best = (1.0, f64::NAN);
        for (i, a) in self.list.iter().enumerate() {
            for b in self.list[..i].iter().filter(|b| !(a.local && b.local)) {
                let cos = dot(a.up, b.up);
                if cos < best.0 {
                    best = (cos, (a.d + b.d) / 2.0);
                }
            }
        }
        best
    }

    /// The radius of the sphere that two contacts hold; None if there are no such two.
    pub fn held_radius(&self) -> Option<f64> {
        let (cos, radius) = self.most_opposed();
        (cos <= HELD).then_some(radius)
    }

    /// The shortest vector of the convex hull of the contacts' directions: moving along it the centre leaves all
    /// contacts at the same rate or faster, and no direction does better. Zero if they surround the centre.
    pub fn fastest(&self) -> [f64; 3] {
        let Some(first) = self.list.first() else { return [0.0; 3] };
        // Corners of the hull's face nearest to the centre, one replaced at a time (Wolfe 1976, in three dimensions).
        let (mut face, mut corners) = ([first.up; 4], 1);
        let mut best = first.up;
        for _ in 0..64 {
            let least = dot(best, best);
            let ahead = self.list.iter().map(|c| c.up).min_by(|a, b| dot(*a, best).total_cmp(&dot(*b, best)));
            let Some(new) = ahead.filter(|u| dot(*u, best) < least - 1e-9) else { return best };
            face[corners] = new;
            if corners == 3 && surround(face) {
                return [0.0; 3];
            }
            let (v, next, left) = shortest(&face[..=corners]);
            if dot(v, v) >= least {
                return best;
            }
            (best, face, corners) = (v, next, left);
        }
        best
    }
}

/// Whether the origin lies in the tetrahedron of four points.
fn surround([a, b, c, d]: [[f64; 3]; 4]) -> bool {
    let side = |p, q, r, s| {
        let n = cross(sub(q, p), sub(r, p));
        dot(n, p) * dot(n, sub(p, s)) > 1e-12
    };
    side(a, b, c, d) && side(b, c, d, a) && side(c, d, a, b) && side(d, a, b, c)
}

/// The shortest vector among the triangles of up to four points, and the corners of the triangle that has it: how many.
fn shortest(points: &[[f64; 3]]) -> ([f64; 3], [[f64; 3]; 4], usize) {
    let mut best = (points[0], [points[0]; 4], 1);
    let mut offer = |v: [f64; 3], [a, b, c]: [[f64; 3]; 3], corners: usize| {
        if dot(v, v) < dot(best.0, best.0) {
            best = (v, [a, b, c, c], corners);
        }
    };
    for (i, &a) in points.iter().enumerate() {
        offer(a, [a, a, a], 1);
        for (j, &b) in points[..i].iter().enumerate() {
            offer(closest_on_segment(a, b), [a, b, b], 2);
            for &c in &points[..j] {
                offer(closest_on_triangle([0.0; 3], [a, b, c]), [a, b, c], 3);
            }
        }
    }
    best
}
