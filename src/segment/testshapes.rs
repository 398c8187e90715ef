//! Composite solids with known parts, for tests: unions of intersections of smooth bodies, meshed on a grid with their
//! sharp edges.

use crate::mesh::measure::{Vec3, add, cross, dot, norm, scale, sub};
use std::collections::HashMap;

/// Signed distance or something like it, negative inside.
type Side = Box<dyn Fn(Vec3) -> f64>;

/// A mesh whose faces are labelled.
pub struct Composite {
    pub name: &'static str,
    pub positions: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
    pub label: Vec<u32>,
}

/// Half-space: what lies below `offset` along `n`.
fn half(n: Vec3, offset: f64) -> Side {
    let n = scale(n, 1.0 / norm(n));
    Box::new(move |p| dot(p, n) - offset)
}

/// Infinite cylinder around the axis `d` through `c`.
fn cylinder(c: Vec3, d: Vec3, r: f64) -> Side {
    Box::new(move |p| norm(cross(sub(p, c), d)) - r)
}

/// What is outside of an infinite cylinder.
fn bore(c: Vec3, d: Vec3, r: f64) -> Side {
    Box::new(move |p| r - norm(cross(sub(p, c), d)))
}

fn ball(c: Vec3, r: f64) -> Side {
    Box::new(move |p| norm(sub(p, c)) - r)
}

/// Torus around the axis `d` (a unit vector) through `c`.
fn torus(c: Vec3, d: Vec3, ring: f64, tube: f64) -> Side {
    Box::new(move |p| {
        let q = sub(p, c);
        let height = dot(q, d);
        let across = norm(sub(q, scale(d, height))) - ring;
        across.hypot(height) - tube
    })
}

fn cuboid(lo: Vec3, hi: Vec3) -> Vec<Side> {
    let axis = |k: usize, s: f64| std::array::from_fn(|i| if i == k { s } else { 0.0 });
    (0..3).flat_map(|k| [half(axis(k, 1.0), hi[k]), half(axis(k, -1.0), -lo[k])]).collect()
}

const X: Vec3 = [1.0, 0.0, 0.0];
const Y: Vec3 = [0.0, 1.0, 0.0];
const Z: Vec3 = [0.0, 0.0, 1.0];
const O: Vec3 = [0.0; 3];

/// All composites; `cell` scales the mesh width (1: some 5 000 to 20 000 faces each).
pub fn composites(cell: f64) -> Vec<Composite> {
    vec![dumbbell(cell), t_beam(cell), plate_with_pins(cell), cross_of_tubes(cell), mug(cell)]
}

pub fn dumbbell(cell: f64) -> Composite {
    let parts = vec![
        (0, vec![ball([-20.0, 0.0, 0.0], 10.0)]),
        (1, vec![ball([20.0, 0.0, 0.0], 10.0)]),
        (2, vec![cylinder(O, X, 3.0), half(X, 18.0), half([-1.0, 0.0, 0.0], 18.0)]),
    ];
    mesh("dumb-bell", parts, [[-31.0, -11.0, -11.0], [31.0, 11.0, 11.0]], cell)
}

pub fn t_beam(cell: f64) -> Composite {
    let parts =
        vec![(0, cuboid([-40.0, -15.0, 20.0], [40.0, 15.0, 24.0])), (1, cuboid([-40.0, -2.0, 0.0], [40.0, 2.0, 22.0]))];
    mesh("T-beam", parts, [[-42.0, -17.0, -2.0], [42.0, 17.0, 26.0]], cell)
}

pub fn plate_with_pins(cell: f64) -> Composite {
    let mut parts = vec![(0, cuboid([-30.0, -20.0, -4.0], [30.0, 20.0, 0.0]))];
    for (k, (x, y)) in
        [(-20.0, -10.0), (0.0, -10.0), (20.0, -10.0), (-20.0, 10.0), (0.0, 10.0), (20.0, 10.0)].into_iter().enumerate()
    {
        let radius = 2.0 + 0.3 * k as f64;
        parts.push((k as u32 + 1, vec![cylinder([x, y, 0.0], Z, radius), half(Z, 15.0), half([0.0, 0.0, -1.0], 2.0)]));
    }
    mesh("plate with pins", parts, [[-32.0, -22.0, -6.0], [32.0, 22.0, 17.0]], cell)
}

