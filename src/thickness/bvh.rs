//! The mesh as rays see it: centred and scaled to unit size, in an eight-wide tree. This is the only file that knows
//! `obvhs`, which builds the binary tree that is folded into ours.

use super::fans::Fans;
use super::fold::fold;
use super::lanes::{Lanes, Ray};
use super::slabs::find_slabs;
use super::tree::{Hit, LEAF, Node, Stack, Tree};
use crate::error::{Error, Result, try_filled, try_vec};
use crate::job::Job;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use rayon::prelude::*;

/// Boxes are padded by this much in units of the tree (the mesh is 1/2 to 1 long): more than the rounding of a ray's
/// origin and of the slab test to single precision.
pub(super) const PADDING: f32 = 2.4e-7;

/// What lies no higher than this above the plane of the face that a ray starts from (in units of the tree) is the same
/// surface: the face itself, its coplanar neighbours, duplicates of it, and faces of another shell glued to it. It is
/// the resolution of a single precision file, several times over.
pub(super) const SAME_SURFACE: f64 = 4.8e-7;

/// A triangle mesh ready for ray shooting.
#[derive(Debug)]
pub struct RayMesh {
    pub(super) tree: Tree,
    /// Corners in units of the tree.
    pub(super) points: Vec<[f64; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Outward unit normals, zero for faces that are left out because they have no area.
    pub(super) normals: Vec<[f64; 3]>,
    /// Faces with the same corners in the same sense as an earlier one, and that one. Only the earlier one is in the
    /// tree: stacks of copies would make every ray meet all of them.
    pub(super) copies: Vec<[u32; 2]>,
    /// The faces around each vertex; empty unless made [`RayMesh::for_spheres`].
    pub(super) fans: Fans,
    /// The middle of the bounding box in the caller's coordinates.
    centre: [f64; 3],
    /// Units of the tree per unit of the caller, a power of two.
    scale: f64,
}

impl RayMesh {
    /// Prepares the triangles (corner indices into `positions`, counterclockwise seen from outside) for ray shooting.
    /// Triangles without area are left out: no ray hits them. Takes about 450 bytes a triangle, half of it while
    /// building.
    ///
    /// # Errors
    /// [`Error::Index`]-free input is the caller's duty: an index out of range is [`Error::Internal`]. [`Error::Budget`],
    /// [`Error::NoMemory`] and [`Error::Cancelled`] as everywhere.
    pub fn new(positions: &[[f64; 3]], triangles: &[[u32; 3]], job: &Job) -> Result<RayMesh> {
        RayMesh::begin(positions, triangles, job)?.turned(triangles, job)
    }

