//! Edges, shells and a consistent outward orientation of a triangle soup with shared vertices.
//!
//! A *half-edge* `3 f + k` is the side of face `f` from its corner `k` to its corner `(k + 1) % 3`. Any number of
//! half-edges may share an edge: one at a boundary, two inside a manifold surface, more at a non-manifold edge.

use super::NONE;
use super::measure::{Vec3, bounding_box, corners, is_flat, signed_volume6};
use crate::error::{Result, try_filled, try_vec};
use std::collections::VecDeque;

/// Connectivity of a mesh; every vector is indexed by faces, edges, vertices or shells as its name says.
#[derive(Debug, Clone)]
pub struct Topology {
    /// Edge of every half-edge.
    pub edge_of_halfedge: Vec<u32>,
    /// Half-edges by edge: those of edge `e` are `halfedges[start[e]..start[e + 1]]`, ascending.
    halfedges: Vec<u32>,
    start: Vec<u32>,
    /// Shell (edge-connected component) of every face, numbered by first face.
    pub shell_of_face: Vec<u32>,
    /// Per face, true if its corners must be reversed for its shell to be consistently oriented and outward.
    pub flipped: Vec<bool>,
    /// Facts of every shell.
    pub shells: Vec<Shell>,
}

/// An edge-connected component.
#[derive(Debug, Clone, PartialEq)]
pub struct Shell {
    /// Lowest face.
    pub first_face: u32,
    /// Number of faces.
    pub faces: u32,
    /// No boundary edge.
    pub closed: bool,
    /// Can be oriented consistently over its two-sided edges (false for a Möbius strip).
    pub orientable: bool,
    /// Volume as given by the file's orientation made consistent; negative for an inward-facing shell, such as a cavity.
    pub volume: f64,
    /// The shell faces inward although no other shell contains it.
    pub inverted: bool,
}

