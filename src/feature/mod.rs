//! Features: what a person would point at, with what they measure.
//!
//! The walk: the parts that [`crate::segment`] finds, on a [`skin`] of the faces cut where their borders cross them →
//! [`widths`] at places spread over them → [`merge`] (what lies back to back is one wall) → [`sheets`] (what is bent or
//! closed is one) → [`split`] (thin walls flush with their body) → [`limbs`] (of what is smooth everywhere) → measures of
//! each: [`lengths`] without the [`foot`], widths, [`kind`] → judged by [`limits`] → [`report`].
//!
//! A feature's slenderness is D1max / D2max: the longest shortest way on its own surface over its thickness. Its thickness
//! is the width of the solid there where both sides belong to the feature, so that neither the fillet at its foot nor
//! the body behind it counts, or its height if it is lower than wide.

pub mod foot;
pub mod kind;
pub mod lengths;
pub mod limbs;
pub mod limits;
mod measure;
pub mod merge;
pub mod report;
pub mod sheets;
pub mod skin;
pub mod split;
pub mod widths;

#[cfg(test)]
mod tests;

use crate::error::{Result, try_vec};
use crate::job::{Job, Stage};
use crate::mesh::measure::{Vec3, area_vector, corners, norm};
use crate::mesh::{Topology, TriMesh};
use crate::segment::dual::Dual;
use crate::segment::{self, SegmentOptions};
use crate::thickness::bvh::RayMesh;
use crate::thickness::wall::WallMesh;
use kind::{Kind, OrientedBox};
use measure::Scene;
use rayon::prelude::*;
use skin::Skin;
use std::sync::atomic::{AtomicUsize, Ordering};
use widths::Place;

/// What to compute.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FeatureOptions {
    /// How the part is cut into segments; whether they are measured does not matter.
    pub segments: SegmentOptions,
}

/// A width, and where.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Width {
    /// Model units; NaN where nothing could be measured.
    pub width: f64,
    /// A point of the surface where it is that wide.
    pub at: Vec3,
    /// The two walls that it is measured between.
    pub contacts: [Vec3; 2],
}

impl Width {
    const NONE: Width = Width { width: f64::NAN, at: [f64::NAN; 3], contacts: [[f64::NAN; 3]; 2] };

    fn of(place: &Place) -> Width {
        Width { width: place.width, at: place.at, contacts: [place.at, place.across] }
    }
}

/// A feature. Lengths in model units; NaN where there is no value.
#[derive(Debug, Clone, PartialEq)]
pub struct Feature {
    /// What sort of thing it is.
    pub kind: Kind,
    /// d1_max / d2_max.width.
    pub ratio: f64,
    /// The ratio is between these, as far as the lengths go.
    pub ratio_range: [f64; 2],
    /// D1max: the longest shortest way on its own surface.
    pub d1_max: f64,
    /// No way on its surface is longer.
    pub d1_upper: f64,
    /// The ends of that way.
    pub d1_ends: [Vec3; 2],
    /// D2max: its thickness.
    pub d2_max: Width,
    /// D2min: the least width anywhere on its surface.
    pub d2_min: Width,
    /// Length, width and thickness as its kind has them: D1max (of a ring the way around), the other side of a strip of
    /// its area, D2max.
    pub dimensions: [f64; 3],
    /// Number of kept faces.
    pub faces: u32,
    /// Area of its surface; of a face that its border crosses, the part on its side.
    pub area: f64,
    /// Centroid of its surface.
    pub centroid: Vec3,
    /// The box that it fits in.
    pub bounds: OrientedBox,
}

/// The features of a part.
#[derive(Debug, Clone, Default)]
pub struct Features {
    /// Feature of every kept face: the one that most of it belongs to.
    pub face_feature: Vec<u32>,
    /// By falling area.
    pub features: Vec<Feature>,
}

/// Finds and measures the features of a mesh. Call it inside [`Job::run`]. Bit-identical for every thread count.
///
/// # Errors
/// Those of [`segment::segment`]; features without area or with nothing inside have NaN.
pub fn find_features(mesh: &TriMesh, options: &FeatureOptions, job: &Job) -> Result<Features> {
    let wanted = SegmentOptions { measure: false, ..options.segments };
    segment::admit(mesh, &wanted, job)?;
    let positions = mesh.positions();
    let triangles = mesh.topology()?.oriented(mesh.triangles());
    let (solid, ground) = rayon::join(
        || Ok((WallMesh::new(positions, &triangles, job)?, Dual::new(positions, &triangles, mesh.topology()?)?)),
        || segment::lay_out(positions, &triangles, &wanted, job),
    );
    let ((walls, dual), ground) = (solid?, ground?);
    let own;
    let rays = match walls.rays() {
        Some(rays) => rays,
        None => {
            own = RayMesh::new(positions, &triangles, job)?;
            &own
        }
    };
    let label = ground.parts(rays, &wanted, job)?;
    // --- faces that a border crosses are cut along it
    let voted = ground.voted(&label, triangles.len())?;
    match ground.cut(&label, &voted, &triangles)? {
        None => {
            drop(ground);
            let skin = Skin::of(mesh, &triangles, &dual)?;
            on_skin(&skin, &voted, (rays, &walls), &wanted, job)
        }
        Some(cut) => {
            drop((ground, dual));
            let topology = Topology::edges_of(cut.positions.len(), &cut.triangles)?;
            let dual = Dual::new(&cut.positions, &cut.triangles, &topology)?;
            let skin = Skin::cut(&cut, &topology, &dual);
            let found = on_skin(&skin, &cut.label, (rays, &walls), &wanted, job)?;
            skin.on_input(found, triangles.len())
        }
    }
}

