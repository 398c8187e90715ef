//! Certified D1 from few fields: upper bounds by ways that meet at a source.
//!
//! The way from v to u by way of a source s is a way, so with the fields of some sources
//!
//! > ecc(v) ≤ max over u of min over s of d(s,v) + d(s,u).
//!
//! On a sphere a dozen sources bound every vertex to a few percent by this; ecc(s) + d(s,v) takes a source within a few
//! percent of every vertex. And the u at which the maximum is found is the far end whose field is worth having: it tells
//! the values of all vertices that may be farthest from there. Only for distances that obey the triangle inequality.

use super::{DistanceFields, Eccentricity, FINE, Targets, columns, members, slices};
use crate::error::{Error, Result, try_filled, try_vec};
use crate::job::Job;
use crate::mesh::NONE;
use crate::mesh::measure::{Vec3, distance};
use rayon::prelude::*;

/// Sources that are looked at together.
const LANES: usize = 8;
/// Ends that are passed over together.
const CHUNK: usize = 16;
/// Relative margin for the rounding of single precision.
const ROUNDING: f64 = 1e-6;
/// Fields that are kept at a time.
const BLOCK: usize = 64;
/// Vertices that are looked at for the next sources, while there are many to choose from.
const LOOKED_AT: usize = 1_000;
/// What distances may be off by is taken from the tolerance, but at least this share of it is left.
const LEAST_AIM: f64 = 0.4;
/// Share of the rest that is aimed at: values are as far off as their lower bounds, and those by up to the whole gap.
const AIM: f64 = 0.6;

/// A column of sources, at most one a component, and its field.
pub type Column = (Vec<u32>, Vec<f64>);

/// Upper bounds of the ways between points by way of sources: the distances of all points from all sources, in single
/// precision.
#[derive(Debug, Default)]
pub struct Ways {
    /// Multiplies lengths.
    scale: f64,
    columns: usize,
    /// By eight columns, then by vertex; infinite where there is no distance.
    blocks: Vec<Vec<[f32; LANES]>>,
}

/// The vertices that may be far ends, by component, and their distances by column.
struct Ends {
    vertices: Vec<Vec<u32>>,
    columns: Vec<Vec<Vec<f32>>>,
}

/// A vertex whose bounds are apart, and the far end that it would take.
#[derive(Clone, Copy)]
struct Open {
    vertex: u32,
    lower: f64,
    upper: f64,
    end: u32,
}

impl Ways {
    /// Takes in the field of a source: the distance of every point, infinite or NaN where there is none.
    ///
    /// # Errors
    /// [`Error::NoMemory`].
    pub fn add(&mut self, field: &[f64]) -> Result<()> {
        if self.columns == 0 {
            let largest = field.iter().filter(|d| d.is_finite()).fold(0.0, |m: f64, d| m.max(*d));
            self.scale = if largest > 0.0 { 1.0 / largest } else { 1.0 };
        }
        let lane = self.columns % LANES;
        if lane == 0 {
            self.blocks.push(try_filled(field.len(), [f32::INFINITY; LANES], "bounds")?);
        }
        if let Some(block) = self.blocks.last_mut() {
            // NaN, of a component without a source, stays infinite
            for (row, d) in block.iter_mut().zip(field).filter(|(_, d)| d.is_finite()) {
                row[lane] = (d * self.scale) as f32;
            }
        }
        self.columns += 1;
        Ok(())
    }

    /// The column whose source is nearest to `v`.
    fn nearest(&self, v: usize) -> usize {
        let all = self.blocks.iter().flat_map(|b| b[v]).enumerate();
        all.fold((0, f32::INFINITY), |m, (k, d)| if d < m.1 { (k, d) } else { m }).0
    }

    /// By source the scaled distances of some points.
    ///
    /// # Errors
    /// [`Error::NoMemory`].
    pub fn columns(&self, points: &[u32]) -> Result<Vec<Vec<f32>>> {
        let mut out = try_vec(self.columns, "bounds")?;
        for c in 0..self.columns {
            let (block, lane) = (&self.blocks[c / LANES], c % LANES);
            let mut column = try_vec(points.len(), "bounds")?;
            column.extend(points.iter().map(|&v| block[v as usize][lane]));
            out.push(column);
        }
        Ok(out)
    }

    /// No way from `v` to one of `ends` is longer than this, unless that is `floor`, and the end that it is for;
    /// [`NONE`] if none is longer than `floor`. `columns` are those of `ends`.
    pub fn bound(&self, v: u32, floor: f64, ends: &[u32], columns: &[Vec<f32>]) -> (f64, u32) {
        let (most, end) = self.scaled_bound(v, (floor * self.scale) as f32, ends, columns);
        if end == NONE { (floor, NONE) } else { (f64::from(most) / self.scale * (1.0 + ROUNDING), end) }
    }

