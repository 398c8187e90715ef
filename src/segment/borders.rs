//! The input cut along the borders of its parts.
//!
//! CAD meshes have faces as long as the part, which borders cross: a rib that ends flush with its plate shares a flat side
//! with it, in triangles that know of neither. A label a face would let each part reach as far as its triangles do. Here
//! a face that a border crosses is cut by straight lines, from where labels change on its sides, as long as a cut gains
//! area that has its right label; its neighbours are cut at the points that it gets on common edges, so that the cut
//! mesh is as closed as the input was.

use super::cut::pair;
use crate::error::{Result, try_filled, try_vec};
use crate::mesh::measure::{Vec3, area_vector, corners, cross, distance, dot, norm, scale, sub};
use crate::mesh::surface::AnalysisSurface;
use hashbrown::HashMap;
use std::collections::BTreeMap;

/// A cut is made where it puts so much area right, in squares of the surface's spacing: a quarter of a patch, ...
const LEAST: f64 = 2.0;
/// ... and beyond that a strip along all of the cut that is so many spacings wide.
const STRIP: f64 = 1.0;
/// Cuts begin and end at so many points around a face at most; of more, every second or third is taken.
const ENDS: usize = 24;

/// The input, faces cut that a border crosses.
#[derive(Debug)]
pub struct CutMesh {
    /// Vertices, first those of the input.
    pub positions: Vec<Vec3>,
    /// Faces, oriented as their parents and in their order.
    pub triangles: Vec<[u32; 3]>,
    /// What each face is part of.
    pub label: Vec<u32>,
    /// The input face that each is a part of.
    pub parent: Vec<u32>,
    /// First face of every input face, and the number of faces at the end.
    first: Vec<u32>,
}

impl CutMesh {
    /// The part of the input face `face` that `p` lies on, or is nearest to the inside of.
    pub fn at(&self, face: u32, p: Vec3) -> u32 {
        let children = self.first[face as usize]..self.first[face as usize + 1];
        let inside = |f: u32| {
            let c = corners(&self.positions, self.triangles[f as usize]);
            let normal = area_vector(c);
            let side = |k: usize| dot(cross(sub(c[(k + 1) % 3], c[k]), sub(p, c[k])), normal);
            // the least share of the face on one side of p
            side(0).min(side(1)).min(side(2)) / dot(normal, normal).max(f64::MIN_POSITIVE)
        };
        children.max_by(|&a, &b| inside(a).total_cmp(&inside(b)).then(b.cmp(&a))).unwrap_or(self.first[face as usize])
    }
}

/// A point on the sides of a face, and how far around they are passed there: 1.5 is the middle of the second.
type Stop = (u32, f64);

/// A convex piece of a face: its corners, and what it is part of.
struct Piece {
    ring: Vec<Stop>,
    label: u32,
}

/// A part of a face as the analysis surface has it.
#[derive(Clone, Copy)]
struct Child {
    at: Vec3,
    area: f64,
    label: u32,
}

/// Cuts the input (`triangles`) along the borders of `label` on its analysis surface, whose faces have `area`; none where
/// no face is crossed. `voted` is what most of each face is part of; only parts that are there count.
///
/// # Errors
/// [`crate::error::Error::NoMemory`].
pub fn cut(
    surface: &AnalysisSurface,
    area: &[f64],
    (label, voted): (&[u32], &[u32]),
    triangles: &[[u32; 3]],
) -> Result<Option<CutMesh>> {
    let mut counts = try_filled(label.len(), false, "borders")?;
    voted.iter().for_each(|&l| counts[l as usize] = true);
    let cutter = Cutter { surface, area, label, voted, counts: &counts };
    let mut pieces: BTreeMap<u32, Vec<Piece>> = BTreeMap::new();
    for (f, &t) in triangles.iter().enumerate() {
        if let Some(found) = cutter.pieces(f, t) {
            pieces.insert(f as u32, found);
        }
    }
    if pieces.is_empty() {
        return Ok(None);
    }
    // --- by edge the points that cuts end at
    let mut ends: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
    for (&f, pieces) in &pieces {
        let t = triangles[f as usize];
        for &(v, at) in pieces.iter().flat_map(|p| &p.ring).filter(|s| s.1.fract() != 0.0) {
            let side = at as usize;
            let points = ends.entry(pair(t[side], t[(side + 1) % 3])).or_default();
            if !points.contains(&v) {
                points.push(v);
            }
        }
    }
    gathered(surface, triangles, voted, &pieces, &ends).map(Some)
}

