//! How long a feature is: the longest shortest way within its own surface, with a bound.
//!
//! Its two ends are sought on a mesh of fewer faces that stands in for a large feature; the way between them is then
//! followed on the feature itself, and shows how far the stand-in is off. No way between two points is longer than one by
//! way of a third, which bounds all of them from the fields of a few.

use crate::error::{Error, Result, try_filled, try_vec};
use crate::geodesic::Ways;
use crate::geodesic::exact::{ExactGeodesics, Limits, Queries, Scratch, SurfacePoint};
use crate::job::Job;
use crate::mesh::measure::{Vec3, add, area_vector, at_weights, bounding_box, corners, distance, dot, scale};
use crate::mesh::proxy::{Proxy, REFERENCE_LIMIT};
use crate::mesh::simplify::{SimplifyOptions, nearest_in_triangle};
use crate::mesh::surface::{AnalysisSurface, SurfaceOptions};
use crate::mesh::used::Used;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Points inside faces that ways may end at.
const SAMPLES: usize = 600;
/// Windows may be given up that shorten a way by no more than this share of the feature's size.
const TOLERANCE: f64 = 5e-4;
/// Relative error that ways may have by it.
const EXCESS: f64 = 4.0 * TOLERANCE;
/// Ways from this many places are followed: to find the longest, and to narrow the bound.
const SOURCES: (usize, usize) = (8, 24);
/// The bound is narrow enough at this relative gap.
const NARROW: f64 = 0.03;
/// Between more points than this each is bounded by the ways to the sources alone.
const MANY_POINTS: usize = 60_000;
/// Windows after which the bound is left as it is.
const WINDOWS: usize = 2_000_000;
/// A feature of more faces than this has another mesh stand in, of fewer faces but at least the second number, that may be
/// this share of the feature's size away from it.
const MANY_FACES: (usize, usize, f64) = (1_200, 500, 1e-3);
/// A stand-in that is off by more than this share of the length is no good.
const MOST_DISTORTION: f64 = 0.02;

/// The longest shortest way.
#[derive(Debug, Clone, PartialEq)]
pub struct Length {
    /// Its length as found, model units.
    pub length: f64,
    /// No way is longer.
    pub upper: f64,
    /// Its ends.
    pub ends: [Vec3; 2],
    /// Distance of every vertex from the first end.
    pub field: Vec<f64>,
}

/// Knowledge about the ways between points of a mesh: its vertices and samples inside its faces.
struct Search<'a> {
    solver: &'a ExactGeodesics,
    limits: Limits,
    samples: Vec<SurfacePoint>,
    queries: Queries,
    place: Vec<Vec3>,
    vertices: usize,
    ways: Ways,
    used: Vec<bool>,
    /// No way from a point is longer, by the far ends of the sources.
    reach: Vec<f64>,
    best: (f64, [usize; 2]),
    /// The ways from the first end of the best, once there is one.
    from_best: Option<Arc<Spread>>,
    windows: usize,
    haste: bool,
}

/// The directions of a box's diagonals, none quite square to another.
const DIAGONALS: [Vec3; 4] = [[1.0, 1.0, 1.0], [-1.0, 1.0, 0.9], [1.0, -1.0, 0.8], [1.0, 1.0, -1.1]];

/// All ways from one point.
struct Spread {
    /// By point; infinite where there is none.
    lengths: Vec<f64>,
    windows: usize,
}

impl Spread {
    /// The farthest point from point `k`, which these ways lead from, and how far it is.
    fn far_end(&self, k: usize) -> (usize, f64) {
        let far = |m: (usize, f64), (i, &d): (usize, &f64)| if d.is_finite() && d > m.1 { (i, d) } else { m };
        self.lengths.iter().enumerate().fold((k, 0.0), far)
    }
}

/// Ways that were followed before it was their turn, by the point that they lead from.
#[derive(Default)]
struct Ahead(Mutex<BTreeMap<usize, Claim>>);