impl Topology {
    /// O(faces) time and memory; orienting nested shells adds (inward shells × faces of the shells around them).
    pub fn new(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Topology> {
        let mut topology = Topology::edges_of(positions.len(), triangles)?;
        topology.shell_of_face = try_filled(triangles.len(), NONE, "shells")?;
        topology.flipped = try_filled(triangles.len(), false, "orientation")?;
        for f in 0..triangles.len() as u32 {
            if topology.shell_of_face[f as usize] == NONE {
                topology.grow_shell(f, triangles);
            }
        }
        topology.orient_shells(positions, triangles);
        Ok(topology)
    }

    /// The edges alone, of faces whose orientation is known: `shell_of_face`, `flipped` and `shells` are empty.
    ///
    /// # Errors
    /// [`crate::error::Error::NoMemory`].
    pub fn edges_of(vertices: usize, triangles: &[[u32; 3]]) -> Result<Topology> {
        let (edge_of_halfedge, halfedges, start) = link_edges(vertices, triangles)?;
        let (shell_of_face, flipped, shells) = (Vec::new(), Vec::new(), Vec::new());
        Ok(Topology { edge_of_halfedge, halfedges, start, shell_of_face, flipped, shells })
    }

    /// Number of edges.
    pub fn edge_count(&self) -> usize {
        self.start.len() - 1
    }
    /// Half-edges of an edge, ascending.
    pub fn halfedges(&self, edge: u32) -> &[u32] {
        &self.halfedges[self.start[edge as usize] as usize..self.start[edge as usize + 1] as usize]
    }
    /// The half-edge on the other side of a two-sided edge; [`NONE`] at boundaries and non-manifold edges.
    pub fn twin(&self, halfedge: u32) -> u32 {
        match *self.halfedges(self.edge_of_halfedge[halfedge as usize]) {
            [a, b] => a ^ b ^ halfedge,
            _ => NONE,
        }
    }
    /// Edges with one face.
    pub fn boundary_edges(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.edge_count() as u32).filter(|&e| self.halfedges(e).len() == 1)
    }
    /// Edges with more than two faces.
    pub fn non_manifold_edges(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.edge_count() as u32).filter(|&e| self.halfedges(e).len() > 2)
    }
    /// The faces of `triangles` with outward orientation: a copy with the corners of flipped faces reversed.
    pub fn oriented(&self, triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
        triangles
            .iter()
            .zip(&self.flipped)
            .map(|(&[a, b, c], &flip)| if flip { [a, c, b] } else { [a, b, c] })
            .collect()
    }

    /// Collects the shell of `seed`, orienting each face like the one it was reached from.
    fn grow_shell(&mut self, seed: u32, triangles: &[[u32; 3]]) {
        let id = self.shells.len() as u32;
        let mut shell =
            Shell { first_face: seed, faces: 0, closed: true, orientable: true, volume: 0.0, inverted: false };
        let mut queue = VecDeque::from([seed]);
        self.shell_of_face[seed as usize] = id;
        while let Some(f) = queue.pop_front() {
            shell.faces += 1;
            for h in 3 * f..3 * f + 3 {
                let mates = self.halfedges(self.edge_of_halfedge[h as usize]);
                shell.closed &= mates.len() > 1;
                let two_sided = mates.len() == 2;
                for i in 0..mates.len() {
                    let mate = self.halfedges(self.edge_of_halfedge[h as usize])[i];
                    let g = mate / 3;
                    // a fair pair of faces runs through the common edge in opposite directions
                    let same_way = from(triangles, h) == from(triangles, mate);
                    let flip = self.flipped[f as usize] ^ same_way;
                    if self.shell_of_face[g as usize] == NONE {
                        self.shell_of_face[g as usize] = id;
                        // across a non-manifold edge nothing says which way is right: keep the file's
                        self.flipped[g as usize] = two_sided && flip;
                        queue.push_back(g);
                    } else if two_sided && g != f && self.flipped[g as usize] != flip {
                        shell.orientable = false;
                    }
                }
            }
        }
        self.shells.push(shell);
    }

    /// Decides which side is out: closed shells by their volume, others by the majority of the file's orientation.
    fn orient_shells(&mut self, positions: &[Vec3], triangles: &[[u32; 3]]) {
        let (lo, hi) = bounding_box(positions.iter().copied());
        let centre = [0, 1, 2].map(|k| 0.5 * (lo[k] + hi[k]));
        let mut reversed = vec![0u32; self.shells.len()];
        for (f, &t) in triangles.iter().enumerate() {
            let s = self.shell_of_face[f] as usize;
            let sign = if self.flipped[f] { -1.0 } else { 1.0 };
            self.shells[s].volume += sign * signed_volume6(corners(positions, t), centre) / 6.0;
            reversed[s] += self.flipped[f] as u32;
        }
        // the seed face chose the side; give the shell back to the majority of its faces first
        let mut turn: Vec<bool> = Vec::with_capacity(self.shells.len());
        for (shell, &r) in self.shells.iter_mut().zip(&reversed) {
            let minority = 2 * u64::from(r) > u64::from(shell.faces);
            shell.volume = if minority { -shell.volume } else { shell.volume };
            turn.push(minority);
        }
        for s in self.inward_without_container(positions, triangles) {
            self.shells[s].inverted = true;
            turn[s] = !turn[s];
        }
        for (flip, &s) in self.flipped.iter_mut().zip(&self.shell_of_face) {
            *flip ^= turn[s as usize];
        }
    }

    /// Closed shells of negative volume that are no cavity: an even number of other closed shells contains them.
    fn inward_without_container(&self, positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<usize> {
        let inward = |s: &Shell| s.closed && s.orientable && s.volume < 0.0;
        if !self.shells.iter().any(inward) {
            return Vec::new();
        }
        let mut faces_of: Vec<Vec<u32>> = vec![Vec::new(); self.shells.len()];
        (0..triangles.len()).for_each(|f| faces_of[self.shell_of_face[f] as usize].push(f as u32));
        let corners_of = |&f: &u32| corners(positions, triangles[f as usize]);
        let boxes: Vec<_> = faces_of.iter().map(|s| bounding_box(s.iter().flat_map(corners_of))).collect();
        let within =
            |a: usize, b: usize| (0..3).all(|k| boxes[b].0[k] < boxes[a].0[k] && boxes[a].1[k] < boxes[b].1[k]);
        // A file of thousands of nested boxes must not cost (shells × faces): past this many face tests the rest are
        // taken as inverted, which is what almost every inward shell of a print file is.
        let mut budget: u64 = 200_000_000;
        let mut out = Vec::new();
        for s in (0..self.shells.len()).filter(|&s| inward(&self.shells[s])) {
            let point = positions[triangles[self.shells[s].first_face as usize][0] as usize];
            let mut inside = 0;
            for o in (0..self.shells.len()).filter(|&o| o != s && self.shells[o].closed && within(s, o)) {
                let cost = faces_of[o].len() as u64;
                if cost > budget {
                    break;
                }
                budget -= cost;
                inside += contains(positions, triangles, &faces_of[o], point) as u32;
            }
            if inside % 2 == 0 {
                out.push(s);
            }
        }
        out
    }
}

