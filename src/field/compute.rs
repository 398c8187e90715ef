//! From a mesh and options to its field.

use super::{Field, reason};
use crate::error::{Error, Result, try_filled, try_vec};
use crate::geodesic::eccentricity::{Eccentricity, Targets, eccentricity};
use crate::geodesic::{HeatOptions, HeatSolver, Mode};
use crate::job::{Job, Stage};
use crate::mesh::intrinsic::IntrinsicMesh;
use crate::mesh::measure::{corners, is_flat};
use crate::mesh::{NONE, TriMesh};
use crate::thickness::bvh::RayMesh;
use crate::thickness::cone::Cone;
use crate::thickness::inscribed::{face_widths, vertex_means};
use crate::thickness::sdf::sdf_values;
use std::time::Instant;

/// Which width D2 is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum D2Method {
    /// The inscribed sphere of Eqs. 10-13.
    #[default]
    Inscribed,
    /// The shape diameter function of Shapira et al. 2008 as CGAL defines it, raw values.
    ShapeDiameter,
}

/// What to compute.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// How D1 is found.
    pub d1: Mode,
    /// m in the heat method's t = m h².
    pub time_factor: f64,
    /// How D2 is found.
    pub d2: D2Method,
    /// Rays a face.
    pub rays: usize,
    /// Full opening angle of the cone of rays, radians.
    pub cone_angle: f64,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            d1: Mode::Certified { tolerance: 0.02 },
            time_factor: 1.0,
            d2: D2Method::Inscribed,
            rays: 20,
            cone_angle: 2.0 / 3.0 * std::f64::consts::PI,
        }
    }
}

/// Triangles thinner than this share of the mean edge are padded to it before cotangents are taken.
const MOLLIFY: f64 = 1e-6;

/// Computes the field of `mesh`. Call it inside [`Job::run`].
pub fn compute(mesh: &TriMesh, options: &Options, job: &Job) -> Result<Field> {
    let (n, m) = (mesh.positions().len(), mesh.triangles().len());
    job.afford(footprint(n, m), "D1 and D2")?;
    let mut seconds = [0.0; Stage::COUNT];
    let mut clock = Instant::now();
    let mut lap = |stage: Stage| {
        seconds[stage as usize] += clock.elapsed().as_secs_f64();
        clock = Instant::now();
    };

    job.begin(Stage::Surface, 0.0, 0.05, 1)?;
    let triangles = mesh.topology()?.oriented(mesh.triangles());
    lap(Stage::Surface);

    job.begin(Stage::Thickness, 0.05, 0.35, m as u64)?;
    let face_d2 = widths(mesh, &triangles, options, job)?;
    let d2 = vertex_means(n, &triangles, &face_d2)?;
    lap(Stage::Thickness);

    job.begin(Stage::Factor, 0.35, 0.45, 2)?;
    let solver = solver(mesh, options, job)?;
    lap(Stage::Factor);

    job.begin(Stage::Geodesic, 0.45, 1.0, n as u64)?;
    let all = try_filled(n, true, "the field")?;
    let d1 = eccentricity(&solver, mesh.positions(), Targets { ask: &all, far: &all }, options.d1, job)?;
    lap(Stage::Geodesic);

    assemble(mesh, d1, d2, face_d2, seconds)
}

/// Geodesic distance of every welded vertex from one, by the heat method; NaN on other components.
pub fn distance(mesh: &TriMesh, source: u32, options: &Options, job: &Job) -> Result<Vec<f64>> {
    if source as usize >= mesh.positions().len() {
        let message = format!("source vertex {source} does not exist: there are {}", mesh.positions().len());
        return Err(Error::Argument(message));
    }
    job.begin(Stage::Factor, 0.0, 0.8, 2)?;
    let solver = solver(mesh, options, job)?;
    if solver.component()[source as usize] == NONE {
        return Err(Error::Argument(format!("no face uses the source vertex {source}")));
    }
    job.begin(Stage::Geodesic, 0.8, 1.0, 1)?;
    let mut scratch = solver.scratch()?;
    Ok(solver.solve(&[&[source]], &mut scratch)?.to_vec())
}

fn solver(mesh: &TriMesh, options: &Options, job: &Job) -> Result<HeatSolver> {
    let mut surface = IntrinsicMesh::from_extrinsic(mesh.positions(), mesh.triangles())?;
    surface.mollify(MOLLIFY);
    HeatSolver::new(&surface, HeatOptions { time_factor: options.time_factor }, job)
}

fn widths(mesh: &TriMesh, triangles: &[[u32; 3]], options: &Options, job: &Job) -> Result<Vec<f64>> {
    let rays = RayMesh::new(mesh.positions(), triangles, job)?;
    match options.d2 {
        D2Method::Inscribed => Ok(face_widths(&rays, &Cone::new(options.rays, options.cone_angle)?, job)?.width),
        D2Method::ShapeDiameter => sdf_values(&rays, options.rays, options.cone_angle, job),
    }
}

fn assemble(
    mesh: &TriMesh,
    d1: Eccentricity,
    d2: Vec<f64>,
    face_d2: Vec<f64>,
    seconds: [f64; Stage::COUNT],
) -> Result<Field> {
    let n = d2.len();
    let mut used = try_filled(n, false, "the field")?;
    let mut solid = try_filled(n, false, "the field")?;
    for &t in mesh.triangles() {
        let has_area = !is_flat(corners(mesh.positions(), t));
        for v in t {
            used[v as usize] = true;
            solid[v as usize] |= has_area;
        }
    }
    let mut ratio = try_vec(n, "the field")?;
    let mut reasons = try_vec(n, "the field")?;
    for v in 0..n {
        ratio.push(d1.distance[v] / d2[v]);
        reasons.push(match (used[v], solid[v], d2[v].is_nan()) {
            (false, _, _) => reason::UNREFERENCED,
            (_, false, _) => reason::NO_AREA,
            (_, _, true) => reason::NO_HIT,
            _ => 0,
        });
    }
    let (farthest, solves) = (d1.farthest, d1.solves as u64);
    Ok(Field { d1: d1.distance, d2, ratio, farthest, reason: reasons, face_d2, solves, seconds })
}

/// Rough peak bytes: operators, factors and their right-hand sides, acceleration structure, results.
fn footprint(vertices: usize, faces: usize) -> u64 {
    vertices as u64 * 1600 + faces as u64 * 250
}
