//! The paper's numerical experiments (Figs. 11 to 20), each a table of shapes, what is known of them and what is measured.

use super::measure::{Measured, measure, measure_with_cone, segments};
use super::shapes::{Shape, bar, bent, bent_rod, cells, cuboid, ellipsoid, finer, helix, regular, sphere};
use armesh::error::Result;
use armesh::field::Profile;
use armesh::geodesic::exact::{ExactGeodesics, Limits, Scratch, SurfacePoint};
use armesh::job::Job;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// One shape of an experiment.
#[derive(Debug, Clone)]
pub struct Row {
    /// The shape, or its parameter in words.
    pub name: String,
    /// The parameter, for plots.
    pub x: f64,
    /// What the paper says of D1max/D2max here, in words; empty where it says nothing.
    pub stated: String,
    /// D1max and D2max of the shape, in closed form or by exact ways.
    pub exact_parts: Option<[f64; 2]>,
    /// Their ratio.
    pub exact: Option<f64>,
    /// D1max/D2max in the paper's profile and in the print profile.
    pub paper: f64,
    pub print: f64,
    /// D1max and D2max in the paper's profile.
    pub paper_parts: [f64; 2],
    /// D1ave/D2ave likewise.
    pub paper_mean: f64,
    pub print_mean: f64,
    pub faces: usize,
}

fn row(name: String, x: f64, stated: &str, exact: Option<[f64; 2]>, shape: &Shape) -> Result<Row> {
    let (paper, print) = (measure(shape, Profile::Paper)?, measure(shape, Profile::Print)?);
    Ok(Row {
        name,
        x,
        stated: stated.into(),
        exact_parts: exact,
        exact: exact.map(|[d1, d2]| d1 / d2),
        paper: paper.ratio(),
        print: print.ratio(),
        paper_parts: [paper.summary.d1_max, paper.summary.d2_max],
        paper_mean: paper.summary.ratio_mean,
        print_mean: print.summary.ratio_mean,
        faces: shape.triangles.len(),
    })
}

/// Side of the square shapes, mm.
pub const SQUARE: f64 = 100.0;

/// Fig. 13: a square of 100 mm extruded to each of these lengths, of about `faces` triangles.
pub fn squares(lengths: &[f64], faces: usize) -> Result<Vec<Row>> {
    let of = |&l: &f64| {
        let size = [SQUARE, SQUARE, l];
        let aspect = SQUARE.max(l) / SQUARE.min(l);
        let shape = cuboid(size, cells(size, faces));
        row(format!("100 x 100 x {l} mm, AR {aspect:.1}"), aspect, "about AR", square_exact(l), &shape)
    };
    lengths.iter().map(of).collect()
}

/// Slabs: between opposite corners over a side; long bars: between the middles of the ends. Between them no closed form.
fn square_exact(l: f64) -> Option<[f64; 2]> {
    let d1 = match l {
        l if l <= SQUARE => Some(SQUARE.hypot(SQUARE + l)),
        l if l >= 2.0 * SQUARE => Some(SQUARE + l),
        _ => None,
    };
    d1.map(|d| [d, SQUARE.min(l)])
}

/// Figs. 11 and 12: the wall, the cube and the rod whose distributions are shown.
pub fn distributions(faces: usize) -> Result<Vec<(&'static str, Measured)>> {
    let of = |(name, l): (&'static str, f64)| {
        let size = [SQUARE, SQUARE, l];
        Ok((name, measure(&cuboid(size, cells(size, faces)), Profile::Paper)?))
    };
    [("thin wall, 100 x 100 x 2 mm", 2.0), ("cube, 100 mm", 100.0), ("rod, 100 x 100 x 2000 mm", 2000.0)]
        .map(of)
        .into_iter()
        .collect()
}

