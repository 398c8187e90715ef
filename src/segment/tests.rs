use super::testshapes::{Composite, adjusted_rand, composites, dumbbell, plate_with_pins, t_beam};
use super::*;
use crate::job::CancelToken;
use crate::mesh::measure::scale;
use crate::mesh::{MeshOptions, shapes};
use std::f64::consts::PI;

fn run_on(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    options: &SegmentOptions,
    threads: usize,
) -> Result<Segmentation> {
    let job = Job::new(threads, None, CancelToken::default());
    job.run(None, || {
        let mesh = TriMesh::new(&(positions, triangles), &MeshOptions::default(), &job)?;
        segment(&mesh, options, &job)
    })
}

fn run(shape: &Composite, options: &SegmentOptions) -> Segmentation {
    run_on(&shape.positions, &shape.triangles, options, 2).unwrap()
}

/// The composites at the width that the figures are given for, made once.
fn standard() -> &'static [Composite] {
    static MADE: std::sync::OnceLock<Vec<Composite>> = std::sync::OnceLock::new();
    MADE.get_or_init(|| composites(1.0))
}

/// Their partitions.
fn standard_found() -> &'static [Segmentation] {
    static FOUND: std::sync::OnceLock<Vec<Segmentation>> = std::sync::OnceLock::new();
    FOUND.get_or_init(|| standard().iter().map(|shape| run(shape, &partition_only())).collect())
}

fn partition_only() -> SegmentOptions {
    SegmentOptions { measure: false, ..SegmentOptions::default() }
}

#[test]
fn composites_fall_into_their_parts_by_themselves() {
    for (shape, out) in standard().iter().zip(standard_found()) {
        let index = adjusted_rand(&out.face_segment, &shape.label);
        eprintln!("{}: {} faces, {} segments, index {index:.4}", shape.name, shape.triangles.len(), out.segments.len());
        assert!(index >= 0.9, "{}: {index} with {} segments", shape.name, out.segments.len());
    }
}

#[test]
fn walls_of_one_or_two_cells_with_faces_turned_over_fall_into_their_parts() {
    for shape in composites(1.5) {
        let out = run(&shape, &partition_only());
        let index = adjusted_rand(&out.face_segment, &shape.label);
        assert!(index >= 0.8, "{}: {index} with {} segments", shape.name, out.segments.len());
    }
}

#[test]
fn the_methods_agree_at_equal_number_of_parts() {
    for shape in [dumbbell(2.0), t_beam(2.5)] {
        let count = Some(shape.label.iter().max().unwrap() + 1);
        let by = |method| run(&shape, &SegmentOptions { method, count, ..partition_only() }).face_segment;
        let (paper, landmarks, creases) = (by(Method::Paper), by(Method::Landmarks), by(Method::Creases));
        let sampled = adjusted_rand(&paper, &landmarks);
        let default = adjusted_rand(&paper, &creases);
        eprintln!("{}: paper-landmarks {sampled:.3} paper-creases {default:.3}", shape.name);
        assert!(sampled >= 0.9, "{}: {sampled}", shape.name);
    }
}

#[test]
fn turned_scaled_and_renumbered_parts_fall_into_the_same_parts() {
    for (shape, first) in standard().iter().zip(standard_found()) {
        // two parts of the cross are equal in size, so their numbers may change places
        let (least, numbered) = (0.98, shape.name != "cross of tubes");
        let turn = |p: &Vec3| {
            let (s, c) = 0.7f64.sin_cos();
            let q = [c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]];
            let (s, c) = 1.1f64.sin_cos();
            [q[0], c * q[1] - s * q[2], s * q[1] + c * q[2]]
        };
        let turned: Vec<Vec3> = shape.positions.iter().map(turn).collect();
        let out = run_on(&turned, &shape.triangles, &partition_only(), 2).unwrap();
        let index = adjusted_rand(&out.face_segment, &first.face_segment);
        eprintln!("{} turned: {index:.4}", shape.name);
        assert!(index >= least, "{} turned: {index}", shape.name);
        // in another unit, vertices and faces in another order, faces begun at another corner
        let (n, m) = (shape.positions.len(), shape.triangles.len());
        let place = |v: usize| (v * 7919 + 13) % n;
        assert!(n % 7919 != 0 && m % 7907 != 0);
        let mut positions = vec![[0.0; 3]; n];
        (0..n).for_each(|v| positions[place(v)] = scale(shape.positions[v], 1e4));
        let face = |f: usize| (f * 7907 + 5) % m;
        let triangles: Vec<[u32; 3]> = (0..m)
            .map(|f| {
                let t = shape.triangles[face(f)].map(|v| place(v as usize) as u32);
                [t[f % 3], t[(f + 1) % 3], t[(f + 2) % 3]]
            })
            .collect();
        let out = run_on(&positions, &triangles, &partition_only(), 2).unwrap();
        let before: Vec<u32> = (0..m).map(|f| first.face_segment[face(f)]).collect();
        let index = adjusted_rand(&out.face_segment, &before);
        eprintln!("{} renumbered: {index:.4}", shape.name);
        assert!(index >= least, "{} renumbered: {index}", shape.name);
        let same = before.iter().zip(&out.face_segment).filter(|(a, b)| a == b).count();
        assert!(!numbered || same as f64 >= 0.98 * m as f64, "{}: numbers of segments moved", shape.name);
    }
}

