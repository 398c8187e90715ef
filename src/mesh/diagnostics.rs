//! What is wrong with a mesh, countable and locatable, and how big it is.

use super::measure::{Vec3, area, bounding_box, corners, is_flat, scale};
use super::sets::Sets;
use super::{NONE, Topology, TriMesh};
use crate::error::{Error, Result, try_filled};
use hashbrown::HashSet;

/// How often a defect occurs and where it occurs first.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Finding {
    /// Number of occurrences.
    pub count: u64,
    /// Input face or vertex of the first occurrence; meaningless when `count` is 0.
    pub first: u64,
    /// Place of the first occurrence, model units; NaN where there is no sound coordinate.
    pub at: Vec3,
}

/// Facts and defects of a mesh. Faces and vertices are numbered as in the source.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnostics {
    /// Vertices with a NaN or infinite coordinate (a vertex).
    pub non_finite_vertices: Finding,
    /// Faces that name a vertex that does not exist (a face).
    pub out_of_range_faces: Finding,
    /// Faces whose corners are not three distinct points after welding (a face).
    pub collapsed_faces: Finding,
    /// Faces of three distinct points on a line (a face).
    pub zero_area_faces: Finding,
    /// Faces with the same three vertices as an earlier one (a face).
    pub duplicate_faces: Finding,
    /// Edges with one face (that face; the middle of the edge).
    pub boundary_edges: Finding,
    /// Edges with more than two faces (the first of them; the middle of the edge).
    pub non_manifold_edges: Finding,
    /// Vertices where separate fans of faces touch (a vertex).
    pub non_manifold_vertices: Finding,
    /// Edges whose two faces run along them in the same direction (the higher face; the middle of the edge).
    pub orientation_conflicts: Finding,
    /// Closed shells that face inward although nothing contains them (their first face).
    pub inverted_shells: Finding,
    /// Vertices that no face uses (a vertex).
    pub unreferenced_vertices: Finding,
    /// Number of edge-connected components.
    pub shells: u64,
    /// Every edge has two faces or more.
    pub closed: bool,
    /// Every shell can be oriented.
    pub orientable: bool,
    /// Enclosed volume of the closed shells, outward ones minus cavities, model units cubed; overlaps count twice.
    pub volume: f64,
    /// Surface area, model units squared.
    pub area: f64,
    /// Lower and upper corner of the bounding box, model units.
    pub bounds: (Vec3, Vec3),
}

impl Finding {
    fn add(&mut self, first: u32, at: impl FnOnce() -> Vec3) {
        if self.count == 0 {
            *self = Finding { count: 0, first: first.into(), at: at() };
        }
        self.count += 1;
    }

    fn list(items: &[u32], at: impl Fn(u32) -> Vec3) -> Finding {
        let mut finding = Finding::default();
        items.iter().for_each(|&i| finding.add(i, || at(i)));
        finding
    }
}

impl Diagnostics {
    /// O(faces) time and memory.
    pub(super) fn new(mesh: &TriMesh) -> Result<Diagnostics> {
        let (positions, triangles, topology) = (mesh.positions(), mesh.triangles(), mesh.topology()?);
        let centre = |f: u32| {
            let [a, b, c] = corners(positions, triangles[f as usize]);
            [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0)
        };
        let nowhere = [f64::NAN; 3];
        let mut d = Diagnostics {
            non_finite_vertices: Finding::list(&mesh.refused().non_finite, |_| nowhere),
            out_of_range_faces: Finding::list(&mesh.refused().out_of_range, |_| nowhere),
            collapsed_faces: Finding::default(),
            zero_area_faces: Finding::default(),
            duplicate_faces: duplicates(mesh, centre)?,
            boundary_edges: Finding::default(),
            non_manifold_edges: Finding::default(),
            non_manifold_vertices: non_manifold_vertices(mesh, topology)?,
            orientation_conflicts: Finding::default(),
            inverted_shells: Finding::default(),
            unreferenced_vertices: Finding::default(),
            shells: topology.shells.len() as u64,
            closed: true,
            orientable: topology.shells.iter().all(|s| s.orientable),
            volume: 0.0,
            area: triangles.iter().map(|&t| area(corners(positions, t))).sum(),
            bounds: bounding_box(triangles.iter().flatten().map(|&v| positions[v as usize])),
        };
        d.count_collapsed(mesh);
        d.count_edges(mesh, topology);
        for (f, &t) in triangles.iter().enumerate() {
            if is_flat(corners(positions, t)) {
                d.zero_area_faces.add(mesh.input_of_face()[f], || centre(f as u32));
            }
        }
        for shell in topology.shells.iter().filter(|s| s.closed) {
            d.volume += if shell.inverted { -shell.volume } else { shell.volume };
            if shell.inverted {
                d.inverted_shells.add(mesh.input_of_face()[shell.first_face as usize], || centre(shell.first_face));
            }
        }
        let mut used = try_filled(positions.len(), false, "vertices")?;
        triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
        for (i, &w) in mesh.vertex_of_input().iter().enumerate() {
            if w != NONE && !used[w as usize] {
                d.unreferenced_vertices.add(i as u32, || positions[w as usize]);
            }
        }
        Ok(d)
    }

