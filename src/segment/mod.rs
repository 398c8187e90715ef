//! Partition of a part into features.
//!
//! Three methods find where the parts are ([`Method`]). The paper's own, spectral clustering of all faces by geodesic,
//! angular and volumetric distances (Eqs. 14-23), needs memory in proportion to the square of the number of faces. Its
//! form by landmarks keeps the quantities and needs memory in proportion to the faces. The default cuts a coarse graph of the surface along
//! concave creases, sharp or rounded, wherever what a cut gains by following creases outweighs the flat surface it
//! crosses; it needs no number of parts and no eigenvectors.
//!
//! The walk: the input is refined ([`crate::mesh::surface`]) → [`dual`] graph, [`creases`], short cuts → [`patches`] → [`cut`] or
//! [`affinity`], [`spectral`], [`kmeans`] → [`finish`] (back on the input, connected, numbered) → [`measure`].

pub mod affinity;
pub mod borders;
pub mod creases;
pub mod cut;
pub mod dual;
pub mod finish;
pub mod kmeans;
pub mod measure;
mod parts;
pub mod patches;
mod queue;
mod reach;
mod refine;
pub mod ring;
mod shortcuts;
pub mod spectral;
pub mod spots;
pub mod vsi;

#[cfg(test)]
mod tests;
#[cfg(test)]
mod testshapes;

pub use affinity::Shares;
pub use borders::CutMesh;
pub use measure::Segment;

use crate::error::{Error, Result, try_filled, try_vec};
use crate::job::{Job, Stage};
use crate::mesh::measure::{Vec3, bounding_box, dot, sub};
use crate::mesh::surface::{AnalysisSurface, SurfaceOptions};
use crate::mesh::{Topology, TriMesh};
use crate::thickness::bvh::RayMesh;
use dual::Dual;
use parts::Scene;
use patches::Patches;
use rayon::prelude::*;

/// How the parts are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// A cut of the surface along concave creases, sharp or rounded. Memory and time in proportion to the faces.
    #[default]
    Creases,
    /// The paper's Eqs. 14-23 on every face of the input as it is. 8 F² bytes for F faces.
    Paper,
    /// The paper's quantities between patches of the analysis surface and some hundred landmarks among them.
    Landmarks,
}

/// What decides on the number of parts, where it is not given, in [`Method::Paper`] and [`Method::Landmarks`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Criterion {
    /// The partition whose borders turn most into concave creases, for their length.
    #[default]
    Creases,
    /// The largest fall of the eigenvalues after the first; at least 2 parts.
    Eigengap,
    /// The largest mean silhouette of the clusters.
    Silhouette,
}

/// What to compute.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SegmentOptions {
    /// How the parts are found.
    pub method: Method,
    /// Number of segments, N_f; automatic without. Fewer come out where the surface has fewer parts than that after
    /// those below `min_area` are joined with neighbours, more where it has more shells.
    pub count: Option<u32>,
    /// What decides on the number of parts in the spectral methods.
    pub criterion: Criterion,
    /// Segments smaller than this share of the area are joined with a neighbour.
    pub min_area: f64,
    /// α, β, γ and ε of Eqs. 15 and 22.
    pub shares: Shares,
    /// Rays of the inscribed spheres from which shape images are taken.
    pub rays: usize,
    /// Full opening angle of their cone, radians.
    pub cone_angle: f64,
    /// Vertices that the analysis surface is refined to.
    pub surface_vertices: usize,
    /// Patches that its coarse graph is wanted to have.
    pub patches: usize,
    /// Measure the segments; without, they have no lengths, widths and ratios.
    pub measure: bool,
}

impl Default for SegmentOptions {
    fn default() -> SegmentOptions {
        SegmentOptions {
            method: Method::default(),
            count: None,
            criterion: Criterion::default(),
            min_area: 1e-3,
            shares: Shares { geodesic: 0.1, angular: 0.8, volumetric: 0.1, epsilon: 0.1 },
            rays: 20,
            cone_angle: 2.0 / 3.0 * std::f64::consts::PI,
            surface_vertices: 25_000,
            patches: 3000,
            measure: true,
        }
    }
}

