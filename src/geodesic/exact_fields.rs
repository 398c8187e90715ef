//! Exact geodesics as a maker of distance fields for [`super::eccentricity`].

use super::eccentricity::{Column, DistanceFields};
use super::exact::{Distances, ExactGeodesics, Limits, Queries, Scratch, SurfacePoint};
use crate::error::{Error, Result, try_filled, try_vec};
use crate::job::Job;
use crate::mesh::NONE;
use crate::mesh::measure::{bounding_box, distance};
use crate::mesh::proxy::{Place, Proxy};
use crate::mesh::sets::Sets;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// Exact distances between points of a mesh, many sources in parallel.
pub struct ExactFields {
    solver: ExactGeodesics,
    component: Vec<u32>,
    components: usize,
    limits: Limits,
    windows: AtomicU64,
    solves: AtomicU64,
    /// The points, and for each that is a vertex of the solver's mesh its number there.
    points: Vec<SurfacePoint>,
    vertex: Vec<u32>,
    /// The numbers of the points that are no vertices, and their places.
    inside: Vec<u32>,
    queries: Queries,
    /// Distances on the mesh that stands in for another are multiplied by this.
    stretch: f64,
    /// Their largest relative error then.
    distortion: f64,
    known: Vec<Column>,
    /// Memory of solves that are over.
    spare: Mutex<Vec<Scratch>>,
}

/// Windows may be given up that shorten a path by no more than this share of the mesh's size: several times as fast, and
/// what a path loses in all is a small multiple of it ([`EXCESS`]).
const TOLERANCE: f64 = 5e-4;

/// Relative error that distances may have by it: eight times the largest seen on real parts.
const EXCESS: f64 = 4.0 * TOLERANCE;

/// Relative error of distances that was seen on real parts: up to this on all but one in thirty.
const USUAL: f64 = TOLERANCE;

/// Fields of one sweep for the diameter; it rarely takes more than three.
const SWEEPS: usize = 4;

/// Windows that are spent on bounds finer than asked for: about a fifth of a second of one core.
const SPARE_WINDOWS: u64 = 300_000;

/// Windows that may be spent on a field from every far end.
const ALL_WINDOWS: u64 = 300_000;

