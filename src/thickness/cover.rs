//! Wall widths all over a mesh, most of them from few spheres.
//!
//! On a dense mesh neighbouring points have nearly the same sphere. The points (vertices and centroids of faces) are
//! gathered in patches: connected, little bent, and no longer than a fifth of the width there. Spheres are grown at the
//! ends of a patch and in its middle; where a plane through these widths fits them, the other points of the patch take
//! theirs from it, and where it does not, the patch is cut up. A patch of few points is measured point by point, so on
//! a mesh whose triangles are not small against its widths every sphere is grown.
//!
//! Nothing slips through: surface that comes so near to a point as to make its width smaller by the share e reaches into
//! the spheres of all points within about sqrt(e) of the width around, so that what lies between places a 14th of the
//! width apart changes no width by more than half a percent without being met. A place of the patch's own side
//! that is narrow by itself, such as the top of a pin, is not connected with what is around it but by surface that
//! is bent away, and is a patch of its own.
//!
//! Patches depend on where the points are, not on their order.

use super::bvh::{along, cross, dot, sub};
use super::wall::{Parents, WallMesh};
use crate::error::{Result, try_filled, try_vec};
use crate::job::Job;
use crate::mesh::sets::Sets;
use rayon::prelude::*;

/// Points of a patch are no further apart than this share of its least width,
const LONG: f64 = 0.2;
/// and a plane fits its measured widths within this share of them.
const FIT: f64 = 0.01;
/// On a patch no longer than this share of its width nothing changes that much; what is left is the roughness of the
/// measurement itself, which may be up to this share.
const SHORT: f64 = 0.12;
const ROUGH: f64 = 0.08;

/// Length of the box of the unit normals of a patch, at most.
const BENT: f32 = 0.5;

/// Patches of so few points are measured point by point.
const FEW: usize = 40;

/// Cosine up to which a vertex's faces are one smooth surface.
const SMOOTH: f64 = 0.94;

/// Places measured on a patch at most: at its ends along, across and upwards, and in the middle.
const PROBES: usize = 7;

/// A vertex or the centroid of a face, in units of the tree.
#[derive(Debug, Clone, Copy)]
struct Spot {
    p: [f32; 3],
    n: [f32; 3],
    /// The vertex, or after all of these the face.
    id: u32,
}

/// A run of spots.
#[derive(Debug, Clone, Copy)]
struct Patch {
    from: usize,
    to: usize,
    kind: Kind,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    New,
    /// Its points hang together.
    Connected,
    /// It cannot be cut: each of its points is measured.
    Single,
}

impl Patch {
    /// Whether its points are measured one by one.
    fn is_single(&self) -> bool {
        self.kind == Kind::Single || self.to - self.from <= FEW
    }
}

/// What is decided about a patch.
enum Next {
    /// All its points have a width.
    Done,
    /// Patches in its place.
    Cut(Vec<Patch>),
}

/// A mesh and its widths so far.
struct Cover<'a> {
    walls: &'a WallMesh,
    positions: &'a [[f64; 3]],
    triangles: &'a [[u32; 3]],
    /// Faces around each vertex: where its list starts, and the lists.
    around: (&'a [usize], &'a [u32]),
    /// By vertex, then by face; negative: not measured.
    width: Vec<f64>,
}