/// Generalised winding number of a closed shell about `point` (Van Oosterom & Strackee 1983), |w| > 1/2 being inside.
fn contains(positions: &[Vec3], triangles: &[[u32; 3]], faces: &[u32], point: Vec3) -> bool {
    use super::measure::{dot, norm, sub};
    let mut w = 0.0;
    for &f in faces {
        let t = corners(positions, triangles[f as usize]);
        if is_flat(t) {
            continue;
        }
        let [a, b, c] = t.map(|p| sub(p, point));
        let (la, lb, lc) = (norm(a), norm(b), norm(c));
        let det = signed_volume6([a, b, c], [0.0; 3]);
        let below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
        w += 2.0 * det.atan2(below);
    }
    (w / (4.0 * std::f64::consts::PI)).abs() > 0.5
}

fn from(triangles: &[[u32; 3]], halfedge: u32) -> u32 {
    triangles[halfedge as usize / 3][halfedge as usize % 3]
}

/// Groups half-edges by their two vertices: edge of every half-edge, half-edges by edge, and the starts of the groups.
fn link_edges(vertices: usize, triangles: &[[u32; 3]]) -> Result<(Vec<u32>, Vec<u32>, Vec<u32>)> {
    let n = 3 * triangles.len();
    let sides = |[a, b, c]: [u32; 3]| [[a, b], [b, c], [c, a]];

    // --- buckets of half-edges by their lower vertex
    let mut bucket: Vec<u32> = try_filled(vertices + 1, 0, "edges")?;
    for [a, b] in triangles.iter().flat_map(|&t| sides(t)) {
        bucket[a.min(b) as usize] += 1;
    }
    let mut sum = 0;
    for end in &mut bucket {
        sum += std::mem::replace(end, sum);
    }
    // upper vertex, half-edge
    let mut sorted: Vec<u64> = try_filled(n, 0, "edges")?;
    for (h, [a, b]) in triangles.iter().flat_map(|&t| sides(t)).enumerate() {
        let slot = &mut bucket[a.min(b) as usize];
        sorted[*slot as usize] = u64::from(a.max(b)) << 32 | h as u64;
        *slot += 1;
    }

    // --- within a bucket, which now ends where its number says, groups of equal upper vertex
    let mut edge_of_halfedge: Vec<u32> = try_filled(n, 0, "edges")?;
    let mut start: Vec<u32> = try_vec(n / 2 + 2, "edges")?;
    let mut from = 0;
    for &end in &bucket[..vertices] {
        sorted[from..end as usize].sort_unstable();
        let mut last = None;
        for (i, key) in (from..).zip(&sorted[from..end as usize]) {
            if last != Some(key >> 32) {
                start.push(i as u32);
                last = Some(key >> 32);
            }
            edge_of_halfedge[*key as u32 as usize] = start.len() as u32 - 1;
        }
        from = end as usize;
    }
    start.push(n as u32);
    drop(bucket);
    let mut halfedges: Vec<u32> = try_vec(n, "edges")?;
    halfedges.extend(sorted.iter().map(|&key| key as u32));
    Ok((edge_of_halfedge, halfedges, start))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::{cuboid, moebius, translated, union};

    fn to(triangles: &[[u32; 3]], halfedge: u32) -> u32 {
        triangles[halfedge as usize / 3][(halfedge as usize + 1) % 3]
    }

    fn reversed(t: &[[u32; 3]]) -> Vec<[u32; 3]> {
        t.iter().map(|&[a, b, c]| [a, c, b]).collect()
    }

    #[test]
    fn a_cube_has_euler_characteristic_two() {
        let (p, t) = cuboid([1.0, 1.0, 1.0]);
        let top = Topology::new(&p, &t).unwrap();
        assert_eq!(p.len() + t.len() - top.edge_count(), 2);
        assert_eq!(top.shells.len(), 1);
        assert!((top.shells[0].volume - 1.0).abs() < 1e-15 && top.shells[0].closed);
        for h in 0..3 * t.len() as u32 {
            assert_eq!(top.twin(top.twin(h)), h);
            assert_eq!(from(&t, h), to(&t, top.twin(h)));
        }
    }

    #[test]
    fn edges_alone_are_those_of_the_whole() {
        for (p, t) in [cuboid([1.0, 2.0, 3.0]), moebius(24)] {
            let (all, alone) = (Topology::new(&p, &t).unwrap(), Topology::edges_of(p.len(), &t).unwrap());
            assert_eq!(alone.edge_of_halfedge, all.edge_of_halfedge);
            assert!((0..all.edge_count() as u32).all(|e| alone.halfedges(e) == all.halfedges(e)));
            assert_eq!((alone.edge_count(), alone.shells.len()), (all.edge_count(), 0));
        }
    }

    #[test]
    fn an_inverted_cube_and_single_turned_faces_are_set_right() {
        let (p, t) = cuboid([1.0, 1.0, 1.0]);
        let top = Topology::new(&p, &reversed(&t)).unwrap();
        assert!(top.shells[0].inverted);
        assert_eq!(top.oriented(&reversed(&t)), t);
        for f in 0..t.len() {
            let mut u = t.clone();
            u[f].swap(1, 2);
            let top = Topology::new(&p, &u).unwrap();
            assert!(!top.shells[0].inverted);
            assert_eq!(top.oriented(&u), t, "face {f}");
        }
    }

    #[test]
    fn a_cavity_is_not_inverted_and_an_inverted_neighbour_is() {
        let (outer, ot) = cuboid([4.0, 4.0, 4.0]);
        let (inner, it) = cuboid([1.0, 1.0, 1.0]);
        let hollow = union(&[(outer, ot), (translated(inner.clone(), [1.0, 1.0, 1.0]), reversed(&it))]);
        let top = Topology::new(&hollow.0, &hollow.1).unwrap();
        assert_eq!(top.shells.len(), 2);
        assert!(top.flipped.iter().all(|f| !f));
        let (outer, ot) = cuboid([4.0, 4.0, 4.0]);
        let beside = union(&[(outer, ot), (translated(inner, [9.0, 0.0, 0.0]), reversed(&it))]);
        let top = Topology::new(&beside.0, &beside.1).unwrap();
        assert_eq!(top.shells.iter().map(|s| s.inverted).collect::<Vec<_>>(), [false, true]);
    }

    #[test]
    fn a_moebius_strip_is_not_orientable() {
        let (p, t) = moebius(24);
        let top = Topology::new(&p, &t).unwrap();
        assert_eq!(top.shells.len(), 1);
        assert!(!top.shells[0].orientable && !top.shells[0].closed);
    }

    #[test]
    fn three_faces_on_one_edge_are_non_manifold() {
        let p = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]];
        let t = [[0, 1, 2], [1, 0, 3], [0, 1, 4]];
        let top = Topology::new(&p, &t).unwrap();
        let e: Vec<u32> = top.non_manifold_edges().collect();
        assert_eq!(e.len(), 1);
        assert_eq!(top.halfedges(e[0]), [0, 3, 6]);
        assert_eq!(top.boundary_edges().count(), 6);
        assert_eq!(top.twin(0), NONE);
    }
}