    /// The same, scaled.
    fn scaled_bound(&self, v: u32, floor: f32, ends: &[u32], columns: &[Vec<f32>]) -> (f32, u32) {
        let v = v as usize;
        let first = self.nearest(v);
        let Some(column) = columns.get(first) else { return (f32::INFINITY, NONE) };
        let near = self.blocks[first / LANES][v][first % LANES];
        if !near.is_finite() {
            return (f32::INFINITY, v as u32);
        }
        let (mut most, mut at, mut hint) = (floor, NONE, 0);
        for (chunk, some) in column.chunks(CHUNK).enumerate() {
            // few ends are so far from the source that it does not rule them out
            if some.iter().fold(0.0, |m: f32, d| if *d > m { *d } else { m }) + near <= most {
                continue;
            }
            for (k, &d) in some.iter().enumerate() {
                // one out of reach is in another component
                if d + near <= most || !d.is_finite() {
                    continue;
                }
                let end = ends[CHUNK * chunk + k];
                let u = end as usize;
                let mut way = meet(&self.blocks[hint][v], &self.blocks[hint][u]);
                for (b, block) in self.blocks.iter().enumerate() {
                    if way <= most {
                        break;
                    }
                    let other = meet(&block[v], &block[u]);
                    if other < way {
                        (way, hint) = (other, b);
                    }
                }
                if way > most {
                    (most, at) = (way, end);
                }
            }
        }
        (most, at)
    }
}

#[inline]
fn meet(a: &[f32; LANES], b: &[f32; LANES]) -> f32 {
    let mut sum = [0f32; LANES];
    (0..LANES).for_each(|k| sum[k] = a[k] + b[k]);
    let half: [f32; LANES / 2] = std::array::from_fn(|k| if sum[k] < sum[k + 4] { sum[k] } else { sum[k + 4] });
    half.into_iter().fold(f32::INFINITY, |m, x| if x < m { x } else { m })
}

impl Ends {
    fn new(vertices: Vec<Vec<u32>>) -> Ends {
        let columns = vec![Vec::new(); vertices.len()];
        Ends { vertices, columns }
    }

    fn add(&mut self, field: &[f64], scale: f64) -> Result<()> {
        for (vertices, columns) in self.vertices.iter().zip(&mut self.columns) {
            let mut column = try_vec(vertices.len(), "bounds")?;
            let at = |&v: &u32| field[v as usize] * scale;
            column.extend(vertices.iter().map(at).map(|d| if d.is_nan() { f32::INFINITY } else { d as f32 }));
            columns.push(column);
        }
        Ok(())
    }
}

/// What is known between two rounds.
struct Search<'a, S> {
    solver: &'a S,
    targets: Targets<'a>,
    state: Eccentricity,
    done: Vec<bool>,
    table: Ways,
    ends: Ends,
    /// Sources by component.
    solved: Vec<usize>,
    /// Largest share of its gap that a value rose by when it was looked into.
    risen: f64,
}

