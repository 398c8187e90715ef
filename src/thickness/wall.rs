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
//! sphere its diameter, a wedge sharper than 65 degrees the sphere between its sides, a blunter corner, such as that of
//! a tetrahedron, the sphere that fits the body behind it. On the edge of a sharp wedge, where the sphere between its
//! sides has no size, its two sides do not hold the sphere, and it slides out of the wedge: the body behind the blade
//! counts. At a concave edge there is a sphere on each side, and the smaller one counts. The sphere depends on where
//! the surface is, not on how it is cut into triangles.

use super::bvh::{RayMesh, SAME_SURFACE, along, dot, sub};
use super::contact::{Contacts, HELD};
use super::exposed::Exposed;
use super::lanes::{Lanes, Work, with_best};
use super::nearest::{Growth, Touch};
use super::rest::Starts;
use super::tree::Stack;
use crate::error::{Error, Result, try_filled, try_vec};
use crate::job::Job;
use rayon::prelude::*;

/// Surface may reach this deep into a sphere, as a share of its radius, without stopping it: first the larger, so that
/// it slides over the facets of round surfaces in few steps; when held, it is set back and goes on with less.
const SLACK: [f64; 3] = [0.04, 0.01, EXACT];

/// The slack at which a held sphere counts, and for facets: what this leaves out is a quarter of a percent of the width.
const EXACT: f64 = 2.5e-3;

/// Surface this near to a sphere, as a share of its radius, touches it,
const NEAR: f64 = 0.01;
/// or nearer than so many times the slack as well: what a sphere slid on is further away than what it ran into.
const WIDER: f64 = 1.5;

/// A step that makes the sphere larger by less than this share is none.
const PROGRESS: f64 = 1e-3;

/// Corners are left in few steps; where a surface is so rough that they do not suffice, the last sphere is as good.
const STEPS: usize = 40;

/// Where nothing grows at a point, this share of the way to the centroids of its faces is tried, on this many faces.
const ASIDE: [f64; 2] = [0.02, 0.3];
const MOST_ASIDE: usize = 6;

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

/// What became of one point.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Outcome {
    Ball([f64; 3], f64),
    Buried,
    Open,
    Degenerate,
}

impl Outcome {
    fn is_sphere(self) -> bool {
        matches!(self, Outcome::Ball(_, r) if r >= SAME_SURFACE)
    }
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

    /// The mesh that this was made from, ready for ray shooting; none if parts of it are left out here.
    pub fn rays(&self) -> Option<&RayMesh> {
        self.surface.is_all().then(|| self.surface.mesh())
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
        let (start, around) = self.around(positions, triangles, parents)?;
        self.measure(positions, Parents::Around(&start, &around), job)
    }

    /// The parents around each vertex: where its list starts, and the lists.
    pub(super) fn around(
        &self,
        positions: &[[f64; 3]],
        triangles: &[[u32; 3]],
        parents: &[u32],
    ) -> Result<(Vec<usize>, Vec<u32>)> {
        let faces = self.surface.face_count() as u32;
        let stray = triangles.iter().flatten().any(|&v| v as usize >= positions.len());
        if triangles.len() != parents.len() || stray || parents.iter().any(|&f| f >= faces) {
            return Err(Error::Internal("wall widths: triangles and parents do not match".into()));
        }
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
        Ok((start, around))
    }

    pub(super) fn mesh(&self) -> &RayMesh {
        self.surface.mesh()
    }

    /// Whether all of a face is surface of the part.
    pub(super) fn is_whole(&self, face: u32) -> bool {
        self.surface.is_whole(face)
    }

    pub(super) fn measure(&self, points: &[[f64; 3]], parents: Parents, job: &Job) -> Result<Walls> {
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
pub(super) enum Parents<'a> {
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
        let mut grower = Grower {
            mesh,
            lanes,
            stack: Stack::new(),
            starts: Starts::default(),
            contacts: Contacts::default(),
            before: Contacts::default(),
            empty: ([0.0; 3], 0.0),
        };
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
    starts: Starts,
    contacts: Contacts,
    before: Contacts,
    /// A sphere known to be empty.
    empty: ([f64; 3], f64),
}

impl<L: Lanes> Grower<'_, L> {
    /// The sphere at `p`, which lies on `faces`: of those on different sides of a concave edge the smallest.
    #[inline(always)]
    fn grow(&mut self, p: [f64; 3], faces: &[u32]) -> Outcome {
        let mut starts = std::mem::take(&mut self.starts);
        let mut outcome = Outcome::Degenerate;
        let mut other = Vec::new();
        // At the point; with faces that touch it without sharing it as a corner; on each face a little aside, for
        // points where slivers leave nothing to rest on.
        let asides = ASIDE.iter().flat_map(|&s| faces.iter().take(MOST_ASIDE).map(move |&f| (s, Some(f))));
        for (share, aside) in [(0.0, None), (0.0, Some(u32::MAX))].into_iter().chain(asides) {
            let mut at = p;
            let on = match aside {
                None => faces,
                Some(u32::MAX) => {
                    other = self.mesh.faces_at(p);
                    &other
                }
                Some(face) => {
                    let corners = self.mesh.corners(face);
                    at = std::array::from_fn(|a| {
                        p[a] + share * ((corners[0][a] + corners[1][a] + corners[2][a]) / 3.0 - p[a])
                    });
                    other.clear();
                    other.push(face);
                    &other
                }
            };
            if starts.find(self.mesh, at, on) {
                let found = self.smallest(at, &starts);
                outcome = if outcome == Outcome::Degenerate || found.is_sphere() { found } else { outcome };
            }
            if outcome == Outcome::Degenerate || outcome.is_sphere() {
                break;
            }
        }
        self.starts = starts;
        outcome
    }

