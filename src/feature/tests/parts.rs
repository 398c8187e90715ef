//! Whole parts: which features are found, and what they measure.

use super::*;

#[test]
fn another_tessellation_gives_the_same_features() {
    let find = |steps: u32, n: u32, threads: usize| {
        on_mesh(&pin_on_disc(1.0, 14.0, 1.5, steps, n), threads, |mesh, job| {
            find_features(mesh, &FeatureOptions::default(), job)
        })
    };
    let [coarse, rough, fine] = [(5, 32), (4, 24), (10, 64)].map(|(steps, n)| find(steps, n, 2));
    for found in [&coarse, &rough, &fine] {
        // the ring in the middle of the fillet may be a feature of its own, but no finding
        assert!(found.features.len() >= 2 && found.features[2..].iter().all(|f| f.ratio < 5.0));
        let pin = &found.features[1];
        assert_eq!(pin.kind, Kind::Bar);
        near(pin.d2_max.width, 2.0, 0.03);
        // from the end of the fillet to the middle of the top
        near(pin.d1_max, 12.5 + 1.0, 0.01);
    }
    for found in [&coarse, &rough] {
        (0..2).for_each(|k| near(found.features[k].ratio, fine.features[k].ratio, 0.03));
    }
    let again = find(5, 32, 1);
    assert_eq!(again.face_feature, coarse.face_feature);
    assert_eq!(again.features, coarse.features);
}

#[test]
fn a_ring_of_very_many_faces_is_that_of_few() {
    let ring = |n: u32, m: u32| {
        let angle = |k: u32, of: u32| 2.0 * PI * f64::from(k) / f64::from(of);
        let point = |k: u32| {
            let (a, b) = (angle(k / m, n), angle(k % m, m));
            let r = 10.0 + b.cos();
            [r * a.cos(), r * a.sin(), b.sin()]
        };
        let at = |i: u32, j: u32| m * (i % n) + j % m;
        let cells = (0..n).flat_map(|i| (0..m).map(move |j| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]));
        let shape: Faces =
            ((0..n * m).map(point).collect(), cells.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect());
        on_mesh(&shape, 2, |mesh, job| find_features(mesh, &FeatureOptions::default(), job))
    };
    let [few, many] = [ring(90, 24), ring(720, 48)].map(|f| f.features);
    assert_eq!((few.len(), many.len()), (1, 1));
    let (few, many) = (&few[0], &many[0]);
    assert!(many.faces as usize > crate::mesh::proxy::REFERENCE_LIMIT);
    assert_eq!((few.kind, many.kind), (Kind::Ring, Kind::Ring));
    near(many.d1_max, few.d1_max, 0.01);
    near(many.d2_max.width, 2.0, 0.02);
    assert!(many.d1_upper >= many.d1_max);
    // the box is that of all vertices
    near(many.bounds.size[0], 22.0, 1e-3);
}

#[test]
fn plates_in_an_angle_are_two_walls_a_box_and_a_bent_sheet_are_one() {
    let angle = [[[24.0, 0.0], [0.0, 0.0], [0.0, 20.0]], [[24.0, 2.0], [2.0, 2.0], [2.0, 20.0]]];
    let walls = features_of(&folded(&angle[0], &angle[1], false, 36.0));
    assert_eq!(walls.len(), 2);
    for (wall, length) in walls.iter().zip([24.0, 18.0]) {
        assert_eq!(wall.kind, Kind::Wall);
        near(wall.d2_max.width, 2.0, 0.01);
        // from corner to corner, and around the rim
        assert!((0.93..1.08).contains(&(wall.d1_max / 36.0f64.hypot(length + 1.0))), "{} {length}", wall.d1_max);
    }
    // four walls that close
    let tube =
        [[[0.0, 0.0], [22.0, 0.0], [22.0, 18.0], [0.0, 18.0]], [[2.0, 2.0], [20.0, 2.0], [20.0, 16.0], [2.0, 16.0]]];
    assert_eq!(features_of(&folded(&tube[0], &tube[1], true, 36.0)).len(), 1);
    // around radii of 4 and 2
    let bend = |r: f64| {
        (0..=6).map(move |k| 0.5 * PI * f64::from(k) / 6.0).map(move |a| [4.0 - r * a.sin(), 4.0 - r * a.cos()])
    };
    let outer: Vec<[f64; 2]> = [[24.0, 0.0]].into_iter().chain(bend(4.0)).chain([[0.0, 20.0]]).collect();
    let inner: Vec<[f64; 2]> = [[24.0, 2.0]].into_iter().chain(bend(2.0)).chain([[2.0, 20.0]]).collect();
    let bent = features_of(&folded(&outer, &inner, false, 36.0));
    assert_eq!(bent.len(), 1);
    near(bent[0].d2_max.width, 2.0, 0.03);
}

