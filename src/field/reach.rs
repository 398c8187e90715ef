//! The longest way across a part: D1 of the part as a whole. Its ends may lie anywhere, not only at vertices: on a long
//! box they are the middles of the two ends.

use super::Reach;
use crate::error::{Result, try_vec};
use crate::geodesic::exact::SurfacePoint;
use crate::geodesic::{Eccentricity, ExactFields};
use crate::job::Job;
use crate::mesh::NONE;
use crate::mesh::measure::{Vec3, add, at_weights, barycentric, corners, cross, distance, dot, norm, scale, sub};
use crate::mesh::simplify::nearest_in_triangle;
use crate::mesh::surface::{AnalysisSurface, SurfaceOptions};

/// Points inside faces between which it is sought.
const SAMPLES: usize = 2_000;
/// Far ends from which the sweeps start.
const STARTS: usize = 4;
/// Then its ends are moved about, within this many times the distance of the samples at first, ...
const AROUND: f64 = 2.0;
/// ... and a quarter of that each time.
const ROUNDS: usize = 3;
/// So many points each way are tried in the disc around an end.
const GRID: i32 = 4;
/// The most points that are tried at a time.
const TRIED: usize = 2_000;

/// The longest distance that any field of `d1` holds.
pub(super) fn farthest_apart(d1: &Eccentricity, positions: &[Vec3]) -> Reach {
    let longest = d1.longest.iter().fold((0.0, [NONE; 2]), |m, x| if x.0 > m.0 { *x } else { m });
    let place = |v: u32| positions.get(v as usize).copied().unwrap_or([f64::NAN; 3]);
    Reach { length: longest.0, ends: longest.1.map(place) }
}

/// The longest shortest way of the mesh that was `solved` for, as far as sweeps find it, or of the fields of `d1`.
pub(super) fn longest_way(
    fields: &ExactFields,
    positions: &[Vec3],
    solved: (&[Vec3], &[[u32; 3]]),
    d1: &Eccentricity,
    job: &Job,
) -> Result<Reach> {
    // --- from far ends of the vertices with the largest D1
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
    let known = farthest_apart(d1, positions);
    let (samples, spacing) = samples(solved, job)?;
    let Some((mut length, mut ends)) = fields.diameter(&starts, &samples, job)? else { return Ok(known) };

    // --- each end to where the way is longest, between the samples
    let mut radius = AROUND * spacing;
    for _ in 0..ROUNDS {
        for k in [1, 0] {
            let points = around(solved, ends[k], radius)?;
            if let Some((d, at)) = fields.farthest(ends[1 - k], &points, job)? {
                if d > length {
                    (length, ends[k]) = (d, points[at]);
                }
            }
        }
        radius *= 0.25;
    }
    Ok(if length > known.length { Reach { length, ends: ends.map(|p| place(solved, p)) } } else { known })
}

/// Where a point of the surface is.
fn place((positions, triangles): (&[Vec3], &[[u32; 3]]), point: SurfacePoint) -> Vec3 {
    match point {
        SurfacePoint::Vertex(v) => positions[v as usize],
        SurfacePoint::Face { face, weights } => {
            let sum: f64 = weights.iter().sum();
            scale(at_weights(corners(positions, triangles[face as usize]), weights), 1.0 / sum)
        }
    }
}

/// Points spread over the inside of the faces, and how far from a point of the surface the nearest of them may be.
fn samples((positions, triangles): (&[Vec3], &[[u32; 3]]), job: &Job) -> Result<(Vec<SurfacePoint>, f64)> {
    let options = SurfaceOptions { target_vertices: SAMPLES, max_added: 2 * SAMPLES, ..SurfaceOptions::default() };
    let surface = AnalysisSurface::refine(positions, triangles, &options, job)?;
    let mut points = try_vec(surface.vertex_face.len(), "samples")?;
    points.extend(surface.added(positions, triangles).map(|(face, weights)| SurfacePoint::Face { face, weights }));
    Ok((points, surface.spacing))
}

/// Points on the faces within `radius` of one: a grid on each large face, the middle of each small one.
fn around(mesh: (&[Vec3], &[[u32; 3]]), point: SurfacePoint, radius: f64) -> Result<Vec<SurfacePoint>> {
    let centre = place(mesh, point);
    let mut out = try_vec(TRIED, "points around an end")?;
    for (face, &t) in mesh.1.iter().enumerate() {
        let triangle = corners(mesh.0, t);
        let (weights, d2) = nearest_in_triangle(triangle, centre);
        if out.len() + (2 * GRID as usize + 1).pow(2) > TRIED {
            break;
        }
        // also false for a NaN
        if !(d2 <= radius * radius) {
            continue;
        }
        let at = |weights| SurfacePoint::Face { face: face as u32, weights };
        let [a, b, c] = triangle;
        if distance(a, b).max(distance(b, c)).max(distance(c, a)) < radius / GRID as f64 {
            out.push(at([1.0 / 3.0; 3]));
            continue;
        }
        let normal = cross(sub(b, a), sub(c, a));
        let along = sub(b, a);
        let across = cross(normal, along);
        let (n, m) = (norm(along), norm(across));
        if !(n > 0.0 && m > 0.0) {
            continue;
        }
        let foot = at_weights(triangle, weights);
        let inside = |u: Vec3, v: Vec3, p: Vec3| dot(cross(sub(u, p), sub(v, p)), normal) >= 0.0;
        for (i, j) in (-GRID..=GRID).flat_map(|i| (-GRID..=GRID).map(move |j| (i, j))) {
            let [i, j] = [i, j].map(|k| radius * k as f64 / GRID as f64);
            let p = add(foot, add(scale(along, i / n), scale(across, j / m)));
            if inside(a, b, p) && inside(b, c, p) && inside(c, a, p) {
                out.push(at(barycentric(triangle, p)));
            }
        }
    }
    Ok(out)
}