    /// Dropped faces that are not already counted as invalid.
    fn count_collapsed(&mut self, mesh: &TriMesh) {
        let invalid: HashSet<u32> = mesh.refused().out_of_range.iter().copied().collect();
        for (f, _) in mesh.face_of_input().iter().enumerate().filter(|&(_, &kept)| kept == NONE) {
            if !invalid.contains(&(f as u32)) {
                self.collapsed_faces.add(f as u32, || [f64::NAN; 3]);
            }
        }
    }

    fn count_edges(&mut self, mesh: &TriMesh, topology: &Topology) {
        let (positions, triangles) = (mesh.positions(), mesh.triangles());
        let ends = |h: u32| {
            let t = triangles[h as usize / 3];
            [t[h as usize % 3], t[(h as usize + 1) % 3]]
        };
        for e in 0..topology.edge_count() as u32 {
            let mates = topology.halfedges(e);
            let [a, b] = ends(mates[0]);
            let middle = || scale([0, 1, 2].map(|k| positions[a as usize][k] + positions[b as usize][k]), 0.5);
            let face = |h: u32| mesh.input_of_face()[h as usize / 3];
            match *mates {
                [h] => self.boundary_edges.add(face(h), middle),
                [g, h] if ends(g) == ends(h) => self.orientation_conflicts.add(face(h), middle),
                [_, _] => {}
                _ => self.non_manifold_edges.add(face(mates[0]), middle),
            }
        }
        self.closed = self.boundary_edges.count == 0;
    }
}

/// Faces with the vertices of an earlier face, in any order.
fn duplicates(mesh: &TriMesh, centre: impl Fn(u32) -> Vec3) -> Result<Finding> {
    let mut seen: HashSet<[u32; 3]> = HashSet::new();
    let enough = seen.try_reserve(mesh.triangles().len());
    enough.map_err(|_| Error::NoMemory("out of memory: looking for duplicate faces".into()))?;
    let mut finding = Finding::default();
    for (f, &t) in mesh.triangles().iter().enumerate() {
        let mut key = t;
        key.sort_unstable();
        if !seen.insert(key) {
            finding.add(mesh.input_of_face()[f], || centre(f as u32));
        }
    }
    Ok(finding)
}

/// Vertices whose faces do not hang together over edges at that vertex. Union-find over the corners of each vertex.
fn non_manifold_vertices(mesh: &TriMesh, topology: &Topology) -> Result<Finding> {
    let corners = 3 * mesh.triangles().len();
    let mut sets = Sets::new(corners)?;
    // the corner of half-edge h's face that sits at vertex v
    let corner_at = |h: u32, v: u32| {
        let t = mesh.triangles()[h as usize / 3];
        h - h % 3 + t.iter().position(|&w| w == v).unwrap_or(0) as u32
    };
    for e in 0..topology.edge_count() as u32 {
        let mates = topology.halfedges(e);
        let t = mesh.triangles()[mates[0] as usize / 3];
        for v in [t[mates[0] as usize % 3], t[(mates[0] as usize + 1) % 3]] {
            for &h in &mates[1..] {
                sets.join(corner_at(mates[0], v), corner_at(h, v));
            }
        }
    }
    let mut fans = try_filled(mesh.positions().len(), 0u32, "vertices")?;
    for c in (0..corners as u32).filter(|&c| sets.root(c) == c) {
        fans[mesh.triangles()[c as usize / 3][c as usize % 3] as usize] += 1;
    }
    let mut finding = Finding::default();
    for v in (0..fans.len()).filter(|&v| fans[v] > 1) {
        finding.add(mesh.input_of_vertex()[v], || mesh.positions()[v]);
    }
    Ok(finding)
}