#[test]
fn thread_counts_do_not_matter() {
    let shape = t_beam(2.5);
    for method in [Method::Creases, Method::Paper, Method::Landmarks] {
        let options = SegmentOptions { method, ..SegmentOptions::default() };
        let one = run_on(&shape.positions, &shape.triangles, &options, 1).unwrap();
        let three = run_on(&shape.positions, &shape.triangles, &options, 3).unwrap();
        assert_eq!(one.face_segment, three.face_segment);
        assert_eq!(format!("{:?}", one.segments), format!("{:?}", three.segments));
    }
}

#[test]
fn measures_of_a_plate_with_pins() {
    let shape = plate_with_pins(1.0);
    let out = run(&shape, &SegmentOptions::default());
    assert_eq!(out.segments.len(), 7);
    let total: u32 = out.segments.iter().map(|s| s.faces).sum();
    assert_eq!(total as usize, shape.triangles.len());
    let plate = &out.segments[0];
    assert_eq!(plate.neighbours, [1, 2, 3, 4, 5, 6]);
    assert_eq!((plate.handles, plate.ring), (0, false));
    assert!((plate.d2_median / 4.0 - 1.0).abs() < 0.02, "{plate:?}");
    // by falling area: the thickest pin comes first
    for (k, pin) in out.segments[1..].iter().enumerate() {
        let radius = 2.0 + 0.3 * (5 - k) as f64;
        assert_eq!(pin.neighbours, [0]);
        assert!((pin.area / (PI * radius * (radius + 30.0)) - 1.0).abs() < 0.05, "{pin:?}");
        assert!((pin.boundary_length / (2.0 * PI * radius) - 1.0).abs() < 0.25, "{pin:?}");
        assert!((pin.d2_median / (2.0 * radius) - 1.0).abs() < 0.05, "{pin:?}");
        // from the foot over the top to the foot on the other side, or around: at least the height and the radius
        assert!(
            pin.d1_max > 15.0 + radius && pin.d1_max < 1.05 * (15.0f64.hypot(PI * radius)).max(15.0 + 2.0 * radius),
            "{pin:?}"
        );
        assert!((pin.ratio_max - pin.d1_max / pin.d2_max).abs() < 1e-12);
        assert!(pin.bounds[1][2] > 14.9 && pin.bounds[0][2] > -0.5, "{pin:?}");
    }
}

/// A rod of radius 1 bent around a circle of radius 10 through `angle`; closed when that is a full turn.
fn bent_rod(angle: f64) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let closed = angle > 2.0 * PI - 1e-9;
    let (along, around) = ((angle * 10.0 / 0.5) as usize, 16usize);
    let rows = if closed { along } else { along + 1 };
    let (mut p, mut t) = (Vec::new(), Vec::new());
    for i in 0..rows {
        let a = angle * i as f64 / along as f64;
        for j in 0..around {
            let b = 2.0 * PI * j as f64 / around as f64;
            let r = 10.0 + b.cos();
            p.push([r * a.cos(), r * a.sin(), b.sin()]);
        }
    }
    let v = |i: usize, j: usize| (i % rows * around + j % around) as u32;
    for i in 0..along {
        for j in 0..around {
            t.extend([[v(i, j), v(i + 1, j), v(i + 1, j + 1)], [v(i, j), v(i + 1, j + 1), v(i, j + 1)]]);
        }
    }
    if !closed {
        for (row, flip) in [(0, false), (along, true)] {
            let a = angle * row as f64 / along as f64;
            p.push([10.0 * a.cos(), 10.0 * a.sin(), 0.0]);
            let c = p.len() as u32 - 1;
            for j in 0..around {
                let (x, y) = (v(row, j), v(row, j + 1));
                t.push(if flip { [c, y, x] } else { [c, x, y] });
            }
        }
    }
    (p, t)
}

