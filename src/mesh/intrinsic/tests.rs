use super::*;
use crate::job::CancelToken;

fn job() -> Job {
    Job::new(2, None, CancelToken::default())
}

/// Pseudo-random numbers in 0..1 (splitmix64).
fn random(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// A grid of n x n squares, stretched `stretch` times along x, with jittered vertices; flat.
fn sheet(n: usize, stretch: f64) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let mut state = 7;
    let mut positions = Vec::new();
    for i in 0..=n {
        for j in 0..=n {
            let inner = i > 0 && i < n && j > 0 && j < n;
            let mut jitter = || if inner { 0.6 * (random(&mut state) - 0.5) } else { 0.0 };
            positions.push([stretch * (i as f64 + jitter()), j as f64 + jitter(), 0.0]);
        }
    }
    let at = |i: usize, j: usize| (i * (n + 1) + j) as u32;
    let quads = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    let triangles = quads
        .flat_map(|(i, j)| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]);
    (positions, triangles.collect())
}

/// A closed ring of slivers: `n` sides, `height` tall, radius 1, with fans as caps.
fn prism(n: u32, height: f64) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let corner = |i: u32, z: f64| {
        let a = std::f64::consts::TAU * i as f64 / n as f64;
        [a.cos(), a.sin(), z]
    };
    let mut positions: Vec<_> = (0..n).map(|i| corner(i, 0.0)).chain((0..n).map(|i| corner(i, height))).collect();
    positions.extend([[0.0; 3], [0.0, 0.0, height]]);
    let triangles = (0..n).flat_map(|i| {
        let j = (i + 1) % n;
        [[i, j, n + j], [i, n + j, n + i], [j, i, 2 * n], [n + i, n + j, 2 * n + 1]]
    });
    (positions, triangles.collect())
}

/// Smallest sum of the cotangents opposite to an interior edge.
fn smallest_cot_sum(mesh: &IntrinsicMesh) -> f64 {
    let twin = twins(mesh.vertex_count, &mesh.triangles, Some(&mesh.lengths)).unwrap();
    let cot = |h: u32| {
        let [a, b, c] = mesh.lengths_from(h);
        (b * b + c * c - a * a) / (2.0 * double_area([a, b, c]))
    };
    let sums = (0..twin.len() as u32).filter(|&h| twin[h as usize] != NONE).map(|h| cot(h) + cot(twin[h as usize]));
    sums.fold(f64::INFINITY, f64::min)
}

#[test]
fn the_area_formula_is_herons_and_stable() {
    assert_eq!(double_area([3.0, 4.0, 5.0]), 12.0);
    assert_eq!(double_area([1.0, 1.0, 2.0]), 0.0);
    assert_eq!(double_area([1.0, 1.0, 3.0]), 0.0);
    // Base 1, height 1e-9, apex over the base's end: all six orders agree.
    let l = [1.0, 1e-9, (1.0f64 + 1e-18).sqrt()];
    for [i, j, k] in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        assert!((double_area([l[i], l[j], l[k]]) / 1e-9 - 1.0).abs() < 1e-6);
    }
}

#[test]
fn a_sheared_sheet_becomes_delaunay_and_keeps_its_area() {
    let (positions, triangles) = sheet(40, 5.0);
    let mut mesh = IntrinsicMesh::from_extrinsic(&positions, &triangles).unwrap();
    assert!((mesh.area() - 8000.0).abs() < 1e-9 * 8000.0);
    assert!(smallest_cot_sum(&mesh) < -1.0);
    assert!(mesh.flip_to_delaunay(&job()).unwrap() > 100);
    assert!(smallest_cot_sum(&mesh) >= -1e-9, "{}", smallest_cot_sum(&mesh));
    assert!((mesh.area() - 8000.0).abs() < 1e-9 * 8000.0);
    // In the plane an intrinsic edge is the straight line between its ends.
    for (t, l) in mesh.triangles.iter().zip(&mesh.lengths) {
        for k in 0..3 {
            let d = distance(positions[t[k] as usize], positions[t[(k + 1) % 3] as usize]);
            assert!((l[k] - d).abs() < 1e-9 * d);
        }
    }
    assert_eq!(mesh.clone().flip_to_delaunay(&job()).unwrap(), 0);
}

#[test]
fn slivers_round_a_corner_flip_into_edges_that_wind_around_it() {
    // The unrolled side of the prism is a strip that its perimeter is shorter than: edges must wrap around it.
    let (positions, triangles) = prism(64, 400.0);
    let mut mesh = IntrinsicMesh::from_extrinsic(&positions, &triangles).unwrap();
    let area = mesh.area();
    mesh.flip_to_delaunay(&job()).unwrap();
    assert!(smallest_cot_sum(&mesh) >= -1e-9, "{}", smallest_cot_sum(&mesh));
    assert!((mesh.area() / area - 1.0).abs() < 1e-9);
    assert_eq!(mesh.triangles.len(), triangles.len());
}

#[test]
fn neighbours_of_either_orientation_flip_alike() {
    let (positions, mut triangles) = sheet(20, 5.0);
    let mut plain = IntrinsicMesh::from_extrinsic(&positions, &triangles).unwrap();
    let flips = plain.flip_to_delaunay(&job()).unwrap();
    for t in triangles.iter_mut().skip(1).step_by(3) {
        t.swap(0, 2);
    }
    let mut mixed = IntrinsicMesh::from_extrinsic(&positions, &triangles).unwrap();
    assert!(mixed.flip_to_delaunay(&job()).unwrap() >= flips / 2);
    assert!(smallest_cot_sum(&mixed) >= -1e-9);
    let edges = |m: &IntrinsicMesh| {
        let mut e: Vec<_> = m
            .triangles
            .iter()
            .flat_map(|t| [0, 1, 2].map(|k| (t[k].min(t[(k + 1) % 3]), t[k].max(t[(k + 1) % 3]))))
            .collect();
        e.sort_unstable();
        e
    };
    assert_eq!(edges(&plain), edges(&mixed));
}

