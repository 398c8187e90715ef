//! Folds the binary tree into eight-wide nodes and blocks of four triangles: by dynamic programming over what it costs
//! to have the triangles below a binary node as 1, 2, .. 7 children of a wide one (Ylitie, Karras & Laine 2017,
//! "Efficient incoherent ray traversal on GPUs through compressed wide BVHs").

use super::bvh::{RayMesh, Twigs};
use super::tree::{Block, LEAF, NO_FACE, Node, Tree};
use crate::error::{Error, Result, try_vec};
use obvhs::bvh2::Bvh2;
use rayon::prelude::*;

/// A node of the binary tree. They are kept level by level from the root down, the two children of one side by side,
/// so that the nodes of a level can be worked on at once when those of the next are known.
#[derive(Debug, Clone, Copy)]
struct Twig {
    /// Its number in the binary tree.
    node: u32,
    /// Place of its first child, 0 for a leaf: the root is no one's child.
    first: u32,
    /// Triangles below it.
    count: u32,
    /// Half the area of its box.
    area: f32,
    /// Least cost of its triangles as 1, 2, .. 7 children of a wide node.
    cost: [f32; 7],
}

/// What testing a block costs, in tests of a node.
const BLOCK_COST: f32 = 1.0;

impl Twig {
    fn block_cost(&self) -> f32 {
        self.area * BLOCK_COST
    }

    /// Whether its triangles are cheapest as one block.
    fn is_block(&self) -> bool {
        self.first == 0 || (self.count <= 4 && self.cost[0] == self.block_cost())
    }

    /// Fills in what follows from the children: the costs as a block, as a wide node of its own, or as several children
    /// of the wide node above.
    fn weigh(&mut self, binary: &Bvh2, children: Option<[&Twig; 2]>) {
        let node = &binary.nodes[self.node as usize];
        self.area = node.aabb().half_area();
        let block = self.block_cost();
        let Some(children) = children else {
            (self.count, self.cost) = (node.prim_count, [block; 7]);
            return;
        };
        self.count = children[0].count + children[1].count;
        self.cost = [split(children, 8).0 + self.area; 7];
        if self.count <= 4 {
            self.cost[0] = self.cost[0].min(block);
        }
        for i in 1..7 {
            self.cost[i] = self.cost[i - 1].min(split(children, i + 1).0);
        }
    }
}

/// Cheapest way to share `budget` children of a wide node between two binary nodes: what it costs, and how many the
/// first gets.
fn split([l, r]: [&Twig; 2], budget: usize) -> (f32, usize) {
    let mut best = (f32::INFINITY, 1);
    for k in 1..budget {
        let both = l.cost[k - 1] + r.cost[budget - k - 1];
        if both < best.0 {
            best = (both, k);
        }
    }
    best
}

/// Twigs in one piece of parallel work; levels with fewer are done at once.
const PIECE: usize = 2048;

/// All nodes of the binary tree with their costs.
fn twigs_of(binary: &Bvh2) -> Result<Vec<Twig>> {
    let twig = |node| Twig { node, first: 0, count: 0, area: 0.0, cost: [0.0; 7] };
    let mut twigs: Vec<Twig> = try_vec(binary.nodes.len(), "order of the ray tree")?;
    // A binary tree of u32 nodes as obvhs builds it is some tens of levels deep.
    let mut levels: Vec<usize> = try_vec(64, "order of the ray tree")?;
    twigs.push(twig(0));
    let mut next = 0;
    while next < twigs.len() {
        levels.try_reserve(1).map_err(|_| Error::NoMemory("out of memory: order of the ray tree".into()))?;
        levels.push(next);
        let level = next..twigs.len();
        next = level.end;
        for at in level {
            let node = &binary.nodes[twigs[at].node as usize];
            if !node.is_leaf() {
                twigs[at].first = twigs.len() as u32;
                twigs.extend([twig(node.first_index), twig(node.first_index + 1)]);
            }
        }
    }
    let mut end = twigs.len();
    for &start in levels.iter().rev() {
        let (above, below) = twigs[..].split_at_mut(end);
        above[start..].par_chunks_mut(PIECE).for_each(|level| {
            for t in level {
                let first = (t.first as usize).wrapping_sub(end);
                t.weigh(binary, below.get(first..).and_then(|pair| pair.first_chunk()).map(|[l, r]| [l, r]));
            }
        });
        end = start;
    }
    Ok(twigs)
}

