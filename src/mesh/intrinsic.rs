//! A surface known by its connectivity and edge lengths alone, made fit for finite elements.
//!
//! Two repairs, both of which leave the vertices where they are:
//! - [`IntrinsicMesh::mollify`] lengthens every edge by the same smallest amount that makes every triangle a proper one
//!   (N. Sharp, K. Crane, "A Laplacian for nonmanifold triangle meshes", 2020, section 4.5);
//! - [`IntrinsicMesh::flip_to_delaunay`] replaces the triangulation by the intrinsic Delaunay one of the same vertices
//!   (A. Bobenko, B. Springborn 2007; M. Fisher et al. 2006), whose cotangent weights are never negative.
//!
//! **Non-manifold and boundary edges stay as they are.** The tufted cover of Sharp & Crane would make them flippable, at
//! the price of twice the triangles for the whole surface. Such edges are few in printable parts, and the analysis surface
//! splits them to the working resolution beforehand, which already removes the obtuse angles that the cover is for.
//!
//! After flips two vertices may be joined by several edges, and an edge may join a vertex to itself. Per-triangle
//! assembly of a Laplacian, a gradient or a divergence is indifferent to both.

use crate::error::{Error, Result, try_filled, try_vec};
use crate::job::Job;
use crate::mesh::NONE;
use crate::mesh::measure::distance;

/// A triangulated surface by connectivity and edge lengths.
#[derive(Debug, Clone, PartialEq)]
pub struct IntrinsicMesh {
    /// Number of vertices; the corners of [`IntrinsicMesh::triangles`] are below it.
    pub vertex_count: usize,
    /// Three corners a triangle. Corners of one triangle may coincide after flips.
    pub triangles: Vec<[u32; 3]>,
    /// `lengths[f][k]` is the length of the edge from corner `k` to corner `(k + 1) % 3`, in model units.
    pub lengths: Vec<[f64; 3]>,
}

