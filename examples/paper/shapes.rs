//! The shapes of the paper, made from their dimensions: closed, outward oriented, of triangles as even as the shape allows.

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

pub type V3 = [f64; 3];

/// Vertices and triangles.
#[derive(Debug, Clone, Default)]
pub struct Shape {
    pub positions: Vec<V3>,
    pub triangles: Vec<[u32; 3]>,
}

// --- bars: a unit cube cut into cells, then bent

/// The skin of the cube [0, 1]³ cut into `n` cells, mapped by `place`. With `closed` the sides x = 0 and x = 1 are one: the
/// bar is a ring and has no ends.
pub fn bar(n: [usize; 3], closed: bool, place: impl Fn(V3) -> V3) -> Shape {
    let mut shape = Shape::default();
    let mut index = HashMap::new();
    let mut vertex = |mut at: [usize; 3], shape: &mut Shape| {
        if closed && at[0] == n[0] {
            at[0] = 0;
        }
        *index.entry(at).or_insert_with(|| {
            shape.positions.push(place([0, 1, 2].map(|k| at[k] as f64 / n[k] as f64)));
            shape.positions.len() as u32 - 1
        })
    };
    for k in 0..3 {
        if closed && k == 0 {
            continue;
        }
        let (u, v) = ((k + 1) % 3, (k + 2) % 3);
        for (side, i, j) in (0..2).flat_map(|s| (0..n[u]).flat_map(move |i| (0..n[v]).map(move |j| (s, i, j)))) {
            let mut corner = |du: usize, dv: usize| {
                let mut at = [0; 3];
                (at[k], at[u], at[v]) = (side * n[k], i + du, j + dv);
                vertex(at, &mut shape)
            };
            let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            let [a, b, c, d] = if side == 1 { [a, b, c, d] } else { [a, d, c, b] };
            shape.triangles.extend(cut(&shape.positions, [a, b, c, d], (i + j) % 2 == 1));
        }
    }
    shape
}

/// How much longer one diagonal of a cell may be for both to count as alike.
const ALIKE: f64 = 0.05;

