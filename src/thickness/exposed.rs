//! The surface of the union of a mesh's shells. Printable files often hold shells that overlap or are glued together
//! face to face; what lies inside another shell is no surface of the part. Faces that others cut are cut up here, and
//! each piece is kept if the space in front of it is outside.

use super::bvh::{RayMesh, SAME_SURFACE, along, cross, dot, sub, unit_normal};
use super::lanes::{Lanes, Ray, Work, with_best};
use super::nearest::closest_on_triangle;
use super::tree::Stack;
use crate::error::{Result, try_filled, try_vec};
use crate::job::Job;
use crate::mesh::sets::Sets;
use rayon::prelude::*;

/// A face is not cut into more pieces than this; what is left whole is judged by its middle.
const MOST_PIECES: usize = 512;

/// Directions without any relation to the axes, so that rays seldom meet edges.
const GENERIC: [[f64; 3]; 5] = [
    [0.5431, 0.4177, 0.7283],
    [-0.6113, 0.7549, 0.2371],
    [0.3347, -0.7027, 0.6277],
    [0.8419, 0.1723, -0.5119],
    [0.1931, 0.5879, -0.7851],
];

/// What is left of a face.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kept {
    /// All of it, under this id.
    Whole(u32),
    /// The pieces with the ids from the first to before the second.
    Pieces(u32, u32),
}

/// The surface of the union.
#[derive(Debug)]
pub(super) struct Exposed {
    mesh: RayMesh,
    /// By face of the caller; None if all of it is exposed, so that ids are the same.
    kept: Option<Vec<Kept>>,
    faces: usize,
}

impl Exposed {
    /// Finds the exposed surface of the mesh.
    pub fn new(positions: &[[f64; 3]], triangles: &[[u32; 3]], job: &Job) -> Result<Exposed> {
        let mesh = RayMesh::new(positions, triangles, job)?;
        let faces = triangles.len();
        let Some(shells) = Shells::find(&mesh)? else {
            return Ok(Exposed { mesh: mesh.for_spheres()?, kept: None, faces });
        };
        let fates: Result<Vec<Vec<Fate>>> = (0..faces)
            .collect::<Vec<_>>()
            .par_chunks(256)
            .map(|ids| {
                job.check()?;
                Ok(with_best(Judge { mesh: &mesh, shells: &shells, ids }))
            })
            .collect();
        let fates: Vec<Fate> = fates?.into_iter().flatten().collect();
        if fates.iter().all(|f| *f == Fate::Exposed) {
            return Ok(Exposed { mesh: mesh.for_spheres()?, kept: None, faces });
        }
        let (mut points, mut tris) = (try_vec(faces, "exposed surface")?, try_vec(faces, "exposed surface")?);
        points.extend_from_slice(positions);
        let mut kept = try_vec(faces, "exposed surface")?;
        for (t, fate) in triangles.iter().zip(fates) {
            let from = tris.len() as u32;
            match fate {
                Fate::Exposed => tris.push(*t),
                Fate::Buried => {}
                Fate::Cut(pieces) => {
                    for piece in pieces {
                        let base = points.len() as u32;
                        points.extend(piece.map(|p| mesh.to_caller(p)));
                        tris.push([base, base + 1, base + 2]);
                    }
                    kept.push(Kept::Pieces(from, tris.len() as u32));
                    continue;
                }
            }
            kept.push(if tris.len() as u32 > from { Kept::Whole(from) } else { Kept::Pieces(from, from) });
        }
        Ok(Exposed { mesh: RayMesh::new(&points, &tris, job)?.for_spheres()?, kept: Some(kept), faces })
    }

    /// The exposed surface; its face ids are its own.
    pub fn mesh(&self) -> &RayMesh {
        &self.mesh
    }

    /// Number of faces of the caller's mesh.
    pub fn face_count(&self) -> usize {
        self.faces
    }

    /// Whether all of the caller's mesh is exposed.
    pub fn is_all(&self) -> bool {
        self.kept.is_none()
    }

    /// Whether all of a caller's face is exposed.
    pub fn is_whole(&self, face: u32) -> bool {
        self.kept.as_ref().is_none_or(|kept| matches!(kept[face as usize], Kept::Whole(_)))
    }

    /// Appends to `out` the faces of [`Exposed::mesh`] on which `p` (in its units) lies, among what is left of the
    /// caller's faces `parents`. None are left if `p` is buried.
    pub fn faces_at(&self, p: [f64; 3], parents: &[u32], out: &mut Vec<u32>) {
        let Some(kept) = &self.kept else {
            out.extend_from_slice(parents);
            return;
        };
        for &parent in parents {
            match kept[parent as usize] {
                Kept::Whole(face) => out.push(face),
                Kept::Pieces(from, to) => out.extend((from..to).filter(|&f| {
                    let d = sub(p, closest_on_triangle(p, self.mesh.corners(f)));
                    dot(d, d) < SAME_SURFACE * SAME_SURFACE
                })),
            }
        }
    }
}

