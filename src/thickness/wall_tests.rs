//! The wall width against closed forms and properties.

use super::shapes::*;
use super::wall::{WallMesh, Walls};
use crate::job::{CancelToken, Job};

fn walls((p, t): &Shape) -> Walls {
    let own: Vec<u32> = (0..t.len() as u32).collect();
    let job = Job::new(2, None, CancelToken::default());
    job.run(None, || WallMesh::new(p, t, &job)?.vertex_widths(p, t, &own, &job)).unwrap()
}

/// Every vertex is as wide as `exact` says of its place.
fn agrees(shape: &Shape, within: f64, exact: impl Fn([f64; 3]) -> f64) {
    let found = walls(shape);
    for (p, d) in shape.0.iter().zip(found.width) {
        assert!((d / exact(*p) - 1.0).abs() <= within, "at {p:?}: {d}, not {}", exact(*p));
    }
}

fn both(mut a: Shape, b: Shape) -> Shape {
    let base = a.0.len() as u32;
    a.0.extend(b.0);
    a.1.extend(b.1.iter().map(|t| t.map(|v| v + base)));
    a
}

fn moved(shape: Shape, by: [f64; 3]) -> Shape {
    mapped(shape, |p| std::array::from_fn(|a| p[a] + by[a]))
}

fn inside_out(mut shape: Shape) -> Shape {
    shape.1.iter_mut().for_each(|t| t.swap(1, 2));
    shape
}

#[test]
fn slabs_and_bars_are_as_wide_as_they_are_thick_also_on_their_rims() {
    for n in [1, 5] {
        agrees(&cuboid([40.0, 30.0, 2.0], [n, n, n]), 2.5e-3, |_| 2.0);
        agrees(&cuboid([4.0, 3.0, 50.0], [n, n, n]), 2.5e-3, |_| 3.0);
        agrees(&mapped(cuboid([40.0, 30.0, 2.0], [n, n, n]), turned), 2.5e-3, |_| 2.0);
    }
}

#[test]
fn place_and_size_do_not_matter() {
    let slab = cuboid([40.0, 30.0, 2.0], [3, 3, 1]);
    for scale in [1e-9, 1e-3, 1e6, 1e12] {
        agrees(&mapped(slab.clone(), |p| p.map(|x| x * scale)), 2.5e-3, |_| 2.0 * scale);
    }
    agrees(&moved(slab, [4e6, -3e6, 7e6]), 3e-3, |_| 2.0);
}

#[test]
fn rods_balls_and_tubes_are_as_wide_as_their_walls() {
    agrees(&prism(&round(5.0, 64), [0.0; 2], 60.0, 12, 1), 0.01, |_| 5.0);
    agrees(&icosphere(24), 0.01, |_| 2.0);
    // A tube: the wall is 1 thick.
    let (outer, inner) = (round(12.0, 96), round(10.0, 96));
    let mut soup = Vec::new();
    for k in 0..96 {
        let l = (k + 1) % 96;
        let at = |c: &Vec<[f64; 2]>, k: usize, z: f64| [c[k][0], c[k][1], z];
        let mut quad = |a, b, c, d| soup.extend([[a, b, c], [a, c, d]]);
        let h = 20.0;
        quad(at(&outer, k, 0.0), at(&outer, l, 0.0), at(&outer, l, h), at(&outer, k, h));
        quad(at(&inner, l, 0.0), at(&inner, k, 0.0), at(&inner, k, h), at(&inner, l, h));
        quad(at(&outer, k, h), at(&outer, l, h), at(&inner, l, h), at(&inner, k, h));
        quad(at(&outer, l, 0.0), at(&outer, k, 0.0), at(&inner, k, 0.0), at(&inner, l, 0.0));
    }
    agrees(&weld(&soup), 0.012, |_| 1.0);
}

