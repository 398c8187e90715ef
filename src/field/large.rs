//! D1 of meshes that are too large for exact distances between all their vertices: they are solved for between points
//! spread evenly over a mesh of few faces that stands in, and every vertex gets the value of the place nearest to it.

use super::Options;
use super::accuracy::{Accuracy, Method, pair, probes, stretch};
use super::print::{Lengths, all_where_none, measure, stand_in};
use crate::error::{Error, Result, try_filled, try_vec};
use crate::geodesic::{Eccentricity, ExactFields, Mode};
use crate::job::{Job, Stage};
use crate::mesh::NONE;
use crate::mesh::corners::shape_corners;
use crate::mesh::measure::{Vec3, distance};
use crate::mesh::proxy::{Around, Place, Proxy, places};
use crate::mesh::surface::{AnalysisSurface, SurfaceOptions};
use rayon::prelude::*;

/// The mesh is first taken down to this many faces, on which a few fields tell how right the others are.
const REFERENCE_FACES: usize = 16_000;
/// It may have this many more if it has to, to stay where it was.
const REFERENCE_LIMIT: usize = 60_000;
/// Distance of the reference from the part, as a share of the part's size: the first that is coarse enough is taken.
const REFERENCE_SHARES: [f64; 3] = [2e-4, 1e-3, 5e-3];
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
/// Points that make the value of a place are no further from it than this many spacings.
const NEAR: f64 = 1.5;
/// Points that D1 is solved for at.
const POINTS: usize = 4_000;

/// D1 of every vertex and the longest way across.
///
/// # Errors
/// [`Error::Numeric`] for a mesh that does not simplify or takes too many windows, those of the solvers.
pub(super) fn lengths(positions: &[Vec3], triangles: &[[u32; 3]], options: &Options, job: &Job) -> Result<Lengths> {
    job.begin(Stage::Surface, 0.35, 0.42, 3)?;
    let reference = reference(positions, triangles, job)?;
    job.advance(1)?;
    let exact = ExactFields::new(&reference.positions, &reference.triangles)?;
    let sources = probes(&reference.positions, &reference.triangles);
    let truth = pair(&exact, sources, job)?;
    let longest = truth.iter().flatten().copied().filter(|d| d.is_finite()).fold(0.0, f64::max);
    let (component, components) = exact.components();
    for (faces, share) in PROXIES {
        let proxy = stand_in(&reference.positions, &reference.triangles, faces, share, job)?;
        let (factor, error) = {
            let from = (&reference.positions[..], &reference.triangles[..]);
            let places = places(from, &proxy.onto, (&proxy.positions, &proxy.triangles), job)?;
            let on_proxy = ExactFields::on_proxy(&proxy, &places, component.to_vec(), components)?;
            stretch(&truth, &mut pair(&on_proxy, sources, job)?)
        };
        if error <= MOST_DISTORTION || share == 0.0 {
            let proxy = Proxy {
                original: proxy.original.iter().map(|&v| reference.original[v as usize]).collect(),
                onto: reference.onto.iter().map(|&v| if v == NONE { NONE } else { proxy.onto[v as usize] }).collect(),
                ..proxy
            };
            return solve((positions, triangles), &proxy, (factor, error, longest), options, job);
        }
    }
    Err(Error::Numeric("the mesh does not simplify".into()))
}

/// The mesh with few enough faces for some exact fields.
fn reference(positions: &[Vec3], triangles: &[[u32; 3]], job: &Job) -> Result<Proxy> {
    for share in REFERENCE_SHARES {
        let proxy = stand_in(positions, triangles, REFERENCE_FACES, share, job)?;
        if proxy.triangles.len() <= REFERENCE_LIMIT {
            return Ok(proxy);
        }
    }
    Err(Error::Numeric("the mesh does not simplify".into()))
}