/// The connected shells of a mesh.
struct Shells {
    /// Shell of each face.
    of: Vec<u32>,
    /// Bounds of each shell, grown by [`SAME_SURFACE`].
    lo: Vec<[f64; 3]>,
    hi: Vec<[f64; 3]>,
    /// Shells without a border: only they have an inside.
    closed: Vec<bool>,
    /// Shells whose bounds meet each shell's.
    near: Vec<Vec<u32>>,
}

impl Shells {
    /// None if no two shells come near each other.
    fn find(mesh: &RayMesh) -> Result<Option<Shells>> {
        let mut sets = Sets::new(mesh.points.len())?;
        for &[a, b, c] in &mesh.triangles {
            sets.join(a, b);
            sets.join(a, c);
        }
        let mut id = try_filled(mesh.points.len(), u32::MAX, "shells")?;
        let mut of = try_vec(mesh.face_count(), "shells")?;
        let (mut lo, mut hi) = (Vec::new(), Vec::new());
        for (f, t) in mesh.triangles.iter().enumerate() {
            let r = sets.root(t[0]) as usize;
            if id[r] == u32::MAX {
                id[r] = lo.len() as u32;
                lo.push([f64::INFINITY; 3]);
                hi.push([f64::NEG_INFINITY; 3]);
            }
            of.push(id[r]);
            for p in mesh.corners(f as u32) {
                for a in 0..3 {
                    let shell = id[r] as usize;
                    lo[shell][a] = lo[shell][a].min(p[a] - SAME_SURFACE);
                    hi[shell][a] = hi[shell][a].max(p[a] + SAME_SURFACE);
                }
            }
        }
        let near = meeting(&lo, &hi);
        if near.iter().all(Vec::is_empty) {
            return Ok(None);
        }
        let closed = closed_shells(mesh, &of, lo.len())?;
        Ok(Some(Shells { of, lo, hi, closed, near }))
    }

    /// True if the bounds of another closed shell meet those of the face.
    fn may_matter(&self, face: u32, lo: [f64; 3], hi: [f64; 3]) -> bool {
        self.near[self.of[face as usize] as usize].iter().any(|&s| {
            let s = s as usize;
            self.closed[s] && (0..3).all(|a| lo[a] <= self.hi[s][a] && self.lo[s][a] <= hi[a])
        })
    }
}

/// For each box the others that it meets, by a sweep along x.
fn meeting(lo: &[[f64; 3]], hi: &[[f64; 3]]) -> Vec<Vec<u32>> {
    let mut order: Vec<u32> = (0..lo.len() as u32).collect();
    order.sort_by(|&i, &j| lo[i as usize][0].total_cmp(&lo[j as usize][0]));
    let mut near = vec![Vec::new(); lo.len()];
    for (k, &i) in order.iter().enumerate() {
        let (l, h) = (lo[i as usize], hi[i as usize]);
        for &j in order[k + 1..].iter().take_while(|&&j| lo[j as usize][0] <= h[0]) {
            if (1..3).all(|a| l[a] <= hi[j as usize][a] && lo[j as usize][a] <= h[a]) {
                near[i as usize].push(j);
                near[j as usize].push(i);
            }
        }
    }
    near
}

/// Which shells have every edge as often one way as the other.
fn closed_shells(mesh: &RayMesh, of: &[u32], count: usize) -> Result<Vec<bool>> {
    let mut edges = try_vec(3 * of.len(), "edges of the shells")?;
    for (t, &shell) in mesh.triangles.iter().zip(of) {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            edges.push((a.min(b), a.max(b), shell, if a < b { 1i32 } else { -1 }));
        }
    }
    edges.par_sort_unstable();
    let mut closed = vec![true; count];
    for run in edges.chunk_by(|e, f| (e.0, e.1) == (f.0, f.1)) {
        if run.iter().map(|e| e.3).sum::<i32>() != 0 {
            closed[run[0].2 as usize] = false;
        }
    }
    Ok(closed)
}

/// What becomes of a face.
#[derive(Debug, Clone, PartialEq)]
enum Fate {
    Exposed,
    Buried,
    /// The exposed pieces.
    Cut(Vec<[[f64; 3]; 3]>),
}

struct Judge<'a> {
    mesh: &'a RayMesh,
    shells: &'a Shells,
    ids: &'a [usize],
}

impl Work for Judge<'_> {
    type Output = Vec<Fate>;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> Vec<Fate> {
        let mut stack = Stack::new();
        self.ids.iter().map(|&f| self.fate(lanes, &mut stack, f as u32)).collect()
    }
}

