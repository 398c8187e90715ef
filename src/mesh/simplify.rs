//! Fewer triangles for almost the same surface: edges collapsed in order of quadric error.
//!
//! Garland & Heckbert, "Surface simplification using quadric error metrics" (SIGGRAPH 1997), with vertices that stay
//! where they are (one end of an edge moves onto the other) and in passes: all edges are weighed, sorted, and the
//! cheapest collapsed as long as their ends are as they were when weighed. Planes count by the angle of their triangle at
//! the vertex, so that the error does not depend on how a face happens to be cut.
//!
//! The topology stays: an edge collapses only if its ends have no neighbours in common but the apexes of its triangles
//! (Dey et al. 1999), a boundary vertex moves along the boundary, one with non-manifold surroundings not at all.
//!
//! A very large mesh is first taken down in [`blocks`], as far as a fifth of the allowed error goes.

mod blocks;

use super::NONE;
use super::measure::{Vec3, area_vector, at_weights, bounding_box, corners, cross, distance, dot, norm, scale, sub};
use super::used::Used;
use crate::error::{Result, try_filled, try_vec};
use crate::job::Job;
use rayon::prelude::*;
use std::f64::consts::PI;

/// A collapse may not turn a triangle by more than the angle of this cosine.
const TURN: f64 = 0.3;
/// Weight of an edge's squared length in the order of collapses: decides inside flat faces.
const SHORT_FIRST: f64 = 1e-8;
/// A pass that removes less than this share of what is to go is the last.
const SLOW: f64 = 0.002;
/// Passes at most; each takes off a quarter or so.
const PASSES: usize = 200;
/// What is smaller than this is not worth more than one thread.
const PIECE: usize = 1 << 16;

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SimplifyOptions {
    /// Number of triangles that is aimed at.
    pub target_faces: usize,
    /// A vertex does not move if its root mean square distance from the planes that it stands for would exceed this,
    /// model units.
    pub max_error: f64,
}

/// A mesh on some of the vertices of another.
#[derive(Debug, Clone, PartialEq)]
pub struct Simplified {
    /// Triangles, by the vertices of the input.
    pub triangles: Vec<[u32; 3]>,
    /// For each vertex of the input the one that it went into, itself if it is still there.
    pub onto: Vec<u32>,
}

/// How a vertex may move.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Inner,
    Boundary,
    Locked,
    /// Not all of its triangles are here: stays, and nothing moves onto it.
    Shared,
}

/// A weighted sum of squared distances from planes: 10 coefficients of the quadratic form and the weights' sum.
#[derive(Debug, Clone, Copy)]
struct Quadric([f64; 11]);

impl Quadric {
    fn plane(n: Vec3, through: Vec3, w: f64) -> Quadric {
        let d = -dot(n, through);
        let [x, y, z] = n;
        Quadric([x * x, x * y, x * z, x * d, y * y, y * z, y * d, z * z, z * d, d * d, 1.0].map(|q| q * w))
    }

    fn add(&mut self, other: &Quadric) {
        self.0.iter_mut().zip(other.0).for_each(|(a, b)| *a += b);
    }

    /// Mean of the squared distances at `p`.
    fn mean(&self, [x, y, z]: Vec3) -> f64 {
        let [xx, xy, xz, xd, yy, yz, yd, zz, zd, dd, w] = self.0;
        let sum = x * (xx * x + 2.0 * (xy * y + xz * z + xd)) + y * (yy * y + 2.0 * (yz * z + yd));
        (sum + z * (zz * z + 2.0 * zd) + dd).max(0.0) / w.max(1e-300)
    }
}

struct Work {
    /// Moved to the origin and scaled to size 1.
    points: Vec<Vec3>,
    /// A dead triangle has NONE for its first corner.
    triangles: Vec<[u32; 3]>,
    kind: Vec<Kind>,
    quadric: Vec<Quadric>,
    onto: Vec<u32>,
    /// By vertex its first corner (3 × triangle + place), and by corner the next of the same vertex.
    head: Vec<u32>,
    next: Vec<u32>,
    /// Vertices marked with the current stamp.
    mark: Vec<u32>,
    stamp: u32,
}