pub fn cross_of_tubes(cell: f64) -> Composite {
    let tube = |d: Vec3, r: f64, end: f64| {
        let holes = [bore(O, X, 5.0), bore(O, Y, 3.5)];
        let ends = [half(d, end), half(scale(d, -1.0), end)];
        [cylinder(O, d, r)].into_iter().chain(holes).chain(ends).collect::<Vec<Side>>()
    };
    let mut out = mesh(
        "cross of tubes",
        vec![(0, tube(X, 7.0, 30.0)), (1, tube(Y, 5.0, 25.0))],
        [[-32.0, -27.0, -9.0], [32.0, 27.0, 9.0]],
        cell,
    );
    for (t, label) in out.triangles.iter().zip(&mut out.label) {
        let [a, b, c] = t.map(|v| out.positions[v as usize]);
        let p = scale(add(add(a, b), c), 1.0 / 3.0);
        let from_x = p[1].hypot(p[2]);
        let on_main = (from_x - 7.0).abs() < 0.2 || (from_x - 5.0).abs() < 0.2 || p[0].abs() > 8.0;
        *label = if on_main {
            0
        } else if p[1] > 0.0 {
            1
        } else {
            2
        };
    }
    out
}

pub fn mug(cell: f64) -> Composite {
    let down = [0.0, 0.0, -1.0];
    let parts = vec![
        (0, vec![cylinder(O, Z, 18.0), bore(O, Z, 15.5), half(Z, 40.0), half(down, 0.0)]),
        (0, vec![cylinder(O, Z, 18.0), half(Z, 3.0), half(down, 0.0)]),
        (1, vec![torus([18.0, 0.0, 20.0], Y, 11.0, 2.5), bore(O, Z, 17.0), half([-1.0, 0.0, 0.0], -10.0)]),
    ];
    mesh("mug", parts, [[-20.0, -20.0, -2.0], [34.0, 20.0, 42.0]], cell)
}

/// Surface nets on a grid of about `cell` model units, vertices then moved onto the sides that meet near them.
fn mesh(name: &'static str, parts: Vec<(u32, Vec<Side>)>, [lo, hi]: [Vec3; 2], cell: f64) -> Composite {
    // a little off the round numbers, so that no side runs through grid points
    let lo = [lo[0] - 0.137 * cell, lo[1] - 0.211 * cell, lo[2] - 0.173 * cell];
    let n: [usize; 3] = std::array::from_fn(|k| ((hi[k] - lo[k]) / cell).ceil() as usize + 1);
    let at = |i: [usize; 3]| -> Vec3 { std::array::from_fn(|k| lo[k] + cell * i[k] as f64) };
    let inside_of = |part: &[Side], p: Vec3| part.iter().map(|g| g(p)).fold(f64::NEG_INFINITY, f64::max);
    let body = |p: Vec3| parts.iter().map(|(_, part)| inside_of(part, p)).fold(f64::INFINITY, f64::min);
    let index = |i: [usize; 3]| (i[0] * n[1] + i[1]) * n[2] + i[2];
    let mut value = vec![0.0; n[0] * n[1] * n[2]];
    for x in 0..n[0] {
        for y in 0..n[1] {
            for z in 0..n[2] {
                value[index([x, y, z])] = body(at([x, y, z]));
            }
        }
    }
    let (mut positions, mut vertex) = (Vec::new(), HashMap::new());
    let mut triangles = Vec::new();
    let mut vertex_of = |c: [usize; 3], positions: &mut Vec<Vec3>| {
        *vertex.entry(c).or_insert_with(|| {
            let (mut sum, mut count) = ([0.0; 3], 0.0);
            for e in 0..12 {
                let (k, u, v) = (e / 4, e % 4 / 2, e % 2);
                let mut a = c;
                a[(k + 1) % 3] += u;
                a[(k + 2) % 3] += v;
                let mut b = a;
                b[k] += 1;
                let (s, t) = (value[index(a)], value[index(b)]);
                if (s < 0.0) != (t < 0.0) {
                    sum = add(sum, add(scale(at(a), t / (t - s)), scale(at(b), -s / (t - s))));
                    count += 1.0;
                }
            }
            positions.push(settle(scale(sum, 1.0 / count), &parts, cell));
            positions.len() as u32 - 1
        })
    };
    for x in 1..n[0] - 1 {
        for y in 1..n[1] - 1 {
            for z in 1..n[2] - 1 {
                for k in 0..3 {
                    let a = [x, y, z];
                    let mut b = a;
                    b[k] += 1;
                    let (s, t) = (value[index(a)] < 0.0, value[index(b)] < 0.0);
                    if s == t {
                        continue;
                    }
                    let mut quad = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[u, v]: [usize; 2]| {
                        let mut c = a;
                        c[(k + 1) % 3] -= u;
                        c[(k + 2) % 3] -= v;
                        vertex_of(c, &mut positions)
                    });
                    if t {
                        quad.reverse();
                    }
                    let [p, q, r, s] = quad;
                    triangles.extend([[p, q, r], [p, r, s]]);
                }
            }
        }
    }
    let label = triangles
        .iter()
        .map(|t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| positions[v as usize]);
            let p = scale(add(add(a, b), c), 1.0 / 3.0);
            let f = |i: usize| inside_of(&parts[i].1, p);
            let nearest = (0..parts.len()).min_by(|&i, &j| f(i).total_cmp(&f(j)));
            parts[nearest.unwrap()].0
        })
        .collect();
    Composite { name, positions, triangles, label }
}

