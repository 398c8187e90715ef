//! Shapes whose features are known, and what the tests of the steps and of whole parts have in common.

mod parts;
mod steps;

use super::widths::Place;
use super::*;
use crate::job::CancelToken;
use crate::mesh::MeshOptions;
use crate::mesh::measure::{add, cross, dot, scale};
use std::f64::consts::PI;

type Faces = (Vec<Vec3>, Vec<[u32; 3]>);

fn on_mesh<T: Send>(shape: &Faces, threads: usize, then: impl FnOnce(&TriMesh, &Job) -> Result<T> + Send) -> T {
    let job = Job::new(threads, None, CancelToken::default());
    let run = || then(&TriMesh::new(&(&shape.0[..], &shape.1[..]), &MeshOptions::default(), &job)?, &job);
    job.run(None, run).unwrap()
}

fn near(value: f64, truth: f64, share: f64) {
    assert!((value / truth - 1.0).abs() <= share, "{value} is not {truth}");
}

/// A flat grid with lines at these x and y; two faces a cell, cells by rows.
fn grid(x: &[f64], y: &[f64]) -> Faces {
    let positions = y.iter().flat_map(|&y| x.iter().map(move |&x| [x, y, 0.0])).collect();
    let n = x.len() as u32;
    let cells = (0..y.len() as u32 - 1).flat_map(|j| (0..n - 1).map(move |i| j * n + i));
    (positions, cells.flat_map(|a| [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]).collect())
}

/// A box from the origin to `size`, turned about the diagonal and moved.
fn turned_box(size: Vec3) -> Faces {
    let [x, y, z] = size;
    let p = [0, 1, 2, 3, 4, 5, 6, 7].map(|k: u32| [x * (k & 1) as f64, y * (k >> 1 & 1) as f64, z * (k >> 2) as f64]);
    let (s, c) = 0.7f64.sin_cos();
    let d = 1.0 / 3.0f64.sqrt();
    let axis = [d, d, d];
    let turn = |p: Vec3| {
        let along = scale(axis, (1.0 - c) * dot(axis, p));
        add(add(add(scale(p, c), scale(cross(axis, p), s)), along), [5.0, -3.0, 2.0])
    };
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    (p.map(turn).to_vec(), quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
}

/// A profile of radii and heights, from the axis and back to it, turned around the axis in `n` steps.
fn revolved(profile: &[[f64; 2]], n: u32) -> Faces {
    let last = profile.len() - 1;
    let mut positions = vec![[0.0, 0.0, profile[0][1]]];
    for [r, z] in &profile[1..last] {
        positions
            .extend((0..n).map(|j| 2.0 * PI * f64::from(j) / f64::from(n)).map(|a| [r * a.cos(), r * a.sin(), *z]));
    }
    positions.push([0.0, 0.0, profile[last][1]]);
    let (at, top) = (|i: usize, j: u32| 1 + (i as u32 - 1) * n + j % n, positions.len() as u32 - 1);
    let mut triangles = Vec::new();
    for j in 0..n {
        triangles.push([0, at(1, j + 1), at(1, j)]);
        for i in 1..last - 1 {
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
        triangles.push([at(last - 1, j), at(last - 1, j + 1), top]);
    }
    (positions, triangles)
}

/// A disc of radius 12 and thickness 8 with its top at 0 that carries a pin of `radius` and `height` with a fillet.
fn pin_on_disc(radius: f64, height: f64, fillet: f64, steps: u32, n: u32) -> Faces {
    let mut profile = vec![[0.0, -8.0], [12.0, -8.0], [12.0, 0.0]];
    profile.extend(
        (0..=steps)
            .map(|k| 0.5 * PI * f64::from(k) / f64::from(steps))
            .map(|a| [radius + fillet * (1.0 - a.sin()), fillet * (1.0 - a.cos())]),
    );
    profile.extend([[radius, height], [0.0, height]]);
    revolved(&profile, n)
}

fn height_of(shape: &Faces, f: usize) -> f64 {
    shape.1[f].map(|v| shape.0[v as usize][2]).iter().sum::<f64>() / 3.0
}

fn place(face: u32, width: f64, facing: u32, area: f64) -> Place {
    Place { at: [0.0; 3], face, area, width, across: [0.0; 3], facing }
}

/// A sheet of even thickness along a profile: its outer and inner points, extruded; the ends closed unless it closes.
fn folded(outer: &[[f64; 2]], inner: &[[f64; 2]], closed: bool, depth: f64) -> Faces {
    let n = outer.len() as u32;
    let at = |p: &[f64; 2], y: f64| [p[0], y, p[1]];
    let positions = [(outer, 0.0), (inner, 0.0), (outer, depth), (inner, depth)]
        .iter()
        .flat_map(|(points, y)| points.iter().map(|p| at(p, *y)))
        .collect();
    let mut quads: Vec<[u32; 4]> = Vec::new();
    for i in 0..if closed { n } else { n - 1 } {
        let j = (i + 1) % n;
        quads.extend([[i, j, j + 2 * n, i + 2 * n], [j + n, i + n, i + 3 * n, j + 3 * n]]);
        quads.extend([[j, i, i + n, j + n], [i + 2 * n, j + 2 * n, j + 3 * n, i + 3 * n]]);
    }
    if !closed {
        let e = n - 1;
        quads.extend([[0, 2 * n, 3 * n, n], [e, e + n, e + 3 * n, e + 2 * n]]);
    }
    (positions, quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
}

/// A plate of square cells, those marked in the rows.
fn cut_out(rows: &[&str], cell: f64, thickness: f64) -> Faces {
    let mut shape: Faces = Default::default();
    let full = |i: i32, j: i32| {
        let row = usize::try_from(j).ok().and_then(|j| rows.get(j));
        row.zip(usize::try_from(i).ok()).is_some_and(|(row, i)| row.as_bytes().get(i) == Some(&b'#'))
    };
    let mut quad = |corners: [(i32, i32, f64); 4]| {
        let v = shape.0.len() as u32;
        shape.0.extend(corners.map(|(i, j, z)| [cell * f64::from(i), cell * f64::from(j), z]));
        shape.1.extend([[v, v + 1, v + 2], [v, v + 2, v + 3]]);
    };
    let t = thickness;
    for (j, row) in (0..).zip(rows) {
        for i in (0..row.len() as i32).filter(|&i| full(i, j)) {
            quad([(i, j, t), (i + 1, j, t), (i + 1, j + 1, t), (i, j + 1, t)]);
            quad([(i, j, 0.0), (i, j + 1, 0.0), (i + 1, j + 1, 0.0), (i + 1, j, 0.0)]);
            for (a, b, di, dj) in
                [((0, 0), (1, 0), 0, -1), ((1, 0), (1, 1), 1, 0), ((1, 1), (0, 1), 0, 1), ((0, 1), (0, 0), -1, 0)]
            {
                if !full(i + di, j + dj) {
                    let ends = [(i + a.0, j + a.1), (i + b.0, j + b.1)];
                    quad(
                        [(ends[0].0, ends[0].1, 0.0), (ends[1].0, ends[1].1, 0.0)]
                            .into_iter()
                            .chain([(ends[1].0, ends[1].1, t), (ends[0].0, ends[0].1, t)])
                            .collect::<Vec<_>>()
                            .try_into()
                            .unwrap(),
                    );
                }
            }
        }
    }
    shape
}

fn features_of(shape: &Faces) -> Vec<Feature> {
    on_mesh(shape, 2, |mesh, job| Ok(find_features(mesh, &FeatureOptions::default(), job)?.features))
}