    /// The smallest sphere that is one at all; the point if none is.
    #[inline(always)]
    fn smallest(&mut self, p: [f64; 3], starts: &Starts) -> Outcome {
        let mut best: Option<([f64; 3], f64)> = None;
        let mut open = false;
        for start in &starts.list {
            self.contacts.apex = None;
            self.contacts.list.clone_from(&start.contacts);
            if self.contacts.hold() {
                // The edge of a blade has no width of its own: that of the body behind it counts.
                self.contacts.apex = Some(p);
                self.contacts.list.iter_mut().for_each(|c| c.local = true);
            }
            self.before.apex = self.contacts.apex;
            match self.follow(p, start.v) {
                Outcome::Ball(c, r) if r >= SAME_SURFACE && best.is_none_or(|b| r < b.1) => best = Some((c, r)),
                Outcome::Open => open = true,
                _ => {}
            }
        }
        match best {
            Some((c, r)) => Outcome::Ball(c, r),
            None if open => Outcome::Open,
            None => Outcome::Ball(p, 0.0),
        }
    }

    #[inline(always)]
    fn follow(&mut self, p: [f64; 3], v: [f64; 3]) -> Outcome {
        // --- step 1: grow until something else is touched
        let g = dot(v, v);
        let Some((mut c, mut r)) = self.advance(&Growth { c: p, r: 0.0, v, g }, EXACT) else { return Outcome::Open };
        let (mesh, lanes) = (self.mesh, self.lanes);
        let range = (r * (1.0 - EXACT), r);
        let mut found = mesh.touching(lanes, &mut self.stack, c, range, NEAR, &mut self.contacts);
        if self.contacts.hold() {
            return Outcome::Ball(c, self.held_radius(r, found));
        }
        r = found.d;
        let mut level = 0;
        let mut beyond: Option<(f64, f64)> = None;
        for _ in 0..STEPS {
            // --- step 2: nowhere to go?
            let v = self.contacts.fastest();
            let g = dot(v, v);
            if g < 1e-3 {
                break;
            }
            // --- step 3: slide out of the corner
            self.before.list.clone_from(&self.contacts.list);
            let slack = SLACK[level];
            let Some((to, size)) = self.advance(&Growth { c, r, v, g }, slack) else { return Outcome::Open };
            let range = (size * (1.0 - slack), size);
            found = mesh.touching(lanes, &mut self.stack, to, range, NEAR + WIDER * slack, &mut self.contacts);
            let held = self.contacts.hold();
            let last = level + 1 == SLACK.len();
            if held && found.all && level > 0 {
                // Held by what it slid on: on the way there it was first.
                if let Some(share) = self.contacts.first_held(&self.before) {
                    let radius = self.held_radius(size, found);
                    return Outcome::Ball(along(c, share, sub(to, c)), r + share * (radius - r));
                }
            }
            if found.d > r * (1.0 + PROGRESS) && (last || !held) {
                (c, r) = (to, found.d);
                if held {
                    return Outcome::Ball(c, self.held_radius(size, found));
                }
                level = level.min(1);
            } else if last {
                // Stuck on the facets of a round surface, between where it is held and where it is not.
                if let Some((cos, held)) = beyond.filter(|b| b.1 > r) {
                    let now = self.before.most_opposed().0.max(HELD);
                    r += (held - r) * (now - HELD) / (now - cos);
                }
                break;
            } else {
                // Too far, or not far enough to matter: back, and with care.
                if held {
                    beyond = Some(self.contacts.most_opposed()).filter(|b| b.0 < HELD);
                }
                level += 1;
                std::mem::swap(&mut self.contacts, &mut self.before);
            }
        }
        Outcome::Ball(c, r)
    }

    /// The radius of the sphere that is held about the same centre: `size` is that of the sphere which touches what it
    /// slid on.
    fn held_radius(&self, size: f64, found: Touch) -> f64 {
        if found.all { self.contacts.most_opposed().1 } else { (size + found.d) / 2.0 }
    }

    /// The sphere to which `growth` leads, with up to `slack` of its radius inside the surface; None if nothing stops
    /// it.
    #[inline(always)]
    fn advance(&mut self, growth: &Growth, slack: f64) -> Option<([f64; 3], f64)> {
        // Straight ahead it cannot pass what the ray meets.
        let speed = growth.g.sqrt();
        let d = growth.v.map(|x| x / speed);
        let start = if growth.r > 0.0 { 0.0 } else { SAME_SURFACE };
        let range = (start, f64::INFINITY);
        let hit = self.mesh.nearest_hit(self.lanes, &mut self.stack, (growth.c, d), range, u32::MAX);
        let mut s = hit.map_or((2.0 - growth.r) / growth.g, |h| ((h.t - growth.r) / (speed + growth.g)).max(0.0));
        let mut stopped = hit.is_some();
        let (to, size) = growth.at(s);
        let apart = sub(to, self.empty.0);
        let known = self.empty.1 - dot(apart, apart).sqrt();
        if known < size * (1.0 - EXACT.max(slack)) {
            let stop = self.mesh.shrink(self.lanes, &mut self.stack, growth, s, slack);
            s = stop.s;
            self.empty = (growth.at(s).0, stop.clear);
            stopped |= stop.stopped;
        }
        stopped.then(|| growth.at(s))
    }
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
