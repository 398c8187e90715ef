//! How a sphere of radius 0 rests on the faces at a point, and where it can grow: the solid seen from so near that each
//! face is a sector about the point.

use super::bvh::{RayMesh, SAME_SURFACE, dot, sub};
use super::contact::{Contact, Contacts};
use super::nearest::{closest_on_triangle, height};

/// Triangles lower than this (in units of the tree) have no trustworthy normal: corners of files in single precision
/// are off by up to a thirtieth of it.
const FLAT: f64 = 4e-6;

/// Cosine of the angle up to which faces at a point are one smooth surface (20 degrees).
const SMOOTH: f64 = 0.94;

/// A sphere that grows slower than this (the sine of half the angle of a wedge, squared) does not.
const LEAST_GROWTH: f64 = 1e-6;

/// Spheres of radius 0 at one point: one on each smooth piece of surface there, so no more than fit around it.
const MOST_STARTS: usize = 12;

/// From so many sectors they are looked for.
const MOST_SEEDS: usize = 48;

/// So many contacts are rested on one after the other before giving up.
const MOST_RESTS: usize = 40;

/// A sector as a triangle that reaches this far from the point, where the sphere about to grow is 1 away.
const FAR: f64 = 1000.0;

/// One way to start growing.
#[derive(Debug, Clone, Default)]
pub(super) struct Start {
    /// What the sphere rests on.
    pub contacts: Vec<Contact>,
    /// As [`Contacts::fastest`].
    pub v: [f64; 3],
}

#[derive(Debug, Clone, Copy)]
struct Sector {
    corners: [[f64; 3]; 3],
    /// Inward unit normal.
    up: [f64; 3],
    face: u32,
}

/// All ways to start at one point; kept between points to spare allocations.
#[derive(Debug, Default)]
pub(super) struct Starts {
    pub list: Vec<Start>,
    sectors: Vec<Sector>,
    contacts: Contacts,
}

impl Starts {
    /// Finds them at `p`, which lies on `faces`. False if these have no area.
    ///
    /// Where the surface is convex at `p` all lead to one sphere, that touches all faces it must. Around a concave edge
    /// there is a sphere on each side.
    pub fn find(&mut self, mesh: &RayMesh, p: [f64; 3], faces: &[u32]) -> bool {
        self.list.clear();
        self.sectors.clear();
        for least in [FLAT, 0.0] {
            let solid = faces.iter().filter(|&&f| height(mesh.corners(f)) > least);
            self.sectors.extend(solid.filter_map(|&face| sector(mesh, p, face)));
            if !self.sectors.is_empty() {
                break;
            }
        }
        for seed in 0..self.sectors.len() {
            let up = self.sectors[seed].up;
            // Each sector in turn, so that their order does not matter, but not two that lead to the same.
            let alike = |sector: &Sector| dot(sector.up, up) > 1.0 - 1e-9;
            if self.list.len() < MOST_SEEDS && !self.sectors[..seed].iter().any(alike) {
                let smooth = self.start_on(seed);
                if smooth {
                    break;
                }
            }
        }
        // Of nearly the same ones that which grows slowest.
        self.list.sort_by(|a, b| dot(a.v, a.v).total_cmp(&dot(b.v, b.v)));
        let mut kept = 0;
        for i in 0..self.list.len() {
            let (v, g) = (self.list[i].v, dot(self.list[i].v, self.list[i].v));
            let same = |s: &Start| dot(s.v, v) > 0.9998 * (dot(s.v, s.v) * g).sqrt();
            if !self.list[..kept].iter().any(same) {
                self.list.swap(kept, i);
                kept += 1;
            }
        }
        self.list.truncate(kept.min(MOST_STARTS));
        !self.sectors.is_empty()
    }

    /// A start on the smooth surface around one sector; true if that is all there is.
    fn start_on(&mut self, seed: usize) -> bool {
        self.contacts.list.clear();
        let up = self.sectors[seed].up;
        for sector in self.sectors.iter().filter(|sector| dot(sector.up, up) > SMOOTH) {
            rest(&mut self.contacts, sector.up, sector.face);
        }
        let apart = |a: &Sector| self.sectors.iter().any(|b| dot(a.up, b.up) <= SMOOTH);
        let smooth = !self.sectors.iter().any(apart);
        // What reaches deepest into a sphere that leaves these is rested on too.
        for _ in 0..MOST_RESTS {
            let v = self.contacts.fastest();
            let g = dot(v, v);
            if g < LEAST_GROWTH {
                break;
            }
            let radius = g.sqrt();
            let centre = v.map(|x| x / radius);
            let distance = |sector: &Sector| {
                let away = sub(centre, closest_on_triangle(centre, sector.corners));
                (dot(away, away).sqrt(), away)
            };
            let least = self.sectors.iter().map(|sector| distance(sector).0).fold(f64::INFINITY, f64::min);
            let mut more = false;
            for sector in self.sectors.iter().filter(|_| least < radius * (1.0 - 1e-3)) {
                let (d, away) = distance(sector);
                if d <= least + 1e-6 {
                    // An edge that is touched from inside, or a face.
                    let edge = d > 1e-6 && dot(away, sector.up) > 1e-9;
                    let up = if edge { away.map(|x| x / d) } else { sector.up };
                    more |= rest(&mut self.contacts, up, sector.face);
                }
            }
            if !more {
                self.list.push(Start { contacts: self.contacts.list.clone(), v });
                break;
            }
        }
        smooth
    }
}

/// Adds a contact; false if there is one like it.
fn rest(contacts: &mut Contacts, up: [f64; 3], face: u32) -> bool {
    if contacts.list.iter().any(|c| dot(c.up, up) > 1.0 - 1e-10) {
        return false;
    }
    contacts.push(Contact { up, face, d: 0.0, local: false })
}

/// A face as a sector about `p`, a point on it.
fn sector(mesh: &RayMesh, p: [f64; 3], face: u32) -> Option<Sector> {
    let up = mesh.normals[face as usize].map(|x| -x);
    let corners = mesh.corners(face).map(|q| {
        let w = sub(q, p);
        let d = dot(w, w).sqrt();
        if d > SAME_SURFACE { w.map(|x| FAR * x / d) } else { [0.0; 3] }
    });
    (up != [0.0; 3]).then_some(Sector { corners, up, face })
}
