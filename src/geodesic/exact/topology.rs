//! Connectivity of the exact solver: every face seen through each of its edges, and the fan of faces around each vertex.
//!
//! Orientation plays no part, so faces that disagree about it need no repair; an edge may have one face (boundary), two,
//! or more (non-manifold). All lengths are scaled by a power of two so that the model is about 1 long.

use crate::error::{Error, Located, Result, try_filled, try_vec};
use crate::mesh::sets::Sets;
use std::f64::consts::PI;

/// Marks an absent index.
pub(super) const NONE: u32 = u32::MAX;
/// Extra angle beyond the flat one from which a vertex is treated as one that a shortest path may bend around.
const SADDLE: f64 = 1e-9;

/// A face seen through one of its edges. In the frame of the edge its origin O is (0, 0), its end E is (len, 0) and the
/// face lies on the side of positive y, with the apex A at (ax, ay).
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(super) struct Crossing {
    pub len: f64,
    pub ax: f64,
    pub ay: f64,
    /// Length of O-A.
    pub left_len: f64,
    /// Length of E-A.
    pub right_len: f64,
    /// Edge O-A: index * 4 + 2 if it leads to another face + 1 if its own origin is A.
    pub left: u32,
    /// Edge E-A, likewise.
    pub right: u32,
    pub face: u32,
    /// Vertex A.
    pub apex: u32,
}

/// The angle of a face at the apex of the crossing with the same index, and its place in the vertex's fan.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corner {
    /// Angle of the corner's first side from the start of the fan, radians.
    pub start: f64,
    /// Angle of the face at the vertex.
    pub angle: f64,
    /// True if the first side is O-A.
    pub left_first: bool,
    /// The edge opposite to the corner: the one that the crossing enters through.
    pub edge: u32,
}

/// How the faces around a vertex are arranged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Fan {
    /// A closed fan of so many radians.
    Closed(f64),
    /// An open fan of so many radians.
    Open(f64),
    /// Several fans, or non-manifold edges: no restriction on where a path leaves.
    Complex,
}

impl Fan {
    /// True if a shortest path may bend at the vertex.
    pub fn is_saddle(self) -> bool {
        match self {
            Fan::Closed(total) => total > 2.0 * PI + SADDLE,
            Fan::Open(total) => total > PI + SADDLE,
            Fan::Complex => true,
        }
    }
}

/// The prepared mesh.
#[derive(Debug)]
pub(super) struct Topology {
    /// Multiplies model lengths; a power of two.
    pub scale: f64,
    /// Vertex that stands for each input vertex (differs only at edges of length zero).
    pub rep: Vec<u32>,
    /// Vertices of each face after that replacement.
    pub faces: Vec<[u32; 3]>,
    /// Scaled positions.
    pub points: Vec<[f64; 3]>,
    /// Ends (origin, end) of each edge.
    pub ends: Vec<[u32; 2]>,
    /// Crossings of edge e are `crossings[first[e]..first[e + 1]]`.
    pub first: Vec<u32>,
    pub crossings: Vec<Crossing>,
    pub corners: Vec<Corner>,
    /// For each face and k the crossing with apex `faces[f][k]`, or NONE for a collapsed face.
    pub of_face: Vec<[u32; 3]>,
    /// Crossings that have vertex v as apex, in fan order: `around[around_first[v]..around_first[v + 1]]`.
    pub around_first: Vec<u32>,
    pub around: Vec<u32>,
    pub fans: Vec<Fan>,
    /// Component of each vertex and number of vertices of each component.
    pub component: Vec<u32>,
    pub component_size: Vec<u32>,
}