    /// Does as much of [`RayMesh::new`] as it can for faces whose orientation is not yet known.
    ///
    /// # Errors
    /// As there.
    pub fn begin<'a>(positions: &[[f64; 3]], triangles: &'a [[u32; 3]], job: &Job) -> Result<Unturned<'a>> {
        job.afford((triangles.len() as u64).saturating_mul(450), "the ray tree")?;
        if triangles.iter().flatten().any(|&v| v as usize >= positions.len()) || triangles.len() >= LEAF as usize {
            return Err(Error::Internal("ray tree: index out of range".into()));
        }
        let (centre, scale) = unit_frame(positions);
        let mut points = try_vec(positions.len(), "points of the ray tree")?;
        points.par_extend(positions.par_iter().map(|p| to_unit(*p, centre, scale)));
        let mut normals = try_vec(triangles.len(), "normals of the ray tree")?;
        let ((), copies) = rayon::join(
            || normals.par_extend(triangles.par_iter().map(|t| unit_normal(t.map(|v| points[v as usize])))),
            || find_copies(positions.len(), triangles),
        );
        job.check()?;
        let (tree, fans) = (Tree::default(), Fans::default());
        let mesh = RayMesh { tree, points, triangles: Vec::new(), normals, copies: copies?, fans, centre, scale };
        let twigs = Twigs::new(&mesh, triangles, job)?;
        Ok(Unturned { mesh, triangles, twigs })
    }

    /// Prepares for [`Tree::approach`] and questions about the surface around a place, which rays need not.
    ///
    /// # Errors
    /// [`Error::NoMemory`].
    pub(super) fn for_spheres(mut self) -> Result<RayMesh> {
        self.fans = Fans::new(&self.points, &self.triangles, &self.normals)?;
        self.tree.slabs = find_slabs(&self.tree, &self)?;
        Ok(self)
    }

    /// Gives faces that are copies of an earlier one that one's value.
    pub(super) fn fill_copies(&self, values: &mut [f64]) {
        for [face, original] in &self.copies {
            values[*face as usize] = values[*original as usize];
        }
    }

    /// Number of faces, those left out included.
    pub fn face_count(&self) -> usize {
        self.triangles.len()
    }

    /// A point of the caller in units of the tree.
    #[inline(always)]
    pub(super) fn to_unit(&self, p: [f64; 3]) -> [f64; 3] {
        to_unit(p, self.centre, self.scale)
    }

    /// A point of the tree in the caller's coordinates.
    #[inline(always)]
    pub(super) fn to_caller(&self, p: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|a| p[a] / self.scale + self.centre[a])
    }

    /// A length of the tree in units of the caller.
    #[inline(always)]
    pub(super) fn to_length(&self, t: f64) -> f64 {
        t / self.scale
    }

    /// Corners of a face in units of the tree.
    #[inline(always)]
    pub(super) fn corners(&self, face: u32) -> [[f64; 3]; 3] {
        self.triangles[face as usize].map(|v| self.points[v as usize])
    }

    /// The nearest triangle that the ray from `o` along the unit vector `d` meets at `tmin < t <= tmax`, other than
    /// `skip`. Of several at the same distance the one with the smallest id.
    #[inline(always)]
    pub(super) fn nearest_hit<L: Lanes>(
        &self,
        lanes: L,
        stack: &mut Stack,
        ray: ([f64; 3], [f64; 3]),
        range: (f64, f64),
        skip: u32,
    ) -> Option<Hit> {
        self.nearest_hit_from(self.tree.root(), lanes, stack, ray, range, skip)
    }

    /// The same among what is below the children of `roots`.
    #[inline(always)]
    pub(super) fn nearest_hit_from<L: Lanes>(
        &self,
        roots: &[Node],
        lanes: L,
        stack: &mut Stack,
        (o, d): ([f64; 3], [f64; 3]),
        (tmin, tmax): (f64, f64),
        skip: u32,
    ) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        self.tree.shoot(lanes, stack, roots, &Ray::new(o, d), (tmin, tmax), |hit| {
            let reach = best.map_or(tmax, |b| b.t);
            if hit.face != skip && best.is_none_or(|b| hit.t < b.t || (hit.t == b.t && hit.face < b.face)) {
                best = Some(hit);
                return hit.t;
            }
            reach
        });
        best
    }
}

/// What of a [`RayMesh`] is the same whichever sides of its faces are out.
pub struct Unturned<'a> {
    /// Without triangles and tree.
    mesh: RayMesh,
    /// The faces as they were.
    triangles: &'a [[u32; 3]],
    twigs: Twigs,
}

impl Unturned<'_> {
    /// The mesh, with these triangles: the same as before, some of them turned.
    ///
    /// # Errors
    /// As [`RayMesh::new`].
    pub fn turned(self, triangles: &[[u32; 3]], job: &Job) -> Result<RayMesh> {
        let Unturned { mut mesh, triangles: before, mut twigs } = self;
        mesh.triangles = try_vec(triangles.len(), "triangles of the ray tree")?;
        mesh.triangles.extend_from_slice(triangles);
        if triangles != before {
            for (normal, (now, before)) in mesh.normals.iter_mut().zip(triangles.iter().zip(before)) {
                if now != before {
                    *normal = unit_normal(now.map(|v| mesh.points[v as usize]));
                }
            }
            // Which faces are copies is a matter of sides.
            let copies = find_copies(mesh.points.len(), triangles)?;
            if copies != mesh.copies {
                mesh.copies = copies;
                twigs = Twigs::new(&mesh, triangles, job)?;
            }
        }
        job.check()?;
        mesh.tree = fold(&mesh, &twigs)?;
        Ok(mesh)
    }
}

/// The binary tree over the faces that rays can hit, but for copies of others.
pub(super) struct Twigs {
    /// None without faces.
    pub binary: Option<Bvh2>,
    /// The faces that it numbers.
    pub faces: Vec<u32>,
}

impl Twigs {
    fn new(mesh: &RayMesh, triangles: &[[u32; 3]], job: &Job) -> Result<Twigs> {
        let mut keep = try_filled(triangles.len(), true, "faces of the ray tree")?;
        mesh.copies.iter().for_each(|c| keep[c[0] as usize] = false);
        mesh.normals.iter().zip(&mut keep).for_each(|(n, keep)| *keep &= *n != [0.0; 3]);
        let kept = keep.iter().filter(|k| **k).count();
        let mut faces: Vec<u32> = try_vec(kept, "faces of the ray tree")?;
        if kept == 0 {
            return Ok(Twigs { binary: None, faces });
        }
        faces.extend((0..triangles.len() as u32).filter(|&f| keep[f as usize]));
        let mut boxes: Vec<Aabb> = try_vec(kept, "boxes of the ray tree")?;
        let corners = |f: u32| triangles[f as usize].map(|v| mesh.points[v as usize]);
        boxes.par_extend(faces.par_iter().map(|&f| padded_box(corners(f))));
        // obvhs allocates without asking: see first that there is room for what it will take.
        drop(try_vec::<[u8; 240]>(kept, "the binary ray tree")?);
        let binary = build_binary(&boxes);
        job.check()?;
        Ok(Twigs { binary: Some(binary), faces })
    }
}