#[test]
fn a_boss_lower_than_wide_is_as_thick_as_it_is_high() {
    let boss = |height: f64| {
        let profile = [[0.0, -8.0], [12.0, -8.0], [12.0, 0.0], [4.0, 0.0], [4.0, height], [0.0, height]];
        let mut found = features_of(&revolved(&profile, 32));
        assert_eq!(found.len(), 2);
        found.swap_remove(1).d2_max.width
    };
    near(boss(3.0), 3.0, 1e-6);
    // but a relief stiffens what it is on
    let relief = boss(1.4);
    assert!(relief > 5.6, "{relief}");
}

/// An outline and its triangles, extruded.
fn extruded(outline: &[[f64; 2]], caps: &[[u32; 3]], depth: f64) -> Faces {
    let n = outline.len() as u32;
    let level = |z: f64| outline.iter().map(move |p| [p[0], p[1], z]);
    let sides = (0..n).flat_map(|i| {
        let j = (i + 1) % n;
        [[i, j, j + n], [i, j + n, i + n]]
    });
    let ends = caps.iter().flat_map(|&[a, b, c]| [[c, b, a], [a + n, b + n, c + n]]);
    (level(0.0).chain(level(depth)).collect(), sides.chain(ends).collect())
}

#[test]
fn a_wall_flush_with_its_body_ends_where_its_body_begins_whatever_the_triangles() {
    let corners = [[0.0, 0.0], [50.0, 0.0], [50.0, 9.0], [3.0, 9.0], [3.0, 40.0], [0.0, 40.0]];
    // ends in triangles from a corner of the body to the top of the wall; and in those of two rectangles
    let long = extruded(&corners, &[[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]], 24.0);
    let apart = [&corners[..], &[[0.0, 9.0]]].concat();
    let apart = extruded(&apart, &[[0, 1, 2], [0, 2, 3], [0, 3, 6], [6, 3, 4], [6, 4, 5]], 24.0);
    let [long, apart] = [long, apart].map(|shape| {
        let mut found = features_of(&shape);
        found.sort_by(|a, b| a.ratio.total_cmp(&b.ratio));
        found
    });
    assert_eq!([long.len(), apart.len()], [2, 2]);
    for (a, b) in long.iter().zip(&apart) {
        near(a.d1_max, b.d1_max, 0.02);
        near(a.d2_max.width, b.d2_max.width, 0.02);
        near(a.area, b.area, 0.02);
        assert_eq!(a.kind, b.kind);
    }
}

#[test]
fn the_outer_tines_of_a_fork_are_tines() {
    let row = ["###############", "#####.........."];
    let fork = cut_out(&[row[0], row[1], row[1], row[0], row[1], row[1], row[0]], 2.4, 2.6);
    let found = features_of(&fork);
    assert_eq!(found.len(), 4);
    for tine in &found[1..] {
        assert_eq!(tine.kind, Kind::Bar);
        near(tine.d2_max.width, 2.4, 0.02);
        near(tine.d1_max, 10.0 * 2.4 + 1.2, 0.06);
    }
}

