//! Shapes with known widths, for tests.

/// Positions and triangles, counterclockwise seen from outside.
pub type Shape = (Vec<[f64; 3]>, Vec<[u32; 3]>);

/// A round plate of radius 10 and height 12 whose end faces are fans of `n` triangles; the middle of the upper one at
/// height `pit`.
pub fn disc(n: u32, pit: f64) -> Shape {
    let at = |i: u32, z: f64| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / f64::from(n)).sin_cos();
        [10.0 * cos, 10.0 * sin, z]
    };
    let mut p: Vec<[f64; 3]> = (0..n).map(|i| at(i, 0.0)).chain((0..n).map(|i| at(i, 12.0))).collect();
    p.extend([[0.0; 3], [0.0, 0.0, pit]]);
    let sides = |i: u32| {
        let j = (i + 1) % n;
        [[2 * n, j, i], [n + i, n + j, 2 * n + 1], [i, j, n + j], [i, n + j, n + i]]
    };
    (p, (0..n).flat_map(sides).collect())
}

/// A sphere of radius 1 from an icosahedron whose faces are split `n` times along each edge: 20 n^2 faces.
pub fn icosphere(n: usize) -> Shape {
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    let v: [[f64; 3]; 12] = [
        [-1.0, g, 0.0],
        [1.0, g, 0.0],
        [-1.0, -g, 0.0],
        [1.0, -g, 0.0],
        [0.0, -1.0, g],
        [0.0, 1.0, g],
        [0.0, -1.0, -g],
        [0.0, 1.0, -g],
        [g, 0.0, -1.0],
        [g, 0.0, 1.0],
        [-g, 0.0, -1.0],
        [-g, 0.0, 1.0],
    ];
    let f: [[usize; 3]; 20] = [
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    let mut soup = Vec::new();
    for [a, b, c] in f {
        let at = |i: usize, j: usize| {
            let (s, t) = (i as f64 / n as f64, j as f64 / n as f64);
            let p: [f64; 3] = std::array::from_fn(|k| v[a][k] * (1.0 - s - t) + v[b][k] * s + v[c][k] * t);
            let r = p.iter().map(|x| x * x).sum::<f64>().sqrt();
            p.map(|x| x / r)
        };
        for i in 0..n {
            for j in 0..n - i {
                soup.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
                if i + j + 1 < n {
                    soup.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                }
            }
        }
    }
    weld(&soup)
}

/// Merges corners that agree to 1e-9.
pub fn weld(soup: &[[[f64; 3]; 3]]) -> Shape {
    let mut seen = std::collections::HashMap::new();
    let mut positions = Vec::new();
    let mut id = |p: [f64; 3]| {
        *seen.entry(p.map(|x| (x * 1e9).round() as i64)).or_insert_with(|| {
            positions.push(p);
            positions.len() as u32 - 1
        })
    };
    let triangles = soup.iter().map(|t| t.map(&mut id)).collect();
    (positions, triangles)
}

/// A box with one corner at the origin, each side cut into `n` cells of two triangles.
pub fn cuboid(size: [f64; 3], n: [usize; 3]) -> Shape {
    let mut soup = Vec::new();
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for side in 0..2 {
            let at = |i: usize, j: usize| {
                let mut p = [0.0; 3];
                p[axis] = size[axis] * side as f64;
                p[u] = size[u] * i as f64 / n[u] as f64;
                p[v] = size[v] * j as f64 / n[v] as f64;
                p
            };
            for i in 0..n[u] {
                for j in 0..n[v] {
                    let q = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                    let [a, b, c, d] = if side == 1 { q } else { [q[3], q[2], q[1], q[0]] };
                    soup.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
    }
    weld(&soup)
}

/// The prism over a counterclockwise polygon that is star-shaped about `middle`, from z = 0 to `height`, its side cut
/// into `layers`, its ends into `rings` about `middle`.
pub fn prism(polygon: &[[f64; 2]], middle: [f64; 2], height: f64, layers: usize, rings: usize) -> Shape {
    let n = polygon.len();
    let mut soup = Vec::new();
    for k in 0..n {
        let (p, q) = (polygon[k], polygon[(k + 1) % n]);
        let z = |i: usize| height * i as f64 / layers as f64;
        for i in 0..layers {
            let [a, b] = [p, q].map(|c| [c[0], c[1], z(i)]);
            let [d, c] = [p, q].map(|c| [c[0], c[1], z(i + 1)]);
            soup.extend([[a, b, c], [a, c, d]]);
        }
        for (z, up) in [(0.0, false), (height, true)] {
            let at = |c: [f64; 2], r: usize| {
                let s = r as f64 / rings as f64;
                [middle[0] + s * (c[0] - middle[0]), middle[1] + s * (c[1] - middle[1]), z]
            };
            let mut cap = |t: [[f64; 3]; 3]| soup.push(if up { t } else { [t[0], t[2], t[1]] });
            for r in 0..rings {
                cap([at(p, r), at(p, r + 1), at(q, r + 1)]);
                if r > 0 {
                    cap([at(p, r), at(q, r + 1), at(q, r)]);
                }
            }
        }
    }
    weld(&soup)
}

/// A regular polygon of `n` corners that touches the circle of diameter `d` from outside.
pub fn round(d: f64, n: usize) -> Vec<[f64; 2]> {
    let r = d / 2.0 / (std::f64::consts::PI / n as f64).cos();
    let angle = |k: usize| 2.0 * std::f64::consts::PI * k as f64 / n as f64;
    (0..n).map(|k| [r * angle(k).cos(), r * angle(k).sin()]).collect()
}

/// Every point moved by `f`.
pub fn mapped(mut shape: Shape, f: impl Fn([f64; 3]) -> [f64; 3]) -> Shape {
    for p in &mut shape.0 {
        *p = f(*p);
    }
    shape
}

/// Turned by an angle that is no fraction of a turn about an axis that is no axis.
pub fn turned(p: [f64; 3]) -> [f64; 3] {
    let (s, c) = 0.7123f64.sin_cos();
    let k = [2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0];
    let dot: f64 = (0..3).map(|a| k[a] * p[a]).sum();
    let cross = [k[1] * p[2] - k[2] * p[1], k[2] * p[0] - k[0] * p[2], k[0] * p[1] - k[1] * p[0]];
    std::array::from_fn(|a| p[a] * c + cross[a] * s + k[a] * dot * (1.0 - c))
}

/// Vertices and faces in another order, corner lists begun elsewhere. Returns the shape and the new place of each face.
pub fn renumbered((p, t): Shape) -> (Shape, Vec<usize>) {
    let shuffled = |n: usize| {
        let step = (n as f64 * 0.618) as usize | 1;
        let step = (step..).step_by(2).find(|&s| gcd(s, n) == 1).unwrap();
        (0..n).map(|i| (i * step + 3) % n).collect::<Vec<_>>()
    };
    let (to_v, to_f) = (shuffled(p.len()), shuffled(t.len()));
    let (mut q, mut u) = (p.clone(), t.clone());
    for (i, &k) in to_v.iter().enumerate() {
        q[k] = p[i];
    }
    for (i, &k) in to_f.iter().enumerate() {
        let [a, b, c] = t[i].map(|v| to_v[v as usize] as u32);
        u[k] = [[a, b, c], [b, c, a], [c, a, b]][i % 3];
    }
    ((q, u), to_f)
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}
