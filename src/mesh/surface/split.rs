//! Cuts one input face along the points on its edges and inside it.
//!
//! Points carry integer barycentric coordinates that sum to [`UNIT`], so every orientation test is exact, collinear
//! points on an edge are exactly collinear, and the children tile the face without overlaps however thin it is. Lengths
//! only decide which of the valid triangulations is made (Delaunay within the face, by Lawson flips).

use super::sites::Sites;
use crate::error::{Error, Result};
use crate::mesh::NONE;
use crate::mesh::intrinsic::double_area;
use crate::mesh::measure::{distance, dot, norm, sub};

/// Barycentric coordinates are integers out of this many. Products of two fit an i64.
pub(super) const UNIT: i64 = 1 << 28;

/// A triangle with the neighbour across each side `k` (corner `k` to `k + 1`).
#[derive(Clone, Copy)]
struct Cell {
    corners: [u32; 3],
    across: [u32; 3],
}

/// Workspace, reused from face to face.
#[derive(Default)]
pub(super) struct Cutter {
    /// Vertex of the surface, barycentric coordinates of corners 1 and 2, and place in the face's plane.
    vertex: Vec<u32>,
    bary: Vec<[i64; 2]>,
    plane: Vec<[f64; 2]>,
    cells: Vec<Cell>,
    stack: Vec<(u32, u32)>,
    flat: bool,
}

impl Cutter {
    /// Appends the children of face `f` with corners `t` to `out`, each with `f`.
    pub(super) fn cut(
        &mut self,
        f: usize,
        t: [u32; 3],
        positions: &[[f64; 3]],
        sites: &Sites,
        out: &mut Vec<([u32; 3], u32)>,
    ) -> Result<()> {
        let inside = sites.inside(f);
        if inside.is_empty() && (0..3).all(|k| sites.on_side(f, k).is_empty()) {
            out.push((t, f as u32));
            return Ok(());
        }
        self.start(t, positions);
        let mut near = 0;
        for k in 0..3 {
            // Parameters run from the lower to the higher vertex of the edge.
            let forward = t[k] < t[(k + 1) % 3];
            for point in sites.on_side(f, k) {
                let along = if forward { point.along } else { UNIT - point.along };
                let mut b = [0; 3];
                b[k] = UNIT - along;
                b[(k + 1) % 3] = along;
                near = self.insert(point.vertex, [b[1], b[2]], near)?;
            }
        }
        for point in inside {
            near = self.insert(point.vertex, point.bary, near)?;
        }
        out.extend(self.cells.iter().map(|c| (c.corners.map(|i| self.vertex[i as usize]), f as u32)));
        Ok(())
    }

    fn start(&mut self, t: [u32; 3], positions: &[[f64; 3]]) {
        self.vertex.clear();
        self.vertex.extend_from_slice(&t);
        self.bary.clear();
        self.bary.extend_from_slice(&[[0, 0], [UNIT, 0], [0, UNIT]]);
        let [a, b, c] = t.map(|v| positions[v as usize]);
        let (u, v) = (sub(b, a), sub(c, a));
        let l = norm(u);
        let x = if l > 0.0 { dot(u, v) / l } else { 0.0 };
        let y = double_area([l, distance(c, b), norm(v)]) / l.max(f64::MIN_POSITIVE);
        // Without any height there is no metric to choose by: leave the first valid triangulation.
        self.flat = !(y > 1e-9 * l && y.is_finite());
        self.plane.clear();
        self.plane.extend_from_slice(&[[0.0, 0.0], [l, 0.0], [x, y]]);
        self.cells.clear();
        self.cells.push(Cell { corners: [0, 1, 2], across: [NONE; 3] });
    }

    /// Twice the signed area of three points in barycentric units; exact.
    fn turn(&self, a: u32, b: u32, c: u32) -> i64 {
        let [a, b, c] = [a, b, c].map(|i| self.bary[i as usize]);
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    }

    /// Inserts a point, searching from the cell `near`; returns a cell that has it as corner.
    fn insert(&mut self, vertex: u32, bary: [i64; 2], near: u32) -> Result<u32> {
        let p = self.vertex.len() as u32;
        self.vertex.push(vertex);
        self.bary.push(bary);
        let [s, t] = bary.map(|b| b as f64 / UNIT as f64);
        let (b, c) = (self.plane[1], self.plane[2]);
        self.plane.push([s * b[0] + t * c[0], s * b[1] + t * c[1]]);
        let cell = self.locate(p, near);
        let corners = self.cells[cell as usize].corners;
        let sides = [0, 1, 2].map(|k| self.turn(corners[k], corners[(k + 1) % 3], p));
        match (0..3).filter(|&k| sides[k] == 0).collect::<Vec<_>>()[..] {
            [] => self.split_cell(cell, p),
            [k] => self.split_side(cell, k, p),
            _ => return Err(Error::Internal("two points of the analysis surface coincide".into())),
        }
        self.legalize(p)?;
        Ok(self.cells.len() as u32 - 1)
    }

    /// The cell that contains `p`, by walking from `near`.
    fn locate(&self, p: u32, near: u32) -> u32 {
        let outside = |c: u32, k: usize| {
            let corners = self.cells[c as usize].corners;
            self.turn(corners[k], corners[(k + 1) % 3], p) < 0
        };
        let mut at = near;
        // In barycentric coordinates the triangulation is not Delaunay: a walk could circle. Turning the order of the
        // tests from step to step avoids it, and after too many steps every cell is tried.
        for step in 0..2 * self.cells.len() + 8 {
            let Some(k) = (0..3).map(|k| (k + step) % 3).find(|&k| outside(at, k)) else { return at };
            match self.cells[at as usize].across[k] {
                NONE => break,
                next => at = next,
            }
        }
        (0..self.cells.len() as u32).find(|&c| (0..3).all(|k| !outside(c, k))).unwrap_or(0)
    }

