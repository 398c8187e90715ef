//! The dual graph of a surface: faces are nodes, common edges join them (Fig. 8a), with the distances that one step
//! costs (Eqs. 14-16).

use crate::error::{Result, try_filled, try_vec};
use crate::mesh::Topology;
use crate::mesh::measure::{Vec3, add, area_vector, corners, cross, distance, dot, norm, scale, sub};
use rayon::prelude::*;

/// An edge with more faces than this joins only those that follow each other in its list, not all pairs.
const MANY_FACES: usize = 6;
/// A triangle lower than this share of the bounding box's diagonal has a normal that rounding made (single precision
/// files): it takes that of the neighbour across its longest side.
const SLIVER: f64 = 2e-6;

/// Cosine of the angle between faces that are folded onto each other (170 degrees).
const FOLDED: f64 = -0.985;

/// Edges of which steps are made at a time.
const BLOCK: u32 = 1 << 18;

/// Faces that one thread takes at least.
const FACES: usize = 1024;

/// The sides of an edge that side `i` of `n` is joined with.
fn partners(i: usize, n: usize) -> std::ops::Range<usize> {
    if n > MANY_FACES { i + 1..(i + 2).min(n) } else { i + 1..n }
}

/// Number of steps that an edge with `sides` faces makes.
pub fn step_count(sides: usize) -> usize {
    (0..sides).map(|i| partners(i, sides).len()).sum()
}

/// A step between two faces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// The two faces.
    pub faces: [u32; 2],
    /// Length of the common edge, model units.
    pub length: f64,
    /// Eq. 14: from centroid to the edge's middle to centroid, model units.
    pub geodesic: f64,
    /// Angle between the normals, radians, positive at concave edges, negative at convex ones.
    pub turn: f64,
}

impl Step {
    /// Eq. 15: the angle between the normals, `epsilon` times it at convex edges.
    pub fn angular(&self, epsilon: f64) -> f64 {
        if self.turn < 0.0 { -epsilon * self.turn } else { self.turn }
    }
}

/// Faces and steps of a surface.
#[derive(Debug)]
pub struct Dual {
    /// Every step once, by common edge.
    pub steps: Vec<Step>,
    /// Steps by face: those of face f are `around[first[f]..first[f + 1]]`, as (other face, step).
    pub around: Vec<(u32, u32)>,
    /// See `around`.
    pub first: Vec<u32>,
    /// Centroids by face.
    pub centroid: Vec<Vec3>,
    /// Outward unit normals by face, zero where there is none.
    pub normal: Vec<Vec3>,
    /// Areas by face.
    pub area: Vec<f64>,
}

impl Dual {
    /// The dual graph of `triangles`, oriented consistently and outward, with their `topology`. O(faces).
    ///
    /// # Errors
    /// [`crate::error::Error::NoMemory`].
    pub fn new(positions: &[Vec3], triangles: &[[u32; 3]], topology: &Topology) -> Result<Dual> {
        let m = triangles.len();
        let mut dual = Dual {
            steps: Vec::new(),
            around: Vec::new(),
            first: Vec::new(),
            centroid: try_filled(m, [0.0; 3], "centroids")?,
            normal: try_filled(m, [0.0; 3], "normals")?,
            area: try_filled(m, 0.0, "areas")?,
        };
        let faces = (dual.centroid.par_iter_mut()).zip(&mut dual.normal).zip(&mut dual.area).zip(triangles);
        faces.with_min_len(FACES).for_each(|(((centroid, normal), area), &t)| {
            let [a, b, c] = corners(positions, t);
            let n = area_vector([a, b, c]);
            let double = norm(n);
            *centroid = scale(add(add(a, b), c), 1.0 / 3.0);
            *normal = if double > 0.0 { scale(n, 1.0 / double) } else { [0.0; 3] };
            *area = 0.5 * double;
        });
        dual.mend_normals(positions, triangles, topology);
        dual.turn_back(topology);
        let mut all: Vec<Step> = try_vec(3 * m / 2 + 8, "steps of the dual graph")?;
        let of_edge = |e: u32| {
            let sides = topology.halfedges(e);
            let pairs = (0..sides.len()).flat_map(move |i| partners(i, sides.len()).map(move |j| [sides[i], sides[j]]));
            pairs.map(|pair| dual.step(positions, triangles, pair))
        };
        // order is kept; the blocks come out in turn and no two copies of all are held
        for block in (0..topology.edge_count() as u32).step_by(BLOCK as usize) {
            let edges = block..topology.edge_count().min((block + BLOCK) as usize) as u32;
            let steps: Vec<Step> = edges.into_par_iter().with_min_len(1024).flat_map_iter(of_edge).collect();
            all.extend(steps);
        }
        dual.steps = all;
        dual.link(m)?;
        Ok(dual)
    }

    /// Number of faces.
    pub fn face_count(&self) -> usize {
        self.area.len()
    }

