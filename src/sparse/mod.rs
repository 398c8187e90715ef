//! Sparse operators on surfaces and their factorisation.

pub mod cholesky;
pub mod laplacian;

pub use cholesky::{Cholesky, Pattern, SymmetricMatrix};
pub use laplacian::{Laplacian, Triangle};
