//! What is known of the triangles below each child of the tree besides its box: planes that they lie between, and a
//! cone that their normals lie in.

use super::bvh::{PADDING, RayMesh, along, cross, dot, sub};
use super::tree::{Block, LEAF, NO_FACE, Slab, Tree};
use crate::error::{Result, try_filled};
use rayon::prelude::*;

/// Cones are this much wider than the normals that they hold (as a chord of the unit sphere): more than the rounding of
/// what they are compared with.
const MARGIN: f64 = 1e-3;

/// What lies below one child of a node.
#[derive(Debug, Clone, Copy)]
struct Below {
    /// The blocks, which follow each other because the tree is laid out depth first: the first, and the last.
    blocks: (u32, u32),
    /// Normals times twice the areas, summed.
    normal: [f64; 3],
}

impl Below {
    const NOTHING: Below = Below { blocks: (u32::MAX, 0), normal: [0.0; 3] };

    fn block(blocks: &[Block], id: u32) -> Below {
        let block = &blocks[id as usize];
        let normal = (0..4).filter(|&k| block.face[k] != NO_FACE).fold([0.0; 3], |sum, k| {
            let [a, b, c] = block.corners(k);
            along(sum, 1.0, cross(sub(b, a), sub(c, a)))
        });
        Below { blocks: (id, id), normal }
    }

    fn and(self, other: Below) -> Below {
        let (a, b) = (self.blocks, other.blocks);
        Below { blocks: (a.0.min(b.0), a.1.max(b.1)), normal: along(self.normal, 1.0, other.normal) }
    }
}

/// Children of more blocks than this have no slab: they are seldom flat, and finding it takes a look at all blocks.
const SLAB_BLOCKS: u32 = 1024;

/// The slabs of all nodes.
pub(super) fn find_slabs(tree: &Tree, mesh: &RayMesh) -> Result<Vec<Slab>> {
    // Children come after their parents.
    let mut below = try_filled(tree.nodes.len(), Below::NOTHING, "slabs of the ray tree")?;
    let of = |below: &[Below], child: u32| match child {
        0 => Below::NOTHING, // nothing leads back to the root: this place is empty
        c if c & LEAF != 0 => Below::block(&tree.blocks, c & !LEAF),
        c => below[c as usize],
    };
    for at in (0..tree.nodes.len()).rev() {
        below[at] = tree.nodes[at].child.iter().fold(Below::NOTHING, |sum, &child| sum.and(of(&below, child)));
    }
    let mut slabs = try_filled(tree.nodes.len(), Slab::EMPTY, "slabs of the ray tree")?;
    slabs.par_iter_mut().zip(&tree.nodes).for_each(|(slab, node)| {
        for (k, &child) in node.child.iter().enumerate() {
            fill_slab(slab, k, (&tree.blocks, mesh), of(&below, child));
        }
    });
    Ok(slabs)
}

fn fill_slab(slab: &mut Slab, k: usize, (blocks, mesh): (&[Block], &RayMesh), below: Below) {
    let length = dot(below.normal, below.normal).sqrt();
    let few = below.blocks.0 <= below.blocks.1 && below.blocks.1 - below.blocks.0 < SLAB_BLOCKS;
    if !few || !(length > 1e-30) {
        return;
    }
    // As it is used: in single precision, and so not quite of unit length.
    let axis = below.normal.map(|x| (x / length) as f32);
    let n = axis.map(|x| x as f64);
    let (mut lo, mut hi, mut spread) = (f64::INFINITY, f64::NEG_INFINITY, 0.0f64);
    for block in &blocks[below.blocks.0 as usize..=below.blocks.1 as usize] {
        for lane in (0..4).filter(|&lane| block.face[lane] != NO_FACE) {
            for corner in block.corners(lane) {
                let h = dot(n, corner);
                (lo, hi) = (lo.min(h), hi.max(h));
            }
            spread = spread.max(mesh.spread_about(block.face[lane], n));
        }
    }
    (0..3).for_each(|a| slab.axis[a][k] = axis[a]);
    (slab.lo[k], slab.hi[k]) = (lo as f32 - 1.5 * PADDING, hi as f32 + 1.5 * PADDING);
    if let Some((sin, cos)) = cone(spread) {
        (slab.sin[k], slab.cos[k]) = (sin, cos);
    }
}

/// Sine and cosine of half the angle of the cone of directions that end within `chord` of its axis, which is of unit
/// length; none if that is more than a half space.
fn cone(chord: f64) -> Option<(f32, f32)> {
    let chord = chord + MARGIN;
    let cos = 1.0 - chord * chord / 2.0;
    (cos > 0.0).then(|| ((1.0 - cos * cos).sqrt() as f32, cos as f32))
}
