use super::shapes::*;
use super::*;
use crate::job::CancelToken;
use rayon::prelude::*;
use std::f64::consts::PI;

fn job() -> Job {
    Job::new(1, None, CancelToken::default())
}

fn solve(mesh: &Mesh, source: SurfacePoint, queries: &[SurfacePoint]) -> Distances {
    let solver = ExactGeodesics::new(&mesh.0, &mesh.1).unwrap();
    solver.distances(source, queries, &Limits::default(), &mut Scratch::default(), &job()).unwrap()
}

fn from_vertex(mesh: &Mesh, source: u32) -> Vec<f64> {
    let d = solve(mesh, SurfacePoint::Vertex(source), &[]);
    assert!(d.complete);
    d.vertices
}

fn close(a: f64, b: f64) {
    assert!((a - b).abs() <= 1e-10 * b.abs().max(1.0), "{a} is not {b}");
}

fn all_close(a: &[f64], b: &[f64]) {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).for_each(|(a, b)| close(*a, *b));
}

fn at(face: u32, weights: [f64; 3]) -> SurfacePoint {
    SurfacePoint::Face { face, weights }
}

fn centroid(face: u32) -> SurfacePoint {
    at(face, [1.0, 1.0, 1.0])
}

// --- closed forms

#[test]
fn box_corner_to_corner() {
    // The shortest of the unfoldings goes over the two shorter sides side by side.
    close(from_vertex(&cuboid([1.0, 1.0, 1.0]), 0)[7], 5f64.sqrt());
    for size in [[1.0, 2.0, 3.0], [3.0, 1.0, 2.0], [2.0, 3.0, 1.0]] {
        close(from_vertex(&cuboid(size), 0)[7], 18f64.sqrt());
    }
    close(from_vertex(&cuboid([100.0, 100.0, 1e-3]), 0)[7], (100f64.powi(2) + 100.001f64.powi(2)).sqrt());
}

#[test]
fn box_between_points_inside_faces() {
    // On the 1 x 1 x 1 cube; the bottom's diagonal runs 0-3, the top's 4-7.
    let cube = cuboid([1.0, 1.0, 1.0]);
    let bottom = at(0, [0.5, 0.0, 0.5]);
    let same = at(0, [0.25, 0.75, 0.0]);
    let queries = [at(2, [0.5, 0.0, 0.5]), centroid(2), same, at(0, [0.1, 0.1, 0.8]), SurfacePoint::Vertex(7)];
    let d = solve(&cube, bottom, &queries);
    close(d.queries[0], 2.0);
    // Face 2 is (4, 5, 7): its centroid (2/3, 1/3, 1) is nearest across the side x = 1 or y = 0, straight or around.
    close(d.queries[1], (1.0 + 0.5 + 1.0 / 3.0f64).hypot(1.0 / 6.0));
    close(d.queries[2], 0.5f64.hypot(0.25));
    // Face 0 is (0, 2, 3): weights (0.1, 0.1, 0.8) are the point (0.8, 0.9).
    close(d.queries[3], 0.3f64.hypot(0.4));
    close(d.queries[4], 1.5f64.hypot(0.5));
    // A source on an edge, a query on an edge and in the same face.
    let d = solve(&cube, at(0, [0.75, 0.25, 0.0]), &[at(0, [0.25, 0.75, 0.0]), at(2, [0.5, 0.0, 0.5])]);
    close(d.queries[0], 0.5);
    close(d.queries[1], 1.5f64.hypot(0.25));
}

#[test]
fn tetrahedron_diameter() {
    let s = 0.5f64.sqrt();
    let mesh: Mesh = (
        vec![[0.5, 0.0, -0.5 * s], [-0.5, 0.0, -0.5 * s], [0.0, 0.5, 0.5 * s], [0.0, -0.5, 0.5 * s]],
        vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 2, 3]],
    );
    let d = solve(&mesh, SurfacePoint::Vertex(0), &[centroid(3), centroid(0)]);
    all_close(&d.vertices, &[0.0, 1.0, 1.0, 1.0]);
    close(d.queries[0], 2.0 / 3f64.sqrt());
    close(d.queries[1], 1.0 / 3f64.sqrt());
}

