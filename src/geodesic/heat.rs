//! Geodesic distance by the heat method: Crane, Weischedel & Wardetzky, "The heat method for distance computation",
//! Commun. ACM 60 (2017); Eqs. 1-9 of Ge & Flynn (2022).
//!
//! Heat flows from a source for a short time t (Eq. 6), its gradient points away from the distance's (Eqs. 2, 7), and the
//! distance is the function whose gradient comes closest to that direction (Eqs. 3, 8, 9). Both linear systems are
//! factored once a surface; a source then costs two pairs of triangular solves.
//!
//! The surface enters by its edge lengths alone, so intrinsic triangulations (Delaunay flips, mollified slivers) work.
//! The paper's gradient and divergence are not formed as vectors: with the local Dirichlet operator L_f of a triangle,
//! A_f |∇u|² = uᵀ L_f u and A_f X·∇φ_i = -(L_f u)_i / |∇u|, which is Eqs. 7 and 8 written with cotangents.

use super::eccentricity::DistanceFields;
use crate::error::{Error, Result, try_filled};
use crate::job::Job;
use crate::mesh::NONE;
use crate::mesh::intrinsic::IntrinsicMesh;
use crate::sparse::{Cholesky, LANES, Laplacian, Pattern, Row, SymmetricMatrix, Triangle};
use rayon::prelude::*;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// exp(-reach / sqrt(t)) of the farthest vertex stays above about 1e-174, so that its direction is still a number.
const MAX_DECAY_LENGTHS: f64 = 400.0;

/// Dirichlet energy of a triangle, its values being scaled to 1, below which their differences are rounding errors.
const NO_GRADIENT: f64 = 1e-30;

/// Largest backward error of a linear solve that is taken as solved.
const MAX_BACKWARD_ERROR: f64 = 1e-9;

/// Parameters of the heat method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeatOptions {
    /// m in t = m h², h being the mean edge length of the source's component. Crane et al. take 1.
    pub time_factor: f64,
}

impl Default for HeatOptions {
    fn default() -> Self {
        HeatOptions { time_factor: 1.0 }
    }
}

/// Both factors of the heat method on one surface, for any number of sources.
pub struct HeatSolver {
    /// Vertices and triangles inside are in elimination order: the surface's vertex v comes `place[v]`-th.
    place: Vec<u32>,
    triangles: Vec<Triangle>,
    grounded: Vec<bool>,
    heat: (SymmetricMatrix, Cholesky),
    poisson: (SymmetricMatrix, Cholesky),
    component: Vec<u32>,
    components: usize,
}

/// Memory of one solving thread.
pub struct Scratch {
    heat: Vec<Row>,
    divergence: Vec<Row>,
    fields: Vec<f64>,
}

impl HeatSolver {
    /// Assembles and factors. Memory and time of a sparse Cholesky factor of a planar graph: about 40 numbers a vertex
    /// at 10 k vertices, growing with log n.
    pub fn new(mesh: &IntrinsicMesh, options: HeatOptions, job: &Job) -> Result<HeatSolver> {
        if !(options.time_factor > 0.0 && options.time_factor.is_finite()) {
            return Err(Error::Argument(format!("the time factor must be positive, not {}", options.time_factor)));
        }
        let laplacian = Laplacian::new(mesh)?;
        let (component, steps) = time_steps(mesh, options.time_factor)?;
        job.check()?;

        // --- Eq. 6: M + t L
        let t = component.iter().map(|&c| steps.get(c as usize).copied().unwrap_or(1.0)).collect::<Vec<_>>();
        let heat = laplacian.heat_operator(&t);
        let pattern = Pattern::new(&heat)?;
        job.afford(4 * pattern.factor_bytes(), "factoring the Laplacian")?;
        let heat_factor = Cholesky::new(&pattern, &heat)?;
        job.advance(1)?;

        // --- Eq. 9: L, regular once each component has a vertex at zero
        let ground = ground(&component, steps.len())?;
        let poisson = laplacian.grounded(&ground);
        let poisson_factor = Cholesky::new(&pattern, &poisson)?;
        job.advance(1)?;

        let order = pattern.order();
        let mut place = try_filled(order.len(), 0, "the elimination order")?;
        order.iter().enumerate().for_each(|(k, &v)| place[v as usize] = k as u32);
        let mut triangles = laplacian.triangles;
        triangles.iter_mut().for_each(|t| t.vertices = t.vertices.map(|v| place[v as usize]));
        let grounded = order.iter().map(|&v| ground[v as usize]).collect();
        let (heat, poisson) = ((heat, heat_factor), (poisson, poisson_factor));
        Ok(HeatSolver { place, triangles, grounded, heat, poisson, component, components: steps.len() })
    }

