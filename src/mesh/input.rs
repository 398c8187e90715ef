//! Raw buffers → a checked, welded [`TriMesh`]. The only constructor.

use super::measure::{Vec3, bounding_box, corners, distance, is_flat};
use super::proxy::Proxy;
use super::{Diagnostics, NONE, Topology};
use crate::error::{Error, Located, Result, try_filled, try_vec};
use crate::job::Job;
use hashbrown::HashMap;
use std::sync::OnceLock;

/// Vertices and triangles as somebody else stores them.
pub trait MeshSource: Sync {
    /// Number of vertices.
    fn vertex_count(&self) -> usize;
    /// Position of vertex `i`, model units.
    fn position(&self, i: usize) -> [f64; 3];
    /// Number of triangles.
    fn face_count(&self) -> usize;
    /// The three vertices of triangle `f`, counter-clockwise seen from outside; may be out of range.
    fn triangle(&self, f: usize) -> [i64; 3];
}

/// Which vertices become one. STL stores three vertices a triangle; without welding no two triangles touch.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Weld {
    /// Vertices with equal coordinates (-0 = +0).
    #[default]
    Exact,
    /// None: the indices are the connectivity.
    None,
    /// Vertices up to this distance apart, model units; the first in order stands for the group.
    Tolerance(f64),
}

/// How a mesh is taken in.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MeshOptions {
    /// Which vertices become one.
    pub weld: Weld,
    /// Leave out faces with a non-finite vertex or an index out of range instead of refusing the mesh.
    pub skip_invalid: bool,
}

/// A welded triangle mesh with finite coordinates and valid indices; immutable.
///
/// *Input* vertices and faces are those of the source; the *welded* vertices and the *kept* faces are what all
/// computations see. A face is kept when it has three distinct welded vertices; it may still have no area.
#[derive(Debug)]
pub struct TriMesh {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    vertex_of_input: Vec<u32>,
    face_of_input: Vec<u32>,
    input_of_face: Vec<u32>,
    input_of_vertex: Vec<u32>,
    refused: Refused,
    topology: OnceLock<Result<Topology>>,
    diagnostics: OnceLock<Result<Diagnostics>>,
    reference: OnceLock<Option<Proxy>>,
}

/// What [`MeshOptions::skip_invalid`] left out.
#[derive(Debug, Clone, Default)]
pub(super) struct Refused {
    pub non_finite: Vec<u32>,
    pub out_of_range: Vec<u32>,
}

impl TriMesh {
    /// Checks and welds `source`. Worst case O(vertices + faces) time and memory.
    pub fn new(source: &impl MeshSource, options: &MeshOptions, job: &Job) -> Result<TriMesh> {
        let (n, m) = (source.vertex_count(), source.face_count());
        check_sizes(n, m)?;
        job.afford(footprint(n, m), "taking in the mesh")?;
        let refused = find_invalid(source, options.skip_invalid, job)?;
        let vertex_of_input = weld(source, options.weld, job)?;

        // --- welded vertices, numbered by first appearance
        let mut positions = try_vec(n, "vertices")?;
        let mut input_of_vertex = try_vec(n, "vertices")?;
        for (i, &w) in vertex_of_input.iter().enumerate() {
            if w != NONE && w as usize == positions.len() {
                positions.push(source.position(i).map(|x| x + 0.0)); // -0 + 0 = +0
                input_of_vertex.push(i as u32);
            }
        }

        // --- kept faces
        let mut triangles = try_vec(m, "faces")?;
        let mut input_of_face = try_vec(m, "faces")?;
        let mut face_of_input = try_vec(m, "faces")?;
        for f in 0..m {
            let t = source.triangle(f).map(|v| usize::try_from(v).ok().and_then(|v| vertex_of_input.get(v).copied()));
            match t {
                [Some(a), Some(b), Some(c)] if a != b && b != c && c != a && a.max(b).max(c) != NONE => {
                    face_of_input.push(triangles.len() as u32);
                    triangles.push([a, b, c]);
                    input_of_face.push(f as u32);
                }
                _ => face_of_input.push(NONE),
            }
        }
        if triangles.iter().all(|&t| is_flat(corners(&positions, t))) {
            let message = format!("all {m} faces are degenerate: each has no area, a repeated or an unusable vertex");
            return Err(Error::Degenerate(Located { message, first: 0, count: m as u64 }));
        }
        check_extent(&positions)?;
        positions.shrink_to_fit();
        Ok(TriMesh {
            positions,
            triangles,
            vertex_of_input,
            face_of_input,
            input_of_face,
            input_of_vertex,
            refused,
            topology: OnceLock::new(),
            diagnostics: OnceLock::new(),
            reference: OnceLock::new(),
        })
    }

