//! D1: the eccentricity of a vertex, the largest geodesic distance d(v, u) to any far end u of its component.
//!
//! [`Mode::AllSources`] is the paper's definition, one distance field a vertex. [`Mode::Certified`] needs far fewer: a
//! field from source s bounds every vertex by the triangle inequality,
//!
//! > max(d(s,v) if s may be a far end, ecc(s) - d(s,v)) ≤ ecc(v) ≤ ecc(s) + d(s,v),
//!
//! and sources are added where the bounds are farthest apart until they agree (Takes & Kosters, "Computing the
//! eccentricity distribution of large graphs", Algorithms 6 (2013), on surfaces). Heat distances are not quite symmetric,
//! so the bounds are padded by the contradictions that the fields show among themselves.

mod meeting;

pub use meeting::{Column, Ways};

use crate::error::{Error, Result, try_filled};
use crate::job::Job;
use crate::mesh::NONE;
use crate::mesh::measure::{Vec3, distance};

/// Something that solves for distance fields on one surface.
pub trait DistanceFields: Sync {
    /// Smallest and largest number of columns of sources between two looks at the bounds.
    const ROUND: (usize, usize);

    /// True if distances are lengths of ways, so that a way by way of a source is none shorter than the shortest.
    const METRIC: bool = false;

    /// Fields that there are already.
    fn known(&self) -> &[Column] {
        &[]
    }

    /// By how much a distance may be too long, and too short, as a share of the largest.
    fn error(&self) -> (f64, f64);

    /// True while so little has been spent that better bounds than asked for are worth having.
    fn has_spare(&self) -> bool;

    /// True if `count` fields more cost so little that bounds need not be bothered with.
    fn has_spare_for(&self, count: usize) -> bool;

    /// Vertex-connected component of every vertex, numbered by first vertex; [`NONE`] without a triangle.
    fn component(&self) -> &[u32];

    /// Number of components.
    fn component_count(&self) -> usize;

    /// Solves every column, in parallel, calls `take` with its number and its field, and returns what it returned, in the
    /// order of the columns. A column is a set of source vertices, at most one a component; its field holds the distance
    /// of every vertex from the source in its component, model units, NaN where there is none. Advances `job` by one a
    /// column. The fields do not depend on the number of threads.
    fn for_each_column<T: Send>(
        &self,
        columns: &[&[u32]],
        job: &Job,
        take: impl Fn(usize, &[f64]) -> T + Sync,
    ) -> Result<Vec<T>>;
}

/// How many distance fields to spend.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mode {
    /// One from every vertex.
    AllSources,
    /// As many as it takes to know every vertex's value to within this relative gap, at most one from every vertex.
    Certified {
        /// (upper - lower) / lower at which a vertex counts as known; 0.05 is 5 %.
        tolerance: f64,
    },
}

/// Whose farthest distance is wanted, and which vertices may be at the far end: flags by vertex.
#[derive(Debug, Clone, Copy)]
pub struct Targets<'a> {
    /// Vertices whose eccentricity is wanted.
    pub ask: &'a [bool],
    /// Vertices that may be the far end. A component without one has no eccentricity.
    pub far: &'a [bool],
}

/// The farthest distance of every vertex that was asked for, model units; NaN at others and at those without a triangle.
#[derive(Debug, Clone)]
pub struct Eccentricity {
    /// The value: the largest lower bound found for d(v, farthest(v)), mostly that distance itself.
    pub distance: Vec<f64>,
    /// The vertex at that distance; [`NONE`] where there is none.
    pub farthest: Vec<u32>,
    /// No vertex is nearer to its farthest point than this, up to the accuracy of the distances themselves.
    pub lower: Vec<f64>,
    /// No vertex is farther from its farthest point than this, likewise.
    pub upper: Vec<f64>,
    /// Distance fields computed.
    pub solves: usize,
    /// By how much fields contradicted each other or the bounds, at most, as a share of the distance; the bounds are padded
    /// by it.
    pub slack: f64,
    /// By how much values may fall short, as a share of the distance: the widest gap between bounds, times the largest
    /// share of its gap that a vertex's value rose by when a field from its end was added.
    pub missed: f64,
    /// By component, the longest distance in any field, far end or not, and its two vertices.
    pub longest: Vec<(f64, [u32; 2])>,
}