/// All faces: whole ones, pieces, and whole ones with points on their sides, in triangles.
fn gathered(
    surface: &AnalysisSurface,
    triangles: &[[u32; 3]],
    voted: &[u32],
    pieces: &BTreeMap<u32, Vec<Piece>>,
    ends: &BTreeMap<[u32; 2], Vec<u32>>,
) -> Result<CutMesh> {
    let positions = &surface.positions;
    // every end of a cut adds two faces
    let most = triangles.len() + 2 * ends.values().map(Vec::len).sum::<usize>() + 2 * pieces.len();
    let mut out = CutMesh {
        positions: try_vec(positions.len(), "borders")?,
        triangles: try_vec(most, "borders")?,
        label: try_vec(most, "borders")?,
        parent: try_vec(most, "borders")?,
        first: try_vec(triangles.len() + 1, "borders")?,
    };
    out.positions.extend_from_slice(&positions[..surface.input_vertices]);
    let mut number: HashMap<u32, u32> = HashMap::new();
    for (f, &t) in triangles.iter().enumerate() {
        out.first.push(out.triangles.len() as u32);
        let on_sides = on_sides(positions, t, ends);
        let whole;
        let own = match pieces.get(&(f as u32)) {
            Some(own) => &own[..],
            None => {
                whole = [Piece { ring: (0..3).map(|k| (t[k], k as f64)).collect(), label: voted[f] }];
                &whole[..]
            }
        };
        for piece in own {
            let ring = with_points(&piece.ring, &on_sides);
            for triangle in triangulated(positions, ring) {
                let mut numbered = |v: u32| {
                    if (v as usize) < surface.input_vertices {
                        return v;
                    }
                    *number.entry(v).or_insert_with(|| {
                        out.positions.push(positions[v as usize]);
                        out.positions.len() as u32 - 1
                    })
                };
                out.triangles.push(triangle.map(&mut numbered));
                out.label.push(piece.label);
                out.parent.push(f as u32);
            }
        }
    }
    out.first.push(out.triangles.len() as u32);
    Ok(out)
}

/// The points that cuts end at on the sides of a face, in their order around it.
fn on_sides(positions: &[Vec3], t: [u32; 3], ends: &BTreeMap<[u32; 2], Vec<u32>>) -> Vec<Stop> {
    let mut all: Vec<Stop> = Vec::new();
    for k in 0..3 {
        let (a, b) = (t[k], t[(k + 1) % 3]);
        let (p, q) = (positions[a as usize], positions[b as usize]);
        let points = ends.get(&pair(a, b)).into_iter().flatten();
        all.extend(points.map(|&v| (v, k as f64 + distance(positions[v as usize], p) / distance(q, p))));
    }
    all.sort_by(|a, b| a.1.total_cmp(&b.1));
    all
}

/// A ring with the points between its corners that lie on the sides of the face.
fn with_points(ring: &[Stop], on_sides: &[Stop]) -> Vec<u32> {
    let mut out = Vec::with_capacity(ring.len() + on_sides.len());
    for (i, &(v, at)) in ring.iter().enumerate() {
        out.push(v);
        let (w, to) = ring[(i + 1) % ring.len()];
        // the end of the last side is the first corner
        let to = if to == 0.0 { 3.0 } else { to };
        if to > at && to <= at.floor() + 1.0 {
            let between = on_sides.iter().filter(|s| s.1 > at && s.1 < to && s.0 != v && s.0 != w);
            out.extend(between.map(|s| s.0));
        }
    }
    out
}

/// A convex ring, some of whose corners may lie in a line, in triangles: the best ear first that leaves some area.
fn triangulated(positions: &[Vec3], mut ring: Vec<u32>) -> Vec<[u32; 3]> {
    let at = |v: u32| positions[v as usize];
    let mut out = Vec::with_capacity(ring.len());
    while ring.len() > 3 {
        let n = ring.len();
        let ear = |i: usize| [ring[(i + n - 1) % n], ring[i], ring[(i + 1) % n]];
        let vector = ring[1..n].windows(2).fold([0.0; 3], |sum: Vec3, w| {
            let v = area_vector([at(ring[0]), at(w[0]), at(w[1])]);
            [sum[0] + v[0], sum[1] + v[1], sum[2] + v[2]]
        });
        let quality = |i: usize| {
            let c = ear(i).map(at);
            let own = area_vector(c);
            let sides = [distance(c[0], c[1]), distance(c[1], c[2]), distance(c[2], c[0])];
            let left = norm(sub(vector, own));
            let shape = norm(own) / sides.into_iter().fold(f64::MIN_POSITIVE, f64::max).powi(2);
            // what is left must have an area, too
            if left > 1e-9 * norm(vector) { shape } else { -1.0 }
        };
        let best = (0..n).max_by(|&i, &j| quality(i).total_cmp(&quality(j)).then(j.cmp(&i))).unwrap_or(0);
        out.push(ear(best));
        ring.remove(best);
    }
    out.push([ring[0], ring[1], ring[2]]);
    out
}

