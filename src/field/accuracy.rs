//! How right D1 is, and what was left out.

use super::Field;
use crate::error::{Result, try_filled};
use crate::geodesic::{DistanceFields, Eccentricity, ExactFields};
use crate::job::Job;
use crate::mesh::measure::{Vec3, add, bounding_box, corners, distance, is_flat, scale};
use crate::mesh::{NONE, TriMesh};

/// What D1's distances were solved for by. The numbers are part of the C interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u32)]
pub enum Method {
    /// Heat distances on the mesh as given.
    #[default]
    Heat = 0,
    /// Heat distances on the mesh with vertices added.
    RefinedHeat = 1,
    /// Exact distances on the mesh as given.
    Exact = 2,
    /// Exact distances on a mesh of fewer faces that stands in for it.
    ExactOnProxy = 3,
}

/// How right D1 is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Accuracy {
    /// What solved for the distances.
    pub method: Method,
    /// Vertices of the surface that they were solved on.
    pub vertices: u64,
    /// Its faces.
    pub faces: u64,
    /// Its mean edge length, model units.
    pub spacing: f64,
    /// Estimated relative error of D1, the sum of what independent solves showed: how far the distances are off (against
    /// exact ones, of the mesh as given or of one far finer than that solved on), and by how much D1 fell short of a
    /// field from the vertex itself where it was least certain. NaN if nothing was there to compare with.
    pub error: f64,
    /// The part of it that is due to the distances.
    pub distance_error: f64,
    /// Largest (upper - lower) / D1 of a vertex.
    pub gap: f64,
    /// Shells of which no face has an area: they have no values. Number, and a face of the first ([`NONE`]: none).
    pub flat_shells: (u64, u32),
    /// Other shells of which no vertex has a D2, since no ray or sphere meets a wall: likewise.
    pub open_shells: (u64, u32),
}

impl Accuracy {
    /// Describes the surface that is solved on.
    pub(super) fn on(method: Method, positions: &[Vec3], triangles: &[[u32; 3]]) -> Accuracy {
        let used = |t: &[u32; 3]| {
            let [a, b, c] = corners(positions, *t);
            distance(a, b) + distance(b, c) + distance(c, a)
        };
        let sum: f64 = triangles.iter().map(used).sum();
        let (vertices, faces) = (positions.len() as u64, triangles.len() as u64);
        Accuracy { method, vertices, faces, spacing: sum / (3 * faces).max(1) as f64, ..Accuracy::default() }
    }

    /// Adds what `d1` knows to the error of its distances.
    pub(super) fn conclude(&mut self, d1: &Eccentricity, distance_error: f64) {
        self.distance_error = distance_error;
        self.error = distance_error + d1.missed;
    }
}

/// Gap and shells of a finished field.
pub(super) fn look_back(field: &Field, mesh: &TriMesh) -> Result<Accuracy> {
    let mut out = field.accuracy;
    let (lower, upper) = &field.d1_bounds;
    let gaps = field.d1.iter().zip(lower.iter().zip(upper)).map(|(d, (lo, hi))| (hi - lo) / d);
    out.gap = gaps.filter(|g| g.is_finite()).fold(0.0, f64::max);
    (out.flat_shells, out.open_shells) = ((0, NONE), (0, NONE));
    let topology = mesh.topology()?;
    let mut solid = try_filled(topology.shells.len(), false, "shells")?;
    let mut measured = try_filled(topology.shells.len(), false, "shells")?;
    for (&t, &shell) in mesh.triangles().iter().zip(&topology.shell_of_face) {
        solid[shell as usize] |= !is_flat(corners(mesh.positions(), t));
        measured[shell as usize] |= t.iter().any(|&v| field.d2[v as usize].is_finite());
    }
    for (k, shell) in topology.shells.iter().enumerate().filter(|(k, _)| !solid[*k] || !measured[*k]) {
        let skipped = if solid[k] { &mut out.open_shells } else { &mut out.flat_shells };
        *skipped = (skipped.0 + 1, skipped.1.min(shell.first_face));
    }
    Ok(out)
}