#[test]
fn a_closed_ring_is_told_from_open_bars_of_the_same_length() {
    for degrees in [180.0, 270.0, 330.0, 350.0] {
        let (p, t) = bent_rod(degrees / 180.0 * PI);
        let out = run_on(&p, &t, &SegmentOptions::default(), 2).unwrap();
        assert_eq!(out.segments.len(), 1, "{degrees}");
        let s = &out.segments[0];
        assert!(!s.ring && s.handles == 0 && s.loop_length.is_nan(), "{degrees}: {s:?}");
        let length = degrees / 180.0 * PI * 10.0;
        assert!(s.d1_max > 0.88 * length && s.d1_max < 1.12 * length, "{degrees}: {s:?}");
    }
    let (p, t) = bent_rod(2.0 * PI);
    let out = run_on(&p, &t, &SegmentOptions::default(), 2).unwrap();
    let s = &out.segments[0];
    assert!(out.segments.len() == 1 && s.ring && s.handles == 1, "{s:?}");
    // between the inner and the outer equator
    assert!(s.loop_length > 2.0 * PI * 9.0 && s.loop_length < 2.0 * PI * 11.5, "{s:?}");
}

#[test]
fn a_pipe_and_a_plate_with_a_hole_are_no_rings() {
    use super::ring::{handles, is_ring};
    // a torus stretched into a pipe: nested circles
    let (n, m) = (40usize, 48usize);
    let mut p = Vec::new();
    for i in 0..n {
        let b = 2.0 * PI * i as f64 / n as f64;
        let (r, z) = (5.0 + b.cos() * 0.5, 20.0 * b.sin());
        for j in 0..m {
            let a = 2.0 * PI * j as f64 / m as f64;
            p.push([r * a.cos(), r * a.sin(), z]);
        }
    }
    let v = |i: usize, j: usize| (i % n * m + j % m) as u32;
    let t: Vec<[u32; 3]> = (0..n * m)
        .flat_map(|k| {
            let (i, j) = (k / m, k % m);
            [[v(i, j), v(i, j + 1), v(i + 1, j + 1)], [v(i, j), v(i + 1, j + 1), v(i + 1, j)]]
        })
        .collect();
    assert_eq!(handles(&t), 1);
    // height stands in for the distance from the lower rim
    let field: Vec<f64> = p.iter().map(|q| q[2] + 20.0).collect();
    assert!(!is_ring(&p, &t, &field));
    assert_eq!(handles(&shapes::icosphere(1).1), 0);
}

#[test]
fn the_dense_method_refuses_large_meshes_and_small_budgets() {
    let (p, t) = shapes::icosphere(6);
    let options = SegmentOptions { method: Method::Paper, ..SegmentOptions::default() };
    match run_on(&p, &t, &options, 2) {
        Err(Error::Budget(m)) => assert!(m.contains("81920 faces"), "{m}"),
        other => panic!("{other:?}"),
    }
    let job = Job::new(1, Some(1 << 20), CancelToken::default());
    let out = job.run(None, || {
        let mesh = TriMesh::new(&(&p[..], &t[..]), &MeshOptions::default(), &Job::default())?;
        segment(&mesh, &SegmentOptions::default(), &job)
    });
    assert!(matches!(out, Err(Error::Budget(_))));
}

#[test]
fn odd_meshes_are_partitioned_without_harm() {
    let two = shapes::union(&[
        shapes::cuboid([1.0; 3]),
        (shapes::translated(shapes::cuboid([1.0; 3]).0, [3.0; 3]), shapes::cuboid([1.0; 3]).1),
    ]);
    let out = run_on(&two.0, &two.1, &SegmentOptions { count: Some(1), ..SegmentOptions::default() }, 2).unwrap();
    assert_eq!(out.segments.len(), 2, "shells stay apart");
    // three triangles on one edge, and one without area
    let p = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [2.0, 0.0, 0.0]];
    let t = [[0, 1, 2], [1, 0, 3], [0, 1, 4], [0, 1, 5]];
    for method in [Method::Creases, Method::Paper, Method::Landmarks] {
        let out = run_on(&p, &t, &SegmentOptions { method, ..SegmentOptions::default() }, 2).unwrap();
        assert_eq!(out.face_segment.len(), 4);
    }
    let (p, t) = shapes::moebius(40);
    for method in [Method::Creases, Method::Paper, Method::Landmarks] {
        let out = run_on(&p, &t, &SegmentOptions { method, count: Some(3), ..SegmentOptions::default() }, 2).unwrap();
        assert!(!out.segments.is_empty());
    }
    for wrong in [
        SegmentOptions { count: Some(0), ..SegmentOptions::default() },
        SegmentOptions { min_area: -0.1, ..SegmentOptions::default() },
        SegmentOptions { min_area: f64::NAN, ..SegmentOptions::default() },
        SegmentOptions {
            shares: Shares { geodesic: 0.0, angular: 0.0, volumetric: 0.0, epsilon: 0.1 },
            ..SegmentOptions::default()
        },
    ] {
        assert!(matches!(run_on(&p, &t, &wrong, 1), Err(Error::Argument(_))));
    }
}

