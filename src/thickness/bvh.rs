//! The mesh as rays see it: centred and scaled to unit size, in an eight-wide tree. This is the only file that knows
//! `obvhs`, which builds the binary tree that is folded into ours.

use super::fans::Fans;
use super::lanes::{Lanes, Ray};
use super::slabs::find_slabs;
use super::tree::{Block, Hit, LEAF, Node, Stack, Tree};
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
        job.afford((triangles.len() as u64).saturating_mul(450), "the ray tree")?;
        if triangles.iter().flatten().any(|&v| v as usize >= positions.len()) || triangles.len() >= LEAF as usize {
            return Err(Error::Internal("ray tree: index out of range".into()));
        }
        let (centre, scale) = unit_frame(positions);
        let mut points = try_vec(positions.len(), "points of the ray tree")?;
        points.extend(positions.iter().map(|p| to_unit(*p, centre, scale)));
        let mut copy = try_vec(triangles.len(), "triangles of the ray tree")?;
        copy.extend_from_slice(triangles);
        let mut normals = try_vec(triangles.len(), "normals of the ray tree")?;
        normals.extend(triangles.iter().map(|t| unit_normal(t.map(|v| points[v as usize]))));
        job.check()?;
        let copies = find_copies(positions.len(), triangles)?;
        let (tree, fans) = (Tree::default(), Fans::default());
        let mut mesh = RayMesh { tree, points, triangles: copy, normals, copies, fans, centre, scale };
        mesh.tree = mesh.build_tree(job)?;
        Ok(mesh)
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

    fn build_tree(&self, job: &Job) -> Result<Tree> {
        let mut keep = try_filled(self.face_count(), true, "faces of the ray tree")?;
        self.copies.iter().for_each(|c| keep[c[0] as usize] = false);
        self.normals.iter().zip(&mut keep).for_each(|(n, keep)| *keep &= *n != [0.0; 3]);
        let kept = keep.iter().filter(|k| **k).count();
        if kept == 0 {
            return Ok(Tree::default());
        }
        let mut faces: Vec<u32> = try_vec(kept, "faces of the ray tree")?;
        faces.extend((0..self.face_count() as u32).filter(|&f| keep[f as usize]));
        let mut boxes = try_filled(kept, Aabb::INVALID, "boxes of the ray tree")?;
        boxes.par_iter_mut().zip(&faces).for_each(|(b, &f)| *b = padded_box(self.corners(f)));
        // obvhs allocates without asking: see first that there is room for what it will take.
        drop(try_vec::<[u8; 240]>(kept, "the binary ray tree")?);
        let binary = build_binary(&boxes);
        job.check()?;
        Folder::new(self, &binary, &faces)?.fold()
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

/// Folds the binary tree into eight-wide nodes and blocks of four triangles.
struct Folder<'a> {
    mesh: &'a RayMesh,
    binary: &'a Bvh2,
    faces: &'a [u32],
    /// Number of triangles below each binary node.
    count: Vec<u32>,
    /// Least cost of the triangles below each binary node as 1, 2, .. 7 children of one wide node.
    cost: Vec<[f32; 7]>,
    out: Tree,
}

/// What testing a block costs, in tests of a node.
const BLOCK_COST: f32 = 1.0;

fn block_cost(binary: &Bvh2, at: u32) -> f32 {
    binary.nodes[at as usize].aabb().half_area() * BLOCK_COST
}

/// Cheapest way to share `budget` children of a wide node between the binary nodes `first` and the next one: what it
/// costs, and how many the first gets.
fn split(cost: &[[f32; 7]], first: u32, budget: usize) -> (f32, usize) {
    let (l, r) = (&cost[first as usize], &cost[first as usize + 1]);
    let mut best = (f32::INFINITY, 1);
    for k in 1..budget {
        let both = l[k - 1] + r[budget - k - 1];
        if both < best.0 {
            best = (both, k);
        }
    }
    best
}

/// The costs of a binary node from those of its children (Ylitie, Karras & Laine 2017): as a block, as a wide node of
/// its own, or as several children of the wide node above.
fn costs(binary: &Bvh2, count: &[u32], cost: &[[f32; 7]], at: u32) -> [f32; 7] {
    let node = &binary.nodes[at as usize];
    let block = block_cost(binary, at);
    if node.is_leaf() {
        return [block; 7];
    }
    let own = split(cost, node.first_index, 8).0 + node.aabb().half_area();
    let mut out = [own; 7];
    if count[at as usize] <= 4 {
        out[0] = out[0].min(block);
    }
    for i in 1..7 {
        out[i] = out[i - 1].min(split(cost, node.first_index, i + 1).0);
    }
    out
}

