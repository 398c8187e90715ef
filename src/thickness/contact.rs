//! Where an inscribed sphere touches the surface, whether that holds it, and where it can grow.

use super::bvh::{cross, dot, sub};
use super::nearest::{closest_on_segment, closest_on_triangle};

/// Cosine of the angle between two contacts, seen from the centre, from which on they hold the sphere: 115 degrees.
pub(super) const HELD: f64 = -0.422_618_261_740_699_44;

/// The tangent plane at a contact is taken to pass through a point if it is no further from it than this share of the
/// radius.
const TANGENT: f64 = 0.05;

/// Cosine of the angle by which a contact moves at most while a sphere slides (25 degrees).
const MOVED: f64 = 0.906;

/// Contacts closer together than this, in radians seen from the centre, are one,
const SAME: f64 = 1e-3;
/// or further, where there would be more than this.
const MOST: usize = 128;

/// With more contacts than this two that hold the sphere are enough.
pub(super) const MANY: usize = 48;

/// One place where the sphere touches.
#[derive(Debug, Clone, Copy)]
pub(super) struct Contact {
    /// Unit vector from the contact to the centre.
    pub up: [f64; 3],
    pub face: u32,
    /// Distance from the centre.
    pub d: f64,
    /// True if its tangent plane passes through the apex.
    pub local: bool,
}

impl Contact {
    /// Whether this and another hold the sphere: they lie on opposite sides, and are not both sides of one wedge.
    #[inline(always)]
    pub fn opposes(&self, other: &Contact) -> bool {
        dot(self.up, other.up) <= HELD && !(self.local && other.local)
    }
}

/// All of them.
#[derive(Debug, Clone, Default)]
pub(super) struct Contacts {
    pub list: Vec<Contact>,
    /// The edge of a wedge from which the sphere slides out: its sides do not hold it.
    pub apex: Option<[f64; 3]>,
    /// Contacts closer together than this, in radians seen from the centre, are one: the nearer.
    same: f64,
}

impl Contacts {
    /// Forgets all contacts but what they are told apart by.
    pub fn start(&mut self) {
        self.list.clear();
        self.same = SAME;
    }

    /// Adds a contact; none further than `reach` matters.
    #[inline(always)]
    pub fn add(&mut self, new: Contact, reach: f64) {
        if self.same > SAME {
            let cos = self.same.cos();
            if let Some(other) = self.list.iter_mut().find(|other| dot(other.up, new.up) > cos) {
                if new.d < other.d {
                    *other = new;
                }
                return;
            }
        }
        self.list.push(new);
        while self.list.len() >= MOST {
            self.same *= 2.0;
            self.settle(reach);
        }
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
    pub fn is_local(&self, contact: &Contact, c: [f64; 3]) -> bool {
        self.apex.is_some_and(|apex| (dot(sub(c, apex), contact.up) - contact.d).abs() < TANGENT * contact.d)
    }

    /// Keeps the contacts within `reach`, and of those in one place the nearest.
    pub fn settle(&mut self, reach: f64) {
        self.list.retain(|contact| contact.d <= reach);
        self.list.sort_unstable_by(|a, b| a.d.total_cmp(&b.d).then(a.up[0].total_cmp(&b.up[0])));
        let cos = self.same.cos();
        let mut kept = 0;
        for i in 0..self.list.len() {
            let contact = self.list[i];
            if self.list[..kept].iter().all(|other| dot(other.up, contact.up) <= cos) {
                self.list[kept] = contact;
                kept += 1;
            }
        }
        self.list.truncate(kept);
    }

    /// Whether two contacts lie on opposite sides.
    #[inline(always)]
    pub fn hold(&self) -> bool {
        self.list.iter().enumerate().any(|(i, a)| self.list[..i].iter().any(|b| a.opposes(b)))
    }

    /// The two contacts that are most opposed, the cosine of the angle between them first.
    fn opposed(&self) -> Option<(f64, &Contact, &Contact)> {
        let mut best: Option<(f64, &Contact, &Contact)> = None;
        for (i, a) in self.list.iter().enumerate() {
            for b in self.list[..i].iter().filter(|b| !(a.local && b.local)) {
                let cos = dot(a.up, b.up);
                if best.is_none_or(|best| cos < best.0) {
                    best = Some((cos, a, b));
                }
            }
        }
        best
    }

    /// The two contacts that are most opposed: the cosine of the angle between them, and half the way between them,
    /// which is the radius of the sphere that they hold, to second order in how far this one is off.
    pub fn most_opposed(&self) -> (f64, f64) {
        self.opposed().map_or((1.0, f64::NAN), |(cos, a, b)| (cos, (a.d + b.d) / 2.0))
    }

    /// The share of its way at which a sphere that slid from where it touched at `before` was first held; none if what
    /// holds it now was not there before.
    pub fn first_held(&self, before: &Contacts) -> Option<f64> {
        let (now, a, b) = self.opposed()?;
        let was = before.opposed()?.0;
        let known = |contact: &Contact| before.list.iter().any(|c| dot(c.up, contact.up) > MOVED);
        (was > HELD && now <= HELD && known(a) && known(b)).then(|| (was - HELD) / (was - now))
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