#[test]
fn a_moebius_strip_flips_except_at_a_seam() {
    // A flat strip of length 30 and width 1, closed with a half turn; intrinsic lengths are those of the strip.
    let n = 10u32;
    let (mut triangles, mut lengths) = (Vec::new(), Vec::new());
    let (long, diagonal) = (3.0, 10.0f64.sqrt());
    for i in 0..n {
        let next = |row: u32| if i + 1 < n { 2 * (i + 1) + row } else { 1 - row };
        let (a, b, c, d) = (2 * i, next(0), next(1), 2 * i + 1);
        triangles.extend([[a, b, c], [a, c, d]]);
        lengths.extend([[long, 1.0, diagonal], [diagonal, long, 1.0]]);
    }
    let mut mesh = IntrinsicMesh { vertex_count: 2 * n as usize, triangles, lengths };
    mesh.flip_to_delaunay(&job()).unwrap();
    assert!((mesh.area() - 30.0).abs() < 1e-9);
}

#[test]
fn boundary_and_non_manifold_edges_stay() {
    // Four half-planes as obtuse triangles on one edge, which no flip may touch.
    let mut positions = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]];
    positions.extend([[0.5, 0.1, 0.0], [0.5, -0.1, 0.0], [0.5, 0.0, 0.1], [0.5, 0.0, -0.1]]);
    let triangles: Vec<[u32; 3]> = (2..6).map(|v| [0, 1, v]).collect();
    let mut mesh = IntrinsicMesh::from_extrinsic(&positions, &triangles).unwrap();
    let before = mesh.clone();
    assert_eq!(mesh.flip_to_delaunay(&job()).unwrap(), 0);
    assert_eq!(mesh, before);
}

#[test]
fn mollification_adds_the_least_that_gives_the_margin() {
    // A square whose bottom side has a vertex in its middle, patched by a zero-area triangle.
    let positions = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0], [1.0, 0.0, 0.0]];
    let triangles = [[0, 1, 2], [0, 2, 3], [1, 0, 4]];
    let mut mesh = IntrinsicMesh::from_extrinsic(&positions, &triangles).unwrap();
    let margin = 1e-6 * mesh.mean_edge();
    let epsilon = mesh.mollify(1e-6);
    assert!((epsilon - margin).abs() < 1e-12);
    let slack = |l: &[f64; 3]| (0..3).map(|k| l[(k + 1) % 3] + l[(k + 2) % 3] - l[k]).fold(f64::INFINITY, f64::min);
    let least = mesh.lengths.iter().map(slack).fold(f64::INFINITY, f64::min);
    assert!((least - margin).abs() < 1e-12);
    assert!(mesh.area() > 4.0 && mesh.area() < 4.01);
    mesh.flip_to_delaunay(&job()).unwrap();
    assert!(mesh.lengths.iter().flatten().all(|l| l.is_finite() && *l > 0.0));
    // The middle vertex is joined to the corner opposite now, which halves the triangle above.
    assert!(mesh.triangles.iter().filter(|t| t.contains(&4)).count() >= 2);
    assert!(smallest_cot_sum(&mesh) >= -1e-9);
    // Nothing to do for a sound mesh.
    let (positions, triangles) = sheet(5, 1.0);
    let mut sound = IntrinsicMesh::from_extrinsic(&positions, &triangles).unwrap();
    assert_eq!(sound.mollify(1e-9), 0.0);
}

#[test]
fn zero_area_triangles_and_hostile_lengths_end() {
    let positions = [[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0; 3]];
    let triangles = [[0, 1, 2], [2, 1, 3], [0, 2, 3], [4, 0, 1], [4, 1, 0]];
    let mut mesh = IntrinsicMesh::from_extrinsic(&positions, &triangles).unwrap();
    mesh.flip_to_delaunay(&job()).unwrap();
    mesh.mollify(1e-6);
    mesh.flip_to_delaunay(&job()).unwrap();
    assert!(mesh.lengths.iter().flatten().all(|l| l.is_finite()));
    let state = &mut 3;
    let lengths = (0..200).map(|_| [0; 3].map(|_| random(state))).collect();
    let triangles = (0..200).map(|_| [0; 3].map(|_| (10.0 * random(state)) as u32)).collect();
    let mut noise = IntrinsicMesh { vertex_count: 10, triangles, lengths };
    noise.flip_to_delaunay(&job()).unwrap();
}

#[test]
fn bad_input_is_refused() {
    let square = [[0.0; 3], [1.0, 0.0, 0.0], [f64::NAN; 3]];
    assert!(matches!(IntrinsicMesh::from_extrinsic(&square, &[[0, 1, 3]]), Err(Error::Index(_))));
    assert!(matches!(IntrinsicMesh::from_extrinsic(&square, &[[0, 1, 2]]), Err(Error::NonFinite(_))));
    assert_eq!(IntrinsicMesh::from_extrinsic(&square, &[]).unwrap().mean_edge(), 0.0);
}
