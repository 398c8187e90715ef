//! The point of the surface nearest to a given one, and what lies in a box.

use super::bvh::{RayMesh, along, dot, sub};
use super::lanes::Lanes;
use super::tree::{LEAF, Stack, faces_of, sort_new, up};

/// A point of the surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Near {
    /// Squared distance from the point asked about.
    pub d2: f64,
    pub point: [f64; 3],
    pub face: u32,
}

impl RayMesh {
    /// The point of the surface nearest to `c` (units of the tree) if its squared distance is below `limit`.
    #[inline(always)]
    pub(super) fn nearest<L: Lanes>(&self, lanes: L, stack: &mut Stack, c: [f64; 3], limit: f64) -> Option<Near> {
        let c32 = [c[0] as f32, c[1] as f32, c[2] as f32];
        let mut best: Option<Near> = None;
        let mut reach = limit;
        let mut d2 = [0.0f32; 8];
        let mut at = 0u32;
        stack.clear();
        loop {
            if at & LEAF == 0 {
                let Some(node) = self.tree.nodes.get(at as usize) else { return best };
                let mut mask = lanes.distances(node, c32, up(reach), &mut d2);
                let base = stack.len();
                while mask != 0 {
                    let k = (mask.trailing_zeros() & 7) as usize;
                    mask &= mask - 1;
                    stack.push((d2[k], node.child[k]));
                }
                sort_new(stack, base);
            } else {
                let Some(block) = self.tree.blocks.get((at & !LEAF) as usize) else { return best };
                for face in faces_of(block) {
                    let corners = self.corners(face);
                    let height = dot(sub(c, corners[0]), self.normals[face as usize]);
                    if height * height >= reach * (1.0 + 1e-9) {
                        continue;
                    }
                    let point = closest_on_triangle(c, corners);
                    let v = sub(c, point);
                    let d2 = dot(v, v);
                    if d2 < reach || best.is_some_and(|b| d2 == b.d2 && face < b.face) {
                        best = Some(Near { d2, point, face });
                        reach = d2;
                    }
                }
            }
            at = loop {
                match stack.pop() {
                    Some((d2, child)) if d2 <= up(reach) => break child,
                    Some(_) => {}
                    None => return best,
                }
            };
        }
    }

    /// Calls `visit` for the faces whose surroundings meet the box from `lo` to `hi` (units of the tree), and some near.
    pub(super) fn faces_near(&self, lo: [f64; 3], hi: [f64; 3], mut visit: impl FnMut(u32)) {
        let meets = |lo2: [f64; 3], hi2: [f64; 3]| (0..3).all(|a| lo[a] <= hi2[a] && lo2[a] <= hi[a]);
        let mut stack = vec![0u32];
        while let Some(at) = stack.pop() {
            if at & LEAF == 0 {
                let Some(node) = self.tree.nodes.get(at as usize) else { return };
                for k in 0..8 {
                    let bound = |a: usize| node.bounds[a][k] as f64;
                    if meets([bound(0), bound(1), bound(2)], [bound(3), bound(4), bound(5)]) {
                        stack.push(node.child[k]);
                    }
                }
            } else if let Some(block) = self.tree.blocks.get((at & !LEAF) as usize) {
                faces_of(block).for_each(&mut visit);
            }
        }
    }
}

/// The point of a triangle nearest to `p` (Ericson, Real-Time Collision Detection, 5.1.5).
#[inline(always)]
pub(super) fn closest_on_triangle(p: [f64; 3], [a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    let (ab, ac, ap) = (sub(b, a), sub(c, a), sub(p, a));
    let (d1, d2) = (dot(ab, ap), dot(ac, ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = sub(p, b);
    let (d3, d4) = (dot(ab, bp), dot(ac, bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return along(a, share(d1, -d3), ab);
    }
    let cp = sub(p, c);
    let (d5, d6) = (dot(ab, cp), dot(ac, cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return along(a, share(d2, -d6), ac);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return along(b, share(d4 - d3, d5 - d6), sub(c, b));
    }
    let scale = 1.0 / (va + vb + vc);
    along(along(a, vb * scale, ab), vc * scale, ac)
}

/// `a / (a + b)` of two numbers that are not negative.
#[inline(always)]
fn share(a: f64, b: f64) -> f64 {
    if a > 0.0 { a / (a + b) } else { 0.0 }
}

/// The point of the segment from `a` to `b` nearest to the origin.
pub(super) fn closest_on_segment(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    let ab = sub(b, a);
    let t = share((-dot(a, ab)).max(0.0), dot(b, ab).max(0.0));
    along(a, t, ab)
}