/// Who was the first in turn to want some ways, and they themselves once known.
struct Claim {
    turn: usize,
    all: Option<Arc<Spread>>,
}

impl Ahead {
    fn entries(&self) -> MutexGuard<'_, BTreeMap<usize, Claim>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether one before `turn` wants, or the same did, the ways from a point; if not, this one does.
    fn is_claimed(&self, k: usize, turn: usize) -> bool {
        let mut entries = self.entries();
        let claim = entries.entry(k).or_insert(Claim { turn: usize::MAX, all: None });
        let claimed = claim.turn <= turn;
        claim.turn = turn.min(claim.turn);
        claimed
    }

    fn known(&self, k: usize) -> Option<Arc<Spread>> {
        self.entries().get(&k)?.all.clone()
    }

    fn add(&self, k: usize, all: Arc<Spread>) -> Arc<Spread> {
        if let Some(claim) = self.entries().get_mut(&k) {
            claim.all = Some(Arc::clone(&all));
        }
        all
    }
}

/// From a point to the farthest from it, and on as long as ways get longer. `far_end` gives the end of a way and its
/// length; none ends the chase.
fn chase(start: usize, mut far_end: impl FnMut(usize) -> Result<Option<(usize, f64)>>) -> Result<()> {
    let (mut from, mut longest) = (start, 0.0);
    for _ in 0..SOURCES.0 / 2 {
        match far_end(from)? {
            Some((end, reach)) if reach > longest => (from, longest) = (end, reach),
            _ => break,
        }
    }
    Ok(())
}

impl Search<'_> {
    fn point(&self, k: usize) -> SurfacePoint {
        if k < self.vertices { SurfacePoint::Vertex(k as u32) } else { self.samples[k - self.vertices] }
    }

    /// Follows all ways from point `k`.
    fn follow(&self, k: usize, scratch: &mut Scratch, job: &Job) -> Result<Arc<Spread>> {
        let found = self.solver.distances_at(self.point(k), &self.queries, &self.limits, scratch, job)?;
        let mut lengths = found.vertices;
        lengths.extend(&found.queries);
        Ok(Arc::new(Spread { lengths, windows: found.windows }))
    }

    /// Takes in all ways from point `k`; returns the farthest point and how far it is.
    fn learn(&mut self, k: usize, all: &Arc<Spread>) -> Result<(usize, f64)> {
        self.used[k] = true;
        self.windows += all.windows;
        let (end, reach) = all.far_end(k);
        if reach > self.best.0 {
            self.best = (reach, [k, end]);
            self.from_best = Some(Arc::clone(all));
        }
        // ways that were given up are ways, too
        if self.place.len() <= MANY_POINTS {
            self.ways.add(&all.lengths)?;
        }
        self.reach.iter_mut().zip(&all.lengths).for_each(|(most, d)| *most = most.min(d + reach));
        Ok((end, reach))
    }

    /// Starts at the ends of the box's diagonals, and from where these ways lead.
    fn sweep(&mut self, scratch: &mut Scratch, job: &Job) -> Result<()> {
        let along = |way: Vec3| {
            let along = |k: usize| dot(self.place[k], way);
            (0..self.place.len()).max_by(|&a, &b| along(a).total_cmp(&along(b)))
        };
        let starts: Vec<usize> = DIAGONALS.into_iter().filter_map(along).collect();
        let ahead = Ahead::default();
        if self.haste && rayon::current_num_threads() > 1 && self.place.len() <= MANY_POINTS {
            let this = &*self;
            starts.par_iter().enumerate().try_for_each(|(turn, &start)| this.sweep_ahead(turn, start, &ahead, job))?;
        }
        for start in starts {
            chase(start, |from| {
                if self.used[from] {
                    return Ok(None);
                }
                let all = match ahead.known(from) {
                    Some(all) => all,
                    None => self.follow(from, scratch, job)?,
                };
                self.learn(from, &all).map(Some)
            })?;
        }
        Ok(())
    }

    /// Follows what one start of a sweep leads to, before it is its `turn`: as far as those before it have not come there.
    fn sweep_ahead(&self, turn: usize, start: usize, ahead: &Ahead, job: &Job) -> Result<()> {
        let mut scratch = Scratch::default();
        chase(start, |from| {
            if ahead.is_claimed(from, turn) {
                return Ok(None);
            }
            let all = match ahead.known(from) {
                Some(all) => all,
                None => ahead.add(from, self.follow(from, &mut scratch, job)?),
            };
            Ok(Some(all.far_end(from)))
        })
    }

    /// Follows ways from wherever one could still be longer. Returns the length that none exceeds.
    fn narrow(&mut self, scratch: &mut Scratch, job: &Job) -> Result<f64> {
        if self.place.len() > MANY_POINTS {
            return Ok(self.reach.iter().fold(0.0, |m: f64, d| m.max(*d)));
        }
        let all: Vec<u32> = (0..self.place.len() as u32).collect();
        let mut open = all.clone();
        for round in 0.. {
            // --- the longest way that there may be, from every point that may have one too long
            let floor = self.best.0 * (1.0 + NARROW);
            let ends = self.ways.ends(&all)?;
            let bound = |&k: &u32| (self.ways.bound(k, floor, &ends), k);
            let mut most: Vec<((f64, u32), u32)> = open.par_iter().with_min_len(32).map(bound).collect();
            most.retain(|m| m.0.0 > floor);
            let widest = most.iter().fold(None, |w: Option<((f64, u32), u32)>, m| match w {
                Some(w) if w.0.0 >= m.0.0 => Some(w),
                _ => Some(*m),
            });
            let Some(((upper, end), from)) = widest else { return Ok(floor) };
            let next = [end, from].into_iter().find(|&k| !self.used[k as usize]);
            let Some(next) = next.filter(|_| round < SOURCES.1 && self.windows <= WINDOWS) else {
                return Ok(upper);
            };
            open = most.into_iter().map(|m| m.1).collect();
            let all = self.follow(next as usize, scratch, job)?;
            self.learn(next as usize, &all)?;
        }
        Ok(f64::INFINITY)
    }
}