/// A partition of a mesh.
#[derive(Debug, Clone, Default)]
pub struct Segmentation {
    /// Segment of every kept face.
    pub face_segment: Vec<u32>,
    /// The segments, by falling area.
    pub segments: Vec<Segment>,
}

/// Segments narrower than this share of a patch's diameter are joined with a neighbour.
const MIN_WIDTH: f64 = 0.1;

/// A part of fewer faces than this has few places where it could be cut: its surface is refined in proportion, ...
const ENOUGH: f64 = 1000.0;
/// ... but not below this share.
const LEAST: f64 = 0.4;

/// Partitions `mesh` and measures its segments. Call it inside [`Job::run`].
///
/// # Errors
/// [`Error::Argument`] for options out of range, [`Error::Budget`] where the method needs more memory than the job
/// may take ([`Method::Paper`] beyond some 20 000 faces in any case), [`Error::NoMemory`], [`Error::Cancelled`].
pub fn segment(mesh: &TriMesh, options: &SegmentOptions, job: &Job) -> Result<Segmentation> {
    admit(mesh, options, job)?;
    let triangles = mesh.topology()?.oriented(mesh.triangles());
    let (positions, topology) = (mesh.positions(), mesh.topology()?);
    let (solid, ground) = rayon::join(
        || Ok((RayMesh::new(positions, &triangles, job)?, Dual::new(positions, &triangles, topology)?)),
        || lay_out(positions, &triangles, options, job),
    );
    let (rays, dual) = solid?;
    let ground = ground?;
    let label = ground.parts(&rays, options, job)?;
    let face_segment = finished(&dual, &ground.voted(&label, triangles.len())?, options)?;
    drop((dual, ground, label));
    let rays = options.measure.then_some(rays);
    let segments = measure::measure(mesh, &triangles, rays, &face_segment, job)?;
    Ok(Segmentation { face_segment, segments })
}

/// Refuses what [`segment`] does, and enters its first stage.
///
/// # Errors
/// Those of [`segment`].
pub fn admit(mesh: &TriMesh, options: &SegmentOptions, job: &Job) -> Result<()> {
    check(options)?;
    job.afford(footprint(mesh.triangles().len(), options), "the segmentation")?;
    job.begin(Stage::Surface, 0.0, 0.1, 2)
}

/// The surface that is partitioned.
pub struct Ground {
    surface: AnalysisSurface,
    dual: Dual,
    /// None for [`Method::Paper`].
    patches: Option<Patches>,
}

/// Prepares what does not depend on the solid: `triangles` are the kept faces, oriented outward. After [`admit`].
///
/// # Errors
/// Those of [`segment`].
pub fn lay_out(positions: &[Vec3], triangles: &[[u32; 3]], options: &SegmentOptions, job: &Job) -> Result<Ground> {
    let share = (triangles.len() as f64 / ENOUGH).clamp(LEAST, 1.0);
    let surface = match options.method {
        Method::Paper => AnalysisSurface::unrefined(positions, triangles)?,
        _ => {
            let target_vertices = (share * options.surface_vertices as f64) as usize;
            let wanted = SurfaceOptions { target_vertices, ..SurfaceOptions::default() };
            AnalysisSurface::refine(positions, triangles, &wanted, job)?
        }
    };
    job.advance(1)?;
    let topology = Topology::edges_of(surface.positions.len(), &surface.triangles)?;
    let mut dual = Dual::new(&surface.positions, &surface.triangles, &topology)?;
    job.begin(Stage::Segment, 0.1, 0.5, 4)?;
    if options.method == Method::Paper {
        return Ok(Ground { surface, dual, patches: None });
    }
    let rank = ranks(&dual.centroid)?;
    let total: f64 = dual.area.iter().sum();
    let walker = creases::Walker { positions: &surface.positions, triangles: &surface.triangles, topology: &topology };
    creases::gather(&mut dual, &walker, (total / options.patches as f64).sqrt(), job)?;
    shortcuts::draw(&mut dual, &walker, job)?;
    drop(topology);
    job.advance(1)?;
    let patches = Patches::new(&dual, (share * options.patches as f64) as usize, &rank, job)?;
    job.advance(1)?;
    Ok(Ground { surface, dual, patches: Some(patches) })
}

