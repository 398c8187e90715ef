//! The paper's D2 and the shape diameter function against closed forms and properties.

use super::bvh::{RayMesh, SAME_SURFACE};
use super::cone::{self, ANGLE, Cone, RAYS, frame};
use super::inscribed::{FaceWidths, Piece, face_widths, vertex_means};
use super::lanes::{Lanes, Portable, Work, with_best};
use super::sdf::{SDF_ANGLE, SDF_RAYS, sdf_values};
use super::shapes::*;
use crate::job::{CancelToken, Job};

fn on<T: Send>(threads: usize, work: impl FnOnce(&Job) -> crate::error::Result<T> + Send) -> T {
    let job = Job::new(threads, None, CancelToken::default());
    job.run(None, || work(&job)).unwrap()
}

fn d2((p, t): &Shape) -> FaceWidths {
    on(2, |job| face_widths(&RayMesh::new(p, t, job)?, &Cone::new(RAYS, ANGLE)?, job))
}

fn max(v: &[f64]) -> f64 {
    v.iter().copied().filter(|x| !x.is_nan()).fold(0.0, f64::max)
}

fn mean(v: &[f64]) -> f64 {
    v.iter().sum::<f64>() / v.len() as f64
}

/// D2max and D2mean over vertices.
fn summary(shape: &Shape) -> [f64; 2] {
    let v = vertex_means(shape.0.len(), &shape.1, &d2(shape).width).unwrap();
    [max(&v), mean(&v)]
}

#[test]
fn a_sphere_is_as_wide_as_its_diameter_everywhere() {
    let shape = icosphere(23);
    assert!(shape.1.len() > 10_000);
    let found = d2(&shape);
    for d in vertex_means(shape.0.len(), &shape.1, &found.width).unwrap() {
        assert!((d / 2.0 - 1.0).abs() < 0.01, "{d}");
    }
}

#[test]
fn d2_max_is_the_thickness_of_slabs_boxes_and_rods() {
    for l in [0.1, 1.0, 10.0, 100.0, 500.0, 2000.0] {
        let shape = cuboid([100.0, 100.0, l], [24, 24, if l > 400.0 { 60 } else { 12 }]);
        let [max, _] = summary(&shape);
        let thickness = l.min(100.0);
        assert!((max / thickness - 1.0).abs() < 0.01, "l {l}: {max}");
    }
}

#[test]
fn d2_max_is_the_diameter_of_cylinders() {
    for (d, h) in [(5.0, 100.0), (5.0, 5.0), (5.0, 0.5)] {
        let [max, _] = summary(&prism(&round(d, 64), [0.0; 2], h, 20, 12));
        assert!((max / d.min(h) - 1.0).abs() < 0.01, "d {d} h {h}: {max}");
    }
}

#[test]
fn the_inscribed_sphere_shrinks_towards_an_edge() {
    // At the distance x from a right-angled edge the inscribed sphere has the diameter 2x: many rays come near it.
    let shape = cuboid([10.0, 10.0, 10.0], [20, 20, 20]);
    let (p, t) = &shape;
    let found = on(2, |job| face_widths(&RayMesh::new(p, t, job)?, &Cone::new(2000, ANGLE)?, job));
    for (t, d) in t.iter().zip(found.width) {
        let c: [f64; 3] = std::array::from_fn(|a| t.iter().map(|&v| p[v as usize][a]).sum::<f64>() / 3.0);
        let mut margin: Vec<f64> = c.iter().map(|x| x.min(10.0 - x)).collect();
        margin.sort_by(f64::total_cmp);
        let exact = 2.0 * margin[1];
        assert!(d >= exact - 1e-9 && d < exact * 1.005, "{d} {exact}");
    }
}

#[test]
fn the_summary_does_not_depend_on_place_size_or_numbering() {
    let base =
        mapped(cuboid([4.0, 2.0, 1.0], [16, 8, 4]), |p| [p[0] + 0.1 * p[1] * p[2], p[1], p[2] * (1.0 + 0.1 * p[0])]);
    let wanted = summary(&base);
    let close = |shape: &Shape, scale: f64, what: &str| {
        for (a, b) in summary(shape).iter().zip(wanted) {
            assert!((a / scale / b - 1.0).abs() < 1e-3, "{what}: {a} {b}");
        }
    };
    close(&mapped(base.clone(), turned), 1.0, "turned");
    close(&mapped(base.clone(), |p| p.map(|x| x + 4e6)), 1.0, "moved");
    close(&mapped(base.clone(), |p| p.map(|x| x * 1e6)), 1e6, "grown");
    close(&mapped(base.clone(), |p| p.map(|x| x * 1e-6)), 1e-6, "shrunk");
    close(&renumbered(base).0, 1.0, "renumbered");
}

