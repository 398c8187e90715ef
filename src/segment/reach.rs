//! D1 of a segment's surface from few sources.
//!
//! A segment needs its longest distance and the mean one, not the value of every vertex to within a bound: on a sphere,
//! where every point is as far from its opposite as any other, that would take hundreds of fields. A field from source s
//! bounds every vertex v by the triangle inequality,
//!
//! > max(d(s,v), ecc(s) - d(s,v)) ≤ ecc(v) ≤ ecc(s) + d(s,v).
//!
//! Half of the sources are far ends of those before, which is what finds the longest distance; the others are where
//! the bounds are farthest apart. It ends when the bounds agree in the mean, or when the sources are spent.

use crate::error::{Result, try_filled};
use crate::geodesic::DistanceFields;
use crate::job::Job;
use crate::mesh::NONE;
use crate::mesh::measure::{Vec3, add, distance, scale};

/// Sources of one round.
const ROUND: usize = 16;
/// Sources of one component at least, if it has as many vertices, so that far ends of far ends are among them; and at most.
const LEAST: usize = 32;
const MOST: usize = 64;
/// The gap between the bounds, in the mean over the vertices and relative to the middle, at which no more sources are added.
const GAP: f64 = 0.04;

/// D1 of a surface.
#[derive(Debug, Clone)]
pub struct Reach {
    /// By vertex, the middle of the bounds on its eccentricity, model units; NaN without a triangle.
    pub distance: Vec<f64>,
    /// The longest distance found.
    pub longest: f64,
    /// Its two vertices; [`NONE`] where there is none.
    pub ends: [u32; 2],
    /// Sources spent, the most of any component.
    pub sources: usize,
}

/// What is known of one component between two rounds.
struct Front {
    members: Vec<u32>,
    /// Sources so far.
    solved: usize,
    /// Far ends of the sources and their distances.
    far: Vec<(f64, u32)>,
    open: bool,
}

/// Bounds by vertex.
struct Bounds {
    lower: Vec<f64>,
    upper: Vec<f64>,
    /// Vertices that were sources.
    done: Vec<bool>,
}

impl Bounds {
    fn middle(&self, v: u32) -> f64 {
        let (lower, upper) = (self.lower[v as usize], self.upper[v as usize]);
        // fields contradict each other a little
        0.5 * (lower + upper.max(lower))
    }

    fn gap(&self, v: u32) -> f64 {
        (self.upper[v as usize] - self.lower[v as usize]).max(0.0)
    }
}

/// D1 of the solver's surface, `positions` those of its vertices, which serve to spread sources. Advances `job` by one a
/// source.
///
/// # Errors
/// Those of the solver.
pub fn reach<S: DistanceFields>(solver: &S, positions: &[Vec3], job: &Job) -> Result<Reach> {
    let n = solver.component().len();
    let mut fronts = fronts(solver)?;
    let mut bounds = Bounds {
        lower: try_filled(n, 0.0, "lengths of segments")?,
        upper: try_filled(n, f64::INFINITY, "lengths of segments")?,
        done: try_filled(n, false, "lengths of segments")?,
    };
    let mut out = Reach { distance: Vec::new(), longest: -1.0, ends: [NONE; 2], sources: 0 };
    loop {
        let picks: Vec<Vec<u32>> = fronts.iter().map(|f| pick(f, &bounds, positions)).collect();
        let longest = picks.iter().map(Vec::len).max().unwrap_or(0);
        if longest == 0 {
            break;
        }
        let columns: Vec<Vec<u32>> =
            (0..longest).map(|k| picks.iter().filter_map(|p| p.get(k).copied()).collect()).collect();
        let slices: Vec<&[u32]> = columns.iter().map(Vec::as_slice).collect();
        let fields = solver.for_each_column(&slices, job, |_, field| field.to_vec())?;
        for (front, picks) in fronts.iter_mut().zip(&picks) {
            for (&s, field) in picks.iter().zip(&fields) {
                let (ecc, end) = front.learn(s, field, &mut bounds);
                if ecc > out.longest {
                    (out.longest, out.ends) = (ecc, [s, end]);
                }
            }
            out.sources = out.sources.max(front.solved);
            let more = front.solved < LEAST || (front.solved < MOST && front.doubt(&bounds) > GAP);
            front.open = more && !picks.is_empty();
        }
    }
    out.distance = try_filled(n, f64::NAN, "lengths of segments")?;
    for front in &fronts {
        let longest = front.far.iter().fold(0.0, |m: f64, f| m.max(f.0));
        front.members.iter().for_each(|&v| out.distance[v as usize] = bounds.middle(v).min(longest));
    }
    Ok(out)
}

fn fronts<S: DistanceFields>(solver: &S) -> Result<Vec<Front>> {
    let mut members: Vec<Vec<u32>> = try_filled(solver.component_count(), Vec::new(), "components")?;
    for (v, &c) in solver.component().iter().enumerate().filter(|(_, c)| **c != NONE) {
        members[c as usize].push(v as u32);
    }
    Ok(members.into_iter().map(|members| Front { members, solved: 0, far: Vec::new(), open: true }).collect())
}

impl Front {
    /// Takes in the field of source `s`; returns its far end and how far that is.
    fn learn(&mut self, s: u32, field: &[f64], bounds: &mut Bounds) -> (f64, u32) {
        let longer = |m: (f64, u32), &v: &u32| if field[v as usize] > m.0 { (field[v as usize], v) } else { m };
        let (ecc, end) = self.members.iter().fold((0.0, s), longer);
        for &v in &self.members {
            let v = v as usize;
            bounds.lower[v] = bounds.lower[v].max(field[v].max(ecc - field[v]));
            bounds.upper[v] = bounds.upper[v].min(ecc + field[v]);
        }
        bounds.done[s as usize] = true;
        self.far.push((ecc, end));
        self.solved += 1;
        (ecc, end)
    }