    /// Makes `to` see `cell` where it saw `before`.
    fn relink(&mut self, to: u32, before: u32, cell: u32) {
        if to != NONE {
            if let Some(side) = self.cells[to as usize].across.iter_mut().find(|s| **s == before) {
                *side = cell;
            }
        }
    }

    /// One cell into three around `p`; each has `p` as last corner.
    fn split_cell(&mut self, cell: u32, p: u32) {
        let Cell { corners: [a, b, c], across: [ab, bc, ca] } = self.cells[cell as usize];
        let (i, j) = (self.cells.len() as u32, self.cells.len() as u32 + 1);
        self.cells[cell as usize] = Cell { corners: [a, b, p], across: [ab, i, j] };
        self.cells.push(Cell { corners: [b, c, p], across: [bc, j, cell] });
        self.cells.push(Cell { corners: [c, a, p], across: [ca, cell, i] });
        self.relink(bc, cell, i);
        self.relink(ca, cell, j);
        self.stack.extend([(cell, 0), (i, 0), (j, 0)]);
    }

    /// Splits the side `k` of `cell` at `p`, and the cell across if there is one.
    fn split_side(&mut self, cell: u32, k: usize, p: u32) {
        let rotate =
            |c: Cell, k: usize| ([0, 1, 2].map(|i| c.corners[(k + i) % 3]), [0, 1, 2].map(|i| c.across[(k + i) % 3]));
        let ([a, b, c], [other, bc, ca]) = rotate(self.cells[cell as usize], k);
        let i = self.cells.len() as u32;
        // The cell becomes (c, a, p), its new sibling (b, c, p).
        self.cells[cell as usize] = Cell { corners: [c, a, p], across: [ca, NONE, i] };
        self.cells.push(Cell { corners: [b, c, p], across: [bc, cell, NONE] });
        self.relink(bc, cell, i);
        self.stack.extend([(cell, 0), (i, 0)]);
        if other == NONE {
            return;
        }
        let m = self.cells[other as usize].across.iter().position(|&n| n == cell).unwrap_or(0);
        let ([_, _, d], [_, ad, db]) = rotate(self.cells[other as usize], m);
        let j = self.cells.len() as u32;
        // Across lie (a, d, p) in place and (d, b, p) new.
        self.cells[other as usize] = Cell { corners: [a, d, p], across: [ad, j, cell] };
        self.cells.push(Cell { corners: [d, b, p], across: [db, i, other] });
        self.relink(db, other, j);
        self.cells[cell as usize].across[1] = other;
        self.cells[i as usize].across[2] = j;
        self.stack.extend([(other, 0), (j, 0)]);
    }

    /// Lawson flips of the sides opposite the new point `p`, the last corner of every cell on the stack.
    fn legalize(&mut self, p: u32) -> Result<()> {
        let mut left = 16 * self.cells.len() + 64;
        while let Some((cell, side)) = self.stack.pop() {
            let Cell { corners, across } = self.cells[cell as usize];
            let other = across[side as usize];
            if other == NONE || self.flat || left == 0 || corners[2] != p {
                continue;
            }
            let m = self.cells[other as usize].across.iter().position(|&n| n == cell).unwrap_or(0);
            let d = self.cells[other as usize].corners[(m + 2) % 3];
            let (a, b) = (corners[0], corners[1]);
            // (a, d, p) and (d, b, p) must both be proper triangles.
            if !self.in_circle(a, b, p, d) || self.turn(a, d, p) <= 0 || self.turn(d, b, p) <= 0 {
                continue;
            }
            left -= 1;
            let Cell { across: other_across, .. } = self.cells[other as usize];
            let (ad, db) = (other_across[(m + 1) % 3], other_across[(m + 2) % 3]);
            let (bp, pa) = (across[1], across[2]);
            self.cells[cell as usize] = Cell { corners: [a, d, p], across: [ad, other, pa] };
            self.cells[other as usize] = Cell { corners: [d, b, p], across: [db, bp, cell] };
            self.relink(ad, other, cell);
            self.relink(bp, cell, other);
            self.stack.extend([(cell, 0), (other, 0)]);
        }
        Ok(())
    }

    /// True if `d` lies inside the circle through a, b, p by more than rounding: opposite angles sum to over pi.
    fn in_circle(&self, a: u32, b: u32, p: u32, d: u32) -> bool {
        let [a, b, p, d] = [a, b, p, d].map(|i| self.plane[i as usize]);
        let angle = |at: [f64; 2], from: [f64; 2], to: [f64; 2]| {
            let (u, v) = ([from[0] - at[0], from[1] - at[1]], [to[0] - at[0], to[1] - at[1]]);
            (u[0] * v[0] + u[1] * v[1], u[0] * v[1] - u[1] * v[0])
        };
        let ((cos_p, sin_p), (cos_d, sin_d)) = (angle(p, a, b), angle(d, b, a));
        let (one, two) = (cos_p * sin_d, cos_d * sin_p);
        one + two < -1e-9 * (one.abs() + two.abs() + (cos_p * cos_d).abs())
    }
}
