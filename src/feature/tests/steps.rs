//! The steps by themselves.

use super::super::foot::Standing;
use super::super::kind::{classify, oriented_box};
use super::super::limits::{ProcessLimits, Severity};
use super::super::measure::{Scene, plateau};
use super::*;
use crate::mesh::measure::{area, sub};
use crate::mesh::{NONE, Topology};

#[test]
fn sorts_of_things() {
    // a wire 20 long and 1 thick; a strip 20 x 10 x 1; a ring of that wire, whose longest way is half of it; a lump
    assert_eq!(classify(20.0, 1.0, 20.0 * PI, false), (Kind::Bar, 1.0));
    let (kind, width) = classify(20.0, 1.0, 2.0 * 20.0 * 11.0, false);
    assert_eq!(kind, Kind::Wall);
    near(width, 10.0, 1e-12);
    assert_eq!(classify(10.0, 1.0, 20.0 * PI, true), (Kind::Ring, 1.0));
    assert_eq!(classify(2.4, 1.0, 4.0, false).0, Kind::Body);
    // too wide for a bar, not wide enough for a wall
    assert_eq!(classify(20.0, 1.0, 20.0 * 6.6, false), (Kind::Body, 0.5 * 6.6 - 1.0));
    assert_eq!(classify(f64::NAN, f64::NAN, 0.0, false).0, Kind::Body);
}

#[test]
fn box_in_any_position() {
    let (positions, triangles) = turned_box([7.0, 2.0, 4.0]);
    let found = oriented_box((&positions, &triangles), (&positions, &triangles));
    (0..3).for_each(|k| near(found.size[k], [7.0, 4.0, 2.0][k], 1e-9));
    let middle = scale(positions.iter().fold([0.0; 3], |m, p| add(m, *p)), 0.125);
    assert!(norm(sub(found.centre, middle)) < 1e-9);
    let [a, b, c] = found.axes;
    near(dot(cross(a, b), c), 1.0, 1e-9);
    near(dot(a, scale(sub(positions[1], positions[0]), 1.0 / 7.0)).abs(), 1.0, 1e-9);
    // a cylinder has no flat sides: its axis is a principal one
    let round = revolved(&[[0.0, 0.0], [1.0, 0.0], [1.0, 9.0], [0.0, 9.0]], 24);
    near(oriented_box((&round.0, &round.1), (&round.0, &round.1)).size[0], 9.0, 1e-6);
    // the sides of a prism on a right triangle lie across its principal axes
    let corner = |k: usize| [[0.0, 0.0], [4.0, 0.0], [0.0, 3.0]][k % 3];
    let p: Vec<Vec3> = (0..6).map(|k| [corner(k)[0], corner(k)[1], if k < 3 { 0.0 } else { 2.0 }]).collect();
    let quads = [[0, 1, 4, 3], [1, 2, 5, 4], [2, 0, 3, 5]];
    let sides = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    let t: Vec<[u32; 3]> = [[0, 2, 1], [3, 4, 5]].into_iter().chain(sides).collect();
    near(oriented_box((&p, &t), (&p, &t)).size.iter().product(), 24.0, 1e-9);
    let nothing = oriented_box((&[], &[]), (&[], &[])).size[0];
    assert!(nothing.is_infinite() || nothing.is_nan());
}

#[test]
fn longest_ways_in_closed_form() {
    let job = Job::default();
    let longest = |shape: &Faces| lengths::longest(&shape.0, &shape.1, true, &job).unwrap();
    let sheet = longest(&grid(&[0.0, 4.0], &[0.0, 3.0])).unwrap();
    near(sheet.length, 5.0, 1e-9);
    near(norm(sub(sheet.ends[0], sheet.ends[1])), 5.0, 1e-9);
    assert!(sheet.upper >= 5.0);
    // between opposite corners of a cube, over two sides
    let cube = longest(&turned_box([1.0; 3])).unwrap();
    near(cube.length, 5.0f64.sqrt(), 2e-3);
    assert!(cube.upper >= 5.0f64.sqrt());
    // from the middle of one end of a rod to the middle of the other, or a little more; the rod has 32 sides
    let rod = longest(&revolved(&[[0.0, 0.0], [1.0, 0.0], [1.0, 30.0], [0.0, 30.0]], 32)).unwrap();
    assert!(
        rod.length >= 30.0 + 2.0 * (PI / 32.0).cos() - 1e-9 && rod.length <= 30.0f64.hypot(PI) + 2.0,
        "{}",
        rod.length
    );
    // of pieces the one that reaches farthest
    let (mut p, mut t) = grid(&[0.0, 4.0], &[0.0, 3.0]);
    p.extend(grid(&[0.0, 8.0], &[10.0, 16.0]).0);
    t.extend([[4, 5, 7], [4, 7, 6]]);
    near(longest(&(p, t)).unwrap().length, 10.0, 1e-9);
    assert!(longest(&(vec![], vec![])).is_none());
}