impl WallMesh {
    /// Wall widths at the vertices and at the centroids of the faces of the mesh that this was made from; NaN where
    /// there is none. Reports `positions.len() + triangles.len()` units to `job`.
    ///
    /// # Errors
    /// [`crate::error::Error::Internal`] if it is not that mesh; [`crate::error::Error::NoMemory`],
    /// [`crate::error::Error::Cancelled`].
    pub fn surface_widths(
        &self,
        positions: &[[f64; 3]],
        triangles: &[[u32; 3]],
        job: &Job,
    ) -> Result<(Vec<f64>, Vec<f64>)> {
        let own: Vec<u32> = (0..triangles.len() as u32).collect();
        let (start, lists) = self.around(positions, triangles, &own)?;
        let width = try_filled(positions.len() + triangles.len(), -1.0, "wall widths")?;
        let mut cover = Cover { walls: self, positions, triangles, around: (&start, &lists), width };
        drop(own);

        // --- step 1: what belongs to no patch, and the rest in patches
        let (mut spots, mut wanted) = cover.spots()?;
        let mut patches = Vec::new();
        let whole = Patch { from: 0, to: spots.len(), kind: Kind::New };
        cut(&mut spots, whole, LONG as f32, 0, &mut patches);

        while !patches.is_empty() || !wanted.is_empty() {
            // --- step 2: measure
            for patch in &patches {
                let spots = &spots[patch.from..patch.to];
                if patch.is_single() {
                    wanted.extend(spots.iter().map(|s| s.id));
                }
            }
            patches.retain(|patch| !patch.is_single());
            let probes: Vec<Vec<u32>> = patches.par_iter().map(|p| probes(&spots[p.from..p.to])).collect();
            for (patch, probes) in patches.iter().zip(&probes) {
                wanted.extend(probes.iter().map(|&k| spots[patch.from + k as usize].id));
            }
            cover.measure(&mut wanted, job)?;

            // --- step 3: fill in, or cut up
            let mut next = Vec::new();
            let mut rest = &mut spots[..];
            let mut at = 0;
            let mut pieces = Vec::new();
            for (patch, probes) in patches.iter().zip(&probes) {
                let (_, tail) = std::mem::take(&mut rest).split_at_mut(patch.from - at);
                let (piece, tail) = tail.split_at_mut(patch.to - patch.from);
                (rest, at) = (tail, patch.to);
                pieces.push((patch, piece, probes));
            }
            let decided: Result<Vec<(Next, Vec<f64>)>> =
                pieces.into_par_iter().map(|(patch, piece, probes)| cover.decide(*patch, piece, probes)).collect();
            for (patch, (decision, values)) in patches.iter().zip(decided?) {
                match decision {
                    Next::Cut(patches) => next.extend(patches),
                    Next::Done => {
                        let mut filled = 0;
                        for (spot, value) in spots[patch.from..patch.to].iter().zip(values) {
                            let width = &mut cover.width[spot.id as usize];
                            if *width < 0.0 {
                                *width = value;
                                filled += 1;
                            }
                        }
                        job.advance(filled)?;
                    }
                }
            }
            patches = next;
        }
        let faces = cover.width.split_off(positions.len());
        Ok((cover.width, faces))
    }
}