/// What faces are cut by.
struct Cutter<'a> {
    surface: &'a AnalysisSurface,
    area: &'a [f64],
    label: &'a [u32],
    /// What most of a face is part of.
    voted: &'a [u32],
    /// Whether a part has most of some face.
    counts: &'a [bool],
}

impl Cutter<'_> {
    /// The pieces of a face that a border crosses; none for others.
    fn pieces(&self, f: usize, t: [u32; 3]) -> Option<Vec<Piece>> {
        let children = self.surface.children(f);
        let label = |c: usize| if self.counts[self.label[c] as usize] { self.label[c] } else { self.voted[f] };
        if children.clone().all(|c| label(c) == self.voted[f]) {
            return None;
        }
        let positions = &self.surface.positions;
        let normal = area_vector(corners(positions, t));
        let whole = norm(normal);
        let least = LEAST * self.surface.spacing * self.surface.spacing;
        if !(0.5 * whole > least) {
            return None;
        }
        let mut ring = self.around(t, children.clone(), label)?;
        let ends = ring.iter().filter(|s| s.2).count();
        if ends > ENDS {
            let every = ends.div_ceil(ENDS);
            let mut passed = 0;
            ring.iter_mut().filter(|s| s.2).for_each(|s| {
                s.2 = passed % every == 0;
                passed += 1;
            });
        }
        let all: Vec<Child> = children
            .map(|c| {
                let [p, q, r] = corners(positions, self.surface.triangles[c]);
                let at = [0, 1, 2].map(|i| (p[i] + q[i] + r[i]) / 3.0);
                Child { at, area: self.area[c], label: label(c) }
            })
            .collect();
        let plane = Plane { positions, normal: scale(normal, 1.0 / whole), least, strip: STRIP * self.surface.spacing };
        let ring: Vec<(Stop, bool)> = ring.into_iter().map(|(v, at, end)| ((v, at), end)).collect();
        let mut out = Vec::new();
        let mut used = Vec::new();
        plane.split(ring, all, &mut used, &mut out);
        if out.len() < 2 {
            return None;
        }
        // of the points where labels change only those remain that a cut ends at
        out.iter_mut().for_each(|p| p.ring.retain(|s| s.1.fract() == 0.0 || used.contains(&s.0)));
        Some(out)
    }

    /// The vertices of the analysis surface around a face: its corners, and where labels change (true).
    fn around(
        &self,
        t: [u32; 3],
        children: std::ops::Range<usize>,
        label: impl Fn(usize) -> u32,
    ) -> Option<Vec<(u32, f64, bool)>> {
        // --- edges of children without a partner, by where they begin
        let mut open: HashMap<[u32; 2], u32> = HashMap::new();
        for c in children {
            let t = self.surface.triangles[c];
            for k in 0..3 {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                if open.remove(&[b, a]).is_none() {
                    open.insert([a, b], label(c));
                }
            }
        }
        let next: HashMap<u32, (u32, u32)> = open.iter().map(|(&[a, b], &l)| (a, (b, l))).collect();
        if next.len() < open.len() {
            return None;
        }
        // --- around, from the first corner
        let positions = &self.surface.positions;
        let mut out = Vec::new();
        let mut last = next.values().find(|n| n.0 == t[0])?.1;
        let (mut v, mut side) = (t[0], 0);
        for _ in 0..next.len() {
            let &(w, label) = next.get(&v)?;
            let (p, q) = (positions[t[side] as usize], positions[t[(side + 1) % 3] as usize]);
            let is_corner = v == t[side];
            if is_corner || label != last {
                let share = if is_corner { 0.0 } else { distance(positions[v as usize], p) / distance(q, p) };
                out.push((v, side as f64 + share.clamp(0.0, 1.0 - f64::EPSILON * 4.0), label != last));
            }
            last = label;
            v = w;
            if side < 2 && v == t[side + 1] {
                side += 1;
            }
        }
        (v == t[0] && side == 2).then_some(out)
    }
}

