//! How long a feature is: the longest shortest way within its own surface, with a bound.

use crate::error::{Result, try_vec};
use crate::geodesic::exact::{ExactGeodesics, Limits, Scratch, SurfacePoint};
use crate::job::Job;
use crate::mesh::measure::{Vec3, add, barycentric, bounding_box, corners, distance, dot, scale};
use crate::mesh::surface::{AnalysisSurface, SurfaceOptions};

/// Points inside faces that ways may end at.
const SAMPLES: usize = 600;
/// Windows may be given up that shorten a way by no more than this share of the feature's size.
const TOLERANCE: f64 = 5e-4;
/// Relative error that ways may have by it.
const EXCESS: f64 = 4.0 * TOLERANCE;
/// Ways from this many places are followed: to find the longest, and to narrow the bound.
const SOURCES: (usize, usize) = (8, 24);
/// The bound is narrow enough at this relative gap.
const NARROW: f64 = 0.05;
/// Windows after which the bound is left as it is.
const WINDOWS: usize = 2_000_000;

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

/// Knowledge about the ways between points.
struct Search<'a> {
    solver: &'a ExactGeodesics,
    samples: Vec<SurfacePoint>,
    place: Vec<Vec3>,
    vertices: usize,
    /// By point: no way from it is longer, over its component.
    upper: Vec<f64>,
    used: Vec<bool>,
    best: (f64, [usize; 2]),
    windows: usize,
}

impl Search<'_> {
    fn point(&self, k: usize) -> SurfacePoint {
        if k < self.vertices { SurfacePoint::Vertex(k as u32) } else { self.samples[k - self.vertices] }
    }

    /// Follows all ways from point `k`; returns the farthest point.
    fn spread(&mut self, k: usize, limits: &Limits, scratch: &mut Scratch, job: &Job) -> Result<usize> {
        let found = self.solver.distances(self.point(k), &self.samples, limits, scratch, job)?;
        self.windows += found.windows;
        self.used[k] = true;
        let far = |m: (f64, usize), (i, &d): (usize, &f64)| if d.is_finite() && d > m.0 { (d, i) } else { m };
        let all = || found.vertices.iter().chain(&found.queries).enumerate();
        let (reach, end) = all().fold((0.0, k), far);
        if reach > self.best.0 {
            self.best = (reach, [k, end]);
        }
        if found.complete {
            all().filter(|(_, d)| d.is_finite()).for_each(|(i, d)| self.upper[i] = self.upper[i].min(reach + d));
            self.upper[k] = reach;
        }
        Ok(end)
    }
}

/// The longest shortest way on the surface of a mesh of its own, or on the largest reach of its pieces; none without faces.
///
/// # Errors
/// Those of [`ExactGeodesics::new`] and [`ExactGeodesics::distances`].
pub fn longest(positions: &[Vec3], triangles: &[[u32; 3]], job: &Job) -> Result<Option<Length>> {
    if triangles.is_empty() {
        return Ok(None);
    }
    let solver = ExactGeodesics::new(positions, triangles)?;
    let (lo, hi) = bounding_box(positions.iter().copied());
    let limits = Limits { tolerance: TOLERANCE * distance(lo, hi), ..Limits::default() };
    let (samples, inside, spacing) = samples(positions, triangles, job)?;
    let vertices = positions.len();
    let mut place = try_vec(vertices + inside.len(), "points of a feature")?;
    place.extend(positions.iter().chain(&inside));
    let n = place.len();
    let mut search = Search {
        solver: &solver,
        samples,
        place,
        vertices,
        upper: vec![f64::INFINITY; n],
        used: vec![false; n],
        best: (0.0, [0; 2]),
        windows: 0,
    };
    let mut scratch = Scratch::default();
    // --- from the ends of the box's diagonals, and from where these ways lead
    for way in [[1.0, 1.0, 1.0], [-1.0, 1.0, 0.9], [1.0, -1.0, 0.8], [1.0, 1.0, -1.1]] {
        let along = |k: usize| dot(search.place[k], way);
        let Some(mut from) = (0..n).max_by(|&a, &b| along(a).total_cmp(&along(b))) else { break };
        let mut reach = 0.0;
        for _ in 0..SOURCES.0 / 2 {
            if search.used[from] {
                break;
            }
            from = search.spread(from, &limits, &mut scratch, job)?;
            let now = search.upper.iter().zip(&search.used).filter(|u| *u.1).fold(0.0, |m: f64, u| m.max(*u.0));
            if now <= reach {
                break;
            }
            reach = now;
        }
    }
    // --- from wherever the way could still be longer
    for k in 0..SOURCES.1 {
        let Some(next) =
            (0..n).filter(|&k| !search.used[k]).max_by(|&a, &b| search.upper[a].total_cmp(&search.upper[b]))
        else {
            break;
        };
        let narrow = search.upper[next] <= (1.0 + NARROW) * search.best.0 || search.windows > WINDOWS;
        if search.upper[next] <= search.best.0 || (narrow && k > 0) {
            break;
        }
        search.spread(next, &limits, &mut scratch, job)?;
    }
    // every point is this near to one of those, and so is where its longest way ends
    let upper = search.upper.iter().copied().fold(search.best.0, f64::max) * (1.0 + EXCESS) + 2.0 * spacing;
    let (length, [a, b]) = search.best;
    let field = solver.distances(search.point(a), &[], &limits, &mut scratch, job)?.vertices;
    Ok(Some(Length { length, upper, ends: [search.place[a], search.place[b]], field }))
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
    for (&p, &face) in places.iter().zip(&surface.vertex_face) {
        let corner = corners(positions, triangles[face as usize]);
        points.push(SurfacePoint::Face { face, weights: barycentric(corner, p) });
    }
    Ok((points, places, surface.spacing))
}

/// Some faces as a mesh of their own: positions and triangles.
pub fn extract(positions: &[Vec3], triangles: &[[u32; 3]], faces: &[u32]) -> Result<(Vec<Vec3>, Vec<[u32; 3]>)> {
    let mut used: Vec<u32> = try_vec(3 * faces.len(), "a feature's surface")?;
    used.extend(faces.iter().flat_map(|&f| triangles[f as usize]));
    used.sort_unstable();
    used.dedup();
    let mut own_positions = try_vec(used.len(), "a feature's surface")?;
    own_positions.extend(used.iter().map(|&v| positions[v as usize]));
    let mut own = try_vec(faces.len(), "a feature's surface")?;
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
