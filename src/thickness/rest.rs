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
    /// Sectors on which a start was tried, or that belong to one's smooth surface.
    done: Vec<bool>,
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
        self.done.clear();
        self.done.resize(self.sectors.len(), false);
        for seed in 0..self.sectors.len() {
            if self.list.len() == MOST_STARTS {
                break;
            }
            if !self.done[seed] {
                self.start_on(seed);
            }
        }
        !self.sectors.is_empty()
    }

    /// A start on the smooth surface around one sector.
    fn start_on(&mut self, seed: usize) {
        self.contacts.list.clear();
        for (sector, done) in self.sectors.iter().zip(&mut self.done) {
            if dot(sector.up, self.sectors[seed].up) > SMOOTH {
                *done = true;
                rest(&mut self.contacts, sector.up, sector.face);
            }
        }
        // Whatever reaches into a sphere that leaves these is rested on too.
        for _ in 0..16 {
            let v = self.contacts.fastest();
            let g = dot(v, v);
            if g < LEAST_GROWTH {
                return;
            }
            let radius = g.sqrt();
            let centre = v.map(|x| x / radius);
            let mut clear = true;
            for sector in &self.sectors {
                let away = sub(centre, closest_on_triangle(centre, sector.corners));
                let d = dot(away, away).sqrt();
                if d < radius * (1.0 - 1e-3) {
                    // An edge that is touched from inside, or a face.
                    let edge = d > 1e-6 && dot(away, sector.up) > 1e-9;
                    let up = if edge { away.map(|x| x / d) } else { sector.up };
                    clear &= !rest(&mut self.contacts, up, sector.face);
                }
            }
            if clear {
                let same = |s: &Start| dot(s.v, v) > 0.9998 * (dot(s.v, s.v) * g).sqrt();
                if !self.list.iter().any(same) {
                    self.list.push(Start { contacts: self.contacts.list.clone(), v });
                }
                return;
            }
        }
    }
}

/// Adds a contact; false if there is one like it.
fn rest(contacts: &mut Contacts, up: [f64; 3], face: u32) -> bool {
    if contacts.list.iter().any(|c| dot(c.up, up) > 1.0 - 1e-6) {
        return false;
    }
    contacts.push(Contact { up, face, d: 0.0, square: true, local: false })
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
