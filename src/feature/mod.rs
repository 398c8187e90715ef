//! Features: what a person would point at, with what they measure.
//!
//! The walk: the segments of [`crate::segment`] → [`widths`] at places spread over them → [`merge`] (what lies back to back is
//! one wall) → [`split`] (thin walls flush with their body) → measures of each: [`lengths`], widths, [`kind`] → judged by [`limits`] → [`report`].
//!
//! A feature's slenderness is D1max / D2max: the longest shortest way on its own surface over its thickness. Its thickness
//! is the width of the solid there where both sides belong to the feature, so that neither the fillet at its foot nor
//! the body behind it counts, or its height if it is lower than wide.

pub mod kind;
pub mod lengths;
pub mod limits;
pub mod merge;
pub mod report;
pub mod split;
pub mod widths;

use crate::error::{Error, Result, try_vec};
use crate::job::{Job, Stage};
use crate::mesh::measure::{Vec3, add, area_vector, corners, cross, distance, dot, norm, scale, sub};
use crate::mesh::{NONE, TriMesh};
use crate::segment::{self, SegmentOptions, ring};
use crate::thickness::bvh::RayMesh;
use crate::thickness::wall::WallMesh;
use hashbrown::HashMap;
use kind::{Kind, OrientedBox};
use rayon::prelude::*;
use std::collections::BTreeMap;
use widths::{Place, quantile};

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
    /// Area.
    pub area: f64,
    /// Centroid of its surface.
    pub centroid: Vec3,
    /// The box that it fits in.
    pub bounds: OrientedBox,
}

/// The features of a part.
#[derive(Debug, Clone, Default)]
pub struct Features {
    /// Feature of every kept face.
    pub face_feature: Vec<u32>,
    /// By falling area.
    pub features: Vec<Feature>,
}

/// The widest tenth of a feature's area may be corners and nodes, in which walls and bars meet: how wide the feature is
/// there at most is told from how its width spreads from the half of its area to nine tenths of it, ...
const TYPICAL: [f64; 2] = [0.5, 0.9];
/// ... going on like this: the width of a cone grows by a quarter of that once more.
const GROWTH: f64 = 0.35;
/// A feature lower than wide is as thick as it is high; but one lower than this share of its width is a relief on its
/// body, which stiffens it.
const RELIEF: f64 = 0.25;
/// What may lie off the plane of a feature's border, as a share of the width of the feature.
const LEVEL: f64 = 0.1;

