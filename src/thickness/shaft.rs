//! The rays of one cone all start at the same place and end in the same sphere: what part of the tree they can meet is
//! found once for all of them.

use super::lanes::Lanes;
use super::tree::{Block, LEAF, NO_FACE, Node, Tree, lowest};

/// A cone with its apex on the surface, cut off by a sphere that touches the surface there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shaft {
    pub apex: [f64; 3],
    /// Unit vector into the solid.
    pub axis: [f64; 3],
    /// Cosine and sine of half the opening angle.
    pub cos: f64,
    pub sin: f64,
    /// Diameter of the sphere.
    pub diameter: f64,
    /// The face at the apex, which is not looked for.
    pub face: u32,
}

/// Children of the tree's nodes that together hold all that a shaft can meet, gathered eight by eight in nodes.
#[derive(Debug)]
pub(super) struct Front {
    nodes: [Node; FRONT],
    used: usize,
    lanes: usize,
}

/// Most nodes of a front.
const FRONT: usize = 8;

/// Spheres of this diameter, several times the mesh's, or more are as good as half-spaces.
const LARGE: f64 = 16.0;

/// More than what single precision does to places in the unit cube, and to distances between them.
pub(super) const ROUNDING: f32 = 2e-6;

impl Front {
    pub fn new() -> Front {
        Front { nodes: [Node::EMPTY; FRONT], used: 0, lanes: 0 }
    }

    /// Where rays begin instead of at the root.
    pub fn roots(&self) -> &[Node] {
        &self.nodes[..self.used]
    }

    fn push(&mut self, node: &Node, k: usize) {
        let (to, lane) = (&mut self.nodes[self.lanes / 8], self.lanes % 8);
        for (to, from) in to.bounds.iter_mut().zip(&node.bounds) {
            to[lane] = from[k];
        }
        to.child[lane] = node.child[k];
        self.lanes += 1;
    }

    /// Empties the lanes of the last node that hold nothing.
    fn close(&mut self) {
        self.used = self.lanes.div_ceil(8);
        for lane in self.lanes..8 * self.used {
            for (a, to) in self.nodes[lane / 8].bounds.iter_mut().enumerate() {
                to[lane % 8] = Node::EMPTY.bounds[a][0];
            }
        }
    }

    /// Gathers anew what is in `shaft`. Boxes that lie about the apex are opened, as nearly all rays pass them; those
    /// further away are left for the rays that meet them, and so is what does not fit.
    #[inline(always)]
    pub fn gather<L: Lanes>(&mut self, lanes: L, tree: &Tree, shaft: &Shaft) {
        self.lanes = 0;
        let single = Single::new(shaft);
        let Some(mut node) = tree.nodes.first() else { return self.close() };
        // Children to be opened. Each has a place in the front until it is.
        let (mut todo, mut left) = ([(node, 0); 8 * FRONT], 0);
        loop {
            let (mut met, about) = lanes.shaft(node, &single);
            while met != 0 {
                let k = lowest(&mut met);
                let child = node.child[k];
                if about >> k & 1 == 0 {
                    self.push(node, k);
                } else if child & LEAF == 0 {
                    todo[left] = (node, k);
                    left += 1;
                } else if shaft.meets(&tree.blocks[(child & !LEAF) as usize]) {
                    self.push(node, k);
                }
            }
            node = loop {
                let Some(last) = left.checked_sub(1) else {
                    return self.close();
                };
                left = last;
                let (node, k) = todo[left];
                if self.lanes + left + 8 <= 8 * FRONT {
                    break &tree.nodes[node.child[k] as usize];
                }
                self.push(node, k);
            };
        }
    }
}

/// A shaft in single precision.
#[derive(Debug, Clone, Copy)]
pub(super) struct Single {
    pub apex: [f32; 3],
    pub axis: [f32; 3],
    pub centre: [f32; 3],
    pub radius2: f32,
    pub cos: f32,
    pub sin: f32,
}

impl Single {
    fn new(shaft: &Shaft) -> Single {
        // Spheres that leave nothing out have no place in single precision.
        let radius = if shaft.diameter < LARGE { 0.5 * shaft.diameter } else { 0.0 };
        let centre: [f64; 3] = std::array::from_fn(|a| shaft.apex[a] + radius * shaft.axis[a]);
        Single {
            apex: shaft.apex.map(|x| x as f32),
            axis: shaft.axis.map(|x| x as f32),
            centre: centre.map(|x| x as f32),
            radius2: if radius > 0.0 { (radius as f32 * (1.0 + 1e-6) + ROUNDING).powi(2) } else { f32::INFINITY },
            cos: shaft.cos as f32,
            sin: shaft.sin as f32,
        }
    }
}

/// Boxes are about the apex if the square of the distance to their middle is at most this many times the square of half
/// their diagonal.
pub(super) const ABOUT: f32 = 1.0;

impl Shaft {
    /// Whether the cone may meet one of the triangles. It does not if a plane that touches the cone along a line on the
    /// side of a triangle has all its corners outside.
    #[inline(always)]
    pub fn meets(&self, block: &Block) -> bool {
        let mut away = [true; 4];
        let mut height = [[0.0f64; 4]; 3];
        let mut beside = [[[0.0f64; 4]; 3]; 3];
        let mut mean = [[0.0f64; 4]; 3];
        for v in 0..3 {
            for a in 0..3 {
                for k in 0..4 {
                    beside[v][a][k] = block.v[v][a][k] - self.apex[a];
                    height[v][k] += beside[v][a][k] * self.axis[a];
                }
            }
            for a in 0..3 {
                for k in 0..4 {
                    beside[v][a][k] -= height[v][k] * self.axis[a];
                    mean[a][k] += beside[v][a][k];
                }
            }
        }
        let mut length = [0.0f64; 4];
        for k in 0..4 {
            length[k] = (mean[0][k] * mean[0][k] + mean[1][k] * mean[1][k] + mean[2][k] * mean[2][k]).sqrt();
        }
        for v in 0..3 {
            for k in 0..4 {
                let side = beside[v][0][k] * mean[0][k] + beside[v][1][k] * mean[1][k] + beside[v][2][k] * mean[2][k];
                // Both sides times the length of the mean; corners at the height of the apex or below are outside.
                let out = height[v][k] * self.sin * length[k] - side * self.cos;
                away[k] &= out < 0.0;
            }
        }
        for k in 0..4 {
            away[k] |= block.face[k] == NO_FACE || block.face[k] == self.face;
        }
        away != [true; 4]
    }
}
