//! The eight-wide tree that rays walk: boxes in single precision, padded outward, and triangles in double precision.

use super::lanes::{Lanes, Ray, Shear};

/// Eight child boxes side by side.
#[derive(Debug, Clone, Copy)]
#[repr(align(32))]
pub(super) struct Node {
    /// Lower x, y, z and upper x, y, z of each child.
    pub bounds: [[f32; 8]; 6],
    /// Index of the child in the tree's nodes, or of a block with [`LEAF`] set.
    pub child: [u32; 8],
}

/// Marks a child that is a block of triangles.
pub(super) const LEAF: u32 = 1 << 31;

impl Node {
    /// A node whose boxes no ray enters.
    pub const EMPTY: Node = {
        let (lo, hi) = ([1e30; 8], [-1e30; 8]);
        Node { bounds: [lo, lo, lo, hi, hi, hi], child: [0; 8] }
    };
}

/// For each child of a node two parallel planes, square to the mean normal of its triangles, that these lie between.
/// Seen from inside a round or slanted surface, they tell much more than a box how far it is away. About the same axis
/// the cone of directions in which something can have its nearest place in the child: towards what is elsewhere, the
/// surface there only leads on to nearer places.
#[derive(Debug, Clone, Copy)]
#[repr(align(32))]
pub(super) struct Slab {
    /// Unit normals by axis and child.
    pub axis: [[f32; 8]; 3],
    /// Heights of the planes.
    pub lo: [f32; 8],
    pub hi: [f32; 8],
    /// Sine and cosine of half the angle of the cone.
    pub sin: [f32; 8],
    pub cos: [f32; 8],
}

impl Slab {
    /// Leaves nothing out.
    pub const EMPTY: Slab = {
        let none = [0.0; 8];
        Slab { axis: [[1.0; 8], none, none], lo: [-1e30; 8], hi: [1e30; 8], sin: [1.0; 8], cos: none }
    };

    /// The children, in boxes with the bounds of `node`, in which the surface may come nearest to `p` somewhere: those
    /// which the double cone about the axis, with its apex at `p`, meets.
    #[inline(always)]
    pub fn facing(&self, node: &Node, p: [f32; 3]) -> u32 {
        let (mut height, mut way2, mut size2) = ([0.0f32; 8], [0.0f32; 8], [0.0f32; 8]);
        for a in 0..3 {
            for k in 0..8 {
                let (lo, hi) = (node.bounds[a][k], node.bounds[a + 3][k]);
                let (way, half) = (p[a] - 0.5 * (lo + hi), 0.5 * (hi - lo));
                height[k] += self.axis[a][k] * way;
                way2[k] += way * way;
                size2[k] += half * half;
            }
        }
        let mut out = 0;
        for k in 0..8 {
            let beside2 = way2[k] - height[k] * height[k];
            let beside = if beside2 > 0.0 { beside2.sqrt() } else { 0.0 };
            let outside = beside * self.cos[k] - height[k].abs() * self.sin[k] - ROUNDING;
            out |= (((outside <= 0.0) | (outside * outside <= size2[k])) as u32) << k;
        }
        out
    }

    /// Signed distances of `p` from what is between the planes, positive where `p` is above.
    #[inline(always)]
    pub fn gaps(&self, p: [f32; 3]) -> [f32; 8] {
        let mut gaps = [0.0; 8];
        for k in 0..8 {
            let h = self.axis[0][k] * p[0] + self.axis[1][k] * p[1] + self.axis[2][k] * p[2];
            let (above, below) = (h - self.hi[k], h - self.lo[k]);
            let above = if above > 0.0 { above } else { 0.0 };
            gaps[k] = if below < 0.0 { below } else { above };
        }
        gaps
    }
}

/// More than what single precision does to places.
const ROUNDING: f32 = 2e-6;

/// Four triangles side by side.
#[derive(Debug, Clone, Copy)]
#[repr(align(32))]
pub(super) struct Block {
    /// Coordinates by corner, axis and lane.
    pub v: [[[f64; 4]; 3]; 3],
    /// Outward unit normals by axis and lane.
    pub normal: [[f64; 4]; 3],
    /// Face ids, [`NO_FACE`] in lanes that hold no triangle.
    pub face: [u32; 4],
}

/// Looks at blocks. A trait and not a closure, which would not be compiled for the instruction set at hand.
pub(super) trait Visitor {
    fn visit(&mut self, block: &Block) -> ([f64; 3], f64);

    /// Of the children in `mask`, those in which there may be something to see.
    #[inline(always)]
    fn worth(&mut self, _node: &Node, _slab: &Slab, mask: u32) -> u32 {
        mask
    }
}

/// Stands for no face.
pub(super) const NO_FACE: u32 = u32::MAX;

impl Block {
    /// A block that no ray hits.
    pub const EMPTY: Block = {
        // Lanes without a triangle lie beyond everything, for those who ask for heights.
        let far = [1e9; 4];
        let normal = [[1.0; 4], [0.0; 4], [0.0; 4]];
        let v = [[far, [0.0; 4], [0.0; 4]]; 3];
        Block { v, normal, face: [NO_FACE; 4] }
    };