    /// How far the bounds are apart, in the mean and relative to their middle.
    fn doubt(&self, bounds: &Bounds) -> f64 {
        let sum = |of: &dyn Fn(u32) -> f64| self.members.iter().map(|&v| of(v)).sum::<f64>();
        sum(&|v| bounds.gap(v)) / sum(&|v| bounds.middle(v)).max(f64::MIN_POSITIVE)
    }
}

/// The component's sources for the next round. The first are spread over it by their distances in space, from the point
/// that is farthest out.
fn pick(front: &Front, bounds: &Bounds, positions: &[Vec3]) -> Vec<u32> {
    if !front.open || front.members.is_empty() {
        return Vec::new();
    }
    if front.solved == 0 {
        return spread(&front.members, positions);
    }
    // --- far ends, the farthest first
    let mut far: Vec<(f64, u32)> = front.far.iter().copied().filter(|f| !bounds.done[f.1 as usize]).collect();
    far.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut sources: Vec<u32> = Vec::with_capacity(ROUND);
    for (_, v) in far {
        if sources.len() < ROUND / 2 && !sources.contains(&v) {
            sources.push(v);
        }
    }
    // --- the widest bounds; once s is known, its neighbours are known to within their distance from it
    let mut gap: Vec<f64> = front.members.iter().map(|&v| bounds.gap(v)).collect();
    let mut seen = 0;
    while sources.len() < ROUND {
        for &s in &sources[seen..] {
            let from = positions[s as usize];
            for (g, &v) in gap.iter_mut().zip(&front.members) {
                *g = g.min(2.0 * distance(positions[v as usize], from));
            }
        }
        seen = sources.len();
        match widest(&gap) {
            Some(k) => sources.push(front.members[k]),
            None => break,
        }
    }
    sources
}

/// Vertices that are far from each other in space.
fn spread(members: &[u32], positions: &[Vec3]) -> Vec<u32> {
    let sum = members.iter().fold([0.0; 3], |sum, &v| add(sum, positions[v as usize]));
    let middle = scale(sum, 1.0 / members.len() as f64);
    let away = |v: u32, from: Vec3| distance(positions[v as usize], from);
    let mut gap: Vec<f64> = members.iter().map(|&v| away(v, middle)).collect();
    let mut sources = Vec::with_capacity(ROUND);
    while sources.len() < ROUND {
        let Some(k) = widest(&gap) else { break };
        let from = positions[members[k] as usize];
        let first = sources.is_empty();
        for (g, &v) in gap.iter_mut().zip(members) {
            *g = if first { away(v, from) } else { g.min(away(v, from)) };
        }
        sources.push(members[k]);
    }
    // all in one place: any will do
    if sources.is_empty() {
        sources.push(members[0]);
    }
    sources
}

/// The first of the largest numbers, unless that is zero.
fn widest(gap: &[f64]) -> Option<usize> {
    let wider = |m: (Option<usize>, f64), (k, &g): (usize, &f64)| if g > m.1 { (Some(k), g) } else { m };
    gap.iter().enumerate().fold((None, 0.0), wider).0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geodesic::{HeatOptions, HeatSolver};
    use crate::mesh::intrinsic::IntrinsicMesh;
    use crate::mesh::shapes::{grid_box, icosphere, union};
    use std::f64::consts::PI;

    fn measure((p, t): &(Vec<Vec3>, Vec<[u32; 3]>)) -> Reach {
        let mesh = IntrinsicMesh::from_extrinsic(p, t).unwrap();
        let solver = HeatSolver::new(&mesh, HeatOptions::default(), &Job::default()).unwrap();
        reach(&solver, p, &Job::default()).unwrap()
    }

    fn mean(of: &[f64]) -> f64 {
        of.iter().sum::<f64>() / of.len() as f64
    }

    #[test]
    fn half_the_circumference_everywhere_on_a_sphere_from_few_sources() {
        let r = measure(&icosphere(4));
        assert!((r.longest / PI - 1.0).abs() < 0.02, "{}", r.longest);
        assert!((mean(&r.distance) / PI - 1.0).abs() < 0.02, "{}", mean(&r.distance));
        assert!(r.sources <= MOST && r.distance.iter().all(|d| (d / PI - 1.0).abs() < 0.08));
    }

    #[test]
    fn a_rod_is_three_quarters_as_long_in_the_mean() {
        let rod = grid_box([40.0, 1.0, 1.0], [160, 4, 4]);
        for shape in [rod.clone(), union(&[icosphere(2), rod])] {
            let r = measure(&shape);
            let ends = r.ends.map(|v| shape.0[v as usize][0]);
            assert!((r.longest / 41.0 - 1.0).abs() < 0.02, "{}", r.longest);
            assert!((ends[0] - ends[1]).abs() > 39.9, "{ends:?}");
            let long: Vec<f64> = r.distance[r.distance.len() - 2..].to_vec();
            assert!(long.iter().all(|d| d.is_finite()));
        }
        let r = measure(&grid_box([40.0, 1.0, 1.0], [160, 4, 4]));
        assert!((mean(&r.distance) / (0.75 * 41.0) - 1.0).abs() < 0.03, "{}", mean(&r.distance));
    }
}
