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
const AIM: f64 = 0.4;

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
    /// By vertex the column whose source is nearest, and how far it is.
    nearest: Vec<(u32, f32)>,
}

/// Points that ways may end at, neighbours together, with their distances from all sources.
#[derive(Debug)]
pub struct Ends {
    vertices: Vec<u32>,
    /// By source the scaled distance of every point.
    columns: Vec<Vec<f32>>,
    /// By [`CHUNK`] points the source that is nearest to them all, and how far the farthest of them is from it.
    nearest: Vec<(u32, f32)>,
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
            self.nearest = try_filled(field.len(), (0, f32::INFINITY), "bounds")?;
        }
        let lane = self.columns % LANES;
        if lane == 0 {
            self.blocks.push(try_filled(field.len(), [f32::INFINITY; LANES], "bounds")?);
        }
        if let Some(block) = self.blocks.last_mut() {
            // NaN, of a component without a source, stays infinite
            for ((row, nearest), d) in block.iter_mut().zip(&mut self.nearest).zip(field).filter(|(_, d)| d.is_finite())
            {
                row[lane] = (d * self.scale) as f32;
                if row[lane] < nearest.1 {
                    *nearest = (self.columns as u32, row[lane]);
                }
            }
        }
        self.columns += 1;
        Ok(())
    }

    /// The scaled distances of `v` from all sources, and infinity in columns without one.
    fn row(&self, v: u32) -> impl Iterator<Item = f32> + '_ {
        self.blocks.iter().flat_map(move |b| b[v as usize])
    }

    /// The column whose source is nearest to `v`, and how far it is.
    fn nearest(&self, v: u32) -> (u32, f32) {
        self.nearest.get(v as usize).copied().unwrap_or((0, f32::INFINITY))
    }

    /// Prepares `points` to be ends of ways, for as long as no field is added. O(points × sources).
    ///
    /// # Errors
    /// [`Error::NoMemory`].
    pub fn ends(&self, points: &[u32]) -> Result<Ends> {
        // --- neighbours together: by their nearest source
        let mut order = try_vec(points.len(), "bounds")?;
        order.extend(points.iter().map(|&v| (self.nearest(v), v)));
        order.sort_unstable_by(|a, b| a.0.0.cmp(&b.0.0).then(a.0.1.total_cmp(&b.0.1)).then(a.1.cmp(&b.1)));
        let mut vertices = try_vec(points.len(), "bounds")?;
        vertices.extend(order.iter().map(|o| o.1));
        // --- distances, and what rules out many at once
        let mut columns = try_vec(self.columns, "bounds")?;
        let mut nearest = try_filled(points.len().div_ceil(CHUNK), (0, f32::INFINITY), "bounds")?;
        for c in 0..self.columns {
            let (block, lane) = (&self.blocks[c / LANES], c % LANES);
            let mut column = try_vec(points.len(), "bounds")?;
            column.extend(vertices.iter().map(|&v| block[v as usize][lane]));
            for (nearest, chunk) in nearest.iter_mut().zip(column.chunks(CHUNK)) {
                let farthest = chunk.iter().fold(0.0, |m: f32, d| if *d > m { *d } else { m });
                if farthest < nearest.1 {
                    *nearest = (c as u32, farthest);
                }
            }
            columns.push(column);
        }
        Ok(Ends { vertices, columns, nearest })
    }

    /// No way from `v` to one of `ends` is longer than this, unless that is `floor`, and the end that it is for;
    /// [`NONE`] if none is longer than `floor`.
    pub fn bound(&self, v: u32, floor: f64, ends: &Ends) -> (f64, u32) {
        let (most, end) = self.scaled_bound(v, (floor * self.scale) as f32, ends);
        if end == NONE { (floor, NONE) } else { (f64::from(most) / self.scale * (1.0 + ROUNDING), end) }
    }

    /// The same, scaled.
    fn scaled_bound(&self, v: u32, floor: f32, ends: &Ends) -> (f32, u32) {
        if ends.columns.is_empty() {
            return (f32::INFINITY, NONE);
        }
        let row: Vec<f32> = self.row(v).collect();
        let (first, near) = self.nearest(v);
        if !near.is_finite() {
            return (f32::INFINITY, v);
        }
        let (mut most, mut at, mut hint) = (floor, NONE, first);
        for (chunk, (some, &(around, radius))) in ends.vertices.chunks(CHUNK).zip(&ends.nearest).enumerate() {
            // few ends are so far away that the source in their midst does not rule them out
            if row[around as usize] + radius <= most {
                continue;
            }
            let from = CHUNK * chunk;
            let mut ways = Chunk::new(&ends.columns[first as usize][from..], near);
            // then, most likely, that which has ruled out the ones before
            for c in [hint].into_iter().chain(0..ends.columns.len() as u32) {
                if ways.longest() <= most {
                    break;
                }
                ways.meet(&ends.columns[c as usize][from..], row[c as usize]);
                hint = c;
            }
            for (&end, &way) in some.iter().zip(&ways.0) {
                if way > most {
                    (most, at) = (way, end);
                }
            }
        }
        (most, at)
    }
}

/// The shortest ways found to some ends.
struct Chunk([f32; CHUNK]);

impl Chunk {
    /// The ways by the first source; none to ends out of its reach, which are in another component.
    #[inline]
    fn new(column: &[f32], near: f32) -> Chunk {
        let mut ways = [f32::NEG_INFINITY; CHUNK];
        let first = |d: f32| if d < f32::INFINITY { d + near } else { f32::NEG_INFINITY };
        match column.first_chunk::<CHUNK>() {
            Some(column) => (0..CHUNK).for_each(|k| ways[k] = first(column[k])),
            None => ways.iter_mut().zip(column).for_each(|(way, &d)| *way = first(d)),
        }
        Chunk(ways)
    }