/// Two vertices at the ends of the part: the farthest from its middle, and the farthest from that one.
pub(super) fn probes(positions: &[Vec3], triangles: &[[u32; 3]]) -> [u32; 2] {
    let used = || triangles.iter().flatten().copied();
    let (lo, hi) = bounding_box(used().map(|v| positions[v as usize]));
    let farthest = |from: Vec3| {
        let far = used().map(|v| (distance(positions[v as usize], from), v));
        far.fold((-1.0, 0), |m, x| if x.0 > m.0 { x } else { m }).1
    };
    let first = farthest(scale(add(lo, hi), 0.5));
    [first, farthest(positions[first as usize])]
}

/// The fields of two sources.
pub(super) fn pair<S: DistanceFields>(fields: &S, sources: [u32; 2], job: &Job) -> Result<Vec<Vec<f64>>> {
    fields.for_each_column(&[&sources[..1], &sources[1..]], job, |_, field| field.to_vec())
}

/// Largest difference between fields of the same sources where the truth is at least `from` of the largest distance, as a
/// share of that.
pub(super) fn distortion(truth: &[Vec<f64>], seen: &[Vec<f64>], from: f64) -> f64 {
    let one = |(truth, seen): (&Vec<f64>, &Vec<f64>)| {
        let largest = truth.iter().filter(|d| d.is_finite()).fold(0.0, |m: f64, d| m.max(*d));
        let both = truth.iter().zip(seen).filter(|(a, _)| **a >= from * largest);
        // NaN, of a vertex that one of them does not reach, counts as infinitely wrong
        let off = both.map(|(a, b)| (a - b).abs()).map(|d| if d.is_nan() { f64::INFINITY } else { d });
        let worst = off.fold(0.0, f64::max);
        if largest > 0.0 { worst / largest } else { 0.0 }
    };
    truth.iter().zip(seen).map(one).fold(0.0, f64::max)
}

/// A mesh that stands in for a smooth one lies inside it and all its distances are short by about the same share: what
/// fields of the same sources are to be multiplied by, which is done, and what is left of their distortion.
pub(super) fn stretch(truth: &[Vec<f64>], seen: &mut [Vec<f64>]) -> (f64, f64) {
    let both = || truth.iter().zip(&*seen).flat_map(|(a, b)| a.iter().zip(b));
    let (long, short) =
        both().filter(|(a, b)| (**a * **b).is_finite()).fold((0.0, 0.0), |m, (a, b)| (m.0 + a, m.1 + b));
    let factor = if long > 0.0 && short > 0.0 { long / short } else { 1.0 };
    seen.iter_mut().flatten().for_each(|d| *d *= factor);
    (factor, distortion(truth, seen, 0.0))
}

/// Faces up to which heat distances are held against exact ones.
const COMPARABLE: usize = 25_000;