/// Fig. 14: ellipsoids of revolution, drawn out to each of these aspect ratios and flattened to it.
pub fn ellipsoids(aspects: &[f64], faces: usize) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for &a in aspects {
        let exact = Some([ellipse_perimeter(a, 1.0) / 2.0, 2.0]);
        let stated = if a == 1.0 { "pi/2 = 1.571" } else { "follows AR" };
        rows.push(row(format!("{a} x 1 x 1"), a, stated, exact, &ellipsoid(a, 1.0, faces))?);
        if a > 1.0 {
            rows.push(row(format!("{a} x {a} x 1"), a, stated, exact, &ellipsoid(1.0, a, faces))?);
        }
    }
    Ok(rows)
}

/// Ramanujan's second formula; off by less than 1e-4 for axes up to 1 : 20.
fn ellipse_perimeter(a: f64, b: f64) -> f64 {
    let h = ((a - b) / (a + b)).powi(2);
    PI * (a + b) * (1.0 + 3.0 * h / (10.0 + (4.0 - 3.0 * h).sqrt()))
}

/// Fig. 15: the regular polyhedra and the sphere, of about `faces` triangles each.
pub fn polyhedra(faces: usize) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for (k, (name, shape)) in regular().into_iter().enumerate() {
        let n = (faces as f64 / shape.triangles.len() as f64).sqrt().round() as usize;
        rows.push(row(name.into(), k as f64, "over 1, falling", polyhedron(name), &finer(&shape, n))?);
    }
    let n = (faces as f64 / 20.0).sqrt().round() as usize;
    rows.push(row("sphere".into(), 5.0, "pi/2 = 1.571", Some([PI, 2.0]), &sphere(n))?);
    Ok(rows)
}

/// D1max and D2max of the polyhedra of [`regular`]. D1max is the way from a corner to the opposite one (of the tetrahedron:
/// to the middle of the opposite side), straight over the sides that it crosses once they are laid flat: the longest of
/// all, as unfolding the sides from a grid of points shows. D2max is the inscribed sphere's diameter.
fn polyhedron(name: &str) -> Option<[f64; 2]> {
    let golden = (1.0 + 5f64.sqrt()) / 2.0;
    let (edge, d1, d2) = match name {
        "tetrahedron" => (8f64.sqrt(), 2.0 / 3f64.sqrt(), 6f64.sqrt() / 6.0),
        "cube" => (2.0, 5f64.sqrt(), 1.0),
        "octahedron" => (2f64.sqrt(), 3f64.sqrt(), 6f64.sqrt() / 3.0),
        "dodecahedron" => (2.0 / golden, (5.0 + 7.0 * golden).sqrt(), ((25.0 + 11.0 * 5f64.sqrt()) / 10.0).sqrt()),
        "icosahedron" => (2.0, 7f64.sqrt(), golden * golden / 3f64.sqrt()),
        _ => return None,
    };
    Some([edge * d1, edge * d2])
}

/// Length and diameter of the curved rod of Fig. 16 and of the wire of Fig. 18, length, width and thickness of the curved
/// wall of Fig. 17, mm. The paper gives the rod's and the wall's proportions only, and not the wall's width.
pub const ROD: [f64; 2] = [100.0, 5.0];
pub const WIRE: [f64; 2] = [157.0, 5.0];
pub const WALL: [f64; 3] = [100.0, 100.0, 0.1];

/// Cells of a round bar with even triangles: around a quarter, and along.
fn round_cells([length, diameter]: [f64; 2], quarter: usize) -> [usize; 3] {
    [(length / (PI * diameter) * 4.0 * quarter as f64).round() as usize, quarter, quarter]
}