    /// Number of vertices of the surface.
    pub fn vertex_count(&self) -> usize {
        self.component.len()
    }

    /// Memory for [`HeatSolver::solve`].
    pub fn scratch(&self) -> Result<Scratch> {
        let rows = || try_filled(self.vertex_count(), [0.0; LANES], "right-hand sides");
        let fields = try_filled(self.vertex_count() * LANES, 0.0, "right-hand sides")?;
        Ok(Scratch { heat: rows()?, divergence: rows()?, fields })
    }

    /// Distances from at most [`LANES`] columns of source vertices: n numbers a column, one column after the other, in
    /// model units. A column holds at most one source a component, as components do not feel each other: a vertex gets its
    /// distance from the source in its own component, NaN where there is none. A source's own distance is 0.
    pub fn solve<'s>(&self, columns: &[&[u32]], scratch: &'s mut Scratch) -> Result<&'s [f64]> {
        let (u, b) = (&mut scratch.heat, &mut scratch.divergence);

        // --- Eq. 6: (M + t L) u = delta
        u.fill([0.0; LANES]);
        for (k, sources) in columns.iter().enumerate() {
            sources.iter().for_each(|&s| u[self.place[s as usize] as usize][k] = 1.0);
        }
        let first = self.first(u);
        self.heat.1.solve_in_place(u);
        certify(&self.heat.0, &self.first(u), &first)?;

        // --- Eqs. 7 and 8: divergence of the normalised gradient
        pulp::Arch::new().dispatch(Divergence { triangles: &self.triangles, u, b });
        for (b, _) in b.iter_mut().zip(&self.grounded).filter(|(_, g)| **g) {
            *b = [0.0; LANES];
        }

        // --- Eq. 9: L phi = b, with phi = 0 at the grounded vertices, then at the sources
        let first = self.first(b);
        self.poisson.1.solve_in_place(b);
        certify(&self.poisson.0, &self.first(b), &first)?;
        let fields = &mut scratch.fields[..self.vertex_count() * columns.len()];
        for (k, (field, &sources)) in fields.chunks_exact_mut(self.vertex_count()).zip(columns).enumerate() {
            let mut zero = vec![f64::NAN; self.components];
            for &s in sources {
                zero[self.component[s as usize] as usize] = b[self.place[s as usize] as usize][k];
            }
            for ((d, &place), &c) in field.iter_mut().zip(&self.place).zip(&self.component) {
                *d = b[place as usize][k] - zero.get(c as usize).copied().unwrap_or(f64::NAN);
            }
        }
        Ok(fields)
    }

    /// The first column of a block, in the surface's numbering.
    fn first(&self, block: &[Row]) -> Vec<f64> {
        self.place.iter().map(|&k| block[k as usize][0]).collect()
    }
}

impl DistanceFields for HeatSolver {
    const ROUND: (usize, usize) = (LANES, 8 * LANES);

    // Heat distances err to both sides; the contradictions among the fields show by how much.
    fn error(&self) -> (f64, f64) {
        (0.0, 0.0)
    }

    fn has_spare(&self) -> bool {
        false
    }

    fn has_spare_for(&self, _count: usize) -> bool {
        false
    }

