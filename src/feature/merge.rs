//! Segments that are one wall: what lies back to back; and strips of surface.
//!
//! A cut along creases parts the two sides of a membrane in a frame, and the floor of a pocket from the bottom below it.
//! Across them, the spheres that measure their width touch the other side. A strip between two creases in a groove, and a
//! chamfer, has no other side of its own: it is part of what lies behind it. So is the fillet around a foot.

use super::widths::Place;
use crate::error::{Result, try_filled};
use crate::mesh::NONE;
use crate::mesh::measure::{Vec3, add, area_vector, corners, norm};
use crate::mesh::sets::Sets;
use crate::segment::dual::Dual;
use std::collections::BTreeMap;

/// Share of a segment's area that must face another for both to be one wall.
const FACING: f64 = 0.5;
/// A sheet without a side of its own across belongs to what it faces with more than this share of its area.
const STRIP: f64 = 0.2;
/// What has both sides of its width on less than this share of its area has no thickness of its own.
const OWN: f64 = 0.1;
/// What turns outward within by this angle (radians), as if all along its border, stands out, and is no strip.
const RAISED: f64 = 0.25;
/// A segment whose area vector is this share of its area is a sheet: it has one side only.
const SHEET: f64 = 0.9;

/// Segments joined: a new label for every old one, numbered by first old one. `places` as measured with `label`.
///
/// # Errors
/// [`crate::error::Error::NoMemory`].
pub fn back_to_back(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    dual: &Dual,
    label: &[u32],
    places: &[Place],
) -> Result<Vec<u32>> {
    let n = label.iter().map(|l| *l as usize + 1).max().unwrap_or(0);
    let mut vector = vec![[0.0; 3]; n];
    let mut area = vec![0.0; n];
    for (f, &t) in triangles.iter().enumerate() {
        let v = area_vector(corners(positions, t));
        vector[label[f] as usize] = add(vector[label[f] as usize], v);
        area[label[f] as usize] += norm(v);
    }
    let mut measured = vec![0.0; n];
    let mut facing: BTreeMap<[u32; 2], f64> = BTreeMap::new();
    for p in places.iter().filter(|p| p.width.is_finite()) {
        let from = label[p.face as usize];
        measured[from as usize] += p.area;
        if p.facing != NONE {
            *facing.entry([from, label[p.facing as usize]]).or_insert(0.0) += p.area;
        }
    }
    let mostly = |a: u32, b: u32| {
        let share = facing.get(&[a, b]).copied().unwrap_or(0.0);
        a != b && share > FACING * measured[a as usize]
    };
    let sheet = |a: u32| norm(vector[a as usize]) > SHEET * area[a as usize];
    let mut sets = Sets::new(n)?;
    let mut joined = vec![false; n];
    for &[a, b] in facing.keys() {
        if mostly(a, b) && (sheet(a) || mostly(b, a)) {
            sets.join(a, b);
            [a, b].into_iter().for_each(|k| joined[k as usize] = true);
        }
    }
    // --- a sheet that is one with none, and what has no thickness, is the surface of what lies behind most of it
    let own = |a: u32| facing.get(&[a, a]).copied().unwrap_or(0.0);
    let raised = raised(dual, label, n)?;
    let mut most: BTreeMap<u32, (f64, u32)> = BTreeMap::new();
    for (&[a, b], &share) in &facing {
        let whole = measured[a as usize];
        let surface = (sheet(a) && share > STRIP * whole)
            || (!raised[a as usize] && own(a) < OWN * whole && share > FACING * whole);
        let larger = a != b && area[b as usize] > area[a as usize];
        if larger && surface && most.get(&a).is_none_or(|m| share > m.0) {
            most.insert(a, (share, b));
        }
    }
    let alone: Vec<(u32, u32)> =
        most.into_iter().filter(|(a, _)| !joined[*a as usize]).map(|(a, m)| (a, m.1)).collect();
    alone.into_iter().for_each(|(a, b)| sets.join(a, b));
    Ok((0..n as u32).map(|a| sets.root(a)).collect())
}

/// Whether segments stand out: they turn outward within, as a boss does over its rim, more than inward.
fn raised(dual: &Dual, label: &[u32], n: usize) -> Result<Vec<bool>> {
    let mut sums = try_filled(n, (0.0, 0.0), "features")?;
    for step in &dual.steps {
        let [a, b] = step.faces.map(|f| label[f as usize] as usize);
        if a == b {
            sums[a].0 -= step.length * step.turn;
        } else {
            [a, b].into_iter().for_each(|k| sums[k].1 += step.length);
        }
    }
    Ok(sums.into_iter().map(|(outward, border)| outward > RAISED * border).collect())
}