impl Cover<'_> {
    /// Corners of a face in units of the tree.
    fn corners(&self, face: u32) -> [[f64; 3]; 3] {
        self.triangles[face as usize].map(|v| self.walls.mesh().to_unit(self.positions[v as usize]))
    }

    /// The points that can be in patches, and the ids of the others.
    fn spots(&self) -> Result<(Vec<Spot>, Vec<u32>)> {
        let n = self.positions.len();
        let (mut spots, mut others) = (try_vec(self.width.len(), "patches")?, Vec::new());
        let normal = |f: u32| {
            let [a, b, c] = self.corners(f);
            cross(sub(b, a), sub(c, a))
        };
        let unit = |x: [f64; 3]| {
            let length = dot(x, x).sqrt();
            (length > 0.0).then(|| x.map(|x| x / length))
        };
        let of_vertex = |v: usize| {
            let faces = &self.around.1[self.around.0[v]..self.around.0[v + 1]];
            let whole = faces.iter().all(|&f| self.walls.is_whole(f));
            let mean = unit(faces.iter().fold([0.0; 3], |sum, &f| along(sum, 1.0, normal(f))))?;
            let smooth = faces.iter().all(|&f| unit(normal(f)).is_none_or(|n| dot(n, mean) > SMOOTH));
            (whole && smooth).then_some((self.walls.mesh().to_unit(self.positions[v]), mean))
        };
        let of_face = |f: u32| {
            let [a, b, c] = self.corners(f);
            let middle = along(along(a, 1.0, b), 1.0, c).map(|x| x / 3.0);
            Some((middle, unit(normal(f))?)).filter(|_| self.walls.is_whole(f))
        };
        let found: Vec<Option<Spot>> = (0..self.width.len())
            .into_par_iter()
            .map(|i| {
                let found = if i < n { of_vertex(i) } else { of_face((i - n) as u32) };
                found.map(|(p, n)| Spot { p: p.map(|x| x as f32), n: n.map(|x| x as f32), id: i as u32 })
            })
            .collect();
        for (i, spot) in found.into_iter().enumerate() {
            match spot {
                Some(spot) => spots.push(spot),
                None => others.push(i as u32),
            }
        }
        Ok((spots, others))
    }

    /// Grows the spheres of the points with the ids in `wanted` that have none, and empties it.
    fn measure(&mut self, wanted: &mut Vec<u32>, job: &Job) -> Result<()> {
        wanted.sort_unstable();
        wanted.dedup();
        wanted.retain(|&id| self.width[id as usize] < 0.0);
        let n = self.positions.len();
        let mut points = try_vec(wanted.len(), "wall widths")?;
        let mut start = try_vec(wanted.len() + 1, "wall widths")?;
        let mut lists = Vec::new();
        for &id in wanted.iter() {
            start.push(lists.len());
            let i = id as usize;
            if i < n {
                points.push(self.positions[i]);
                lists.extend_from_slice(&self.around.1[self.around.0[i]..self.around.0[i + 1]]);
            } else {
                let [a, b, c] = self.triangles[i - n].map(|v| self.positions[v as usize]);
                points.push(along(along(a, 1.0, b), 1.0, c).map(|x| x * (1.0 / 3.0)));
                lists.push((i - n) as u32);
            }
        }
        start.push(lists.len());
        let found = self.walls.measure(&points, Parents::Around(&start, &lists), job)?.width;
        for (&id, width) in wanted.iter().zip(found) {
            self.width[id as usize] = width;
        }
        wanted.clear();
        Ok(())
    }

    /// Whether the widths measured on a patch tell those between them; if so all of them, in order.
    fn decide(&self, patch: Patch, spots: &mut [Spot], probes: &[u32]) -> Result<(Next, Vec<f64>)> {
        let measured = || probes.iter().map(|&k| self.width[spots[k as usize].id as usize]);
        let known = measured().all(|width| width > 0.0);
        let least = (measured().fold(f64::INFINITY, f64::min) / self.walls.mesh().to_length(1.0)) as f32;
        let long = LONG as f32 * least;
        let mut next = Vec::new();
        let all = Patch { from: 0, to: spots.len(), kind: Kind::New };
        if known && extent(spots).length() <= long {
            let fit = Fit::new(spots, probes, &self.width);
            let limit = if extent(spots).length() <= SHORT as f32 * least { ROUGH } else { FIT };
            if fit.error <= limit {
                if patch.kind == Kind::Connected {
                    return Ok((Next::Done, fit.at_all(spots)));
                }
                self.separate(spots, &mut next)?;
                if next.len() == 1 {
                    return Ok((Next::Done, fit.at_all(spots)));
                }
            } else {
                cut(spots, all, 0.0, 2, &mut next);
            }
        } else {
            cut(spots, all, if known { long } else { 0.0 }, 1, &mut next);
        }
        let moved = |p: Patch| Patch { from: p.from + patch.from, to: p.to + patch.from, ..p };
        Ok((Next::Cut(next.into_iter().map(moved).collect()), Vec::new()))
    }

    /// Sorts the spots by the connected pieces that they belong to.
    fn separate(&self, spots: &mut [Spot], out: &mut Vec<Patch>) -> Result<()> {
        let n = self.positions.len();
        let mut corners: Vec<(u32, u32)> = Vec::with_capacity(3 * spots.len());
        for (k, spot) in spots.iter().enumerate() {
            match (spot.id as usize).checked_sub(n) {
                None => corners.push((spot.id, k as u32)),
                Some(f) => corners.extend(self.triangles[f].map(|v| (v, k as u32))),
            }
        }
        corners.sort_unstable();
        let mut sets = Sets::new(spots.len())?;
        for pair in corners.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
            sets.join(pair[0].1, pair[1].1);
        }
        let mut keyed: Vec<(u32, Spot)> = spots.iter().enumerate().map(|(k, s)| (sets.root(k as u32), *s)).collect();
        keyed.sort_by_key(|k| k.0);
        let mut from = 0;
        for piece in keyed.chunk_by(|a, b| a.0 == b.0) {
            out.push(Patch { from, to: from + piece.len(), kind: Kind::Connected });
            from += piece.len();
        }
        spots.iter_mut().zip(keyed).for_each(|(spot, k)| *spot = k.1);
        Ok(())
    }
}