/// How far heat distances are off in the half of the mesh that is far from a source, as a share of the largest; NaN for
/// a mesh that is too large for exact ones.
pub(super) fn heat_error<S: DistanceFields>(
    heat: &S,
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    job: &Job,
) -> Result<f64> {
    if triangles.len() > COMPARABLE {
        return Ok(f64::NAN);
    }
    let sources = probes(positions, triangles);
    let exact = ExactFields::new(positions, triangles)?;
    match pair(&exact, sources, job) {
        Ok(truth) => Ok(distortion(&truth, &pair(heat, sources, job)?, 0.5)),
        Err(crate::error::Error::Numeric(_)) => Ok(f64::NAN),
        Err(e) => Err(e),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::{D2Method, Options, Profile, compute};
    use crate::geodesic::Mode;
    use crate::job::CancelToken;
    use crate::mesh::MeshOptions;
    use crate::mesh::shapes::{Shape, grid_box, icosphere, split_in_four, translated, union};
    use crate::thickness::shapes::{prism, round};

    fn field(shape: Shape, options: &Options) -> Field {
        let job = Job::new(0, None, CancelToken::default());
        let mesh = TriMesh::new(&(&shape.0[..], &shape.1[..]), &MeshOptions::default(), &job).unwrap();
        job.run(None, || compute(&mesh, options, &job)).unwrap()
    }

    #[test]
    fn a_box_of_few_corners_is_known_exactly() {
        let f = field(grid_box([4.0, 2.0, 1.0], [8, 4, 2]), &Options::default());
        assert_eq!(f.accuracy.method, Method::Exact);
        assert!(f.accuracy.error < 1e-3 && f.solves == 8, "{:?}", f.accuracy);
        let all = field(grid_box([4.0, 2.0, 1.0], [8, 4, 2]), &Options { d1: Mode::AllSources, ..Options::default() });
        assert!(f.d1.iter().zip(&all.d1).all(|(d, exact)| (d / exact - 1.0).abs() < 2e-3));
        // along the top and over one edge: the longest corner to corner path is the least of the three unfoldings
        let exact = (16f64 + 9.0).sqrt();
        assert!(f.d1.iter().all(|d| *d <= exact * 1.002));
        assert!((f.d1[0] / exact - 1.0).abs() < 2e-3, "{} {exact}", f.d1[0]);
    }

    #[test]
    fn a_finely_cut_disc_has_the_far_ends_of_a_coarse_one() {
        // the middle of a lid is 5 away from the middle of the other, but only 3 from its rim, where the corners are
        let (p, t) = prism(&round(4.0, 128), [0.0; 2], 1.0, 40, 40);
        let farthest =
            |from: [f64; 3]| (0..p.len()).max_by(|&a, &b| distance(p[a], from).total_cmp(&distance(p[b], from)));
        let rim = farthest([0.0; 3]).unwrap();
        let middle = p.iter().position(|q| *q == [0.0, 0.0, 1.0]).unwrap();
        let f = field((p, t), &Options { d2: D2Method::Inscribed, ..Options::default() });
        assert_eq!(f.accuracy.method, Method::ExactOnProxy);
        assert!((f.d1[rim] / 5.0 - 1.0).abs() < 5e-3, "{}", f.d1[rim]);
        // the least value of all: those of the points around it are greater by up to their spacing
        assert!(f.d1[middle] > 2.99 && f.d1[middle] < 3.1, "{}", f.d1[middle]);
        assert!(f.accuracy.gap < 0.05, "{:?}", f.accuracy);
    }

    #[test]
    fn a_large_sphere_is_right_within_what_it_says() {
        let (p, t) = icosphere(5);
        let shape = split_in_four(&p, &t);
        let f = field(
            shape,
            &Options { d1: Mode::Certified { tolerance: 0.2 }, d2: D2Method::Inscribed, ..Options::default() },
        );
        assert_eq!(f.accuracy.method, Method::ExactOnProxy);
        assert!(f.accuracy.faces < 20_000 && f.accuracy.distance_error < 0.0106, "{:?}", f.accuracy);
        let worst = f.d1.iter().map(|d| (d / std::f64::consts::PI - 1.0).abs()).fold(0.0, f64::max);
        assert!(worst <= f.accuracy.gap && worst <= f.accuracy.error + 0.02, "{worst} {:?}", f.accuracy);
        let half = std::f64::consts::PI;
        let holds = |v: usize| f.d1_bounds.0[v] <= half && 0.9995 * half <= f.d1_bounds.1[v];
        assert!((0..f.d1.len()).filter(|v| holds(*v)).count() * 100 >= 99 * f.d1.len());
    }

    #[test]
    fn heat_distances_are_compared_with_exact_ones() {
        let f = field(icosphere(3), &Options { profile: Profile::Paper, ..Options::default() });
        assert!(f.accuracy.method == Method::Heat && f.accuracy.error > 1e-3 && f.accuracy.error < 0.1);
    }

    #[test]
    fn shells_without_a_wall_are_counted() {
        let sheet = (vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]);
        let sheet = (translated(sheet.0, [50.0, 0.0, 0.0]), sheet.1);
        let f = field(union(&[grid_box([1.0; 3], [1; 3]), sheet]), &Options::default());
        assert_eq!(f.accuracy.open_shells, (1, 12), "{:?}", f.accuracy);
        assert_eq!(f.accuracy.flat_shells, (0, NONE));
    }
}
