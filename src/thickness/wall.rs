//! The wall width: how wide the part is where a point of its surface lies, by an inscribed sphere that is held from
//! opposite sides.
//!
//! The paper's D2 at a point is the diameter of the largest inscribed sphere that touches the surface there. Near a
//! convex edge that sphere is small, because it touches the face around the corner: a fact about the corner, not about
//! the width of the part. The wall width lets such a sphere grow on:
//!
//! 1. A sphere of radius 0 sits at the point and grows, moving away from the surface, as fast as the contact with the
//!    faces at the point allows, until it touches the surface elsewhere.
//! 2. If two of its contacts lie on opposite sides of it, at least 115 degrees apart seen from its centre (their
//!    tangent planes are within 65 degrees of parallel, the limit of Pusicha 2025), it is held: its diameter is the
//!    wall width. Between contacts closer than that it sits in a corner.
//! 3. In a corner it slides out, keeping its contacts, in the direction in which it grows fastest (the steepest ascent
//!    of the distance to the surface), until it touches a further face: back to 2. It also ends where no direction
//!    lets it grow.
//!
//! So a plate reads its thickness on its sides, on its rim and at its corners, a bar its width also on its ends, a
//! sphere its diameter, a wedge sharper than 65 degrees the sphere between its sides (and 0 on its edge), a blunter
//! corner, such as that of a tetrahedron, the sphere that fits the body behind it. The sphere depends on where the
//! surface is, not on how it is cut into triangles.

use super::bvh::{RayMesh, SAME_SURFACE, along, dot, sub};
use super::exposed::Exposed;
use super::lanes::{Lanes, Work, with_best};
use super::nearest::{Near, closest_on_segment, closest_on_triangle};
use super::tree::Stack;
use crate::error::{Error, Result, try_filled, try_vec};
use crate::job::Job;
use rayon::prelude::*;

/// Cosine of the angle between two contacts, seen from the centre, from which on they hold the sphere: 115 degrees.
const HELD: f64 = -0.422_618_261_740_699_44;

/// Surface may reach this deep into a sphere, as a share of its radius, without counting as a contact: the facets of
/// round surfaces do. The width is corrected for it at the end.
const SLACK: f64 = 5e-3;

/// A contact is lost when the sphere is further from it than this share of its radius.
const LOST: f64 = 1e-2;

/// A corner is left in few steps; on badly faceted surfaces the sphere of the last step is as good.
const STEPS: usize = 24;

/// Corrections of one step. Each makes the sphere smaller; some five are usual.
const CORRECTIONS: usize = 48;

/// Triangles lower than this (in units of the tree) have no trustworthy normal: corners of files in single precision
/// are off by up to a thirtieth of it.
const FLAT: f64 = 4e-6;

/// Points in one piece of parallel work.
const CHUNK: usize = 256;

/// Wall widths at points of the surface.
#[derive(Debug, Clone, Default)]
pub struct Walls {
    /// Width at each point, in the caller's unit; NaN where there is none.
    pub width: Vec<f64>,
    /// Centre of the sphere of that width; NaN likewise.
    pub centre: Vec<[f64; 3]>,
    /// Points inside another, overlapping shell: not on the surface of the part.
    pub buried: u64,
    /// Points where nothing ends the sphere, because the surface is open.
    pub open: u64,
    /// Points on faces without area only.
    pub degenerate: u64,
}

/// Where the sphere rests.
#[derive(Debug, Clone, Copy)]
struct Contact {
    /// Unit vector from the contact to the centre.
    up: [f64; 3],
    face: u32,
}

/// What became of one point.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Outcome {
    Ball([f64; 3], f64),
    Buried,
    Open,
    Degenerate,
}

/// A mesh ready for measuring wall widths: the surface of the union of its shells.
#[derive(Debug)]
pub struct WallMesh {
    surface: Exposed,
}

impl WallMesh {
    /// Prepares a mesh (corner indices into `positions`, counterclockwise seen from outside). Where connected shells
    /// overlap, the parts of each inside another are left out.
    ///
    /// # Errors
    /// As [`RayMesh::new`].
    pub fn new(positions: &[[f64; 3]], triangles: &[[u32; 3]], job: &Job) -> Result<WallMesh> {
        Ok(WallMesh { surface: Exposed::new(positions, triangles, job)? })
    }