/// What a search has found.
struct Found {
    length: f64,
    /// No way between two points of the mesh is longer.
    upper: f64,
    ends: [SurfacePoint; 2],
    places: [Vec3; 2],
    /// Distance of every vertex from the first end.
    field: Vec<f64>,
}

/// The longest way on a mesh.
fn search(
    solver: &ExactGeodesics,
    (positions, triangles): (&[Vec3], &[[u32; 3]]),
    limits: Limits,
    haste: bool,
    scratch: &mut Scratch,
    job: &Job,
) -> Result<Found> {
    let (samples, inside, spacing) = samples(positions, triangles, job)?;
    let vertices = positions.len();
    let mut place = try_vec(vertices + inside.len(), "points of a feature")?;
    place.extend(positions.iter().chain(&inside));
    let reach = try_filled(place.len(), f64::INFINITY, "points of a feature")?;
    let used = vec![false; place.len()];
    let queries = solver.prepare(&samples)?;
    let (ways, best) = (Ways::default(), (0.0, [0; 2]));
    let mut search = Search {
        solver,
        limits,
        samples,
        queries,
        place,
        vertices,
        ways,
        used,
        reach,
        best,
        from_best: None,
        windows: 0,
        haste,
    };
    search.sweep(scratch, job)?;
    // every point is this near to one of those, and so is where its longest way ends
    let upper = search.narrow(scratch, job)? * (1.0 + EXCESS) + 2.0 * spacing;
    let (length, ends) = search.best;
    let points = ends.map(|k| search.point(k));
    let field = match search.from_best.take().and_then(Arc::into_inner) {
        Some(mut all) => {
            all.lengths.truncate(vertices);
            all.lengths
        }
        None => solver.distances(points[0], &[], &limits, scratch, job)?.vertices,
    };
    Ok(Found { length, upper, ends: points, places: ends.map(|k| search.place[k]), field })
}

