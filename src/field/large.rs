//! D1 of meshes that are too large for exact distances between all their vertices: they are solved for between points
//! spread evenly over a mesh of few faces that stands in, and every vertex gets its value from the points around it, by way
//! of a reference: the mesh with some thousand faces, which also tells how right the distances are.

use super::Options;
use super::accuracy::{Accuracy, Method, pair, probes, stretch};
use super::bridge::Bridge;
use super::print::{Lengths, all_where_none, measure};
use crate::error::{Error, Result, try_filled, try_vec};
use crate::geodesic::{ExactFields, Mode};
use crate::job::{Job, Stage};
use crate::mesh::corners::shape_corners;
use crate::mesh::measure::Vec3;
use crate::mesh::proxy::{Place, Proxy, REFERENCE_FACES, places};
use crate::mesh::surface::{AnalysisSurface, SurfaceOptions};
use crate::mesh::{NONE, TriMesh};

/// Faces at least and distance of the mesh that stands in for the reference.
const PROXIES: [(usize, f64); 4] = [(500, 2e-3), (1_000, 1e-3), (3_000, 2.5e-4), (REFERENCE_FACES, 0.0)];
/// Two fields see a part of the distortion that all have: it is taken to be this many times as large.
const UNSEEN: f64 = 2.0;
/// Distances on the mesh that stands in may be off by this share of the largest, as two fields see it.
const MOST_DISTORTION: f64 = 0.004;
/// Every place is this near to a point, as a share of their spacing.
const COVERED: f64 = 0.7;
/// Share of the tolerance that is left to the search, however much of it the rest takes.
const LEAST: f64 = 0.5;
/// The search aims at less than half of its tolerance, so that small meshes have values as near as their time allows. Here
/// vertices get theirs from points around them, and it is given so much more; bounds stay within the tolerance.
const COARSER: f64 = 1.4;
/// Points that D1 is solved for at.
const POINTS: usize = 4_000;

/// D1 of every vertex and the longest way across.
///
/// # Errors
/// [`Error::Numeric`] for a mesh that does not simplify or takes too many windows, those of the solvers.
pub(super) fn lengths(mesh: &TriMesh, triangles: &[[u32; 3]], options: &Options, job: &Job) -> Result<Lengths> {
    job.begin(Stage::Surface, 0.35, 0.42, 3)?;
    // a few fields on it tell how right the others are
    let Some(reference) = mesh.reference(job)? else {
        return Err(Error::Numeric("the mesh does not simplify".into()));
    };
    job.advance(1)?;
    let exact = ExactFields::new(&reference.positions, &reference.triangles)?;
    let sources = probes(&reference.positions, &reference.triangles);
    let truth = pair(&exact, sources, job)?;
    let longest = truth.iter().flatten().copied().filter(|d| d.is_finite()).fold(0.0, f64::max);
    let (component, components) = exact.components();
    for (faces, share) in PROXIES {
        let proxy = Proxy::within(&reference.positions, &reference.triangles, faces, share, job)?;
        let (factor, error) = {
            let from = (&reference.positions[..], &reference.triangles[..]);
            let places = places(from, &proxy.onto, (&proxy.positions, &proxy.triangles), job)?;
            let on_proxy = ExactFields::on_proxy(&proxy, &places, component.to_vec(), components)?;
            stretch(&truth, &mut pair(&on_proxy, sources, job)?)
        };
        if error <= MOST_DISTORTION || share == 0.0 {
            return solve((mesh.positions(), triangles), (reference, &proxy), (factor, error, longest), options, job);
        }
    }
    Err(Error::Numeric("the mesh does not simplify".into()))
}

/// D1 of `positions` by way of points on `proxy`.
fn solve(
    (positions, triangles): (&[Vec3], &[[u32; 3]]),
    (reference, proxy): (&Proxy, &Proxy),
    (factor, error, longest): (f64, f64, f64),
    options: &Options,
    job: &Job,
) -> Result<Lengths> {
    // --- points: the proxy's vertices and others between them
    let spread = SurfaceOptions { target_vertices: POINTS, max_added: 2 * POINTS, ..SurfaceOptions::default() };
    let surface = AnalysisSurface::refine(&proxy.positions, &proxy.triangles, &spread, job)?;
    let mut points = try_vec(surface.positions.len(), "points")?;
    let mut corner = try_filled(proxy.positions.len(), Place { face: NONE, weights: [0.0; 3] }, "points")?;
    for (face, t) in proxy.triangles.iter().enumerate() {
        for (k, &v) in t.iter().enumerate() {
            let mut weights = [0.0; 3];
            weights[k] = 1.0;
            corner[v as usize] = Place { face: face as u32, weights };
        }
    }
    points.extend(corner);
    let added = surface.added(&proxy.positions, &proxy.triangles);
    points.extend(added.map(|(face, weights)| Place { face, weights }));

    // --- D1 of the points
    let whole = ExactFields::new(&surface.positions, &surface.triangles)?;
    let (component, components) = whole.components();
    let mut fields = ExactFields::on_proxy(proxy, &points, component.to_vec(), components)?;
    fields.set_distortion(factor, UNSEEN * error);
    let bridge = Bridge::new((positions, triangles), (reference, &proxy.onto), &surface, job)?;
    let stands = bridge.stands(&shape_corners(positions, triangles)?)?;
    let mut far = try_vec(stands.vertex.len(), "far ends")?;
    far.extend(stands.vertex.iter().map(|&v| v != NONE));
    all_where_none(&whole, &mut far)?;
    drop(whole);
    job.begin(Stage::Geodesic, 0.42, 0.9, surface.positions.len() as u64)?;
    let accuracy = Accuracy::on(Method::ExactOnProxy, &proxy.positions, &proxy.triangles);
    let solved = (&proxy.positions[..], &proxy.triangles[..], accuracy);
    // the farthest corner need not be one of the points, but is this near to one, and such a point is off its corner; no
    // D1 is less than half the largest
    let beyond = COVERED * surface.spacing;
    let ends = far.iter().filter(|f| **f).count().max(1);
    let off = far.iter().zip(&stands.off).filter(|(far, _)| **far).map(|(_, off)| off).sum::<f64>() / ends as f64;
    let d1 = match options.d1 {
        Mode::Certified { tolerance } => {
            let left = (tolerance - 2.0 * (beyond + off) / longest).max(LEAST * tolerance);
            Mode::Certified { tolerance: COARSER * left }
        }
        Mode::AllSources => Mode::AllSources,
    };
    let mut found = measure(&fields, &surface.positions, &far, solved, &Options { d1, ..*options }, job)?;
    found.d1.upper.iter_mut().for_each(|d| *d += beyond);
    for (d, &end) in found.d1.lower.iter_mut().zip(&found.d1.farthest) {
        *d -= stands.off.get(end as usize).copied().unwrap_or(0.0);
    }

    // --- and of the vertices
    job.begin(Stage::Geodesic, 0.97, 1.0, 1)?;
    let d1 = bridge.spread(&found.d1, &stands)?;
    Ok(Lengths { d1, ..found })
}
