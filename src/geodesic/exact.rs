//! Exact geodesic distances on a triangle mesh, by window propagation.
//!
//! A shortest path on a polyhedral surface is straight where it crosses an edge, once the two faces are laid flat, and
//! bends only at vertices with more than 360 degrees around them. So all shortest paths from one source can be carried
//! across the mesh as *windows*: intervals of edges that see the same (pseudo-)source (Mitchell, Mount & Papadimitriou
//! 1987, "The discrete geodesic problem"). This solver keeps the lower envelope of all windows on every edge, whichever
//! face they come through, takes them in order of distance, drops those that a vertex's known distance makes useless
//! (Xin & Wang 2009, "Improving Chen and Han's algorithm on the discrete geodesic problem"), and lets a path leave a
//! vertex only into the directions that have at least 180 degrees on either side.
//!
//! Unlike the heat method it needs no good triangles: slivers, holes, flat faces, edges with three or more faces and
//! faces that disagree about orientation are all plain cases. Work and memory grow with the number of windows, some tens
//! per face on CAD parts.

mod envelope;
mod propagate;
#[cfg(test)]
mod shapes;
#[cfg(test)]
mod tests;
mod topology;

use crate::error::{Error, Result, try_filled, try_vec};
use crate::job::Job;
use envelope::{Envelope, Queue, TIE, Window};
use propagate::{Arrival, Wave};
use topology::{NONE, Topology, norm, sub};

/// A point of the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SurfacePoint {
    /// The vertex of this index.
    Vertex(u32),
    /// The point of face `face` with barycentric coordinates `weights` (one per corner, in the face's order; not
    /// negative, with a positive sum, which need not be 1).
    Face {
        /// Index of the face.
        face: u32,
        /// Barycentric coordinates.
        weights: [f64; 3],
    },
}

/// A mesh prepared for exact distances from many sources. Shared by threads; each needs a [`Scratch`] of its own.
#[derive(Debug)]
pub struct ExactGeodesics {
    mesh: Topology,
}

/// What a solve may spend and leave out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Length, in model units, by which a path may be longer for each window that is given up for it; 0 is exact.
    /// Distances stay lengths of real paths. The error has no proven bound: with 1e-4 of the model's size, distances
    /// were too long by less than 5e-4 of that size on 27 of 28 CAD parts and by 1.6e-3 on the other, for a quarter to
    /// a half of the windows on parts that have many, and little gain on the rest.
    pub tolerance: f64,
    /// Number of windows that may be made (about 64 bytes each) before the solve gives up.
    pub max_windows: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Limits { tolerance: 0.0, max_windows: 8_000_000 }
    }
}

/// Memory of one solve, to be reused by the next, of the same mesh or another.
#[derive(Debug, Default)]
pub struct Scratch {
    dist: Vec<f64>,
    arrival: Vec<Arrival>,
    /// Whether the vertex has been passed by the wave, and whether it waits to be.
    passed: Vec<bool>,
    waiting: Vec<bool>,
    /// Whether paths may bend at the vertex although it is convex, because a window was given up for it.
    bends: Vec<bool>,
    envelope: Envelope,
    /// Edges that the window being placed has been carried across at distance zero.
    touched: Vec<u32>,
}

/// Distances from one source, in model units; infinite on other components.
#[derive(Debug, Clone, Default)]
pub struct Distances {
    /// One per vertex.
    pub vertices: Vec<f64>,
    /// One per query point.
    pub queries: Vec<f64>,
    /// False if the window limit was met: the distances are then lengths of real paths, perhaps not the shortest.
    pub complete: bool,
    /// Number of windows that were made.
    pub windows: usize,
}

/// Points that distances are wanted at, located on one mesh.
#[derive(Debug, Clone)]
pub struct Queries {
    /// Point k is `seen[first[k]..first[k + 1]]`: one that lies on an edge is seen in each of its faces.
    first: Vec<u32>,
    seen: Vec<Seen>,
}

/// A query point, in scaled units.
#[derive(Debug, Clone)]
enum Seen {
    Vertex(u32),
    Inside {
        face: u32,
        point: [f64; 3],
        /// The face's vertices and how far they are.
        corners: [(u32, f64); 3],
        /// The face's edges and where the point lies in their frames.
        edges: [(u32, f64, f64); 3],
    },
}