    fn component(&self) -> &[u32] {
        &self.component
    }

    fn component_count(&self) -> usize {
        self.components
    }

    /// Blocks of [`LANES`] columns in parallel. The blocks, and so all roundings, do not depend on the number of threads.
    fn for_each_column<T: Send>(
        &self,
        columns: &[&[u32]],
        job: &Job,
        take: impl Fn(usize, &[f64]) -> T + Sync,
    ) -> Result<Vec<T>> {
        let n = self.vertex_count();
        let solve_block = |scratch: &mut Result<Scratch>, (block, columns): (usize, &[&[u32]])| -> Result<Vec<T>> {
            let scratch = scratch.as_mut().map_err(|e| e.clone())?;
            let distances = self.solve(columns, scratch)?;
            let taken = distances.chunks_exact(n).enumerate().map(|(k, d)| take(block * LANES + k, d)).collect();
            job.advance(columns.len() as u64)?;
            Ok(taken)
        };
        let blocks = columns.par_chunks(LANES).enumerate().map_init(|| self.scratch(), solve_block);
        Ok(blocks.collect::<Result<Vec<_>>>()?.into_iter().flatten().collect())
    }
}

/// b_i = ∫ X·∇φ_i with X = -∇u/|∇u|, the weak form of Eq. 8, for a block of heat fields.
struct Divergence<'a> {
    triangles: &'a [Triangle],
    u: &'a [Row],
    b: &'a mut [Row],
}

impl pulp::NullaryFnOnce for Divergence<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.b.fill([0.0; LANES]);
        for t in self.triangles {
            let [i, j, k] = t.vertices.map(|v| v as usize);
            let mut u = [self.u[i], self.u[j], self.u[k]];
            // Loops over lanes without branches, so that they become vector instructions.
            for l in 0..LANES {
                // u spans hundreds of decades: scale before squaring. Only its direction counts.
                let scale = 1.0 / u[0][l].abs().max(u[1][l].abs()).max(u[2][l].abs()).max(f64::MIN_POSITIVE);
                (u[0][l], u[1][l], u[2][l]) = (u[0][l] * scale, u[1][l] * scale, u[2][l] * scale);
            }
            let mut out = [[0.0; LANES]; 3];
            for l in 0..LANES {
                let s = t.stiffness([u[0][l], u[1][l], u[2][l]]);
                let energy = u[0][l] * s[0] + u[1][l] * s[1] + u[2][l] * s[2]; // A_f |∇u|²
                let inverse = -(t.area / energy.max(NO_GRADIENT)).sqrt(); // -1 / |∇u|
                (out[0][l], out[1][l], out[2][l]) = (s[0] * inverse, s[1] * inverse, s[2] * inverse);
            }
            for (v, out) in [i, j, k].into_iter().zip(&out) {
                for l in 0..LANES {
                    self.b[v][l] += out[l];
                }
            }
        }
    }
}

/// The first vertex of every component, and vertices without a triangle.
fn ground(component: &[u32], components: usize) -> Result<Vec<bool>> {
    let mut grounded = try_filled(component.len(), false, "the Laplacian")?;
    let mut seen = try_filled(components, false, "the Laplacian")?;
    for (v, &c) in component.iter().enumerate() {
        grounded[v] = c == NONE || !seen[c as usize];
        if c != NONE {
            seen[c as usize] = true;
        }
    }
    Ok(grounded)
}

fn certify(a: &SymmetricMatrix, x: &[f64], b: &[f64]) -> Result<()> {
    let error = a.backward_error(x, b);
    if error <= MAX_BACKWARD_ERROR {
        return Ok(());
    }
    Err(Error::Numeric(format!("a linear solve ended with backward error {error:.1e}: the surface is too distorted")))
}