    /// Number of vertices of the source.
    pub fn input_vertex_count(&self) -> usize {
        self.vertex_of_input.len()
    }
    /// Number of faces of the source.
    pub fn input_face_count(&self) -> usize {
        self.face_of_input.len()
    }
    /// Welded vertex of every input vertex; [`NONE`] for one that is not finite.
    pub fn vertex_of_input(&self) -> &[u32] {
        &self.vertex_of_input
    }
    /// Kept face of every input face, or [`NONE`].
    pub fn face_of_input(&self) -> &[u32] {
        &self.face_of_input
    }
    /// The input face of every kept face, ascending.
    pub fn input_of_face(&self) -> &[u32] {
        &self.input_of_face
    }
    /// The first input vertex of every welded vertex, ascending.
    pub fn input_of_vertex(&self) -> &[u32] {
        &self.input_of_vertex
    }
    /// Welded vertices, model units.
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }
    /// Kept faces, as oriented in the source, in welded vertices.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }
    /// Edges, shells and orientation; computed at the first call.
    pub fn topology(&self) -> Result<&Topology> {
        let made = self.topology.get_or_init(|| Topology::new(&self.positions, &self.triangles));
        made.as_ref().map_err(Clone::clone)
    }
    /// What is wrong with the mesh, and its size; computed at the first call.
    pub fn diagnostics(&self) -> Result<&Diagnostics> {
        self.diagnostics.get_or_init(|| Diagnostics::new(self)).as_ref().map_err(Clone::clone)
    }
    /// A mesh of some thousand faces that stands in for this one, turned outward; computed at the first call that succeeds.
    /// See [`Proxy::reference`].
    pub fn reference(&self, job: &Job) -> Result<Option<&Proxy>> {
        if self.reference.get().is_none() {
            let made = Proxy::reference(&self.positions, &self.topology()?.oriented(&self.triangles), job)?;
            // another call may have been faster: both made the same
            let _ = self.reference.set(made);
        }
        Ok(self.reference.get().and_then(Option::as_ref))
    }
    pub(super) fn refused(&self) -> &Refused {
        &self.refused
    }
}

fn check_sizes(vertices: usize, faces: usize) -> Result<()> {
    if vertices == 0 || faces == 0 {
        return Err(Error::Empty(format!("the mesh is empty: {vertices} vertices, {faces} faces")));
    }
    // half-edges and vertices are numbered by u32, the last number means "none"
    let limit = (NONE / 3) as usize;
    if vertices >= NONE as usize || faces >= limit {
        return Err(Error::Argument(format!(
            "the mesh is too large: {vertices} vertices (limit {}), {faces} faces (limit {limit})",
            NONE - 1
        )));
    }
    Ok(())
}

/// Refuses sizes whose squares and cubes would leave the range of f64.
fn check_extent(positions: &[Vec3]) -> Result<()> {
    let (lo, hi) = bounding_box(positions.iter().copied());
    let size = distance(lo, hi);
    if (1e-60..1e60).contains(&size) {
        return Ok(());
    }
    Err(Error::Argument(format!(
        "the mesh is {size:e} units across, from {lo:?} to {hi:?}; 1e-60 to 1e60 can be measured"
    )))
}

/// Bytes that taking in a mesh needs at its peak (positions, maps, faces, the hash table of the weld).
fn footprint(vertices: usize, faces: usize) -> u64 {
    (vertices as u64) * (24 + 4 + 4 + 48) + (faces as u64) * (12 + 4 + 4)
}

/// Lists unusable vertices and faces; refuses the mesh at the first kind found unless `skip`.
fn find_invalid(source: &impl MeshSource, skip: bool, job: &Job) -> Result<Refused> {
    let mut refused = Refused::default();
    for i in 0..source.vertex_count() {
        if i % 65_536 == 0 {
            job.check()?;
        }
        if source.position(i).iter().any(|x| !x.is_finite()) {
            refused.non_finite.push(i as u32);
        }
    }
    if let (false, Some(&first)) = (skip, refused.non_finite.first()) {
        let (count, [x, y, z]) = (refused.non_finite.len() as u64, source.position(first as usize));
        let message = format!("{count} vertices are not finite; the first is vertex {first} at ({x}, {y}, {z})");
        return Err(Error::NonFinite(Located { message, first: first.into(), count }));
    }
    let n = source.vertex_count() as i64;
    for f in 0..source.face_count() {
        if f % 65_536 == 0 {
            job.check()?;
        }
        if source.triangle(f).iter().any(|v| !(0..n).contains(v)) {
            refused.out_of_range.push(f as u32);
        }
    }
    if let (false, Some(&first)) = (skip, refused.out_of_range.first()) {
        let t = source.triangle(first as usize);
        let corner = t.iter().position(|v| !(0..n).contains(v)).unwrap_or(0);
        let count = refused.out_of_range.len() as u64;
        let message = format!(
            "{count} faces name a vertex that does not exist; the first is face {first}, corner {corner}, vertex {} of {n}",
            t[corner]
        );
        return Err(Error::Index(Located { message, first: first.into(), count }));
    }
    Ok(refused)
}

