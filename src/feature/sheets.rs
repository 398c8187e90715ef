//! Walls that are one sheet: bent around, or closed to a shell.
//!
//! A cut along creases parts every two walls that meet in an angle. Two plates in an angle are two walls; but a sheet that
//! is bent around a radius, outside as well as inside, is one, and so are the walls of a box, which close around it.

use super::widths::{Place, quantile};
use crate::error::{Result, try_filled};
use crate::mesh::NONE;
use crate::mesh::sets::Sets;
use crate::segment::dual::Dual;
use std::collections::BTreeMap;

/// A wall is as thick as its middle place, within this share, ...
const EVEN: f64 = 0.15;
/// ... over so much of its area, and both its sides are its own over as much.
const MOSTLY: f64 = 0.5;
/// It is so many times as large as its thickness squared: 2.5 thicknesses wide on both sides.
const LARGE: f64 = 12.5;
/// Edges that turn more than this are sharp (radians); those below the other are flat.
const TURNS: [f64; 2] = [0.8, 0.01];
/// Share of a border that turns inward, and as much outward, where walls meet in an angle or a bend.
const ANGLE: f64 = 0.25;
/// Of the border in a bend no more than this share is sharp.
const SHARP: f64 = 0.1;
/// So many walls close to a shell; three meet in a corner.
const SHELL: usize = 4;

/// What two features have in common: lengths by how the surface turns there.
#[derive(Default, Clone, Copy)]
struct Border {
    whole: f64,
    /// Inward: at sharp edges, and at gentle ones.
    inward: [f64; 2],
    /// Outward, likewise.
    outward: [f64; 2],
}

impl Border {
    fn add(&mut self, length: f64, turn: f64) {
        self.whole += length;
        if turn.abs() > TURNS[1] {
            let side = if turn > 0.0 { &mut self.inward } else { &mut self.outward };
            side[usize::from(turn.abs() <= TURNS[0])] += length;
        }
    }

    /// Around a radius.
    fn is_bend(&self) -> bool {
        let sharp = self.inward[0] + self.outward[0];
        sharp <= SHARP * self.whole && self.inward[1].min(self.outward[1]) >= ANGLE * self.whole
    }

    /// Two walls in an angle, and none that goes on beyond.
    fn is_angle(&self) -> bool {
        let [inward, outward] = [self.inward, self.outward].map(|s| s[0] + s[1]);
        inward.min(outward) >= ANGLE * self.whole
    }
}

/// Walls joined that are one sheet: a new label for every old one. `places` as measured with `label` or a finer one.
///
/// # Errors
/// [`crate::error::Error::NoMemory`].
pub fn closed_or_bent(dual: &Dual, label: &[u32], places: &[Place]) -> Result<Vec<u32>> {
    let n = label.iter().map(|l| *l as usize + 1).max().unwrap_or(0);
    let thickness = thicknesses(dual, label, places, n)?;
    let alike = |&[a, b]: &[u32; 2]| {
        let [a, b] = [thickness[a as usize], thickness[b as usize]];
        (a - b).abs() <= EVEN * a.max(b)
    };
    let mut borders: BTreeMap<[u32; 2], Border> = BTreeMap::new();
    for step in &dual.steps {
        let [a, b] = step.faces.map(|f| label[f as usize]);
        if a != b {
            borders.entry([a.min(b), a.max(b)]).or_default().add(step.length, step.turn);
        }
    }
    borders.retain(|pair, _| alike(pair));
    let mut sets = Sets::new(n)?;
    borders.iter().filter(|(_, b)| b.is_bend()).for_each(|(&[a, b], _)| sets.join(a, b));
    // --- a chain of walls in angles that closes: what is left when its loose ends are taken away
    let mut edges: Vec<[u32; 2]> = borders.iter().filter(|(_, b)| b.is_angle()).map(|(p, _)| *p).collect();
    loop {
        let mut degree = try_filled(n, 0u32, "walls")?;
        edges.iter().flatten().for_each(|&a| degree[a as usize] += 1);
        let before = edges.len();
        edges.retain(|e| e.iter().all(|&a| degree[a as usize] > 1));
        if edges.len() == before {
            break;
        }
    }
    let mut loops = Sets::new(n)?;
    edges.iter().for_each(|&[a, b]| loops.join(a, b));
    let mut size = try_filled(n, 0usize, "walls")?;
    (0..n as u32).for_each(|a| size[loops.root(a) as usize] += 1);
    for &[a, b] in edges.iter().filter(|e| size[loops.root(e[0]) as usize] >= SHELL) {
        sets.join(a, b);
    }
    Ok((0..n as u32).map(|a| sets.root(a)).collect())
}

/// How thick each feature is if it is an even wall; NaN if not.
fn thicknesses(dual: &Dual, label: &[u32], places: &[Place], n: usize) -> Result<Vec<f64>> {
    let mut area = try_filled(n, 0.0, "walls")?;
    label.iter().zip(&dual.area).for_each(|(&l, a)| area[l as usize] += a);
    let mut measured = try_filled(n, 0.0, "walls")?;
    let mut own: Vec<Vec<&Place>> = try_filled(n, Vec::new(), "walls")?;
    for p in places.iter().filter(|p| p.width.is_finite()) {
        let l = label[p.face as usize];
        measured[l as usize] += p.area;
        if p.facing != NONE && label[p.facing as usize] == l {
            own[l as usize].push(p);
        }
    }
    let mut out = try_filled(n, f64::NAN, "walls")?;
    for (k, own) in own.iter_mut().enumerate() {
        let Some(middle) = quantile(own, 0.5).map(|p| p.width) else { continue };
        let even = own.iter().filter(|p| (p.width - middle).abs() <= EVEN * middle).map(|p| p.area).sum::<f64>();
        if even >= MOSTLY * measured[k] && area[k] >= LARGE * middle * middle {
            out[k] = middle;
        }
    }
    Ok(out)
}