#[test]
fn each_arm_of_an_l_has_its_own_width() {
    // Arms 2 and 3 thick, 20 long, 10 deep, the concave edge at (2, 3).
    let l = [[0.0, 0.0], [20.0, 0.0], [20.0, 3.0], [2.0, 3.0], [2.0, 20.0], [0.0, 20.0]];
    let shape = prism(&l, [1.0, 1.5], 10.0, 1, 1);
    let found = walls(&shape);
    for (p, d) in shape.0.iter().zip(&found.width) {
        let exact = match (p[0], p[1]) {
            (20.0, _) => 3.0,
            (_, 20.0) | (2.0, 3.0) => 2.0, // at the concave edge the thinner arm
            _ => continue,
        };
        assert!((d / exact - 1.0).abs() < 5e-3, "at {p:?}: {d}, not {exact}");
    }
    // In the corner where the arms meet the sphere that touches both outer sides and the concave edge:
    // (2 - r)^2 + (3 - r)^2 = r^2.
    let r = 5.0 - 12f64.sqrt();
    for (p, d) in shape.0.iter().zip(&found.width) {
        if p[0] == 0.0 && p[1] == 0.0 {
            assert!(*d >= 2.0 * 0.99 && *d <= 2.0 * r * 1.01, "{d}");
        }
    }
}

#[test]
fn a_wedge_reads_the_width_of_its_body_on_its_edge() {
    // A blade 10 high over a base 4 wide: the inscribed circle of the triangle, also on the edge of the blade.
    let shape = prism(&[[-2.0, 0.0], [2.0, 0.0], [0.0, 10.0]], [0.0, 2.0], 60.0, 1, 1);
    let side = 104f64.sqrt();
    let circle = 4.0 * 10.0 / (4.0 + 2.0 * side);
    let found = walls(&shape);
    for (p, d) in shape.0.iter().zip(&found.width) {
        if p[1] == 10.0 {
            assert!((d / (2.0 * circle) - 1.0).abs() < 0.01, "at {p:?}: {d}, not {}", 2.0 * circle);
        }
        assert!(*d > 0.5 && *d < 2.02 * circle, "at {p:?}: {d}");
    }
}

#[test]
fn overlapping_boxes_are_as_wide_as_their_union() {
    // Two plates 3 thick that overlap by 1: together 5.
    let shape =
        both(cuboid([40.0, 30.0, 3.0], [4, 4, 1]), moved(cuboid([40.0, 30.0, 3.0], [4, 4, 1]), [0.0, 0.0, 2.0]));
    let found = walls(&shape);
    assert!(found.buried > 0 || found.width.iter().all(|d| !d.is_nan()));
    for (p, d) in shape.0.iter().zip(found.width) {
        if p[2] == 0.0 || p[2] == 5.0 {
            assert!((d / 5.0 - 1.0).abs() < 0.01, "at {p:?}: {d}");
        }
    }
    // Glued face to face: together 6.
    let shape =
        both(cuboid([40.0, 30.0, 3.0], [4, 4, 1]), moved(cuboid([40.0, 30.0, 3.0], [4, 4, 1]), [0.0, 0.0, 3.0]));
    for (p, d) in shape.0.iter().zip(walls(&shape).width) {
        if p[2] == 0.0 || p[2] == 6.0 {
            assert!((d / 6.0 - 1.0).abs() < 0.01, "at {p:?}: {d}");
        }
    }
}

#[test]
fn a_hollow_box_is_as_wide_as_its_walls() {
    let hole = moved(inside_out(cuboid([16.0, 16.0, 16.0], [3, 3, 3])), [2.0; 3]);
    let shape = both(cuboid([20.0, 20.0, 20.0], [3, 3, 3]), hole);
    let found = walls(&shape);
    for (p, d) in shape.0.iter().zip(found.width) {
        // At an outer corner or edge the sphere reaches to the hole's: between 2 and 2 + 2 sqrt 3 of the diagonal.
        let outer = p.iter().filter(|x| **x == 0.0 || **x == 20.0).count();
        if outer <= 1 {
            assert!((d / 2.0 - 1.0).abs() < 5e-3, "at {p:?}: {d}");
        } else {
            assert!((1.99..2.6).contains(&d), "at {p:?}: {d}");
        }
    }
}