/// A mesh of few faces that stands in for a feature of very many; none for another, or if it does not become so simple.
///
/// # Errors
/// Those of [`Proxy::reference`].
pub fn simpler(positions: &[Vec3], triangles: &[[u32; 3]], job: &Job) -> Result<Option<Proxy>> {
    if triangles.len() > REFERENCE_LIMIT { Proxy::reference(positions, triangles, job) } else { Ok(None) }
}

/// The longest shortest way on the surface of a mesh of its own, or on the largest reach of its pieces; none without faces.
/// In `haste` some more ways are followed than needed, by threads that have nothing else to do; the result is the same.
///
/// # Errors
/// Those of [`ExactGeodesics::new`] and [`ExactGeodesics::distances`].
pub fn longest(positions: &[Vec3], triangles: &[[u32; 3]], haste: bool, job: &Job) -> Result<Option<Length>> {
    if triangles.is_empty() {
        return Ok(None);
    }
    let (lo, hi) = bounding_box(positions.iter().copied());
    let size = distance(lo, hi);
    let limits = Limits { tolerance: TOLERANCE * size, ..Limits::default() };
    let mut scratch = Scratch::default();
    let (solver, stand_in) = rayon::join(
        || ExactGeodesics::new(positions, triangles),
        || {
            (triangles.len() > MANY_FACES.0)
                .then(|| on_stand_in((positions, triangles), size, limits, haste, job))
                .transpose()
        },
    );
    let solver = solver?;
    if let Some(Some((proxy, found))) = stand_in? {
        let onto = |k: usize| match found.ends[k] {
            SurfacePoint::Vertex(v) => Some((SurfacePoint::Vertex(proxy.original[v as usize]), found.places[k])),
            SurfacePoint::Face { face, .. } => {
                let facing = area_vector(corners(&proxy.positions, proxy.triangles[face as usize]));
                nearest((positions, triangles), found.places[k], facing)
            }
        };
        if let [Some((a, at_a)), Some((b, at_b))] = [onto(0), onto(1)] {
            let truth = solver.distances(a, &[b], &limits, &mut scratch, job)?;
            let off = |(&v, d): (&u32, &f64)| (truth.vertices[v as usize] - d).abs();
            let off = proxy.original.iter().zip(&found.field).map(off).filter(|d| d.is_finite()).fold(0.0, f64::max);
            let length = truth.queries[0];
            if off.max((length - found.length).abs()) <= MOST_DISTORTION * found.length {
                let upper = (found.upper + 2.0 * off).max(length);
                return Ok(Some(Length { length, upper, ends: [at_a, at_b], field: truth.vertices }));
            }
        }
    }
    let found = search(&solver, (positions, triangles), limits, haste, &mut scratch, job)?;
    Ok(Some(Length { length: found.length, upper: found.upper, ends: found.places, field: found.field }))
}

/// The longest way on a mesh of fewer faces; none if it does not become much simpler.
fn on_stand_in(
    (positions, triangles): (&[Vec3], &[[u32; 3]]),
    size: f64,
    limits: Limits,
    haste: bool,
    job: &Job,
) -> Result<Option<(Proxy, Found)>> {
    let options = SimplifyOptions { target_faces: MANY_FACES.1, max_error: MANY_FACES.2 * size };
    let proxy = Proxy::new(positions, triangles, &options, job)?;
    if proxy.triangles.is_empty() || proxy.triangles.len() > triangles.len() / 2 {
        return Ok(None);
    }
    let mut scratch = Scratch::default();
    let solver = ExactGeodesics::new(&proxy.positions, &proxy.triangles)?;
    let found = match search(&solver, (&proxy.positions, &proxy.triangles), limits, haste, &mut scratch, job) {
        Err(Error::Degenerate(_)) => return Ok(None),
        other => other?,
    };
    Ok(Some((proxy, found)))
}