impl ExactFields {
    /// Prepares a mesh; the points are its vertices. See [`ExactGeodesics::new`]. O(faces log faces).
    ///
    /// # Errors
    /// Those of [`ExactGeodesics::new`].
    pub fn new(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<ExactFields> {
        let (component, components) = components(positions.len(), triangles)?;
        let mut vertex = try_vec(positions.len(), "points")?;
        vertex.extend(0..positions.len() as u32);
        let points = vertex.iter().map(|&v| SurfacePoint::Vertex(v)).collect();
        Self::between(positions, triangles, (component, components), points, vertex)
    }

    /// Distances between `places` of a mesh that stands in for another, whose components are those of the places.
    ///
    /// # Errors
    /// Those of [`ExactGeodesics::new`].
    pub fn on_proxy(proxy: &Proxy, places: &[Place], component: Vec<u32>, components: usize) -> Result<ExactFields> {
        let mut vertex = try_filled(places.len(), NONE, "points")?;
        let mut points = try_vec(places.len(), "points")?;
        for (p, at) in places.iter().zip(&mut vertex) {
            let corner = p.weights.iter().position(|w| *w == 1.0).filter(|_| p.face != NONE);
            points.push(match corner {
                Some(k) => {
                    *at = proxy.triangles[p.face as usize][k];
                    SurfacePoint::Vertex(*at)
                }
                None => SurfacePoint::Face { face: p.face, weights: p.weights },
            });
        }
        Self::between(&proxy.positions, &proxy.triangles, (component, components), points, vertex)
    }

    fn between(
        positions: &[[f64; 3]],
        triangles: &[[u32; 3]],
        (component, components): (Vec<u32>, usize),
        points: Vec<SurfacePoint>,
        vertex: Vec<u32>,
    ) -> Result<ExactFields> {
        let solver = ExactGeodesics::new(positions, triangles)?;
        let (lo, hi) = bounding_box(triangles.iter().flatten().map(|&v| positions[v as usize]));
        let limits = Limits { tolerance: TOLERANCE * distance(lo, hi), ..Limits::default() };
        let inside = (0..points.len() as u32).filter(|&i| vertex[i as usize] == NONE && component[i as usize] != NONE);
        let inside: Vec<u32> = inside.collect();
        let places: Vec<SurfacePoint> = inside.iter().map(|&i| points[i as usize]).collect();
        let queries = solver.prepare(&places)?;
        let (windows, solves) = (AtomicU64::new(0), AtomicU64::new(0));
        Ok(ExactFields {
            solver,
            component,
            components,
            limits,
            windows,
            solves,
            points,
            vertex,
            inside,
            queries,
            stretch: 1.0,
            distortion: 0.0,
            known: Vec::new(),
            spare: Mutex::new(Vec::new()),
        })
    }

    /// The components of the points and their number.
    pub fn components(&self) -> (&[u32], usize) {
        (&self.component, self.components)
    }

    /// Windows that one field took on average.
    pub fn windows_per_field(&self) -> f64 {
        self.windows.load(Ordering::Relaxed) as f64 / self.solves.load(Ordering::Relaxed).max(1) as f64
    }

    /// How far distances are off, as far as is known: a share of the largest.
    pub fn distance_error(&self) -> f64 {
        USUAL + self.distortion
    }

    /// Distances on this mesh are to be multiplied by `stretch` to be like those on the one that it stands in for, and may
    /// then be off by `distortion`, a share of the largest.
    pub fn set_distortion(&mut self, stretch: f64, distortion: f64) {
        (self.stretch, self.distortion) = (stretch, distortion);
    }

    /// Hands over fields that were solved for already, by these points and stretched.
    pub fn set_known(&mut self, known: Vec<Column>) {
        self.known = known;
    }

    /// One solve, in memory that another has left.
    fn solve(&self, source: SurfacePoint, queries: &Queries, job: &Job) -> Result<Distances> {
        let spare = || self.spare.lock().unwrap_or_else(PoisonError::into_inner);
        let mut scratch = spare().pop().unwrap_or_default();
        let found = self.solver.distances_at(source, queries, &self.limits, &mut scratch, job);
        spare().push(scratch);
        let mut found = found?;
        found.vertices.iter_mut().chain(&mut found.queries).for_each(|d| *d *= self.stretch);
        Ok(found)
    }

    /// The longest shortest path of the surface as far as sweeps find it: from each of `starts` to its farthest of
    /// `samples` (points inside faces of the solver's mesh) and its vertices, from there again, a few times. Its length
    /// and two ends.
    pub fn diameter(
        &self,
        starts: &[u32],
        samples: &[SurfacePoint],
        job: &Job,
    ) -> Result<Option<(f64, [SurfacePoint; 2])>> {
        let queries = self.solver.prepare(samples)?;
        let sweep = |&from: &SurfacePoint| -> Result<(f64, [SurfacePoint; 2])> {
            let found = self.solve(from, &queries, job)?;
            let vertices = found.vertices.iter().enumerate().map(|(v, &d)| (d, SurfacePoint::Vertex(v as u32)));
            let points = found.queries.iter().copied().zip(samples.iter().copied());
            let far = vertices.chain(points).filter(|(d, _)| d.is_finite());
            let far = far.fold((0.0, from), |m, (d, p)| if d > m.0 { (d, p) } else { m });
            Ok((far.0, [from, far.1]))
        };
        let mut swept: Vec<SurfacePoint> = Vec::new();
        let mut next: Vec<(f64, SurfacePoint)> = starts.iter().map(|&s| (0.0, self.points[s as usize])).collect();
        let mut best = None;
        for _ in 0..SWEEPS {
            // where others have been already, the way leads on as it did for them
            next.retain(|(_, from)| {
                let new = !swept.contains(from);
                if new {
                    swept.push(*from);
                }
                new
            });
            let found: Result<Vec<_>> = next.par_iter().with_max_len(1).map(|(_, from)| sweep(from)).collect();
            let found = found?;
            best = found.iter().copied().chain(best).reduce(|m, x| if x.0 > m.0 { x } else { m });
            let farther = next.iter().zip(found).filter(|((so_far, _), (far, _))| far > so_far);
            next = farther.map(|(_, (far, ends))| (far, ends[1])).collect();
        }
        Ok(best)
    }

    /// The farthest of some points of the solver's mesh from another: how far, and its number.
    pub fn farthest(&self, from: SurfacePoint, points: &[SurfacePoint], job: &Job) -> Result<Option<(f64, usize)>> {
        let found = self.solve(from, &self.solver.prepare(points)?, job)?;
        let far = found.queries.iter().copied().enumerate().filter(|(_, d)| d.is_finite());
        Ok(far.fold(None, |m, (k, d)| if m.is_none_or(|m: (f64, usize)| d > m.0) { Some((d, k)) } else { m }))
    }

    fn column(&self, sources: &[u32], job: &Job) -> Result<Vec<f64>> {
        let mut field = try_filled(self.component.len(), f64::NAN, "distances")?;
        for &s in sources {
            let found = self.solve(self.points[s as usize], &self.queries, job)?;
            self.windows.fetch_add(found.windows as u64, Ordering::Relaxed);
            self.solves.fetch_add(1, Ordering::Relaxed);
            if !found.complete {
                let message = format!("exact distances from vertex {s} need more than {} windows", found.windows);
                return Err(Error::Numeric(message));
            }
            let component = self.component[s as usize];
            for (i, d) in field.iter_mut().enumerate().filter(|(i, _)| self.component[*i] == component) {
                if let Some(exact) = found.vertices.get(self.vertex[i] as usize) {
                    *d = *exact;
                }
            }
            for (&i, &exact) in self.inside.iter().zip(&found.queries) {
                if self.component[i as usize] == component {
                    field[i as usize] = exact;
                }
            }
        }
        Ok(field)
    }
}

impl DistanceFields for ExactFields {
    // a field costs far more than a look at the bounds
    const ROUND: (usize, usize) = (4, 32);