/// The eight-wide tree of faces of `mesh`, over whose boxes the binary one was built. It is laid out depth first, so
/// that blocks that follow each other are near each other.
pub(super) fn fold(mesh: &RayMesh, Twigs { binary, faces }: &Twigs) -> Result<Tree> {
    let Some(binary) = binary else { return Ok(Tree::default()) };
    let no_room = |_| Error::NoMemory("out of memory: the ray tree".into());
    let twigs = twigs_of(binary)?;
    let mut nodes: Vec<Node> = try_vec(faces.len() / 8 + 8, "nodes of the ray tree")?;
    let mut roots: Vec<u32> = try_vec(faces.len() / 2 + 8, "blocks of the ray tree")?;
    nodes.push(Node::EMPTY);
    let mut todo = vec![(0u32, 0usize)];
    while let Some((root, at)) = todo.pop() {
        let (mut children, mut n) = ([root; 8], 0);
        open(&twigs, root, 8, &mut children, &mut n);
        nodes.try_reserve(8).map_err(no_room)?;
        roots.try_reserve(8).map_err(no_room)?;
        let base = todo.len();
        for (k, &child) in children[..n].iter().enumerate() {
            let twig = &twigs[child as usize];
            let id = if twig.is_block() {
                roots.push(twig.node);
                (roots.len() - 1) as u32 | LEAF
            } else {
                nodes.push(Node::EMPTY);
                todo.push((child, nodes.len() - 1));
                (nodes.len() - 1) as u32
            };
            set_child(&mut nodes[at], k, binary, (twig.node, id));
        }
        todo[base..].reverse();
    }
    drop(twigs);
    let mut blocks: Vec<Block> = try_vec(roots.len(), "blocks of the ray tree")?;
    blocks.par_extend(roots.par_iter().map(|&root| block_of(mesh, binary, faces, root)));
    Ok(Tree { nodes, blocks, slabs: Vec::new() })
}

fn set_child(node: &mut Node, k: usize, binary: &Bvh2, (child, id): (u32, u32)) {
    let b = binary.nodes[child as usize].aabb();
    let (lo, hi) = (b.min.to_array(), b.max.to_array());
    for a in 0..3 {
        node.bounds[a][k] = lo[a];
        node.bounds[a + 3][k] = hi[a];
    }
    node.child[k] = id;
}

/// Appends the at most `budget` descendants of `at` that are its cheapest cover.
fn open(twigs: &[Twig], at: u32, budget: usize, children: &mut [u32; 8], n: &mut usize) {
    let twig = &twigs[at as usize];
    let cost = &twig.cost;
    if twig.first == 0 || budget == 1 || (budget < 8 && cost[budget - 1] == cost[0]) {
        children[*n] = at;
        *n += 1;
        return;
    }
    let mut budget = budget;
    while budget < 8 && budget > 2 && cost[budget - 1] == cost[budget - 2] {
        budget -= 1;
    }
    let first = twig.first;
    let (_, k) = split([&twigs[first as usize], &twigs[first as usize + 1]], budget);
    open(twigs, first, k, children, n);
    open(twigs, first + 1, budget - k, children, n);
}

/// The block of the triangles below a binary node.
fn block_of(mesh: &RayMesh, binary: &Bvh2, faces: &[u32], root: u32) -> Block {
    let mut block = Block::EMPTY;
    let mut lane = 0;
    let mut todo = [root; 8];
    let mut left = 1;
    while left > 0 && lane < 4 {
        left -= 1;
        let node = &binary.nodes[todo[left] as usize];
        if !node.is_leaf() {
            todo[left] = node.first_index + 1;
            todo[left + 1] = node.first_index;
            left += 2;
            continue;
        }
        for p in node.first_index..node.first_index + node.prim_count {
            let face = faces[binary.primitive_indices[p as usize] as usize];
            block.face[lane] = face;
            for a in 0..3 {
                block.normal[a][lane] = mesh.normals[face as usize][a];
            }
            for (v, corner) in mesh.corners(face).iter().enumerate() {
                for a in 0..3 {
                    block.v[v][a][lane] = corner[a];
                }
            }
            lane += 1;
        }
    }
    debug_assert!(block.face[0] != NO_FACE);
    block
}
