//! D2: widths by ray shooting.

pub mod bvh;
pub mod chords;
pub mod cone;
mod contact;
mod cover;
mod exposed;
mod fans;
mod fold;
pub mod inscribed;
mod lanes;
mod nearest;
mod rest;
pub mod sdf;
mod shaft;
mod slabs;
mod tree;
pub mod wall;

#[cfg(test)]
mod cover_tests;
#[cfg(test)]
#[path = "shapes.rs"]
pub(crate) mod shapes;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod wall_tests;
