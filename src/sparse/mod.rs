//! Sparse operators and their factorisation.
