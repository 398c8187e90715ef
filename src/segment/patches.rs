//! A coarse face graph: the surface in some thousand patches, none across a concave crease.
//!
//! Seeds are put where the surface is farthest from the seeds so far, by a distance in which turning into a concave
//! edge is as far as walking; a face belongs to the nearest seed. So a patch ends at a crease, a small pin on a large plate gets
//! patches of its own, and the number of patches does not depend on the number of faces.

use super::affinity::Near;
use super::dual::{Dual, Step};
use crate::error::{Result, try_filled, try_vec};
use crate::job::Job;
use crate::mesh::NONE;
use std::collections::BinaryHeap;

/// How far apart one radian of concave turning puts two faces, in patch diameters.
const TURN: f64 = 3.0;
/// Turn of a sharp edge, radians.
const SHARP: f64 = 0.4;
/// Covering radius at which seeding stops, in patch diameters.
const RADIUS: f64 = 0.75;

/// The surface in patches.
#[derive(Debug)]
pub struct Patches {
    /// Patch of every face.
    pub of_face: Vec<u32>,
    /// The face that every patch grew from.
    pub seed: Vec<u32>,
    /// Area of every patch.
    pub area: Vec<f64>,
    /// Diameter that patches were wanted to have, model units.
    pub diameter: f64,
    /// Borders between patches.
    pub borders: Vec<Border>,
}

/// Where two patches meet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Border {
    /// The two patches, the lower first.
    pub patches: [u32; 2],
    /// Length of their common border.
    pub length: f64,
    /// Length of the way from seed to seed through the border's best edge.
    pub geodesic: f64,
    /// Concave turning on the way from seed to seed, radians, in the mean over the border.
    pub concave: f64,
    /// Convex turning, likewise.
    pub convex: f64,
}

/// What is known of a face while seeds are put.
#[derive(Clone, Copy)]
struct Place {
    distance: f64,
    seed: u32,
    /// Length of the way from the seed.
    walked: f64,
    turned: Turned,
}

/// How a way turns, radians.
#[derive(Debug, Clone, Copy, Default)]
struct Turned {
    /// At sharp concave edges.
    sharp: f64,
    /// At other concave edges.
    up: f64,
    /// At convex edges that are not sharp.
    down: f64,
    /// At sharp convex edges.
    over: f64,
}

impl Turned {
    fn and(mut self, turn: f64) -> Turned {
        match turn {
            t if t >= SHARP => self.sharp += t,
            t if t > 0.0 => self.up += t,
            t if t > -SHARP => self.down -= t,
            t => self.over -= t,
        }
        self
    }

    /// On a rough surface small turns come both ways: only what is left of them counts.
    fn concave(self, rest: Turned) -> f64 {
        self.sharp + rest.sharp + (self.up + rest.up - self.down - rest.down).max(0.0)
    }

    fn convex(self, rest: Turned) -> f64 {
        self.down + rest.down + self.over + rest.over
    }
}

impl Patches {
    /// About `target` patches of the surface (more where creases or shells are many, fewer where one face is larger
    /// than a patch). `rank` orders faces by their position, to decide between equals.
    ///
    /// # Errors
    /// [`crate::error::Error::NoMemory`], [`crate::error::Error::Cancelled`].
    pub fn new(dual: &Dual, target: usize, rank: &[u32], job: &Job) -> Result<Patches> {
        let total: f64 = dual.area.iter().sum();
        let diameter = (total / target.max(1) as f64).sqrt();
        let unknown = Place { distance: f64::INFINITY, seed: NONE, walked: 0.0, turned: Turned::default() };
        let mut place = try_filled(dual.face_count(), unknown, "patches")?;
        let mut seed: Vec<u32> = Vec::new();
        // the farthest face comes out first, the first by rank of equals; entries may be out of date
        let mut far: BinaryHeap<(Far, u32)> = BinaryHeap::new();
        far.extend((0..dual.face_count() as u32).map(|f| (Far(f64::INFINITY, rank[f as usize]), f)));
        let mut heap = BinaryHeap::new();
        while let Some((Far(d, r), f)) = far.pop() {
            let now = place[f as usize].distance;
            if now < d {
                if now > RADIUS {
                    far.push((Far(now, r), f));
                }
                continue;
            }
            if d <= RADIUS || (seed.len() >= 4 * target && d.is_finite()) {
                break;
            }
            if seed.len() % 256 == 0 {
                job.check()?;
            }
            grow(dual, diameter, f, seed.len() as u32, &mut place, &mut heap);
            seed.push(f);
        }
        let mut out = Patches {
            of_face: try_vec(place.len(), "patches")?,
            seed,
            area: Vec::new(),
            diameter,
            borders: Vec::new(),
        };
        out.of_face.extend(place.iter().map(|p| p.seed));
        out.area = try_filled(out.seed.len(), 0.0, "patches")?;
        out.of_face.iter().zip(&dual.area).for_each(|(&p, a)| out.area[p as usize] += a);
        out.find_borders(dual, &place)?;
        Ok(out)
    }

    fn find_borders(&mut self, dual: &Dual, place: &[Place]) -> Result<()> {
        let mut crossing: Vec<([u32; 2], u32)> = try_vec(dual.steps.len() / 4, "borders of patches")?;
        for (s, step) in dual.steps.iter().enumerate() {
            let [p, q] = step.faces.map(|f| self.of_face[f as usize]);
            if p != q {
                crossing.push(([p.min(q), p.max(q)], s as u32));
            }
        }
        crossing.sort_unstable();
        for run in crossing.chunk_by(|a, b| a.0 == b.0) {
            let mut border =
                Border { patches: run[0].0, length: 0.0, geodesic: f64::INFINITY, concave: 0.0, convex: 0.0 };
            for &(_, s) in run {
                let step: &Step = &dual.steps[s as usize];
                let [a, b] = step.faces.map(|f| place[f as usize]);
                let length = step.length.max(f64::MIN_POSITIVE);
                border.length += length;
                border.geodesic = border.geodesic.min(a.walked + step.geodesic + b.walked);
                border.concave += length * a.turned.and(step.turn).concave(b.turned);
                border.convex += length * a.turned.and(step.turn).convex(b.turned);
            }
            border.concave /= border.length;
            border.convex /= border.length;
            self.borders.push(border);
        }
        Ok(())
    }
}

/// Takes for a new seed the faces that are nearer to it than to any before.
fn grow(dual: &Dual, diameter: f64, f: u32, seed: u32, place: &mut [Place], heap: &mut BinaryHeap<Near>) {
    place[f as usize] = Place { distance: 0.0, seed, walked: 0.0, turned: Turned::default() };
    heap.push(Near(0.0, f));
    while let Some(Near(d, f)) = heap.pop() {
        let here = place[f as usize];
        if d > here.distance || here.seed != seed {
            continue;
        }
        for &(g, s) in dual.around(f) {
            let step = &dual.steps[s as usize];
            let d = d + step.geodesic / diameter + TURN * step.turn.max(0.0);
            let there = &mut place[g as usize];
            if d < there.distance {
                *there = Place {
                    distance: d,
                    seed,
                    walked: here.walked + step.geodesic,
                    turned: here.turned.and(step.turn),
                };
                heap.push(Near(d, g));
            }
        }
    }
}

/// Larger distances are greater, of equals the one with the lower rank.
#[derive(Clone, Copy, PartialEq)]
struct Far(f64, u32);

impl Eq for Far {}

impl Ord for Far {
    fn cmp(&self, other: &Far) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0).then(other.1.cmp(&self.1))
    }
}

impl PartialOrd for Far {
    fn partial_cmp(&self, other: &Far) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
