//! Where vertices are added: points at a spacing of about h that cover the surface, on edges and inside faces.
//!
//! Greedy packing: candidates are offered in a fixed order and taken if no vertex or taken point of the same sheet lies
//! within [`PACKING`] h. Order: open and non-manifold edges (taken unseen: no flip mends what is beside them), all other edges (the longest first, evenly spaced by h),
//! a triangular lattice of spacing h inside every face, and at last edges again at a third of the spacing, which fills what
//! bundles of slivers left open. The number of points follows from area and h alone, never from the number or shape of
//! the triangles.

use super::normal;
use super::split::UNIT;
use crate::error::{Result, try_filled, try_push, try_vec};
use crate::job::Job;
use crate::mesh::intrinsic::for_each_edge;
use crate::mesh::measure::{distance, dot, norm, sub};
use rayon::prelude::*;

/// No two points of a sheet are closer than this many spacings.
const PACKING: f64 = 0.7;
/// Points inside a face keep at least this many spacings from its edges; closer ones are left to the edges.
const MARGIN: f64 = 0.35;
/// Sheets whose normals differ by more than about 100 degrees do not see each other: sides of a thin wall.
const SAME_SHEET: f64 = -0.2;
/// Edges whose candidates are looked at side by side.
const BLOCK: usize = 1024;
/// Candidates per allowed point; the spacing of candidates grows beyond.
const CANDIDATES: usize = 24;

/// A point on an edge, `along` / UNIT of the way from the edge's lower to its higher vertex.
pub(super) struct OnEdge {
    pub(super) vertex: u32,
    pub(super) along: i64,
}

/// A point inside a face, by the barycentric coordinates of corners 1 and 2 out of UNIT.
pub(super) struct Inside {
    pub(super) vertex: u32,
    pub(super) bary: [i64; 2],
}

/// The added points, by edge and by face.
pub(super) struct Sites {
    pub(super) positions: Vec<[f64; 3]>,
    /// A face that each point lies on.
    pub(super) faces: Vec<u32>,
    /// Edge of every half-edge `3 f + k`.
    side_edge: Vec<u32>,
    on_edges: Groups<OnEdge>,
    inside: Groups<Inside>,
}

impl Sites {
    pub(super) fn on_side(&self, f: usize, k: usize) -> &[OnEdge] {
        self.on_edges.of(self.side_edge[3 * f + k])
    }

    pub(super) fn inside(&self, f: usize) -> &[Inside] {
        self.inside.of(f as u32)
    }
}

/// Items by group, in the order in which they came.
struct Groups<T> {
    start: Vec<u32>,
    items: Vec<T>,
}

impl<T> Groups<T> {
    /// Sorts `(group, item)` pairs into `count` groups.
    fn new(count: usize, mut pairs: Vec<(u32, T)>) -> Result<Groups<T>> {
        let mut start = try_filled(count + 1, 0u32, "analysis surface")?;
        for (group, _) in &pairs {
            start[*group as usize + 1] += 1;
        }
        for g in 0..count {
            start[g + 1] += start[g];
        }
        pairs.sort_by_key(|p| p.0);
        Ok(Groups { start, items: pairs.into_iter().map(|p| p.1).collect() })
    }

    fn of(&self, group: u32) -> &[T] {
        &self.items[self.start[group as usize] as usize..self.start[group as usize + 1] as usize]
    }
}

/// An undirected edge of the input.
struct Edge {
    ends: [u32; 2],
    length: f64,
    /// Sum of the unit normals beside it.
    normal: [f64; 3],
    face: u32,
    sides: u32,
}