/// The box of some spots: lower and upper ends, of places and normals.
#[derive(Debug, Clone, Copy)]
struct Extent([[f32; 6]; 2]);

fn extent(spots: &[Spot]) -> Extent {
    let mut bounds = [[f32::INFINITY; 6], [f32::NEG_INFINITY; 6]];
    for s in spots {
        let x = [s.p[0], s.p[1], s.p[2], s.n[0], s.n[1], s.n[2]];
        for a in 0..6 {
            bounds[0][a] = bounds[0][a].min(x[a]);
            bounds[1][a] = bounds[1][a].max(x[a]);
        }
    }
    Extent(bounds)
}

impl Extent {
    fn sides(&self) -> [f32; 6] {
        std::array::from_fn(|a| self.0[1][a] - self.0[0][a])
    }

    fn length(&self) -> f32 {
        self.sides()[..3].iter().map(|x| x * x).sum::<f32>().sqrt()
    }

    fn bend(&self) -> f32 {
        self.sides()[3..].iter().map(|x| x * x).sum::<f32>().sqrt()
    }
}

/// Cuts spots in halves, at least `times` times over, until none of the patches is longer than `long` or too much bent,
/// or it has few points. A `long` of 0 is no limit.
fn cut(spots: &mut [Spot], patch: Patch, long: f32, times: u32, out: &mut Vec<Patch>) {
    let piece = &mut spots[patch.from..patch.to];
    if piece.is_empty() {
        return;
    }
    let extent = extent(piece);
    let small = long == 0.0 || extent.length() <= long;
    if piece.len() <= FEW || (times == 0 && small && extent.bend() <= BENT) {
        out.push(patch);
        return;
    }
    let sides = extent.sides();
    // What is too long is cut across, then what is too much bent.
    let widest = |from: usize, to: usize| (from..to).fold(from, |m, a| if sides[a] > sides[m] { a } else { m });
    let axis = if small && extent.bend() > BENT { widest(3, 6) } else { widest(0, 3) };
    let middle = extent.0[0][axis] / 2.0 + extent.0[1][axis] / 2.0;
    let key = |s: &Spot| if axis < 3 { s.p[axis] } else { s.n[axis - 3] };
    let mut below = 0;
    for k in 0..piece.len() {
        if key(&piece[k]) < middle {
            piece.swap(below, k);
            below += 1;
        }
    }
    if below == 0 || below == piece.len() {
        // All in one place.
        out.push(Patch { kind: Kind::Single, ..patch });
        return;
    }
    let middle = patch.from + below;
    let times = times.saturating_sub(1);
    cut(spots, Patch { from: patch.from, to: middle, kind: Kind::New }, long, times, out);
    cut(spots, Patch { from: middle, to: patch.to, kind: Kind::New }, long, times, out);
}

/// The middle of some spots, and the directions along, across and upwards.
fn frame(spots: &[Spot]) -> ([f64; 3], [[f64; 3]; 3]) {
    let share = 1.0 / spots.len() as f64;
    let (middle, up) = spots.iter().fold(([0.0; 3], [0.0; 3]), |(p, n), s| {
        (along(p, share, s.p.map(f64::from)), along(n, share, s.n.map(f64::from)))
    });
    let length = dot(up, up).sqrt().max(1e-30);
    let up = up.map(|x| x / length);
    let mut spread = [[0.0; 3]; 3];
    for s in spots {
        let d = sub(s.p.map(f64::from), middle);
        let d = along(d, -dot(d, up), up);
        (0..3).for_each(|a| spread[a] = along(spread[a], d[a], d));
    }
    // The longest axis by repeated multiplication: it need not be exact.
    let longest = (1..3).fold(0, |m, a| if spread[a][a] > spread[m][m] { a } else { m });
    let mut first = spread[longest];
    for _ in 0..8 {
        let next = spread.map(|row| dot(row, first));
        let length = dot(next, next).sqrt();
        if !(length > 0.0) {
            break;
        }
        first = next.map(|x| x / length);
    }
    let first = along(first, -dot(first, up), up);
    let length = dot(first, first).sqrt().max(1e-30);
    let first = first.map(|x| x / length);
    (middle, [first, cross(up, first), up])
}

