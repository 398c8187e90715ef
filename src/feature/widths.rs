//! How wide the features are: spheres between their walls, at places spread over the surface.

use crate::error::{Result, try_vec};
use crate::job::Job;
use crate::mesh::measure::{Vec3, add, area, corners, norm, scale, sub};
use crate::mesh::surface::{AnalysisSurface, SurfaceOptions};
use crate::thickness::bvh::RayMesh;
use crate::thickness::chords::first_met;
use crate::thickness::wall::WallMesh;

/// Places where the width is measured: at least in each part, and for the whole.
const PLACES: (usize, usize) = (60, 6000);
/// Vertices of the surface that the places are chosen on.
const VERTICES: usize = 25_000;
/// The most places of one face.
const MOST: usize = 4096;

/// A place where the width was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Where.
    pub at: Vec3,
    /// The face it lies on.
    pub face: u32,
    /// Area that it stands for.
    pub area: f64,
    /// Width there; NaN where there is none.
    pub width: f64,
    /// Where the sphere of that width is met by the wall across.
    pub across: Vec3,
    /// The face of that wall; [`crate::mesh::NONE`] where there is none.
    pub facing: u32,
}

/// The width of the solid at places spread over the parts that `label` gives to its faces, in the order of the faces:
/// evenly over each part, [`PLACES`].0 in the smallest.
///
/// # Errors
/// Those of [`WallMesh::new`] and [`WallMesh::point_widths`].
pub fn places(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    rays: &RayMesh,
    walls: &WallMesh,
    label: &[u32],
    job: &Job,
) -> Result<Vec<Place>> {
    let wanted = SurfaceOptions { target_vertices: VERTICES, ..SurfaceOptions::default() };
    let surface = AnalysisSurface::refine(positions, triangles, &wanted, job)?;
    let parts = label.iter().map(|l| *l as usize + 1).max().unwrap_or(0);
    let mut part_area = vec![0.0; parts];
    for (f, &t) in triangles.iter().enumerate() {
        part_area[label[f] as usize] += area(corners(positions, t));
    }
    let total: f64 = part_area.iter().sum();
    let every: Vec<f64> = part_area
        .iter()
        .map(|a| a / (PLACES.0 as f64 + (PLACES.1 as f64 * a / total.max(f64::MIN_POSITIVE)).floor()))
        .collect();
    // --- walk over the faces, and put a place whenever so much area was passed
    let mut passed: Vec<f64> = every.iter().map(|e| 0.5 * e).collect();
    let (mut points, mut faces) = (try_vec::<Vec3>(PLACES.1, "places")?, try_vec::<u32>(PLACES.1, "places")?);
    let mut weights: Vec<f64> = try_vec(PLACES.1, "places")?;
    for (f, &l) in label.iter().enumerate() {
        let (every, passed) = (every[l as usize], &mut passed[l as usize]);
        for child in surface.children(f).take(MOST) {
            let [a, b, c] = corners(&surface.positions, surface.triangles[child]);
            *passed += area([a, b, c]);
            if every > 0.0 && *passed >= every {
                let times = (*passed / every).floor();
                *passed -= times * every;
                points.push(scale(add(add(a, b), c), 1.0 / 3.0));
                faces.push(f as u32);
                weights.push(times * every);
            }
        }
    }
    drop(surface);
    // --- spheres, and the walls across
    let found = walls.point_widths(&points, &faces, job)?;
    let ways: Vec<Vec3> = found.centre.iter().zip(&points).map(|(c, p)| sub(*c, *p)).collect();
    let met = first_met(rays, &found.centre, &ways, None, job)?;
    let mut out = try_vec(points.len(), "places")?;
    for i in 0..points.len() {
        let way = norm(ways[i]).max(f64::MIN_POSITIVE);
        let across = add(found.centre[i], scale(ways[i], met[i].distance / way));
        let place = Place {
            at: points[i],
            face: faces[i],
            area: weights[i],
            width: found.width[i],
            across,
            facing: met[i].face,
        };
        out.push(place);
    }
    Ok(out)
}

/// The width that a share `q` of the area of the places is not above, and the place; none if no place has a width.
pub fn quantile<'a>(places: &mut [&'a Place], q: f64) -> Option<&'a Place> {
    places.sort_by(|a, b| a.width.total_cmp(&b.width).then_with(|| order(a.at, b.at)));
    let total: f64 = places.iter().map(|p| p.area).sum();
    let mut below = 0.0;
    let found = places.iter().find(|p| {
        below += p.area;
        below >= q * total
    });
    found.or(places.last()).copied()
}

fn order(a: Vec3, b: Vec3) -> std::cmp::Ordering {
    a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])).then(a[2].total_cmp(&b[2]))
}