/// Chooses the points that bring the mesh to the spacing `h`, at most `limit` of them.
pub(super) fn lay_out(
    positions: &[[f64; 3]],
    triangles: &[[u32; 3]],
    h: f64,
    limit: usize,
    job: &Job,
) -> Result<Sites> {
    let mut normals = try_vec(triangles.len(), "normals")?;
    normals.extend(triangles.iter().map(|t| unit(normal(positions, t))));
    let (edges, side_edge) = edges(positions, triangles, &normals)?;
    let longest = edges.iter().fold(0.0f64, |m, e| m.max(e.length));
    let mut packing = Packing::new(positions.len(), h, limit);
    if longest > 2.0 * PACKING * h && limit > 0 {
        packing.occupy(positions, triangles, &normals)?;
        let mut order: Vec<u32> = (0..edges.len() as u32).filter(|&e| edges[e as usize].length > h).collect();
        let regular = |e: &u32| edges[*e as usize].sides == 2;
        order.sort_by(|x, y| {
            let longer = edges[*y as usize].length.total_cmp(&edges[*x as usize].length);
            regular(x).cmp(&regular(y)).then(longer).then(x.cmp(y))
        });
        // Candidates are bounded as well as points: total length over spacing could be anything.
        let total: f64 = order.iter().map(|&e| edges[e as usize].length).sum();
        let step = h.max(total / (CANDIDATES * limit) as f64);
        // Edges that no flip can touch are divided evenly, whatever lies beside them, unless there are very many.
        let fixed = order.iter().take_while(|e| !regular(e)).count();
        let fixed_length: f64 = order[..fixed].iter().map(|&e| edges[e as usize].length).sum();
        packing.crowded = fixed_length < 0.25 * limit as f64 * step;
        packing.along_edges(positions, &edges, &order[..fixed], step, job)?;
        packing.crowded = false;
        packing.along_edges(positions, &edges, &order[fixed..], step, job)?;
        packing.inside_faces(positions, triangles, &normals, h, job)?;
        packing.fill_edges(
            positions,
            &edges,
            &order,
            step.max(3.0 * total / (CANDIDATES * limit) as f64) / 3.0,
            job,
        )?;
    }
    Ok(Sites {
        on_edges: Groups::new(edges.len(), packing.on_edges)?,
        inside: Groups::new(triangles.len(), packing.inside)?,
        positions: packing.points,
        faces: packing.faces,
        side_edge,
    })
}

fn unit(n: [f64; 3]) -> [f64; 3] {
    let l = norm(n);
    if l > 0.0 { n.map(|x| x / l) } else { [0.0; 3] }
}

/// The undirected edges and the edge of every half-edge.
fn edges(positions: &[[f64; 3]], triangles: &[[u32; 3]], normals: &[[f64; 3]]) -> Result<(Vec<Edge>, Vec<u32>)> {
    let mut side_edge = try_filled(3 * triangles.len(), 0u32, "edges")?;
    let mut edges = try_vec(3 * triangles.len(), "edges")?;
    for_each_edge(positions.len(), triangles, |sides| {
        let h = sides[0].1 as usize;
        let (a, b) = (triangles[h / 3][h % 3], triangles[h / 3][(h + 1) % 3]);
        let ends = [a.min(b), a.max(b)];
        let mut normal = [0.0; 3];
        for &(_, side) in sides.iter() {
            side_edge[side as usize] = edges.len() as u32;
            (0..3).for_each(|i| normal[i] += normals[side as usize / 3][i]);
        }
        let length = distance(positions[a as usize], positions[b as usize]);
        edges.push(Edge { ends, length, normal: unit(normal), face: h as u32 / 3, sides: sides.len() as u32 });
    })?;
    Ok((edges, side_edge))
}

/// An edge in equal pieces.
struct Line<'a> {
    edge: &'a Edge,
    ends: [[f64; 3]; 2],
    pieces: i64,
}

impl Line<'_> {
    /// Pieces no longer than `step`, about.
    fn new<'a>(positions: &[[f64; 3]], edge: &'a Edge, step: f64) -> Line<'a> {
        let pieces = (edge.length / step).ceil().min(UNIT as f64 / 16.0) as i64;
        Line { edge, ends: edge.ends.map(|v| positions[v as usize]), pieces }
    }

    /// Where piece `i` begins, and how far along that is.
    fn at(&self, i: i64) -> ([f64; 3], i64) {
        let along = i * UNIT / self.pieces;
        let t = along as f64 / UNIT as f64;
        let [a, b] = self.ends;
        ([0, 1, 2].map(|k| a[k] + (b[k] - a[k]) * t), along)
    }
}

/// A point that keeps others at a distance. Single precision is enough for a rule of thumb.
struct Occupant {
    at: [f64; 3],
    normal: [f32; 3],
    next: u32,
}

const HASH: u64 = 0x51_7C_C1_B7;