/// Simplifies a mesh of `positions` (model units, finite) and `triangles` (three distinct valid indices each). O(faces)
/// a pass, some 250 bytes a face; some 50 for the faces of a very large mesh.
///
/// # Errors
/// [`crate::error::Error::NoMemory`], [`crate::error::Error::Cancelled`].
pub fn simplify(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    options: &SimplifyOptions,
    job: &Job,
) -> Result<Simplified> {
    let (lo, hi) = bounding_box(triangles.iter().flatten().map(|&v| positions[v as usize]));
    let size = (0..3).map(|k| hi[k] - lo[k]).fold(0.0, f64::max);
    let whole = |positions: &[Vec3], triangles: &[[u32; 3]], options: &SimplifyOptions| {
        let mut work = Work::new(positions, triangles, lo, size)?;
        work.run(options, size, job)?;
        Ok(work.finish())
    };
    let Some((first, rest)) = blocks::first_stage(positions, triangles, (lo, size), options, job)? else {
        return whole(positions, triangles, options);
    };
    // --- what the first stage has left as a mesh of its own
    let used = Used::new(positions.len(), first.triangles.iter().copied(), "simplified mesh")?;
    let mut points = try_vec(used.vertices.len(), "simplified mesh")?;
    points.extend(used.vertices.iter().map(|&v| positions[v as usize]));
    let mut own = try_vec(first.triangles.len(), "simplified mesh")?;
    own.extend(first.triangles.iter().map(|t| used.triangle(*t)));
    let second = whole(&points, &own, &rest)?;
    drop((points, own));
    first.then(&second, &used.vertices)
}

impl Simplified {
    /// This, and then what was done with the `used` vertices.
    fn then(mut self, second: &Simplified, used: &[u32]) -> Result<Simplified> {
        let mut moved = try_vec(self.onto.len(), "simplified mesh")?;
        moved.extend(0..self.onto.len() as u32);
        used.iter().zip(&second.onto).for_each(|(&v, &to)| moved[v as usize] = used[to as usize]);
        self.onto.iter_mut().for_each(|to| *to = moved[*to as usize]);
        self.triangles = try_vec(second.triangles.len(), "simplified mesh")?;
        self.triangles.extend(second.triangles.iter().map(|t| t.map(|v| used[v as usize])));
        Ok(self)
    }
}

impl Work {
    fn new(positions: &[Vec3], triangles: &[[u32; 3]], lo: Vec3, size: f64) -> Result<Work> {
        let n = positions.len();
        let mut points = try_vec(n, "simplified mesh")?;
        points.extend(positions.iter().map(|p| scale(sub(*p, lo), 1.0 / size)));
        let mut copy = try_vec(triangles.len(), "simplified mesh")?;
        copy.extend_from_slice(triangles);
        let mut onto = try_vec(n, "simplified mesh")?;
        onto.extend(0..n as u32);
        let mut work = Work {
            points,
            triangles: copy,
            kind: Vec::new(),
            quadric: try_filled(n, Quadric([0.0; 11]), "simplified mesh")?,
            onto,
            head: try_filled(n, NONE, "simplified mesh")?,
            next: try_filled(3 * triangles.len(), NONE, "simplified mesh")?,
            mark: try_filled(n, 0, "simplified mesh")?,
            stamp: 0,
        };
        work.link();
        work.kind = (0..n as u32).into_par_iter().with_min_len(PIECE).map(|v| work.classify(v)).collect();
        work.quadric = (0..n as u32).into_par_iter().with_min_len(PIECE).map(|v| work.planes(v)).collect();
        Ok(work)
    }

    /// Collapses edges until few enough triangles are left, or none can go.
    fn run(&mut self, options: &SimplifyOptions, size: f64, job: &Job) -> Result<()> {
        let limit = (options.max_error / size).powi(2);
        let mut alive = self.triangles.len();
        for _ in 0..PASSES {
            let excess = alive.saturating_sub(options.target_faces);
            job.check()?;
            if excess == 0 || !(limit >= 0.0) {
                break;
            }
            let removed = self.pass(excess, limit)?;
            alive -= removed;
            self.compact();
            if (removed as f64) < SLOW * excess as f64 {
                break;
            }
            self.link();
        }
        Ok(())
    }

    /// Lists the corners of every vertex anew.
    fn link(&mut self) {
        self.head.fill(NONE);
        for (f, t) in self.triangles.iter().enumerate() {
            for (k, &v) in t.iter().enumerate() {
                let corner = (3 * f + k) as u32;
                self.next[corner as usize] = std::mem::replace(&mut self.head[v as usize], corner);
            }
        }
    }

    fn compact(&mut self) {
        self.triangles.retain(|t| t[0] != NONE);
    }

    /// The live triangles of a vertex, each turned so that the vertex is first.
    fn around(&self, v: u32) -> impl Iterator<Item = [u32; 3]> {
        let mut corner = self.head[v as usize];
        std::iter::from_fn(move || {
            while corner != NONE {
                let (t, k) = (self.triangles[corner as usize / 3], corner as usize % 3);
                corner = self.next[corner as usize];
                if t[0] != NONE {
                    return Some([t[k], t[(k + 1) % 3], t[(k + 2) % 3]]);
                }
            }
            None
        })
    }

