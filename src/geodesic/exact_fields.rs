//! Exact geodesics as a maker of distance fields for [`super::eccentricity`].

use super::eccentricity::DistanceFields;
use super::exact::{ExactGeodesics, Limits, Scratch, SurfacePoint};
use crate::error::{Error, Result, try_filled};
use crate::job::Job;
use crate::mesh::NONE;
use rayon::prelude::*;

/// Exact distances between the vertices of a mesh, many sources in parallel.
pub struct ExactFields {
    solver: ExactGeodesics,
    component: Vec<u32>,
    components: usize,
    limits: Limits,
}

impl ExactFields {
    /// Prepares a mesh; see [`ExactGeodesics::new`]. O(faces log faces).
    pub fn new(positions: &[[f64; 3]], triangles: &[[u32; 3]], limits: Limits) -> Result<ExactFields> {
        let solver = ExactGeodesics::new(positions, triangles)?;
        let (component, components) = components(positions.len(), triangles)?;
        Ok(ExactFields { solver, component, components, limits })
    }

    /// The solver behind it.
    pub fn solver(&self) -> &ExactGeodesics {
        &self.solver
    }

    fn column(&self, sources: &[u32], scratch: &mut Scratch, job: &Job) -> Result<Vec<f64>> {
        let mut field = try_filled(self.component.len(), f64::NAN, "distances")?;
        for &s in sources {
            let found = self.solver.distances(SurfacePoint::Vertex(s), &[], &self.limits, scratch, job)?;
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
