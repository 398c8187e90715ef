//! The print profile: D1 and D2 that depend on the shape and not on its triangulation.

use super::{Options, Reach};
use crate::error::{Error, Result, try_filled, try_vec};
use crate::geodesic::exact::SurfacePoint;
use crate::geodesic::{DistanceFields, Eccentricity, ExactFields, HeatOptions, HeatSolver, Targets, eccentricity};
use crate::job::{Job, Stage};
use crate::mesh::corners::shape_corners;
use crate::mesh::measure::{Vec3, add, area_vector, corners, cross, dot, scale, sub};
use crate::mesh::surface::{AnalysisSurface, SurfaceOptions};
use crate::mesh::{NONE, TriMesh};
use crate::thickness::wall::WallMesh;

/// Meshes up to this many faces get exact distances; beyond, heat distances are accurate enough and far cheaper.
const EXACT_FACES: usize = 25_000;

/// Points inside faces between which the part's D1 is sought.
const SAMPLES: usize = 2_000;

/// Far ends from which the sweeps for the part's D1 start.
const STARTS: usize = 4;

/// Wall widths by vertex and by face.
pub(super) fn walls(mesh: &TriMesh, triangles: &[[u32; 3]], job: &Job) -> Result<(Vec<f64>, Vec<f64>)> {
    let positions = mesh.positions();
    let solid = WallMesh::new(positions, triangles, job)?;
    let own: Vec<u32> = (0..triangles.len() as u32).collect();
    let vertices = solid.vertex_widths(positions, triangles, &own, job)?.width;
    let mut centroids = try_vec(triangles.len(), "wall widths")?;
    for &t in triangles {
        let [a, b, c] = corners(positions, t);
        centroids.push(scale(add(add(a, b), c), 1.0 / 3.0));
    }
    let faces = solid.point_widths(&centroids, &own, job)?.width;
    Ok((vertices, faces))
}

/// D1 of every vertex, towards the corners of the shape, and the longest way across the part.
pub(super) fn lengths(
    mesh: &TriMesh,
    triangles: &[[u32; 3]],
    options: &Options,
    job: &Job,
) -> Result<(Eccentricity, Reach)> {
    if triangles.len() <= EXACT_FACES {
        match exact_lengths(mesh, triangles, options, job) {
            Err(Error::Numeric(_)) => {} // more windows than it may make: a heat distance costs the same on every shape
            other => return other,
        }
    }
    heat_lengths(mesh, triangles, options, job)
}

fn exact_lengths(
    mesh: &TriMesh,
    triangles: &[[u32; 3]],
    options: &Options,
    job: &Job,
) -> Result<(Eccentricity, Reach)> {
    let positions = mesh.positions();
    let fields = ExactFields::new(positions, triangles)?;
    let far = far_ends(&fields, positions, triangles)?;
    let ask = try_filled(positions.len(), true, "the field")?;
    job.begin(Stage::Geodesic, 0.4, 0.95, positions.len() as u64)?;
    let d1 = eccentricity(&fields, positions, Targets { ask: &ask, far: &far }, options.d1, job)?;

    job.begin(Stage::Geodesic, 0.95, 1.0, 1)?;
    let mut ends: Vec<u32> = (0..positions.len() as u32).filter(|&v| d1.distance[v as usize] > 0.0).collect();
    ends.sort_by(|&a, &b| d1.distance[b as usize].total_cmp(&d1.distance[a as usize]).then(a.cmp(&b)));
    let mut starts: Vec<u32> = Vec::new();
    for v in ends {
        let far_end = d1.farthest[v as usize];
        if starts.len() == STARTS {
            break;
        }
        if far_end != NONE && !starts.contains(&far_end) {
            starts.push(far_end);
        }
    }
    let (samples, places) = samples(positions, triangles, job)?;
    let mut reach = farthest_apart(&d1, positions);
    if let Some((length, ends)) = fields.diameter(&starts, &samples, job)? {
        if length > reach.length {
            let place = |p: SurfacePoint| match p {
                SurfacePoint::Vertex(v) => positions[v as usize],
                point => samples.iter().position(|s| *s == point).map_or([f64::NAN; 3], |k| places[k]),
            };
            reach = Reach { length, ends: ends.map(place) };
        }
    }
    Ok((d1, reach))
}

fn heat_lengths(mesh: &TriMesh, triangles: &[[u32; 3]], options: &Options, job: &Job) -> Result<(Eccentricity, Reach)> {
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
    let reach = farthest_apart(&d1, &surface.positions);
    for values in [&mut d1.distance, &mut d1.lower, &mut d1.upper] {
        values.truncate(n);
    }
    d1.farthest.truncate(n);
    Ok((d1, reach))
}

/// The longest distance that any field of `d1` holds.
pub(super) fn farthest_apart(d1: &Eccentricity, positions: &[Vec3]) -> Reach {
    let longest = d1.longest.iter().fold((0.0, [NONE; 2]), |m, x| if x.0 > m.0 { *x } else { m });
    let place = |v: u32| positions.get(v as usize).copied().unwrap_or([f64::NAN; 3]);
    Reach { length: longest.0, ends: longest.1.map(place) }
}

/// The corners of the shape; on a component that has none, all its vertices.
fn far_ends(fields: &impl DistanceFields, positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Vec<bool>> {
    let mut far = shape_corners(positions, triangles)?;
    let mut some = try_filled(fields.component_count(), false, "corners")?;
    let component = |v: usize| fields.component()[v];
    for v in (0..far.len()).filter(|&v| far[v] && component(v) != NONE) {
        some[component(v) as usize] = true;
    }
    for (v, far) in far.iter_mut().enumerate() {
        *far |= component(v) != NONE && !some[component(v) as usize];
    }
    Ok(far)
}

/// Points spread over the inside of the faces: as points of the surface, and where they are.
fn samples(positions: &[Vec3], triangles: &[[u32; 3]], job: &Job) -> Result<(Vec<SurfacePoint>, Vec<Vec3>)> {
    let options = SurfaceOptions { target_vertices: SAMPLES, max_added: 2 * SAMPLES, ..SurfaceOptions::default() };
    let surface = AnalysisSurface::refine(positions, triangles, &options, job)?;
    let places = surface.positions[surface.input_vertices..].to_vec();
    let mut points = try_vec(places.len(), "samples")?;
    for (&p, &face) in places.iter().zip(&surface.vertex_face) {
        points.push(SurfacePoint::Face { face, weights: barycentric(corners(positions, triangles[face as usize]), p) });
    }
    Ok((points, places))
}

/// Barycentric coordinates of a point of a triangle, not negative; those of its centroid if it has no area.
fn barycentric(triangle: [Vec3; 3], p: Vec3) -> [f64; 3] {
    let normal = area_vector(triangle);
    let share = |k: usize| {
        let (b, c) = (triangle[(k + 1) % 3], triangle[(k + 2) % 3]);
        (dot(cross(sub(b, p), sub(c, p)), normal) / dot(normal, normal)).max(0.0)
    };
    let weights = [share(0), share(1), share(2)];
    if weights.iter().sum::<f64>() > 0.0 { weights } else { [1.0 / 3.0; 3] }
}