/// Component of every vertex and the time step t = m h² of every component.
fn time_steps(mesh: &IntrinsicMesh, factor: f64) -> Result<(Vec<u32>, Vec<f64>)> {
    let n = mesh.vertex_count;
    let edges = EdgeGraph::new(mesh)?;
    let mut component = try_filled(n, NONE, "components")?;
    let mut distance = try_filled(n, f64::INFINITY, "components")?;
    let mut steps = Vec::new();
    for seed in 0..n {
        if component[seed] != NONE || edges.of(seed).is_empty() {
            continue;
        }
        let members = edges.dijkstra(seed, &mut distance)?;
        members.iter().for_each(|&v| component[v as usize] = steps.len() as u32);
        // the farthest vertex by edges sees the other end of the component: twice as far is beyond everything
        let reach = distance[members[members.len() - 1] as usize];
        let lengths = members.iter().flat_map(|&v| edges.of(v as usize)).map(|e| e.1);
        let (sum, count) = lengths.fold((0.0, 0u64), |(s, c), l| (s + l, c + 1));
        let mean = sum / count as f64;
        steps.push((factor * mean * mean).max((1.5 * reach / MAX_DECAY_LENGTHS).powi(2)));
    }
    Ok((component, steps))
}

/// Edges by vertex: neighbour and length.
struct EdgeGraph {
    start: Vec<u32>,
    edges: Vec<(u32, f64)>,
}

impl EdgeGraph {
    fn new(mesh: &IntrinsicMesh) -> Result<EdgeGraph> {
        let sides = || {
            mesh.triangles.iter().zip(&mesh.lengths).flat_map(|(t, l)| {
                (0..3).flat_map(move |k| [(t[k], t[(k + 1) % 3], l[k]), (t[(k + 1) % 3], t[k], l[k])])
            })
        };
        let mut start = try_filled(mesh.vertex_count + 1, 0u32, "edges")?;
        sides().for_each(|(a, _, _)| start[a as usize + 1] += 1);
        for v in 0..mesh.vertex_count {
            start[v + 1] += start[v];
        }
        let mut fill = start.clone();
        let mut edges = try_filled(6 * mesh.triangles.len(), (0, 0.0), "edges")?;
        for (a, b, l) in sides() {
            edges[fill[a as usize] as usize] = (b, l);
            fill[a as usize] += 1;
        }
        Ok(EdgeGraph { start, edges })
    }

    fn of(&self, v: usize) -> &[(u32, f64)] {
        &self.edges[self.start[v] as usize..self.start[v + 1] as usize]
    }