    const METRIC: bool = true;

    fn known(&self) -> &[Column] {
        &self.known
    }

    fn error(&self) -> (f64, f64) {
        (EXCESS + self.distortion, self.distortion)
    }

    fn has_spare_for(&self, count: usize) -> bool {
        self.windows_per_field() > 0.0 && self.windows_per_field() * count as f64 <= ALL_WINDOWS as f64
    }

    // Read between rounds only, when the sum is the same for every number of threads.
    fn has_spare(&self) -> bool {
        self.windows.load(Ordering::Relaxed) < SPARE_WINDOWS
    }

    fn component(&self) -> &[u32] {
        &self.component
    }

    fn component_count(&self) -> usize {
        self.components
    }

    fn for_each_column<T: Send>(
        &self,
        columns: &[&[u32]],
        job: &Job,
        take: impl Fn(usize, &[f64]) -> T + Sync,
    ) -> Result<Vec<T>> {
        let one = |(k, sources): (usize, &&[u32])| {
            let taken = take(k, &self.column(sources, job)?);
            job.advance(1)?;
            Ok(taken)
        };
        columns.par_iter().enumerate().with_max_len(1).map(one).collect()
    }
}

/// Vertex-connected component of every vertex, numbered by first vertex; [`NONE`] without a triangle.
fn components(vertices: usize, triangles: &[[u32; 3]]) -> Result<(Vec<u32>, usize)> {
    let mut sets = Sets::new(vertices)?;
    let mut used = try_filled(vertices, false, "components")?;
    for t in triangles {
        t.iter().for_each(|&v| used[v as usize] = true);
        sets.join(t[0], t[1]);
        sets.join(t[0], t[2]);
    }
    let mut number = try_filled(vertices, NONE, "components")?;
    let mut count = 0;
    for v in 0..vertices as u32 {
        let r = sets.root(v) as usize;
        if used[v as usize] {
            if number[r] == NONE {
                number[r] = count;
                count += 1;
            }
            number[v as usize] = number[r];
        }
    }
    Ok((number, count as usize))
}
