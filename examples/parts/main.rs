//! Writes the bundled example part: `cargo run --release --example parts -- examples/parts`.
//!
//! `bracket.stl` is our own design (same licence as the project), in millimetres: a base plate that carries a tall thin
//! fin, a pin and a low rib. The fin and the pin are too slender for a metal powder bed, the plate and the rib are not.
//! It is closed, outward oriented and evenly meshed: boxes on a shared grid, the pin joined by rings around its foot.

use std::io::Write;
use std::path::Path;

type V3 = [f64; 3];
type Triangle = [V3; 3];

/// Longest side of a grid cell, mm.
const STEP: f64 = 2.8;
/// Foot of the pin: centre, half side of the square of the grid that it takes the place of, radius, height, mm.
const PIN: ([f64; 2], f64, f64, f64) = ([50.0, 12.0], 3.0, 1.5, 28.0);
const PIN_SIDES: usize = 16;
const PLATE: f64 = 5.0;

/// The boxes: low corner, high corner.
const BOXES: [[V3; 2]; 3] = [
    [[0.0, 0.0, 0.0], [60.0, 36.0, PLATE]],
    [[6.0, 26.0, PLATE], [46.0, 27.2, PLATE + 26.0]], // the fin, 1.2 mm thick
    [[6.0, 8.0, PLATE], [36.0, 12.0, PLATE + 8.0]],   // the rib, 4 mm thick
];

/// Coordinates of the grid along `axis`: every box's faces and the pin's square, subdivided to [`STEP`].
fn grid(axis: usize) -> Vec<f64> {
    let mut stops: Vec<f64> = BOXES.iter().flat_map(|b| [b[0][axis], b[1][axis]]).collect();
    if axis < 2 {
        stops.extend([PIN.0[axis] - PIN.1, PIN.0[axis] + PIN.1]);
    }
    stops.sort_by(f64::total_cmp);
    stops.dedup();
    let mut out = vec![stops[0]];
    for w in stops.windows(2) {
        let n = ((w[1] - w[0]) / STEP).ceil().max(1.0);
        out.extend((1..=n as usize).map(|k| w[0] + (w[1] - w[0]) * k as f64 / n));
    }
    out
}

