//! What a segment measures: length and width, how they are spread, where they are, and what it borders on.

use super::reach::reach;
use super::ring::{handles, is_ring};
use super::spots::Spots;
use crate::error::{Error, Result, try_vec};
use crate::geodesic::{HeatOptions, HeatSolver};
use crate::job::{Job, Stage};
use crate::mesh::measure::{Vec3, add, area, bounding_box, corners, distance, scale, sub};
use crate::mesh::proxy::Proxy;
use crate::mesh::simplify::SimplifyOptions;
use crate::mesh::surface::{AnalysisSurface, SurfaceOptions};
use crate::mesh::{NONE, TriMesh};
use crate::thickness::bvh::RayMesh;
use crate::thickness::chords::first_met;
use crate::thickness::wall::WallMesh;
use rayon::prelude::*;

/// Places where the width of a segment is measured: at least, and for the whole part.
const PLACES: (usize, usize) = (40, 6000);
/// One place in this many is measured first; on a sphere, whose walls touch everywhere, a place takes long.
const FEW: usize = 8;
/// Where that many places agree to this share, those in between are not measured.
const ENOUGH: usize = 100;
const EVEN: f64 = 0.01;
/// Vertices that the surface of a segment is refined to: at least, and for the whole part.
const VERTICES: (usize, usize) = (1500, 8000);
/// A segment with more than this many faces by such a vertex is simplified before, to this many, ...
const FINE: usize = 8;
const COARSE: usize = 4;
/// ... as far as no vertex leaves the surface by more than this share of the segment's size.
const FLAT: f64 = 2e-4;

/// A part of a part. Lengths in model units; NaN where there is no value.
#[derive(Debug, Clone, PartialEq)]
pub struct Segment {
    /// Largest D1, the longest geodesic distance within the segment's own surface.
    pub d1_max: f64,
    /// Mean of D1 over the surface.
    pub d1_mean: f64,
    /// Largest D2, the wall width of the whole solid at the segment's surface.
    pub d2_max: f64,
    /// Mean of D2 over the surface.
    pub d2_mean: f64,
    /// The width that half of the surface is below.
    pub d2_median: f64,
    /// Smallest D2.
    pub d2_min: f64,
    /// d1_max / d2_max, the segment's slenderness.
    pub ratio_max: f64,
    /// d1_mean / d2_mean.
    pub ratio_mean: f64,
    /// The two points at distance d1_max.
    pub d1_ends: [Vec3; 2],
    /// Where D2 is largest.
    pub d2_max_at: Vec3,
    /// Where D2 is smallest.
    pub d2_min_at: Vec3,
    /// Number of kept faces.
    pub faces: u32,
    /// Area.
    pub area: f64,
    /// Centroid of the surface.
    pub centroid: Vec3,
    /// Lower and upper corner of the bounding box.
    pub bounds: [Vec3; 2],
    /// Length of the borders with other segments and of open edges.
    pub boundary_length: f64,
    /// Segments that share an edge with this one, ascending.
    pub neighbours: Vec<u32>,
    /// Handles of the surface, its holes thought closed: 1 for a ring or a piece of pipe with its bore.
    pub handles: u32,
    /// A closed ring: two ways lead from any point to the opposite one.
    pub ring: bool,
    /// Length of the closed way around a ring, 2 d1_max: what would be the D1 of the same bar cut open. NaN if not a ring.
    pub loop_length: f64,
}

impl Segment {
    fn empty() -> Segment {
        let (nan, nowhere) = (f64::NAN, [f64::NAN; 3]);
        Segment {
            d1_max: nan,
            d1_mean: nan,
            d2_max: nan,
            d2_mean: nan,
            d2_median: nan,
            d2_min: nan,
            ratio_max: nan,
            ratio_mean: nan,
            d1_ends: [nowhere; 2],
            d2_max_at: nowhere,
            d2_min_at: nowhere,
            faces: 0,
            area: 0.0,
            centroid: [0.0; 3],
            bounds: [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]],
            boundary_length: 0.0,
            neighbours: Vec::new(),
            handles: 0,
            ring: false,
            loop_length: nan,
        }
    }
}