/// Welded vertex of every input vertex, numbered by first appearance; [`NONE`] where not finite.
fn weld(source: &impl MeshSource, weld: Weld, job: &Job) -> Result<Vec<u32>> {
    match weld {
        Weld::Exact => weld_by(source, job, |p| Ok(p.map(|x| (x + 0.0).to_bits()))),
        Weld::None => {
            let mut next = 0;
            let mut out = try_vec(source.vertex_count(), "vertices")?;
            for i in 0..source.vertex_count() {
                let finite = source.position(i).iter().all(|x| x.is_finite());
                out.push(if finite { next } else { NONE });
                next += finite as u32;
            }
            Ok(out)
        }
        Weld::Tolerance(t) if t > 0.0 && t.is_finite() => weld_near(source, t, job),
        Weld::Tolerance(t) => Err(Error::Argument(format!("the weld tolerance must be positive and finite, not {t}"))),
    }
}

/// Welds the vertices with equal keys.
fn weld_by(source: &impl MeshSource, job: &Job, key: impl Fn(Vec3) -> Result<[u64; 3]>) -> Result<Vec<u32>> {
    let n = source.vertex_count();
    let mut out = try_filled(n, NONE, "vertices")?;
    let mut seen: HashMap<[u64; 3], u32> = HashMap::new();
    // soup has six vertices for every welded one
    reserve(&mut seen, n / 4)?;
    for (i, slot) in out.iter_mut().enumerate() {
        if i % 65_536 == 0 {
            job.check()?;
            reserve(&mut seen, 65_536)?;
        }
        let p = source.position(i);
        if p.iter().all(|x| x.is_finite()) {
            let next = seen.len() as u32;
            *slot = *seen.entry(key(p)?).or_insert(next);
        }
    }
    Ok(out)
}

fn reserve<K: std::hash::Hash + Eq, V>(map: &mut HashMap<K, V>, more: usize) -> Result<()> {
    map.try_reserve(more).map_err(|_| Error::NoMemory("out of memory: welding vertices".into()))
}

/// Welds every vertex to the first earlier representative within `tolerance`, found on a grid of that cell size.
fn weld_near(source: &impl MeshSource, tolerance: f64, job: &Job) -> Result<Vec<u32>> {
    let n = source.vertex_count();
    let cell_of = |p: Vec3| {
        let c = p.map(|x| (x / tolerance).floor());
        // beyond 2^53 neighbouring cells are not distinct numbers
        if c.iter().any(|x| x.abs() > 9e15) {
            let message = format!("the weld tolerance {tolerance} is below the resolution of the coordinates at {p:?}");
            return Err(Error::Argument(message));
        }
        Ok(c.map(|x| x as i64))
    };
    let mut out = try_filled(n, NONE, "vertices")?;
    // first representative of a cell, and the next of the same cell for every representative
    let mut cells: HashMap<[i64; 3], u32> = HashMap::new();
    let (mut next_in_cell, mut at): (Vec<u32>, Vec<Vec3>) = (Vec::new(), Vec::new());
    for (i, slot) in out.iter_mut().enumerate() {
        if i % 65_536 == 0 {
            job.check()?;
            reserve(&mut cells, 65_536)?;
        }
        let p = source.position(i);
        if p.iter().any(|x| !x.is_finite()) {
            continue;
        }
        let home = cell_of(p)?;
        let mut found = NONE;
        for k in 0..27 {
            let neighbour = [home[0] + k % 3 - 1, home[1] + k / 3 % 3 - 1, home[2] + k / 9 - 1];
            let mut r = cells.get(&neighbour).copied().unwrap_or(NONE);
            while r != NONE {
                if r < found && distance(at[r as usize], p) <= tolerance {
                    found = r;
                }
                r = next_in_cell[r as usize];
            }
        }
        if found == NONE {
            found = at.len() as u32;
            at.push(p);
            next_in_cell.push(cells.insert(home, found).unwrap_or(NONE));
        }
        *slot = found;
    }
    Ok(out)
}