impl Judge<'_> {
    fn fate<L: Lanes>(&self, lanes: L, stack: &mut Stack, face: u32) -> Fate {
        let corners = self.mesh.corners(face);
        let lo = std::array::from_fn(|a| corners[0][a].min(corners[1][a]).min(corners[2][a]) - SAME_SURFACE);
        let hi = std::array::from_fn(|a| corners[0][a].max(corners[1][a]).max(corners[2][a]) + SAME_SURFACE);
        let normal = self.mesh.normals[face as usize];
        if normal == [0.0; 3] || !self.shells.may_matter(face, lo, hi) {
            return Fate::Exposed;
        }
        let own = self.shells.of[face as usize];
        let mut cutters = Vec::new();
        self.mesh.faces_near(lo, hi, |g| {
            let shell = self.shells.of[g as usize];
            if shell != own && self.shells.closed[shell as usize] && crosses(self.mesh.corners(g), corners[0], normal) {
                cutters.push(g);
            }
        });
        cutters.sort_unstable();
        let mut pieces = vec![corners.to_vec()];
        for &g in &cutters {
            let g = self.mesh.corners(g);
            let mut next = Vec::with_capacity(pieces.len() + 1);
            for piece in pieces {
                if next.len() < MOST_PIECES { cut(piece, g, &mut next) } else { next.push(piece) }
            }
            pieces = next;
        }
        let total = pieces.len();
        let mut exposed = Vec::new();
        for piece in pieces {
            let middle = centroid(&piece);
            if !self.is_buried(lanes, stack, middle, normal) {
                exposed.push(piece);
            }
        }
        match exposed.len() {
            0 => Fate::Buried,
            n if n == total => Fate::Exposed,
            _ => Fate::Cut(exposed.iter().flat_map(|p| (2..p.len()).map(|k| [p[0], p[k - 1], p[k]])).collect()),
        }
    }

    /// Whether the space in front of `p`, a point of a face with the outward `normal`, is inside a shell: the winding
    /// number there, counted along a ray: shells left less shells entered. Two of three rays decide.
    fn is_buried<L: Lanes>(&self, lanes: L, stack: &mut Stack, p: [f64; 3], normal: [f64; 3]) -> bool {
        let usable = GENERIC.iter().filter(|d| dot(**d, normal).abs() > 0.2);
        let votes: usize = usable
            .take(3)
            .map(|d| {
                let length = dot(*d, *d).sqrt().copysign(dot(*d, normal));
                let d = d.map(|x| x / length);
                let mut winding = 0;
                let start = SAME_SURFACE / dot(d, normal);
                self.mesh.tree.shoot(
                    lanes,
                    stack,
                    self.mesh.tree.root(),
                    &Ray::new(p, d),
                    (start, f64::INFINITY),
                    |hit| {
                        if self.shells.closed[self.shells.of[hit.face as usize] as usize] {
                            winding += if hit.exit { 1 } else { -1 };
                        }
                        f64::INFINITY
                    },
                );
                (winding >= 1) as usize
            })
            .sum();
        votes >= 2
    }
}

/// True unless the triangle `g` lies on one side of the plane through `p` with the normal `n`.
fn crosses(g: [[f64; 3]; 3], p: [f64; 3], n: [f64; 3]) -> bool {
    let h = g.map(|q| dot(sub(q, p), n));
    h.iter().any(|&h| h <= SAME_SURFACE) && h.iter().any(|&h| h >= -SAME_SURFACE)
}

/// Cuts a convex polygon by the plane of the triangle `g` if the cut would touch `g`.
fn cut(polygon: Vec<[f64; 3]>, g: [[f64; 3]; 3], out: &mut Vec<Vec<[f64; 3]>>) {
    let n = unit_normal(g);
    let h: Vec<f64> = polygon.iter().map(|p| dot(sub(*p, g[0]), n)).collect();
    if !h.iter().any(|&h| h > SAME_SURFACE) || !h.iter().any(|&h| h < -SAME_SURFACE) {
        out.push(polygon);
        return;
    }
    let (mut above, mut below, mut seam) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..polygon.len() {
        let j = (i + 1) % polygon.len();
        let (p, q) = (polygon[i], polygon[j]);
        if h[i].abs() <= SAME_SURFACE {
            above.push(p);
            below.push(p);
            seam.push(p);
        } else {
            if h[i] > 0.0 {
                above.push(p)
            } else {
                below.push(p)
            }
            if h[i] * h[j] < 0.0 && h[j].abs() > SAME_SURFACE {
                let x = along(p, h[i] / (h[i] - h[j]), sub(q, p));
                above.push(x);
                below.push(x);
                seam.push(x);
            }
        }
    }
    let beyond = (0..3).any(|a| {
        let range =
            |v: &[[f64; 3]]| v.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p[a]), h.max(p[a])));
        let (s, t) = (range(&seam), range(&g));
        s.0 > t.1 + SAME_SURFACE || t.0 > s.1 + SAME_SURFACE
    });
    if beyond {
        out.push(polygon);
    } else {
        out.extend([above, below].into_iter().filter(|p| p.len() >= 3));
    }
}

/// Centroid of a convex polygon's area; the mean of its corners if it has none.
fn centroid(polygon: &[[f64; 3]]) -> [f64; 3] {
    let (mut sum, mut total) = ([0.0; 3], 0.0);
    for k in 2..polygon.len() {
        let (a, b, c) = (polygon[0], polygon[k - 1], polygon[k]);
        let n = cross(sub(b, a), sub(c, a));
        let area = dot(n, n).sqrt();
        total += area;
        sum = along(sum, area / 3.0, along(along(a, 1.0, b), 1.0, c));
    }
    if total > 0.0 {
        return sum.map(|x| x / total);
    }
    polygon.iter().fold([0.0; 3], |s, p| along(s, 1.0 / polygon.len() as f64, *p))
}