/// A cell as two triangles, by its shorter diagonal. Where both are alike they alternate, or every geodesic has a preferred
/// direction: with `first` between the first corner and the third.
fn cut(positions: &[V3], [a, b, c, d]: [u32; 4], first: bool) -> [[u32; 3]; 2] {
    let long = |u: u32, v: u32| {
        let (p, q) = (positions[u as usize], positions[v as usize]);
        (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt()
    };
    let (ac, bd) = (long(a, c), long(b, d));
    let by_first = if ac.max(bd) <= (1.0 + ALIKE) * ac.min(bd) { first } else { ac < bd };
    if by_first { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
}

/// Cells along three sides so that a box of this size has about `faces` even triangles.
pub fn cells(size: V3, faces: usize) -> [usize; 3] {
    let area = 2.0 * (size[0] * size[1] + size[1] * size[2] + size[2] * size[0]);
    let step = (2.0 * area / faces as f64).sqrt();
    size.map(|s| (s / step).round().max(1.0) as usize)
}

/// A box.
pub fn cuboid(size: V3, n: [usize; 3]) -> Shape {
    bar(n, false, |u| [0, 1, 2].map(|k| u[k] * size[k]))
}

/// A flat bar of `length` × `width` × `thick`, bent about an axis along its width until it takes `angle` radians of a
/// circle; its middle layer keeps its length. At 2 π it is closed.
pub fn bent([length, width, thick]: V3, angle: f64, n: [usize; 3]) -> Shape {
    let radius = length / angle;
    let closed = angle >= TAU - 1e-9;
    bar(n, closed, |u| {
        let (a, r) = (u[0] * angle, radius - (u[2] - 0.5) * thick);
        [r * a.sin(), u[1] * width, -r * a.cos()]
    })
}

/// A round wire of this centre-line length and diameter, one turn of a helix that rises by `height`; closed at 0.
pub fn helix(length: f64, diameter: f64, height: f64, n: [usize; 3]) -> Shape {
    let radius = (length * length - height * height).sqrt() / TAU;
    // unit vectors along the wire, towards the axis, and across both
    let (sin, cos) = (height / length, TAU * radius / length);
    bar(n, height == 0.0, |u| {
        let a = TAU * u[0];
        let [p, q] = disc([2.0 * u[1] - 1.0, 2.0 * u[2] - 1.0]).map(|c| 0.5 * diameter * c);
        // (out, along) x up: the section spans the outward normal and the binormal
        let out = [a.cos(), a.sin(), 0.0];
        let binormal = [a.sin() * sin, -a.cos() * sin, cos];
        let centre = [radius * a.cos(), radius * a.sin(), height * u[0]];
        [0, 1, 2].map(|k| centre[k] - p * out[k] + q * binormal[k])
    })
}

/// A round rod with its axis on an arc of `angle` radians; its centre line keeps its length. At 2 π it is closed.
pub fn bent_rod(length: f64, diameter: f64, angle: f64, n: [usize; 3]) -> Shape {
    let radius = length / angle;
    bar(n, angle >= TAU - 1e-9, |u| {
        let a = u[0] * angle;
        let [p, q] = disc([2.0 * u[1] - 1.0, 2.0 * u[2] - 1.0]).map(|c| 0.5 * diameter * c);
        [(radius - p) * a.cos(), (radius - p) * a.sin(), q]
    })
}

/// The square [-1, 1]² on the unit disc, concentric squares to circles, areas alike (Shirley & Chiu 1997).
fn disc([x, y]: [f64; 2]) -> [f64; 2] {
    if x == 0.0 && y == 0.0 {
        return [0.0; 2];
    }
    let (r, a) = if x.abs() > y.abs() { (x, PI / 4.0 * y / x) } else { (y, PI / 2.0 - PI / 4.0 * x / y) };
    [r * a.cos(), r * a.sin()]
}

// --- round and regular bodies

/// Every triangle cut into n² alike, vertices shared.
pub fn finer(shape: &Shape, n: usize) -> Shape {
    let mut out = Shape { positions: shape.positions.clone(), triangles: Vec::new() };
    let mut on_edge: HashMap<(u32, u32, usize), u32> = HashMap::new();
    for &t in &shape.triangles {
        let corner = t.map(|v| shape.positions[v as usize]);
        let mut at: HashMap<(usize, usize), u32> = HashMap::new();
        for (i, j) in (0..=n).flat_map(|i| (0..=n - i).map(move |j| (i, j))) {
            let k = n - i - j;
            let weights = [k, i, j];
            let zero = weights.iter().filter(|w| **w == 0).count();
            let add = |out: &mut Shape| {
                out.positions
                    .push([0, 1, 2].map(|c| (0..3).map(|m| weights[m] as f64 * corner[m][c]).sum::<f64>() / n as f64));
                out.positions.len() as u32 - 1
            };
            let v = match zero {
                2 => t[weights.iter().position(|w| *w == n).unwrap_or(0)],
                1 => {
                    let m = weights.iter().position(|w| *w == 0).unwrap_or(0);
                    let (a, b) = ((m + 1) % 3, (m + 2) % 3);
                    let (lo, hi) = if t[a] < t[b] { (a, b) } else { (b, a) };
                    *on_edge.entry((t[lo], t[hi], weights[lo])).or_insert_with(|| add(&mut out))
                }
                _ => add(&mut out),
            };
            at.insert((i, j), v);
        }
        for (i, j) in (0..n).flat_map(|i| (0..n - i).map(move |j| (i, j))) {
            out.triangles.push([at[&(i, j)], at[&(i + 1, j)], at[&(i, j + 1)]]);
            if i + j + 1 < n {
                out.triangles.push([at[&(i + 1, j)], at[&(i + 1, j + 1)], at[&(i, j + 1)]]);
            }
        }
    }
    out
}

/// The convex body whose corners are given, of triangles: flat sides with more corners are fans around their middle.
fn convex(corners: &[V3], side_corners: usize, edge: f64) -> Shape {
    let mut out = Shape { positions: corners.to_vec(), triangles: Vec::new() };
    let dot = |a: V3, b: V3| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let sub = |a: V3, b: V3| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let cross = |a: V3, b: V3| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let near = |a: usize, b: usize| {
        let d = sub(corners[a], corners[b]);
        dot(d, d) < (1.001 * edge).powi(2)
    };
    let n = corners.len();
    let mut seen: Vec<Vec<usize>> = Vec::new();
    for (b, a, c) in (0..n).flat_map(|b| (0..n).flat_map(move |a| (0..n).map(move |c| (b, a, c)))) {
        if a == b || c == b || a == c || !near(a, b) || !near(b, c) {
            continue;
        }
        let normal = cross(sub(corners[b], corners[a]), sub(corners[c], corners[b]));
        let height = |v: usize| dot(sub(corners[v], corners[b]), normal);
        let scale = dot(normal, normal).sqrt() * edge;
        if scale == 0.0 || (0..n).any(|v| height(v) > 1e-6 * scale) {
            continue;
        }
        let mut side: Vec<usize> = (0..n).filter(|&v| height(v).abs() <= 1e-6 * scale).collect();
        if side.len() != side_corners || seen.contains(&side) {
            continue;
        }
        seen.push(side.clone());
        let middle = [0, 1, 2].map(|k| side.iter().map(|&v| corners[v][k]).sum::<f64>() / side.len() as f64);
        let x = sub(corners[side[0]], middle);
        let y = cross(normal, x);
        let length = (dot(y, y) / dot(x, x)).sqrt();
        let angle = |v: usize| {
            let d = sub(corners[v], middle);
            (dot(d, y) / length).atan2(dot(d, x))
        };
        side.sort_by(|&a, &b| angle(a).total_cmp(&angle(b)));
        let ring: Vec<u32> = side.iter().map(|&v| v as u32).collect();
        if let [a, b, c] = ring[..] {
            out.triangles.push([a, b, c]);
        } else {
            out.positions.push(middle);
            let m = out.positions.len() as u32 - 1;
            out.triangles.extend((0..ring.len()).map(|k| [ring[k], ring[(k + 1) % ring.len()], m]));
        }
    }
    out
}

/// The five regular polyhedra, by their names.
pub fn regular() -> Vec<(&'static str, Shape)> {
    let g = (1.0 + 5f64.sqrt()) / 2.0;
    let signs = [1.0, -1.0];
    let pairs = signs.map(|s| signs.map(|t| [s, t])).concat();
    let cube: Vec<V3> = pairs.iter().flat_map(|&[x, y]| signs.map(|z| [x, y, z])).collect();
    let golden = |a: f64, b: f64| -> Vec<V3> {
        pairs.iter().flat_map(|[s, t]| [[0.0, s * a, t * b], [s * a, t * b, 0.0], [t * b, 0.0, s * a]]).collect()
    };
    let axes = (0..3).flat_map(|k| signs.map(|s| [0, 1, 2].map(|c| if c == k { s } else { 0.0 }))).collect::<Vec<V3>>();
    let tetra = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    let dodeca: Vec<V3> = cube.iter().copied().chain(golden(1.0 / g, g)).collect();
    vec![
        ("tetrahedron", convex(&tetra, 3, 8f64.sqrt())),
        ("cube", convex(&cube, 4, 2.0)),
        ("octahedron", convex(&axes, 3, 2f64.sqrt())),
        ("dodecahedron", convex(&dodeca, 5, 2.0 / g)),
        ("icosahedron", convex(&golden(1.0, g), 3, 2.0)),
    ]
}

/// The unit sphere, of 20 n² triangles.
pub fn sphere(n: usize) -> Shape {
    let mut shape = regular().pop().map_or_else(Shape::default, |(_, icosahedron)| finer(&icosahedron, n));
    for p in &mut shape.positions {
        let length = p.iter().map(|c| c * c).sum::<f64>().sqrt();
        *p = p.map(|c| c / length);
    }
    shape
}

/// An ellipsoid of revolution about x with the semi-axes `along` and `across`, of about so many even triangles: rings of
/// points that stand as far apart as their neighbours on the same ring do.
pub fn ellipsoid(along: f64, across: f64, faces: usize) -> Shape {
    // the meridian, by its length
    const STEPS: usize = 20_000;
    let point = |k: usize| {
        let t = PI * k as f64 / STEPS as f64;
        [along * t.cos(), across * t.sin()]
    };
    let mut length = vec![0.0];
    let mut area = 0.0;
    for k in 1..=STEPS {
        let ([x, r], [x0, r0]) = (point(k), point(k - 1));
        let step = (x - x0).hypot(r - r0);
        length.push(length[k - 1] + step);
        area += PI * (r + r0) * step;
    }
    let side = (4.0 * area / 3f64.sqrt() / faces as f64).sqrt();
    let rings = (length[STEPS] / (side * 0.75f64.sqrt())).round().max(2.0) as usize;
    // each ring: its first vertex and how many it has; a pole has one
    let mut shape = Shape::default();
    let mut last: Option<(u32, usize, f64)> = None;
    for ring in 0..=rings {
        let at = length.partition_point(|l| *l < length[STEPS] * ring as f64 / rings as f64).min(STEPS);
        let [x, r] = point(at);
        let pole = ring == 0 || ring == rings;
        let n = if pole { 1 } else { (TAU * r / side).round().max(5.0) as usize };
        let (first, turn) = (shape.positions.len() as u32, 0.5 * (ring % 2) as f64);
        shape.positions.extend((0..n).map(|k| {
            let a = TAU * (k as f64 + turn) / n as f64;
            if pole { [along * if ring == 0 { 1.0 } else { -1.0 }, 0.0, 0.0] } else { [x, r * a.cos(), r * a.sin()] }
        }));
        if let Some(below) = last {
            stitch(below, (first, n, turn), &mut shape.triangles);
        }
        last = Some((first, n, turn));
    }
    shape
}

/// Triangles between two rings of vertices (first, number, turned by this share of a step), whichever comes next.
fn stitch(a: (u32, usize, f64), b: (u32, usize, f64), triangles: &mut Vec<[u32; 3]>) {
    let angle = |ring: (u32, usize, f64), k: usize| (k as f64 + ring.2) / ring.1 as f64;
    let vertex = |ring: (u32, usize, f64), k: usize| ring.0 + (k % ring.1) as u32;
    let (mut i, mut j) = (0, 0);
    while i < a.1 || j < b.1 {
        // the shorter of the two diagonals; a pole stays where it is
        let on_a =
            j == b.1 || (i < a.1 && (angle(a, i + 1) - angle(b, j)).abs() <= (angle(b, j + 1) - angle(a, i)).abs());
        let (p, q) = (vertex(a, i), vertex(b, j));
        if on_a {
            i += 1;
            if a.1 > 1 {
                triangles.push([p, q, vertex(a, i)]);
            }
        } else {
            j += 1;
            if b.1 > 1 {
                triangles.push([p, q, vertex(b, j)]);
            }
        }
    }
}

// --- parts with features (in the manner of Figs. 21 and 22)

/// The outer skin of a union of boxes (low corner, high corner), on one grid with cells of at most `step`.
pub fn blocks(boxes: &[[V3; 2]], step: f64) -> Shape {
    let lines = [0, 1, 2].map(|axis| {
        let mut stops: Vec<f64> = boxes.iter().flat_map(|b| [b[0][axis], b[1][axis]]).collect();
        stops.sort_by(f64::total_cmp);
        stops.dedup();
        let mut out = vec![stops[0]];
        for w in stops.windows(2) {
            let n = ((w[1] - w[0]) / step).ceil().max(1.0);
            out.extend((1..=n as usize).map(|k| w[0] + (w[1] - w[0]) * k as f64 / n));
        }
        out
    });
    let n = [0, 1, 2].map(|k| lines[k].len() as i64 - 1);
    let middle = |c: [i64; 3], k: usize| 0.5 * (lines[k][c[k] as usize] + lines[k][c[k] as usize + 1]);
    let solid = |c: [i64; 3]| {
        (0..3).all(|k| (0..n[k]).contains(&c[k]))
            && boxes.iter().any(|b| (0..3).all(|k| (b[0][k]..b[1][k]).contains(&middle(c, k))))
    };
    let mut shape = Shape::default();
    let mut index: HashMap<[i64; 3], u32> = HashMap::new();
    for (x, y, z) in (0..n[0]).flat_map(|x| (0..n[1]).flat_map(move |y| (0..n[2]).map(move |z| (x, y, z)))) {
        let cell = [x, y, z];
        for (axis, side) in (0..3).flat_map(|a| [(a, 0), (a, 1)]) {
            let mut next = cell;
            next[axis] += 2 * side - 1;
            if !solid(cell) || solid(next) {
                continue;
            }
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let mut corner = |du: i64, dv: i64| {
                let mut at = cell;
                (at[axis], at[u], at[v]) = (cell[axis] + side, cell[u] + du, cell[v] + dv);
                *index.entry(at).or_insert_with(|| {
                    shape.positions.push([0, 1, 2].map(|k| lines[k][at[k] as usize]));
                    shape.positions.len() as u32 - 1
                })
            };
            let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            let [a, b, c, d] = if side == 1 { [a, b, c, d] } else { [a, d, c, b] };
            let even = (x + y + z) % 2 == 0;
            shape.triangles.extend(if even { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
        }
    }
    shape
}

/// A prism of `height` on an outline around the origin that every ray from there crosses once (counter-clockwise), with a
/// round hole of radius `bore` (or none: 0), of triangles with sides of about `step`.
pub fn prism(outline: &[[f64; 2]], bore: f64, height: f64, step: f64) -> Shape {
    let mut rim: Vec<[f64; 2]> = Vec::new();
    for (k, &p) in outline.iter().enumerate() {
        let q = outline[(k + 1) % outline.len()];
        let parts = ((q[0] - p[0]).hypot(q[1] - p[1]) / step).ceil().max(1.0);
        rim.extend((0..parts as usize).map(|i| [0, 1].map(|c| p[c] + (q[c] - p[c]) * i as f64 / parts)));
    }
    let reach = rim.iter().map(|p| p[0].hypot(p[1])).fold(0.0, f64::max);
    let (m, rings) = (rim.len(), ((reach - bore) / step).ceil() as usize);
    let storeys = (height / step).ceil().max(1.0) as usize;
    let hollow = bore > 0.0;
    // rings from the bore (or the middle) to the rim
    let at = |k: usize, i: usize| -> [f64; 2] {
        let (p, f) = (rim[i], k as f64 / rings as f64);
        let inner = bore / p[0].hypot(p[1]);
        p.map(|c| c * (inner + (1.0 - inner) * f))
    };
    let mut shape = Shape::default();
    let mut index: HashMap<[usize; 3], u32> = HashMap::new();
    let mut vertex = |k: usize, i: usize, s: usize, shape: &mut Shape| {
        let i = if k == 0 && !hollow { 0 } else { i % m };
        *index.entry([k, i, s]).or_insert_with(|| {
            let [x, y] = at(k, i);
            shape.positions.push([x, y, height * s as f64 / storeys as f64]);
            shape.positions.len() as u32 - 1
        })
    };
    let mut quad = |q: [[usize; 3]; 4], shape: &mut Shape| {
        let [a, b, c, d] = q.map(|[k, i, s]| vertex(k, i, s, shape));
        for t in [[a, b, c], [a, c, d]] {
            if t[0] != t[1] && t[1] != t[2] && t[2] != t[0] {
                shape.triangles.push(t);
            }
        }
    };
    for i in 0..m {
        for k in 0..rings {
            quad([[k, i, storeys], [k + 1, i, storeys], [k + 1, i + 1, storeys], [k, i + 1, storeys]], &mut shape);
            quad([[k, i, 0], [k, i + 1, 0], [k + 1, i + 1, 0], [k + 1, i, 0]], &mut shape);
        }
        for s in 0..storeys {
            quad([[rings, i, s], [rings, i + 1, s], [rings, i + 1, s + 1], [rings, i, s + 1]], &mut shape);
            if hollow {
                quad([[0, i, s], [0, i, s + 1], [0, i + 1, s + 1], [0, i + 1, s]], &mut shape);
            }
        }
    }
    shape
}

/// The outline of a star with `points` tips between two radii.
pub fn star(points: usize, [inner, outer]: [f64; 2]) -> Vec<[f64; 2]> {
    let at = |k: usize| {
        let (a, r) = (PI * k as f64 / points as f64, if k % 2 == 0 { outer } else { inner });
        [r * a.cos(), r * a.sin()]
    };
    (0..2 * points).map(at).collect()
}

/// The outline of a gear with `teeth` teeth between two radii.
pub fn gear(teeth: usize, [root, tip]: [f64; 2]) -> Vec<[f64; 2]> {
    let corner = |tooth: usize, turn: f64, r: f64| {
        let a = TAU * (tooth as f64 + turn) / teeth as f64;
        [r * a.cos(), r * a.sin()]
    };
    let tooth = |k| [corner(k, 0.0, root), corner(k, 0.13, tip), corner(k, 0.37, tip), corner(k, 0.5, root)];
    (0..teeth).flat_map(tooth).collect()
}