impl Ground {
    /// What each face of the surface is part of; not yet connected or numbered. `rays` are of the solid.
    ///
    /// # Errors
    /// Those of [`segment`].
    pub fn parts(&self, rays: &RayMesh, options: &SegmentOptions, job: &Job) -> Result<Vec<u32>> {
        let Ground { surface, dual, patches } = self;
        let scene = Scene { dual, parent: &surface.parent_face, rays };
        match (options.method, patches) {
            (Method::Paper, _) | (_, None) => parts::by_all_faces(&scene, options, job),
            (Method::Landmarks, Some(patches)) => parts::by_landmarks(&scene, patches, options, job),
            (Method::Creases, Some(patches)) => {
                let count = options.count.map(|k| k as usize);
                parts::by_creases(&scene, surface, patches, count, job)
            }
        }
    }

    /// The part that most of each kept face belongs to.
    ///
    /// # Errors
    /// [`Error::NoMemory`].
    pub fn voted(&self, label: &[u32], faces: usize) -> Result<Vec<u32>> {
        finish::vote(&self.surface, &self.dual.area, label, faces)
    }

    /// The kept faces, `triangles` as given to [`lay_out`], cut where a border of the parts crosses them; none where it
    /// crosses none. `voted` as by [`Ground::voted`].
    ///
    /// # Errors
    /// [`Error::NoMemory`].
    pub fn cut(&self, label: &[u32], voted: &[u32], triangles: &[[u32; 3]]) -> Result<Option<CutMesh>> {
        borders::cut(&self.surface, &self.dual.area, (label, voted), triangles)
    }
}

/// Labels of faces as connected, numbered segments: the segment of each. `dual` joins the faces.
///
/// # Errors
/// [`Error::NoMemory`].
pub fn finished(dual: &Dual, label: &[u32], options: &SegmentOptions) -> Result<Vec<u32>> {
    let rank = ranks(&dual.centroid)?;
    let total: f64 = dual.area.iter().sum();
    let limits = (options.min_area * total, MIN_WIDTH * (total / options.patches as f64).sqrt());
    finish::segments(dual, label, &rank, limits, options.count.map(|k| k as usize))
}

/// The place of every face when faces are ordered along a direction in which no two are likely to be level. It does not
/// depend on how the faces are numbered.
fn ranks(centroid: &[Vec3]) -> Result<Vec<u32>> {
    let (lo, _) = bounding_box(centroid.iter().copied());
    let along = |c: Vec3| dot(sub(c, lo), [0.537_721, 0.833_907, 0.124_889]);
    let mut order: Vec<(f64, u32)> = try_vec(centroid.len(), "order of faces")?;
    order.extend(centroid.iter().zip(0..).map(|(&c, f)| (along(c), f)));
    order.par_sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut rank = try_filled(centroid.len(), 0, "order of faces")?;
    order.iter().zip(0..).for_each(|(o, k)| rank[o.1 as usize] = k);
    Ok(rank)
}

fn check(options: &SegmentOptions) -> Result<()> {
    let wrong = |what: &str| Err(Error::Argument(format!("segmentation: {what}")));
    let shares = options.shares;
    let all = [shares.geodesic, shares.angular, shares.volumetric, shares.epsilon];
    if options.count.is_some_and(|k| k == 0 || k > 4096) {
        return wrong("the number of segments is not in 1..4096");
    }
    if !(0.0..1.0).contains(&options.min_area) {
        return wrong("the smallest area is not a share from 0 to below 1");
    }
    if all.iter().any(|s| !(s.is_finite() && *s >= 0.0)) || !(all[..3].iter().sum::<f64>() > 0.0) {
        return wrong("the shares of the distances are negative, not finite, or all zero");
    }
    if !(100..=1_000_000).contains(&options.surface_vertices) || !(50..=100_000).contains(&options.patches) {
        return wrong("surface vertices are not in 100..1000000 or patches not in 50..100000");
    }
    Ok(())
}

/// Rough peak bytes: analysis surface with its dual graph, ray trees, the largest segment's factors.
fn footprint(faces: usize, options: &SegmentOptions) -> u64 {
    let surface = faces as u64 + 4 * options.surface_vertices as u64;
    surface * 400 + faces as u64 * 700
}