impl<S: DistanceFields> Search<'_, S> {
    fn take(&mut self, sources: &[u32], field: &[f64]) -> Result<()> {
        self.table.add(field)?;
        self.ends.add(field, self.table.scale)?;
        self.state.update(self.solver, self.targets, sources, field);
        for &s in sources {
            self.done[s as usize] = true;
            self.solved[self.solver.component()[s as usize] as usize] += 1;
        }
        Ok(())
    }

    /// Lowers the upper bounds of `vertices` of a component by ways that meet; those that are still open at a gap of `aim`.
    fn look(&mut self, component: usize, vertices: &[u32], aim: f64) -> Vec<Open> {
        let (table, state) = (&self.table, &self.state);
        let (ends, columns) = (&self.ends.vertices[component], &self.ends.columns[component]);
        let one = |&vertex: &u32| {
            let lower = state.lower[vertex as usize];
            let (upper, end) = table.bound(vertex, lower * (1.0 + aim), ends, columns);
            let upper = (upper * (1.0 + ROUNDING)).min(state.upper[vertex as usize]);
            Open { vertex, lower, upper, end }
        };
        let mut open: Vec<Open> = vertices.par_iter().with_min_len(16).map(one).collect();
        open.iter().for_each(|o| self.state.upper[o.vertex as usize] = o.upper);
        open.retain(|o| o.end != NONE && o.upper - o.lower > aim * o.lower);
        open
    }

    /// The next sources of a component: the far ends of the vertices with the widest bounds, each the worst once the ones
    /// before it are foreseen to be known. With the vertices that they are picked for.
    fn picks(&mut self, component: usize, members: &[u32], aim: f64, positions: &[Vec3]) -> Vec<(u32, Open)> {
        let solved = self.solved[component];
        let first = members[0];
        let none = Open { vertex: first, lower: 0.0, upper: 0.0, end: NONE };
        match self.state.farthest[first as usize] {
            _ if solved == 0 => return vec![(first, none)],
            end if solved == 1 && end != NONE && !self.done[end as usize] => return vec![(end, none)],
            _ => {}
        }
        let wide = |v: &u32| {
            let (lower, upper) = (self.state.lower[*v as usize], self.state.upper[*v as usize]);
            upper - lower > aim * lower
        };
        let all: Vec<u32> = members.iter().copied().filter(|v| wide(v)).collect();
        let stride = all.len() / LOOKED_AT + 1;
        let some: Vec<u32> = all.iter().copied().step_by(stride).collect();
        let mut open = self.look(component, &some, aim);
        if open.is_empty() && stride > 1 {
            open = self.look(component, &all, aim);
        }
        let mut out = Vec::new();
        for _ in 0..solved.clamp(S::ROUND.0, S::ROUND.1) {
            let gap = |o: &Open| (o.upper - o.lower) / o.lower;
            let worst = open.iter().fold(None, |m: Option<&Open>, o| match m {
                Some(m) if gap(m) >= gap(o) => Some(m),
                _ => Some(o),
            });
            let Some(&worst) = worst.filter(|o| gap(o) > aim && !self.done[o.end as usize]) else { break };
            let (end, at) = (worst.end as usize, positions[worst.end as usize]);
            out.push((worst.end, Open { upper: self.state.upper[worst.vertex as usize], ..worst }));
            for o in &mut open {
                let beside = o.lower + distance(positions[o.end as usize], at);
                let here = self.state.lower[end] + distance(positions[o.vertex as usize], at);
                // NaN, of one that is not asked for, leaves it
                o.upper = o.upper.min(beside).min(here);
            }
        }
        out
    }

    /// Solves for the fields of all corners.
    fn all_corners(&mut self, job: &Job) -> Result<()> {
        let left = |ends: &Vec<u32>| ends.iter().copied().filter(|&v| !self.done[v as usize]).collect();
        let left: Vec<Vec<u32>> = self.ends.vertices.iter().map(left).collect();
        for block in columns(&left).chunks(BLOCK) {
            let fields = self.solver.for_each_column(&slices(block), job, |_, field| field.to_vec())?;
            block.iter().zip(&fields).try_for_each(|(sources, field)| self.take(sources, field))?;
        }
        Ok(())
    }

    /// By how much values rose, at most, when they were looked into: a share of their gap. Pick k is in `fields[k]`.
    fn learn(&mut self, picks: &[(u32, Open)], fields: &[Vec<f64>]) {
        for ((_, open), field) in picks.iter().zip(fields).filter(|((_, o), _)| o.end != NONE) {
            let risen = (field[open.vertex as usize] - open.lower) / (open.upper - open.lower);
            if risen.is_finite() {
                self.risen = self.risen.max(risen.min(1.0));
            }
        }
    }

    /// Pads the bounds by what distances may be off by, and tells what the values are short of.
    fn conclude(self, asked: &[Vec<u32>]) -> Eccentricity {
        let (long, short) = self.solver.error();
        let mut state = self.state;
        let mut open = 0.0f64;
        for v in asked.iter().flatten().map(|&v| v as usize) {
            let gap = state.upper[v] / state.lower[v] - 1.0;
            open = if gap.is_finite() { open.max(gap) } else { open };
            state.lower[v] = (state.lower[v] - long * state.upper[v]).min(state.distance[v]);
            state.upper[v] = (state.upper[v] * (1.0 + short)).max(state.distance[v]);
        }
        state.missed = self.risen * open;
        state
    }
}