/// Pairs of a face and an earlier one with the same corners in the same sense.
fn find_copies(vertex_count: usize, triangles: &[[u32; 3]]) -> Result<Vec<[u32; 2]>> {
    // The corner list begun at its smallest; copies then agree, and have the same first corner.
    let key = |f: u32| {
        let [a, b, c] = triangles[f as usize];
        if a <= b && a <= c {
            [a, b, c]
        } else if b <= a && b <= c {
            [b, c, a]
        } else {
            [c, a, b]
        }
    };
    let faces = 0..triangles.len() as u32;
    let mut start = try_filled(vertex_count + 1, 0u32, "copies of faces")?;
    faces.clone().for_each(|f| start[key(f)[0] as usize] += 1);
    let mut sum = 0;
    for s in &mut start {
        sum += *s;
        *s = sum;
    }
    let mut by_corner = try_filled(triangles.len(), 0u32, "copies of faces")?;
    for f in faces.rev() {
        let s = &mut start[key(f)[0] as usize];
        *s -= 1;
        by_corner[*s as usize] = f;
    }
    let mut copies = Vec::new();
    for v in 0..vertex_count {
        let group = &mut by_corner[start[v] as usize..start[v + 1] as usize];
        if group.len() > 1 {
            group.sort_unstable_by_key(|&f| (key(f), f));
            for run in group.chunk_by(|&f, &g| key(f) == key(g)).filter(|run| run.len() > 1) {
                copies.try_reserve(run.len()).map_err(|_| Error::NoMemory("out of memory: copies of faces".into()))?;
                copies.extend(run[1..].iter().map(|&f| [f, run[0]]));
            }
        }
    }
    Ok(copies)
}

/// Middle of the bounding box and the power of two that brings its longest side to 1/2..1.
fn unit_frame(positions: &[[f64; 3]]) -> ([f64; 3], f64) {
    let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for p in positions {
        for a in 0..3 {
            lo[a] = lo[a].min(p[a]);
            hi[a] = hi[a].max(p[a]);
        }
    }
    // Halved before subtracting, for coordinates near the largest double.
    let centre = std::array::from_fn(|a| lo[a] / 2.0 + hi[a] / 2.0);
    let longest = (0..3).map(|a| hi[a] / 2.0 - lo[a] / 2.0).fold(0.0, f64::max) * 2.0;
    if !(longest > 0.0 && longest.is_finite()) {
        return ([0.0; 3], 1.0);
    }
    (centre, 2f64.powi((-longest.log2().ceil()).clamp(-1000.0, 1000.0) as i32))
}

fn to_unit(p: [f64; 3], centre: [f64; 3], scale: f64) -> [f64; 3] {
    std::array::from_fn(|a| (p[a] - centre[a]) * scale)
}

/// The unit normal of a triangle, zero if it has no area.
pub(super) fn unit_normal([a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    let n = cross(sub(b, a), sub(c, a));
    let length = dot(n, n).sqrt();
    if length > 0.0 { n.map(|x| x / length) } else { [0.0; 3] }
}

#[inline(always)]
pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]
}

#[inline(always)]
pub(super) fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `a + s*b`.
#[inline(always)]
pub(super) fn along(a: [f64; 3], s: f64, b: [f64; 3]) -> [f64; 3] {
    [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]]
}

#[inline(always)]
pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn padded_box(corners: [[f64; 3]; 3]) -> Aabb {
    let bound = |a: usize, pick: fn(f64, f64) -> f64| pick(pick(corners[0][a], corners[1][a]), corners[2][a]) as f32;
    let lo: [f32; 3] = std::array::from_fn(|a| bound(a, f64::min) - PADDING);
    let hi: [f32; 3] = std::array::from_fn(|a| bound(a, f64::max) + PADDING);
    Aabb::new(lo.into(), hi.into())
}

fn build_binary(boxes: &[Aabb]) -> Bvh2 {
    let mut bvh = PlocBuilder::with_capacity(boxes.len()).build(
        PlocSearchDistance::Low,
        boxes,
        (0..boxes.len() as u32).collect(),
        SortPrecision::U64,
        2,
    );
    ReinsertionOptimizer::default().run(&mut bvh, 0.02, None);
    bvh
}