#[test]
fn no_segments_are_smaller_than_asked_for_and_all_hang_together() {
    for shape in standard() {
        let out = run(shape, &SegmentOptions { min_area: 0.02, ..partition_only() });
        let total: f64 = out.segments.iter().map(|s| s.area).sum();
        assert!(out.segments.iter().all(|s| s.area >= 0.02 * total), "{}", shape.name);
        assert!(out.segments.windows(2).all(|w| w[0].area >= w[1].area * (1.0 - 1e-6)));
        let topology = Topology::new(&shape.positions, &shape.triangles).unwrap();
        let dual = Dual::new(&shape.positions, &shape.triangles, &topology).unwrap();
        let pieces =
            finish::segments(&dual, &out.face_segment, &ranks(&dual.centroid).unwrap(), (0.0, 0.0), None).unwrap();
        assert_eq!(*pieces.iter().max().unwrap() as usize + 1, out.segments.len());
    }
}

#[test]
fn a_raised_flag_stops_the_work() {
    let shape = t_beam(1.0);
    let job = Job::new(2, None, CancelToken::default());
    let mut calls = 0;
    let out = job.run(
        Some(&mut |_, _| {
            calls += 1;
            calls < 2
        }),
        || {
            let mesh =
                TriMesh::new(&(&shape.positions[..], &shape.triangles[..]), &MeshOptions::default(), &Job::default())?;
            segment(&mesh, &SegmentOptions::default(), &job)
        },
    );
    assert!(matches!(out, Err(Error::Cancelled)));
}

/// A prism on an outline around the origin that every ray from there meets once.
fn prism(outline: &[[f64; 2]], height: f64) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let n = outline.len() as u32;
    let level = |z: f64| outline.iter().chain(&[[0.0; 2]]).map(move |p| [p[0], p[1], z]);
    let around = |i: u32| {
        let (j, up) = ((i + 1) % n, n + 1);
        [[i, j, j + up], [i, j + up, i + up], [n + up, i + up, j + up], [n, j, i]]
    };
    (level(0.0).chain(level(height)).collect(), (0..n).flat_map(around).collect())
}

fn areas(outline: &[[f64; 2]], height: f64) -> Vec<f64> {
    let (positions, triangles) = prism(outline, height);
    let out = run_on(&positions, &triangles, &partition_only(), 2).unwrap();
    out.segments.iter().map(|s| s.area).collect()
}

#[test]
fn what_is_flush_with_its_body_is_cut_off_by_the_shortest_lines() {
    // five spikes of a star, each with its share of the middle, as its faces reach that far
    let star: Vec<[f64; 2]> = (0..10)
        .map(|k| (PI * k as f64 / 5.0, if k % 2 == 0 { 40.0 } else { 10.0 }))
        .map(|(a, r)| [r * a.cos(), r * a.sin()])
        .collect();
    let half = 10.0 * (PI / 5.0).sin();
    let spike = 2.0 * 40.0 * half + 2.0 * 6.0 * half.hypot(40.0 - 10.0 * (PI / 5.0).cos());
    let found = areas(&star, 6.0);
    assert_eq!(found.len(), 5, "{found:?}");
    assert!(found.iter().all(|a| (a / spike - 1.0).abs() < 1e-6), "{found:?}, not {spike}");
    // but a bent bar stays whole, and so does a plate with a notch
    let bent = [[-1.0, -1.0], [23.0, -1.0], [23.0, 1.0], [1.0, 1.0], [1.0, 15.0], [-1.0, 15.0]];
    assert_eq!(areas(&bent, 2.0).len(), 1);
    let notch = [[5.0, 20.0], [5.0, 15.0], [-5.0, 15.0], [-5.0, 20.0]];
    let notched = [&[[-50.0, -20.0], [50.0, -20.0], [50.0, 20.0]], &notch[..], &[[-50.0, 20.0]]].concat();
    let found = areas(&notched, 3.0);
    assert!(found[0] > 0.99 * found.iter().sum::<f64>(), "{found:?}");
}