    /// Wall widths at `points`, each on the face of this mesh with the id in `parents` (not on its border, where
    /// [`WallMesh::vertex_widths`] knows more). Reports `points.len()` units to `job`.
    ///
    /// # Errors
    /// [`Error::Internal`] if the lengths differ or an id is out of range; [`Error::NoMemory`], [`Error::Cancelled`].
    pub fn point_widths(&self, points: &[[f64; 3]], parents: &[u32], job: &Job) -> Result<Walls> {
        let faces = self.surface.face_count() as u32;
        if points.len() != parents.len() || parents.iter().any(|&f| f >= faces) {
            return Err(Error::Internal("wall widths: points and parents do not match".into()));
        }
        self.measure(points, Parents::One(parents), job)
    }

    /// Wall widths at the vertices of a surface that refines this mesh: `positions` and `triangles`, each lying in the
    /// face of this mesh with the id in `parents`. At a vertex all faces that meet there are taken into account, so
    /// that a vertex of an edge or a corner has one width. NaN and `degenerate` at vertices of no triangle. Reports
    /// `positions.len()` units to `job`.
    ///
    /// # Errors
    /// [`Error::Internal`] if the lengths differ or an id is out of range; [`Error::NoMemory`], [`Error::Cancelled`].
    pub fn vertex_widths(
        &self,
        positions: &[[f64; 3]],
        triangles: &[[u32; 3]],
        parents: &[u32],
        job: &Job,
    ) -> Result<Walls> {
        let faces = self.surface.face_count() as u32;
        let stray = triangles.iter().flatten().any(|&v| v as usize >= positions.len());
        if triangles.len() != parents.len() || stray || parents.iter().any(|&f| f >= faces) {
            return Err(Error::Internal("wall widths: triangles and parents do not match".into()));
        }
        // Parents around each vertex, one list after the other.
        let mut start = try_filled(positions.len() + 1, 0usize, "faces around vertices")?;
        triangles.iter().flatten().for_each(|&v| start[v as usize] += 1);
        let mut sum = 0;
        for s in &mut start {
            sum += *s;
            *s = sum;
        }
        let mut around = try_filled(sum, 0u32, "faces around vertices")?;
        for (t, &parent) in triangles.iter().zip(parents).rev() {
            for &v in t {
                start[v as usize] -= 1;
                around[start[v as usize]] = parent;
            }
        }
        self.measure(positions, Parents::Around(&start, &around), job)
    }

    fn measure(&self, points: &[[f64; 3]], parents: Parents, job: &Job) -> Result<Walls> {
        let order = near_each_other(self.surface.mesh(), points)?;
        let pieces: Result<Vec<Vec<Outcome>>> = order
            .par_chunks(CHUNK)
            .map(|piece| {
                let mut out = try_vec(piece.len(), "wall widths")?;
                with_best(Piece { surface: &self.surface, points, parents, piece, out: &mut out });
                job.advance(piece.len() as u64)?;
                Ok(out)
            })
            .collect();
        let mut walls = Walls {
            width: try_filled(points.len(), f64::NAN, "wall widths")?,
            centre: try_filled(points.len(), [f64::NAN; 3], "wall centres")?,
            ..Walls::default()
        };
        for (&i, outcome) in order.iter().zip(pieces?.iter().flatten()) {
            match *outcome {
                Outcome::Ball(c, r) => {
                    walls.width[i as usize] = self.surface.mesh().to_length(2.0 * r);
                    walls.centre[i as usize] = self.surface.mesh().to_caller(c);
                }
                Outcome::Buried => walls.buried += 1,
                Outcome::Open => walls.open += 1,
                Outcome::Degenerate => walls.degenerate += 1,
            }
        }
        Ok(walls)
    }
}

/// The faces on which each point lies.
#[derive(Debug, Clone, Copy)]
enum Parents<'a> {
    One(&'a [u32]),
    /// Where each point's list starts (and the last ends), and the lists.
    Around(&'a [usize], &'a [u32]),
}

impl<'a> Parents<'a> {
    fn of(self, point: usize) -> &'a [u32] {
        match self {
            Parents::One(parents) => &parents[point..point + 1],
            Parents::Around(start, lists) => &lists[start[point]..start[point + 1]],
        }
    }
}