/// Moves a vertex onto all sides that meet within half a cell of it (Gauss-Newton).
fn settle(mut p: Vec3, parts: &[(u32, Vec<Side>)], cell: f64) -> Vec3 {
    let reach = 0.55 * cell;
    let active: Vec<&Side> = parts
        .iter()
        .filter(|(_, part)| part.iter().map(|g| g(p)).fold(f64::NEG_INFINITY, f64::max).abs() < reach)
        .flat_map(|(_, part)| part.iter().filter(|g| g(p).abs() < reach))
        .collect();
    for _ in 0..8 {
        // (JᵀJ + ε) δ = -Jᵀ g, ε well above rounding, solved by Cramer's rule
        let mut m = [[1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [0.0, 0.0, 1e-4]];
        let mut right = [0.0; 3];
        for g in &active {
            let h = 1e-5 * cell;
            let slope: Vec3 = std::array::from_fn(|k| {
                let mut e = [0.0; 3];
                e[k] = h;
                (g(add(p, e)) - g(sub(p, e))) / (2.0 * h)
            });
            let value = g(p);
            for i in 0..3 {
                right[i] -= slope[i] * value;
                for j in 0..3 {
                    m[i][j] += slope[i] * slope[j];
                }
            }
        }
        let determinant = dot(m[0], cross(m[1], m[2]));
        let step = scale(
            add(
                add(scale(cross(m[1], m[2]), right[0]), scale(cross(m[2], m[0]), right[1])),
                scale(cross(m[0], m[1]), right[2]),
            ),
            1.0 / determinant,
        );
        let length = norm(step);
        p = add(p, if length > 0.3 * cell { scale(step, 0.3 * cell / length) } else { step });
    }
    p
}

/// Adjusted Rand index of two labellings (Hubert & Arabie 1985), every item with the weight 1.
pub fn adjusted_rand(a: &[u32], b: &[u32]) -> f64 {
    let mut table: HashMap<(u32, u32), f64> = HashMap::new();
    let (mut rows, mut columns): (HashMap<u32, f64>, HashMap<u32, f64>) = Default::default();
    for (&x, &y) in a.iter().zip(b) {
        *table.entry((x, y)).or_default() += 1.0;
        *rows.entry(x).or_default() += 1.0;
        *columns.entry(y).or_default() += 1.0;
    }
    let pairs = |n: f64| n * (n - 1.0) / 2.0;
    let same: f64 = table.values().map(|n| pairs(*n)).sum();
    let (r, c): (f64, f64) = (rows.values().map(|n| pairs(*n)).sum(), columns.values().map(|n| pairs(*n)).sum());
    let expected = r * c / pairs(a.len() as f64);
    let most = 0.5 * (r + c);
    if most == expected { 1.0 } else { (same - expected) / (most - expected) }
}