/// D1 of `positions` by way of points on `proxy`.
fn solve(
    (positions, triangles): (&[Vec3], &[[u32; 3]]),
    proxy: &Proxy,
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
    let places = places((positions, triangles), &proxy.onto, (&surface.positions, &surface.triangles), job)?;
    let around = Around::new(&surface.positions, &surface.triangles)?;
    let stands = Stands::new(positions, triangles, (&surface, &around), &places)?;
    let mut far = try_vec(stands.vertex.len(), "far ends")?;
    far.extend(stands.vertex.iter().map(|&v| v != NONE));
    all_where_none(&whole, &mut far)?;
    drop(whole);
    job.begin(Stage::Geodesic, 0.42, 0.9, surface.positions.len() as u64)?;
    let accuracy = Accuracy::on(Method::ExactOnProxy, &proxy.positions, &proxy.triangles);
    let solved = (&proxy.positions[..], &proxy.triangles[..], accuracy);
    // the farthest corner need not be one of the points, but is this near to one; no D1 is less than half the largest
    let beyond = COVERED * surface.spacing;
    let d1 = match options.d1 {
        Mode::Certified { tolerance } => {
            Mode::Certified { tolerance: (tolerance - 2.0 * beyond / longest).max(LEAST * tolerance) }
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
    let d1 = interpolate(positions, &found.d1, (&surface, &around), &stands, &places)?;
    Ok(Lengths { d1, ..found })
}

/// The points that stand for corners of the shape: for each its nearest corner and how far it is off.
struct Stands {
    /// A vertex of the part; [`NONE`] for a point that stands for none.
    vertex: Vec<u32>,
    /// Model units.
    off: Vec<f64>,
}

impl Stands {
    fn new(
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        (surface, around): (&AnalysisSurface, &Around),
        places: &[Place],
    ) -> Result<Stands> {
        let corner = shape_corners(positions, triangles)?;
        let mut vertex = try_filled(surface.positions.len(), NONE, "far ends")?;
        let mut off = try_filled(surface.positions.len(), 0.0, "far ends")?;
        for (v, place) in places.iter().enumerate().filter(|(v, p)| corner[*v] && p.face != NONE) {
            let nearer = |a: (f64, u32), b: (f64, u32)| if b < a { b } else { a };
            let t = surface.triangles[place.face as usize];
            let corners = t.map(|u| (distance(positions[v], surface.positions[u as usize]), u));
            let mut best = corners.into_iter().fold((f64::INFINITY, NONE), nearer);
            if best.0 > surface.spacing {
                around.vertices_near(positions[v], place, best.0, |u, gap| best = nearer(best, (gap, u)));
            }
            let (gap, point) = (best.0, best.1 as usize);
            if vertex[point] == NONE || gap < off[point] {
                (vertex[point], off[point]) = (v as u32, gap);
            }
        }
        Ok(Stands { vertex, off })
    }
}

/// The points whose values make that of a place, with weights that add up to 1, the heaviest first: the corners of its
/// triangle or, where that is a sliver that reaches farther than its neighbours lie, points near by.
fn shares(p: Vec3, place: &Place, surface: &AnalysisSurface, around: &Around) -> Vec<(u32, f64)> {
    let t = surface.triangles[place.face as usize];
    let mut out: Vec<(u32, f64)> = t.into_iter().zip(place.weights).collect();
    let radius = NEAR * surface.spacing;
    let length = |k: usize| distance(surface.positions[t[k] as usize], surface.positions[t[(k + 1) % 3] as usize]);
    if (0..3).any(|k| length(k) > radius) {
        let mut near = Vec::new();
        around.vertices_near(p, place, radius, |v, gap| near.push((v, (1.0 - gap / radius).powi(2))));
        let total: f64 = near.iter().map(|n| n.1).sum();
        if total > 0.0 {
            near.iter_mut().for_each(|n| n.1 /= total);
            out = near;
        }
    }
    out.sort_unstable_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    out
}

/// Values at places of the surface, the nearest to `positions`; the far end is that of the nearest of its points.
fn interpolate(
    positions: &[Vec3],
    d1: &Eccentricity,
    (surface, around): (&AnalysisSurface, &Around),
    ends: &Stands,
    places: &[Place],
) -> Result<Eccentricity> {
    let mut all = try_filled(places.len(), ([f64::NAN; 3], NONE), "the field")?;
    all.par_iter_mut().zip(positions).zip(places).filter(|(_, place)| place.face != NONE).for_each(
        |((out, &p), place)| {
            let shares = shares(p, place, surface, around);
            let mean = |values: &[f64]| shares.iter().map(|(v, w)| w * values[*v as usize]).sum();
            let end = d1.farthest[shares[0].0 as usize];
            let end = ends.vertex.get(end as usize).copied().unwrap_or(NONE);
            *out = ([mean(&d1.distance), mean(&d1.lower), mean(&d1.upper)], end);
        },
    );
    let column = |k: usize| -> Result<Vec<f64>> {
        let mut out = try_vec(all.len(), "the field")?;
        out.extend(all.iter().map(|a| a.0[k]));
        Ok(out)
    };
    let mut farthest = try_vec(all.len(), "the field")?;
    farthest.extend(all.iter().map(|a| a.1));
    Ok(Eccentricity {
        distance: column(0)?,
        lower: column(1)?,
        upper: column(2)?,
        farthest,
        longest: d1.longest.clone(),
        ..*d1
    })
}