    /// Vertices reachable from `seed` in the order of their distance along edges, which is written to `distance`.
    fn dijkstra(&self, seed: usize, distance: &mut [f64]) -> Result<Vec<u32>> {
        let mut order = Vec::new();
        // distances are not negative, so their bits sort like they do
        let mut queue = BinaryHeap::from([Reverse((0u64, seed as u32))]);
        distance[seed] = 0.0;
        while let Some(Reverse((bits, v))) = queue.pop() {
            let d = f64::from_bits(bits);
            if d > distance[v as usize] {
                continue;
            }
            order.push(v);
            for &(w, l) in self.of(v as usize) {
                let longer = d + l;
                if longer < distance[w as usize] {
                    distance[w as usize] = longer;
                    queue.push(Reverse((longer.to_bits(), w)));
                }
            }
        }
        Ok(order)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::measure::{dot, scale};
    use crate::mesh::shapes::{grid_box, icosphere, union};

    fn solver((p, t): &(Vec<[f64; 3]>, Vec<[u32; 3]>)) -> HeatSolver {
        let mesh = IntrinsicMesh::from_extrinsic(p, t).unwrap();
        HeatSolver::new(&mesh, HeatOptions::default(), &Job::default()).unwrap()
    }

    fn field(shape: &(Vec<[f64; 3]>, Vec<[u32; 3]>), source: u32) -> Vec<f64> {
        let solver = solver(shape);
        solver.solve(&[&[source]], &mut solver.scratch().unwrap()).unwrap().to_vec()
    }

    #[test]
    fn great_circles_on_the_sphere() {
        let sphere = icosphere(5);
        let d = field(&sphere, 17);
        let (mut error, mut size) = (0.0, 0.0);
        for (q, d) in sphere.0.iter().zip(&d) {
            let exact = dot(*q, sphere.0[17]).clamp(-1.0, 1.0).acos();
            error += (d - exact).powi(2);
            size += exact.powi(2);
        }
        let relative: f64 = (error / size).sqrt();
        assert!(relative < 0.01, "{relative}");
        assert_eq!(d[17], 0.0);
    }

    #[test]
    fn straight_lines_on_the_flat_side_of_a_box() {
        // unit square top of a shallow box, seen from its middle: plane distances
        let (p, t) = grid_box([1.0, 1.0, 0.25], [40, 40, 10]);
        let middle = p.iter().position(|q| *q == [0.5, 0.5, 0.25]).unwrap();
        let d = field(&(p.clone(), t), middle as u32);
        for (q, d) in p.iter().zip(&d).filter(|(q, _)| q[2] == 0.25) {
            let exact = ((q[0] - 0.5).powi(2) + (q[1] - 0.5).powi(2)).sqrt();
            assert!((d - exact).abs() < 0.03, "{q:?}: {d} for {exact}");
        }
    }

    #[test]
    fn other_components_are_not_a_number() {
        let a = icosphere(2);
        let n = a.0.len();
        let b = (a.0.iter().map(|q| scale(*q, 7.0)).collect(), a.1.clone());
        let both = union(&[a.clone(), b]);
        let alone = field(&a, 3);
        let d = field(&both, 3);
        assert!(d[n..].iter().all(|x| x.is_nan()));
        assert!(d[..n].iter().zip(&alone).all(|(p, q)| (p - q).abs() < 1e-9), "the step is that of the own component");
        let solver = solver(&both);
        let together = solver.solve(&[&[3, n as u32 + 5]], &mut solver.scratch().unwrap()).unwrap().to_vec();
        assert_eq!(together[..n], d[..n]);
        assert_eq!(together[n + 5], 0.0);
        let big = field(&both, n as u32 + 3);
        assert!(big[n..].iter().zip(&alone).all(|(p, q)| (p - 7.0 * q).abs() < 1e-8));
    }

    #[test]
    fn a_block_of_sources_is_each_of_them() {
        let shape = grid_box([3.0, 1.0, 1.0], [12, 4, 4]);
        let solver = solver(&shape);
        let n = solver.vertex_count();
        let sources: Vec<u32> = (0..LANES as u32).map(|k| k * 7).collect();
        let columns: Vec<&[u32]> = sources.chunks(1).collect();
        let block = solver.solve(&columns, &mut solver.scratch().unwrap()).unwrap().to_vec();
        for (k, &s) in sources.iter().enumerate() {
            let alone = solver.solve(&[&[s]], &mut solver.scratch().unwrap()).unwrap().to_vec();
            assert!(alone.iter().zip(&block[k * n..]).all(|(p, q)| (p - q).abs() < 1e-10));
        }
    }

    #[test]
    fn a_long_fine_strip_does_not_underflow() {
        // 4000 edge lengths from end to end: with t = h² the heat at the far end would be exp(-4000)
        let (p, t) = grid_box([4000.0, 1.0, 1.0], [4000, 1, 1]);
        let start = p.iter().position(|q| *q == [0.0; 3]).unwrap();
        let d = field(&(p.clone(), t), start as u32);
        for (q, d) in p.iter().zip(&d) {
            assert!((d - q[0]).abs() < 0.02 * q[0] + 20.0, "{q:?}: {d}");
        }
    }

    #[test]
    fn a_time_factor_that_makes_no_sense_is_refused() {
        let (p, t) = icosphere(0);
        let mesh = IntrinsicMesh::from_extrinsic(&p, &t).unwrap();
        for time_factor in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let made = HeatSolver::new(&mesh, HeatOptions { time_factor }, &Job::default());
            assert!(matches!(made, Err(Error::Argument(_))));
        }
    }
}