#[test]
fn own_mesh_and_centroid() {
    let (p, t) = grid(&[0.0, 1.0, 3.0], &[0.0, 2.0]);
    let (centre, whole) = lengths::centroid(&p, &t, &[2, 3]);
    near(whole, 4.0, 1e-12);
    assert!(norm(sub(centre, [2.0, 1.0, 0.0])) < 1e-12);
    let (own, faces) = lengths::extract(&p, &t, &[2, 3]).unwrap();
    assert_eq!((own.len(), faces.len()), (4, 2));
    near(faces.iter().map(|&t| area(corners(&own, t))).sum(), 4.0, 1e-12);
    assert!(lengths::centroid(&p, &t, &[]).0[0].is_nan());
}

fn merged(p: &[Vec3], t: &[[u32; 3]], label: &[u32], places: &[Place]) -> Vec<u32> {
    let dual = Dual::new(p, t, &Topology::new(p, t).unwrap()).unwrap();
    merge::back_to_back(p, t, &dual, label, places).unwrap()
}

#[test]
fn back_to_back_is_one_wall() {
    // two sheets that face each other, and a box that one of them faces, too
    let (mut p, mut t) = grid(&[0.0, 4.0], &[0.0, 3.0]);
    for shape in [grid(&[0.0, 4.0], &[0.0, 3.0]), turned_box([2.0; 3])] {
        t.extend(shape.1.iter().map(|t| t.map(|v| v + p.len() as u32)));
        p.extend(shape.0);
    }
    let label: Vec<u32> = [vec![0; 2], vec![1; 2], vec![2; 12]].concat();
    let facing = |share: f64| vec![place(0, 1.0, 2, share), place(1, 1.0, 5, 1.0 - share), place(2, 1.0, 0, 1.0)];
    assert_eq!(merged(&p, &t, &label, &facing(0.9)), [0, 0, 2]);
    // the second is a sheet that faces the first; the box is none, and its facing a sheet does not suffice
    let mut places = vec![place(0, 1.0, 5, 1.0), place(2, 1.0, NONE, 1.0), place(5, 1.0, 2, 1.0)];
    places[0].width = f64::NAN;
    assert_eq!(merged(&p, &t, &label, &places), [0, 1, 2]);
}

#[test]
fn a_strip_belongs_to_what_it_faces() {
    // a small sheet in front of a box
    let (mut p, mut t) = grid(&[0.0, 1.0], &[0.0, 1.0]);
    let solid = turned_box([2.0; 3]);
    t.extend(solid.1.iter().map(|t| t.map(|v| v + 4)));
    p.extend(solid.0);
    let label: Vec<u32> = [vec![0; 2], vec![1; 12]].concat();
    let places = |share: f64| vec![place(0, 1.0, 2, share), place(0, 1.0, NONE, 1.0 - share), place(2, 1.0, 3, 9.0)];
    assert_eq!(merged(&p, &t, &label, &places(0.21)), [0, 0]);
    assert_eq!(merged(&p, &t, &label, &places(0.19)), [0, 1]);
    // what is smaller is no body
    let (mut q, mut u) = grid(&[0.0, 4.0], &[0.0, 3.0]);
    u.extend([[4, 5, 7], [4, 7, 6]]);
    q.extend(grid(&[0.0, 1.0], &[0.0, 1.0]).0);
    let places_of_large = [place(0, 1.0, 2, 0.3), place(0, 1.0, NONE, 0.7), place(2, 1.0, NONE, 1.0)];
    assert_eq!(merged(&q, &u, &[0, 0, 1, 1], &places_of_large), [0, 1]);
    // a part of the box that has no side across is no strip: it is bent
    let label: Vec<u32> = [vec![0; 2], vec![1; 4], vec![2; 8]].concat();
    let places = vec![place(2, 1.0, 9, 0.4), place(2, 1.0, NONE, 0.6), place(9, 1.0, 10, 9.0)];
    assert_eq!(merged(&p, &t, &label, &places), [0, 1, 2]);
    // unless hardly any of it has, and most of it the same across
    let places = |own: f64, share: f64| {
        vec![
            place(2, 1.0, 3, own),
            place(2, 1.0, 9, share),
            place(3, 1.0, NONE, 1.0 - own - share),
            place(9, 1.0, 10, 9.0),
        ]
    };
    for (own, share, joined) in [(0.05, 0.6, 1), (0.05, 0.4, 2), (0.2, 0.6, 2)] {
        assert_eq!(merged(&p, &t, &label, &places(own, share)), [0, 1, joined]);
    }
    // nor if it stands out: two sides of the box that meet
    let sides = [0, 0, 1, 1, 2, 2, 1, 1, 2, 2, 2, 2, 2, 2];
    assert_eq!(merged(&p, &t, &sides, &places(0.05, 0.6)), [0, 1, 2]);
}