#[test]
fn renumbering_does_not_change_a_face() {
    let shape = mapped(icosphere(8), |p| [p[0], 0.5 * p[1], 0.3 * p[2] * (1.2 + p[0])]);
    let before = d2(&shape).width;
    let (after, to) = renumbered(shape);
    let after = d2(&after).width;
    for (i, &k) in to.iter().enumerate() {
        assert!((before[i] / after[k] - 1.0).abs() < 1e-9, "face {i}: {} {}", before[i], after[k]);
    }
}

#[test]
fn rays_do_not_slip_between_triangles() {
    // From inside a closed mesh straight at every corner and at points of every edge.
    struct Aim<'a>(&'a Shape, &'a RayMesh);
    impl Work for Aim<'_> {
        type Output = usize;
        fn run<L: Lanes>(self, lanes: L) -> usize {
            let mut misses = 0;
            let mut stack = Vec::new();
            let from = self.1.to_unit([0.05, -0.03, 0.02]);
            for t in &self.0.1 {
                for k in 0..3 {
                    let [p, q] = [t[k], t[(k + 1) % 3]].map(|v| self.1.points[v as usize]);
                    for s in [0.0, 0.25, 0.5, 1.0 / 3.0] {
                        let to: [f64; 3] = std::array::from_fn(|a| p[a] + s * (q[a] - p[a]) - from[a]);
                        let l = to.iter().map(|x| x * x).sum::<f64>().sqrt();
                        let ray = (from, to.map(|x| x / l));
                        let hit = self.1.nearest_hit(lanes, &mut stack, ray, (0.0, f64::INFINITY), u32::MAX);
                        misses += hit.is_none_or(|h| (h.t - l).abs() > 1e-9 || !h.exit) as usize;
                    }
                }
            }
            misses
        }
    }
    let flat = mapped(icosphere(9), |p| [(p[0] * 8.0).round() / 8.0, p[1], 0.4 * p[2]]);
    let cube = mapped(cuboid([0.5; 3], [8, 8, 8]), |p| p.map(|x| x - 0.24));
    for shape in [icosphere(12), cube, flat] {
        let shape = mapped(shape, |p| p.map(|x| x - 0.01));
        let mesh = on(1, |job| RayMesh::new(&shape.0, &shape.1, job));
        assert_eq!(with_best(Aim(&shape, &mesh)), 0);
        assert_eq!(Aim(&shape, &mesh).run(Portable), 0);
    }
}

/// The smallest sphere of each face by all rays one for one, from the root and to the end.
struct OneByOne<'a>(&'a RayMesh, &'a Cone);

impl Work for OneByOne<'_> {
    type Output = Vec<f64>;

    fn run<L: Lanes>(self, lanes: L) -> Vec<f64> {
        let OneByOne(mesh, rays) = self;
        let width = |face: u32| {
            let corners = mesh.corners(face);
            let centroid = std::array::from_fn(|a| (corners[0][a] + corners[1][a] + corners[2][a]) / 3.0);
            let inward = mesh.normals[face as usize].map(|x| -x);
            let xy = frame(corners, inward);
            let spheres = rays.directions().iter().filter_map(|d| {
                let ray = (centroid, cone::turned(*d, xy, inward));
                let range = (SAME_SURFACE / d[2], f64::INFINITY);
                Some(mesh.nearest_hit(lanes, &mut Vec::new(), ray, range, face)?.t / d[2])
            });
            mesh.to_length(spheres.fold(f64::NAN, f64::min))
        };
        (0..mesh.face_count() as u32).map(width).collect()
    }
}

