//! The print profile: D1 and D2 that depend on the shape and not on its triangulation.

use super::accuracy::{Accuracy, Method, pair, probes, stretch};
use super::{Options, Reach, large, reach};
use crate::error::{Error, Result, try_filled};
use crate::geodesic::{
    Column, DistanceFields, Eccentricity, ExactFields, HeatOptions, HeatSolver, Mode, Targets, eccentricity,
};
use crate::job::{Job, Stage};
use crate::mesh::corners::shape_corners;
use crate::mesh::measure::Vec3;
use crate::mesh::proxy::{Proxy, places};
use crate::mesh::surface::{AnalysisSurface, SurfaceOptions};
use crate::mesh::{NONE, TriMesh};
use crate::thickness::wall::WallMesh;

/// What the geodesic half of a computation finds.
pub(super) struct Lengths {
    pub d1: Eccentricity,
    pub reach: Reach,
    pub accuracy: Accuracy,
}

/// Meshes up to this many faces are solved on themselves, at least for a field or two.
const EXACT_FACES: usize = 25_000;

/// A field of more windows than this is dear: the others are solved on a mesh that stands in.
const DEAR: f64 = 15_000.0;

/// Meshes of more faces than this have dear fields as a rule.
const LIKELY_DEAR: usize = 3_000;

/// Wall widths by vertex and by face.
pub(super) fn walls(mesh: &TriMesh, triangles: &[[u32; 3]], job: &Job) -> Result<(Vec<f64>, Vec<f64>)> {
    let positions = mesh.positions();
    let solid = WallMesh::new(positions, triangles, job)?;
    solid.surface_widths(positions, triangles, job)
}

/// D1 of every vertex, towards the corners of the shape, the longest way across the part, and how right they are.
pub(super) fn lengths(mesh: &TriMesh, triangles: &[[u32; 3]], options: &Options, job: &Job) -> Result<Lengths> {
    let exact = if triangles.len() <= EXACT_FACES {
        exact_lengths(mesh, triangles, options, job)
    } else {
        large::lengths(mesh, triangles, options, job)
    };
    match exact {
        // more windows than it may make: a heat distance costs the same on every shape
        Err(Error::Numeric(_)) => heat_lengths(mesh, triangles, options, job),
        other => other,
    }
}

fn exact_lengths(mesh: &TriMesh, triangles: &[[u32; 3]], options: &Options, job: &Job) -> Result<Lengths> {
    let positions = mesh.positions();
    let certified = matches!(options.d1, Mode::Certified { .. });
    let proxy = |k: usize| Proxy::within(positions, triangles, PROXIES[k].0, PROXIES[k].1, job);
    job.begin(Stage::Geodesic, 0.4, 0.45, 2)?;

    // --- two fields from the ends of the part: what one costs, and the truth for a mesh that stands in
    let sources = probes(positions, triangles);
    let (truth, first) = rayon::join(
        || {
            let fields = ExactFields::new(positions, triangles)?;
            let truth = pair(&fields, sources, job)?;
            Ok::<_, Error>((fields, truth))
        },
        // likely to be wanted
        || (certified && triangles.len() > LIKELY_DEAR).then(|| proxy(0)),
    );
    let (mut fields, truth) = truth?;
    let far = far_ends(&fields, positions, triangles)?;
    job.begin(Stage::Geodesic, 0.45, 0.95, positions.len() as u64)?;
    if certified && fields.windows_per_field() > DEAR {
        let mut first = first;
        for k in 0..PROXIES.len() {
            let proxy = first.take().unwrap_or_else(|| proxy(k))?;
            let places = places((positions, triangles), &proxy.onto, (&proxy.positions, &proxy.triangles), job)?;
            let (component, components) = fields.components();
            let mut on_proxy = ExactFields::on_proxy(&proxy, &places, component.to_vec(), components)?;
            let mut seen = pair(&on_proxy, sources, job)?;
            let (factor, error) = stretch(&truth, &mut seen);
            if error <= MOST_DISTORTION {
                on_proxy.set_distortion(factor, error);
                on_proxy.set_known(columns(sources, seen));
                let solved = Accuracy::on(Method::ExactOnProxy, &proxy.positions, &proxy.triangles);
                let solved = (&proxy.positions[..], &proxy.triangles[..], solved);
                return measure(&on_proxy, positions, &far, solved, options, job);
            }
        }
    }
    fields.set_known(columns(sources, truth));
    let solved = (positions, triangles, Accuracy::on(Method::Exact, positions, triangles));
    measure(&fields, positions, &far, solved, options, job)
}

