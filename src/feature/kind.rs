//! What sort of thing a feature is, and the box it fits in.

use crate::mesh::measure::{Vec3, area_vector, corners, cross, dot, norm, scale, sub};

/// Sort of a feature.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Kind {
    /// About as thick as long and wide, or of no simple sort.
    #[default]
    Body,
    /// Long, and about as wide as thick: a pin, strut, hook or wire.
    Bar,
    /// Long and wide, and thin: a plate, fin, rib, web, tube or shell.
    Wall,
    /// A bar that closes on itself.
    Ring,
}

impl Kind {
    /// Lower-case name.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Body => "body",
            Kind::Bar => "bar",
            Kind::Wall => "wall",
            Kind::Ring => "ring",
        }
    }
}

/// From this many thicknesses on something is long.
const LONG: f64 = 2.5;
/// Up to this many thicknesses something is narrow.
const NARROW: f64 = 2.0;

/// Sort of something with this length, thickness and area, and its width: half of what a strip as long would be wide
/// that has the area, less its two rims.
pub fn classify(length: f64, thickness: f64, area: f64, ring: bool) -> (Kind, f64) {
    // a closed ring is twice as long as the longest way in it
    let unrolled = if ring { 2.0 * length } else { length };
    let girth = area / unrolled.max(f64::MIN_POSITIVE);
    let round = std::f64::consts::PI * thickness;
    let width = (0.5 * girth - thickness).max(thickness);
    let kind = if !(unrolled >= LONG * thickness) {
        Kind::Body
    } else if ring && girth <= NARROW * round {
        Kind::Ring
    } else if girth <= NARROW * round {
        Kind::Bar
    } else if width >= LONG * thickness {
        Kind::Wall
    } else {
        Kind::Body
    };
    (kind, if matches!(kind, Kind::Bar | Kind::Ring) { thickness.max(girth / std::f64::consts::PI) } else { width })
}

/// Different directions of faces that are told apart.
const DIRECTIONS: usize = 400;

/// A box in any position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrientedBox {
    /// Its centre.
    pub centre: Vec3,
    /// Its edges' unit directions, right-handed, the longest first.
    pub axes: [Vec3; 3],
    /// Its edges' lengths, falling.
    pub size: [f64; 3],
}

/// The smallest of some boxes around the faces: along the principal axes of their area, and along the directions most of
/// the area faces, as `guide`, the same mesh or one that stands in for it, has them.
pub fn oriented_box((positions, triangles): (&[Vec3], &[[u32; 3]]), guide: (&[Vec3], &[[u32; 3]])) -> OrientedBox {
    let mut frames = vec![principal(guide.0, guide.1)];
    frames.extend(facing(guide.0, guide.1));
    let boxes = frames.into_iter().map(|axes| fitted(positions, triangles, axes));
    let volume = |b: &OrientedBox| b.size[0] * b.size[1] * b.size[2];
    let smallest = boxes.reduce(|a, b| if volume(&b) < volume(&a) * (1.0 - 1e-6) { b } else { a });
    smallest.unwrap_or(OrientedBox { centre: [f64::NAN; 3], axes: [[f64::NAN; 3]; 3], size: [f64::NAN; 3] })
}

fn fitted(positions: &[Vec3], triangles: &[[u32; 3]], axes: [Vec3; 3]) -> OrientedBox {
    let mut range = [(f64::INFINITY, f64::NEG_INFINITY); 3];
    for &v in triangles.iter().flatten() {
        for k in 0..3 {
            let x = dot(positions[v as usize], axes[k]);
            range[k] = (range[k].0.min(x), range[k].1.max(x));
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| (range[b].1 - range[b].0).total_cmp(&(range[a].1 - range[a].0)));
    let mut centre = [0.0; 3];
    for k in 0..3 {
        let middle = 0.5 * (range[k].0 + range[k].1);
        (0..3).for_each(|i| centre[i] += middle * axes[k][i]);
    }
    let [a, b] = [axes[order[0]], axes[order[1]]];
    OrientedBox { centre, axes: [a, b, cross(a, b)], size: order.map(|k| range[k].1 - range[k].0) }
}

/// Two square directions that most area faces, one way or the other, and the third.
fn facing(positions: &[Vec3], triangles: &[[u32; 3]]) -> Option<[Vec3; 3]> {
    let vectors: Vec<Vec3> = triangles.iter().map(|&t| area_vector(corners(positions, t))).collect();
    let mut sums: Vec<(Vec3, f64)> = Vec::new();
    for v in vectors {
        let a = norm(v);
        if a > 0.0 {
            let n = scale(v, 1.0 / a);
            match sums.iter().position(|s| dot(s.0, n).abs() > 0.9999) {
                Some(k) => sums[k].1 += a,
                None if sums.len() < DIRECTIONS => sums.push((n, a)),
                None => {}
            }
        }
    }
    let most = |from: &mut dyn Iterator<Item = &(Vec3, f64)>| {
        from.fold((None, 0.0), |m, s| if s.1 > m.1 * (1.0 + 1e-9) { (Some(s.0), s.1) } else { m }).0
    };
    let a = most(&mut sums.iter())?;
    let b = most(&mut sums.iter().filter(|s| dot(s.0, a).abs() < 1e-3))?;
    let c = cross(a, b);
    let c = scale(c, 1.0 / norm(c));
    Some([a, cross(c, a), c])
}

/// Principal axes of the area: eigenvectors of its covariance, by Jacobi's rotations.
fn principal(positions: &[Vec3], triangles: &[[u32; 3]]) -> [Vec3; 3] {
    let (mut sum, mut whole) = ([0.0; 3], 0.0);
    let middles: Vec<(Vec3, f64)> = triangles
        .iter()
        .flat_map(|&t| {
            let p = corners(positions, t);
            let a = norm(area_vector(p)) / 3.0;
            // the middles of the sides integrate squares exactly
            (0..3).map(move |k| (scale([0, 1, 2].map(|i| p[k][i] + p[(k + 1) % 3][i]), 0.5), a))
        })
        .collect();
    for (p, a) in &middles {
        whole += a;
        (0..3).for_each(|i| sum[i] += a * p[i]);
    }
    let centre = scale(sum, 1.0 / whole.max(f64::MIN_POSITIVE));
    let mut m = [[0.0; 3]; 3];
    for (p, a) in &middles {
        let d = sub(*p, centre);
        (0..9).for_each(|k| m[k / 3][k % 3] += a * d[k / 3] * d[k % 3]);
    }
    let mut v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..16 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if m[p][q] == 0.0 {
                continue;
            }
            let angle = 0.5 * (2.0 * m[p][q]).atan2(m[q][q] - m[p][p]);
            let (s, c) = angle.sin_cos();
            for k in 0..3 {
                (m[k][p], m[k][q]) = (c * m[k][p] - s * m[k][q], s * m[k][p] + c * m[k][q]);
            }
            for k in 0..3 {
                (m[p][k], m[q][k]) = (c * m[p][k] - s * m[q][k], s * m[p][k] + c * m[q][k]);
                (v[p][k], v[q][k]) = (c * v[p][k] - s * v[q][k], s * v[p][k] + c * v[q][k]);
            }
        }
    }
    v
}