#[test]
fn rays_of_a_cone_together_find_what_they_find_one_by_one() {
    let lumps = |p: [f64; 3]| {
        let s = 1.0 + 0.3 * (7.0 * p[0]).sin() * (5.0 * p[1]).cos() + 0.1 * (23.0 * p[2]).sin();
        [3.0 * s * p[0], s * p[1], 0.4 * s * p[2]]
    };
    let open = {
        let (p, mut t) = mapped(icosphere(8), lumps);
        t.retain(|t| t[0] % 7 != 0);
        (p, t)
    };
    let needles = cuboid([1.0, 0.02, 0.3], [40, 1, 3]);
    for shape in [mapped(icosphere(14), lumps), open, needles, cuboid([1.0; 3], [9, 9, 9])] {
        for (rays, angle) in [(20, ANGLE), (7, 0.03), (50, 3.1), (1, 1.0)] {
            let (mesh, cone) = on(1, |job| Ok((RayMesh::new(&shape.0, &shape.1, job)?, Cone::new(rays, angle)?)));
            let found = on(1, |job| face_widths(&mesh, &cone, job)).width;
            for (face, (found, sure)) in found.iter().zip(OneByOne(&mesh, &cone).run(Portable)).enumerate() {
                let same = (found / sure - 1.0).abs() < 1e-12 || (found.is_nan() && sure.is_nan());
                assert!(same, "{rays} rays in {angle}: face {face} of {}: {found}, not {sure}", shape.1.len());
            }
            let mut portable = Vec::new();
            Piece { mesh: &mesh, cone: &cone, blocks: &mesh.tree.blocks, out: &mut portable }.run(Portable);
            for (face, d) in portable {
                let (found, d) = (found[face as usize], mesh.to_length(d));
                assert!((found / d - 1.0).abs() < 1e-12 || (found.is_nan() && d.is_nan()), "face {face}: {found}, {d}");
            }
        }
    }
}

#[test]
fn an_axis_ray_that_ends_on_the_diagonal_of_the_other_side_is_not_lost() {
    // The centroid of each triangle of the bottom lies straight below the diagonal of the top.
    let p = vec![
        [0.0, 0.0, 0.0],
        [3.0, 0.0, 0.0],
        [3.0, 3.0, 0.0],
        [0.0, 3.0, 0.0],
        [-1.0, -1.0, 2.0],
        [5.0, 2.0, 2.0],
        [3.0, 3.0, 2.0],
        [2.0, 5.0, 2.0],
    ];
    let t = vec![[0u32, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7]];
    // Face 0 has its centroid at (2, 1), face 1 at (1, 2); the top's diagonal 4-6 is x = y: move the top to suit.
    let top = |dx: f64, p: &[[f64; 3]]| -> Vec<[f64; 3]> {
        p.iter().map(|q| if q[2] > 1.0 { [q[0] + dx, q[1], q[2]] } else { *q }).collect()
    };
    for (dx, face) in [(1.0, 0), (-1.0, 1)] {
        let p = top(dx, &p);
        let found = on(1, |job| face_widths(&RayMesh::new(&p, &t, job)?, &Cone::new(1, ANGLE)?, job));
        assert!((found.width[face] - 2.0).abs() < 1e-12, "{:?}", found.width);
    }
}

#[test]
fn an_open_surface_has_no_width_and_says_so() {
    let (p, mut t) = cuboid([1.0, 1.0, 1.0], [4, 4, 4]);
    t.retain(|t| t.iter().all(|&v| p[v as usize][2] == 0.0));
    let found = d2(&(p, t.clone()));
    assert!(found.width.iter().all(|d| d.is_nan()));
    assert_eq!((found.open_faces, found.first_open), (t.len() as u64, Some(0)));
}

#[test]
fn duplicates_and_faces_without_area_change_nothing() {
    let (p, t) = cuboid([4.0, 2.0, 1.0], [8, 4, 2]);
    let before = d2(&(p.clone(), t.clone())).width;
    let mut more = t.clone();
    more.extend(t.iter().map(|t| [t[1], t[2], t[0]]));
    let mut q = p.clone();
    q.push(std::array::from_fn(|a| (p[t[0][0] as usize][a] + p[t[0][1] as usize][a]) / 2.0));
    more.push([t[0][0], t[0][1], p.len() as u32]);
    let after = d2(&(q, more.clone())).width;
    assert!(before.iter().zip(&after).all(|(a, b)| (a / b - 1.0).abs() < 1e-12));
    assert!(after[more.len() - 1].is_nan());
}

#[test]
fn results_are_the_same_for_every_thread_count() {
    let (p, t) = mapped(icosphere(20), |p| [p[0], p[1] * 0.4, p[2] * (0.5 + 0.2 * p[0])]);
    let run = |threads| {
        on(threads, |job| {
            let mesh = RayMesh::new(&p, &t, job)?;
            let mut all = face_widths(&mesh, &Cone::new(RAYS, ANGLE)?, job)?.width;
            all.extend(sdf_values(&mesh, SDF_RAYS, SDF_ANGLE, job)?);
            Ok(all.iter().map(|x| x.to_bits()).collect::<Vec<_>>())
        })
    };
    let one = run(1);
    assert!([2, 3, 8].iter().all(|&n| run(n) == one));
}