    /// Inner if the triangles around the vertex close in one fan, boundary if they form an open one.
    fn classify(&self, v: u32) -> Kind {
        let mut sides: Vec<[u32; 2]> = self.around(v).map(|t| [t[1], t[2]]).collect();
        let Some([mut back, mut front]) = sides.pop() else { return Kind::Locked };
        let uses = |sides: &[[u32; 2]], v: u32| sides.iter().flatten().filter(|&&u| u == v).count();
        if sides.iter().flatten().any(|&u| uses(&sides, u) + usize::from(u == back || u == front) > 2) {
            return Kind::Locked;
        }
        while let Some(at) = sides.iter().position(|s| s.contains(&front)) {
            let [a, b] = sides.swap_remove(at);
            front = if a == front { b } else { a };
        }
        while let Some(at) = sides.iter().position(|s| s.contains(&back)) {
            let [a, b] = sides.swap_remove(at);
            back = if a == back { b } else { a };
        }
        match (sides.is_empty(), front == back) {
            (false, _) => Kind::Locked,
            (true, true) => Kind::Inner,
            (true, false) => Kind::Boundary,
        }
    }

    /// The planes of the triangles around a vertex and, on the boundary, those upright on its two edges.
    fn planes(&self, v: u32) -> Quadric {
        let mut sum = Quadric([0.0; 11]);
        for t in self.around(v) {
            let points = corners(&self.points, t);
            let n = area_vector(points);
            if norm(n) > 0.0 {
                let (a, b) = (sub(points[1], points[0]), sub(points[2], points[0]));
                let angle = norm(n).atan2(dot(a, b));
                let n = scale(n, 1.0 / norm(n));
                sum.add(&Quadric::plane(n, points[0], angle / (2.0 * PI)));
                if self.kind[v as usize] == Kind::Boundary {
                    for (k, side) in [(1, a), (2, b)] {
                        if self.around(v).filter(|u| u[1..].contains(&t[k])).count() == 1 {
                            let upright = cross(side, n);
                            sum.add(&Quadric::plane(scale(upright, 1.0 / norm(upright)), points[0], 0.25));
                        }
                    }
                }
            }
        }
        sum
    }