/// Eccentricity of the vertices of the solver's surface that `targets` asks for. `positions` of its vertices, in model
/// units, serve to spread the sources of one round.
pub fn eccentricity<S: DistanceFields>(
    solver: &S,
    positions: &[Vec3],
    targets: Targets<'_>,
    mode: Mode,
    job: &Job,
) -> Result<Eccentricity> {
    match mode {
        Mode::AllSources => all_sources(solver, targets, job),
        Mode::Certified { tolerance } if tolerance > 0.0 && tolerance.is_finite() => {
            if S::METRIC {
                meeting::meeting(solver, positions, targets, tolerance, solver.known(), job)
            } else {
                certified(solver, positions, targets, tolerance, job)
            }
        }
        Mode::Certified { tolerance } => {
            Err(Error::Argument(format!("the D1 tolerance must be positive, not {tolerance}")))
        }
    }
}

/// The paper's definition: a field from every vertex. Column k holds the k-th vertex of every component.
fn all_sources<S: DistanceFields>(solver: &S, targets: Targets<'_>, job: &Job) -> Result<Eccentricity> {
    let members = members(solver, targets.ask)?;
    let columns = columns(&members);
    let far = solver.for_each_column(&slices(&columns), job, |_, field| farthest(solver, targets.far, field))?;
    let mut out = Eccentricity::unknown(solver)?;
    for (&s, far) in columns.iter().zip(&far).flat_map(|(c, far)| c.iter().map(move |s| (s, far))) {
        let component = solver.component()[s as usize] as usize;
        let End { far, all } = far[component];
        out.lengthen(component, s, all);
        let s = s as usize;
        if far.0 != NONE {
            (out.distance[s], out.farthest[s], out.lower[s], out.upper[s]) = (far.1, far.0, far.1, far.1);
        }
        out.solves += 1;
    }
    Ok(out)
}

/// The vertices of every component that have their flag set.
fn members<S: DistanceFields>(solver: &S, flag: &[bool]) -> Result<Vec<Vec<u32>>> {
    let mut members: Vec<Vec<u32>> = try_filled(solver.component_count(), Vec::new(), "components")?;
    for (v, &c) in solver.component().iter().enumerate().filter(|&(v, &c)| c != NONE && flag[v]) {
        members[c as usize].push(v as u32);
    }
    Ok(members)
}

/// Column k holds the k-th source of every component that has so many.
fn columns(sources: &[Vec<u32>]) -> Vec<Vec<u32>> {
    let longest = sources.iter().map(Vec::len).max().unwrap_or(0);
    (0..longest).map(|k| sources.iter().filter_map(|s| s.get(k).copied()).collect()).collect()
}

fn slices(columns: &[Vec<u32>]) -> Vec<&[u32]> {
    columns.iter().map(Vec::as_slice).collect()
}

/// The far ends of one component in one field: vertex and distance.
#[derive(Debug, Clone, Copy)]
struct End {
    /// Among those that may be far ends.
    far: (u32, f64),
    /// Among all vertices.
    all: (u32, f64),
}

/// The far ends of a field by component; the lowest vertex of equals.
fn farthest<S: DistanceFields>(solver: &S, far: &[bool], field: &[f64]) -> Vec<End> {
    let none = (NONE, -1.0);
    let mut ends = vec![End { far: none, all: none }; solver.component_count()];
    for (v, (&d, &c)) in field.iter().zip(solver.component()).enumerate() {
        // NaN, of a vertex without a source in its component, compares false
        if c != NONE && d > ends[c as usize].all.1 {
            ends[c as usize].all = (v as u32, d);
        }
        if c != NONE && far[v] && d > ends[c as usize].far.1 {
            ends[c as usize].far = (v as u32, d);
        }
    }
    ends
}

impl Eccentricity {
    fn unknown<S: DistanceFields>(solver: &S) -> Result<Eccentricity> {
        let n = solver.component().len();
        let nan = || try_filled(n, f64::NAN, "eccentricities");
        let farthest = try_filled(n, NONE, "eccentricities")?;
        let longest = vec![(0.0, [NONE; 2]); solver.component_count()];
        Ok(Eccentricity {
            distance: nan()?,
            lower: nan()?,
            upper: nan()?,
            farthest,
            solves: 0,
            slack: 0.0,
            missed: 0.0,
            longest,
        })
    }