/// The outer skin of the union of the boxes, as two triangles a cell side, without the square under the pin.
fn skin() -> Vec<Triangle> {
    let lines = [grid(0), grid(1), grid(2)];
    let n = [0, 1, 2].map(|k| lines[k].len() as i64 - 1);
    let middle = |c: [i64; 3], k: usize| 0.5 * (lines[k][c[k] as usize] + lines[k][c[k] as usize + 1]);
    let solid = |c: [i64; 3]| {
        (0..3).all(|k| (0..n[k]).contains(&c[k]))
            && BOXES.iter().any(|b| (0..3).all(|k| (b[0][k]..b[1][k]).contains(&middle(c, k))))
    };
    let mut out = Vec::new();
    for (x, y, z) in (0..n[0]).flat_map(|x| (0..n[1]).flat_map(move |y| (0..n[2]).map(move |z| (x, y, z)))) {
        let cell = [x, y, z];
        if !solid(cell) {
            continue;
        }
        for (axis, side) in (0..3).flat_map(|a| [(a, 0), (a, 1)]) {
            let mut next = cell;
            next[axis] += 2 * side - 1;
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let under_pin = axis == 2
                && side == 1
                && lines[2][cell[2] as usize + 1] == PLATE
                && (0..2).all(|k| (middle(cell, k) - PIN.0[k]).abs() < PIN.1);
            if solid(next) || under_pin {
                continue;
            }
            let corner = |du: i64, dv: i64| {
                let mut at = cell;
                at[axis] += side;
                at[u] += du;
                at[v] += dv;
                [0, 1, 2].map(|k| lines[k][at[k] as usize])
            };
            let q = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            let q = if side == 1 { q } else { [q[0], q[3], q[2], q[1]] };
            // alternate the diagonals, or every geodesic has a preferred direction
            if (x + y + z) % 2 == 0 {
                out.extend([[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
            } else {
                out.extend([[q[0], q[1], q[3]], [q[1], q[2], q[3]]]);
            }
        }
    }
    out
}

/// The pin, from the grid points around its foot to its tip.
fn pin() -> Vec<Triangle> {
    let ([cx, cy], half, radius, height) = PIN;
    let side =
        |axis: usize| -> Vec<f64> { grid(axis).into_iter().filter(|c| (c - PIN.0[axis]).abs() <= half).collect() };
    let (xs, ys) = (side(0), side(1));
    let (nx, ny) = (xs.len() - 1, ys.len() - 1);
    let mut square: Vec<V3> = (0..nx).map(|k| [xs[k], ys[0], PLATE]).collect();
    square.extend((0..ny).map(|k| [xs[nx], ys[k], PLATE]));
    square.extend((0..nx).map(|k| [xs[nx - k], ys[ny], PLATE]));
    square.extend((0..ny).map(|k| [xs[0], ys[ny - k], PLATE]));
    let ring = |r: f64, z: f64, turn: f64| -> Vec<V3> {
        (0..PIN_SIDES)
            .map(|k| {
                let a = std::f64::consts::TAU * (k as f64 + turn) / PIN_SIDES as f64 - 0.75 * std::f64::consts::PI;
                [cx + r * a.cos(), cy + r * a.sin(), z]
            })
            .collect()
    };
    let mut out = Vec::new();
    let rings = (height / 1.2).ceil() as usize;
    let mut below = square;
    for k in 0..=rings {
        let above = ring(radius, PLATE + height * k as f64 / rings as f64, 0.5 * (k % 2) as f64);
        bridge(&below, &above, &mut out);
        below = above;
    }
    let top = PLATE + height;
    let inner = ring(0.5 * radius, top, 0.5 * ((rings + 1) % 2) as f64);
    bridge(&below, &inner, &mut out);
    for k in 0..PIN_SIDES {
        out.push([inner[k], inner[(k + 1) % PIN_SIDES], [cx, cy, top]]);
    }
    out
}

/// Triangles between two closed loops that run the same way round, outside to inside, by merging their angles.
fn bridge(outer: &[V3], inner: &[V3], out: &mut Vec<Triangle>) {
    let angle = |p: V3, first: V3| {
        let a = |q: V3| (q[1] - PIN.0[1]).atan2(q[0] - PIN.0[0]);
        (a(p) - a(first) + 1e-9).rem_euclid(std::f64::consts::TAU)
    };
    let (n, m) = (outer.len(), inner.len());
    // start the inner loop at its first point past the start of the outer one
    let start = (0..m).min_by(|&a, &b| angle(inner[a], outer[0]).total_cmp(&angle(inner[b], outer[0]))).unwrap_or(0);
    let inner: Vec<V3> = (0..m).map(|k| inner[(start + k) % m]).collect();
    let (mut i, mut j) = (0, 0);
    while i < n || j < m {
        let mid = |l: &[V3], k: usize| {
            let turn = std::f64::consts::TAU * f64::from(u8::from(k + 1 >= l.len()));
            angle(l[k % l.len()], outer[0]) + angle(l[(k + 1) % l.len()], outer[0]) + turn
        };
        if j >= m || (i < n && mid(outer, i) <= mid(&inner, j)) {
            out.push([outer[i % n], outer[(i + 1) % n], inner[j % m]]);
            i += 1;
        } else {
            out.push([outer[i % n], inner[(j + 1) % m], inner[j % m]]);
            j += 1;
        }
    }
}

fn write_stl(path: &Path, triangles: &[Triangle]) -> std::io::Result<()> {
    let mut bytes = vec![0u8; 80];
    bytes[..30].copy_from_slice(b"armesh example part, unit: mm ");
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for t in triangles {
        bytes.extend([0u8; 12]); // readers take the normal from the winding
        bytes.extend(t.iter().flatten().flat_map(|&c| (c as f32).to_le_bytes()));
        bytes.extend([0u8; 2]);
    }
    std::fs::File::create(path)?.write_all(&bytes)
}

fn main() -> std::io::Result<()> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "examples/parts".into());
    let triangles: Vec<Triangle> = skin().into_iter().chain(pin()).collect();
    let path = Path::new(&folder).join("bracket.stl");
    write_stl(&path, &triangles)?;
    println!("{}: {} triangles", path.display(), triangles.len());
    Ok(())
}