/// A mesh held in plain vectors, for tests and for file readers.
impl MeshSource for (&[Vec3], &[[u32; 3]]) {
    fn vertex_count(&self) -> usize {
        self.0.len()
    }
    fn position(&self, i: usize) -> [f64; 3] {
        self.0[i]
    }
    fn face_count(&self) -> usize {
        self.1.len()
    }
    fn triangle(&self, f: usize) -> [i64; 3] {
        self.1[f].map(i64::from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    fn mesh(p: &[Vec3], t: &[[u32; 3]], options: MeshOptions) -> Result<TriMesh> {
        TriMesh::new(&(p, t), &options, &Job::default())
    }

    /// Triangle soup of a mesh: three vertices a face.
    fn soup(p: &[Vec3], t: &[[u32; 3]]) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let points = t.iter().flatten().map(|&v| p[v as usize]).collect();
        (points, (0..t.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect())
    }

    #[test]
    fn soup_welds_to_the_cube_it_came_from() {
        let (p, t) = shapes::cuboid([1.0, 2.0, 3.0]);
        let (sp, st) = soup(&p, &t);
        let m = mesh(&sp, &st, MeshOptions::default()).unwrap();
        assert_eq!((m.positions().len(), m.triangles().len(), m.input_vertex_count()), (8, 12, 36));
        for (i, &w) in m.vertex_of_input().iter().enumerate() {
            assert_eq!(m.positions()[w as usize], sp[i]);
        }
        assert_eq!(m.topology().unwrap().boundary_edges().count(), 0);
        let none = mesh(&sp, &st, MeshOptions { weld: Weld::None, ..Default::default() }).unwrap();
        assert_eq!(none.positions().len(), 36);
    }

    #[test]
    fn negative_zero_is_zero() {
        let p = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-0.0, -0.0, -0.0], [0.0, 0.0, 1.0]];
        let m = mesh(&p, &[[0, 1, 2], [3, 4, 1]], MeshOptions::default()).unwrap();
        assert_eq!(m.positions().len(), 4);
        assert_eq!(m.vertex_of_input()[3], 0);
    }

    #[test]
    fn tolerance_welds_near_vertices_across_cells() {
        let (p, t) = shapes::cuboid([1.0, 1.0, 1.0]);
        let (mut sp, st) = soup(&p, &t);
        for (i, q) in sp.iter_mut().enumerate() {
            q[i % 3] += 1e-4 * ((i * 7 % 11) as f64 / 11.0 - 0.5);
        }
        let apart = mesh(&sp, &st, MeshOptions::default()).unwrap();
        assert!(apart.positions().len() > 20);
        let near = mesh(&sp, &st, MeshOptions { weld: Weld::Tolerance(3e-4), ..Default::default() }).unwrap();
        assert_eq!(near.positions().len(), 8);
        let bad = mesh(&sp, &st, MeshOptions { weld: Weld::Tolerance(f64::NAN), ..Default::default() });
        assert!(matches!(bad, Err(Error::Argument(_))));
    }

    #[test]
    fn unusable_input_is_located_or_skipped() {
        let (mut p, mut t) = shapes::cuboid([1.0, 1.0, 1.0]);
        p.push([0.0, f64::NAN, 0.0]);
        t.push([0, 1, 8]);
        t.push([0, 1, 99]);
        match mesh(&p, &t, MeshOptions::default()) {
            Err(Error::NonFinite(l)) => assert_eq!((l.first, l.count), (8, 1)),
            other => panic!("{other:?}"),
        }
        match mesh(&p[..8], &t, MeshOptions::default()) {
            Err(Error::Index(l)) => assert_eq!((l.first, l.count), (12, 2)),
            other => panic!("{other:?}"),
        }
        let m = mesh(&p, &t, MeshOptions { skip_invalid: true, ..Default::default() }).unwrap();
        assert_eq!((m.triangles().len(), m.face_of_input()[12], m.face_of_input()[13]), (12, NONE, NONE));
        let d = m.diagnostics().unwrap();
        assert_eq!((d.non_finite_vertices.count, d.out_of_range_faces.count), (1, 1));
    }

    #[test]
    fn nothing_to_measure_is_refused() {
        assert!(matches!(mesh(&[], &[], MeshOptions::default()), Err(Error::Empty(_))));
        let p = [[0.0; 3], [1.0, 0.0, 0.0]];
        assert!(matches!(mesh(&p, &[[0, 1, 1]], MeshOptions::default()), Err(Error::Degenerate(_))));
    }
}