/// A point located on the prepared mesh, in scaled units.
enum Place {
    Vertex(u32),
    /// On an edge, at this distance from its origin.
    Edge(u32, f64),
    /// Inside face `.0`, with normalised weights.
    Face(u32, [f64; 3]),
}

impl ExactGeodesics {
    /// Prepares a mesh of `positions` (finite, any unit) and `triangles` (indices into `positions`). The mesh need not be
    /// manifold, closed or oriented; zero-area faces are flat bridges; the two ends of an edge of length zero are one
    /// point. Vertices are connected by faces only: weld coincident ones first.
    ///
    /// Errors: [`Error::Index`], [`Error::NonFinite`], [`Error::Argument`] (2^28 faces or more), [`Error::NoMemory`].
    pub fn new(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<ExactGeodesics> {
        Ok(ExactGeodesics { mesh: Topology::new(positions, triangles)? })
    }

    /// Distances from `source` to every vertex and every point of `queries`, along the surface.
    ///
    /// A solve that meets the limit on windows returns upper bounds and says so. The result does not depend on what
    /// `scratch` was used for before.
    ///
    /// Errors: [`Error::Index`] or [`Error::Argument`] for a point that is not on the mesh or a tolerance that is not 0 or
    /// more, [`Error::NoMemory`],
    /// [`Error::Cancelled`] through `job`.
    pub fn distances(
        &self,
        source: SurfacePoint,
        queries: &[SurfacePoint],
        limits: &Limits,
        scratch: &mut Scratch,
        job: &Job,
    ) -> Result<Distances> {
        self.distances_at(source, &self.prepare(queries)?, limits, scratch, job)
    }

    /// The same with query points that were prepared for this mesh, for many sources.
    ///
    /// Errors: those of [`ExactGeodesics::distances`].
    pub fn distances_at(
        &self,
        source: SurfacePoint,
        queries: &Queries,
        limits: &Limits,
        scratch: &mut Scratch,
        job: &Job,
    ) -> Result<Distances> {
        let mesh = &self.mesh;
        if !(limits.tolerance >= 0.0) {
            return Err(Error::Argument(format!("the tolerance of exact distances is {}", limits.tolerance)));
        }
        scratch.reset(mesh, limits.max_windows)?;
        let place = self.locate(source)?;
        let mut wave = Wave { mesh, state: scratch, tolerance: TIE.max(limits.tolerance * mesh.scale) };
        let start = self.seed(&mut wave, &place);
        let component = mesh.component[start as usize];
        let mut pending = mesh.component_size[component as usize];

        // --- vertices, then whatever lies farther inside faces
        let mut complete = wave.run(&mut pending, 0.0, job)?;
        let mut at_queries = try_filled(queries.first.len() - 1, f64::INFINITY, "exact geodesics: query distances")?;
        self.evaluate(wave.state, &place, queries, 0.0, &mut at_queries);
        if complete {
            let far = |d: &[f64]| d.iter().copied().filter(|d| d.is_finite()).fold(0.0, f64::max);
            let (farthest, passed) = (far(&at_queries), far(&wave.state.dist));
            if Queue::key(farthest) > Queue::key(passed) {
                complete = wave.run(&mut pending, farthest, job)?;
                self.evaluate(wave.state, &place, queries, passed, &mut at_queries);
            }
        }

        let mut vertices = try_filled(mesh.rep.len(), f64::INFINITY, "exact geodesics: distances")?;
        for (d, &r) in vertices.iter_mut().zip(&mesh.rep) {
            *d = scratch.dist[r as usize] / mesh.scale;
        }
        at_queries.iter_mut().for_each(|d| *d /= mesh.scale);
        Ok(Distances { vertices, queries: at_queries, complete, windows: scratch.envelope.made })
    }

    /// Finds the vertex, edge or face that a point lies on.
    fn locate(&self, point: SurfacePoint) -> Result<Place> {
        let mesh = &self.mesh;
        let (face, weights) = match point {
            SurfacePoint::Vertex(v) => {
                let rep = mesh.rep.get(v as usize).copied();
                return rep.map(Place::Vertex).ok_or_else(|| Error::Argument(format!("there is no vertex {v}")));
            }
            SurfacePoint::Face { face, weights } => (face, weights),
        };
        let Some(&corners) = mesh.faces.get(face as usize) else {
            return Err(Error::Argument(format!("there is no face {face}")));
        };
        let sum: f64 = weights.iter().sum();
        if !(weights.iter().all(|w| *w >= 0.0) && sum > 0.0 && sum.is_finite()) {
            return Err(Error::Argument(format!("{weights:?} are not barycentric coordinates")));
        }
        let weights = weights.map(|w| if w / sum > 1e-14 { w / sum } else { 0.0 });
        // Weight by vertex: collapsed faces name one twice.
        let mut at: [(u32, f64); 3] = [(corners[0], weights[0]), (corners[1], weights[1]), (corners[2], weights[2])];
        at.sort_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
        for k in [1, 0] {
            if at[k].0 == at[k + 1].0 {
                at[k].1 += std::mem::take(&mut at[k + 1].1);
            }
        }
        let used: Vec<(u32, f64)> = at.into_iter().filter(|a| a.1 > 0.0).collect();
        match used[..] {
            [(v, _)] => Ok(Place::Vertex(v)),
            [(a, wa), (b, wb)] => Ok(match mesh.ends.binary_search(&[a, b]) {
                Ok(e) => {
                    let len = mesh.crossings[mesh.first[e] as usize].len;
                    Place::Edge(e as u32, len * wb / (wa + wb))
                }
                // The edge of a collapsed face that nothing else uses.
                Err(_) => Place::Vertex(if wa >= wb { a } else { b }),
            }),
            _ => Ok(Place::Face(face, weights)),
        }
    }

    /// Starts the wave; returns a vertex of the source's component.
    fn seed(&self, wave: &mut Wave, place: &Place) -> u32 {
        let mesh = &self.mesh;
        match *place {
            Place::Vertex(v) => {
                wave.reach(v, 0.0, || Arrival::Any);
                v
            }
            Place::Edge(e, t) => {
                let len = mesh.crossings[mesh.first[e as usize] as usize].len;
                let [a, b] = mesh.ends[e as usize];
                wave.reach(a, t, || Arrival::Any);
                wave.reach(b, len - t, || Arrival::Any);
                wave.place(Window::new(e, NONE, (0.0, len), (t, 0.0), 0.0));
                a
            }
            Place::Face(f, weights) => {
                let p = self.point(f, weights);
                for (k, &v) in mesh.faces[f as usize].iter().enumerate() {
                    wave.reach(v, norm(sub(mesh.points[v as usize], p)), || Arrival::Any);
                    let c = mesh.of_face[f as usize][k];
                    let (x, y) = self.in_frame(c, weights);
                    let (edge, len) = (mesh.corners[c as usize].edge, mesh.crossings[c as usize].len);
                    if y > 0.0 || (x > 0.0 && x < len) {
                        wave.place(Window::new(edge, f, (0.0, len), (x, y), 0.0));
                    }
                }
                mesh.faces[f as usize][0]
            }
        }
    }

    /// Scaled position of a point in a face.
    fn point(&self, face: u32, weights: [f64; 3]) -> [f64; 3] {
        let corners = self.mesh.faces[face as usize].map(|v| self.mesh.points[v as usize]);
        [0, 1, 2].map(|k| (0..3).map(|i| weights[i] * corners[i][k]).sum())
    }

    /// A point of a face in the frame of crossing `c` of that face.
    fn in_frame(&self, c: u32, weights: [f64; 3]) -> (f64, f64) {
        let mesh = &self.mesh;
        let (crossing, corner) = (&mesh.crossings[c as usize], &mesh.corners[c as usize]);
        let ends = mesh.ends[corner.edge as usize];
        let face = mesh.faces[crossing.face as usize];
        let weight = |v: u32| face.iter().position(|&u| u == v).map_or(0.0, |k| weights[k]);
        let (we, wa) = (weight(ends[1]), weight(crossing.apex));
        (we * crossing.len + wa * crossing.ax, wa * crossing.ay)
    }

    /// Locates points for [`ExactGeodesics::distances_at`]. Some 200 bytes a point.
    ///
    /// Errors: [`Error::Argument`] for a point that is not on the mesh, [`Error::NoMemory`].
    pub fn prepare(&self, points: &[SurfacePoint]) -> Result<Queries> {
        let mesh = &self.mesh;
        let mut out = Queries { first: try_vec(points.len() + 1, "queries")?, seen: try_vec(points.len(), "queries")? };
        for point in points {
            out.first.push(out.seen.len() as u32);
            match self.locate(*point)? {
                Place::Vertex(v) => out.seen.push(Seen::Vertex(v)),
                Place::Face(f, weights) => out.seen.push(self.seen(f, weights)),
                // A point of every face of the edge (boundary edges hold no windows of their own).
                Place::Edge(e, t) => {
                    for c in &mesh.crossings[mesh.first[e as usize] as usize..mesh.first[e as usize + 1] as usize] {
                        let end = mesh.ends[e as usize][1];
                        let weight = |v| match v {
                            v if v == c.apex => 0.0,
                            v if v == end => t / c.len,
                            _ => 1.0 - t / c.len,
                        };
                        out.seen.push(self.seen(c.face, mesh.faces[c.face as usize].map(weight)));
                    }
                }
            }
        }
        out.first.push(out.seen.len() as u32);
        Ok(out)
    }

    /// A point of a face, seen from its corners and its edges.
    fn seen(&self, face: u32, weights: [f64; 3]) -> Seen {
        let mesh = &self.mesh;
        let point = self.point(face, weights);
        let vertices = mesh.faces[face as usize];
        let corners = vertices.map(|v| (v, norm(sub(mesh.points[v as usize], point))));
        let edges = mesh.of_face[face as usize].map(|c| {
            let (x, y) = self.in_frame(c, weights);
            (mesh.corners[c as usize].edge, x, y)
        });
        Seen::Inside { face, point, corners, edges }
    }

    /// Distances of the query points by what is known on the edges around them, where they are farther than `passed` so
    /// far: the others are final.
    fn evaluate(&self, state: &Scratch, source: &Place, queries: &Queries, passed: f64, out: &mut [f64]) {
        for (range, out) in queries.first.windows(2).zip(out) {
            if Queue::key(*out) > Queue::key(passed) {
                let all = &queries.seen[range[0] as usize..range[1] as usize];
                *out = all.iter().map(|seen| self.reached(state, source, seen)).fold(f64::INFINITY, f64::min);
            }
        }
    }

    /// Distance of a point: inside a face straight from the source or a corner, or through the windows of its edges.
    fn reached(&self, state: &Scratch, source: &Place, seen: &Seen) -> f64 {
        let (face, point, corners, edges) = match seen {
            Seen::Vertex(v) => return state.dist[*v as usize],
            Seen::Inside { face, point, corners, edges } => (*face, *point, corners, edges),
        };
        let mut best = match *source {
            Place::Face(f, s) if f == face => norm(sub(self.point(f, s), point)),
            _ => f64::INFINITY,
        };
        for &(v, away) in corners {
            best = best.min(state.dist[v as usize] + away);
        }
        for &(edge, x, y) in edges {
            for w in state.envelope.windows(edge) {
                // not even straight from the source
                let (room, across, along) = (best - w.sigma, w.py + y, x - w.px);
                if room <= 0.0 || along * along + across * across >= room * room {
                    continue;
                }
                let split = if w.py + y > 0.0 { w.px + (x - w.px) * w.py / (w.py + y) } else { x };
                // straight, or bent at the window's end
                let through = split.clamp(w.b0, w.b1);
                best = best.min(w.at(through) + ((x - through) * (x - through) + y * y).sqrt());
            }
        }
        best
    }
}

/// Makes `v` hold `n` copies of `value`.
fn refill<T: Clone>(v: &mut Vec<T>, n: usize, value: T) -> Result<()> {
    v.clear();
    let no_memory = |_| Error::NoMemory(format!("out of memory: exact geodesics: state of {n} vertices"));
    v.try_reserve_exact(n).map_err(no_memory)?;
    v.resize(n, value);
    Ok(())
}

impl Scratch {
    fn reset(&mut self, mesh: &Topology, max_windows: usize) -> Result<()> {
        let n = mesh.rep.len();
        refill(&mut self.dist, n, f64::INFINITY)?;
        refill(&mut self.arrival, n, Arrival::Any)?;
        refill(&mut self.passed, n, false)?;
        refill(&mut self.waiting, n, false)?;
        refill(&mut self.bends, n, false)?;
        self.touched.clear();
        self.envelope.reset(mesh.ends.len(), max_windows)
    }
}