    /// Another source, `near` away.
    #[inline]
    fn meet(&mut self, column: &[f32], near: f32) {
        let shorter = |way: f32, d: f32| if d + near < way { d + near } else { way };
        match column.first_chunk::<CHUNK>() {
            Some(column) => (0..CHUNK).for_each(|k| self.0[k] = shorter(self.0[k], column[k])),
            None => self.0.iter_mut().zip(column).for_each(|(way, &d)| *way = shorter(*way, d)),
        }
    }

    #[inline]
    fn longest(&self) -> f32 {
        let longer = |a: f32, b: f32| if a > b { a } else { b };
        let mut most = [f32::NEG_INFINITY; 4];
        for four in self.0.chunks_exact(4) {
            (0..4).for_each(|k| most[k] = longer(four[k], most[k]));
        }
        longer(longer(most[0], most[1]), longer(most[2], most[3]))
    }
}

/// What is known between two rounds.
struct Search<'a, S> {
    solver: &'a S,
    targets: Targets<'a>,
    state: Eccentricity,
    done: Vec<bool>,
    table: Ways,
    /// The vertices that may be far ends, by component.
    ends: Vec<Vec<u32>>,
    /// Sources by component.
    solved: Vec<usize>,
    /// Largest share of its gap that a value rose by when it was looked into.
    risen: f64,
}

impl<S: DistanceFields> Search<'_, S> {
    fn take(&mut self, sources: &[u32], field: &[f64]) -> Result<()> {
        self.table.add(field)?;
        self.state.update(self.solver, self.targets, sources, field);
        for &s in sources {
            self.done[s as usize] = true;
            self.solved[self.solver.component()[s as usize] as usize] += 1;
        }
        Ok(())
    }

    /// Lowers the upper bounds of `vertices` of a component by ways that meet; those that are still open at a gap of `aim`.
    fn look(&mut self, ends: &Ends, vertices: &[u32], aim: f64) -> Vec<Open> {
        let (table, state) = (&self.table, &self.state);
        let one = |&vertex: &u32| {
            let lower = state.lower[vertex as usize];
            let (upper, end) = table.bound(vertex, lower * (1.0 + aim), ends);
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
    fn picks(&mut self, component: usize, members: &[u32], aim: f64, positions: &[Vec3]) -> Result<Vec<(u32, Open)>> {
        let solved = self.solved[component];
        let first = members[0];
        let none = Open { vertex: first, lower: 0.0, upper: 0.0, end: NONE };
        match self.state.farthest[first as usize] {
            _ if solved == 0 => return Ok(vec![(first, none)]),
            end if solved == 1 && end != NONE && !self.done[end as usize] => return Ok(vec![(end, none)]),
            _ => {}
        }
        let wide = |v: &u32| {
            let (lower, upper) = (self.state.lower[*v as usize], self.state.upper[*v as usize]);
            upper - lower > aim * lower
        };
        let all: Vec<u32> = members.iter().copied().filter(|v| wide(v)).collect();
        let stride = all.len() / LOOKED_AT + 1;
        let some: Vec<u32> = all.iter().copied().step_by(stride).collect();
        let ends = self.table.ends(&self.ends[component])?;
        let mut open = self.look(&ends, &some, aim);
        if open.is_empty() && stride > 1 {
            open = self.look(&ends, &all, aim);
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
        Ok(out)
    }

    /// Solves for the fields of all corners.
    fn all_corners(&mut self, job: &Job) -> Result<()> {
        let left = |ends: &Vec<u32>| ends.iter().copied().filter(|&v| !self.done[v as usize]).collect();
        let left: Vec<Vec<u32>> = self.ends.iter().map(left).collect();
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
        ends: far,
        solved: vec![0; solver.component_count()],
        risen: 0.0,
    };
    let state = &mut search.state;
    for v in asked.iter().flatten().map(|&v| v as usize) {
        (state.distance[v], state.lower[v], state.upper[v]) = (0.0, 0.0, f64::INFINITY);
    }
    known.iter().try_for_each(|(sources, field)| search.take(sources, field))?;
    if solver.has_spare_for(search.ends.iter().map(Vec::len).max().unwrap_or(0)) {
        search.all_corners(job)?;
    }
    let (long, short) = solver.error();
    let room = (tolerance - long - short).max(LEAST_AIM * tolerance);
    loop {
        let aim = if solver.has_spare() { (AIM * room).min(FINE) } else { AIM * room };
        let mut picks: Vec<Vec<(u32, Open)>> = try_vec(asked.len(), "sources")?;
        for (component, members) in asked.iter().enumerate() {
            let of_component =
                if members.is_empty() { Vec::new() } else { search.picks(component, members, aim, positions)? };
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
        let table = ways.ends(&ends).unwrap();
        let meet = |v: usize, u: usize| sources.iter().map(|&s| d(s, v) + d(s, u)).fold(f64::INFINITY, f64::min);
        for v in 0..80 {
            let reached = (0..80).filter(|&u| !apart(v, u));
            let longest = reached.map(|u| meet(v, u)).fold(0.0, f64::max);
            let (bound, end) = ways.bound(v as u32, 0.0, &table);
            assert!((bound / longest - 1.0).abs() < 1e-5, "{v}: {bound} is not {longest}");
            assert!((meet(v, end as usize) / longest - 1.0).abs() < 1e-5);
            assert_eq!(ways.bound(v as u32, 1.01 * longest, &table), (1.01 * longest, NONE));
        }
    }
}