    /// Signed distances of `p` from the planes of the triangles, positive outside.
    #[inline(always)]
    pub fn heights(&self, p: [f64; 3]) -> [f64; 4] {
        let mut h = [0.0; 4];
        for a in 0..3 {
            for k in 0..4 {
                h[k] += (p[a] - self.v[0][a][k]) * self.normal[a][k];
            }
        }
        h
    }

    /// Squared distances of `p` from the triangles.
    #[inline(always)]
    pub fn distances2(&self, p: [f64; 3], heights: &[f64; 4]) -> [f64; 4] {
        let mut d2 = [f64::INFINITY; 4];
        let mut inside = [f64::INFINITY; 4];
        for v in 0..3 {
            let (from, to) = (&self.v[v], &self.v[(v + 1) % 3]);
            let mut e = [[0.0; 4]; 3];
            let mut w = [[0.0; 4]; 3];
            for a in 0..3 {
                for k in 0..4 {
                    e[a][k] = to[a][k] - from[a][k];
                    w[a][k] = p[a] - from[a][k];
                }
            }
            for k in 0..4 {
                let n = [self.normal[0][k], self.normal[1][k], self.normal[2][k]];
                let side = (e[1][k] * w[2][k] - e[2][k] * w[1][k]) * n[0]
                    + (e[2][k] * w[0][k] - e[0][k] * w[2][k]) * n[1]
                    + (e[0][k] * w[1][k] - e[1][k] * w[0][k]) * n[2];
                inside[k] = if side < inside[k] { side } else { inside[k] };
                let s = (e[0][k] * w[0][k] + e[1][k] * w[1][k] + e[2][k] * w[2][k])
                    / (e[0][k] * e[0][k] + e[1][k] * e[1][k] + e[2][k] * e[2][k]);
                let s = if s > 0.0 { s } else { 0.0 };
                let s = if s < 1.0 { s } else { 1.0 };
                let q = [w[0][k] - s * e[0][k], w[1][k] - s * e[1][k], w[2][k] - s * e[2][k]];
                let edge = q[0] * q[0] + q[1] * q[1] + q[2] * q[2];
                d2[k] = if edge < d2[k] { edge } else { d2[k] };
            }
        }
        for k in 0..4 {
            d2[k] = if inside[k] >= 0.0 { heights[k] * heights[k] } else { d2[k] };
        }
        d2
    }

    /// Corners of the triangle in lane `k`.
    #[inline(always)]
    pub fn corners(&self, k: usize) -> [[f64; 3]; 3] {
        let v = &self.v;
        [
            [v[0][0][k], v[0][1][k], v[0][2][k]],
            [v[1][0][k], v[1][1][k], v[1][2][k]],
            [v[2][0][k], v[2][1][k], v[2][2][k]],
        ]
    }
}

/// One triangle met by a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hit {
    /// Distance from the origin, in units of the tree.
    pub t: f64,
    /// Face id.
    pub face: u32,
    /// True where the ray leaves the solid (the face's outward side faces away from the origin).
    pub exit: bool,
}

/// Nodes and blocks still to visit, with the distance at which each begins; kept between rays to spare allocations.
pub(super) type Stack = Vec<(f32, u32)>;

/// A tree over triangles. Node 0 is the root.
#[derive(Debug, Default)]
pub(super) struct Tree {
    pub nodes: Vec<Node>,
    /// One for each node, or none where only rays are shot.
    pub slabs: Vec<Slab>,
    pub blocks: Vec<Block>,
}

/// A distance as the smallest single above it, so that comparing in single precision never loses a hit.
#[inline(always)]
pub(super) fn up(t: f64) -> f32 {
    (t * (1.0 + 1e-6)) as f32
}

impl Tree {
    /// The root, where rays begin.
    #[inline(always)]
    pub fn root(&self) -> &[Node] {
        &self.nodes[..self.nodes.len().min(1)]
    }