impl IntrinsicMesh {
    /// The intrinsic view of a mesh in space: `positions` in model units, `triangles` with valid indices.
    ///
    /// # Errors
    /// [`Error::Index`] and [`Error::NonFinite`] for meshes that were not checked, [`Error::Argument`] for more than
    /// 2³⁰ triangles, [`Error::NoMemory`].
    pub fn from_extrinsic(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<IntrinsicMesh> {
        if triangles.len() >= 1 << 30 {
            return Err(Error::Argument(format!("{} triangles: at most 2^30 are supported", triangles.len())));
        }
        let mut lengths = try_vec(triangles.len(), "edge lengths")?;
        for (f, t) in triangles.iter().enumerate() {
            if t.iter().any(|&v| v as usize >= positions.len()) {
                return Err(located(Error::Index, "names a vertex that does not exist", f));
            }
            // From the lower to the higher index, so that both sides of an edge get the same bits.
            let length = |a: u32, b: u32| distance(positions[a.min(b) as usize], positions[a.max(b) as usize]);
            let l = [length(t[0], t[1]), length(t[1], t[2]), length(t[2], t[0])];
            if l.iter().any(|x| !x.is_finite()) {
                return Err(located(Error::NonFinite, "has a corner that is not finite", f));
            }
            lengths.push(l);
        }
        let mut copy = try_vec(triangles.len(), "triangles")?;
        copy.extend_from_slice(triangles);
        Ok(IntrinsicMesh { vertex_count: positions.len(), triangles: copy, lengths })
    }

    /// Total area, in squared model units; triangles that violate the triangle inequality count as flat.
    pub fn area(&self) -> f64 {
        self.lengths.iter().map(|&l| double_area(l)).sum::<f64>() / 2.0
    }

    /// Mean edge length over the triangles' sides, in model units (0 without triangles).
    pub fn mean_edge(&self) -> f64 {
        let sum: f64 = self.lengths.iter().flatten().sum();
        sum / (3 * self.lengths.len()).max(1) as f64
    }

    /// Adds the smallest common epsilon to all edges such that every triangle satisfies the triangle inequality with
    /// the margin `relative` × mean edge, and returns epsilon (0 when nothing had to change).
    ///
    /// 1e-6 is enough for stable cotangents and moves no length of a sound mesh noticeably.
    pub fn mollify(&mut self, relative: f64) -> f64 {
        let margin = relative.max(0.0) * self.mean_edge();
        let mut epsilon = 0.0f64;
        for l in &self.lengths {
            for k in 0..3 {
                epsilon = epsilon.max(margin - ((l[(k + 1) % 3] - l[k]) + l[(k + 2) % 3]));
            }
        }
        if epsilon > 0.0 {
            self.lengths.iter_mut().flatten().for_each(|l| *l += epsilon);
        }
        epsilon
    }

    /// Flips edges until the triangulation is the intrinsic Delaunay one and returns the number of flips.
    ///
    /// Edges between exactly two triangles are flipped; others stay. Neighbours of opposite orientation are turned
    /// first; on a non-orientable surface the edges of one seam stay unflipped. The order is deterministic, and the
    /// number of flips is bounded by 100 a triangle and a million more (real parts take up to 4 a triangle, bundles of
    /// slivers 500 times longer than the spacing 50), beyond which the triangulation is valid but short of Delaunay. Call [`IntrinsicMesh::mollify`] before if there are zero-area triangles.
    ///
    /// # Errors
    /// [`Error::Cancelled`] and [`Error::NoMemory`].
    pub fn flip_to_delaunay(&mut self, job: &Job) -> Result<usize> {
        let sides = 3 * self.triangles.len();
        let mut twin = twins(self.vertex_count, &self.triangles, Some(&self.lengths))?;
        orient(self, &mut twin)?;
        let mut queued = try_filled(sides, false, "edge queue")?;
        let mut stack: Vec<u32> = try_vec(sides, "edge queue")?;
        for h in (0..sides as u32).rev() {
            if twin[h as usize] != NONE && h < twin[h as usize] {
                queued[h as usize] = true;
                stack.push(h);
            }
        }
        let bound = 100 * self.triangles.len() + 1_000_000;
        let (mut flips, mut visits) = (0, 0usize);
        while let Some(h) = stack.pop() {
            queued[h as usize] = false;
            visits += 1;
            if visits % 4096 == 0 {
                job.check()?;
            }
            let t = twin[h as usize];
            // An edge without a length has nothing to unfold about.
            if t == NONE || t / 3 == h / 3 || self.lengths_from(h)[0] <= 0.0 || !self.must_flip(h, t) {
                continue;
            }
            if flips == bound {
                break;
            }
            for side in self.flip(h, t, &mut twin) {
                let low = side.min(twin[side as usize]);
                if !queued[low as usize] && twin[side as usize] != NONE {
                    queued[low as usize] = true;
                    stack.push(low);
                }
            }
            flips += 1;
        }
        Ok(flips)
    }

    /// The lengths of the triangle of half-edge `h`, starting with `h` itself.
    fn lengths_from(&self, h: u32) -> [f64; 3] {
        let (l, k) = (self.lengths[h as usize / 3], h as usize % 3);
        [l[k], l[(k + 1) % 3], l[(k + 2) % 3]]
    }

    /// True if the angles opposite `h` and its twin `t` sum to more than pi (cotangents summing below zero), by more than
    /// rounding. Multiplied out by the areas, so that flat triangles need no special case.
    fn must_flip(&self, h: u32, t: u32) -> bool {
        let (f, g) = (self.lengths_from(h), self.lengths_from(t));
        let (area_f, area_g) = (double_area(f), double_area(g));
        // cot(opposite) = (b² + c² - a²) / (4 area), with the difference of squares taken stably.
        let cosine = |l: [f64; 3]| l[1] * l[1] + (l[2] - l[0]) * (l[2] + l[0]);
        let (cf, cg) = (cosine(f), cosine(g));
        let sum = cf * area_g + cg * area_f;
        sum < -1e-10 * area_f * area_g - 4e-14 * (cf.abs() * area_g + cg.abs() * area_f)
    }

    /// Replaces the edge (a, b) of f = (a, b, c) and g = (b, a, d) by (c, d) and returns the four half-edges around.
    fn flip(&mut self, h: u32, t: u32, twin: &mut [u32]) -> [u32; 4] {
        let (f, g) = (h as usize / 3, t as usize / 3);
        let (k, m) = (h as usize % 3, t as usize % 3);
        let (tf, tg) = (self.triangles[f], self.triangles[g]);
        let (a, b, c, d) = (tf[k], tf[(k + 1) % 3], tf[(k + 2) % 3], tg[(m + 2) % 3]);
        let ([ab, bc, ca], [_, ad, db]) = (self.lengths_from(h), self.lengths_from(t));
        let cd = diagonal(ab, bc, ca, ad, db);
        let outer = [(f, (k + 1) % 3), (f, (k + 2) % 3), (g, (m + 1) % 3), (g, (m + 2) % 3)];
        let [bc_twin, ca_twin, ad_twin, db_twin] = outer.map(|(face, corner)| twin[3 * face + corner]);
        // New triangles f = (c, d, b), g = (d, c, a): sides f: cd, db, bc; g: dc, ca, ad.
        self.triangles[f] = [c, d, b];
        self.lengths[f] = [cd, db, bc];
        self.triangles[g] = [d, c, a];
        self.lengths[g] = [cd, ca, ad];
        let (f, g) = (3 * f as u32, 3 * g as u32);
        let moved = |old: u32| -> u32 {
            // A neighbour of the pair may be the pair itself (self-glued sides): follow the move.
            match outer.iter().position(|&(face, corner)| (3 * face + corner) as u32 == old) {
                Some(0) => f + 2,
                Some(1) => g + 1,
                Some(2) => g + 2,
                Some(3) => f + 1,
                _ => old,
            }
        };
        for (side, other) in [(f + 2, bc_twin), (g + 1, ca_twin), (g + 2, ad_twin), (f + 1, db_twin)] {
            let other = if other == NONE { NONE } else { moved(other) };
            twin[side as usize] = other;
            if other != NONE {
                twin[other as usize] = side;
            }
        }
        twin[f as usize] = g;
        twin[g as usize] = f;
        [f + 1, f + 2, g + 1, g + 2]
    }
}

fn located(kind: fn(crate::error::Located) -> Error, what: &str, face: usize) -> Error {
    kind(crate::error::Located { message: format!("face {face} {what}"), first: face as u64, count: 1 })
}

/// Twice the area of a triangle with sides `l`, by Kahan's stable form of Heron's formula; 0 if they make no triangle.
pub fn double_area(l: [f64; 3]) -> f64 {
    let (x, y, z) = (l[0], l[1], l[2]);
    let (x, y) = if x < y { (y, x) } else { (x, y) };
    let (y, z) = if y < z { (z, y) } else { (y, z) };
    let (a, b) = if x < y { (y, x) } else { (x, y) };
    let c = z;
    let product = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c));
    product.max(0.0).sqrt() / 2.0
}

