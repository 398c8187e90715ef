//! D2: widths by ray shooting.

pub mod bvh;
pub mod chords;
pub mod cone;
pub mod inscribed;
mod lanes;
pub mod sdf;
mod tree;

#[cfg(test)]
#[path = "shapes.rs"]
mod shapes;
#[cfg(test)]
mod tests;