    /// Weighs all edges and collapses the cheapest, up to `excess` triangles. Returns how many went.
    fn pass(&mut self, excess: usize, limit: f64) -> Result<usize> {
        let weigh = |from: u32, to: u32| {
            let (kf, kt) = (self.kind[from as usize], self.kind[to as usize]);
            if kf == Kind::Shared || kt == Kind::Shared {
                return f64::INFINITY;
            }
            if kf == Kind::Locked || (kf == Kind::Boundary && kt == Kind::Inner) {
                return f64::INFINITY;
            }
            let error = self.quadric[from as usize].mean(self.points[to as usize]);
            let length = distance(self.points[from as usize], self.points[to as usize]);
            if error <= limit { error + SHORT_FIRST * length * length } else { f64::INFINITY }
        };
        let candidate = |a: u32, b: u32| {
            // an inner edge is seen from both of its triangles, once in either direction
            let edge = self.kind[a as usize] != Kind::Inner && self.kind[b as usize] != Kind::Inner;
            if a > b && !edge {
                return None;
            }
            let (there, back) = (weigh(a, b), weigh(b, a));
            let (cost, from, to) = if there <= back { (there, a, b) } else { (back, b, a) };
            // not negative: the bits sort as the numbers do
            cost.is_finite().then_some(((cost as f32).to_bits(), from, to))
        };
        let all = |t: &[u32; 3]| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])];
        let mut edges: Vec<(u32, u32, u32)> = self
            .triangles
            .par_iter()
            .with_min_len(PIECE)
            .flat_map_iter(|t| all(t).into_iter().filter_map(|(a, b)| candidate(a, b)))
            .collect();
        // the cheapest that it can take, and some for those that turn out not to be possible
        let some = excess.max(edges.len() / 2);
        if some < edges.len() {
            edges.select_nth_unstable(some);
            edges.truncate(some);
        }
        if edges.len() < PIECE {
            edges.sort_unstable();
        } else {
            edges.par_sort_unstable();
        }
        let mut touched = try_filled(self.points.len(), false, "simplified mesh")?;
        let mut removed = 0;
        for (_, from, to) in edges {
            if removed >= excess {
                break;
            }
            if touched[from as usize] || touched[to as usize] || !self.possible(from, to) {
                continue;
            }
            (touched[from as usize], touched[to as usize]) = (true, true);
            removed += self.collapse(from, to);
        }
        Ok(removed)
    }

    /// True if the edge can collapse without changing the topology or turning triangles over.
    fn possible(&mut self, from: u32, to: u32) -> bool {
        self.stamp += 1;
        let stamp = self.stamp;
        let mut shared = 0;
        let mut corner = self.head[from as usize];
        while corner != NONE {
            let t = self.triangles[corner as usize / 3];
            corner = self.next[corner as usize];
            if t[0] != NONE {
                t.iter().for_each(|&v| self.mark[v as usize] = stamp);
                shared += usize::from(t.contains(&to));
            }
        }
        if shared != if self.kind[from as usize] == Kind::Boundary { 1 } else { 2 } {
            return false;
        }
        // Common neighbours, counted once by taking off their mark.
        (self.mark[from as usize], self.mark[to as usize]) = (0, 0);
        let mut common = [NONE; 2];
        let mut count = 0;
        let mut corner = self.head[to as usize];
        while corner != NONE {
            let t = self.triangles[corner as usize / 3];
            corner = self.next[corner as usize];
            for v in t.into_iter().filter(|_| t[0] != NONE) {
                if std::mem::replace(&mut self.mark[v as usize], 0) == stamp {
                    if count == shared {
                        return false;
                    }
                    common[count] = v;
                    count += 1;
                }
            }
        }
        let enough = |v: u32| self.around(v).count() > if self.kind[v as usize] == Kind::Inner { 3 } else { 1 };
        if count != shared || !common[..count].iter().all(|&v| enough(v)) {
            return false;
        }
        let target = self.points[to as usize];
        self.around(from).filter(|t| !t.contains(&to)).all(|t| {
            let [a, b, c] = corners(&self.points, t);
            let (before, after) = (area_vector([a, b, c]), area_vector([target, b, c]));
            dot(before, after) > TURN * norm(before) * norm(after)
        })
    }

    /// Moves `from` onto `to`; returns how many triangles that ends.
    fn collapse(&mut self, from: u32, to: u32) -> usize {
        let (mut dead, mut last) = (0, NONE);
        let mut corner = self.head[from as usize];
        while corner != NONE {
            let t = &mut self.triangles[corner as usize / 3];
            if t[0] != NONE {
                if t.contains(&to) {
                    t[0] = NONE;
                    dead += 1;
                } else {
                    t[corner as usize % 3] = to;
                }
            }
            last = corner;
            corner = self.next[corner as usize];
        }
        if last != NONE {
            self.next[last as usize] = self.head[to as usize];
            self.head[to as usize] = std::mem::replace(&mut self.head[from as usize], NONE);
        }
        let moved = self.quadric[from as usize];
        self.quadric[to as usize].add(&moved);
        self.onto[from as usize] = to;
        dead
    }

    fn finish(mut self) -> Simplified {
        for v in 0..self.onto.len() as u32 {
            let mut root = v;
            while self.onto[root as usize] != root {
                root = self.onto[root as usize];
            }
            let mut at = v;
            while at != root {
                at = std::mem::replace(&mut self.onto[at as usize], root);
            }
        }
        self.compact();
        Simplified { triangles: self.triangles, onto: self.onto }
    }
}

/// Barycentric coordinates of the point of a triangle that is nearest to `p`, and their squared distance.
pub fn nearest_in_triangle([a, b, c]: [Vec3; 3], p: Vec3) -> ([f64; 3], f64) {
    let n = area_vector([a, b, c]);
    let nn = dot(n, n);
    let squared = |w: [f64; 3]| {
        let d = sub(at_weights([a, b, c], w), p);
        (w, dot(d, d))
    };
    if nn > 0.0 {
        let share = |u: Vec3, v: Vec3| dot(cross(sub(u, p), sub(v, p)), n) / nn;
        let w = [share(b, c), share(c, a), share(a, b)];
        if w.iter().all(|w| *w >= 0.0) {
            return squared(w);
        }
    }
    let on_side = |k: usize| {
        let ends = [a, b, c, a];
        let (o, side) = (ends[k], sub(ends[k + 1], ends[k]));
        let s = (dot(sub(p, o), side) / dot(side, side)).clamp(0.0, 1.0);
        let mut w = [0.0; 3];
        // a side without length gives NaN: its start will do
        let s = if s.is_nan() { 0.0 } else { s };
        w[k] += 1.0 - s;
        w[(k + 1) % 3] += s;
        squared(w)
    };
    let sides = [on_side(0), on_side(1), on_side(2)];
    sides.into_iter().fold(sides[0], |m, s| if s.1 < m.1 { s } else { m })
}