/// The other diagonal of the quadrilateral of triangles (a, b, c) and (b, a, d), unfolded into the plane.
fn diagonal(ab: f64, bc: f64, ca: f64, ad: f64, db: f64) -> f64 {
    let along = |near: f64, far: f64| (ab * ab + (near - far) * (near + far)) / (2.0 * ab);
    let x = along(ca, bc) - along(ad, db);
    let y = (double_area([ab, bc, ca]) + double_area([ab, ad, db])) / ab;
    (x * x + y * y).sqrt()
}

/// For every half-edge `3 f + k` the one on the other side, or `NONE` unless exactly two triangles share the edge.
///
/// Edges are told apart by their two vertices and, given `lengths`, by equal lengths as well, as flips may have joined
/// two vertices by several edges.
pub(crate) fn twins(vertex_count: usize, triangles: &[[u32; 3]], lengths: Option<&[[f64; 3]]>) -> Result<Vec<u32>> {
    let mut twin = try_filled(3 * triangles.len(), NONE, "edge table")?;
    for_each_edge(vertex_count, triangles, |sides: &mut [(u32, u32)]| {
        let length = |h: u32| lengths.map_or(0, |l| l[h as usize / 3][h as usize % 3].to_bits());
        if let [(_, a), (_, b)] = *sides {
            if length(a) == length(b) {
                twin[a as usize] = b;
                twin[b as usize] = a;
            }
        } else if lengths.is_some() {
            sides.sort_unstable_by_key(|&(_, h)| (length(h), h));
            for same in sides.chunk_by(|x, y| length(x.1) == length(y.1)) {
                if let [(_, a), (_, b)] = *same {
                    twin[a as usize] = b;
                    twin[b as usize] = a;
                }
            }
        }
    })?;
    Ok(twin)
}

