//! From a mesh and options to its field.

use super::accuracy::{Accuracy, Method, heat_error, look_back};
use super::print::{self, Lengths};
use super::reach::farthest_apart;
use super::{Field, reason};
use crate::error::{Error, Result, try_filled, try_vec};
use crate::geodesic::{DistanceFields, HeatOptions, HeatSolver, Mode, Targets, eccentricity};
use crate::job::{Job, Stage};
use crate::mesh::intrinsic::IntrinsicMesh;
use crate::mesh::measure::{corners, is_flat};
use crate::mesh::{NONE, TriMesh};
use crate::thickness::bvh::{RayMesh, Unturned};
use crate::thickness::cone::Cone;
use crate::thickness::inscribed::{face_widths, vertex_means};
use crate::thickness::sdf::sdf_values;
use std::time::Instant;

/// What the numbers are for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Profile {
    /// The method as printed: the heat method and the rays on the mesh as given, means over faces. For meshes that are
    /// good for finite elements, and for comparing with the paper.
    Paper,
    /// For parts that are to be printed, on any triangulation: D1 by exact distances (or heat distances on a refined
    /// surface where those cost too much), D2 the wall width.
    #[default]
    Print,
}

/// Which width D2 is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum D2Method {
    /// That of the profile: the inscribed sphere of Eqs. 10-13, or the wall width.
    #[default]
    Profile,
    /// The inscribed sphere of Eqs. 10-13.
    Inscribed,
    /// The shape diameter function of Shapira et al. 2008 as CGAL defines it, raw values.
    ShapeDiameter,
    /// The wall width: see [`crate::thickness::wall`].
    Wall,
}

/// What to compute.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// What the numbers are for.
    pub profile: Profile,
    /// How many sources D1 takes.
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
            profile: Profile::default(),
            d1: Mode::Certified { tolerance: 0.05 },
            time_factor: 1.0,
            d2: D2Method::default(),
            rays: 20,
            cone_angle: 2.0 / 3.0 * std::f64::consts::PI,
        }
    }
}

/// Triangles thinner than this share of the mean edge are padded to it before cotangents are taken.
const MOLLIFY: f64 = 1e-6;

/// Measures what each stage takes.
struct Clock {
    last: Instant,
    seconds: [f64; Stage::COUNT],
}

impl Clock {
    fn lap(&mut self, stage: Stage) {
        self.seconds[stage as usize] += self.last.elapsed().as_secs_f64();
        self.last = Instant::now();
    }
}

/// Computes the field of `mesh`. Call it inside [`Job::run`].
pub fn compute(mesh: &TriMesh, options: &Options, job: &Job) -> Result<Field> {
    let (n, m) = (mesh.positions().len(), mesh.triangles().len());
    job.afford(footprint(n, m), "D1 and D2")?;
    let mut clock = Clock { last: Instant::now(), seconds: [0.0; Stage::COUNT] };

    job.begin(Stage::Mesh, 0.0, 0.02, 1)?;
    let method = width_method(options);
    // The boxes of faces do not depend on which sides are out.
    let (topology, rays) = rayon::join(
        || mesh.topology(),
        || (method != D2Method::Wall).then(|| RayMesh::begin(mesh.positions(), mesh.triangles(), job)),
    );
    let triangles = topology?.oriented(mesh.triangles());
    clock.lap(Stage::Mesh);

    job.begin(Stage::Thickness, 0.02, 0.35, (m + n) as u64)?;
    let (d2, face_d2) = widths(mesh, &triangles, (method, rays.transpose()?), options, job)?;
    clock.lap(Stage::Thickness);

    job.begin(Stage::Factor, 0.35, 0.45, 2)?;
    let lengths = match options.profile {
        Profile::Paper => {
            let solver = solver(mesh, options, job)?;
            clock.lap(Stage::Factor);
            job.begin(Stage::Geodesic, 0.45, 1.0, n as u64)?;
            let all = try_filled(n, true, "the field")?;
            let targets = Targets { ask: &all, far: &all };
            let d1 = eccentricity(&solver, mesh.positions(), targets, options.d1, job)?;
            let reach = farthest_apart(&d1, mesh.positions());
            let mut accuracy = Accuracy::on(Method::Heat, mesh.positions(), &triangles);
            accuracy.conclude(&d1, heat_error(&solver, mesh.positions(), &triangles, job)?);
            Lengths { d1, reach, accuracy }
        }
        Profile::Print => print::lengths(mesh, &triangles, options, job)?,
    };
    clock.lap(Stage::Geodesic);
    assemble(mesh, lengths, (d2, face_d2), clock.seconds)
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

/// The heat method on the mesh as given.
fn solver(mesh: &TriMesh, options: &Options, job: &Job) -> Result<HeatSolver> {
    let mut surface = IntrinsicMesh::from_extrinsic(mesh.positions(), mesh.triangles())?;
    surface.mollify(MOLLIFY);
    HeatSolver::new(&surface, HeatOptions { time_factor: options.time_factor }, job)
}

/// Which width D2 is.
fn width_method(options: &Options) -> D2Method {
    match (options.d2, options.profile) {
        (D2Method::Profile, Profile::Paper) => D2Method::Inscribed,
        (D2Method::Profile, Profile::Print) => D2Method::Wall,
        (method, _) => method,
    }
}

/// D2 by vertex and by face.
fn widths(
    mesh: &TriMesh,
    triangles: &[[u32; 3]],
    (method, rays): (D2Method, Option<Unturned>),
    options: &Options,
    job: &Job,
) -> Result<(Vec<f64>, Vec<f64>)> {
    let Some(rays) = rays else { return print::walls(mesh, triangles, job) };
    let rays = rays.turned(triangles, job)?;
    let face_d2 = match method {
        D2Method::ShapeDiameter => sdf_values(&rays, options.rays, options.cone_angle, job)?,
        _ => face_widths(&rays, &Cone::new(options.rays, options.cone_angle)?, job)?.width,
    };
    Ok((vertex_means(mesh.positions().len(), triangles, &face_d2)?, face_d2))
}

fn assemble(
    mesh: &TriMesh,
    Lengths { d1, reach, accuracy }: Lengths,
    (d2, face_d2): (Vec<f64>, Vec<f64>),
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
    let solves = d1.solves as u64;
    let (farthest, d1_bounds) = (d1.farthest, (d1.lower, d1.upper));
    let d1 = d1.distance;
    let mut field =
        Field { d1, d1_bounds, d2, ratio, farthest, reason: reasons, face_d2, reach, accuracy, solves, seconds };
    field.accuracy = look_back(&field, mesh)?;
    Ok(field)
}

/// Rough peak bytes: operators, factors and their right-hand sides, acceleration structure, results.
fn footprint(vertices: usize, faces: usize) -> u64 {
    vertices as u64 * 1600 + faces as u64 * 250
}