/// The features of a skin, by its faces, out of what each is part of.
fn on_skin(
    skin: &Skin<'_>,
    label: &[u32],
    (rays, walls): (&RayMesh, &WallMesh),
    wanted: &SegmentOptions,
    job: &Job,
) -> Result<Features> {
    let Skin { positions, triangles, topology, dual, .. } = *skin;
    let segments = segment::finished(dual, label, wanted)?;
    job.begin(Stage::Thickness, 0.5, 0.7, 12_000)?;
    let places = widths::places(skin, rays, walls, &segments, job)?;
    // --- segments back to back are one
    let joined = merge::back_to_back(positions, triangles, dual, &segments, &places)?;
    let joined: Vec<u32> = segments.iter().map(|&s| joined[s as usize]).collect();
    // --- a bent sheet, and the walls of a box
    let sheet = sheets::closed_or_bent(dual, &joined, &places)?;
    let joined: Vec<u32> = joined.iter().map(|&s| sheet[s as usize]).collect();
    // --- thin walls on thick bodies without a crease between
    let min_area = wanted.min_area * dual.area.iter().sum::<f64>();
    let parts = split::at_jumps(positions, triangles, topology, &joined, &places, min_area)?;
    // --- limbs of smooth shapes
    let parts = limbs::at_ends(dual, &parts, &places, min_area)?;
    let face_feature = numbered(positions, triangles, &parts)?;
    let members = members(&face_feature)?;
    // --- measures
    let mut by_feature: Vec<Vec<&Place>> = vec![Vec::new(); members.len()];
    places.iter().for_each(|p| by_feature[face_feature[p.face as usize] as usize].push(p));
    job.begin(Stage::Geodesic, 0.7, 1.0, members.len() as u64)?;
    // features that nobody has begun to measure
    let waiting = AtomicUsize::new(members.len());
    let scene = Scene { skin, label: &face_feature };
    let features: Vec<Feature> = (members.par_iter().zip(by_feature).enumerate().with_max_len(1))
        .map(|(k, (faces, places))| {
            let last = waiting.fetch_sub(1, Ordering::Relaxed) == 1;
            let feature = scene.measure(k as u32, faces, places, last, job)?;
            job.advance(1)?;
            Ok(feature)
        })
        .collect::<Result<_>>()?;
    Ok(Features { face_feature, features })
}

/// Parts numbered by falling area, equal ones as they were.
fn numbered(positions: &[Vec3], triangles: &[[u32; 3]], part: &[u32]) -> Result<Vec<u32>> {
    let n = part.iter().map(|p| *p as usize + 1).max().unwrap_or(0);
    let mut area = vec![0.0; n];
    let mut used = vec![false; n];
    for (f, &t) in triangles.iter().enumerate() {
        area[part[f] as usize] += norm(area_vector(corners(positions, t)));
        used[part[f] as usize] = true;
    }
    // segments are numbered by falling area, and equal ones by position: that order is kept between equals
    let total: f64 = area.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let mut order: Vec<usize> = (0..n).filter(|&k| used[k]).collect();
    order.sort_by_key(|&k| -((area[k] / total * 1e7).round() as i64));
    let mut number = vec![0u32; n];
    order.iter().enumerate().for_each(|(n, &k)| number[k] = n as u32);
    let mut out = try_vec(part.len(), "features")?;
    out.extend(part.iter().map(|&p| number[p as usize]));
    Ok(out)
}

/// Faces by feature.
fn members(label: &[u32]) -> Result<Vec<Vec<u32>>> {
    let n = label.iter().map(|l| *l as usize + 1).max().unwrap_or(0);
    let mut out: Vec<Vec<u32>> = try_vec(n, "features")?;
    out.resize_with(n, Vec::new);
    for (f, &l) in label.iter().enumerate() {
        out[l as usize].push(f as u32);
    }
    Ok(out)
}
