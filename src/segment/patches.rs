//! A coarse face graph: the surface in some thousand patches, none across a concave crease.
//!
//! Seeds keep a distance from each other, by a measure in which turning into a concave edge is as far as walking; a face
//! belongs to the nearest seed. So a patch ends at a crease, a small pin on a large plate gets patches of its own, and
//! the number of patches does not depend on the number of faces. Each seed looks around no farther than to where the
//! next may be: time in proportion to the faces.

use super::affinity::{Graph, Near};
use super::cut::pair;
use super::dual::{Dual, Step};
use crate::error::{Result, try_filled, try_push, try_vec};
use crate::job::Job;
use crate::mesh::NONE;
use crate::mesh::measure::distance;
use rayon::prelude::*;
use std::collections::BinaryHeap;

/// How far apart one radian of concave turning puts two faces, in patch diameters.
const TURN: f64 = 3.0;
/// One radian of turning over a sharp convex edge does, in patch diameters: the edge of a box is the border of a patch.
const OVER: f64 = 0.7;
/// Turn of a sharp edge, radians.
const SHARP: f64 = 0.4;
/// A face farther than this from all seeds becomes one, in patch diameters.
const RADIUS: f64 = 1.0;
/// On a surface that is all creases seeds keep twice that distance, and twice again, so many times ...
const COARSER: i32 = 6;
/// ... until there are no more of them than so many times the number wanted. Separate shells have one each in any case.
const MOST: usize = 4;

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
        let (order, metric) = rayon::join(|| from_outside(dual, rank), || Metric::new(dual, diameter));
        let (order, mut metric) = (order?, metric?);
        let mut reached = Reached::new(dual.face_count())?;
        let mut seed: Vec<u32> = Vec::new();
        for coarser in 0..=COARSER {
            metric.reach = RADIUS * 2f64.powi(coarser);
            let most = if coarser < COARSER { MOST * target } else { usize::MAX };
            if put_seeds(&metric, &order, most, &mut reached, &mut seed, job)? {
                break;
            }
            reached.forget();
            seed.clear();
        }
        drop((order, metric));
        let place = reached.place;
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

    /// `count` patches that are far from each other, or all.
    pub fn spread(&self, count: usize) -> Result<Vec<u32>> {
        let way = |b: &Border| b.geodesic / self.diameter.max(f64::MIN_POSITIVE) + TURN * b.concave;
        let ways: Vec<([u32; 2], f64)> = self.borders.iter().map(|b| (b.patches, way(b))).collect();
        let graph = Graph::new(self.seed.len(), &ways)?;
        let mut gap = try_filled(self.seed.len(), f64::INFINITY, "landmarks")?;
        let (mut out, mut heap) = (try_vec(count.min(gap.len()), "landmarks")?, BinaryHeap::new());
        while out.len() < count.min(self.seed.len()) {
            let farther = |m: usize, p: usize| if gap[p] > gap[m] { p } else { m };
            let next = (1..gap.len()).fold(0, farther) as u32;
            out.push(next);
            gap[next as usize] = 0.0;
            heap.push(Near(0.0, next));
            graph.settle(&mut gap, &mut heap);
            // never again
            gap[next as usize] = -1.0;
        }
        Ok(out)
    }

    fn find_borders(&mut self, dual: &Dual, place: &[Place]) -> Result<()> {
        let mut crossing: Vec<([u32; 2], u32)> = try_vec(dual.steps.len() / 4, "borders of patches")?;
        for (s, step) in dual.steps.iter().enumerate() {
            let [p, q] = step.faces.map(|f| self.of_face[f as usize]);
            if p != q {
                crossing.push((pair(p, q), s as u32));
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

/// Faces by their distance from the middle of the surface, the farthest first: an order that turning the part does not
/// change, but for equals.
fn from_outside(dual: &Dual, rank: &[u32]) -> Result<Vec<u32>> {
    let total: f64 = dual.area.iter().sum();
    let mut middle = [0.0; 3];
    for (c, a) in dual.centroid.iter().zip(&dual.area) {
        (0..3).for_each(|k| middle[k] += c[k] * a / total.max(f64::MIN_POSITIVE));
    }
    let mut order: Vec<(f64, u32)> = try_vec(dual.face_count(), "patches")?;
    order.extend(dual.centroid.iter().zip(0..).map(|(&c, f)| (distance(c, middle), f)));
    order.par_sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(rank[a.1 as usize].cmp(&rank[b.1 as usize])));
    Ok(order.into_iter().map(|o| o.1).collect())
}

/// How far it is from face to face.
struct Metric<'a> {
    dual: &'a Dual,
    /// By entry of [`Dual::around`].
    ways: Vec<Way>,
    /// Seeds look so far around them, in patch diameters.
    reach: f64,
}

/// The way to a neighbouring face, in patch diameters.
#[derive(Clone, Copy)]
struct Way {
    to: u32,
    step: u32,
    length: f64,
    /// What its turning adds.
    turn: f64,
}

impl<'a> Metric<'a> {
    fn new(dual: &'a Dual, diameter: f64) -> Result<Metric<'a>> {
        let way = |&(to, step): &(u32, u32)| {
            let Step { geodesic, turn, .. } = dual.steps[step as usize];
            let turn = if turn <= -SHARP { -OVER * turn } else { TURN * turn.max(0.0) };
            Way { to, step, length: geodesic / diameter, turn }
        };
        let mut ways = try_vec(dual.around.len(), "patches")?;
        dual.around.par_iter().with_min_len(4096).map(way).collect_into_vec(&mut ways);
        Ok(Metric { dual, ways, reach: 0.0 })
    }
}

/// Faces as the seeds have reached them.
struct Reached {
    /// From the nearest seed, in patch diameters.
    distance: Vec<f64>,
    place: Vec<Place>,
}

impl Reached {
    const UNKNOWN: Place =
        Place { seed: NONE, walked: 0.0, turned: Turned { sharp: 0.0, up: 0.0, down: 0.0, over: 0.0 } };

    fn new(faces: usize) -> Result<Reached> {
        let distance = try_filled(faces, f64::INFINITY, "patches")?;
        Ok(Reached { distance, place: try_filled(faces, Reached::UNKNOWN, "patches")? })
    }

    fn forget(&mut self) {
        self.distance.fill(f64::INFINITY);
        self.place.fill(Reached::UNKNOWN);
    }
}

/// Makes seeds of the faces that none before has reached, in `order`; false if there would be more than `most`.
fn put_seeds(
    metric: &Metric<'_>,
    order: &[u32],
    most: usize,
    reached: &mut Reached,
    seed: &mut Vec<u32>,
    job: &Job,
) -> Result<bool> {
    let mut heap = BinaryHeap::new();
    for &f in order {
        if reached.place[f as usize].seed != NONE {
            continue;
        }
        if seed.len() >= most {
            return Ok(false);
        }
        if seed.len() % 256 == 0 {
            job.check()?;
        }
        metric.grow(f, seed.len() as u32, reached, &mut heap);
        try_push(seed, f, "patches")?;
    }
    Ok(true)
}

impl Metric<'_> {
    /// Takes for a new seed the faces that are nearer to it than to any before. `heap` is empty.
    fn grow(&self, f: u32, seed: u32, reached: &mut Reached, heap: &mut BinaryHeap<Near>) {
        let Reached { distance, place } = reached;
        distance[f as usize] = 0.0;
        place[f as usize] = Place { seed, walked: 0.0, turned: Turned::default() };
        heap.push(Near(0.0, f));
        while let Some(Near(d, f)) = heap.pop() {
            if d > distance[f as usize] {
                continue;
            }
            let here = place[f as usize];
            let [from, to] = [f, f + 1].map(|f| self.dual.first[f as usize] as usize);
            for way in &self.ways[from..to] {
                let (d, g) = (d + way.length + way.turn, way.to as usize);
                if d <= self.reach && d < distance[g] {
                    let step = &self.dual.steps[way.step as usize];
                    distance[g] = d;
                    place[g] = Place { seed, walked: here.walked + step.geodesic, turned: here.turned.and(step.turn) };
                    heap.push(Near(d, way.to));
                }
            }
        }
    }
}
