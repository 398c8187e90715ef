//! Exact geodesics as a maker of distance fields for [`super::eccentricity`].

use super::eccentricity::DistanceFields;
use super::exact::{ExactGeodesics, Limits, Scratch, SurfacePoint};
use crate::error::{Error, Result, try_filled};
use crate::job::Job;
use crate::mesh::NONE;
use crate::mesh::measure::{bounding_box, distance};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// Exact distances between the vertices of a mesh, many sources in parallel.
pub struct ExactFields {
    solver: ExactGeodesics,
    component: Vec<u32>,
    components: usize,
    limits: Limits,
    windows: AtomicU64,
}

/// Windows may be given up that shorten a path by no more than this share of the mesh's size: several times as fast, and
/// what a path loses in all is a small multiple of it ([`EXCESS`]).
const TOLERANCE: f64 = 5e-4;

/// Relative error that distances may have by it: eight times the largest seen on real parts.
const EXCESS: f64 = 4.0 * TOLERANCE;

/// Fields of one sweep for the diameter; it rarely takes more than three.
const SWEEPS: usize = 4;

/// Windows that are spent on bounds finer than asked for: about half a second of one core.
const SPARE_WINDOWS: u64 = 1_500_000;

impl ExactFields {
    /// Prepares a mesh; see [`ExactGeodesics::new`]. O(faces log faces).
    pub fn new(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<ExactFields> {
        let solver = ExactGeodesics::new(positions, triangles)?;
        let (component, components) = components(positions.len(), triangles)?;
        let (lo, hi) = bounding_box(triangles.iter().flatten().map(|&v| positions[v as usize]));
        let limits = Limits { tolerance: TOLERANCE * distance(lo, hi), ..Limits::default() };
        Ok(ExactFields { solver, component, components, limits, windows: AtomicU64::new(0) })
    }

    /// The longest shortest path of the surface as far as sweeps find it: from each of `starts` to its farthest of
    /// `samples` (points inside faces) and the vertices, from there again, twice. Its length and two ends.
    pub fn diameter(
        &self,
        starts: &[u32],
        samples: &[SurfacePoint],
        job: &Job,
    ) -> Result<Option<(f64, [SurfacePoint; 2])>> {
        let sweep = |scratch: &mut Scratch, &start: &u32| -> Result<(f64, [SurfacePoint; 2])> {
            let mut from = SurfacePoint::Vertex(start);
            let mut best = (0.0, [from; 2]);
            for _ in 0..SWEEPS {
                let found = self.solver.distances(from, samples, &self.limits, scratch, job)?;
                let vertices = found.vertices.iter().enumerate().map(|(v, &d)| (d, SurfacePoint::Vertex(v as u32)));
                let points = found.queries.iter().copied().zip(samples.iter().copied());
                let none = (0.0, from);
                let far = vertices.chain(points).filter(|(d, _)| d.is_finite());
                let far = far.fold(none, |m, (d, p)| if d > m.0 { (d, p) } else { m });
                if far.0 <= best.0 {
                    break;
                }
                best = (far.0, [from, far.1]);
                from = far.1;
            }
            Ok(best)
        };
        let found: Result<Vec<_>> = starts.par_iter().with_max_len(1).map_init(Scratch::default, sweep).collect();
        Ok(found?.into_iter().reduce(|m, x| if x.0 > m.0 { x } else { m }))
    }

    fn column(&self, sources: &[u32], scratch: &mut Scratch, job: &Job) -> Result<Vec<f64>> {
        let mut field = try_filled(self.component.len(), f64::NAN, "distances")?;
        for &s in sources {
            let found = self.solver.distances(SurfacePoint::Vertex(s), &[], &self.limits, scratch, job)?;
            self.windows.fetch_add(found.windows as u64, Ordering::Relaxed);
            if !found.complete {
                let message = format!("exact distances from vertex {s} need more than {} windows", found.windows);
                return Err(Error::Numeric(message));
            }
            for ((d, &exact), &c) in field.iter_mut().zip(&found.vertices).zip(&self.component) {
                if c == self.component[s as usize] {
                    *d = exact;
                }
            }
        }
        Ok(field)
    }
}

impl DistanceFields for ExactFields {
    // a field costs far more than a look at the bounds
    const ROUND: (usize, usize) = (4, 32);

    fn excess(&self) -> f64 {
        EXCESS
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
        let one = |scratch: &mut Scratch, (k, sources): (usize, &&[u32])| {
            let taken = take(k, &self.column(sources, scratch, job)?);
            job.advance(1)?;
            Ok(taken)
        };
        columns.par_iter().enumerate().with_max_len(1).map_init(Scratch::default, one).collect()
    }
}

/// Vertex-connected component of every vertex, numbered by first vertex; [`NONE`] without a triangle.
fn components(vertices: usize, triangles: &[[u32; 3]]) -> Result<(Vec<u32>, usize)> {
    let mut parent: Vec<u32> = try_filled(vertices, 0, "components")?;
    (0..vertices as u32).for_each(|v| parent[v as usize] = v);
    let mut used = try_filled(vertices, false, "components")?;
    fn root(parent: &mut [u32], mut v: u32) -> u32 {
        while parent[v as usize] != v {
            parent[v as usize] = parent[parent[v as usize] as usize];
            v = parent[v as usize];
        }
        v
    }
    for t in triangles {
        t.iter().for_each(|&v| used[v as usize] = true);
        for v in [t[1], t[2]] {
            let (a, b) = (root(&mut parent, t[0]), root(&mut parent, v));
            parent[a.max(b) as usize] = a.min(b);
        }
    }
    let mut number = try_filled(vertices, NONE, "components")?;
    let mut count = 0;
    for v in 0..vertices as u32 {
        let r = root(&mut parent, v) as usize;
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