#[test]
fn what_stands_out_is_no_strip() {
    // the side of a boss with nothing of it across but the rest: it turns by its height over its diameter
    for (height, own) in [(4.0, 0), (4.8, 0), (5.2, 1), (6.0, 1)] {
        let profile = [[0.0, -5.0], [20.0, -5.0], [20.0, 0.0], [10.0, 0.0], [10.0, height], [0.0, height]];
        let (p, t) = revolved(&profile, 64);
        let is_side = |t: &[u32; 3]| {
            let corner = t.map(|v| p[v as usize]);
            let [low, high] = [f64::min, f64::max].map(|f| corner.map(|p| p[2]).into_iter().reduce(f).unwrap());
            low == 0.0 && high == height
        };
        let label: Vec<u32> = t.iter().map(|t| u32::from(is_side(t))).collect();
        let [body, side] = [0, 1].map(|k| label.iter().position(|&l| l == k).unwrap() as u32);
        let around = [place(side, 5.0, body, 1.0), place(body, 5.0, body, 9.0)];
        assert_eq!(merged(&p, &t, &label, &around)[1], own, "{height}");
    }
}

#[test]
fn thin_walls_part_from_thick_bodies() {
    // two thick ends with a thin middle, and a row of slivers above, on which there are no places
    let (p, t) = grid(&[0.0, 12.0, 20.0, 31.0], &[0.0, 2.0, 2.05]);
    let topology = Topology::new(&p, &t).unwrap();
    let width = |f: u32| if f / 2 == 1 { 1.0 } else { 10.0 };
    let places: Vec<Place> = (0..6).map(|f| place(f, width(f), f ^ 1, 10.0)).collect();
    let split = |label: &[u32], places: &[Place]| split::at_jumps(&p, &t, &topology, label, places, 16.0).unwrap();
    let found = split(&[0; 12], &places);
    assert_eq!(found, [0, 0, 1, 1, 2, 2, 0, 0, 1, 1, 2, 2].map(|l| [0, 1, 2][l]));
    // it is 8 x 2.05: less than is wanted
    assert_eq!(split::at_jumps(&p, &t, &topology, &[0; 12], &places, 17.0).unwrap(), [0; 12]);
    // a wall that faces something else is the face of a body
    let other: Vec<Place> = places.iter().map(|p| Place { facing: NONE, ..*p }).collect();
    assert_eq!(split(&[0; 12], &other), [0; 12]);
    // not thin, and nothing known
    let even: Vec<Place> = places.iter().map(|p| Place { width: p.width.max(5.0), ..*p }).collect();
    assert_eq!(split(&[0; 12], &even), [0; 12]);
    for (thin, thick) in [(1.0, 2.0), (2.5, 10.0)] {
        // half as thick; as thick as it is long and wide
        let other: Vec<Place> =
            places.iter().map(|p| Place { width: if p.width < 5.0 { thin } else { thick }, ..*p }).collect();
        assert_eq!(split(&[0; 12], &other), [0; 12]);
    }
    // a remnant beyond the wall is no feature, unless it is a tenth of the rest
    for (length, own) in [(0.5, 0), (1.1, 0), (1.3, 2)] {
        let (p, t) = grid(&[0.0, 12.0, 20.0, 20.0 + length], &[0.0, 2.0, 2.05]);
        let topology = Topology::new(&p, &t).unwrap();
        let found = split::at_jumps(&p, &t, &topology, &[0; 12], &places, 0.0).unwrap();
        assert_eq!(found, [0, 0, 1, 1, own, own, 0, 0, 1, 1, own, own]);
    }
    assert_eq!(split(&[0; 12], &[]), [0; 12]);
}