    fn lengthen(&mut self, component: usize, source: u32, end: (u32, f64)) {
        if end.1 > self.longest[component].0 {
            self.longest[component] = (end.1, [source, end.0]);
        }
    }

    /// Takes in the field of one column of sources.
    fn update<S: DistanceFields>(&mut self, solver: &S, targets: Targets<'_>, sources: &[u32], field: &[f64]) {
        let ends = farthest(solver, targets.far, field);
        let mut source = vec![NONE; ends.len()];
        for &s in sources {
            let component = solver.component()[s as usize] as usize;
            source[component] = s;
            self.lengthen(component, s, ends[component].all);
        }
        for (v, &d) in field.iter().enumerate().filter(|(v, d)| targets.ask[*v] && !d.is_nan()) {
            let c = solver.component()[v] as usize;
            let (end, ecc) = ends[c].far;
            let may_be_far = targets.far[source[c] as usize];
            let (most, witness) = if may_be_far && d >= ecc - d { (d, source[c]) } else { (ecc - d, end) };
            if most > self.distance[v] {
                (self.distance[v], self.farthest[v]) = (most, witness);
            }
            self.lower[v] = self.lower[v].max(most);
            self.upper[v] = self.upper[v].min(ecc + d);
        }
        for &s in sources.iter().filter(|&&s| targets.ask[s as usize]) {
            let (at, ecc) = ends[solver.component()[s as usize] as usize].far;
            let s = s as usize;
            if ecc > self.distance[s] {
                (self.distance[s], self.farthest[s]) = (ecc, at);
            }
            (self.lower[s], self.upper[s]) = (ecc, ecc);
        }
        self.solves += sources.len();
    }
}

/// What is known of one component between two rounds.
struct Front {
    /// Vertices that are asked for.
    members: Vec<u32>,
    /// Sources so far.
    solved: usize,
    /// Largest relative amount by which a field contradicted the bounds or another field.
    slack: f64,
}

/// Share of the tolerance that is aimed at: what is padded later has room in the rest.
const AIM: f64 = 0.9;

/// The relative gap that is aimed at while there is effort to spare.
const FINE: f64 = 0.01;

fn certified<S: DistanceFields>(
    solver: &S,
    positions: &[Vec3],
    targets: Targets<'_>,
    tolerance: f64,
    job: &Job,
) -> Result<Eccentricity> {
    let n = solver.component().len();
    let mut state = Eccentricity::unknown(solver)?;
    let some_far: Vec<bool> = members(solver, targets.far)?.iter().map(|m| !m.is_empty()).collect();
    let mut fronts: Vec<Front> = Vec::new();
    for (members, some_far) in members(solver, targets.ask)?.into_iter().zip(some_far) {
        if some_far && !members.is_empty() {
            fronts.push(Front { members, solved: 0, slack: 0.0 });
        }
    }
    for &v in fronts.iter().flat_map(|f| &f.members) {
        (state.distance[v as usize], state.lower[v as usize], state.upper[v as usize]) = (0.0, 0.0, f64::INFINITY);
    }
    let mut done = try_filled(n, false, "sources")?;
    loop {
        let tolerance = if solver.has_spare() { tolerance.min(FINE) } else { AIM * tolerance };
        let picks: Vec<Vec<u32>> =
            fronts.iter().map(|f| next_sources(f, &state, &done, positions, tolerance, S::ROUND)).collect();
        let columns = columns(&picks);
        if columns.is_empty() {
            break;
        }
        let fields = solver.for_each_column(&slices(&columns), job, |_, field| field.to_vec())?;
        for (front, picks) in fronts.iter_mut().zip(&picks) {
            let missed = shortfall(solver, targets, &state, picks, &fields);
            state.missed = state.missed.max(missed);
            front.slack = front.slack.max(contradiction(solver, targets, &state, picks, &fields));
            front.solved += picks.len();
        }
        for (sources, field) in columns.iter().zip(&fields) {
            state.update(solver, targets, sources, field);
            sources.iter().for_each(|&s| done[s as usize] = true);
        }
    }
    let (long, short) = solver.error();
    // what is left of the gaps may hide as much as those hid that were looked into
    let open = fronts.iter().flat_map(|f| &f.members).map(|&v| state.upper[v as usize] / state.lower[v as usize] - 1.0);
    state.missed *= open.filter(|g| g.is_finite()).fold(0.0, f64::max);
    for front in &fronts {
        for v in front.members.iter().map(|&v| v as usize) {
            let pad = front.slack * state.distance[v];
            state.lower[v] = (state.lower[v] - pad - long * state.upper[v]).min(state.distance[v]);
            // too long by as much a field from the vertex itself may be: it is held, too
            state.upper[v] = (state.upper[v] * (1.0 + short + long) + pad).max(state.distance[v]);
        }
        state.slack = state.slack.max(front.slack);
    }
    Ok(state)
}