impl<'a> Folder<'a> {
    fn new(mesh: &'a RayMesh, binary: &'a Bvh2, faces: &'a [u32]) -> Result<Self> {
        let n = binary.nodes.len();
        // Children may come before their parents: count along an explicit walk, parents first, then add up backwards.
        let mut walk: Vec<u32> = try_vec(n, "order of the ray tree")?;
        walk.push(0);
        let mut next = 0;
        while let Some(&at) = walk.get(next) {
            let node = &binary.nodes[at as usize];
            if !node.is_leaf() {
                walk.extend([node.first_index, node.first_index + 1]);
            }
            next += 1;
        }
        let mut count = try_filled(n, 0u32, "counts of the ray tree")?;
        for &at in walk.iter().rev() {
            let node = &binary.nodes[at as usize];
            let first = node.first_index as usize;
            count[at as usize] = if node.is_leaf() { node.prim_count } else { count[first] + count[first + 1] };
        }
        let mut cost = try_filled(n, [0.0; 7], "costs of the ray tree")?;
        for &at in walk.iter().rev() {
            cost[at as usize] = costs(binary, &count, &cost, at);
        }
        let out = Tree {
            nodes: try_vec(faces.len() / 8 + 8, "nodes of the ray tree")?,
            blocks: try_vec(faces.len() / 2 + 8, "blocks of the ray tree")?,
            slabs: Vec::new(),
        };
        Ok(Folder { mesh, binary, faces, count, cost, out })
    }

    /// The walk is depth first, so that blocks that follow each other are near each other.
    fn fold(mut self) -> Result<Tree> {
        let no_room = |_| Error::NoMemory("out of memory: the ray tree".into());
        self.out.nodes.push(Node::EMPTY);
        let mut todo = vec![(0u32, 0usize)];
        while let Some((root, at)) = todo.pop() {
            let (mut children, mut n) = ([root; 8], 0);
            self.open(root, 8, &mut children, &mut n);
            self.out.nodes.try_reserve(8).map_err(no_room)?;
            self.out.blocks.try_reserve(8).map_err(no_room)?;
            let base = todo.len();
            for (k, &child) in children[..n].iter().enumerate() {
                let (lo, hi) = {
                    let b = &self.binary.nodes[child as usize].aabb();
                    (b.min.to_array(), b.max.to_array())
                };
                let id = if self.is_block(child) {
                    self.fill_block(child);
                    (self.out.blocks.len() - 1) as u32 | LEAF
                } else {
                    self.out.nodes.push(Node::EMPTY);
                    todo.push((child, self.out.nodes.len() - 1));
                    (self.out.nodes.len() - 1) as u32
                };
                let node = &mut self.out.nodes[at];
                for a in 0..3 {
                    node.bounds[a][k] = lo[a];
                    node.bounds[a + 3][k] = hi[a];
                }
                node.child[k] = id;
            }
            todo[base..].reverse();
        }
        Ok(self.out)
    }

    /// Appends the at most `budget` descendants of `at` that are its cheapest cover.
    fn open(&self, at: u32, budget: usize, children: &mut [u32; 8], n: &mut usize) {
        let node = &self.binary.nodes[at as usize];
        let cost = &self.cost[at as usize];
        if node.is_leaf() || budget == 1 || (budget < 8 && cost[budget - 1] == cost[0]) {
            children[*n] = at;
            *n += 1;
            return;
        }
        let mut budget = budget;
        while budget < 8 && budget > 2 && cost[budget - 1] == cost[budget - 2] {
            budget -= 1;
        }
        let first = node.first_index;
        let (_, k) = split(&self.cost, first, budget);
        self.open(first, k, children, n);
        self.open(first + 1, budget - k, children, n);
    }

    /// Whether the triangles below `at` are cheapest as one block.
    fn is_block(&self, at: u32) -> bool {
        let i = at as usize;
        self.binary.nodes[i].is_leaf() || (self.count[i] <= 4 && self.cost[i][0] == block_cost(self.binary, at))
    }

    fn fill_block(&mut self, root: u32) {
        let mut block = Block::EMPTY;
        let mut lane = 0;
        let mut todo = [root; 8];
        let mut left = 1;
        while left > 0 && lane < 4 {
            left -= 1;
            let node = &self.binary.nodes[todo[left] as usize];
            if !node.is_leaf() {
                todo[left] = node.first_index + 1;
                todo[left + 1] = node.first_index;
                left += 2;
                continue;
            }
            for p in node.first_index..node.first_index + node.prim_count {
                let face = self.faces[self.binary.primitive_indices[p as usize] as usize];
                block.face[lane] = face;
                for a in 0..3 {
                    block.normal[a][lane] = self.mesh.normals[face as usize][a];
                }
                for (v, corner) in self.mesh.corners(face).iter().enumerate() {
                    for a in 0..3 {
                        block.v[v][a][lane] = corner[a];
                    }
                }
                lane += 1;
            }
        }
        self.out.blocks.push(block);
    }
}
