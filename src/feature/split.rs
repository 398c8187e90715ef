//! Walls that no crease parts from their body: where the width of the part jumps.
//!
//! A wall that stands flush with the side of its body is joined to it by a flat face, and a crease on its other side
//! only. Its width tells it apart.

use super::widths::Place;
use crate::error::Result;
use crate::mesh::measure::{area, corners, distance};
use crate::mesh::sets::Sets;
use crate::mesh::{NONE, Topology};
use std::collections::BTreeMap;

/// Neighbouring faces whose widths differ by more than this are on two sides of a jump.
const SMOOTH: f64 = 0.6;
/// What is split off is thinner than this share of the rest.
const THIN: f64 = 0.4;
/// Share of its area whose other side must belong to it, too.
const OWN: f64 = 0.6;
/// What it parted are features of their own if the smaller is at least this share of the larger.
const PART: f64 = 0.1;
/// It is so many times as large as its thickness squared, at least.
const LARGE: f64 = 8.0;

/// Labels with the thin walls of thick features split off: the label of each face, new ones after the old. `places` as
/// measured on these faces. What is smaller than `min_area` is not split off.
///
/// # Errors
/// [`crate::error::Error::NoMemory`].
pub fn at_jumps(
    positions: &[[f64; 3]],
    triangles: &[[u32; 3]],
    topology: &Topology,
    label: &[u32],
    places: &[Place],
    min_area: f64,
) -> Result<Vec<u32>> {
    // --- the width of every face that has places
    let mut sums = vec![(0.0, 0.0); triangles.len()];
    for p in places.iter().filter(|p| p.width.is_finite()) {
        let s = &mut sums[p.face as usize];
        *s = (s.0 + p.area * p.width, s.1 + p.area);
    }
    let width: Vec<f64> = sums.iter().map(|s| if s.1 > 0.0 { s.0 / s.1 } else { f64::NAN }).collect();
    // --- pieces over which it does not jump
    let mut sets = Sets::new(triangles.len())?;
    let mut unmeasured: Vec<(f64, [u32; 2])> = Vec::new();
    for e in 0..topology.edge_count() as u32 {
        let [h, g] = *topology.halfedges(e) else { continue };
        let (f, g) = (h / 3, g / 3);
        if label[f as usize] != label[g as usize] {
            continue;
        }
        let (a, b) = (width[f as usize], width[g as usize]);
        if a.is_nan() || b.is_nan() {
            unmeasured.push((common_edge(positions, triangles[f as usize], triangles[g as usize]), [f, g]));
        } else if a.min(b) >= SMOOTH * a.max(b) {
            sets.join(f, g);
        }
    }
    // --- faces without places go where they have most of their border: slivers beside a wall do not hang on its foot
    unmeasured.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut known: Vec<bool> = width.iter().map(|w| w.is_finite()).collect();
    for (_, [f, g]) in unmeasured {
        let (a, b) = (sets.root(f), sets.root(g));
        if !(known[a as usize] && known[b as usize]) {
            let either = known[a as usize] || known[b as usize];
            sets.join(a, b);
            known[sets.root(a) as usize] = either;
        }
    }
    let piece: Vec<u32> = (0..triangles.len() as u32).map(|f| sets.root(f)).collect();
    let split = split_off(positions, triangles, label, &piece, (places, min_area));
    parted(positions, triangles, topology, label, split)
}

/// Connected faces of one label, named by one of them.
fn connected(faces: usize, topology: &Topology, label: &[u32]) -> Result<Vec<u32>> {
    let mut sets = Sets::new(faces)?;
    for e in 0..topology.edge_count() as u32 {
        let sides = topology.halfedges(e);
        for pair in sides.windows(2) {
            let [f, g] = [pair[0] / 3, pair[1] / 3];
            if label[f as usize] == label[g as usize] {
                sets.join(f, g);
            }
        }
    }
    Ok((0..faces as u32).map(|f| sets.root(f)).collect())
}

/// Two blocks that hung together through a wall are two features once it is split off. What lay apart before stays one.
fn parted(
    positions: &[[f64; 3]],
    triangles: &[[u32; 3]],
    topology: &Topology,
    before: &[u32],
    mut after: Vec<u32>,
) -> Result<Vec<u32>> {
    if before == after {
        return Ok(after);
    }
    let was = connected(triangles.len(), topology, before)?;
    let is = connected(triangles.len(), topology, &after)?;
    let mut sizes: BTreeMap<u32, f64> = BTreeMap::new();
    for (f, &t) in triangles.iter().enumerate() {
        *sizes.entry(is[f]).or_insert(0.0) += area(corners(positions, t));
    }
    // --- the largest of what was connected keeps the label
    let mut largest: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    for (&k, size) in &sizes {
        let most = largest.entry((was[k as usize], after[k as usize])).or_insert(k);
        if *size > sizes[most] {
            *most = k;
        }
    }
    let mut next = after.iter().map(|l| l + 1).max().unwrap_or(0);
    let mut new: BTreeMap<u32, u32> = BTreeMap::new();
    for (&k, size) in &sizes {
        let most = largest[&(was[k as usize], after[k as usize])];
        if most != k && *size >= PART * sizes[&most] {
            new.insert(k, next);
            next += 1;
        }
    }
    after.iter_mut().zip(&is).for_each(|(l, k)| *l = new.get(k).copied().unwrap_or(*l));
    Ok(after)
}

/// Length of the edge that two faces have in common.
fn common_edge(positions: &[[f64; 3]], f: [u32; 3], g: [u32; 3]) -> f64 {
    let mut common = f.into_iter().filter(|v| g.contains(v)).map(|v| positions[v as usize]);
    common.next().zip(common.next()).map_or(0.0, |(a, b)| distance(a, b))
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
    (places, min_area): (&[Place], f64),
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
        if thin && p.area >= (LARGE * mean(p) * mean(p)).max(min_area) {
            new.insert(k, next);
            next += 1;
        }
    }
    piece.iter().zip(label).map(|(p, &l)| new.get(p).copied().unwrap_or(l)).collect()
}