/// Finds and measures the features of a mesh. Call it inside [`Job::run`]. Bit-identical for every thread count.
///
/// # Errors
/// Those of [`segment::segment`]; features without area or with nothing inside have NaN.
pub fn find_features(mesh: &TriMesh, options: &FeatureOptions, job: &Job) -> Result<Features> {
    let wanted = SegmentOptions { measure: false, ..options.segments };
    let segments = segment::segment(mesh, &wanted, job)?.face_segment;
    let positions = mesh.positions();
    let triangles = mesh.topology()?.oriented(mesh.triangles());
    job.begin(Stage::Thickness, 0.5, 0.7, 12_000)?;
    let rays = RayMesh::new(positions, &triangles, job)?;
    let walls = WallMesh::new(positions, &triangles, job)?;
    let places = widths::places(positions, &triangles, &rays, &walls, &segments, job)?;
    // --- segments back to back are one
    let joined = merge::back_to_back(positions, &triangles, &segments, &places);
    let joined: Vec<u32> = segments.iter().map(|&s| joined[s as usize]).collect();
    // --- thin walls on thick bodies without a crease between
    let parts = split::at_jumps(positions, &triangles, mesh.topology()?, &joined, &places);
    let face_feature = numbered(positions, &triangles, &parts)?;
    let members = members(&face_feature)?;
    // --- measures
    let mut by_feature: Vec<Vec<&Place>> = vec![Vec::new(); members.len()];
    places.iter().for_each(|p| by_feature[face_feature[p.face as usize] as usize].push(p));
    job.begin(Stage::Geodesic, 0.7, 1.0, members.len() as u64)?;
    let scene = Scene { mesh, triangles: &triangles, label: &face_feature };
    let features: Vec<Feature> = (members.par_iter().zip(by_feature).enumerate())
        .map(|(k, (faces, places))| {
            let feature = scene.measure(k as u32, faces, places, job)?;
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

/// A part and its features.
struct Scene<'a> {
    mesh: &'a TriMesh,
    triangles: &'a [[u32; 3]],
    label: &'a [u32],
}

impl Scene<'_> {
    fn measure(&self, k: u32, faces: &[u32], places: Vec<&Place>, job: &Job) -> Result<Feature> {
        job.check()?;
        let positions = self.mesh.positions();
        let (centroid, area) = lengths::centroid(positions, self.triangles, faces);
        let (own_positions, own) = lengths::extract(positions, self.triangles, faces)?;
        let (d2_max, d2_min) = self.widths(k, places, faces)?;
        let length = match lengths::longest(&own_positions, &own, job) {
            // a feature without area has no length
            Err(Error::Degenerate(_) | Error::Numeric(_)) => None,
            other => other?,
        };
        let (d1_max, d1_upper, d1_ends) =
            length.as_ref().map_or((f64::NAN, f64::NAN, [[f64::NAN; 3]; 2]), |l| (l.length, l.upper, l.ends));
        let is_ring = match &length {
            Some(l) if ring::handles(&own) > 0 => ring::is_ring(&own_positions, &own, &l.field),
            _ => false,
        };
        let (kind, width) = kind::classify(d1_max, d2_max.width, area, is_ring);
        let long = if is_ring { 2.0 * d1_max } else { d1_max };
        Ok(Feature {
            kind,
            ratio: d1_max / d2_max.width,
            ratio_range: [d1_max / d2_max.width, d1_upper / d2_max.width],
            d1_max,
            d1_upper,
            d1_ends,
            d2_max,
            d2_min,
            dimensions: [long, width, d2_max.width],
            faces: faces.len() as u32,
            area,
            centroid,
            bounds: kind::oriented_box(&own_positions, &own),
        })
    }

    /// D2max and D2min.
    fn widths(&self, k: u32, mut places: Vec<&Place>, faces: &[u32]) -> Result<(Width, Width)> {
        places.retain(|p| p.width.is_finite());
        let least = quantile(&mut places, 0.0).map_or(Width::NONE, Width::of);
        let own = |p: &&Place| p.facing != NONE && self.label[p.facing as usize] == k;
        if places.iter().any(own) {
            places.retain(own);
        }
        let mut most = quantile(&mut places, 1.0).map_or(Width::NONE, Width::of);
        if let [Some(half), Some(typical)] = TYPICAL.map(|q| quantile(&mut places, q)) {
            let limit = typical.width + GROWTH * (typical.width - half.width);
            let within = places.iter().rev().find(|p| p.width <= limit * (1.0 + 1e-9));
            most = within.map_or(most, |p| Width::of(p));
        }
        // --- lower than wide
        if let Some((height, top, foot)) = self.height(k, faces, most.width)? {
            if height < most.width && height >= RELIEF * most.width {
                most = Width { width: height, at: top, contacts: [top, foot] };
            }
        }
        Ok((most, least))
    }

    /// How far the feature rises from the plane that its border lies in, its highest point and the foot of that point;
    /// none if its border lies in no plane, within a share of `width`, or the feature on both sides of it.
    fn height(&self, k: u32, faces: &[u32], width: f64) -> Result<Option<(f64, Vec3, Vec3)>> {
        let positions = self.mesh.positions();
        let border = self.largest_border(k, faces)?;
        // --- the plane: its normal is the area vector of the closed border, which points into the feature
        let whole: f64 = border.iter().map(|(a, b)| distance(*a, *b)).sum();
        if !(whole > 0.0) {
            return Ok(None);
        }
        let moment = border.iter().fold([0.0; 3], |m, (a, b)| add(m, scale(add(*a, *b), 0.5 * distance(*a, *b))));
        let centre = scale(moment, 1.0 / whole);
        let vector = area_within(&border, centre);
        let length = norm(vector);
        if !(length > 1e-6 * whole * whole) {
            return Ok(None);
        }
        let up = scale(vector, 1.0 / length);
        let level = |p: Vec3| dot(sub(p, centre), up);
        if border.iter().any(|(a, _)| level(*a).abs() > LEVEL * width) {
            return Ok(None);
        }
        let corner = faces.iter().flat_map(|&f| self.triangles[f as usize]).map(|v| positions[v as usize]);
        let (mut low, mut top) = (0.0f64, (0.0f64, centre));
        for p in corner {
            let h = level(p);
            low = low.min(h);
            if h > top.0 {
                top = (h, p);
            }
        }
        let one_sided = low >= -LEVEL * width || top.0 <= LEVEL * width;
        if !one_sided {
            return Ok(None);
        }
        let height = top.0.max(-low);
        Ok((top.0 > -low).then(|| (height, top.1, sub(top.1, scale(up, top.0)))))
    }
    /// The sides of the closed border that encloses most.
    fn largest_border(&self, k: u32, faces: &[u32]) -> Result<Vec<(Vec3, Vec3)>> {
        let topology = self.mesh.topology()?;
        let positions = self.mesh.positions();
        let mut sides: Vec<[u32; 2]> = Vec::new();
        for &f in faces {
            for c in 0..3usize {
                // an edge of the mesh as stored: the corners may be turned around in `triangles`
                let t = self.mesh.triangles()[f as usize];
                let (a, b) = (t[c], t[(c + 1) % 3]);
                let around = topology.halfedges(topology.edge_of_halfedge[3 * f as usize + c]);
                if around.len() != 2 || around.iter().any(|h| self.label[*h as usize / 3] != k) {
                    let turned = topology.flipped[f as usize];
                    sides.push(if turned { [b, a] } else { [a, b] });
                }
            }
        }
        let mut root: HashMap<u32, u32> = sides.iter().flatten().map(|&v| (v, v)).collect();
        for &[a, b] in &sides {
            let (a, b) = (find(&root, a), find(&root, b));
            root.insert(a.max(b), a.min(b));
        }
        let mut loops: BTreeMap<u32, Vec<(Vec3, Vec3)>> = BTreeMap::new();
        for [a, b] in sides {
            loops.entry(find(&root, a)).or_default().push((positions[a as usize], positions[b as usize]));
        }
        let size = |l: &Vec<(Vec3, Vec3)>| norm(area_within(l, l[0].0));
        Ok(loops.into_values().max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or_default())
    }
}

/// Area vector of what a closed border encloses.
fn area_within(border: &[(Vec3, Vec3)], from: Vec3) -> Vec3 {
    border.iter().fold([0.0; 3], |m, (a, b)| add(m, scale(cross(sub(*a, from), sub(*b, from)), 0.5)))
}

fn find(root: &HashMap<u32, u32>, mut v: u32) -> u32 {
    while root[&v] != v {
        v = root[&v];
    }
    v
}
