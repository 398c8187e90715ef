//! Sparse Cholesky factorisation, the only room that knows faer.
//!
//! The pattern is analysed once ([`Pattern`]) and shared by all matrices that have it; faer factors. The factor
//! ([`Cholesky`]) then solves blocks of [`LANES`] right-hand sides stored row by row, so that every entry of L that is
//! fetched from memory works on all of them in vector registers. That loop is ours because it is where D1 spends its time
//! and faer's column-major solve takes about five times as long on the small supernodes of a surface. Everything runs on the calling
//! thread: callers parallelise over blocks.

use crate::error::{Error, Result, try_filled, try_vec};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::supernodal::SupernodalLltRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Par, Side};
use std::cmp::Ordering;
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

/// Right-hand sides that are solved together: enough to use every entry of the factor from a register, few enough for the
/// vectors to stay in cache.
pub const LANES: usize = 16;

/// One entry of [`LANES`] vectors. A block of vectors is a slice of rows.
pub type Row = [f64; LANES];

/// A fill-reducing elimination order for a pattern and the pattern of its factor.
#[derive(Debug)]
pub struct Pattern(SymbolicCholesky<u32>);

/// A = L Lᵀ in the elimination order of its [`Pattern`].
///
/// Columns of L with the same pattern are kept together as dense *supernodes*, stored by rows.
#[derive(Debug)]
pub struct Cholesky {
    supernodes: Vec<Supernode>,
    /// Rows below the diagonal block of every supernode.
    rows: Vec<u32>,
    /// By supernode: the diagonal block (its diagonal inverted) and the rows below it, each `width` numbers long.
    values: Vec<f64>,
}

#[derive(Debug, Clone, Copy)]
struct Supernode {
    /// First column.
    start: u32,
    /// Number of columns.
    width: u32,
    /// Where its rows are in [`Cholesky::rows`].
    rows: (u32, u32),
    /// Where its numbers begin in [`Cholesky::values`].
    values: usize,
}

impl Pattern {
    /// Analyses the pattern of `a` (approximate minimum degree order).
    pub fn new(a: &SymmetricMatrix) -> Result<Pattern> {
        let parameters = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        factorize_symbolic_cholesky(symbolic(a), Side::Lower, SymmetricOrdering::Amd, parameters)
            .map(Pattern)
            .map_err(|e| Error::NoMemory(format!("analysing the Laplacian's pattern: {e}")))
    }

    /// Bytes of one factor with this pattern.
    pub fn factor_bytes(&self) -> u64 {
        8 * self.0.len_val() as u64
    }

    /// The elimination order: the row of the matrix that comes k-th.
    pub fn order(&self) -> Vec<u32> {
        self.0.perm().map(|p| p.arrays().0.to_vec()).unwrap_or_default()
    }
}

impl Cholesky {
    /// Factors `a`, which has the pattern that `pattern` was made from and must be positive definite.
    pub fn new(pattern: &Pattern, a: &SymmetricMatrix) -> Result<Cholesky> {
        let mut values = try_filled(pattern.0.len_val(), 0.0, "the factor of the Laplacian")?;
        let scratch = pattern.0.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        let out_of_memory = |_| Error::NoMemory(format!("out of memory: factoring the Laplacian needs {scratch:?}"));
        let mut memory = MemBuffer::try_new(scratch).map_err(out_of_memory)?;
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
        match pattern.0.raw() {
            SymbolicCholeskyRaw::Supernodal(symbolic) => Cholesky::repack(SupernodalLltRef::new(symbolic, &values)),
            SymbolicCholeskyRaw::Simplicial(_) => Err(Error::Internal("the factor is not supernodal".into())),
        }
    }

    /// Copies faer's column-major supernodes into rows.
    fn repack(factor: SupernodalLltRef<'_, u32, f64>) -> Result<Cholesky> {
        let symbolic = factor.symbolic();
        let mut supernodes = try_vec(symbolic.n_supernodes(), "the factor of the Laplacian")?;
        let mut rows = try_vec(symbolic.row_idx().len(), "the factor of the Laplacian")?;
        let mut values = try_vec(symbolic.len_val(), "the factor of the Laplacian")?;
        for s in 0..symbolic.n_supernodes() {
            let node = factor.supernode(s);
            let (block, first_row, first_value) = (node.val(), rows.len() as u32, values.len());
            rows.extend_from_slice(node.pattern());
            for i in 0..block.nrows() {
                for j in 0..block.ncols() {
                    // faer leaves the upper half of the diagonal block undefined
                    values.push(match i.cmp(&j) {
                        Ordering::Less => 0.0,
                        Ordering::Equal => 1.0 / block[(i, j)],
                        Ordering::Greater => block[(i, j)],
                    });
                }
            }
            let (start, width) = (node.start() as u32, block.ncols() as u32);
            supernodes.push(Supernode { start, width, rows: (first_row, rows.len() as u32), values: first_value });
        }
        Ok(Cholesky { supernodes, rows, values })
    }

