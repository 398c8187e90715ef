//! Segments that are one thing: what lies back to back, and strips of its surface.
//!
//! A cut along creases parts the two sides of a membrane in a frame, and the floor of a pocket from the bottom below it.
//! Across them, the spheres that measure their width touch the other side. A strip between two creases in a groove, and
//! a chamfer, has no opposite side of its own: it is part of what lies behind it.

use super::widths::Place;
use crate::mesh::NONE;
use crate::mesh::measure::{Vec3, add, area_vector, corners, norm};
use std::collections::BTreeMap;

/// Share of a segment's area that must face another for both to be one wall.
const FACING: f64 = 0.5;
/// A segment whose area vector is this share of its area is a sheet: it has one side only.
const SHEET: f64 = 0.9;
/// Something of which less than this share of the area faces its own other side is a strip of something else.
const STRIP: f64 = 0.2;

/// Segments joined: a new label for every old one, named by one of them. `places` as measured with `label`.
pub fn back_to_back(positions: &[Vec3], triangles: &[[u32; 3]], label: &[u32], places: &[Place]) -> Vec<u32> {
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
    let mut root: Vec<u32> = (0..n as u32).collect();
    for &[a, b] in facing.keys() {
        if mostly(a, b) && (sheet(a) || mostly(b, a)) {
            let (a, b) = (find(&root, a), find(&root, b));
            root[a.max(b) as usize] = a.min(b);
        }
    }
    let root = (0..n as u32).map(|a| find(&root, a)).collect();
    strips(root, &area, &measured, &facing)
}

/// Strips joined with what they face most, the smallest first. By segment: what it is part of, its area, the area of its
/// places; by two segments the area of the places of the first that face the second.
fn strips(mut root: Vec<u32>, area: &[f64], measured: &[f64], facing: &BTreeMap<[u32; 2], f64>) -> Vec<u32> {
    let n = root.len();
    let (mut whole, mut places) = (vec![0.0; n], vec![0.0; n]);
    for (a, &r) in root.iter().enumerate() {
        whole[r as usize] += area[a];
        places[r as usize] += measured[a];
    }
    let mut faced: BTreeMap<[u32; 2], f64> = BTreeMap::new();
    for (&[a, b], share) in facing {
        *faced.entry([root[a as usize], root[b as usize]]).or_insert(0.0) += share;
    }
    let mut order: Vec<u32> = (0..n as u32).filter(|&r| root[r as usize] == r && places[r as usize] > 0.0).collect();
    order.sort_by(|&a, &b| whole[a as usize].total_cmp(&whole[b as usize]).then(b.cmp(&a)));
    for r in order {
        let own = faced.get(&[r, r]).copied().unwrap_or(0.0);
        if own >= STRIP * places[r as usize] {
            continue;
        }
        let others = faced.range([r, 0]..=[r, u32::MAX]).filter(|o| whole[o.0[1] as usize] > whole[r as usize]);
        if let Some((&[_, most], _)) = others.max_by(|a, b| a.1.total_cmp(b.1).then(b.0.cmp(a.0))) {
            root[r as usize] = most;
        }
    }
    (0..n as u32).map(|a| find(&root, a)).collect()
}

fn find(root: &[u32], mut a: u32) -> u32 {
    while root[a as usize] != a {
        a = root[a as usize];
    }
    a
}
