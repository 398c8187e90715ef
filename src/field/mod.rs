//! The slenderness field of a part: D1, D2 and D1/D2 at every vertex, their summary and histograms.
//!
//! [`compute`] brings [`crate::geodesic`] and [`crate::thickness`] together; neither knows the other.

mod accuracy;
mod bridge;
mod compute;
mod large;
mod paint;
mod print;
mod reach;
mod summary;

pub use accuracy::{Accuracy, Method};
pub use compute::{D2Method, Options, Profile, compute, distance};
pub use summary::{Histogram, Quantity, Summary};

use crate::job::Stage;

/// Why a vertex has no value: flags of [`Field::reason`].
pub mod reason {
    /// No face uses the vertex.
    pub const UNREFERENCED: u32 = 1;
    /// The vertex is not finite. Set for input vertices only: welded ones are finite.
    pub const NOT_FINITE: u32 = 2;
    /// No ray from the faces around the vertex met the surface: it is open there. No D2.
    pub const NO_HIT: u32 = 4;
    /// All faces around the vertex are without area. No D2.
    pub const NO_AREA: u32 = 8;
}

/// Values by welded vertex, in model units; NaN where [`Field::reason`] says why.
#[derive(Debug, Clone, Default)]
pub struct Field {
    /// D1, the farthest geodesic distance.
    pub d1: Vec<f64>,
    /// Lower and upper bound of D1.
    pub d1_bounds: (Vec<f64>, Vec<f64>),
    /// D2, the inscribed sphere's diameter or the shape diameter function.
    pub d2: Vec<f64>,
    /// The slenderness D1/D2.
    pub ratio: Vec<f64>,
    /// The vertex at distance D1; [`crate::mesh::NONE`] where there is none.
    pub farthest: Vec<u32>,
    /// Flags of [`reason`]; 0 where all values are there.
    pub reason: Vec<u32>,
    /// D2 by kept face.
    pub face_d2: Vec<f64>,
    /// The longest way across the part.
    pub reach: Reach,
    /// How right D1 is.
    pub accuracy: Accuracy,
    /// Distance fields that were solved for D1.
    pub solves: u64,
    /// Seconds spent by [`Stage`].
    pub seconds: [f64; Stage::COUNT],
}

/// The longest of the shortest paths between two points of the surface that was found, model units. Its ends need not be
/// vertices: from the middle of one end of a square bar to the middle of the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// Its length.
    pub length: f64,
    /// Its ends; NaN when there is none.
    pub ends: [[f64; 3]; 2],
}

impl Default for Reach {
    fn default() -> Self {
        Reach { length: 0.0, ends: [[f64::NAN; 3]; 2] }
    }
}
