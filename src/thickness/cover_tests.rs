//! Widths of dense meshes, most of them not measured, against closed forms and against measuring each.

use super::shapes::*;
use super::wall::WallMesh;
use crate::job::{CancelToken, Job};

fn job(threads: usize) -> Job {
    Job::new(threads, None, CancelToken::default())
}

/// Widths at vertices and faces.
fn surface((p, t): &Shape, threads: usize) -> (Vec<f64>, Vec<f64>) {
    let job = job(threads);
    job.run(None, || WallMesh::new(p, t, &job)?.surface_widths(p, t, &job)).unwrap()
}

fn centroids((p, t): &Shape) -> Vec<[f64; 3]> {
    t.iter().map(|t| std::array::from_fn(|a| t.iter().map(|&v| p[v as usize][a]).sum::<f64>() / 3.0)).collect()
}

/// Every vertex and face is as wide as `exact` says of its place, where it says anything.
fn agrees(shape: &Shape, within: f64, exact: impl Fn([f64; 3]) -> Option<f64>) {
    let (vertices, faces) = surface(shape, 2);
    for (p, d) in shape.0.iter().chain(&centroids(shape)).zip(vertices.iter().chain(&faces)) {
        if let Some(exact) = exact(*p) {
            assert!((d / exact - 1.0).abs() <= within, "at {p:?}: {d}, not {exact}");
        }
    }
}

/// A plate 6 x 6 x 2 in cells of 0.05, its vertices moved by `f`.
fn plate(f: impl Fn([f64; 3]) -> [f64; 3]) -> Shape {
    mapped(moved_to_middle(cuboid([6.0, 6.0, 2.0], [120, 120, 1])), f)
}

fn moved_to_middle(shape: Shape) -> Shape {
    mapped(shape, |p| [p[0] - 3.0, p[1] - 3.0, p[2]])
}

fn radius(p: [f64; 3]) -> f64 {
    p[0].hypot(p[1])
}

#[test]
fn balls_and_the_flat_side_of_an_ellipsoid() {
    agrees(&icosphere(40), 0.01, |_| Some(2.0));
    let ellipsoid = mapped(icosphere(40), |p| [3.0 * p[0], 2.0 * p[1], p[2]]);
    agrees(&ellipsoid, 0.02, |p| (radius(p) < 0.1).then_some(2.0));
}

#[test]
fn a_needle_from_below_is_met_by_all_above_it() {
    let needle = plate(|p| if radius(p) < 0.01 && p[2] == 0.0 { [0.0, 0.0, 1.6] } else { p });
    agrees(&needle, 0.03, |p| match (p[2] == 2.0, radius(p)) {
        // the sphere between the upper side and the needle's end: r^2 = x^2 + (r - 0.4)^2
        (true, x) if x < 0.2 => Some((x * x + 0.16) / 0.4),
        (_, x) if x > 2.1 && p[0].abs() < 2.9 && p[1].abs() < 2.9 => Some(2.0),
        _ => None,
    });
}

#[test]
fn a_pin_flush_with_the_side_it_stands_in_is_as_wide_as_itself() {
    let moat = |p: [f64; 3]| (0.13..0.26).contains(&radius(p)) && p[2] == 2.0;
    let island = plate(|p| if moat(p) { [p[0], p[1], 1.0] } else { p });
    let (vertices, _) = surface(&island, 2);
    let mut on_top = 0;
    for (p, d) in island.0.iter().zip(&vertices).filter(|(p, _)| p[2] == 2.0) {
        if radius(*p) < 0.13 {
            assert!((0.15..0.45).contains(d), "at {p:?}: {d}");
            on_top += 1;
        } else if radius(*p) > 1.6 {
            assert!((d / 2.0 - 1.0).abs() < 0.02, "at {p:?}: {d}");
        }
    }
    assert!(on_top > 15);
}

#[test]
fn a_cone_grows_as_it_should() {
    // Twice as wide at one end as at the other, 12 long.
    let ring = round(2.0, 48);
    let cone = mapped(prism(&ring, [0.0; 2], 12.0, 90, 10), |p| {
        let s = 0.5 + p[2] / 24.0;
        [p[0] * s, p[1] * s, p[2]]
    });
    // The sphere that touches at height z has its centre on the axis, where the normal meets it.
    let slope = 1.0f64 / 24.0;
    agrees(&cone, 0.02, |p| {
        let inner = p[2] > 2.0 && p[2] < 10.0;
        inner.then(|| 2.0 * (0.5 + p[2] * slope) * (1.0 + slope * slope).sqrt())
    });
}

#[test]
fn filling_in_gives_what_measuring_gives() {
    let shape = mapped(icosphere(30), |p| [2.0 * p[0], p[1], p[2] * (0.6 + 0.2 * p[0])]);
    let (vertices, faces) = surface(&shape, 2);
    let own: Vec<u32> = (0..shape.1.len() as u32).collect();
    let job = job(2);
    let (v, f) = job
        .run(None, || {
            let walls = WallMesh::new(&shape.0, &shape.1, &job)?;
            let v = walls.vertex_widths(&shape.0, &shape.1, &own, &job)?.width;
            Ok((v, walls.point_widths(&centroids(&shape), &own, &job)?.width))
        })
        .unwrap();
    let mut change: Vec<f64> =
        vertices.iter().zip(&v).chain(faces.iter().zip(&f)).map(|(a, b)| (a / b - 1.0).abs()).collect();
    change.sort_by(f64::total_cmp);
    let at = |share: f64| change[(share * (change.len() - 1) as f64) as usize];
    assert!(at(0.5) < 0.01 && at(0.95) < 0.08, "{} {}", at(0.5), at(0.95));
    assert!(change.iter().any(|c| *c > 0.0), "nothing was filled in");
}

#[test]
fn threads_and_numbers_do_not_matter() {
    let shape = mapped(icosphere(30), |p| [2.0 * p[0], p[1], p[2] * (0.6 + 0.2 * p[0])]);
    let bits = |w: &(Vec<f64>, Vec<f64>)| w.0.iter().chain(&w.1).map(|x| x.to_bits()).collect::<Vec<_>>();
    let one = surface(&shape, 1);
    assert!([2, 5].iter().all(|&n| bits(&surface(&shape, n)) == bits(&one)));
}