/// The longest shortest way over a bar: exact ways to every vertex, from so many places all around one of its ends and then
/// from wherever the longest of them leads, as long as it grows. The ends of the longest way lie at the ends of the bar;
/// a ring is alike all along, and any place of it will do for an end.
fn longest_way(shape: &Shape, diameter: f64, sources: usize) -> Result<f64> {
    let solver = ExactGeodesics::new(&shape.positions, &shape.triangles)?;
    let (job, limits) = (Job::default(), Limits::default());
    // the farthest vertex and its distance
    let farthest = |from: u32| -> Result<(u32, f64)> {
        let from = SurfacePoint::Vertex(from);
        let found = solver.distances(from, &[], &limits, &mut Scratch::default(), &job)?.vertices;
        Ok((0..).zip(found).fold((0, 0.0), |m, (v, d)| if d > m.1 { (v, d) } else { m }))
    };
    let (end, _) = farthest(0)?;
    let gap = |v: u32| {
        let (p, q) = (shape.positions[v as usize], shape.positions[end as usize]);
        (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt()
    };
    let near: Vec<u32> = (0..shape.positions.len() as u32).filter(|&v| gap(v) <= diameter).collect();
    let step = near.len().div_ceil(sources);
    let found: Vec<(u32, f64)> = near.par_iter().step_by(step).map(|&v| farthest(v)).collect::<Result<_>>()?;
    let mut best = found.into_iter().fold((0, 0.0), |m, f| if f.1 > m.1 { f } else { m });
    loop {
        let next = farthest(best.0)?;
        if next.1 <= best.1 * (1.0 + 1e-6) {
            return Ok(best.1);
        }
        best = next;
    }
}

/// Fig. 16: a round rod of AR 20 bent by each of these angles, degrees; closed at 360. So many cells a quarter turn: of
/// the rod that is measured, and of the one whose exact ways from so many `sources` are the exact D1max.
pub fn curved_rods(degrees: &[f64], quarters: [usize; 2], sources: usize) -> Result<Vec<Row>> {
    let of = |&angle: &f64| {
        let shape = bent_rod(ROD[0], ROD[1], angle.to_radians(), round_cells(ROD, quarters[0]));
        let stated = if angle < 360.0 { "about 20" } else { "about 10" };
        let fine = bent_rod(ROD[0], ROD[1], angle.to_radians(), round_cells(ROD, quarters[1]));
        let exact = [longest_way(&fine, ROD[1], sources)?, ROD[1]];
        row(format!("{angle} degrees"), angle, stated, Some(exact), &shape)
    };
    degrees.iter().map(of).collect()
}

/// A wall of AR 1000 bent by an angle in degrees, of `n` by `n` cells.
pub fn curved_wall(degrees: f64, n: usize) -> Shape {
    bent(WALL, degrees.to_radians(), [n, n, 1])
}

/// Fig. 17: such walls. A thin sheet keeps its lengths when it is bent: open, D1 is its diagonal; closed, half as long one way.
pub fn curved_walls(degrees: &[f64], n: usize) -> Result<Vec<Row>> {
    let of = |&angle: &f64| {
        let [length, width, thick] = WALL;
        let (stated, long) = if angle < 360.0 { ("about 1200", length) } else { ("about 1000", length / 2.0) };
        row(format!("{angle} degrees"), angle, stated, Some([long.hypot(width), thick]), &curved_wall(angle, n))
    };
    degrees.iter().map(of).collect()
}

/// The wall at 300 degrees, with rays in a cone of each of these angles, degrees: cone, D1max, D2max, ratio.
pub fn wall_by_cone(cones: &[f64], n: usize) -> Result<Vec<[f64; 4]>> {
    let shape = curved_wall(300.0, n);
    let of = |&cone: &f64| {
        let summary = measure_with_cone(&shape, cone.to_radians())?.summary;
        Ok([cone, summary.d1_max, summary.d2_max, summary.ratio_max])
    };
    cones.iter().map(of).collect()
}

/// Fig. 18: one turn of a helix of round wire that rises by each of these heights, mm; closed at 0. Exact
/// values as of [`curved_rods`].
pub fn helices(heights: &[f64], quarters: [usize; 2], sources: usize) -> Result<Vec<Row>> {
    let of = |&height: &f64| {
        let shape = helix(WIRE[0], WIRE[1], height, round_cells(WIRE, quarters[0]));
        let stated = if height > 0.0 { "about 31.4" } else { "about 15" };
        let fine = helix(WIRE[0], WIRE[1], height, round_cells(WIRE, quarters[1]));
        let exact = [longest_way(&fine, WIRE[1], sources)?, WIRE[1]];
        row(format!("H = {height} mm"), height, stated, Some(exact), &shape)
    };
    heights.iter().map(of).collect()
}

/// Figs. 19 and 20: square shapes of these lengths, every side cut into k × k cells: 12 k² triangles. By length.
pub fn sensitivity(lengths: &[f64], cells: &[usize]) -> Result<Vec<(f64, Vec<Row>)>> {
    let of = |&l: &f64| {
        let cut = |&k: &usize| {
            let shape = cuboid([SQUARE, SQUARE, l], [k; 3]);
            row(format!("{}", 12 * k * k), (12 * k * k) as f64, "tends to a value", square_exact(l), &shape)
        };
        Ok((l, cells.iter().map(cut).collect::<Result<_>>()?))
    };
    lengths.iter().map(of).collect()
}

/// A shape as CAD exports it and the same with every triangle cut in n².
pub struct Coarse {
    pub name: &'static str,
    pub faces: [usize; 2],
    /// D1max/D2max in the print profile, of each.
    pub print: [f64; 2],
    /// The same in the paper's profile.
    pub paper: [f64; 2],
}

/// Shapes of as few triangles as they can have.
pub fn coarse_shapes() -> Vec<(&'static str, Shape)> {
    let mut shapes = vec![
        ("slab 100 x 100 x 2", cuboid([SQUARE, SQUARE, 2.0], [1; 3])),
        ("cube", cuboid([SQUARE; 3], [1; 3])),
        ("bar 100 x 100 x 2000", cuboid([SQUARE, SQUARE, 2000.0], [1; 3])),
        ("curved wall, 270 degrees", bent(WALL, 1.5 * PI, [36, 1, 1])),
        ("curved wall, closed", bent(WALL, TAU, [36, 1, 1])),
        (
            "square ring",
            bar([24, 1, 1], true, |u| {
                let (a, r) = (TAU * u[0], 25.0 - 5.0 * (u[2] - 0.5));
                [r * a.sin(), 5.0 * u[1], -r * a.cos()]
            }),
        ),
    ];
    shapes.extend(regular().into_iter().filter(|(name, _)| *name != "cube"));
    shapes
}

/// Independence of the mesh: what the paper's method asks of its meshes and the print profile does not.
pub fn mesh_quality(target: usize) -> Result<Vec<Coarse>> {
    let of = |(name, shape): (&'static str, Shape)| {
        let n = (target as f64 / shape.triangles.len() as f64).sqrt().ceil() as usize;
        let fine = finer(&shape, n.max(2));
        let both = |profile| Ok([measure(&shape, profile)?.ratio(), measure(&fine, profile)?.ratio()]);
        let faces = [shape.triangles.len(), fine.triangles.len()];
        Ok(Coarse { name, faces, print: both(Profile::Print)?, paper: both(Profile::Paper)? })
    };
    coarse_shapes().into_iter().map(of).collect()
}

/// A bar whose ends meet, and the same bar open.
pub struct Closed {
    pub name: &'static str,
    /// D1max/D2max open and closed.
    pub open: f64,
    pub closed: f64,
    /// The length of the closed way around it over D2max, and the library's word that it is a ring.
    pub around: f64,
    pub ring: bool,
}

/// The question that the paper leaves open: rings have half the D1 of the bar that they were bent from.
pub fn rings(quarter: usize) -> Result<Vec<Closed>> {
    let rod = |angle: f64| bent_rod(ROD[0], ROD[1], angle, round_cells(ROD, quarter));
    let wire = |height: f64| helix(WIRE[0], WIRE[1], height, round_cells(WIRE, quarter));
    let pairs = [("curved rod", rod(1.9 * PI), rod(TAU)), ("helical wire", wire(20.0), wire(0.0))];
    let of = |(name, open, closed): (&'static str, Shape, Shape)| {
        let whole = measure(&closed, Profile::Print)?;
        let found = segments(&whole.mesh, Some(1))?;
        let s = &found.segments[0];
        let open = measure(&open, Profile::Print)?.ratio();
        Ok(Closed { name, open, closed: whole.ratio(), around: s.loop_length / s.d2_max, ring: s.ring })
    };
    pairs.map(of).into_iter().collect()
}