/// Measures the segments of a mesh: `triangles` are its kept faces oriented outward, `label` their segments from 0, `rays`
/// what they bound (without it no lengths and widths are measured).
pub fn measure(
    mesh: &TriMesh,
    triangles: &[[u32; 3]],
    rays: Option<RayMesh>,
    label: &[u32],
    job: &Job,
) -> Result<Vec<Segment>> {
    let members = members(label)?;
    let mut out: Vec<Segment> = members.par_iter().map(|faces| shape(mesh.positions(), triangles, faces)).collect();
    borders(mesh, label, &mut out)?;
    let Some(rays) = rays else { return Ok(out) };
    widths(mesh, triangles, &rays, (&members, label), &mut out, job)?;
    drop(rays);
    let total: f64 = out.iter().map(|s| s.area).sum();
    job.begin(Stage::Geodesic, 0.7, 1.0, 100 * out.len() as u64)?;
    out.par_iter_mut().zip(&members).try_for_each(|(segment, faces)| {
        job.check()?;
        match lengths(mesh.positions(), triangles, faces, segment, total, job) {
            // a segment without area, or on which the heat method fails, has no length
            Err(Error::Degenerate(_) | Error::Numeric(_)) => Ok(()),
            other => other,
        }
    })?;
    for s in &mut out {
        s.ratio_max = s.d1_max / s.d2_max;
        s.ratio_mean = s.d1_mean / s.d2_mean;
    }
    Ok(out)
}

/// Faces by segment.
fn members(label: &[u32]) -> Result<Vec<Vec<u32>>> {
    let n = label.iter().map(|l| *l as usize + 1).max().unwrap_or(0);
    let mut out: Vec<Vec<u32>> = try_vec(n, "segments")?;
    out.resize_with(n, Vec::new);
    for (f, &l) in label.iter().enumerate() {
        out[l as usize].push(f as u32);
    }
    Ok(out)
}

/// Area, centroid, bounding box, handles.
fn shape(positions: &[Vec3], triangles: &[[u32; 3]], faces: &[u32]) -> Segment {
    let mut out = Segment::empty();
    out.faces = faces.len() as u32;
    let mut own: Vec<[u32; 3]> = Vec::with_capacity(faces.len());
    let mut moment = [0.0; 3];
    for &f in faces {
        let t = triangles[f as usize];
        let p = corners(positions, t);
        let a = area(p);
        out.area += a;
        moment = add(moment, scale(add(add(p[0], p[1]), p[2]), a / 3.0));
        own.push(t);
    }
    let (lo, hi) = bounding_box(own.iter().flatten().map(|&v| positions[v as usize]));
    out.bounds = [lo, hi];
    out.centroid = if out.area > 0.0 { scale(moment, 1.0 / out.area) } else { scale(add(lo, hi), 0.5) };
    out.handles = handles(&own);
    out
}

/// Boundary lengths and neighbours.
fn borders(mesh: &TriMesh, label: &[u32], out: &mut [Segment]) -> Result<()> {
    let topology = mesh.topology()?;
    let mut pairs: Vec<(u32, u32)> = Vec::new();
    let mut around: Vec<u32> = Vec::new();
    for e in 0..topology.edge_count() as u32 {
        let sides = topology.halfedges(e);
        around.clear();
        around.extend(sides.iter().map(|h| label[*h as usize / 3]));
        around.sort_unstable();
        around.dedup();
        if around.len() < 2 && sides.len() > 1 {
            continue;
        }
        let h = sides[0] as usize;
        let t = mesh.triangles()[h / 3];
        let [a, b] = [t[h % 3], t[(h + 1) % 3]].map(|v| mesh.positions()[v as usize]);
        for &s in &around {
            out[s as usize].boundary_length += distance(a, b);
            pairs.extend(around.iter().filter(|r| **r != s).map(|&r| (s, r)));
        }
        if pairs.len() > 1 << 16 {
            pairs.sort_unstable();
            pairs.dedup();
        }
    }
    pairs.sort_unstable();
    pairs.dedup();
    pairs.iter().for_each(|&(s, r)| out[s as usize].neighbours.push(r));
    Ok(())
}