/// The plane of a face.
struct Plane<'a> {
    positions: &'a [Vec3],
    normal: Vec3,
    /// A cut puts so much area right at least, ...
    least: f64,
    /// ... and so much more for its length.
    strip: f64,
}

/// How much area has its label, if each of two sides gets the one that most of it has.
fn right(sides: &[Vec<(u32, f64)>; 2]) -> f64 {
    sides.iter().map(|s| s.iter().map(|l| l.1).fold(0.0, f64::max)).sum()
}

fn count(side: &mut Vec<(u32, f64)>, child: &Child) {
    match side.iter_mut().find(|l| l.0 == child.label) {
        Some(l) => l.1 += child.area,
        None => side.push((child.label, child.area)),
    }
}

impl Plane<'_> {
    /// Cuts a convex ring (true: a cut may end there) in two, and these again; `children` lie in it. `used` are the ends of
    /// the cuts.
    fn split(&self, ring: Vec<(Stop, bool)>, children: Vec<Child>, used: &mut Vec<u32>, out: &mut Vec<Piece>) {
        let mut all = Vec::new();
        children.iter().for_each(|c| count(&mut all, c));
        let most = all.iter().copied().reduce(|a, b| if b.1 > a.1 { b } else { a });
        let (label, before) = most.unwrap_or((0, 0.0));
        let mut best = (before + self.least, None);
        for i in (0..ring.len()).filter(|&i| ring[i].1) {
            for j in (i + 2..ring.len()).filter(|&j| ring[j].1 && (i > 0 || j + 1 < ring.len())) {
                let mut sides = [Vec::new(), Vec::new()];
                let beyond = self.beyond(&ring, [i, j]);
                children.iter().for_each(|c| count(&mut sides[usize::from(beyond(c))], c));
                let ends = [i, j].map(|k| self.positions[ring[k].0.0 as usize]);
                let right = right(&sides) - self.strip * distance(ends[0], ends[1]);
                if right > best.0 && sides.iter().all(|s| !s.is_empty()) {
                    best = (right, Some([i, j]));
                }
            }
        }
        let Some([i, j]) = best.1 else {
            out.push(Piece { ring: ring.into_iter().map(|r| r.0).collect(), label });
            return;
        };
        used.extend([ring[i].0.0, ring[j].0.0]);
        let beyond = self.beyond(&ring, [i, j]);
        let (far, near): (Vec<Child>, Vec<Child>) = children.into_iter().partition(|c| beyond(c));
        let others = ring[j..].iter().chain(&ring[..=i]).copied().collect();
        self.split(ring[i..=j].to_vec(), far, used, out);
        self.split(others, near, used, out);
    }

    /// Whether something lies on that side of a cut where the ring goes on from its first end.
    fn beyond(&self, ring: &[(Stop, bool)], [i, j]: [usize; 2]) -> impl Fn(&Child) -> bool + use<> {
        let [p, q] = [i, j].map(|k| self.positions[ring[k].0.0 as usize]);
        // the ring is counterclockwise: what follows its first end lies to the right
        let right = cross(sub(q, p), self.normal);
        move |c: &Child| dot(sub(c.at, p), right) > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::super::finish::vote;
    use super::*;
    use crate::job::Job;
    use crate::mesh::measure::area as area_of;
    use crate::mesh::surface::SurfaceOptions;
    use crate::mesh::{NONE, Topology};

    /// A rib flush with the ends of its plate, its sides in triangles around a point of the plate.
    fn flush_rib() -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let outline = [
            [-30.0, -6.0],
            [30.0, -6.0],
            [30.0, 2.0],
            [2.0, 2.0],
            [2.0, 30.0],
            [-2.0, 30.0],
            [-2.0, 2.0],
            [-30.0, 2.0],
        ];
        let n = outline.len() as u32;
        let level = |z: f64| outline.iter().chain(&[[0.0; 2]]).map(move |p| [p[0], p[1], z]);
        let around = |i: u32| {
            let (j, up) = ((i + 1) % n, n + 1);
            [[i, j, j + up], [i, j + up, i + up], [n + up, i + up, j + up], [n, j, i]]
        };
        (level(0.0).chain(level(20.0)).collect(), (0..n).flat_map(around).collect())
    }

    fn cut_at(height: f64, vertices: usize) -> (CutMesh, f64, Vec<f64>) {
        let (positions, triangles) = flush_rib();
        let options = SurfaceOptions { target_vertices: vertices, ..SurfaceOptions::default() };
        let surface = AnalysisSurface::refine(&positions, &triangles, &options, &Job::default()).unwrap();
        let corner = |f: usize| corners(&surface.positions, surface.triangles[f]);
        let all = || 0..surface.triangles.len();
        let area: Vec<f64> = all().map(|f| area_of(corner(f))).collect();
        let label: Vec<u32> =
            all().map(|f| u32::from(corner(f).iter().map(|p| p[1]).sum::<f64>() > 3.0 * height)).collect();
        let whole = triangles.iter().map(|&t| area_of(corners(&positions, t))).collect();
        let voted = vote(&surface, &area, &label, triangles.len()).unwrap();
        (cut(&surface, &area, (&label, &voted), &triangles).unwrap().unwrap(), surface.spacing, whole)
    }

    #[test]
    fn a_flush_rib_is_cut_off_its_plate() {
        for (height, vertices) in [(2.0, 25_000), (9.0, 3_000)] {
            let (cut, spacing, whole) = cut_at(height, vertices);
            let area = |f: usize| area_of(corners(&cut.positions, cut.triangles[f]));
            // as closed as before, the same area, none of it turned over
            let edges = Topology::edges_of(cut.positions.len(), &cut.triangles).unwrap();
            assert!((0..edges.edge_count() as u32).all(|e| edges.halfedges(e).len() == 2));
            for (f, whole) in whole.iter().enumerate() {
                let own: f64 = (0..cut.triangles.len()).filter(|&g| cut.parent[g] as usize == f).map(area).sum();
                assert!((own / whole - 1.0).abs() < 1e-9, "{f}: {own}, {whole}");
            }
            let (positions, triangles) = flush_rib();
            for (&t, &f) in cut.triangles.iter().zip(&cut.parent) {
                let [own, parent] =
                    [area_vector(corners(&cut.positions, t)), area_vector(corners(&positions, triangles[f as usize]))];
                assert!(dot(own, parent) > 0.0);
            }
            // what lies above the height, but for the steps of the surface
            let found: f64 = (0..cut.triangles.len()).filter(|&f| cut.label[f] == 1).map(area).sum();
            let (rise, around) = (30.0 - height, 48.0);
            let truth = 2.0 * 4.0 * rise + (2.0 * rise + 4.0) * 20.0;
            assert!((found - truth).abs() < 0.5 * spacing * around, "{found}, not {truth}");
            // few faces more
            assert!(cut.triangles.len() < 2 * whole.len() + 16, "{}", cut.triangles.len());
        }
    }

    #[test]
    fn a_point_is_on_the_piece_that_holds_it() {
        let (cut, ..) = cut_at(9.0, 3_000);
        assert!(cut.first.windows(2).any(|w| w[1] - w[0] > 2));
        for (f, &t) in cut.triangles.iter().enumerate() {
            let [a, b, c] = corners(&cut.positions, t);
            for w in [[1.0 / 3.0; 3], [0.9, 0.05, 0.05], [0.05, 0.05, 0.9]] {
                let p = [0, 1, 2].map(|i| w[0] * a[i] + w[1] * b[i] + w[2] * c[i]);
                assert_eq!(cut.at(cut.parent[f], p), f as u32);
            }
        }
        assert_ne!(cut.at(0, [1e9; 3]), NONE);
    }

    #[test]
    fn rings_with_corners_in_a_line_fall_into_triangles_with_an_area() {
        let at = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [4.0, 0.0], [4.0, 3.0], [2.0, 1.5], [1.0, 0.75]];
        let positions: Vec<Vec3> = at.iter().map(|p| [p[0], p[1], 1.0]).collect();
        for first in 0..7 {
            let ring = (0..7).map(|k| (first + k) % 7).collect();
            let found = triangulated(&positions, ring);
            let areas: Vec<f64> = found.iter().map(|&t| area_of(corners(&positions, t))).collect();
            assert_eq!(areas.len(), 5);
            assert!(areas.iter().all(|a| *a > 0.05), "{areas:?}");
            assert!((areas.iter().sum::<f64>() - 6.0).abs() < 1e-12);
        }
    }
}