#[test]
fn limits_are_inclusive() {
    let (_, feature) = on_mesh(&turned_box([9.0, 3.0, 3.0]), 1, |mesh, job| {
        let found = find_features(mesh, &FeatureOptions::default(), job)?;
        Ok((found.face_feature, found.features[0].clone()))
    });
    let judge = |ratio: f64, width: f64, min_width: f64| {
        let limits = ProcessLimits { warn_ratio: 5.0, error_ratio: 8.0, min_width };
        let verdict = limits.judge(&Feature { ratio, d2_min: Width { width, ..feature.d2_min }, ..feature.clone() });
        (verdict.severity, verdict.slender, verdict.thin)
    };
    assert_eq!(judge(5.0f64.next_down(), 1.0, 0.0), (Severity::Fine, false, false));
    assert_eq!(judge(5.0, 1.0, 0.0), (Severity::Warning, true, false));
    assert_eq!(judge(8.0f64.next_down(), 1.0, 0.0), (Severity::Warning, true, false));
    assert_eq!(judge(8.0, 1.0, 0.0), (Severity::Error, true, false));
    assert_eq!(judge(1.0, 1.0, 1.0), (Severity::Error, false, true));
    assert_eq!(judge(1.0, 1.0, 1.0f64.next_down()), (Severity::Fine, false, false));
    assert_eq!(judge(1.0, 0.0, 0.0), (Severity::Fine, false, false));
    assert_eq!(judge(f64::NAN, f64::NAN, 1.0), (Severity::Fine, false, false));
}

#[test]
fn height_above_the_border() {
    let shape = revolved(&[[0.0, -5.0], [10.0, -5.0], [10.0, 0.0], [4.0, 0.0], [4.0, 1.5], [0.0, 1.5]], 24);
    let label: Vec<u32> = (0..shape.1.len())
        .map(|f| {
            let [a, b, c] = shape.1[f].map(|v| shape.0[v as usize]);
            let reach = [a, b, c].map(|p| p[0].hypot(p[1])).into_iter().fold(0.0, f64::max);
            u32::from(height_of(&shape, f) > 0.0 && reach < 4.5)
        })
        .collect();
    on_mesh(&shape, 1, |mesh, _| {
        let triangles = mesh.topology()?.oriented(mesh.triangles());
        let dual = Dual::new(mesh.positions(), &triangles, mesh.topology()?)?;
        let skin = Skin::of(mesh, &triangles, &dual)?;
        let scene = Scene { skin: &skin, label: &label };
        let of = |k: u32| -> Vec<u32> { (0..label.len() as u32).filter(|&f| label[f as usize] == k).collect() };
        let (height, top, foot) = scene.height(1, &of(1), 8.0)?.unwrap();
        near(height, 1.5, 1e-9);
        assert!((top[2] - 1.5).abs() < 1e-9 && foot[2].abs() < 1e-9);
        // the body hangs from its border with the boss, downward
        near(scene.height(0, &of(0), 20.0)?.unwrap().0, 5.0, 1e-9);
        // a border in no plane, and one that the feature is on both sides of
        let middle = |f: usize| {
            let [a, b, c] = shape.1[f].map(|v| shape.0[v as usize]);
            scale(add(add(a, b), c), 1.0 / 3.0)
        };
        let bent: Vec<u32> =
            (0..label.len()).map(|f| u32::from(label[f] == 1 && (middle(f)[1] > 0.0 || middle(f)[2] > 1.4))).collect();
        let flat = |f: usize| middle(f)[2].abs() < 1e-9;
        let both: Vec<u32> = (0..label.len()).map(|f| u32::from(!flat(f))).collect();
        for label in [&bent, &both] {
            let faces: Vec<u32> = (0..label.len() as u32).filter(|&f| label[f as usize] == 1).collect();
            let scene = Scene { skin: &skin, label };
            assert!(scene.height(1, &faces, 2.0)?.is_none());
        }

        let alone = Scene { label: &vec![0; label.len()], ..scene };
        assert!(alone.height(0, &(0..label.len() as u32).collect::<Vec<u32>>(), 8.0)?.is_none());
        Ok(())
    });
}