#[test]
fn no_width_is_zero_where_struts_meet_a_block() {
    // The outside of three bars that cross: concave edges and corners everywhere.
    let bar = |size: [f64; 3]| moved(cuboid(size, [1, 1, 1]), size.map(|x| -x / 2.0));
    let cross = both(both(bar([2.0, 2.0, 20.0]), bar([2.0, 20.0, 2.0])), bar([20.0, 2.0, 2.0]));
    agrees(&cross, 5e-3, |_| 2.0);
    // One surface with the same shape: each bar's five free sides, cut where they meet.
    let mut soup = Vec::new();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let arm = cuboid([2.0, 2.0, 9.0], [1, 1, 1]);
            for t in &arm.1 {
                let corners = t.map(|v| arm.0[v as usize]);
                if corners.iter().any(|p| p[2] > 0.0) {
                    soup.push(corners.map(|p| {
                        let q = [p[0] - 1.0, p[1] - 1.0, p[2] + 1.0];
                        let q = if side < 0.0 { [-q[0], q[1], -q[2]] } else { q };
                        let mut out = [0.0; 3];
                        (0..3).for_each(|a| out[(a + axis) % 3] = q[a]);
                        out
                    }));
                }
            }
        }
    }
    let star = weld(&soup);
    assert_eq!((star.0.len(), star.1.len()), (8 + 24, 60));
    // At the eight corners in the middle the sphere that fits between the concave edges.
    let at_ends = |p: [f64; 3]| p.iter().any(|x| x.abs() > 5.0);
    agrees(&star, 5e-3, |p| if at_ends(p) { 2.0 } else { 8f64.sqrt() });
}

#[test]
fn a_box_with_a_pocket_has_thin_walls_around_it() {
    // A pocket 16 x 16 x 18 in a box of 20: walls and floor are 2.
    let shape = {
        let outer = cuboid([20.0; 3], [1, 1, 1]);
        let inner = moved(inside_out(cuboid([16.0, 16.0, 18.0], [1, 1, 1])), [2.0, 2.0, 2.0]);
        let mut soup: Vec<[[f64; 3]; 3]> = Vec::new();
        for s in [&outer, &inner] {
            let faces = s.1.iter().map(|t| t.map(|v| s.0[v as usize]));
            soup.extend(faces.filter(|t| t.iter().any(|p| p[2] < 20.0)));
        }
        let ring = |k: usize, r: f64| [[-r, -r], [r, -r], [r, r], [-r, r]][k % 4].map(|x| x + 10.0);
        for k in 0..4 {
            let at = |k, r| [ring(k, r)[0], ring(k, r)[1], 20.0];
            soup.extend([[at(k, 10.0), at(k + 1, 10.0), at(k + 1, 8.0)], [at(k, 10.0), at(k + 1, 8.0), at(k, 8.0)]]);
        }
        weld(&soup)
    };
    for (p, d) in shape.0.iter().zip(walls(&shape).width) {
        assert!((1.99..2.6).contains(&d), "at {p:?}: {d}");
    }
}

/// A lump with bumps, which has no two equal distances.
fn lump() -> Shape {
    mapped(icosphere(14), |p| {
        let bump = 1.0 + 0.07 * (5.0 * p[0]).sin() * (4.0 * p[1] + 0.3).cos() + 0.05 * (6.0 * p[2] + p[0]).sin();
        [2.7 * bump * p[0], 1.7 * bump * p[1], bump * p[2]]
    })
}

/// All but one in two hundred vertices, where the sphere has to choose, are as wide as before; those nearly.
fn unchanged(before: &[f64], after: &[f64], what: &str) {
    let mut change: Vec<f64> = before.iter().zip(after).map(|(a, b)| (b / a - 1.0).abs()).collect();
    change.sort_by(f64::total_cmp);
    let (most, usual) = (change[change.len() - 1], change[(change.len() - 1) * 199 / 200]);
    assert!(usual <= 1e-3 && most <= 0.02, "{what}: {usual} {most}");
}