fn mix(h: u64, x: i64) -> u64 {
    (h ^ x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(29)
}

/// The points taken so far and a hash grid over them and the vertices.
struct Packing {
    first_vertex: usize,
    limit: usize,
    spacing: f64,
    radius: f64,
    /// Take points without looking for others.
    crowded: bool,
    cell: f64,
    heads: Vec<u32>,
    occupants: Vec<Occupant>,
    points: Vec<[f64; 3]>,
    faces: Vec<u32>,
    on_edges: Vec<(u32, OnEdge)>,
    inside: Vec<(u32, Inside)>,
}

impl Packing {
    fn new(first_vertex: usize, spacing: f64, limit: usize) -> Packing {
        let radius = PACKING * spacing;
        Packing {
            first_vertex,
            limit,
            spacing,
            radius,
            crowded: false,
            cell: 2.0 * radius,
            heads: Vec::new(),
            occupants: Vec::new(),
            points: Vec::new(),
            faces: Vec::new(),
            on_edges: Vec::new(),
            inside: Vec::new(),
        }
    }

    /// Enters the vertices of the mesh, thinned out where they are much denser than the spacing.
    fn occupy(&mut self, positions: &[[f64; 3]], triangles: &[[u32; 3]], normals: &[[f64; 3]]) -> Result<()> {
        let slots = (positions.len() + self.limit.min(1 << 20)).next_power_of_two();
        self.heads = try_filled(slots, u32::MAX, "grid")?;
        let mut sums = try_filled(positions.len(), [0.0; 3], "normals")?;
        for (t, n) in triangles.iter().zip(normals) {
            t.iter().for_each(|&v| (0..3).for_each(|i| sums[v as usize][i] += n[i]));
        }
        self.occupants = try_vec(positions.len(), "grid")?;
        let full = self.radius;
        self.radius = full / 4.0;
        for (p, n) in positions.iter().zip(&sums) {
            let n = unit(*n);
            if self.is_free(*p, n) {
                self.enter(*p, n);
            }
        }
        self.radius = full;
        Ok(())
    }

    fn slot(&self, c: [i64; 3]) -> usize {
        self.head_of(c.iter().fold(HASH, |h, &x| mix(h, x)))
    }

    fn head_of(&self, hash: u64) -> usize {
        hash as usize & (self.heads.len() - 1)
    }

    fn enter(&mut self, at: [f64; 3], normal: [f64; 3]) {
        let slot = self.slot(at.map(|x| (x / self.cell).floor() as i64));
        let next = std::mem::replace(&mut self.heads[slot], self.occupants.len() as u32);
        self.occupants.push(Occupant { at, normal: normal.map(|x| x as f32), next });
    }

    /// True if nothing of the same sheet is within the packing radius, which is at most half a cell: eight cells to see.
    fn is_free(&self, at: [f64; 3], normal: [f64; 3]) -> bool {
        let cell = at.map(|x| x / self.cell);
        let low = cell.map(|x| (x - 0.5).floor() as i64);
        let normal = normal.map(|x| x as f32);
        let two = |h: u64, x: i64| [mix(h, x), mix(h, x.wrapping_add(1))];
        let eight = two(HASH, low[0]).map(|h| two(h, low[1]).map(|h| two(h, low[2])));
        // the point's own cell first: what is in its way is there more often than in any other
        let own = [0, 1, 2].map(|k| usize::from(cell[k].floor() as i64 != low[k]));
        (0..8).all(|other| {
            let [x, y, z] = [0, 1, 2].map(|k| own[k] ^ (other >> k & 1));
            let mut i = self.heads[self.head_of(eight[x][y][z])];
            while i != u32::MAX {
                let o = &self.occupants[i as usize];
                let d = sub(o.at, at);
                let facing = (0..3).map(|k| o.normal[k] * normal[k]).sum::<f32>();
                if dot(d, d) < self.radius * self.radius && facing > SAME_SHEET as f32 {
                    return false;
                }
                i = o.next;
            }
            true
        })
    }

    /// Takes a point if there is room for it and returns its vertex.
    fn offer(&mut self, at: [f64; 3], normal: [f64; 3], face: u32) -> Option<u32> {
        if self.points.len() >= self.limit || !(self.crowded || self.is_free(at, normal)) {
            return None;
        }
        self.enter(at, normal);
        self.points.push(at);
        self.faces.push(face);
        Some((self.first_vertex + self.points.len() - 1) as u32)
    }

    /// Offers points at about `step` along the edges in `order`.
    fn along_edges(
        &mut self,
        positions: &[[f64; 3]],
        edges: &[Edge],
        order: &[u32],
        step: f64,
        job: &Job,
    ) -> Result<()> {
        for &e in order {
            let line = Line::new(positions, &edges[e as usize], step);
            for i in 1..line.pieces {
                if i % 1024 == 0 {
                    job.check()?;
                }
                self.offer_on(e, &line, i);
            }
        }
        job.check()
    }

    /// The same where there is little room left. What is in the way of a point stays there: so most points are ruled out
    /// side by side, and only the others are offered in turn.
    fn fill_edges(
        &mut self,
        positions: &[[f64; 3]],
        edges: &[Edge],
        order: &[u32],
        step: f64,
        job: &Job,
    ) -> Result<()> {
        let line = |e: u32| Line::new(positions, &edges[e as usize], step);
        for block in order.chunks(BLOCK) {
            let this = &*self;
            let open = |&e: &u32| {
                let (line, mut open) = (line(e), Vec::new());
                for i in 1..line.pieces {
                    if i % 1024 == 0 {
                        job.check()?;
                    }
                    if this.is_free(line.at(i).0, line.edge.normal) {
                        try_push(&mut open, i, "analysis surface")?;
                    }
                }
                Ok(open)
            };
            let open: Vec<Vec<i64>> = block.par_iter().with_min_len(8).map(open).collect::<Result<_>>()?;
            for (&e, open) in block.iter().zip(open) {
                open.into_iter().for_each(|i| self.offer_on(e, &line(e), i));
            }
            job.check()?;
        }
        Ok(())
    }

    fn offer_on(&mut self, e: u32, line: &Line<'_>, i: i64) {
        let (at, along) = line.at(i);
        if let Some(vertex) = self.offer(at, line.edge.normal, line.edge.face) {
            self.on_edges.push((e, OnEdge { vertex, along }));
        }
    }

    /// Offers the points of a triangular lattice inside every face that is wide enough to hold any.
    fn inside_faces(
        &mut self,
        positions: &[[f64; 3]],
        triangles: &[[u32; 3]],
        normals: &[[f64; 3]],
        h: f64,
        job: &Job,
    ) -> Result<()> {
        for (f, t) in triangles.iter().enumerate() {
            if f % 1024 == 0 {
                job.check()?;
            }
            let corners = t.map(|v| positions[v as usize]);
            let side = |k: usize| distance(corners[(k + 1) % 3], corners[k]);
            let k = (1..3).fold(0, |k, i| if side(i) > side(k) { i } else { k });
            // Base: the longest side, from a to b; apex c at height `height` above base point `foot`.
            let [a, b, c] = [0, 1, 2].map(|i| corners[(k + i) % 3]);
            let base = side(k);
            let u = sub(b, a).map(|x| x / base);
            let foot = dot(sub(c, a), u);
            let height = norm(normal(positions, t)) / base;
            // A triangle whose inscribed circle is smaller than the margin holds none.
            if !(height > 2.0 * MARGIN * h) || !normals[f].iter().any(|x| *x != 0.0) {
                continue;
            }
            let slopes = [side((k + 1) % 3), side((k + 2) % 3)];
            let row_height = 0.75f64.sqrt() * h;
            for row in 1..=(height / row_height) as i64 {
                let y = row as f64 * row_height;
                let apex = y / height;
                // The row's ends, kept off the two other sides by the margin.
                let off = slopes.map(|l| MARGIN * self.spacing * l / height);
                let from = foot * apex + off[1];
                let to = base + (foot - base) * apex - off[0];
                let shift = if row % 2 == 0 { 0.0 } else { 0.5 };
                let mut i = (from / h - shift).ceil();
                if height - y < MARGIN * h {
                    continue;
                }
                while (i + shift) * h <= to {
                    let x = (i + shift) * h;
                    i += 1.0;
                    // x = foot apex + along base (1 - apex)
                    let at_b = (x - foot * apex) / base;
                    let mut bary = [0i64; 3];
                    bary[(k + 1) % 3] = (at_b * UNIT as f64) as i64;
                    bary[(k + 2) % 3] = (apex * UNIT as f64) as i64;
                    bary[k] = UNIT - bary[(k + 1) % 3] - bary[(k + 2) % 3];
                    if bary.iter().any(|&b| b < 1) {
                        continue;
                    }
                    let weight = bary.map(|b| b as f64 / UNIT as f64);
                    let at = [0, 1, 2].map(|i| {
                        corners[0][i]
                            + weight[1] * (corners[1][i] - corners[0][i])
                            + weight[2] * (corners[2][i] - corners[0][i])
                    });
                    if let Some(vertex) = self.offer(at, normals[f], f as u32) {
                        self.inside.push((f as u32, Inside { vertex, bary: [bary[1], bary[2]] }));
                    }
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes::grid_box;

    #[test]
    fn edges_are_filled_side_by_side_as_in_turn() {
        let (positions, triangles) = grid_box([7.0, 4.0, 0.3], [3, 2, 1]);
        let normals: Vec<[f64; 3]> = triangles.iter().map(|t| unit(normal(&positions, t))).collect();
        let (edges, _) = edges(&positions, &triangles, &normals).unwrap();
        let order: Vec<u32> = (0..edges.len() as u32).collect();
        let points = |filled: bool, limit: usize| {
            let mut packing = Packing::new(positions.len(), 0.1, limit);
            packing.occupy(&positions, &triangles, &normals).unwrap();
            let job = Job::default();
            packing.along_edges(&positions, &edges, &order[..9], 0.2, &job).unwrap();
            match filled {
                true => packing.fill_edges(&positions, &edges, &order, 0.03, &job).unwrap(),
                false => packing.along_edges(&positions, &edges, &order, 0.03, &job).unwrap(),
            }
            (packing.points, packing.on_edges.iter().map(|(e, p)| (*e, p.vertex, p.along)).collect::<Vec<_>>())
        };
        for limit in [10_000, 100] {
            assert_eq!(points(true, limit), points(false, limit));
        }
        assert!(points(true, 10_000).0.len() > 300);
    }
}