/// Places in `spots` at the ends and in the middle.
fn probes(spots: &[Spot]) -> Vec<u32> {
    let (middle, axes) = frame(spots);
    let mut best = [(f64::NEG_INFINITY, 0usize); PROBES];
    for (k, s) in spots.iter().enumerate() {
        let d = sub(s.p.map(f64::from), middle);
        let [x, y, z] = axes.map(|axis| dot(axis, d));
        for (best, value) in best.iter_mut().zip([x, -x, y, -y, z, -z, -dot(d, d)]) {
            let before = || s.p.partial_cmp(&spots[best.1].p) == Some(std::cmp::Ordering::Less);
            if value > best.0 || (value == best.0 && before()) {
                *best = (value, k);
            }
        }
    }
    let mut out: Vec<u32> = best.iter().map(|b| b.1 as u32).collect();
    out.sort_unstable();
    out.dedup();
    out
}

/// A plane through widths.
struct Fit {
    middle: [f64; 3],
    axes: [[f64; 3]; 2],
    /// Width in the middle, and its growth along the axes.
    plane: [f64; 3],
    range: (f64, f64),
    /// Largest difference from a measured width, as a share of it.
    error: f64,
}

impl Fit {
    /// Least squares over the places `probes`, held towards an even width where they do not tell.
    fn new(spots: &[Spot], probes: &[u32], width: &[f64]) -> Fit {
        let (middle, [x, y, _]) = frame(spots);
        let samples: Vec<(Spot, f64)> =
            probes.iter().map(|&k| (spots[k as usize], width[spots[k as usize].id as usize])).collect();
        let mut fit = Fit { middle, axes: [x, y], plane: [0.0; 3], range: (f64::INFINITY, 0.0), error: 0.0 };
        let mut m = [[0.0; 4]; 3];
        for (s, w) in &samples {
            let row = fit.row(s);
            fit.range = (fit.range.0.min(*w), fit.range.1.max(*w));
            for a in 0..3 {
                (0..3).for_each(|b| m[a][b] += row[a] * row[b]);
                m[a][3] += row[a] * w;
            }
        }
        let ridge = 1e-3 * (m[1][1] + m[2][2]) + 1e-30;
        m[1][1] += ridge;
        m[2][2] += ridge;
        // Elimination without pivots: the matrix is positive definite.
        for a in 0..3 {
            for b in a + 1..3 {
                let factor = m[b][a] / m[a][a];
                (a..4).for_each(|c| m[b][c] -= factor * m[a][c]);
            }
        }
        for a in (0..3).rev() {
            let rest: f64 = (a + 1..3).map(|b| m[a][b] * fit.plane[b]).sum();
            fit.plane[a] = (m[a][3] - rest) / m[a][a];
        }
        fit.error = samples.iter().fold(0.0, |e, (s, w)| f64::max(e, (fit.at(s) / w - 1.0).abs()));
        fit
    }

    fn row(&self, spot: &Spot) -> [f64; 3] {
        let d = sub(spot.p.map(f64::from), self.middle);
        [1.0, dot(d, self.axes[0]), dot(d, self.axes[1])]
    }

    fn at(&self, spot: &Spot) -> f64 {
        dot(self.row(spot), self.plane).clamp(self.range.0, self.range.1)
    }

    fn at_all(&self, spots: &[Spot]) -> Vec<f64> {
        spots.iter().map(|s| self.at(s)).collect()
    }
}