#[test]
fn hostile_input_is_answered() {
    let width = |p: &[[f64; 3]], t: &[[u32; 3]]| d2(&(p.to_vec(), t.to_vec())).width;
    assert!(width(&[], &[]).is_empty());
    let p = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [2.0, 0.0, 0.0]];
    assert!(width(&p, &[[0, 1, 2]])[0].is_nan());
    assert!(width(&p, &[[0, 1, 3]])[0].is_nan());
    // A hundred thousand copies of one triangle, and of a point.
    assert!(width(&p, &vec![[0, 1, 2]; 100_000]).iter().all(|d| d.is_nan()));
    let line: Vec<[f64; 3]> =
        (0..3000).map(|k| [1.5f64.powi(k - 1500), 1.5f64.powi(k - 1501), (k % 2) as f64]).collect();
    let fan: Vec<[u32; 3]> = (0..2998).map(|k| [k, k + 1, k + 2]).collect();
    assert_eq!(width(&line, &fan).len(), 2998);
    // Near the ends of the range of doubles.
    for scale in [1e-300, 1e307] {
        let (p, t) = mapped(cuboid([1.0, 1.0, 0.25], [4, 4, 2]), |p| p.map(|x| x * scale));
        assert!((max(&width(&p, &t)) / scale / 0.25 - 1.0).abs() < 1e-6);
    }
}

#[test]
fn the_shape_diameter_of_a_sphere_is_the_mean_chord_of_its_rays() {
    // A chord that leaves the surface at the angle theta to the normal is 2 cos(theta) long; with the spiral's radii
    // tan(theta_i) = tan(60 degrees) i/25.
    let (p, t) = icosphere(30);
    let values = on(2, |job| sdf_values(&RayMesh::new(&p, &t, job)?, SDF_RAYS, SDF_ANGLE, job));
    let chord: Vec<f64> = (0..25).map(|i| 2.0 * (3f64.sqrt() * i as f64 / 25.0).atan().cos()).collect();
    let median = chord[12];
    let mut deviation: Vec<f64> = chord.iter().map(|c| (c - median).abs()).collect();
    deviation.sort_by(f64::total_cmp);
    let kept: Vec<f64> = chord.iter().copied().filter(|c| (c - median).abs() <= 1.5 * deviation[12]).collect();
    let exact = mean(&kept);
    let middle = mean(&values);
    assert!((middle / exact - 1.0).abs() < 0.005, "{middle} {exact}");
}

#[test]
fn bad_options_are_refused() {
    assert!(Cone::new(0, ANGLE).is_err() && Cone::new(20, 0.0).is_err() && Cone::new(20, f64::NAN).is_err());
    assert!(Cone::new(20, 4.0).is_err());
    let (p, t) = icosphere(1);
    let job = Job::new(1, None, CancelToken::default());
    let mesh = RayMesh::new(&p, &t, &job).unwrap();
    assert!(sdf_values(&mesh, 0, SDF_ANGLE, &job).is_err() && sdf_values(&mesh, 25, -1.0, &job).is_err());
    job.run::<()>(None, || {
        let tight = Job::new(1, Some(1), CancelToken::default());
        assert!(matches!(RayMesh::new(&p, &t, &tight), Err(crate::error::Error::Budget(_))));
        let stop = CancelToken::default();
        let stopped = Job::new(1, None, stop.clone());
        stop.cancel();
        assert!(matches!(face_widths(&mesh, &Cone::new(20, ANGLE)?, &stopped), Err(crate::error::Error::Cancelled)));
        Ok(())
    })
    .unwrap();
}

#[test]
fn cone_directions_fill_the_cone_evenly() {
    let cone = Cone::new(400, ANGLE).unwrap();
    assert_eq!(cone.directions()[0], [0.0, 0.0, 1.0]);
    let mut sum = [0.0; 3];
    for d in cone.directions() {
        assert!((d.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-12 && d[2] >= 0.5);
        (0..3).for_each(|a| sum[a] += d[a] / 400.0);
    }
    // The mean of z over the cap is (1 + cos 60)/2.
    assert!((sum[2] - 0.75).abs() < 2e-3 && sum[0].abs() < 3e-3 && sum[1].abs() < 3e-3, "{sum:?}");
}