pub(super) fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(super) fn norm(a: [f64; 3]) -> f64 {
    (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt()
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn check(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<()> {
    if positions.len() >= (1 << 30) || triangles.len() >= (1 << 28) {
        return Err(Error::Argument("exact geodesics take less than 2^28 faces and 2^30 vertices".into()));
    }
    let located = |what: &str, first: usize, count: usize| {
        let message = format!("{count} {what}, the first is number {first}");
        Located { message, first: first as u64, count: count as u64 }
    };
    let bad = |t: &&[u32; 3]| t.iter().any(|&v| v as usize >= positions.len());
    if let Some(i) = triangles.iter().position(|t| bad(&t)) {
        let count = triangles.iter().filter(bad).count();
        return Err(Error::Index(located("faces name a vertex that does not exist", i, count)));
    }
    let wild = |p: &&[f64; 3]| p.iter().any(|x| !x.is_finite());
    if let Some(i) = positions.iter().position(|p| wild(&p)) {
        return Err(Error::NonFinite(located("vertices are not finite", i, positions.iter().filter(wild).count())));
    }
    Ok(())
}

/// The power of two that brings the largest coordinate difference to 0.5..1 (1 for a single point).
fn unit_scale(positions: &[[f64; 3]]) -> f64 {
    let span = (0..3).map(|k| {
        let (lo, hi) = positions.iter().fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(p[k]), h.max(p[k])));
        hi / 4.0 - lo / 4.0
    });
    let span = span.fold(0.0, f64::max) * 4.0;
    if span > 1e-290 && span < 1e300 { (-(span.log2().floor() + 1.0)).exp2() } else { 1.0 }
}

/// The face of `corners` (vertex order O, E, A) laid out in the frame of its edge O-E.
fn lay_out(o: [f64; 3], e: [f64; 3], a: [f64; 3]) -> Crossing {
    let (oe, oa, ea) = (sub(e, o), sub(a, o), sub(a, e));
    let (len, left_len, right_len) = (norm(oe), norm(oa), norm(ea));
    // Measured from the nearer end, which keeps slivers accurate.
    let ax = if left_len <= right_len { dot(oe, oa) / len } else { len + dot(oe, ea) / len };
    let spread = if left_len <= right_len { cross(oe, oa) } else { cross(oe, ea) };
    let ay = norm(spread) / len;
    // Thinner than rounding: flat, so that windows pass straight through.
    let ay = if ay <= 1e-14 * (left_len + right_len) { 0.0 } else { ay };
    Crossing { len, ax, ay, left_len, right_len, left: 0, right: 0, face: 0, apex: 0 }
}

impl Topology {
    /// Prepares a mesh. Faces may be degenerate, non-manifold and of any orientation.
    pub fn new(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<Topology> {
        check(positions, triangles)?;
        let scale = unit_scale(positions);
        let mut points = try_vec(positions.len(), "exact geodesics: positions")?;
        points.extend(positions.iter().map(|p| p.map(|x| x * scale)));
        let (rep, faces) = collapse(&points, triangles)?;
        let mut topology = Topology {
            scale,
            rep,
            points,
            ends: Vec::new(),
            first: Vec::new(),
            crossings: Vec::new(),
            corners: Vec::new(),
            of_face: try_filled(faces.len(), [NONE; 3], "exact geodesics: faces")?,
            around_first: Vec::new(),
            around: Vec::new(),
            fans: try_filled(positions.len(), Fan::Open(0.0), "exact geodesics: fans")?,
            component: Vec::new(),
            component_size: Vec::new(),
            faces,
        };
        topology.link_edges()?;
        topology.lay_out_faces()?;
        topology.gather_corners()?;
        topology.order_fans()?;
        topology.label_components()?;
        Ok(topology)
    }

    /// Numbers the edges and makes one crossing per edge and face, grouped by edge.
    fn link_edges(&mut self) -> Result<()> {
        let mut sides: Vec<(u32, u32, u32, u8)> = try_vec(3 * self.faces.len(), "exact geodesics: edges")?;
        for (f, t) in self.faces.iter().enumerate() {
            if t[0] == t[1] || t[1] == t[2] || t[2] == t[0] {
                continue;
            }
            for k in 0..3 {
                let (a, b) = (t[(k + 1) % 3], t[(k + 2) % 3]);
                sides.push((a.min(b), a.max(b), f as u32, k as u8));
            }
        }
        sides.sort_unstable();
        self.crossings = try_vec(sides.len(), "exact geodesics: crossings")?;
        self.corners = try_vec(sides.len(), "exact geodesics: corners")?;
        self.ends = try_vec(sides.len(), "exact geodesics: edges")?;
        self.first = try_vec(sides.len() + 1, "exact geodesics: edges")?;
        for (i, &(o, e, f, k)) in sides.iter().enumerate() {
            if self.ends.last() != Some(&[o, e]) {
                self.ends.push([o, e]);
                self.first.push(i as u32);
            }
            let apex = self.faces[f as usize][k as usize];
            let [po, pe, pa] = [o, e, apex].map(|v| self.points[v as usize]);
            self.crossings.push(Crossing { face: f, apex, ..lay_out(po, pe, pa) });
            let edge = self.ends.len() as u32 - 1;
            self.corners.push(Corner { start: 0.0, angle: 0.0, left_first: true, edge });
            self.of_face[f as usize][k as usize] = i as u32;
        }
        self.first.push(sides.len() as u32);
        Ok(())
    }

    /// Fills in the two other edges of every crossing and the angle at its apex.
    fn lay_out_faces(&mut self) -> Result<()> {
        for i in 0..self.crossings.len() {
            let c = self.crossings[i];
            let [o, _] = self.ends[self.corners[i].edge as usize];
            for j in self.of_face[c.face as usize] {
                let edge = self.corners[j as usize].edge;
                if j as usize == i {
                    continue;
                }
                let ends = self.ends[edge as usize];
                let leads_on = self.first[edge as usize + 1] - self.first[edge as usize] > 1;
                let code = edge * 4 + 2 * leads_on as u32 + (ends[0] == c.apex) as u32;
                let side = if ends.contains(&o) { &mut self.crossings[i].left } else { &mut self.crossings[i].right };
                *side = code;
            }
            // Angle between A-O and A-E.
            self.corners[i].angle = if c.ay == 0.0 {
                if c.ax > 0.0 && c.ax < c.len { PI } else { 0.0 }
            } else {
                (c.ax / c.ay).atan() + ((c.len - c.ax) / c.ay).atan()
            };
        }
        Ok(())
    }

    /// Lists the corners of every vertex.
    fn gather_corners(&mut self) -> Result<()> {
        let n = self.points.len();
        self.around_first = try_filled(n + 1, 0u32, "exact geodesics: fans")?;
        self.around = try_filled(self.crossings.len(), 0u32, "exact geodesics: fans")?;
        for c in &self.crossings {
            self.around_first[c.apex as usize + 1] += 1;
        }
        for v in 0..n {
            self.around_first[v + 1] += self.around_first[v];
        }
        let mut fill = self.around_first.clone();
        for (i, c) in self.crossings.iter().enumerate() {
            let slot = &mut fill[c.apex as usize];
            self.around[*slot as usize] = i as u32;
            *slot += 1;
        }
        Ok(())
    }

    /// Orders the corners around each vertex into a fan, where they form one.
    fn order_fans(&mut self) -> Result<()> {
        let mut sides: Vec<(u32, u32)> = Vec::new();
        for v in 0..self.points.len() {
            let range = self.around_first[v] as usize..self.around_first[v + 1] as usize;
            if range.is_empty() {
                continue;
            }
            // Both sides of every corner, sorted by edge: neighbours in the fan sit next to each other.
            sides.clear();
            for &c in &self.around[range.clone()] {
                let crossing = &self.crossings[c as usize];
                sides.extend([(crossing.left / 4, c), (crossing.right / 4, c)]);
            }
            sides.sort_unstable();
            self.fans[v] = self.walk_fan(&sides, range);
        }
        Ok(())
    }

    /// Walks from corner to corner around a vertex. `sides` holds (edge, corner) of all its corners, sorted.
    fn walk_fan(&mut self, sides: &[(u32, u32)], range: std::ops::Range<usize>) -> Fan {
        let span = |edge: u32| {
            let from = sides.partition_point(|s| s.0 < edge);
            &sides[from..from + sides[from..].partition_point(|s| s.0 == edge)]
        };
        let mut open = 0;
        let mut begin = sides[0];
        for run in sides.chunk_by(|a, b| a.0 == b.0) {
            if run.len() > 2 {
                return Fan::Complex;
            }
            if run.len() == 1 {
                begin = if open == 0 { run[0] } else { begin };
                open += 1;
            }
        }
        if open > 2 {
            return Fan::Complex;
        }
        let (mut edge, mut corner) = begin;
        let mut total = 0.0;
        let mut order = Vec::with_capacity(range.len());
        loop {
            let crossing = &self.crossings[corner as usize];
            let left_first = crossing.left / 4 == edge;
            edge = if left_first { crossing.right / 4 } else { crossing.left / 4 };
            let slot = &mut self.corners[corner as usize];
            (slot.start, slot.left_first) = (total, left_first);
            total += slot.angle;
            order.push(corner);
            match span(edge).iter().find(|s| s.1 != corner) {
                Some(next) if next.1 != begin.1 && order.len() < range.len() => corner = next.1,
                _ => break,
            }
        }
        if order.len() < range.len() {
            return Fan::Complex;
        }
        self.around[range].copy_from_slice(&order);
        if open == 0 { Fan::Closed(total) } else { Fan::Open(total) }
    }

    fn label_components(&mut self) -> Result<()> {
        let n = self.points.len();
        let mut sets = Sets::new(n)?;
        self.ends.iter().for_each(|[a, b]| sets.join(*a, *b));
        self.component = try_filled(n, 0, "exact geodesics: components")?;
        self.component_size = try_filled(n, 0, "exact geodesics: components")?;
        for v in 0..n as u32 {
            let root = sets.root(v);
            self.component[v as usize] = root;
            self.component_size[root as usize] += u32::from(self.rep[v as usize] == v);
        }
        Ok(())
    }
}

/// Merges the ends of edges of length zero: the two vertices are one point of the surface.
fn collapse(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<(Vec<u32>, Vec<[u32; 3]>)> {
    let mut same = Sets::new(points.len())?;
    for t in triangles {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            let d = sub(points[a as usize], points[b as usize]);
            if a != b && dot(d, d) < 1e-290 {
                same.join(a, b);
            }
        }
    }
    let mut rep = try_vec(points.len(), "exact geodesics: vertices")?;
    rep.extend((0..points.len() as u32).map(|v| same.root(v)));
    let mut faces = try_vec(triangles.len(), "exact geodesics: faces")?;
    faces.extend(triangles.iter().map(|t| t.map(|v| rep[v as usize])));
    Ok((rep, faces))
}