    /// Neighbours of a face with the steps to them.
    pub fn around(&self, face: u32) -> &[(u32, u32)] {
        &self.around[self.first[face as usize] as usize..self.first[face as usize + 1] as usize]
    }

    /// --- Eqs. 14-16 for the faces of two half-edges of one edge.
    fn step(&self, positions: &[Vec3], triangles: &[[u32; 3]], [h, g]: [u32; 2]) -> Step {
        let (i, j) = (h as usize / 3, g as usize / 3);
        let end = |k: u32| positions[triangles[i][((h + k) % 3) as usize] as usize];
        // corner k of half-edge 3 f + k: h % 3 as 3 f is a multiple of 3
        let (a, b) = (end(0), end(1));
        let middle = scale(add(a, b), 0.5);
        let (n, m) = (self.normal[i], self.normal[j]);
        // atan2 is exact for small angles where acos is not
        let angle = if n == [0.0; 3] || m == [0.0; 3] { 0.0 } else { norm(cross(n, m)).atan2(dot(n, m)) };
        // Eq. 16: concave where the other face rises above this one's plane, seen from both sides.
        let rise = dot(sub(self.centroid[j], middle), n) + dot(sub(self.centroid[i], middle), m);
        Step {
            faces: [i as u32, j as u32],
            length: distance(a, b),
            geodesic: distance(self.centroid[i], middle) + distance(self.centroid[j], middle),
            turn: if rise > 0.0 { angle } else { -angle },
        }
    }

    /// Gives slivers the normal of the face across their longest side.
    fn mend_normals(&mut self, positions: &[Vec3], triangles: &[[u32; 3]], topology: &Topology) {
        let (lo, hi) = crate::mesh::measure::bounding_box(triangles.iter().flatten().map(|&v| positions[v as usize]));
        let limit = SLIVER * distance(lo, hi);
        let longest = |f: usize| {
            let p = corners(positions, triangles[f]);
            let side = |k: usize| distance(p[k], p[(k + 1) % 3]);
            let k = (0..3).max_by(|&i, &j| side(i).total_cmp(&side(j))).unwrap_or(0);
            (k, side(k))
        };
        let mut slivers: Vec<(usize, u32)> = (0..triangles.len())
            .into_par_iter()
            .with_min_len(FACES)
            .filter_map(|f| {
                let (k, side) = longest(f);
                (2.0 * self.area[f] < limit * side).then_some((f, (3 * f + k) as u32))
            })
            .collect();
        slivers.iter().for_each(|s| self.normal[s.0] = [0.0; 3]);
        // from the good faces inward, as slivers lie beside slivers
        for _ in 0..8 {
            let before = slivers.len();
            let found: Vec<(usize, Vec3)> = slivers
                .iter()
                .map(|&(f, h)| match topology.twin(h) {
                    crate::mesh::NONE => (f, [0.0; 3]),
                    g => (f, self.normal[g as usize / 3]),
                })
                .filter(|(_, n)| *n != [0.0; 3])
                .collect();
            found.iter().for_each(|&(f, n)| self.normal[f] = n);
            slivers.retain(|s| self.normal[s.0] == [0.0; 3]);
            if slivers.len() == before {
                break;
            }
        }
    }

    /// Turns the normals of faces that lie folded onto the surface: against two neighbours that agree with each other.
    /// Coarse and ragged meshing leaves such faces. Whether their folds are concave is decided by rounding, and a cut
    /// along them would gain more than along any crease.
    fn turn_back(&mut self, topology: &Topology) {
        let is_over = |f: usize| {
            let n = self.normal[f];
            let mut against = [0, 1, 2]
                .map(|k| topology.twin((3 * f + k) as u32))
                .into_iter()
                .filter(|&g| g != crate::mesh::NONE)
                .map(|g| self.normal[g as usize / 3])
                .filter(|m| dot(n, *m) < FOLDED);
            let (Some(a), Some(b)) = (against.next(), against.next()) else { return false };
            dot(a, b) > 0.0
        };
        let over: Vec<usize> =
            (0..self.normal.len()).into_par_iter().with_min_len(FACES).filter(|&f| is_over(f)).collect();
        over.iter().for_each(|&f| self.normal[f] = scale(self.normal[f], -1.0));
    }

    fn link(&mut self, m: usize) -> Result<()> {
        let mut first = try_filled(m + 1, 0u32, "the dual graph")?;
        for f in self.steps.iter().flat_map(|s| s.faces) {
            first[f as usize + 1] += 1;
        }
        for f in 0..m {
            first[f + 1] += first[f];
        }
        let mut next = first.clone();
        self.around = try_filled(2 * self.steps.len(), (0, 0), "the dual graph")?;
        for (s, step) in self.steps.iter().enumerate() {
            for [f, g] in [step.faces, [step.faces[1], step.faces[0]]] {
                self.around[next[f as usize] as usize] = (g, s as u32);
                next[f as usize] += 1;
            }
        }
        self.first = first;
        Ok(())
    }
}
