//! Meshes for the tests.

use super::topology::{norm, sub};
use std::f64::consts::PI;

/// Positions and triangles.
pub(super) type Mesh = (Vec<[f64; 3]>, Vec<[u32; 3]>);

/// Vertex i has coordinate k = size[k] if bit k of i is set.
pub(super) fn cuboid(size: [f64; 3]) -> Mesh {
    let positions = (0..8).map(|i| [0, 1, 2].map(|k| if i >> k & 1 == 1 { size[k] } else { 0.0 })).collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    (positions, quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect())
}

/// A torus with waves: saddles, convex vertices, no symmetry.
pub(super) fn wavy_torus(n: u32, m: u32) -> Mesh {
    let mut positions = Vec::new();
    for i in 0..n {
        for j in 0..m {
            let (a, b) = (2.0 * PI * i as f64 / n as f64, 2.0 * PI * j as f64 / m as f64);
            let r = 1.0 + 0.25 * (3.0 * a + 0.3).sin() * (2.0 * b).cos() + 0.1 * (5.0 * b + a).sin();
            positions.push([(2.5 + r * b.cos()) * a.cos(), (2.5 + r * b.cos()) * a.sin(), r * b.sin()]);
        }
    }
    let at = |i: u32, j: u32| (i % n) * m + j % m;
    let cells = (0..n).flat_map(|i| (0..m).map(move |j| (i, j)));
    let faces = cells
        .flat_map(|(i, j)| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]);
    (positions, faces.collect())
}

/// Splits every face at its centroid; the new vertices come after the old ones, in the order of the faces.
pub(super) fn split_faces(mesh: &Mesh) -> Mesh {
    let (mut positions, mut faces) = (mesh.0.clone(), Vec::new());
    for t in &mesh.1 {
        let c = positions.len() as u32;
        let p = t.map(|v| mesh.0[v as usize]);
        positions.push([0, 1, 2].map(|k| (p[0][k] + p[1][k] + p[2][k]) / 3.0));
        faces.extend((0..3).map(|k| [t[k], t[(k + 1) % 3], c]));
    }
    (positions, faces)
}

/// Splits every edge in the middle, which leaves no vertex of the old mesh without a new one between.
pub(super) fn split_edges(mesh: &Mesh) -> Mesh {
    let (mut positions, mut faces) = (mesh.0.clone(), Vec::new());
    let mut middle = std::collections::BTreeMap::new();
    for t in &mesh.1 {
        let m = [0, 1, 2].map(|k| {
            let (a, b) = (t[k].min(t[(k + 1) % 3]), t[k].max(t[(k + 1) % 3]));
            *middle.entry((a, b)).or_insert_with(|| {
                let (p, q) = (mesh.0[a as usize], mesh.0[b as usize]);
                positions.push([0, 1, 2].map(|k| 0.5 * (p[k] + q[k])));
                positions.len() as u32 - 1
            })
        });
        faces.extend([[t[0], m[0], m[2]], [m[0], t[1], m[1]], [m[2], m[1], t[2]], [m[0], m[1], m[2]]]);
    }
    (positions, faces)
}

/// The surface of unit cubes at these places, each side cut into two triangles; cubes that touch along an edge make it
/// non-manifold.
pub(super) fn blocks(cells: &[[i32; 3]]) -> Mesh {
    let mut index = std::collections::BTreeMap::new();
    let mut mesh: Mesh = Default::default();
    for cell in cells {
        for (axis, side) in (0..3).flat_map(|axis| [(axis, 0), (axis, 1)]) {
            let mut beyond = *cell;
            beyond[axis] += 2 * side - 1;
            if cells.contains(&beyond) {
                continue;
            }
            let quad = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[u, w]| {
                let mut p = *cell;
                (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) =
                    (p[axis] + side, p[(axis + 1) % 3] + u, p[(axis + 2) % 3] + w);
                *index.entry(p).or_insert_with(|| {
                    mesh.0.push(p.map(f64::from));
                    mesh.0.len() as u32 - 1
                })
            });
            let k = (cell.iter().sum::<i32>() as usize + axis) % 2;
            mesh.1.extend([[quad[k], quad[k + 1], quad[k + 2]], [quad[k], quad[k + 2], quad[(k + 3) % 4]]]);
        }
    }
    mesh
}

/// An arch on a stepped base, with a cube that touches the rest along an edge only.
pub(super) fn ruin() -> Mesh {
    let base = (0..5).flat_map(|x| (0..3).map(move |y| [x, y, 0]));
    let more =
        [[0, 1, 1], [0, 1, 2], [1, 1, 2], [2, 1, 2], [2, 1, 1], [4, 0, 1], [4, 1, 1], [4, 2, 1], [4, 1, 2], [5, 3, 0]];
    blocks(&base.chain(more).collect::<Vec<_>>())
}

/// Where the faces on one side of a vertex make up a flat half-disc, lets go of the vertex on that side and closes the
/// seam with a zero-area face: the same surface, with T-junctions. Returns the number of such faces.
pub(super) fn unhinge(mesh: &mut Mesh) -> usize {
    let index: std::collections::BTreeMap<[i32; 3], u32> =
        mesh.0.iter().enumerate().map(|(i, p)| (p.map(|x| x as i32), i as u32)).collect();
    let mut used = vec![false; mesh.0.len()];
    let mut made = 0;
    let axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]];
    for v in 0..mesh.0.len() {
        for (d, up) in axes.iter().flat_map(|d| axes.iter().map(move |up| (d, up))) {
            let step = |s: &[i32; 3], k: i32| {
                let p = mesh.0[v].map(|x| x as i32);
                index.get(&[0, 1, 2].map(|i| p[i] + k * s[i])).copied()
            };
            let (Some(a), Some(b), Some(p)) = (step(d, -1), step(d, 1), step(up, 1)) else { continue };
            if d.iter().zip(up).any(|(d, u)| d * u != 0) || used[v] {
                continue;
            }
            // Faces at v in the plane of d and up, on the side of up.
            let coordinate =
                |u: u32, s: &[i32; 3]| (0..3).map(|i| (mesh.0[u as usize][i] - mesh.0[v][i]) * s[i] as f64).sum();
            let inside = |u: u32| {
                let (x, y): (f64, f64) = (coordinate(u, d), coordinate(u, up));
                y >= 0.0 && (norm(sub(mesh.0[u as usize], mesh.0[v])).powi(2) - x * x - y * y).abs() < 1e-9
            };
            let disc: Vec<[u32; 3]> =
                mesh.1.iter().filter(|t| t.contains(&(v as u32)) && t.iter().all(|&u| inside(u))).copied().collect();
            let mut ring: Vec<u32> = disc.iter().flatten().copied().filter(|&u| u != v as u32).collect();
            ring.sort_by(|p, q| {
                let angle = |u: u32| f64::atan2(coordinate(u, up), coordinate(u, d));
                angle(*p).total_cmp(&angle(*q))
            });
            ring.dedup();
            let whole = ring.len() == disc.len() + 1 && ring.first() == Some(&b) && ring.last() == Some(&a);
            if !whole || !ring.contains(&p) || ring.iter().any(|&u| used[u as usize]) {
                continue;
            }
            ring.iter().for_each(|&u| used[u as usize] = true);
            used[v] = true;
            mesh.1.retain(|t| !disc.contains(t));
            let at_p = ring.iter().position(|&u| u == p).unwrap();
            ring.rotate_left(at_p);
            mesh.1.extend(ring[1..].windows(2).map(|w| [p, w[0], w[1]]));
            mesh.1.push([a, v as u32, b]);
            made += 1;
        }
    }
    made
}