#[cfg(test)]
mod tests {
    use crate::job::Job;
    use crate::mesh::shapes::{Shape, cuboid, union};
    use crate::mesh::{Diagnostics, MeshOptions, TriMesh};

    fn diagnose((p, t): &Shape) -> Diagnostics {
        let mesh = TriMesh::new(&(p.as_slice(), t.as_slice()), &MeshOptions::default(), &Job::default()).unwrap();
        mesh.diagnostics().unwrap().clone()
    }

    #[test]
    fn a_sound_box_has_no_findings() {
        let d = diagnose(&cuboid([1.0, 2.0, 3.0]));
        assert!((d.volume - 6.0).abs() < 1e-14 && (d.area - 22.0).abs() < 1e-14);
        assert_eq!((d.shells, d.closed, d.bounds), (1, true, ([0.0; 3], [1.0, 2.0, 3.0])));
        let counts = [d.boundary_edges, d.non_manifold_edges, d.non_manifold_vertices, d.orientation_conflicts];
        let more =
            [d.collapsed_faces, d.zero_area_faces, d.duplicate_faces, d.inverted_shells, d.unreferenced_vertices];
        assert!(counts.iter().chain(&more).all(|f| f.count == 0), "{d:?}");
    }

    #[test]
    fn every_defect_is_counted_and_located() {
        let (p, mut t) = cuboid([1.0, 1.0, 1.0]);
        let gone = t.remove(5);
        let d = diagnose(&(p.clone(), t.clone()));
        assert_eq!((d.boundary_edges.count, d.closed), (3, false));
        t.push(gone);
        t[3].swap(0, 1);
        let d = diagnose(&(p.clone(), t.clone()));
        assert_eq!((d.orientation_conflicts.count, d.inverted_shells.count), (3, 0));
        assert!((d.volume - 1.0).abs() < 1e-14, "the volume is that of the consistent orientation");
        t[3].swap(0, 1);
        t.push(t[2]);
        let d = diagnose(&(p.clone(), t.clone()));
        assert_eq!((d.duplicate_faces.count, d.duplicate_faces.first, d.non_manifold_edges.count), (1, 12, 3));
    }

    #[test]
    fn cubes_that_touch_at_a_corner_share_a_non_manifold_vertex() {
        let (p, t) = cuboid([1.0; 3]);
        let moved = p.iter().map(|q| [q[0] + 1.0, q[1] + 1.0, q[2] + 1.0]).collect();
        let d = diagnose(&union(&[(p.clone(), t.clone()), (moved, t.clone())]));
        assert_eq!((d.non_manifold_vertices.count, d.non_manifold_vertices.at, d.shells), (1, [1.0; 3], 2));
        let beside = p.iter().map(|q| [q[0] + 1.0, q[1] + 1.0, q[2]]).collect();
        let d = diagnose(&union(&[(p, t.clone()), (beside, t)]));
        assert_eq!((d.non_manifold_edges.count, d.non_manifold_vertices.count, d.shells), (1, 0, 1));
        assert!((d.volume - 2.0).abs() < 1e-14);
    }

    #[test]
    fn zero_area_faces_and_inverted_shells_are_told_apart() {
        let (p, mut t) = cuboid([2.0, 1.0, 1.0]);
        t.iter_mut().for_each(|f| f.swap(1, 2));
        let d = diagnose(&(p.clone(), t.clone()));
        assert_eq!((d.inverted_shells.count, d.orientation_conflicts.count), (1, 0));
        assert!((d.volume - 2.0).abs() < 1e-14);
        let mut q = p.clone();
        q.push([q[0][0] * 0.5 + q[1][0] * 0.5, q[0][1] * 0.5 + q[1][1] * 0.5, q[0][2] * 0.5 + q[1][2] * 0.5]);
        t.push([0, 1, 8]);
        let d = diagnose(&(q, t));
        assert_eq!((d.zero_area_faces.count, d.zero_area_faces.first, d.collapsed_faces.count), (1, 12, 0));
    }
}