/// By how much the values of new sources fell short of what their own fields say, as a share of the gap between their
/// bounds. Source `picks[k]` is in column k of `fields`.
fn shortfall<S: DistanceFields>(
    solver: &S,
    targets: Targets<'_>,
    before: &Eccentricity,
    picks: &[u32],
    fields: &[Vec<f64>],
) -> f64 {
    let one = |(&s, field): (&u32, &Vec<f64>)| {
        let ecc = farthest(solver, targets.far, field)[solver.component()[s as usize] as usize].far.1;
        let s = s as usize;
        let gap = (before.upper[s] - before.lower[s]) / before.lower[s];
        if targets.ask[s] && gap > 0.0 { (1.0 - before.distance[s] / ecc) / gap } else { 0.0 }
    };
    picks.iter().zip(fields).map(one).fold(0.0, f64::max)
}

/// By how much, relatively, new fields contradict each other (d(a,b) against d(b,a)) and the bounds that earlier fields
/// set on their eccentricities. Source `picks[k]` is in column k of `fields`.
fn contradiction<S: DistanceFields>(
    solver: &S,
    targets: Targets<'_>,
    before: &Eccentricity,
    picks: &[u32],
    fields: &[Vec<f64>],
) -> f64 {
    let mut worst = 0.0f64;
    for (i, &s) in picks.iter().enumerate() {
        let component = solver.component()[s as usize] as usize;
        let ecc = farthest(solver, targets.far, &fields[i])[component].far.1;
        let s = s as usize;
        worst = worst.max((ecc - before.upper[s]) / ecc).max((before.lower[s] - ecc) / ecc);
        for (j, &r) in picks.iter().enumerate().skip(i + 1) {
            let (there, back) = (fields[i][r as usize], fields[j][s]);
            worst = worst.max((there - back).abs() / ecc);
        }
    }
    worst
}