/// Fields of single sources as columns.
fn columns(sources: [u32; 2], fields: Vec<Vec<f64>>) -> Vec<Column> {
    sources.iter().zip(fields).map(|(&s, field)| (vec![s], field)).collect()
}

/// Distances on a mesh that stands in may be off by this share of the largest; more, and it is made finer.
pub(super) const MOST_DISTORTION: f64 = 0.01;

/// Faces that a mesh that stands in has at least, and its distance from the part as a share of the part's size: tried in
/// this order.
const PROXIES: [(usize, f64); 4] = [(500, 2e-3), (1_000, 1e-3), (2_000, 1e-3), (4_000, 2.5e-4)];

/// D1 of `positions` by exact `fields` on the mesh `solved`, and the longest way across.
pub(super) fn measure(
    fields: &ExactFields,
    positions: &[Vec3],
    far: &[bool],
    solved: (&[Vec3], &[[u32; 3]], Accuracy),
    options: &Options,
    job: &Job,
) -> Result<Lengths> {
    let ask = try_filled(positions.len(), true, "the field")?;
    let d1 = eccentricity(fields, positions, Targets { ask: &ask, far }, options.d1, job)?;

    job.begin(Stage::Geodesic, 0.95, 1.0, 1)?;
    let reach = reach::longest_way(fields, positions, (solved.0, solved.1), &d1, job)?;
    let mut accuracy = solved.2;
    accuracy.conclude(&d1, fields.distance_error());
    Ok(Lengths { d1, reach, accuracy })
}

fn heat_lengths(mesh: &TriMesh, triangles: &[[u32; 3]], options: &Options, job: &Job) -> Result<Lengths> {
    job.begin(Stage::Surface, 0.35, 0.4, 1)?;
    let surface = AnalysisSurface::refine(mesh.positions(), triangles, &SurfaceOptions::default(), job)?;
    let intrinsic = surface.intrinsic(job)?;
    job.begin(Stage::Factor, 0.4, 0.5, 2)?;
    let solver = HeatSolver::new(&intrinsic, HeatOptions { time_factor: options.time_factor }, job)?;
    let n = mesh.positions().len();
    let mut far = far_ends(&solver, mesh.positions(), triangles)?;
    far.resize(surface.positions.len(), false);
    let mut ask = try_filled(surface.positions.len(), false, "the field")?;
    ask[..n].fill(true);
    job.begin(Stage::Geodesic, 0.5, 1.0, n as u64)?;
    let targets = Targets { ask: &ask, far: &far };
    let mut d1 = eccentricity(&solver, &surface.positions, targets, options.d1, job)?;
    let reach = reach::farthest_apart(&d1, &surface.positions);
    for values in [&mut d1.distance, &mut d1.lower, &mut d1.upper] {
        values.truncate(n);
    }
    d1.farthest.truncate(n);
    let mut accuracy = Accuracy::on(Method::RefinedHeat, &surface.positions, &surface.triangles);
    // no exact distances to compare with, or they would have been used: what the fields show among themselves
    accuracy.conclude(&d1, if d1.slack > 0.0 { d1.slack } else { f64::NAN });
    Ok(Lengths { d1, reach, accuracy })
}

/// The corners of the shape; on a component that has none, all its vertices.
pub(super) fn far_ends(fields: &impl DistanceFields, positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Vec<bool>> {
    let mut far = shape_corners(positions, triangles)?;
    all_where_none(fields, &mut far)?;
    Ok(far)
}

/// Sets all flags of a component that has none set.
pub(super) fn all_where_none(fields: &impl DistanceFields, far: &mut [bool]) -> Result<()> {
    let mut some = try_filled(fields.component_count(), false, "corners")?;
    let component = |v: usize| fields.component()[v];
    for v in (0..far.len()).filter(|&v| far[v] && component(v) != NONE) {
        some[component(v) as usize] = true;
    }
    for (v, far) in far.iter_mut().enumerate() {
        *far |= component(v) != NONE && !some[component(v) as usize];
    }
    Ok(())
}
