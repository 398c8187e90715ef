//! The topology of a segment's surface: handles, and whether it is a closed ring.
//!
//! A bent rod whose ends meet has half the D1 of the same rod with open ends (Fig. 16): two ways lead to every point. A
//! segment is a *closed ring* when its surface has a handle, the points at half of D1 from one end of D1 form two
//! separate arms side by side, and the arms meet again beyond. Two nested circles, as on the wall of a pipe, are not side
//! by side. The *loop length* is that of the closed way out along one arm and back along the other: twice D1max.

use crate::mesh::measure::{Vec3, add, distance, scale};
use crate::mesh::sets::SparseSets;
use hashbrown::HashMap;

/// Number of handles of a connected triangle mesh whose holes are thought closed: (2 - V + E - F - holes) / 2.
pub fn handles(triangles: &[[u32; 3]]) -> u32 {
    let mut edges: HashMap<(u32, u32), u32> = HashMap::new();
    let mut vertices: Vec<u32> = triangles.iter().flatten().copied().collect();
    vertices.sort_unstable();
    vertices.dedup();
    for t in triangles {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            *edges.entry((a.min(b), a.max(b))).or_insert(0) += 1;
        }
    }
    let border: Vec<(u32, u32)> = edges.iter().filter(|(_, n)| **n == 1).map(|(e, _)| *e).collect();
    let holes = component_count(&border);
    let euler = vertices.len() as i64 - edges.len() as i64 + triangles.len() as i64;
    ((2 - euler - holes as i64) / 2).max(0) as u32
}

/// Number of connected components of a set of edges.
fn component_count(edges: &[(u32, u32)]) -> usize {
    let mut sets = SparseSets::default();
    edges.iter().for_each(|&(a, b)| sets.join(a, b));
    sets.count()
}

/// A closed curve of a level set.
#[derive(Default, Clone)]
struct Curve {
    length: f64,
    centre: Vec3,
    points: Vec<(Vec3, f64)>,
}

/// True if the surface is a closed ring (see above), given the distances `field` of its vertices from one end of D1.
pub fn is_ring(positions: &[Vec3], triangles: &[[u32; 3]], field: &[f64]) -> bool {
    let longest = field.iter().copied().filter(|d| d.is_finite()).fold(0.0, f64::max);
    let level = 0.5 * longest;
    let arms = curves(positions, triangles, field, level);
    let whole: f64 = arms.iter().map(|c| c.length).sum();
    // ripples of the field make curves that are short beside the arms
    let arms: Vec<&Curve> = arms.iter().filter(|c| c.length > 0.05 * whole).collect();
    let [a, b] = arms[..] else { return false };
    let gap = distance(a.centre, b.centre);
    let extent = |c: &Curve| {
        let sum: f64 = c.points.iter().map(|(p, l)| l * distance(*p, c.centre).powi(2)).sum();
        (sum / c.length.max(f64::MIN_POSITIVE)).sqrt()
    };
    if gap < extent(a).max(extent(b)) {
        return false;
    }
    // the arms meet again: what lies beyond the level is one piece
    let mut beyond = SparseSets::default();
    for t in triangles {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            if field[a as usize] > level && field[b as usize] > level {
                beyond.join(a, b);
            }
        }
    }
    let mut size: HashMap<u32, usize> = HashMap::new();
    let members: Vec<u32> = beyond.members().collect();
    for &v in &members {
        *size.entry(beyond.root(v)).or_insert(0) += 1;
    }
    size.values().any(|&n| n * 10 > members.len() * 9)
}

/// The curves on which the field has the value `level`.
fn curves(positions: &[Vec3], triangles: &[[u32; 3]], field: &[f64], level: f64) -> Vec<Curve> {
    // Curves are told apart by the mesh edges they cross: two crossed edges of one triangle are on one curve.
    let mut name: HashMap<(u32, u32), u32> = HashMap::new();
    let mut sets = SparseSets::default();
    let mut pieces: Vec<(u32, Vec3, Vec3)> = Vec::new();
    for t in triangles {
        let mut crossed: Vec<(u32, Vec3)> = Vec::new();
        for k in 0..3 {
            let (a, b) = (t[k].min(t[(k + 1) % 3]), t[k].max(t[(k + 1) % 3]));
            let (u, v) = (field[a as usize], field[b as usize]);
            if (u > level) != (v > level) && u.is_finite() && v.is_finite() {
                let next = name.len() as u32;
                let share = (level - u) / (v - u);
                let point = add(scale(positions[a as usize], 1.0 - share), scale(positions[b as usize], share));
                crossed.push((*name.entry((a, b)).or_insert(next), point));
            }
        }
        if let [a, b] = crossed[..] {
            sets.join(a.0, b.0);
            pieces.push((a.0, a.1, b.1));
        }
    }
    let mut found: std::collections::BTreeMap<u32, Curve> = Default::default();
    for (edge, p, q) in pieces {
        let curve = found.entry(sets.root(edge)).or_default();
        let (length, middle) = (distance(p, q), scale(add(p, q), 0.5));
        curve.length += length;
        curve.centre = add(curve.centre, scale(middle, length));
        curve.points.push((middle, length));
    }
    let mut found: Vec<Curve> = found.into_values().filter(|c| c.length > 0.0).collect();
    found.iter_mut().for_each(|c| c.centre = scale(c.centre, 1.0 / c.length));
    found
}