/// The component's sources for the next round: the vertices with the widest bounds, each the worst once the ones before it
/// are foreseen to be known; a quarter of them far ends seen so far, whose fields raise the lower bounds that all others
/// lean on. The first round is the lowest vertex, the second takes place in any case, to see how fields contradict.
fn next_sources(
    front: &Front,
    state: &Eccentricity,
    done: &[bool],
    positions: &[Vec3],
    tolerance: f64,
    round: (usize, usize),
) -> Vec<u32> {
    if front.solved == 0 {
        return front.members[..1].to_vec();
    }
    let tolerance = if front.solved == 1 { 0.0 } else { tolerance };
    let gap = |lo: f64, hi: f64| (hi - lo) / lo;
    let bounds = |v: u32| (v, state.lower[v as usize], state.upper[v as usize]);
    let unseen = |v: u32| Some(state.farthest[v as usize]).filter(|&f| f != NONE && !done[f as usize]);
    let members = front.members.iter().filter(|&&v| !done[v as usize]).map(|&v| bounds(v));
    // a value that rests on a far end without a field of its own is worth that field unless it is all but known
    let loose = |&(v, lo, hi): &(u32, f64, f64)| {
        gap(lo, hi) > tolerance || (gap(lo, hi) > 0.25 * tolerance && unseen(v).is_some())
    };
    let mut open: Vec<_> = members.filter(loose).collect();
    let count = front.solved.clamp(round.0, round.1).min(open.len());

    let mut sources: Vec<u32> = open.iter().filter_map(|o| unseen(o.0)).collect();
    sources.sort_unstable();
    sources.dedup();
    let wide = open.iter().any(|&(_, lo, hi)| gap(lo, hi) > tolerance);
    sources.truncate(if wide { count.div_ceil(4) } else { count });
    for i in 0..count {
        if i == sources.len() {
            let wider =
                |m: (u32, f64), &(v, lo, hi): &(u32, f64, f64)| if gap(lo, hi) > m.1 { (v, gap(lo, hi)) } else { m };
            match open.iter().fold((NONE, tolerance), wider).0 {
                NONE => break,
                v => sources.push(v),
            }
        }
        // once s is known to be about lower(s), its neighbours cannot exceed that by more than their distance
        let (s, ecc) = (sources[i] as usize, state.lower[sources[i] as usize]);
        for (v, _, hi) in &mut open {
            *hi = hi.min(ecc + distance(positions[*v as usize], positions[s]));
        }
    }
    sources
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geodesic::{HeatOptions, HeatSolver};
    use crate::mesh::intrinsic::IntrinsicMesh;
    use crate::mesh::shapes::{grid_box, icosphere, union};
    use std::f64::consts::PI;

    fn measure((p, t): &(Vec<Vec3>, Vec<[u32; 3]>), mode: Mode) -> Eccentricity {
        let mesh = IntrinsicMesh::from_extrinsic(p, t).unwrap();
        let solver = HeatSolver::new(&mesh, HeatOptions::default(), &Job::default()).unwrap();
        let all = vec![true; p.len()];
        eccentricity(&solver, p, Targets { ask: &all, far: &all }, mode, &Job::default()).unwrap()
    }

    #[test]
    fn half_the_circumference_everywhere_on_a_sphere() {
        let e = measure(&icosphere(4), Mode::AllSources);
        assert!(e.distance.iter().all(|d| (d / PI - 1.0).abs() < 0.02));
        assert_eq!(e.solves, 2562);
    }

    #[test]
    fn a_rod_is_as_long_as_its_ends_are_apart() {
        let (p, t) = grid_box([20.0, 1.0, 1.0], [80, 4, 4]);
        let e = measure(&(p.clone(), t), Mode::AllSources);
        let max = e.distance.iter().fold(0.0, |m: f64, &d| m.max(d));
        assert!((max / 21.0 - 1.0).abs() < 0.03, "between the middles of the end faces: {max}");
        let min = e.distance.iter().fold(f64::MAX, |m: f64, &d| m.min(d));
        assert!((min / 10.5 - 1.0).abs() < 0.05, "from the middle: {min}");
    }

    #[test]
    fn certified_bounds_hold_the_all_sources_value() {
        let shapes = [grid_box([20.0, 1.0, 1.0], [80, 4, 4]), grid_box([1.0; 3], [14; 3]), icosphere(3)];
        for shape in shapes.iter().chain([&union(&[shapes[0].clone(), shapes[2].clone()])]) {
            let exact = measure(shape, Mode::AllSources);
            for tolerance in [0.1, 0.03] {
                let e = measure(shape, Mode::Certified { tolerance });
                assert!(e.solves < exact.solves || tolerance < 0.1, "{} of {}", e.solves, exact.solves);
                let mut worst = 0.0f64;
                for v in 0..shape.0.len() {
                    let d = exact.distance[v];
                    assert!(
                        e.lower[v] <= d * (1.0 + 1e-12) && d <= e.upper[v] * (1.0 + 1e-12),
                        "{v}: {d} in {} {}",
                        e.lower[v],
                        e.upper[v]
                    );
                    worst = worst.max((e.distance[v] / d - 1.0).abs());
                }
                assert!(worst < tolerance + 0.05, "{worst}");
            }
        }
    }

    #[test]
    fn the_witness_is_at_the_distance() {
        let shape = grid_box([3.0, 2.0, 1.0], [12, 8, 4]);
        let e = measure(&shape, Mode::AllSources);
        for v in 0..shape.0.len() {
            let w = e.farthest[v] as usize;
            assert!(distance(shape.0[v], shape.0[w]) <= e.distance[v] * 1.02);
            assert!(e.distance[w] >= 0.95 * e.distance[v]);
        }
    }
}