#[test]
fn widths_do_not_depend_on_how_a_lump_lies_or_is_numbered() {
    let shape = lump();
    let before = walls(&shape).width;
    unchanged(&before, &walls(&mapped(shape.clone(), turned)).width, "turned");
    let twice = |p| turned(turned(turned(p)));
    unchanged(&before, &walls(&mapped(shape.clone(), twice)).width, "turned further");
    let mixed = renumbered(shape.clone()).0;
    let new_place = |p: &[f64; 3]| mixed.0.iter().position(|q| q == p).unwrap();
    let after = walls(&mixed).width;
    let after: Vec<f64> = shape.0.iter().map(|p| after[new_place(p)]).collect();
    unchanged(&before, &after, "renumbered");
}

/// Every triangle in four.
fn cut_in_four((p, t): &Shape) -> Shape {
    let mut soup = Vec::new();
    for t in t {
        let [a, b, c] = t.map(|v| p[v as usize]);
        let middle = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|k| (a[k] + b[k]) / 2.0);
        let (d, e, f) = (middle(a, b), middle(b, c), middle(c, a));
        soup.extend([[a, d, f], [d, b, e], [f, e, c], [d, e, f]]);
    }
    weld(&soup)
}

#[test]
fn widths_do_not_depend_on_how_the_surface_is_cut_into_triangles() {
    let hole = moved(inside_out(prism(&round(3.0, 24), [0.0; 2], 4.0, 1, 1)), [0.0, 0.0, 3.0]);
    for shape in [lump(), both(cuboid([9.0, 7.0, 12.0], [2, 2, 2]), moved(hole, [4.0, 3.0, 0.0]))] {
        let fine = cut_in_four(&cut_in_four(&shape));
        let (before, widths) = (walls(&shape).width, walls(&fine).width);
        let place = |p: &[f64; 3]| fine.0.iter().position(|q| q == p).unwrap();
        let after: Vec<f64> = shape.0.iter().map(|p| widths[place(p)]).collect();
        unchanged(&before, &after, "cut");
    }
}

/// A round plate of radius 10 and height 12 whose end faces are fans of `n` triangles; the middle of the upper one at
/// height `pit`.
fn disc(n: u32, pit: f64) -> Shape {
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

#[test]
fn fans_of_a_great_many_triangles_have_the_width_beneath_them() {
    for n in [32, 200, 600] {
        let (p, t) = disc(n, 12.0);
        let width = walls(&(p, t)).width;
        assert!(width.iter().all(|w| (w / 12.0 - 1.0).abs() < 0.01), "{n} {width:?}");
        // below the tip of a pit, between it and the end face: across where the sphere starts on one of its sides
        let (p, t) = disc(n, 6.0);
        let width = walls(&(p, t)).width;
        let slope = (10.0f64).hypot(6.0) / 10.0;
        let tip = width[2 * n as usize + 1];
        assert!((5.99..12.0 * slope / (1.0 + slope) * 1.01).contains(&tip), "{n} {tip}");
        assert!(width.iter().all(|w| (5.9..12.1).contains(w)), "{n} {width:?}");
    }
}

#[test]
fn widths_do_not_depend_on_threads() {
    let (p, t) = mapped(icosphere(12), |p| [p[0], p[1] * 0.4, p[2] * (0.5 + 0.2 * p[0])]);
    let own: Vec<u32> = (0..t.len() as u32).collect();
    let run = |threads| {
        let job = Job::new(threads, None, CancelToken::default());
        let found = job.run(None, || WallMesh::new(&p, &t, &job)?.vertex_widths(&p, &t, &own, &job)).unwrap();
        found.width.iter().map(|x| x.to_bits()).collect::<Vec<_>>()
    };
    let one = run(1);
    assert!([2, 5].iter().all(|&n| run(n) == one));
}
