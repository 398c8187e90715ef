use super::*;
use crate::job::CancelToken;
use crate::mesh::intrinsic::for_each_edge;
use crate::mesh::measure::{distance, dot, norm, sub};

type Mesh = (Vec<[f64; 3]>, Vec<[u32; 3]>);

fn job() -> Job {
    Job::new(2, None, CancelToken::default())
}

fn refine(mesh: &Mesh, options: SurfaceOptions) -> AnalysisSurface {
    AnalysisSurface::refine(&mesh.0, &mesh.1, &options, &job()).unwrap()
}

fn target(vertices: usize) -> SurfaceOptions {
    SurfaceOptions { target_vertices: vertices, ..SurfaceOptions::default() }
}

/// A box with two triangles a side.
fn cuboid(size: [f64; 3]) -> Mesh {
    let positions = (0..8).map(|i| [0, 1, 2].map(|k| size[k] * (i >> k & 1) as f64)).collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    (positions, quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect())
}

/// A closed rod of `n` slivers a side, radius 1.
fn rod(n: u32, height: f64) -> Mesh {
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

fn area(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> f64 {
    triangles.iter().map(|t| norm(normal(positions, t)) / 2.0).sum()
}

fn volume(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> f64 {
    triangles.iter().map(|t| dot(normal(positions, t), positions[t[0] as usize]) / 6.0).sum()
}

/// Numbers of triangles at the edges of a mesh.
fn edge_degrees(vertices: usize, triangles: &[[u32; 3]]) -> Vec<usize> {
    let mut degrees = Vec::new();
    for_each_edge(vertices, triangles, |sides| degrees.push(sides.len())).unwrap();
    degrees
}

/// What holds for every refined surface.
fn check(mesh: &Mesh, surface: &AnalysisSurface) {
    let (positions, triangles) = mesh;
    assert_eq!(&surface.positions[..positions.len()], &positions[..]);
    assert_eq!(surface.input_vertices, positions.len());
    assert_eq!(surface.positions.len() - positions.len(), surface.vertex_face.len());
    let (before, after) = (area(positions, triangles), area(&surface.positions, &surface.triangles));
    assert!((after / before - 1.0).abs() < 1e-12, "area {}", after / before - 1.0);
    let scale = before.powf(1.5);
    let change = volume(&surface.positions, &surface.triangles) - volume(positions, triangles);
    assert!(change.abs() < 1e-12 * scale, "volume {change}");
    // Children lie in their parent's plane and inside it, and tile it.
    for f in 0..triangles.len() {
        let n = normal(positions, &triangles[f]);
        let corners = triangles[f].map(|v| positions[v as usize]);
        let size = (0..3).map(|k| distance(corners[(k + 1) % 3], corners[k])).fold(0.0, f64::max);
        let mut tiled = 0.0;
        for child in surface.children(f) {
            assert_eq!(surface.parent_face[child] as usize, f);
            let t = surface.triangles[child];
            tiled += dot(normal(&surface.positions, &t), n);
            for v in t {
                let p = surface.positions[v as usize];
                assert!(dot(sub(p, corners[0]), n).abs() <= 1e-13 * size * norm(n));
                for k in 0..3 {
                    // The distance from every side is not negative.
                    let side = normal(&[corners[k], corners[(k + 1) % 3], p], &[0, 1, 2]);
                    assert!(dot(side, n) >= -1e-13 * size * size * norm(n));
                }
            }
        }
        assert!((tiled - dot(n, n)).abs() <= 1e-11 * size * size * norm(n));
    }
    assert_eq!(surface.children(triangles.len() - 1).end, surface.triangles.len());
    // No vertex is left out, none is met twice by a triangle.
    let mut used = vec![false; surface.positions.len()];
    for t in &surface.triangles {
        assert!(t[0] != t[1] && t[1] != t[2] && t[2] != t[0]);
        t.iter().for_each(|&v| used[v as usize] = true);
    }
    assert!(used[positions.len()..].iter().all(|&u| u));
    for (v, &f) in surface.vertex_face.iter().enumerate() {
        let v = (positions.len() + v) as u32;
        assert!(surface.children(f as usize).any(|c| surface.triangles[c].contains(&v)));
    }
}

/// Largest distance of points of the surface from their nearest vertex, in spacings, seen at the corners' circumcentres
/// of the intrinsic Delaunay triangulation.
fn largest_circumradius(surface: &AnalysisSurface) -> f64 {
    let mesh = surface.intrinsic(&job()).unwrap();
    let radius = |l: &[f64; 3]| l[0] * l[1] * l[2] / (2.0 * crate::mesh::intrinsic::double_area(*l));
    mesh.lengths.iter().map(radius).fold(0.0, f64::max) / surface.spacing
}

#[test]
fn a_box_is_covered_evenly() {
    let mesh = cuboid([3.0, 2.0, 1.0]);
    let surface = refine(&mesh, target(5000));
    check(&mesh, &surface);
    assert!((4500..5500).contains(&surface.positions.len()), "{}", surface.positions.len());
    assert!(edge_degrees(surface.positions.len(), &surface.triangles).iter().all(|&d| d == 2));
    assert!(largest_circumradius(&surface) < 1.1, "{}", largest_circumradius(&surface));
    // Sixty degrees is the best that a triangulation can have, zero the worst.
    let mesh = surface.intrinsic(&job()).unwrap();
    let quality = |l: &[f64; 3]| {
        3f64.sqrt() * 2.0 * crate::mesh::intrinsic::double_area(*l) / (l[0] * l[0] + l[1] * l[1] + l[2] * l[2])
    };
    let mean = mesh.lengths.iter().map(quality).sum::<f64>() / mesh.lengths.len() as f64;
    assert!(mean > 0.9, "{mean}");
}

#[test]
fn slivers_cost_no_more_than_their_area() {
    // Slivers 300 000 times longer than wide; every edge alone is 500 spacings long.
    let mesh = rod(20_000, 100.0);
    let surface = refine(&mesh, target(20_000));
    check(&mesh, &surface);
    assert!(surface.positions.len() < 40_002 + 25_000, "{}", surface.positions.len());
    assert!(edge_degrees(surface.positions.len(), &surface.triangles).iter().all(|&d| d == 2));
    // A bundle of slivers in the plane, open: a fan.
    let n = 5000u32;
    let mut fan = vec![[0.0; 3]];
    fan.extend((0..=n).map(|i| [1e3, 2e-3 * i as f64, 0.0]));
    let mesh = (fan, (1..=n).map(|i| [0, i, i + 1]).collect());
    let surface = refine(&mesh, target(3000));
    check(&mesh, &surface);
    assert!(surface.positions.len() < 5000 + 4500, "{}", surface.positions.len());
    let longest =
        surface.intrinsic(&job()).unwrap().lengths.into_iter().flatten().fold(0.0, f64::max) / surface.spacing;
    assert!(longest < 2.5, "{longest}");
}

#[test]
fn the_cap_holds() {
    let mesh = cuboid([1.0, 1.0, 1e-3]);
    for options in [
        SurfaceOptions { max_added: 700, ..target(1_000_000) },
        SurfaceOptions { max_added: 700, edge_length: Some(1e-9), ..target(10) },
        SurfaceOptions { max_added: 700, edge_length: Some(f64::MIN_POSITIVE), ..target(10) },
    ] {
        let surface = refine(&mesh, options);
        check(&mesh, &surface);
        assert!(surface.vertex_face.len() <= 700);
        assert!(surface.vertex_face.len() > 300);
    }
    assert_eq!(refine(&mesh, SurfaceOptions { max_added: 0, ..target(1000) }).vertex_face.len(), 0);
}

#[test]
fn open_and_non_manifold_edges_are_split_alike_on_all_sides() {
    // Five pages of a book and a closed box that touches it along an edge.
    let mut mesh = cuboid([1.0, 1.0, 4.0]);
    for page in 0..5 {
        let a = 0.3 + 0.7 * page as f64;
        let v = mesh.0.len() as u32;
        mesh.0.extend([[-a.cos().abs(), -a.sin(), 0.0], [-a.cos().abs(), -a.sin(), 4.0]]);
        mesh.1.extend([[0, 4, v], [4, v + 1, v]]);
    }
    let surface = refine(&mesh, target(2000));
    check(&mesh, &surface);
    // The spine is now several edges with all seven faces each; apart from it only free page edges are not regular.
    let degrees = edge_degrees(surface.positions.len(), &surface.triangles);
    let spine = degrees.iter().filter(|&&d| d == 7).count();
    assert!(spine as f64 * surface.spacing > 3.0, "{spine}");
    assert!(degrees.iter().all(|d| [1, 2, 7].contains(d)));
}

#[test]
fn fine_meshes_come_back_as_they_are() {
    let mesh = cuboid([1.0, 2.0, 3.0]);
    let fine = refine(&mesh, target(4000));
    let again = (fine.positions.clone(), fine.triangles.clone());
    assert_eq!(refine(&again, target(500)).triangles, again.1);
    // At the same spacing little is left to add.
    let surface = refine(&again, target(4000));
    assert!(surface.vertex_face.len() < 200, "{}", surface.vertex_face.len());
}

#[test]
fn results_follow_scale_and_do_not_depend_on_threads() {
    let mesh = rod(50, 7.0);
    let surface = refine(&mesh, target(3000));
    // Powers of two scale exactly; a refinement in other units must be the same one.
    for scale in [0.0009765625, 1048576.0] {
        let scaled = (mesh.0.iter().map(|p| p.map(|x| x * scale)).collect(), mesh.1.clone());
        let other = refine(&scaled, target(3000));
        assert_eq!(other.triangles, surface.triangles);
        assert_eq!(other.spacing, surface.spacing * scale);
    }
    let single = Job::new(1, None, CancelToken::default());
    let one = single.run(None, || AnalysisSurface::refine(&mesh.0, &mesh.1, &target(3000), &single)).unwrap();
    assert_eq!(one, surface);
}

#[test]
fn zero_area_faces_are_cut_along_with_their_neighbours() {
    // A vertex in the middle of a box edge, patched by a triangle without area.
    let mut mesh = cuboid([1.0, 1.0, 8.0]);
    mesh.0.push([0.0, 0.0, 3.0]);
    let edge = mesh.1.iter().position(|t| (0..3).any(|k| t[k] == 0 && t[(k + 1) % 3] == 4)).unwrap();
    mesh.1.push([0, 4, 8]);
    let k = (0..3).find(|&k| mesh.1[edge][k] == 0).unwrap();
    let t = [0, 1, 2].map(|i| mesh.1[edge][(k + i) % 3]);
    mesh.1[edge] = [0, 8, t[2]];
    mesh.1.push([8, 4, t[2]]);
    assert!(edge_degrees(9, &mesh.1).iter().all(|&d| d == 2));
    let surface = refine(&mesh, target(3000));
    check(&mesh, &surface);
    assert!(edge_degrees(surface.positions.len(), &surface.triangles).iter().all(|&d| d == 2));
    let intrinsic = surface.intrinsic(&job()).unwrap();
    assert!((intrinsic.area() / 34.0 - 1.0).abs() < 1e-5, "{:e}", intrinsic.area() / 34.0 - 1.0);
}

#[test]
fn thin_walls_are_covered_on_both_sides() {
    // Thickness far below the spacing: the points of one side must not stand for those of the other.
    let mesh = cuboid([1.0, 1.0, 1e-4]);
    let surface = refine(&mesh, target(2000));
    for z in [0.0, 1e-4] {
        let side = surface.positions.iter().filter(|p| p[2] == z).count();
        assert!((900..1300).contains(&side), "{side}");
    }
}

#[test]
fn nonsense_is_refused_and_cancel_is_heard() {
    let mesh = cuboid([1.0; 3]);
    for h in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let options = SurfaceOptions { edge_length: Some(h), ..SurfaceOptions::default() };
        assert!(matches!(AnalysisSurface::refine(&mesh.0, &mesh.1, &options, &job()), Err(Error::Argument(_))));
    }
    let flat: Vec<[f64; 3]> = vec![[0.0; 3]; 8];
    assert!(matches!(AnalysisSurface::refine(&flat, &mesh.1, &target(10), &job()), Err(Error::Degenerate(_))));
    assert!(matches!(AnalysisSurface::refine(&flat, &[], &target(10), &job()), Err(Error::Degenerate(_))));
    let token = CancelToken::default();
    token.cancel();
    let cancelled = Job::new(1, None, token);
    assert_eq!(AnalysisSurface::refine(&mesh.0, &mesh.1, &target(1000), &cancelled), Err(Error::Cancelled));
    let poor = Job::new(1, Some(1000), CancelToken::default());
    assert!(matches!(AnalysisSurface::refine(&mesh.0, &mesh.1, &target(1000), &poor), Err(Error::Budget(_))));
}
