//! Sparse Cholesky factorisation, the only room that knows faer.
//!
//! The pattern is analysed once ([`Pattern`]) and shared by all matrices that have it; a factor ([`Cholesky`]) then
//! solves blocks of right-hand sides. Everything runs on the calling thread: callers parallelise over blocks.

use crate::error::{Error, Result, try_filled};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};
use std::sync::Arc;

/// Lower triangle of a symmetric n × n matrix in compressed columns; rows ascend, the diagonal comes first.
#[derive(Debug, Clone)]
pub struct SymmetricMatrix {
    /// Start of every column in `rows` and `values`, and the end: n + 1 numbers.
    pub columns: Arc<[u32]>,
    /// Row of every entry.
    pub rows: Arc<[u32]>,
    /// Value of every entry.
    pub values: Vec<f64>,
}

impl SymmetricMatrix {
    /// Number of rows.
    pub fn order(&self) -> usize {
        self.columns.len() - 1
    }

    /// y = A x
    pub fn multiply(&self, x: &[f64], y: &mut [f64]) {
        y.fill(0.0);
        for j in 0..self.order() {
            for k in self.columns[j] as usize..self.columns[j + 1] as usize {
                let (i, a) = (self.rows[k] as usize, self.values[k]);
                y[i] += a * x[j];
                if i != j {
                    y[j] += a * x[i];
                }
            }
        }
    }

    /// Largest |b - A x| over largest |A| |x| + |b|: the normwise backward error of a solution.
    pub fn backward_error(&self, x: &[f64], b: &[f64]) -> f64 {
        let (mut residual, mut size) = (b.to_vec(), b.iter().map(|v| v.abs()).collect::<Vec<_>>());
        for j in 0..self.order() {
            for k in self.columns[j] as usize..self.columns[j + 1] as usize {
                let (i, a) = (self.rows[k] as usize, self.values[k]);
                residual[i] -= a * x[j];
                size[i] += (a * x[j]).abs();
                if i != j {
                    residual[j] -= a * x[i];
                    size[j] += (a * x[i]).abs();
                }
            }
        }
        // `max` would drop a NaN
        let worst = |v: &[f64]| v.iter().fold(0.0, |m: f64, r| if r.abs() <= m || m.is_nan() { m } else { r.abs() });
        worst(&residual) / worst(&size).max(f64::MIN_POSITIVE)
    }
}

/// A fill-reducing elimination order for a pattern and the pattern of its factor.
#[derive(Debug, Clone)]
pub struct Pattern(Arc<SymbolicCholesky<u32>>);

/// A = L Lᵀ.
#[derive(Debug)]
pub struct Cholesky {
    pattern: Pattern,
    values: Vec<f64>,
}

/// Memory for [`Cholesky::solve_in_place`], to be used again by the next solve.
pub struct Workspace(MemBuffer);

impl Pattern {
    /// Analyses the pattern of `a` (approximate minimum degree order).
    pub fn new(a: &SymmetricMatrix) -> Result<Pattern> {
        let symbolic = symbolic(a);
        let ordering = SymmetricOrdering::Amd;
        factorize_symbolic_cholesky(symbolic, Side::Lower, ordering, CholeskySymbolicParams::default())
            .map(|s| Pattern(Arc::new(s)))
            .map_err(|e| Error::NoMemory(format!("analysing the Laplacian's pattern: {e}")))
    }

    /// Bytes of one factor with this pattern.
    pub fn factor_bytes(&self) -> u64 {
        8 * self.0.len_val() as u64
    }
}

impl Cholesky {
    /// Factors `a`, which has the pattern that `pattern` was made from and must be positive definite.
    pub fn new(pattern: &Pattern, a: &SymmetricMatrix) -> Result<Cholesky> {
        let mut values = try_filled(pattern.0.len_val(), 0.0, "the factor of the Laplacian")?;
        let scratch = pattern.0.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        let mut memory = buffer(scratch)?;
        let matrix = SparseColMatRef::new(symbolic(a), &a.values);
        let stack = MemStack::new(&mut memory);
        let regularization = LltRegularization::default();
        pattern
            .0
            .factorize_numeric_llt(
                &mut values,
                matrix,
                Side::Lower,
                regularization,
                Par::Seq,
                stack,
                Default::default(),
            )
            .map_err(|e| Error::Numeric(format!("the Laplacian is not positive definite: {e:?}")))?;
        Ok(Cholesky { pattern: pattern.clone(), values })
    }

    /// Memory for solving with up to `columns` right-hand sides at a time.
    pub fn workspace(&self, columns: usize) -> Result<Workspace> {
        buffer(self.pattern.0.solve_in_place_scratch::<f64>(columns, Par::Seq)).map(Workspace)
    }

    /// Replaces the right-hand sides, columns of n numbers one after the other, by the solutions.
    pub fn solve_in_place(&self, columns: &mut [f64], workspace: &mut Workspace) {
        let n = self.pattern.0.nrows();
        let rhs = MatMut::from_column_major_slice_mut(columns, n, columns_of(columns.len(), n));
        let stack = MemStack::new(&mut workspace.0);
        LltRef::new(&*self.pattern.0, &self.values).solve_in_place_with_conj(Conj::No, rhs, Par::Seq, stack);
    }
}

fn columns_of(len: usize, n: usize) -> usize {
    if n == 0 { 0 } else { len / n }
}

fn symbolic(a: &SymmetricMatrix) -> SymbolicSparseColMatRef<'_, u32> {
    SymbolicSparseColMatRef::new_checked(a.order(), a.order(), &a.columns, None, &a.rows)
}

fn buffer(size: faer::dyn_stack::StackReq) -> Result<MemBuffer> {
    MemBuffer::try_new(size).map_err(|_| Error::NoMemory(format!("out of memory: a solve needs {size:?}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The 1-D Laplacian plus identity: tridiagonal 3, -1.
    fn tridiagonal(n: usize) -> SymmetricMatrix {
        let (mut columns, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
        for j in 0..n {
            rows.push(j as u32);
            values.push(3.0);
            if j + 1 < n {
                rows.push(j as u32 + 1);
                values.push(-1.0);
            }
            columns.push(rows.len() as u32);
        }
        SymmetricMatrix { columns: columns.into(), rows: rows.into(), values }
    }

    #[test]
    fn solves_a_block_of_right_hand_sides() {
        let a = tridiagonal(50);
        let factor = Cholesky::new(&Pattern::new(&a).unwrap(), &a).unwrap();
        let x: Vec<f64> = (0..150).map(|i| (i as f64 * 0.7).sin()).collect();
        let mut b = vec![0.0; 150];
        for k in 0..3 {
            a.multiply(&x[50 * k..50 * k + 50], &mut b[50 * k..50 * k + 50]);
        }
        let rhs = b.clone();
        factor.solve_in_place(&mut b, &mut factor.workspace(3).unwrap());
        assert!(b.iter().zip(&x).all(|(p, q)| (p - q).abs() < 1e-14));
        assert!(a.backward_error(&b[..50], &rhs[..50]) < 1e-15);
        b[7] += 1e-3;
        assert!(a.backward_error(&b[..50], &rhs[..50]) > 1e-5);
        b[7] = f64::NAN;
        assert!(!(a.backward_error(&b[..50], &rhs[..50]) < 1.0));
    }

    #[test]
    fn an_indefinite_matrix_is_refused() {
        let mut a = tridiagonal(5);
        a.values[0] = -3.0;
        assert!(matches!(Cholesky::new(&Pattern::new(&a).unwrap(), &a), Err(Error::Numeric(_))));
    }
}