/// A place where D2 was measured.
struct Sample {
    width: f64,
    area: f64,
    /// Its number among all places.
    at: u32,
    /// The sphere is held by two walls of the segment itself.
    own: bool,
}

/// D2 of the whole solid at points spread over the segments. On the fillet of a pin, and on a plate below a pin, the
/// sphere measures the plate or the pin: where it is held by another segment's wall it counts only if there is no other.
fn widths(
    mesh: &TriMesh,
    triangles: &[[u32; 3]],
    rays: &RayMesh,
    (members, label): (&[Vec<u32>], &[u32]),
    out: &mut [Segment],
    job: &Job,
) -> Result<()> {
    let total: f64 = out.iter().map(|s| s.area).sum();
    // --- places spread evenly over each segment
    let mut first = try_vec(members.len() + 1, "widths of segments")?;
    let mut spots = Spots::default();
    for (segment, faces) in out.iter().zip(members) {
        first.push(spots.points.len());
        let wanted = PLACES.0 + (PLACES.1 as f64 * segment.area / total.max(f64::MIN_POSITIVE)) as usize;
        let every = segment.area / wanted as f64;
        let mut passed = 0.5 * every;
        for &f in faces {
            spots.put(f, corners(mesh.positions(), triangles[f as usize]), every, &mut passed);
        }
    }
    let Spots { points, faces: parents, areas } = spots;
    first.push(points.len());
    // --- a few of them first: where all walls are equally wide, those will do
    job.begin(Stage::Thickness, 0.5, 0.7, 2 * points.len() as u64)?;
    let walls = WallMesh::new(mesh.positions(), triangles, job)?;
    let measured = |of: &[usize]| -> Result<Vec<Sample>> {
        let at: Vec<Vec3> = of.iter().map(|&i| points[i]).collect();
        let on: Vec<u32> = of.iter().map(|&i| parents[i]).collect();
        let found = walls.point_widths(&at, &on, job)?;
        // from the sphere's centre straight away from the point to the wall that holds it
        let ways: Vec<Vec3> = found.centre.iter().zip(&at).map(|(c, p)| sub(*c, *p)).collect();
        let met = first_met(rays, &found.centre, &ways, None, job)?;
        let sample = |(k, &i): (usize, &usize)| {
            let own = label.get(met[k].face as usize) == label.get(parents[i] as usize);
            Sample { width: found.width[k], area: areas[i], at: i as u32, own }
        };
        Ok(of.iter().enumerate().map(sample).collect())
    };
    let few: Vec<usize> = first.windows(2).flat_map(|w| (w[0]..w[1]).step_by(FEW)).collect();
    let mut samples = by_segment(measured(&few)?, &first);
    let uneven: Vec<bool> = samples.par_iter().map(|s| !is_even(s)).collect();
    let rest = (0..out.len()).filter(|&k| uneven[k]).flat_map(|k| first[k]..first[k + 1]);
    let rest: Vec<usize> = rest.filter(|i| few.binary_search(i).is_err()).collect();
    for (all, more) in samples.iter_mut().zip(by_segment(measured(&rest)?, &first)) {
        all.extend(more);
    }
    for (segment, samples) in out.iter_mut().zip(samples) {
        spread(segment, counted(samples), &points);
    }
    Ok(())
}

/// Samples by segment; those of segment k are numbered from `first[k]`.
fn by_segment(samples: Vec<Sample>, first: &[usize]) -> Vec<Vec<Sample>> {
    let mut out: Vec<Vec<Sample>> = Vec::new();
    out.resize_with(first.len() - 1, Vec::new);
    for sample in samples {
        out[first.partition_point(|&i| i <= sample.at as usize) - 1].push(sample);
    }
    out
}

/// The samples that count, by width.
fn counted(mut samples: Vec<Sample>) -> Vec<Sample> {
    samples.retain(|s| s.width.is_finite());
    if samples.iter().any(|s| s.own) {
        samples.retain(|s| s.own);
    }
    samples.sort_unstable_by(|a, b| a.width.total_cmp(&b.width).then(a.at.cmp(&b.at)));
    samples
}