#[test]
fn cone_unfolds_to_a_fan() {
    // 24 faces around an apex of height h; around the rim points are 2 L sin(angle / 2) apart in the unfolded fan.
    for h in [0.3, 1.0, 4.0] {
        let n = 24u32;
        let rim = |i: u32| 2.0 * PI * i as f64 / n as f64;
        let mut positions: Vec<[f64; 3]> = (0..n).map(|i| [rim(i).cos(), rim(i).sin(), 0.0]).collect();
        positions.push([0.0, 0.0, h]);
        let mesh = (positions, (0..n).map(|i| [i, (i + 1) % n, n]).collect());
        let slant = (1.0 + h * h).sqrt();
        let wedge = 2.0 * ((PI / n as f64).sin() / slant).asin();
        let d = from_vertex(&mesh, 0);
        for k in 0..=n / 2 {
            close(d[k as usize], 2.0 * slant * (0.5 * (k as f64 * wedge)).sin());
        }
        close(d[n as usize], slant);
    }
}

#[test]
fn plate_with_a_hole_bends_at_its_corners() {
    // [-2, 2]^2 less [-1, 1]^2 in 16 squares of which 4 are missing, with alternating diagonals.
    let positions = (0..25).map(|i| [(i % 5) as f64 - 2.0, (i / 5) as f64 - 2.0, 0.0]).collect();
    let mut faces = Vec::new();
    for (i, j) in (0..4u32).flat_map(|i| (0..4).map(move |j| (i, j))) {
        let (a, b, c, d) = (j * 5 + i, j * 5 + i + 1, j * 5 + i + 6, j * 5 + i + 5);
        if !((1..3).contains(&i) && (1..3).contains(&j)) {
            faces.extend(if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
        }
    }
    let d = from_vertex(&(positions, faces), 10);
    close(d[14], 2.0 + 2.0 * 2f64.sqrt());
    close(d[24], 2f64.sqrt() + 10f64.sqrt());
    close(d[4], 2f64.sqrt() + 10f64.sqrt());
    close(d[11], 1.0);
    assert!(d[12].is_infinite(), "the vertex in the hole belongs to no face");
}

// --- defects

#[test]
fn pages_of_a_book_share_a_spine() {
    // Five pages of width 1 on the edge 0-1 of length 4, faces of either orientation.
    let mut mesh: Mesh = (vec![[0.0; 3], [0.0, 0.0, 4.0]], Vec::new());
    for i in 0..5u32 {
        let a = i as f64;
        mesh.0.extend([[a.cos(), a.sin(), 0.0], [a.cos(), a.sin(), 4.0]]);
        let (low, high) = (2 + 2 * i, 3 + 2 * i);
        mesh.1.extend(if i % 2 == 0 { [[0, low, 1], [low, high, 1]] } else { [[1, low, 0], [low, high, 1]] });
    }
    let d = from_vertex(&mesh, 2);
    close(d[3], 4.0);
    for i in 1..5 {
        close(d[2 + 2 * i], 2.0);
        close(d[3 + 2 * i], 20f64.sqrt());
    }
    let d = solve(&mesh, at(1, [0.25, 0.5, 0.25]), &[at(2, [0.0, 0.5, 0.5]), at(0, [0.1, 0.3, 0.6])]);
    // Source 0.75 from the spine at z = 3; query on the rim of page 1, 0.5 from the spine; and on page 0 (0.3, z = 2.4).
    close(d.queries[0], 1.25f64.hypot(3.0));
    close(d.queries[1], 0.45f64.hypot(0.6));
}

#[test]
fn flat_faces_are_bridges() {
    // A square [0,2] x [-1,1]: below one face on the long edge 0-1, above four on its quarters, between them three
    // zero-area faces that fan from vertex 0.
    let positions: Vec<[f64; 3]> = vec![
        [0.0, 0.0, 0.0],
        [2.0, 0.0, 0.0],
        [0.5, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.5, 0.0, 0.0],
        [1.0, -1.0, 0.0],
        [0.0, 1.0, 0.0],
        [2.0, 1.0, 0.0],
        [0.3, -0.2, 0.0],
    ];
    let faces = vec![
        [0, 1, 8],
        [1, 5, 8],
        [5, 0, 8],
        [0, 4, 1],
        [0, 3, 4],
        [0, 2, 3],
        [0, 2, 6],
        [2, 3, 6],
        [3, 7, 6],
        [3, 4, 7],
        [4, 1, 7],
    ];
    let mesh = (positions, faces);
    // The outline is convex, so all distances are straight ones; turned, so that heights are not exactly 0.
    let turned =
        (mesh.0.iter().map(|p| [0.6 * p[0] - 0.8 * p[1], 0.8 * p[0] + 0.6 * p[1], 7.0]).collect(), mesh.1.clone());
    for mesh in [&mesh, &turned] {
        for source in 0..9 {
            let d = from_vertex(mesh, source);
            (0..9).for_each(|v| close(d[v], norm(sub(mesh.0[source as usize], mesh.0[v]))));
        }
        // The source is the point x = 0.95 of the common line, inside a zero-area face.
        let queries = [SurfacePoint::Vertex(5), SurfacePoint::Vertex(7), centroid(5)];
        all_close(&solve(mesh, at(4, [0.2, 0.5, 0.3]), &queries).queries, &[1f64.hypot(0.05), 1f64.hypot(1.05), 0.45]);
    }
}

#[test]
fn a_bend_is_seen_through_a_flat_face() {
    // Seven faces of 60 degrees around vertex 0, five in the plane and two upright: paths bend there.
    let mut mesh: Mesh = (vec![[0.0; 3]], Vec::new());
    for i in 0..6 {
        let a = (i as f64 * 60.0).to_radians();
        mesh.0.push([a.cos(), a.sin(), 0.0]);
    }
    mesh.0.push([0.5, -0.75f64.sqrt() / 3.0, (2.0f64 / 3.0).sqrt()]);
    mesh.1.extend((1..6).map(|i| [0, i, i + 1]));
    mesh.1.extend([[0, 6, 7], [0, 7, 1]]);
    // Vertex 8 halves the edge 0-4 and a zero-area face replaces the seam.
    let p = mesh.0[4];
    mesh.0.push([0.5 * p[0], 0.5 * p[1], 0.0]);
    mesh.1.retain(|t| *t != [0, 4, 5]);
    mesh.1.extend([[0, 8, 4], [0, 8, 5], [8, 4, 5]]);
    // The same surface without that vertex.
    let mut plain = mesh.clone();
    plain.0.pop();
    plain.1.retain(|t| !t.contains(&8));
    plain.1.push([0, 4, 5]);
    for source in 0..8 {
        all_close(&from_vertex(&mesh, source)[..8], &from_vertex(&plain, source));
    }
}

#[test]
fn flat_faces_beside_saddles_and_creases_change_nothing() {
    let plain = ruin();
    let mut hinged = plain.clone();
    assert!(unhinge(&mut hinged) >= 5);
    for source in 0..plain.0.len() as u32 {
        all_close(&from_vertex(&hinged, source), &from_vertex(&plain, source));
    }
}

#[test]
fn edges_of_length_zero_are_points() {
    // The cube with vertex 7 doubled: face (7, 7', 5) and (7, 7', 6) close the gap.
    let mut mesh = cuboid([1.0, 1.0, 1.0]);
    mesh.0.push(mesh.0[7]);
    for t in mesh.1.iter_mut().filter(|t| t.contains(&1)) {
        t.iter_mut().for_each(|v| *v = if *v == 7 { 8 } else { *v });
    }
    mesh.1.extend([[7, 8, 5], [7, 3, 8]]);
    let last = mesh.1.len() as u32 - 1;
    let d = solve(&mesh, SurfacePoint::Vertex(0), &[at(last, [0.25, 0.5, 0.25]), at(last, [0.5, 0.0, 0.5])]);
    all_close(&d.vertices[..8], &from_vertex(&cuboid([1.0, 1.0, 1.0]), 0));
    close(d.vertices[8], 5f64.sqrt());
    // Half way along the edge 7-3 (x = y = 1, z = 1/2), and the doubled point.
    close(d.queries[0], 1.5f64.hypot(1.0));
    close(d.queries[1], 5f64.sqrt());
}

#[test]
fn shells_are_apart() {
    let (a, b) = (cuboid([1.0, 1.0, 1.0]), cuboid([2.0, 2.0, 2.0]));
    let mut mesh = a.clone();
    mesh.0.extend(b.0);
    mesh.0.push([9.0; 3]);
    mesh.1.extend(b.1.iter().map(|t| t.map(|v| v + 8)));
    let d = solve(&mesh, SurfacePoint::Vertex(8), &[centroid(0), centroid(20)]);
    assert!(d.vertices[..8].iter().chain(&d.vertices[16..]).all(|d| d.is_infinite()));
    close(d.vertices[15], 20f64.sqrt());
    assert!(d.queries[0].is_infinite() && d.queries[1].is_finite());
    let lone = from_vertex(&mesh, 16);
    assert!(lone[16] == 0.0 && lone[..16].iter().all(|d| d.is_infinite()));
}

#[test]
fn everything_on_one_line_ends() {
    let positions: Vec<[f64; 3]> = (0..12).map(|i| [(i * i % 13) as f64, 0.0, 0.0]).collect();
    let faces: Vec<[u32; 3]> = (0..10).flat_map(|i| [[i, i + 1, i + 2], [i, (i + 5) % 12, i + 1]]).collect();
    let d = from_vertex(&(positions.clone(), faces), 0);
    d.iter().zip(&positions).for_each(|(d, p)| assert!(*d >= p[0] - 1e-12 && d.is_finite()));
}

#[test]
fn bad_input_is_refused() {
    let cube = cuboid([1.0, 1.0, 1.0]);
    let new = |mesh: &Mesh| ExactGeodesics::new(&mesh.0, &mesh.1).map(|_| ());
    let mut bad = cube.clone();
    bad.1[3][1] = 8;
    assert!(matches!(new(&bad), Err(Error::Index(l)) if l.first == 3 && l.count == 1));
    let mut bad = cube.clone();
    bad.0[2][1] = f64::NAN;
    assert!(matches!(new(&bad), Err(Error::NonFinite(l)) if l.first == 2));
    let solver = ExactGeodesics::new(&cube.0, &cube.1).unwrap();
    let try_source = |s| solver.distances(s, &[], &Limits::default(), &mut Scratch::default(), &job()).map(|_| ());
    for s in [SurfacePoint::Vertex(8), centroid(12), at(0, [0.0; 3]), at(0, [1.0, -0.1, 0.1]), at(0, [f64::NAN; 3])] {
        assert!(matches!(try_source(s), Err(Error::Argument(_))), "{s:?}");
    }
    let empty = ExactGeodesics::new(&[], &[]).unwrap();
    assert!(
        empty.distances(SurfacePoint::Vertex(0), &[], &Limits::default(), &mut Scratch::default(), &job()).is_err()
    );
}

// --- properties

#[test]
fn agrees_with_paths_through_points_on_edges() {
    // An independent bound from above: Dijkstra over the mesh with every edge cut in 12, faces crossed straight. The
    // second mesh has saddles in plenty and non-manifold edges and vertices.
    for mesh in [wavy_torus(14, 9), ruin()] {
        for source in [5, 20] {
            let d = from_vertex(&mesh, source);
            let steiner = steiner_distances(&mesh, source as usize, 12);
            for (d, s) in d.iter().zip(&steiner) {
                assert!(*d <= s + 1e-12 && *s <= 1.01 * d, "{d} {s}");
            }
        }
    }
}

fn steiner_distances(mesh: &Mesh, source: usize, cuts: usize) -> Vec<f64> {
    let mut points = mesh.0.clone();
    let mut on_edge = std::collections::BTreeMap::new();
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for t in &mesh.1 {
        let mut group: Vec<usize> = t.iter().map(|&v| v as usize).collect();
        for k in 0..3 {
            let (a, b) = (t[k].min(t[(k + 1) % 3]), t[k].max(t[(k + 1) % 3]));
            let first = *on_edge.entry((a, b)).or_insert_with(|| {
                let (p, q) = (mesh.0[a as usize], mesh.0[b as usize]);
                points.extend((1..cuts).map(|i| [0, 1, 2].map(|k| p[k] + (q[k] - p[k]) * i as f64 / cuts as f64)));
                points.len() - (cuts - 1)
            });
            group.extend(first..first + cuts - 1);
        }
        groups.push(group);
    }
    let mut member = vec![Vec::new(); points.len()];
    groups.iter().enumerate().for_each(|(g, group)| group.iter().for_each(|&p| member[p].push(g)));
    let mut dist = vec![f64::INFINITY; points.len()];
    let mut heap = std::collections::BinaryHeap::from([(std::cmp::Reverse(0u64), source)]);
    dist[source] = 0.0;
    while let Some((std::cmp::Reverse(key), p)) = heap.pop() {
        if key != dist[p].to_bits() {
            continue;
        }
        for &q in member[p].iter().flat_map(|&g| &groups[g]) {
            let d = dist[p] + norm(sub(points[p], points[q]));
            if d < dist[q] {
                dist[q] = d;
                heap.push((std::cmp::Reverse(d.to_bits()), q));
            }
        }
    }
    dist.truncate(mesh.0.len());
    dist
}

#[test]
fn distances_are_symmetric() {
    for mesh in [wavy_torus(13, 8), ruin()] {
        let all: Vec<Vec<f64>> = (0..mesh.0.len() as u32).map(|v| from_vertex(&mesh, v)).collect();
        for (i, row) in all.iter().enumerate() {
            row.iter().enumerate().for_each(|(j, d)| close(*d, all[j][i]));
        }
    }
    let mesh = wavy_torus(13, 8);
    let (p, q) = (at(17, [0.2, 0.5, 0.3]), at(140, [0.7, 0.1, 0.2]));
    close(solve(&mesh, p, &[q]).queries[0], solve(&mesh, q, &[p]).queries[0]);
}

#[test]
fn splitting_faces_and_edges_changes_nothing() {
    let mesh = wavy_torus(12, 8);
    let n = mesh.0.len();
    let (faces, edges) = (split_faces(&mesh), split_edges(&mesh));
    let queries: Vec<SurfacePoint> = (0..mesh.1.len() as u32).map(centroid).collect();
    for source in [0, 37, 90] {
        let d = solve(&mesh, SurfacePoint::Vertex(source), &queries);
        let finer = from_vertex(&faces, source);
        all_close(&d.vertices, &finer[..n]);
        all_close(&d.queries, &finer[n..]);
        all_close(&d.vertices, &from_vertex(&edges, source)[..n]);
    }
    // From inside a face.
    let d = solve(&mesh, centroid(50), &queries);
    let finer = from_vertex(&faces, (n + 50) as u32);
    all_close(&d.vertices, &finer[..n]);
    all_close(&d.queries, &finer[n..]);
}

#[test]
fn numbering_and_orientation_do_not_matter() {
    let mesh = wavy_torus(12, 8);
    let n = mesh.0.len() as u32;
    let renumber = |v: u32| (v * 29 + 11) % n;
    let mut turned: Mesh = (vec![[0.0; 3]; n as usize], Vec::new());
    (0..n).for_each(|v| turned.0[renumber(v) as usize] = mesh.0[v as usize]);
    turned.1 = mesh.1.iter().rev().map(|t| t.map(renumber)).collect();
    turned.1.iter_mut().step_by(3).for_each(|t| t.swap(0, 1));
    let (d, e) = (from_vertex(&mesh, 4), from_vertex(&turned, renumber(4)));
    (0..n).for_each(|v| close(d[v as usize], e[renumber(v) as usize]));
}

#[test]
fn scale_comes_out_as_a_factor() {
    let mesh = wavy_torus(12, 8);
    let d = from_vertex(&mesh, 4);
    for (scale, tolerance) in [(1024.0, 0.0), (1e-30, 1e-12), (3e200, 1e-12)] {
        let scaled = (mesh.0.iter().map(|p| p.map(|x| x * scale)).collect(), mesh.1.clone());
        for (a, b) in d.iter().zip(from_vertex(&scaled, 4)) {
            assert!((a - b / scale).abs() <= tolerance * a, "{a} {b}");
        }
    }
}

#[test]
fn a_met_window_limit_leaves_upper_bounds() {
    let mesh = wavy_torus(20, 12);
    let solver = ExactGeodesics::new(&mesh.0, &mesh.1).unwrap();
    let exact = from_vertex(&mesh, 0);
    for max_windows in [0, 10, 300] {
        let limits = Limits { max_windows, ..Limits::default() };
        let source = SurfacePoint::Vertex(0);
        let d = solver.distances(source, &[centroid(9)], &limits, &mut Scratch::default(), &job()).unwrap();
        assert!(!d.complete && d.windows <= max_windows + 20);
        assert!(d.vertices.iter().zip(&exact).all(|(a, b)| *a >= b - 1e-12));
    }
}

#[test]
fn tolerance_errs_on_the_long_side_and_little() {
    let mesh = wavy_torus(40, 24);
    let solver = ExactGeodesics::new(&mesh.0, &mesh.1).unwrap();
    let exact = solve(&mesh, SurfacePoint::Vertex(7), &[]);
    let limits = Limits { tolerance: 1e-3, ..Limits::default() };
    let d = solver.distances(SurfacePoint::Vertex(7), &[], &limits, &mut Scratch::default(), &job()).unwrap();
    assert!(d.complete && d.windows < exact.windows, "{} {}", d.windows, exact.windows);
    for (a, b) in d.vertices.iter().zip(&exact.vertices) {
        assert!(*a >= b - 1e-12 && *a <= b + 10.0 * limits.tolerance, "{a} {b}");
    }
}

#[test]
fn scratch_and_threads_leave_no_trace() {
    let (mesh, other) = (wavy_torus(16, 10), cuboid([1.0, 2.0, 3.0]));
    let solver = ExactGeodesics::new(&mesh.0, &mesh.1).unwrap();
    let others = ExactGeodesics::new(&other.0, &other.1).unwrap();
    let run = |solver: &ExactGeodesics, v: u32, scratch: &mut Scratch| {
        let d = solver.distances(SurfacePoint::Vertex(v), &[centroid(3)], &Limits::default(), scratch, &job()).unwrap();
        d.vertices.iter().chain(&d.queries).map(|x| x.to_bits()).collect::<Vec<u64>>()
    };
    let fresh: Vec<Vec<u64>> = (0..60).map(|v| run(&solver, v, &mut Scratch::default())).collect();
    let mut scratch = Scratch::default();
    for v in (0..60).rev() {
        assert!(run(&solver, v, &mut scratch) == fresh[v as usize]);
        run(&others, v % 8, &mut scratch);
    }
    let many: Vec<Vec<u64>> =
        (0..60u32).into_par_iter().map_init(Scratch::default, |scratch, v| run(&solver, v, scratch)).collect();
    assert!(many == fresh);
}

#[test]
fn a_cancelled_job_stops() {
    let mesh = wavy_torus(60, 40);
    let solver = ExactGeodesics::new(&mesh.0, &mesh.1).unwrap();
    let token = CancelToken::default();
    token.cancel();
    let job = Job::new(1, None, token);
    let d = solver.distances(SurfacePoint::Vertex(0), &[], &Limits::default(), &mut Scratch::default(), &job);
    assert_eq!(d.unwrap_err(), Error::Cancelled);
}
