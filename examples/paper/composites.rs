//! Parts with features, in the manner of Figs. 21 and 22: their fields, their segments, the slenderness of each.

use super::measure::{Measured, measure, segments};
use super::shapes::{Shape, V3, blocks, gear, prism, star};
use armesh::error::Result;
use armesh::field::Profile;
use armesh::io::{self, Limits};
use armesh::job::Job;
use armesh::segment::Segmentation;
use std::path::Path;

/// A part and what a person would call its features.
pub struct Part {
    pub key: &'static str,
    pub name: &'static str,
    pub shape: Shape,
    /// How many features a person would count.
    pub features: usize,
}

/// The parts; the bracket is the project's bundled example.
pub fn parts(examples: &Path) -> Result<Vec<Part>> {
    let centred = |half: V3, at: V3| [[0, 1, 2].map(|k| at[k] - half[k]), [0, 1, 2].map(|k| at[k] + half[k])];
    let wall = [[[0.0; 3], [40.0, 40.0, 15.0]], [[0.0, 19.0, 15.0], [40.0, 21.0, 45.0]]];
    let steps = [
        centred([15.0, 15.0, 10.0], [0.0, 0.0, 10.0]),
        centred([8.0, 8.0, 15.0], [0.0, 0.0, 35.0]),
        centred([3.0, 3.0, 20.0], [0.0, 0.0, 70.0]),
    ];
    let node = [
        centred([30.0, 2.0, 2.0], [0.0; 3]),
        centred([2.0, 30.0, 2.0], [0.0; 3]),
        centred([2.0, 2.0, 30.0], [0.0; 3]),
        centred([5.0, 5.0, 5.0], [0.0; 3]),
    ];
    let raw = io::load(&examples.join("parts/bracket.stl"), &Limits::default(), &Job::default())?;
    let bracket = Shape { positions: raw.positions, triangles: raw.triangles };
    let part = |key, name, shape, features| Part { key, name, shape, features };
    Ok(vec![
        part("wall", "thin wall on a block", blocks(&wall, 1.3), 2),
        part("steps", "stepped bar", blocks(&steps, 1.6), 3),
        part("star", "sharp star", prism(&star(5, [10.0, 40.0]), 0.0, 6.0, 1.4), 6),
        part("gear", "gear", prism(&gear(14, [20.0, 26.0]), 6.0, 8.0, 1.2), 15),
        part("node", "lattice node", blocks(&node, 1.1), 7),
        part("bracket", "bracket", bracket, 4),
    ])
}

/// A part, measured in the print profile and segmented without being told how many features it has.
pub struct Result22 {
    pub part: Part,
    pub measured: Measured,
    pub segmentation: Segmentation,
}

/// Measures the parts.
pub fn composites(examples: &Path) -> Result<Vec<Result22>> {
    let of = |part: Part| {
        let measured = measure(&part.shape, Profile::Print)?;
        let segmentation = segments(&measured.mesh, None)?;
        Ok(Result22 { part, measured, segmentation })
    };
    parts(examples)?.into_iter().map(of).collect()
}
