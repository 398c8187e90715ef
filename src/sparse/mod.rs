//! Sparse operators on surfaces and their factorisation.

pub mod cholesky;
pub mod eigen;
pub mod laplacian;

pub use cholesky::{Cholesky, LANES, Pattern, Row, SymmetricMatrix};
pub use laplacian::{Laplacian, Triangle};