#[test]
fn the_floor_of_a_cup_is_one_with_its_wall_and_the_crown_of_a_piston_is_not() {
    // upside down: a wall of 1.5 with a floor of the same, and with a crown four times as thick
    let cap = |top: f64| {
        let inner = [[0.0, 20.0], [10.5, 20.0], [10.5, 0.0]];
        let outer = [[12.0, 0.0], [12.0, 20.0], [12.0, top], [0.0, top]];
        features_of(&revolved(&[&inner[..], &outer[..]].concat(), 40))
    };
    let cup = cap(21.5);
    assert_eq!(cup.len(), 1);
    near(cup[0].d2_max.width, 1.5, 0.05);
    let piston = cap(26.0);
    assert_eq!(piston.len(), 2);
    near(piston[0].d2_max.width, 1.5, 0.05);
    near(piston[1].d2_max.width, 6.0, 0.05);
}

#[test]
fn a_twisted_strip_in_coarse_triangles_is_one_wall() {
    // twisted by 160 degrees in 36 steps: across each step a concave and a convex edge of 40 degrees
    let ring = |k: u32| {
        let (s, c) = (160f64.to_radians() * f64::from(k) / 36.0).sin_cos();
        [[-5.0, -0.75], [5.0, -0.75], [5.0, 0.75], [-5.0, 0.75]]
            .map(|[y, z]: [f64; 2]| [f64::from(k), c * y - s * z, s * y + c * z])
    };
    let side = |a: u32, b: u32| [[a, b, b + 4], [a, b + 4, a + 4]];
    let sides = (0..36u32).flat_map(|k| (0..4).flat_map(move |j| side(4 * k + j, 4 * k + (j + 1) % 4)));
    let ends = [[0, 2, 1], [0, 3, 2], [144, 145, 146], [144, 146, 147]];
    let found = features_of(&((0..=36).flat_map(ring).collect(), sides.chain(ends).collect()));
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].kind, Kind::Wall);
    // the longest ways are those along the edges, which are helices
    near(found[0].d1_max, 36f64.hypot(5.0 * 160f64.to_radians()), 0.1);
}

/// A rod of radius 3 between two bodies of radius 12, blended with radii of `blend`: there is no crease.
fn blended_dumbbell(blend: f64, n: u32) -> Faces {
    let mut half: Vec<[f64; 2]> = (0..=30).map(|k| [3.0, 30.0 * f64::from(k) / 30.0]).collect();
    // from the rod outward, around a radius, onto a ball
    let centre = [3.0 + blend, 30.0];
    let ball = (12.0 + blend).hypot(0.0);
    let along = (ball * ball - centre[0] * centre[0]).sqrt();
    let top = [0.0, 30.0 + along];
    let turn = (top[1] - centre[1]).atan2(centre[0] - top[0]);
    half.extend(
        (1..=40).map(|k| turn * f64::from(k) / 40.0).map(|a| [centre[0] - blend * a.cos(), 30.0 + blend * a.sin()]),
    );
    let from = (half[70][1] - top[1]).atan2(half[70][0]);
    half.extend(
        (1..40)
            .map(|k| from + (0.5 * PI - from) * f64::from(k) / 40.0)
            .map(|a| [12.0 * a.cos(), top[1] + 12.0 * a.sin()]),
    );
    half.push([0.0, top[1] + 12.0]);
    let below = half.iter().skip(1).rev().map(|p| [p[0], -p[1]]);
    revolved(&below.chain(half.iter().copied()).collect::<Vec<_>>(), n)
}

#[test]
fn a_rod_that_grows_out_of_its_bodies_is_told_from_them() {
    for (blend, n) in [(8.0, 48), (12.0, 96)] {
        let shape = blended_dumbbell(blend, n);
        let found = features_of(&shape);
        assert_eq!(found.len(), 3, "{blend}");
        let rod = &found[2];
        near(rod.d2_max.width, 6.0, 0.25);
        near(rod.d1_max, 60.0, 0.3);
        assert_eq!(rod.kind, Kind::Bar);
        for body in &found[..2] {
            near(body.d2_max.width, 24.0, 0.03);
        }
    }
}