/// The eccentricities that `targets` asks for, to a relative gap of `tolerance`; `known` are fields that there are already.
pub fn meeting<S: DistanceFields>(
    solver: &S,
    positions: &[Vec3],
    targets: Targets<'_>,
    tolerance: f64,
    known: &[Column],
    job: &Job,
) -> Result<Eccentricity> {
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        return Err(Error::Argument(format!("the D1 tolerance must be positive, not {tolerance}")));
    }
    let n = solver.component().len();
    let far = members(solver, targets.far)?;
    let mut asked = members(solver, targets.ask)?;
    asked.iter_mut().zip(&far).filter(|(_, far)| far.is_empty()).for_each(|(asked, _)| asked.clear());
    let mut search = Search {
        solver,
        targets,
        state: Eccentricity::unknown(solver)?,
        done: try_filled(n, false, "sources")?,
        table: Ways::default(),
        ends: Ends::new(far),
        solved: vec![0; solver.component_count()],
        risen: 0.0,
    };
    let state = &mut search.state;
    for v in asked.iter().flatten().map(|&v| v as usize) {
        (state.distance[v], state.lower[v], state.upper[v]) = (0.0, 0.0, f64::INFINITY);
    }
    known.iter().try_for_each(|(sources, field)| search.take(sources, field))?;
    if solver.has_spare_for(search.ends.vertices.iter().map(Vec::len).max().unwrap_or(0)) {
        search.all_corners(job)?;
    }
    let (long, short) = solver.error();
    let room = (tolerance - long - short).max(LEAST_AIM * tolerance);
    loop {
        let aim = if solver.has_spare() { (AIM * room).min(FINE) } else { AIM * room };
        let mut picks: Vec<Vec<(u32, Open)>> = try_vec(asked.len(), "sources")?;
        for (component, members) in asked.iter().enumerate() {
            let of_component =
                if members.is_empty() { Vec::new() } else { search.picks(component, members, aim, positions) };
            picks.push(of_component);
        }
        let sources: Vec<Vec<u32>> = picks.iter().map(|picks| picks.iter().map(|p| p.0).collect()).collect();
        let columns = columns(&sources);
        if columns.is_empty() {
            return Ok(search.conclude(&asked));
        }
        let fields = solver.for_each_column(&slices(&columns), job, |_, field| field.to_vec())?;
        picks.iter().for_each(|picks| search.learn(picks, &fields));
        for (sources, field) in columns.iter().zip(&fields) {
            search.take(sources, field)?;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geodesic::{ExactFields, Mode, eccentricity};
    use crate::mesh::corners::shape_corners;
    use crate::mesh::shapes::{Shape, grid_box, icosphere, union};

    #[test]
    fn bounds_hold_the_value_of_all_sources_and_are_as_near_as_asked_for() {
        let rod: Shape = grid_box([20.0, 1.0, 1.0], [40, 2, 2]);
        let shapes = [icosphere(3), grid_box([1.0; 3], [8; 3]), union(&[rod, icosphere(2)])];
        for (p, t) in &shapes {
            let solver = ExactFields::new(p, t).unwrap();
            let (all, job) = (vec![true; p.len()], Job::default());
            // far ends are the corners, as of a box, or any vertex, as of a sphere; a few only tell little
            let few: Vec<bool> = (0..p.len()).map(|v| v % 100 == 0).collect();
            for (tolerance, far) in [(0.1, &all), (0.05, &shape_corners(p, t).unwrap()), (0.05, &few)] {
                let targets = Targets { ask: &all, far };
                let truth = eccentricity(&solver, p, targets, Mode::AllSources, &job).unwrap();
                let found = meeting(&solver, p, targets, tolerance, &[], &job).unwrap();
                assert!(found.solves <= truth.solves, "{} of {}", found.solves, truth.solves);
                for v in (0..p.len()).filter(|v| !found.distance[*v].is_nan()) {
                    let (exact, lower, upper) = (truth.distance[v], found.lower[v], found.upper[v]);
                    // the fields that they are held against may be too long by this share
                    assert!(lower <= exact * 1.002 && exact <= upper * 1.002, "{v}: {exact} in {lower} {upper}");
                    assert!(upper - lower <= tolerance * found.distance[v], "{v}: {lower} {upper}");
                    assert!((lower..=upper).contains(&found.distance[v]));
                }
            }
        }
    }

    #[test]
    fn ways_are_bounded_as_by_all_sums() {
        // points in two rooms, 40 in each, and fields of every fifth
        let mut seed = 1u64;
        let mut random = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 33) as f64 / (1u64 << 31) as f64
        };
        let points: Vec<Vec3> = (0..80).map(|_| [random(), random(), random()]).collect();
        let apart = |a: usize, b: usize| (a < 40) != (b < 40);
        let d = |a: usize, b: usize| if apart(a, b) { f64::INFINITY } else { distance(points[a], points[b]) };
        let sources: Vec<usize> = (0..80).step_by(5).collect();
        let mut ways = Ways::default();
        for &s in &sources {
            ways.add(&(0..80).map(|v| d(s, v)).collect::<Vec<_>>()).unwrap();
        }
        let ends: Vec<u32> = (0..80).rev().collect();
        let columns = ways.columns(&ends).unwrap();
        let meet = |v: usize, u: usize| sources.iter().map(|&s| d(s, v) + d(s, u)).fold(f64::INFINITY, f64::min);
        for v in 0..80 {
            let reached = (0..80).filter(|&u| !apart(v, u));
            let longest = reached.map(|u| meet(v, u)).fold(0.0, f64::max);
            let (bound, end) = ways.bound(v as u32, 0.0, &ends, &columns);
            assert!((bound / longest - 1.0).abs() < 1e-5, "{v}: {bound} is not {longest}");
            assert!((meet(v, end as usize) / longest - 1.0).abs() < 1e-5);
            assert_eq!(ways.bound(v as u32, 1.01 * longest, &ends, &columns), (1.01 * longest, NONE));
        }
    }
}