#[test]
fn a_border_is_level_within_a_tenth_of_the_width() {
    let mut shape = revolved(&[[0.0, -5.0], [10.0, -5.0], [10.0, 0.0], [4.0, 0.0], [4.0, 1.5], [0.0, 1.5]], 24);
    let label: Vec<u32> = (0..shape.1.len()).map(|f| u32::from(height_of(&shape, f) > 0.0)).collect();
    // the foot goes up and down by 0.1
    (0..24).for_each(|j| shape.0[1 + 2 * 24 + j][2] = if j % 2 == 0 { 0.1 } else { -0.1 });
    on_mesh(&shape, 1, |mesh, _| {
        let triangles = mesh.topology()?.oriented(mesh.triangles());
        let dual = Dual::new(mesh.positions(), &triangles, mesh.topology()?)?;
        let scene = Scene { skin: &Skin::of(mesh, &triangles, &dual)?, label: &label };
        let faces: Vec<u32> = (0..label.len() as u32).filter(|&f| label[f as usize] == 1).collect();
        assert!(scene.height(1, &faces, 0.99)?.is_none());
        near(scene.height(1, &faces, 1.01)?.unwrap().0, 1.5, 1e-9);
        Ok(())
    });
}

#[test]
fn the_length_is_measured_above_the_fillet() {
    above_the_fillet(&pin_on_disc(1.0, 12.0, 1.5, 8, 32), |above, shape| {
        let pin = above(1, 2.0).unwrap();
        assert!(pin.iter().all(|&f| height_of(shape, f as usize) > 1.5));
        assert_eq!(pin.len(), (0..shape.1.len()).filter(|&f| height_of(shape, f) > 1.5).count());
        // what is much wider than the pin is thick is no fillet at its foot, and the disc does not stand on the pin
        assert!(above(1, 0.5).is_none());
        assert!(above(0, 8.0).is_none());
    });
    // of a low one hardly more than the fillet would be left
    above_the_fillet(&pin_on_disc(1.0, 1.9, 1.5, 8, 32), |above, _| assert!(above(1, 2.0).is_none()));
}

/// What a pin on a disc, and the disc, are without the fillet between them, in whose middle their border is.
fn above_the_fillet(shape: &Faces, then: impl Fn(&dyn Fn(u32, f64) -> Option<Vec<u32>>, &Faces)) {
    let middle = 1.5 * (1.0 - (PI / 4.0).cos());
    let top = |f: usize| height_of(shape, f) > middle;
    let label: Vec<u32> = (0..shape.1.len()).map(|f| u32::from(top(f))).collect();
    let topology = Topology::new(&shape.0, &shape.1).unwrap();
    let dual = Dual::new(&shape.0, &shape.1, &topology).unwrap();
    let above = |own: u32, thickness: f64| {
        let standing =
            Standing { positions: &shape.0, triangles: &shape.1, dual: &dual, label: &label, own, thickness };
        let faces: Vec<u32> = (0..label.len() as u32).filter(|&f| label[f as usize] == own).collect();
        standing.above(&faces)
    };
    then(&above, shape);
}

#[test]
fn what_stands_on_a_fillet_is_steep() {
    // a cone above the fillet, its sides at an angle with the axis
    for (angle, stands) in [(20.0f64, true), (28.0, true), (32.0, false), (45.0, false)] {
        let mut profile = vec![[0.0, -8.0], [25.0, -8.0], [25.0, 0.0]];
        let (steps, fillet, radius) = (8, 1.5, 9.0);
        let end = 0.5 * PI - angle.to_radians();
        profile.extend(
            (0..=steps)
                .map(|k| end * f64::from(k) / f64::from(steps))
                .map(|a| [radius + fillet * (1.0 - a.sin()), fillet * (1.0 - a.cos())]),
        );
        let [r, z] = *profile.last().unwrap();
        let height = 0.8 * r / angle.to_radians().tan();
        profile.extend([[0.2 * r, z + height], [0.0, z + height]]);
        above_the_fillet(&revolved(&profile, 48), |above, _| assert_eq!(above(1, 4.0).is_some(), stands, "{angle}"));
    }
}

#[test]
fn the_greatest_width_goes_on_from_the_middle() {
    // ninety places grow wider evenly; ten are corners, of which those count that go on so
    let corners = [0.95, 1.0, 1.02, 1.035, 1.05, 1.1, 1.2, 1.3, 1.4, 1.5];
    let widths = (1..=90).map(|k| 0.01 * f64::from(k)).chain(corners);
    let places: Vec<Place> = widths.map(|w| place(0, w, 0, 1.0)).collect();
    on_mesh(&turned_box([2.0; 3]), 1, |mesh, _| {
        let triangles = mesh.topology()?.oriented(mesh.triangles());
        let dual = Dual::new(mesh.positions(), &triangles, mesh.topology()?)?;
        let skin = Skin::of(mesh, &triangles, &dual)?;
        let scene = Scene { skin: &skin, label: &[0; 12] };
        // 0.9 + 0.35 (0.9 - 0.5)
        let (most, least) = scene.widths(0, places.iter().collect(), &[])?;
        assert_eq!([most.width, least.width], [1.035, 0.01]);
        Ok(())
    });
}