struct Piece<'a> {
    surface: &'a Exposed,
    points: &'a [[f64; 3]],
    parents: Parents<'a>,
    piece: &'a [u32],
    out: &'a mut Vec<Outcome>,
}

impl Work for Piece<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let mesh = self.surface.mesh();
        let mut grower = Grower { mesh, lanes, stack: Stack::new(), contacts: Vec::new(), empty: ([0.0; 3], 0.0) };
        let mut faces = Vec::new();
        for &i in self.piece {
            let p = mesh.to_unit(self.points[i as usize]);
            let parents = self.parents.of(i as usize);
            faces.clear();
            self.surface.faces_at(p, parents, &mut faces);
            let buried = faces.is_empty() && !parents.is_empty();
            self.out.push(if buried { Outcome::Buried } else { grower.grow(p, &faces) });
        }
    }
}

/// Grows spheres, one after the other.
struct Grower<'a, L> {
    mesh: &'a RayMesh,
    lanes: L,
    stack: Stack,
    contacts: Vec<Contact>,
    /// A sphere known to hold no surface.
    empty: ([f64; 3], f64),
}

impl<L: Lanes> Grower<'_, L> {
    #[inline(always)]
    fn grow(&mut self, p: [f64; 3], faces: &[u32]) -> Outcome {
        // --- step 1: rest on the faces at the point
        if !self.rest_on(faces) {
            return Outcome::Degenerate;
        }
        let (mut c, mut r) = (p, 0.0);
        for _ in 0..STEPS {
            // --- step 2: held?
            if self.is_held() {
                break;
            }
            // --- step 3: the direction in which the sphere grows fastest, and how far it gets
            let v = fastest(&self.contacts);
            if dot(v, v) < 1e-4 {
                break;
            }
            let Some((s, near)) = self.advance(c, r, v) else { return Outcome::Open };
            c = along(c, s, v);
            r += s * dot(v, v);
            self.keep_contacts(c, r, near);
        }
        match self.mesh.nearest(self.lanes, &mut self.stack, c, r * r) {
            Some(near) if near.d2.sqrt() > 0.9 * r => r = near.d2.sqrt(),
            _ => {}
        }
        Outcome::Ball(c, r)
    }

    /// Contacts with the faces at the point; of faces with nearly the same normal one is enough.
    #[inline(always)]
    fn rest_on(&mut self, faces: &[u32]) -> bool {
        self.contacts.clear();
        for least in [FLAT, 0.0] {
            for &face in faces {
                let up = self.mesh.normals[face as usize].map(|x| -x);
                let known = self.contacts.iter().any(|c| dot(c.up, up) > 0.9999);
                if up != [0.0; 3] && !known && self.contacts.len() < 16 && height(self.mesh.corners(face)) > least {
                    self.contacts.push(Contact { up, face });
                }
            }
            if !self.contacts.is_empty() {
                break;
            }
        }
        !self.contacts.is_empty()
    }

    #[inline(always)]
    fn is_held(&self) -> bool {
        let c = &self.contacts;
        (1..c.len()).any(|i| (0..i).any(|j| dot(c[i].up, c[j].up) <= HELD))
    }

    /// How far the sphere about `c` of radius `r` gets along `v`, growing by |v|^2 per unit (as its contacts ask), and
    /// what stops it: the largest s for which the sphere about c + s v of radius r + s |v|^2 is empty, by shrinking it
    /// to each point of the surface that is found in it (Ma, Bae & Choi 2012, there for one contact). None if nothing
    /// stops it.
    #[inline(always)]
    fn advance(&mut self, c: [f64; 3], r: f64, v: [f64; 3]) -> Option<(f64, Near)> {
        let g = dot(v, v);
        let speed = g.sqrt();
        let d = v.map(|x| x / speed);
        let start = if r > 0.0 { 0.0 } else { SAME_SURFACE };
        let hit = self.mesh.nearest_hit(self.lanes, &mut self.stack, (c, d), (start, f64::INFINITY), u32::MAX);
        // Straight ahead the sphere cannot pass what the ray meets.
        let mut near = hit.map(|h| Near { d2: 0.0, point: along(c, h.t, d), face: h.face });
        let mut s = hit.map_or((2.0 - r) / g, |h| ((h.t - r) / (speed + g)).max(0.0));
        for _ in 0..CORRECTIONS {
            let (to, size) = (along(c, s, v), r + s * g);
            let inner = size * (1.0 - SLACK);
            let apart = sub(to, self.empty.0);
            if dot(apart, apart).sqrt() + inner <= self.empty.1 {
                break;
            }
            let outer = size * (1.0 - SLACK / 2.0);
            let found = match self.mesh.nearest(self.lanes, &mut self.stack, to, outer * outer) {
                Some(found) if found.d2 < inner * inner => found,
                found => {
                    self.empty = (to, found.map_or(outer, |f| f.d2.sqrt()));
                    break;
                }
            };
            // |c + s v - q|^2 = (r + s g)^2, the smaller root.
            let w = sub(c, found.point);
            let (a, b, k) = (g - g * g, dot(v, w) - r * g, dot(w, w) - r * r);
            let next = k / ((b * b - a * k).max(0.0).sqrt() - b);
            near = Some(found);
            if !(next < s * (1.0 - 1e-6)) {
                break;
            }
            s = next.max(0.0);
            if s == 0.0 {
                break;
            }
        }
        near.map(|n| (s, n))
    }

    /// Drops the contacts that the sphere has left and adds the new one.
    #[inline(always)]
    fn keep_contacts(&mut self, c: [f64; 3], r: f64, near: Near) {
        let mesh = self.mesh;
        let mut new = Contact { up: [0.0; 3], face: near.face };
        self.contacts.retain_mut(|contact| {
            let away = sub(c, closest_on_triangle(c, mesh.corners(contact.face)));
            let d = dot(away, away).sqrt();
            let stays = d <= r * (1.0 + LOST) && d > 0.0;
            if stays {
                contact.up = away.map(|x| x / d);
            }
            stays && contact.face != near.face
        });
        let away = sub(c, near.point);
        let d = dot(away, away).sqrt();
        if d > 0.0 {
            new.up = away.map(|x| x / d);
            self.contacts.retain(|contact| dot(contact.up, new.up) < 0.9999);
            self.contacts.push(new);
        }
    }
}

