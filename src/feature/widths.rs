//! How wide the features are: spheres between their walls, at places spread over the surface.

use super::skin::Skin;
use crate::error::{Result, try_vec};
use crate::job::Job;
use crate::mesh::measure::{Vec3, add, area, corners, norm, scale, sub};
use crate::segment::spots::Spots;
use crate::thickness::bvh::RayMesh;
use crate::thickness::chords::first_met;
use crate::thickness::wall::WallMesh;

/// Places where the width is measured: at least in each part, ...
const LEAST: f64 = 60.0;
/// ... and for the whole, so many a face, within these.
const PLACES: (f64, f64, f64) = (20.0, 1500.0, 6000.0);

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

/// The width of the solid, which `rays` and `walls` are of, at places spread over the parts that `label` gives to the
/// faces of its skin, in the order of these faces: evenly over each part, [`LEAST`] in the smallest.
///
/// # Errors
/// Those of [`WallMesh::new`] and [`WallMesh::point_widths`].
pub fn places(skin: &Skin<'_>, rays: &RayMesh, walls: &WallMesh, label: &[u32], job: &Job) -> Result<Vec<Place>> {
    let (positions, triangles) = (skin.positions, skin.triangles);
    let parts = label.iter().map(|l| *l as usize + 1).max().unwrap_or(0);
    let mut part_area = vec![0.0; parts];
    for (f, &t) in triangles.iter().enumerate() {
        part_area[label[f] as usize] += area(corners(positions, t));
    }
    let total: f64 = part_area.iter().sum();
    let whole = (PLACES.0 * triangles.len() as f64).clamp(PLACES.1, PLACES.2);
    let every = |a: &f64| a / (LEAST + (whole * a / total.max(f64::MIN_POSITIVE)).floor());
    let every: Vec<f64> = part_area.iter().map(every).collect();
    // --- walk over the faces, and put a place whenever so much area was passed
    let mut passed: Vec<f64> = every.iter().map(|e| 0.5 * e).collect();
    let mut spots = Spots::default();
    for (f, (&l, &t)) in label.iter().zip(triangles).enumerate() {
        spots.put(f as u32, corners(positions, t), every[l as usize], &mut passed[l as usize]);
    }
    let Spots { points, faces, areas } = spots;
    // --- spheres, and the walls across
    let mut solid = try_vec(faces.len(), "places")?;
    solid.extend(faces.iter().map(|&f| skin.parent(f)));
    let found = walls.point_widths(&points, &solid, job)?;
    let ways: Vec<Vec3> = found.centre.iter().zip(&points).map(|(c, p)| sub(*c, *p)).collect();
    let met = first_met(rays, &found.centre, &ways, None, job)?;
    let mut out = try_vec(points.len(), "places")?;
    for i in 0..points.len() {
        let way = norm(ways[i]).max(f64::MIN_POSITIVE);
        let across = add(found.centre[i], scale(ways[i], met[i].distance / way));
        let facing = skin.at(met[i].face, across);
        out.push(Place { at: points[i], face: faces[i], area: areas[i], width: found.width[i], across, facing });
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