/// Whether no wall is wider than half of them are, and hardly one narrower.
fn is_even(samples: &[Sample]) -> bool {
    let mut width: Vec<f64> = samples.iter().filter(|s| s.own && s.width.is_finite()).map(|s| s.width).collect();
    width.sort_unstable_by(f64::total_cmp);
    let n = width.len();
    n >= ENOUGH && width[n - 1] <= (1.0 + EVEN) * width[n / 2] && width[n / 20] >= (1.0 - EVEN) * width[n / 2]
}

/// Largest, smallest, mean and median of D2, from samples by width.
fn spread(segment: &mut Segment, samples: Vec<Sample>, points: &[Vec3]) {
    let total: f64 = samples.iter().map(|s| s.area).sum();
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else { return };
    segment.d2_mean = samples.iter().map(|s| s.width * s.area).sum::<f64>() / total;
    (segment.d2_min, segment.d2_min_at) = (first.width, points[first.at as usize]);
    (segment.d2_max, segment.d2_max_at) = (last.width, points[last.at as usize]);
    let mut below = 0.0;
    let half = samples.iter().find(|s| {
        below += s.area;
        below >= 0.5 * total
    });
    segment.d2_median = half.unwrap_or(last).width;
}

/// D1 on the segment's own surface.
fn lengths(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    faces: &[u32],
    segment: &mut Segment,
    total_area: f64,
    job: &Job,
) -> Result<()> {
    let (mut own_positions, mut own) = extract(positions, triangles, faces)?;
    let share = segment.area / total_area.max(f64::MIN_POSITIVE);
    let target = VERTICES.0 + (VERTICES.1 as f64 * share) as usize;
    if own.len() > FINE * target {
        let size = distance(segment.bounds[0], segment.bounds[1]);
        let wanted = SimplifyOptions { target_faces: COARSE * target, max_error: FLAT * size };
        let proxy = Proxy::new(&own_positions, &own, &wanted, job)?;
        (own_positions, own) = (proxy.positions, proxy.triangles);
    }
    let wanted = SurfaceOptions { target_vertices: target, edge_length: None, max_added: 4 * target };
    let surface = AnalysisSurface::refine(&own_positions, &own, &wanted, job)?;
    let solver = HeatSolver::new(&surface.intrinsic(job)?, HeatOptions::default(), job)?;
    let found = reach(&solver, &surface.positions, job)?;
    if found.ends.contains(&NONE) {
        return Ok(());
    }
    segment.d1_max = found.longest;
    segment.d1_ends = found.ends.map(|v| surface.positions[v as usize]);
    let (mut sum, mut weight) = (0.0, 0.0);
    for &t in &surface.triangles {
        let a = area(corners(&surface.positions, t));
        let d = t.map(|v| found.distance[v as usize]);
        if d.iter().all(|d| d.is_finite()) {
            sum += a * (d[0] + d[1] + d[2]) / 3.0;
            weight += a;
        }
    }
    segment.d1_mean = if weight > 0.0 { sum / weight } else { f64::NAN };

    // --- closed ring
    if segment.handles > 0 {
        let mut scratch = solver.scratch()?;
        let field = solver.solve(&[&[found.ends[0]]], &mut scratch)?;
        segment.ring = is_ring(&surface.positions, &surface.triangles, field);
        if segment.ring {
            segment.loop_length = 2.0 * segment.d1_max;
        }
    }
    Ok(())
}

/// The faces as a mesh of their own.
fn extract(positions: &[Vec3], triangles: &[[u32; 3]], faces: &[u32]) -> Result<(Vec<Vec3>, Vec<[u32; 3]>)> {
    let mut used: Vec<u32> = try_vec(3 * faces.len(), "a segment's surface")?;
    used.extend(faces.iter().flat_map(|&f| triangles[f as usize]));
    used.sort_unstable();
    used.dedup();
    let mut own_positions = try_vec(used.len(), "a segment's surface")?;
    own_positions.extend(used.iter().map(|&v| positions[v as usize]));
    let mut own = try_vec(faces.len(), "a segment's surface")?;
    // every corner is among those collected
    own.extend(faces.iter().map(|&f| triangles[f as usize].map(|v| used.binary_search(&v).unwrap_or(0) as u32)));
    Ok((own_positions, own))
}