/// Calls `visit` once an undirected edge with its sides as (higher vertex, half-edge), ordered by lower then higher
/// vertex, sides in index order.
pub(crate) fn for_each_edge(
    vertex_count: usize,
    triangles: &[[u32; 3]],
    mut visit: impl FnMut(&mut [(u32, u32)]),
) -> Result<()> {
    let sides = 3 * triangles.len();
    let mut start = try_filled(vertex_count + 1, 0u32, "edge table")?;
    let ends = |h: usize| {
        let t = &triangles[h / 3];
        let (a, b) = (t[h % 3], t[(h + 1) % 3]);
        (a.min(b), a.max(b))
    };
    for h in 0..sides {
        start[ends(h).0 as usize + 1] += 1;
    }
    for v in 0..vertex_count {
        start[v + 1] += start[v];
    }
    let mut by_low = try_filled(sides, (0u32, 0u32), "edge table")?;
    let mut next = try_vec(vertex_count, "edge table")?;
    next.extend_from_slice(&start[..vertex_count]);
    for h in 0..sides {
        let (low, high) = ends(h);
        by_low[next[low as usize] as usize] = (high, h as u32);
        next[low as usize] += 1;
    }
    for v in 0..vertex_count {
        let bucket = &mut by_low[start[v] as usize..start[v + 1] as usize];
        bucket.sort_unstable();
        for edge in bucket.chunk_by_mut(|x, y| x.0 == y.0) {
            visit(edge);
        }
    }
    Ok(())
}

/// Turns triangles so that neighbours run along their common edge in opposite directions; where a surface is not
/// orientable, the two sides of the conflicting edges are parted in `twin`.
fn orient(mesh: &mut IntrinsicMesh, twin: &mut [u32]) -> Result<()> {
    let faces = mesh.triangles.len();
    // Reversal is only noted during the walk: reversing (v0, v1, v2) to (v0, v2, v1) renumbers the half-edges.
    let mut turn = try_filled(faces, 2u8, "orientation")?;
    let mut stack: Vec<u32> = try_vec(faces, "orientation")?;
    let start = |t: &[u32; 3], k: usize| t[k];
    let mut turned = false;
    for seed in 0..faces {
        if turn[seed] != 2 {
            continue;
        }
        turn[seed] = 0;
        stack.push(seed as u32);
        while let Some(f) = stack.pop() {
            for k in 0..3 {
                let h = 3 * f as usize + k;
                let Some(g) = (twin[h] != NONE).then(|| twin[h] as usize) else { continue };
                let same_way = start(&mesh.triangles[f as usize], k) == start(&mesh.triangles[g / 3], g % 3);
                let wanted = turn[f as usize] ^ u8::from(same_way);
                if turn[g / 3] == 2 {
                    turn[g / 3] = wanted;
                    turned |= wanted == 1;
                    stack.push((g / 3) as u32);
                } else if turn[g / 3] != wanted {
                    twin[h] = NONE;
                    twin[g] = NONE;
                }
            }
        }
    }
    if turned {
        // (v0, v1, v2) -> (v0, v2, v1): sides 0, 1, 2 become 2, 1, 0.
        let place = |h: u32| if h != NONE && turn[h as usize / 3] == 1 { 3 * (h / 3) + 2 - h % 3 } else { h };
        for f in 0..faces {
            if turn[f] == 1 {
                mesh.triangles[f].swap(1, 2);
                mesh.lengths[f].swap(0, 2);
                twin.swap(3 * f, 3 * f + 2);
            }
        }
        twin.iter_mut().for_each(|t| *t = place(*t));
    }
    Ok(())
}

#[cfg(test)]
mod tests;