    /// Replaces a block of right-hand sides by the solutions. Both are in the elimination order ([`Pattern::order`]).
    pub fn solve_in_place(&self, x: &mut [Row]) {
        struct Solve<'a>(&'a Cholesky, &'a mut [Row]);
        impl pulp::NullaryFnOnce for Solve<'_> {
            type Output = ();
            #[inline(always)]
            fn call(self) {
                self.0.forward(self.1);
                self.0.backward(self.1);
            }
        }
        pulp::Arch::new().dispatch(Solve(self, x));
    }

    /// L y = b
    #[inline(always)]
    fn forward(&self, x: &mut [Row]) {
        for s in &self.supernodes {
            let (start, width) = (s.start as usize, s.width as usize);
            let values = &self.values[s.values..];
            for i in 0..width {
                let (above, below) = x.split_at_mut(start + i);
                let row = &values[i * width..][..width];
                subtract(&mut below[0], row, &above[start..]);
                below[0].iter_mut().for_each(|v| *v *= row[i]);
            }
            // the rows below are all beyond the diagonal block
            let (above, below) = x.split_at_mut(start + width);
            let entries = values[width * width..].chunks_exact(width);
            for (&r, row) in self.rows[s.rows.0 as usize..s.rows.1 as usize].iter().zip(entries) {
                subtract(&mut below[r as usize - start - width], row, &above[start..]);
            }
        }
    }

    /// Lᵀ x = y
    #[inline(always)]
    fn backward(&self, x: &mut [Row]) {
        for s in self.supernodes.iter().rev() {
            let (start, width) = (s.start as usize, s.width as usize);
            let values = &self.values[s.values..];
            let (above, below) = x.split_at_mut(start + width);
            let block = &mut above[start..];
            let entries = values[width * width..].chunks_exact(width);
            for (&r, row) in self.rows[s.rows.0 as usize..s.rows.1 as usize].iter().zip(entries) {
                scatter(block, row, &below[r as usize - start - width]);
            }
            for i in (0..width).rev() {
                let row = &values[i * width..][..width];
                let (before, now) = block.split_at_mut(i);
                now[0].iter_mut().for_each(|v| *v *= row[i]);
                scatter(before, row, &now[0]);
            }
        }
    }
}

/// y -= sum over j of a[j] x[j], for as many j as both have.
#[inline(always)]
fn subtract(y: &mut Row, a: &[f64], x: &[Row]) {
    let mut sum = *y;
    for (&a, x) in a.iter().zip(x) {
        for k in 0..LANES {
            sum[k] -= a * x[k];
        }
    }
    *y = sum;
}

/// y[j] -= a[j] x for every j that both have.
#[inline(always)]
fn scatter(y: &mut [Row], a: &[f64], x: &Row) {
    let x = *x;
    for (&a, y) in a.iter().zip(y) {
        for k in 0..LANES {
            y[k] -= a * x[k];
        }
    }
}

fn symbolic(a: &SymmetricMatrix) -> SymbolicSparseColMatRef<'_, u32> {
    SymbolicSparseColMatRef::new_checked(a.order(), a.order(), &a.columns, None, &a.rows)
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
        let pattern = Pattern::new(&a).unwrap();
        let factor = Cholesky::new(&pattern, &a).unwrap();
        let order = pattern.order();
        let exact = |k: usize| (0..50).map(|i| ((50 * k + i) as f64 * 0.7).sin()).collect::<Vec<f64>>();
        let mut block = vec![[0.0; LANES]; 50];
        let mut b = vec![0.0; 50];
        for k in 0..LANES {
            a.multiply(&exact(k), &mut b);
            (0..50).for_each(|i| block[i][k] = b[order[i] as usize]);
        }
        factor.solve_in_place(&mut block);
        for k in 0..LANES {
            let mut x = vec![0.0; 50];
            (0..50).for_each(|i| x[order[i] as usize] = block[i][k]);
            assert!(x.iter().zip(&exact(k)).all(|(p, q)| (p - q).abs() < 1e-14));
            a.multiply(&exact(k), &mut b);
            assert!(a.backward_error(&x, &b) < 1e-15);
            x[7] += 1e-3;
            assert!(a.backward_error(&x, &b) > 1e-5);
            x[7] = f64::NAN;
            assert!(!(a.backward_error(&x, &b) < 1.0));
        }
    }

    #[test]
    fn an_indefinite_matrix_is_refused() {
        let mut a = tridiagonal(5);
        a.values[0] = -3.0;
        assert!(matches!(Cholesky::new(&Pattern::new(&a).unwrap(), &a), Err(Error::Numeric(_))));
    }
}