/// The point of a mesh nearest to `p` on faces that look the same way as `facing`, and where it is.
fn nearest((positions, triangles): (&[Vec3], &[[u32; 3]]), p: Vec3, facing: Vec3) -> Option<(SurfacePoint, Vec3)> {
    let mut best = (f64::INFINITY, None);
    for (face, &t) in triangles.iter().enumerate() {
        let corner = corners(positions, t);
        if dot(area_vector(corner), facing) > 0.0 {
            let (w, squared) = nearest_in_triangle(corner, p);
            if squared < best.0 {
                let at = at_weights(corner, w);
                best = (squared, Some((SurfacePoint::Face { face: face as u32, weights: w.map(|w| w.max(0.0)) }, at)));
            }
        }
    }
    best.1
}

/// Points spread over the inside of the faces: as points of the surface, where they are, and how far from a point of the
/// surface the nearest of them or of the vertices may be.
fn samples(positions: &[Vec3], triangles: &[[u32; 3]], job: &Job) -> Result<(Vec<SurfacePoint>, Vec<Vec3>, f64)> {
    let options = SurfaceOptions { target_vertices: SAMPLES, max_added: 2 * SAMPLES, ..SurfaceOptions::default() };
    let surface = match AnalysisSurface::refine(positions, triangles, &options, job) {
        Err(crate::error::Error::Degenerate(_)) => return Ok((Vec::new(), Vec::new(), 0.0)),
        other => other?,
    };
    let places = surface.positions[surface.input_vertices..].to_vec();
    let mut points = try_vec(places.len(), "samples")?;
    points.extend(surface.added(positions, triangles).map(|(face, weights)| SurfacePoint::Face { face, weights }));
    Ok((points, places, surface.spacing))
}

/// Some faces as a mesh of their own: positions and triangles.
pub fn extract(positions: &[Vec3], triangles: &[[u32; 3]], faces: &[u32]) -> Result<(Vec<Vec3>, Vec<[u32; 3]>)> {
    let mut own = try_vec(faces.len(), "a feature's surface")?;
    if faces.len() > positions.len() / 8 {
        // most of the mesh: by a list of all its vertices
        let used = Used::new(positions.len(), faces.iter().map(|&f| triangles[f as usize]), "a feature's surface")?;
        let mut own_positions = try_vec(used.vertices.len(), "a feature's surface")?;
        own_positions.extend(used.vertices.iter().map(|&v| positions[v as usize]));
        own.extend(faces.iter().map(|&f| used.triangle(triangles[f as usize])));
        return Ok((own_positions, own));
    }
    let mut used: Vec<u32> = try_vec(3 * faces.len(), "a feature's surface")?;
    used.extend(faces.iter().flat_map(|&f| triangles[f as usize]));
    used.sort_unstable();
    used.dedup();
    let mut own_positions = try_vec(used.len(), "a feature's surface")?;
    own_positions.extend(used.iter().map(|&v| positions[v as usize]));
    // every corner is among those collected
    own.extend(faces.iter().map(|&f| triangles[f as usize].map(|v| used.binary_search(&v).unwrap_or(0) as u32)));
    Ok((own_positions, own))
}

/// Centroid of some faces, and their area.
pub fn centroid(positions: &[Vec3], triangles: &[[u32; 3]], faces: &[u32]) -> (Vec3, f64) {
    let (mut moment, mut whole) = ([0.0; 3], 0.0);
    for &f in faces {
        let p = corners(positions, triangles[f as usize]);
        let a = crate::mesh::measure::area(p);
        whole += a;
        moment = add(moment, scale(add(add(p[0], p[1]), p[2]), a / 3.0));
    }
    (if whole > 0.0 { scale(moment, 1.0 / whole) } else { [f64::NAN; 3] }, whole)
}