    /// Calls `visit` for triangles that the ray meets at `tmin < t <= tmax` in or below the children of `roots`, in no
    /// particular order; `visit` returns the new `tmax`, beyond which the caller needs no more.
    #[inline(always)]
    pub fn shoot<L: Lanes>(
        &self,
        lanes: L,
        stack: &mut Stack,
        roots: &[Node],
        ray: &Ray,
        (tmin, mut tmax): (f64, f64),
        mut visit: impl FnMut(Hit) -> f64,
    ) {
        stack.clear();
        let slopes = lanes.slopes(ray);
        // Many rays meet no block.
        let mut shear = None;
        let mut tmax32 = up(tmax);
        let mut enter = [0.0f32; 8];
        for roots in roots.chunks(8) {
            // All masks first, then what is in them: one loop whose end cannot be foretold instead of eight.
            let (mut begins, mut all) = ([[0.0f32; 8]; 8], 0u64);
            for (g, node) in roots.iter().enumerate() {
                all |= (lanes.boxes(node, &slopes, tmax32, &mut begins[g]) as u64) << (8 * g);
            }
            while all != 0 {
                let bit = all.trailing_zeros() as usize;
                all &= all - 1;
                stack.push((begins[bit / 8][bit % 8], roots[bit / 8].child[bit % 8]));
            }
        }
        let Some((_, mut at)) = stack.pop() else { return };
        loop {
            if at & LEAF == 0 {
                let Some(node) = self.nodes.get(at as usize) else { return };
                let mut mask = lanes.boxes(node, &slopes, tmax32, &mut enter);
                // mostly one or two: straight on into the nearer
                let base = stack.len();
                if mask != 0 {
                    let k = lowest(&mut mask);
                    if mask == 0 {
                        at = node.child[k];
                        continue;
                    }
                    let j = lowest(&mut mask);
                    let (near, far) = if enter[k] <= enter[j] { (k, j) } else { (j, k) };
                    stack.push((enter[far], node.child[far]));
                    if mask == 0 {
                        at = node.child[near];
                        continue;
                    }
                    stack.push((enter[near], node.child[near]));
                }
                while mask != 0 {
                    let k = lowest(&mut mask);
                    stack.push((enter[k], node.child[k]));
                }
                sort_new(stack, base);
            } else {
                let Some(block) = self.blocks.get((at & !LEAF) as usize) else { return };
                let sheared = match shear {
                    Some(sheared) => sheared,
                    None => *shear.insert(Shear::new(ray)),
                };
                let found = lanes.triangles(block, &sheared, tmin, tmax);
                let mut mask = found.hit;
                while mask != 0 {
                    let k = (mask.trailing_zeros() & 3) as usize;
                    mask &= mask - 1;
                    if block.face[k] != NO_FACE && found.t[k] <= tmax {
                        tmax = visit(Hit { t: found.t[k], face: block.face[k], exit: found.exit >> k & 1 == 1 });
                        tmax32 = up(tmax);
                    }
                }
            }
            at = loop {
                match stack.pop() {
                    Some((t, child)) if t <= tmax32 => break child,
                    Some(_) => {}
                    None => return,
                }
            };
        }
    }

    /// Shows `visitor` the blocks within `reach` of `from` (of a tree with slabs), the nearer ones first. It returns what centre and reach are
    /// from then on; the reach only shrinks, and where it is 0 nothing more is visited.
    #[inline(always)]
    pub fn approach<L: Lanes>(
        &self,
        lanes: L,
        stack: &mut Stack,
        from: [f64; 3],
        mut reach: f64,
        visitor: &mut impl Visitor,
    ) {
        stack.clear();
        let (mut c, mut d2) = (from, [0.0f32; 8]);
        let mut at = 0u32;
        loop {
            let limit = up(reach * reach);
            if at & LEAF == 0 {
                let (Some(node), Some(slab)) = (self.nodes.get(at as usize), self.slabs.get(at as usize)) else {
                    return;
                };
                let c32 = c.map(|x| x as f32);
                let mut mask = lanes.distances(node, c32, limit, &mut d2);
                let gaps = slab.gaps(c32);
                let mut near = 0;
                for k in 0..8 {
                    let gap2 = gaps[k] * gaps[k];
                    d2[k] = if gap2 > d2[k] { gap2 } else { d2[k] };
                    near |= ((gap2 < limit) as u32) << k;
                }
                mask &= near;
                mask = visitor.worth(node, slab, mask);
                let base = stack.len();
                while mask != 0 {
                    let k = (mask.trailing_zeros() & 7) as usize;
                    mask &= mask - 1;
                    stack.push((d2[k], node.child[k]));
                }
                sort_new(stack, base);
            } else {
                let Some(block) = self.blocks.get((at & !LEAF) as usize) else { return };
                (c, reach) = visitor.visit(block);
                if reach <= 0.0 {
                    return;
                }
            }
            // Distances on the stack are from where the centre was.
            let limit = if c == from { up(reach * reach) } else { f32::INFINITY };
            at = loop {
                match stack.pop() {
                    Some((d2, child)) if d2 <= limit => break child,
                    Some(_) => {}
                    None => return,
                }
            };
        }
    }
}

/// Takes the lowest bit out of a mask of eight, which is not empty; its number.
#[inline(always)]
pub(super) fn lowest(mask: &mut u32) -> usize {
    let k = (mask.trailing_zeros() & 7) as usize;
    *mask &= mask.wrapping_sub(1);
    k
}

/// Sorts the entries from `base` on so that the nearest is popped first.
#[inline(always)]
pub(super) fn sort_new(stack: &mut Stack, base: usize) {
    let new = &mut stack[base..];
    for i in 1..new.len() {
        let mut j = i;
        while j > 0 && new[j - 1].0 < new[j].0 {
            new.swap(j - 1, j);
            j -= 1;
        }
    }
}

/// Faces in the order of the tree, for work that profits from neighbours following each other.
pub(super) fn faces_of(block: &Block) -> impl Iterator<Item = u32> + '_ {
    block.face.iter().copied().filter(|&f| f != NO_FACE)
}
