//! Walls that no crease parts from their body: where the width of the part jumps.
//!
//! A wall that stands flush with the side of its body is joined to it by a flat face, and a crease on its other side
//! only. Its width tells it apart.

use super::widths::Place;
use crate::mesh::measure::{area, corners};
use crate::mesh::{NONE, Topology};
use std::collections::BTreeMap;

/// Neighbouring faces whose widths differ by more than this are on two sides of a jump.
const SMOOTH: f64 = 0.6;
/// What is split off is thinner than this share of the rest.
const THIN: f64 = 0.4;
/// Share of its area whose other side must belong to it, too.
const OWN: f64 = 0.6;
/// It is so many times as large as its thickness squared, at least.
const LARGE: f64 = 8.0;

/// Labels with the thin walls of thick features split off: the label of each face, new ones after the old. `places` as
/// measured on these faces.
pub fn at_jumps(
    positions: &[[f64; 3]],
    triangles: &[[u32; 3]],
    topology: &Topology,
    label: &[u32],
    places: &[Place],
) -> Vec<u32> {
    // --- the width of every face that has places
    let mut sums = vec![(0.0, 0.0); triangles.len()];
    for p in places.iter().filter(|p| p.width.is_finite()) {
        let s = &mut sums[p.face as usize];
        *s = (s.0 + p.area * p.width, s.1 + p.area);
    }
    let width: Vec<f64> = sums.iter().map(|s| if s.1 > 0.0 { s.0 / s.1 } else { f64::NAN }).collect();
    // --- pieces over which it does not jump; faces without places go with any neighbour
    let mut root: Vec<u32> = (0..triangles.len() as u32).collect();
    let mut late: Vec<[u32; 2]> = Vec::new();
    for e in 0..topology.edge_count() as u32 {
        let [h, g] = *topology.halfedges(e) else { continue };
        let (f, g) = (h / 3, g / 3);
        if label[f as usize] != label[g as usize] {
            continue;
        }
        let (a, b) = (width[f as usize], width[g as usize]);
        if a.is_nan() || b.is_nan() {
            late.push([f, g]);
        } else if a.min(b) >= SMOOTH * a.max(b) {
            join(&mut root, f, g);
        }
    }
    let mut known: Vec<bool> = width.iter().map(|w| w.is_finite()).collect();
    for _ in 0..8 {
        for &[f, g] in &late {
            if known[f as usize] != known[g as usize] {
                join(&mut root, f, g);
                (known[f as usize], known[g as usize]) = (true, true);
            }
        }
    }
    let piece: Vec<u32> = (0..triangles.len() as u32).map(|f| find(&mut root, f)).collect();
    split_off(positions, triangles, label, &piece, places)
}

/// A piece of a feature.
#[derive(Default, Clone, Copy)]
struct Piece {
    label: u32,
    area: f64,
    /// Area of its places, that times their widths, and the area of those whose other side is the piece's own.
    measured: (f64, f64, f64),
}

fn split_off(
    positions: &[[f64; 3]],
    triangles: &[[u32; 3]],
    label: &[u32],
    piece: &[u32],
    places: &[Place],
) -> Vec<u32> {
    let mut pieces: BTreeMap<u32, Piece> = BTreeMap::new();
    for (f, &t) in triangles.iter().enumerate() {
        let p = pieces.entry(piece[f]).or_default();
        (p.label, p.area) = (label[f], p.area + area(corners(positions, t)));
    }
    for place in places.iter().filter(|p| p.width.is_finite()) {
        let own = place.facing != NONE && piece[place.facing as usize] == piece[place.face as usize];
        let m = &mut pieces.entry(piece[place.face as usize]).or_default().measured;
        *m = (m.0 + place.area, m.1 + place.area * place.width, m.2 + if own { place.area } else { 0.0 });
    }
    // --- by feature the width of its largest piece
    let mut largest: BTreeMap<u32, Piece> = BTreeMap::new();
    for p in pieces.values().filter(|p| p.measured.0 > 0.0) {
        let most = largest.entry(p.label).or_insert(*p);
        if p.area > most.area {
            *most = *p;
        }
    }
    let mean = |p: &Piece| p.measured.1 / p.measured.0;
    let mut next = label.iter().map(|l| l + 1).max().unwrap_or(0);
    let mut new: BTreeMap<u32, u32> = BTreeMap::new();
    for (&k, p) in pieces.iter().filter(|p| p.1.measured.0 > 0.0) {
        let whole = &largest[&p.label];
        let thin = mean(p) < THIN * mean(whole) && p.measured.2 >= OWN * p.measured.0;
        if thin && p.area >= LARGE * mean(p) * mean(p) {
            new.insert(k, next);
            next += 1;
        }
    }
    piece.iter().zip(label).map(|(p, &l)| new.get(p).copied().unwrap_or(l)).collect()
}

fn join(root: &mut [u32], f: u32, g: u32) {
    let (a, b) = (find(root, f), find(root, g));
    root[a.max(b) as usize] = a.min(b);
}

fn find(root: &mut [u32], mut f: u32) -> u32 {
    while root[f as usize] != f {
        root[f as usize] = root[root[f as usize] as usize];
        f = root[f as usize];
    }
    f
}