#[test]
fn what_is_mostly_even_is_that_wide() {
    let places: Vec<Place> =
        (0..100).map(|k| place(0, if k < 70 { 2.0 + 1e-4 * k as f64 } else { 3.0 }, 0, 1.0)).collect();
    let sorted: Vec<&Place> = places.iter().collect();
    near(plateau(&sorted).unwrap(), 2.0069, 1e-9);
    let cone: Vec<Place> = (0..100).map(|k| place(0, 1.0 + 0.02 * k as f64, 0, 1.0)).collect();
    assert_eq!(plateau(&cone.iter().collect::<Vec<_>>()), None);
    assert_eq!(plateau(&[]), None);
}

#[test]
fn walls_are_joined_by_how_they_meet() {
    // labels by face, eight to a piece of the profile and two to an end; walls as thick as told, both sides their own
    let joined = |shape: &Faces, label: &dyn Fn(usize) -> u32, thickness: &[f64]| {
        let topology = Topology::new(&shape.0, &shape.1).unwrap();
        let dual = Dual::new(&shape.0, &shape.1, &topology).unwrap();
        let label: Vec<u32> = (0..shape.1.len()).map(label).collect();
        let of = |k: usize| label.iter().position(|&l| l as usize == k).unwrap() as u32;
        let places: Vec<Place> = thickness.iter().enumerate().map(|(k, &t)| place(of(k), t, of(k), 1.0)).collect();
        sheets::closed_or_bent(&dual, &label, &places).unwrap()
    };
    let bend =
        |r: f64| (0..=6).map(move |k| PI * f64::from(k) / 12.0).map(move |a| [4.0 - r * a.sin(), 4.0 - r * a.cos()]);
    let outer: Vec<[f64; 2]> = [[24.0, 0.0]].into_iter().chain(bend(4.0)).chain([[0.0, 20.0]]).collect();
    let inner: Vec<[f64; 2]> = [[24.0, 2.0]].into_iter().chain(bend(2.0)).chain([[2.0, 20.0]]).collect();
    let bent = folded(&outer, &inner, false, 36.0);
    let half = |f: usize| u32::from((32..64).contains(&f) || f >= 66);
    assert_eq!(joined(&bent, &half, &[2.0, 2.0]), [0, 0]);
    assert_eq!(joined(&bent, &half, &[2.0, 3.0]), [0, 1]);
    // a tenth thicker is as thick, a quarter is not
    assert_eq!(joined(&bent, &half, &[2.0, 2.2]), [0, 0]);
    assert_eq!(joined(&bent, &half, &[2.0, 2.55]), [0, 1]);
    // a wall is 12.5 times as large as its thickness squared
    let area =
        |k: u32| (0..bent.1.len()).filter(|&f| half(f) == k).map(|f| area(corners(&bent.0, bent.1[f]))).sum::<f64>();
    let thickest = (area(0).min(area(1)) / 12.5).sqrt();
    assert_eq!(joined(&bent, &half, &[0.95 * thickest; 2]), [0, 0]);
    assert_eq!(joined(&bent, &half, &[1.05 * thickest; 2]), [0, 1]);
    let tube =
        [[[0.0, 0.0], [22.0, 0.0], [22.0, 18.0], [0.0, 18.0]], [[2.0, 2.0], [20.0, 2.0], [20.0, 16.0], [2.0, 16.0]]];
    let shell = folded(&tube[0], &tube[1], true, 36.0);
    assert_eq!(joined(&shell, &|f| f as u32 / 8, &[2.0; 4]), [0; 4]);
    assert_eq!(joined(&shell, &|f| f as u32 / 8, &[2.0, 2.0, 2.0, 3.0]), [0, 1, 2, 3]);
    // three sides of it close nothing
    let channel = folded(&tube[0], &tube[1], false, 36.0);
    assert_eq!(joined(&channel, &|f| [f as u32 / 8, 0, 0, 2, 2][f.max(23) - 23], &[2.0; 3]), [0, 1, 2]);
}