/// The shortest vector of the convex hull of the contacts' directions: moving along it the centre leaves all contacts
/// at the same rate, the fastest possible. Zero if they surround the centre.
fn fastest(contacts: &[Contact]) -> [f64; 3] {
    let mut best = [f64::INFINITY; 3];
    let mut least = f64::INFINITY;
    let mut offer = |v: [f64; 3]| {
        if dot(v, v) < least {
            (best, least) = (v, dot(v, v));
        }
    };
    for (i, a) in contacts.iter().enumerate() {
        offer(a.up);
        for (j, b) in contacts[..i].iter().enumerate() {
            offer(closest_on_segment(a.up, b.up));
            contacts[..j].iter().for_each(|c| offer(closest_on_triangle([0.0; 3], [a.up, b.up, c.up])));
        }
    }
    let outside = contacts.iter().all(|c| dot(c.up, best) >= least - 1e-6);
    if outside && least <= 1.5 { best } else { [0.0; 3] }
}

/// The indices of the points along a curve that keeps near what is near (Morton order).
fn near_each_other(mesh: &RayMesh, points: &[[f64; 3]]) -> Result<Vec<u32>> {
    let spread = |x: f64| {
        let mut v = ((x + 0.5).clamp(0.0, 1.0) * 1023.0) as u32;
        for (shift, mask) in [(16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3), (2, 0x09249249)] {
            v = (v | v << shift) & mask;
        }
        v
    };
    let mut keys = try_vec(points.len(), "order of the points")?;
    keys.extend(points.iter().enumerate().map(|(i, p)| {
        let [x, y, z] = mesh.to_unit(*p).map(spread);
        (x | y << 1 | z << 2, i as u32)
    }));
    keys.par_sort_unstable();
    let mut order = try_vec(points.len(), "order of the points")?;
    order.extend(keys.iter().map(|k| k.1));
    Ok(order)
}

/// Height of a triangle over its longest side.
fn height([a, b, c]: [[f64; 3]; 3]) -> f64 {
    let n = super::bvh::cross(sub(b, a), sub(c, a));
    let longest = [sub(b, a), sub(c, b), sub(a, c)].map(|e| dot(e, e)).into_iter().fold(0.0, f64::max);
    if longest > 0.0 { dot(n, n).sqrt() / longest.sqrt() } else { 0.0 }
}
