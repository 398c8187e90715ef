//! Shapes with known measures, for tests.

use super::measure::{Vec3, add, norm, scale};
use std::f64::consts::PI;

/// Vertices and triangles.
pub type Shape = (Vec<Vec3>, Vec<[u32; 3]>);

/// A box from the origin to `size` of 8 vertices and 12 triangles.
pub fn cuboid(size: Vec3) -> Shape {
    grid_box(size, [1, 1, 1])
}

/// A box from the origin to `size`, each side cut into `n` × 2 triangles, vertices shared.
pub fn grid_box(size: Vec3, n: [usize; 3]) -> Shape {
    let mut index = std::collections::HashMap::new();
    let (mut p, mut t) = (Vec::new(), Vec::new());
    let mut vertex = |at: [usize; 3]| {
        *index.entry(at).or_insert_with(|| {
            p.push([0, 1, 2].map(|k| size[k] * at[k] as f64 / n[k] as f64));
            p.len() as u32 - 1
        })
    };
    for k in 0..3 {
        let (u, v) = ((k + 1) % 3, (k + 2) % 3);
        for side in 0..2 {
            for i in 0..n[u] {
                for j in 0..n[v] {
                    let mut corner = |du: usize, dv: usize| {
                        let mut at = [0; 3];
                        (at[k], at[u], at[v]) = (side * n[k], i + du, j + dv);
                        vertex(at)
                    };
                    let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                    let faces = if side == 1 { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] };
                    t.extend(faces);
                }
            }
        }
    }
    (p, t)
}

/// A sphere of radius 1 from an icosahedron whose triangles are split in four `levels` times: 20 · 4^levels faces.
pub fn icosphere(levels: usize) -> Shape {
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    let mut p: Vec<Vec3> = Vec::new();
    for (a, b) in [(1.0, g), (-1.0, g), (1.0, -g), (-1.0, -g)] {
        p.extend([[0.0, a, b], [a, b, 0.0], [b, 0.0, a]]);
    }
    let edge2 = 4.0 + 1e-9;
    let near = |a: Vec3, b: Vec3| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>() < edge2;
    let mut t = Vec::new();
    for a in 0..12u32 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                let [x, y, z] = [a, b, c].map(|v| p[v as usize]);
                if near(x, y) && near(y, z) && near(z, x) {
                    let out = super::measure::signed_volume6([x, y, z], [0.0; 3]) > 0.0;
                    t.push(if out { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    for _ in 0..levels {
        (p, t) = split_in_four(&p, &t);
    }
    (p.into_iter().map(|q| scale(q, 1.0 / norm(q))).collect(), t)
}

/// Every triangle split in four at the middles of its sides.
pub fn split_in_four(p: &[Vec3], t: &[[u32; 3]]) -> Shape {
    let mut p = p.to_vec();
    let mut middle = std::collections::HashMap::new();
    let mut out = Vec::new();
    for &[a, b, c] in t {
        let mut mid = |i: u32, j: u32| {
            *middle.entry((i.min(j), i.max(j))).or_insert_with(|| {
                p.push(scale(add(p[i as usize], p[j as usize]), 0.5));
                p.len() as u32 - 1
            })
        };
        let [d, e, f] = [mid(a, b), mid(b, c), mid(c, a)];
        out.extend([[a, d, f], [d, b, e], [f, e, c], [d, e, f]]);
    }
    (p, out)
}

/// A Möbius strip of `n` quads.
pub fn moebius(n: u32) -> Shape {
    let mut p = Vec::new();
    for i in 0..n {
        let a = 2.0 * PI * i as f64 / n as f64;
        for s in [-0.3, 0.3] {
            let r = 1.0 + s * (a / 2.0).cos();
            p.push([r * a.cos(), r * a.sin(), s * (a / 2.0).sin()]);
        }
    }
    let mut t = Vec::new();
    for i in 0..n {
        let (a, b) = (2 * i, 2 * i + 1);
        let (c, d) = if i + 1 < n { (a + 2, b + 2) } else { (1, 0) };
        t.extend([[a, c, b], [b, c, d]]);
    }
    (p, t)
}

/// Points moved by `by`.
pub fn translated(p: Vec<Vec3>, by: Vec3) -> Vec<Vec3> {
    p.into_iter().map(|q| add(q, by)).collect()
}

/// Several shapes in one mesh, vertices not shared.
pub fn union(shapes: &[Shape]) -> Shape {
    let (mut p, mut t) = (Vec::new(), Vec::new());
    for (q, u) in shapes {
        let base = p.len() as u32;
        p.extend_from_slice(q);
        t.extend(u.iter().map(|f| f.map(|v| v + base)));
    }
    (p, t)
}
