//! Leading eigenpairs of a large symmetric matrix of which only products with blocks of vectors are known.

use crate::error::{Error, Result, try_filled};
use crate::job::Job;
use faer::{Mat, Side};
use rayon::prelude::*;

/// Vectors beyond the wanted ones: they make the iteration converge faster and keep close eigenvalues apart.
const SPARE: usize = 8;
/// Iterations after which the pairs are taken as they are.
const ITERATIONS: usize = 60;
/// Residual |A x - λ x| at which a pair counts as found, relative to the largest |λ|.
const TOLERANCE: f64 = 1e-8;
/// Rows in one piece of a sum over rows. Fixed, so that roundings do not depend on the number of threads.
const CHUNK: usize = 256;

/// Eigenvalues in falling order and their vectors.
#[derive(Debug, Clone)]
pub struct Eigenpairs {
    /// The algebraically largest eigenvalues, falling.
    pub values: Vec<f64>,
    /// `values.len()` numbers a row: entry k of row i is component i of the k-th unit eigenvector, of either sign.
    pub vectors: Vec<f64>,
}

/// The `count` largest eigenpairs of a symmetric positive semidefinite operator of order `n` (fewer if n is less) by
/// block subspace iteration with Rayleigh-Ritz projection. `apply(x, width, y)` writes A X to `y`; both are n rows of
/// `width` numbers, and it must not round differently on different numbers of threads.
///
/// # Errors
/// [`Error::NoMemory`], [`Error::Cancelled`], [`Error::Numeric`] when the operator is not finite.
pub fn leading(
    n: usize,
    count: usize,
    apply: impl Fn(&[f64], usize, &mut [f64]) -> Result<()>,
    job: &Job,
) -> Result<Eigenpairs> {
    let count = count.min(n);
    if count == 0 {
        return Ok(Eigenpairs { values: Vec::new(), vectors: Vec::new() });
    }
    let width = (count + (count / 2).max(SPARE)).min(n);
    let mut x = try_filled(n * width, 0.0, "eigenvectors")?;
    let mut y = try_filled(n * width, 0.0, "eigenvectors")?;
    for (i, v) in x.iter_mut().enumerate() {
        *v = noise(i as u64);
    }
    let mut values = vec![0.0; width];
    orthonormalise(&mut x, width)?;
    for iteration in 0..ITERATIONS {
        job.check()?;
        apply(&x, width, &mut y)?;
        // --- Rayleigh-Ritz on the current block
        let h = gram(&x, &y, width);
        let (ritz, rotation) = dense(&h, width)?;
        rotate(&mut x, &rotation, width);
        rotate(&mut y, &rotation, width);
        values.copy_from_slice(&ritz);
        let residual = residuals(&x, &y, &values, width);
        let largest = values.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        if residual[..count].iter().all(|r| *r <= TOLERANCE * largest) || width == n || iteration + 1 == ITERATIONS {
            break;
        }
        x.copy_from_slice(&y);
        orthonormalise(&mut x, width)?;
    }
    let mut vectors = try_filled(n * count, 0.0, "eigenvectors")?;
    for (to, from) in vectors.chunks_mut(count).zip(x.chunks(width)) {
        to.copy_from_slice(&from[..count]);
    }
    values.truncate(count);
    Ok(Eigenpairs { values, vectors })
}

/// Y = A X for a dense symmetric matrix of `n` rows; blocks of `width` vectors.
pub fn multiply_dense(a: &[f64], n: usize, x: &[f64], width: usize, y: &mut [f64]) {
    y.par_chunks_mut(width.max(1)).zip(a.par_chunks(n.max(1))).for_each(|(y, row)| {
        y.fill(0.0);
        for (&a, x) in row.iter().zip(x.chunks_exact(width)) {
            for (y, x) in y.iter_mut().zip(x) {
                *y += a * x;
            }
        }
    });
}

/// A number between -1 and 1 that depends on nothing but `i` (splitmix64).
fn noise(i: u64) -> f64 {
    let mut z = i.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    (z ^ (z >> 31)) as i64 as f64 / i64::MAX as f64
}

/// Xᵀ Y, symmetrised, in row-major order.
fn gram(x: &[f64], y: &[f64], width: usize) -> Vec<f64> {
    let parts: Vec<Vec<f64>> = x
        .par_chunks(CHUNK * width)
        .zip(y.par_chunks(CHUNK * width))
        .map(|(x, y)| {
            let mut sum = vec![0.0; width * width];
            for (x, y) in x.chunks_exact(width).zip(y.chunks_exact(width)) {
                for (sum, x) in sum.chunks_exact_mut(width).zip(x) {
                    for (s, y) in sum.iter_mut().zip(y) {
                        *s += x * y;
                    }
                }
            }
            sum
        })
        .collect();
    let mut sum = vec![0.0; width * width];
    for part in parts {
        sum.iter_mut().zip(part).for_each(|(s, p)| *s += p);
    }
    (0..width * width).map(|k| 0.5 * (sum[k] + sum[k % width * width + k / width])).collect()
}

/// Eigenvalues in falling order and vectors (row-major, one column a vector) of a small symmetric matrix.
fn dense(h: &[f64], width: usize) -> Result<(Vec<f64>, Vec<f64>)> {
    if h.iter().any(|v| !v.is_finite()) {
        return Err(Error::Numeric("the eigenvalue iteration met a number that is not finite".into()));
    }
    let matrix = Mat::from_fn(width, width, |i, j| h[i * width + j]);
    let eigen = matrix
        .self_adjoint_eigen(Side::Lower)
        .map_err(|_| Error::Numeric("the small eigenvalue problem did not converge".into()))?;
    let (s, u) = (eigen.S().column_vector(), eigen.U());
    let mut order: Vec<usize> = (0..width).collect();
    order.sort_by(|&i, &j| s[j].total_cmp(&s[i]));
    let values = order.iter().map(|&k| s[k]).collect();
    let vectors = (0..width * width).map(|k| u[(k / width, order[k % width])]).collect();
    Ok((values, vectors))
}

/// X ← X R
fn rotate(x: &mut [f64], r: &[f64], width: usize) {
    x.par_chunks_mut(CHUNK * width).for_each(|rows| {
        let mut out = vec![0.0; width];
        for row in rows.chunks_exact_mut(width) {
            out.fill(0.0);
            for (x, r) in row.iter().zip(r.chunks_exact(width)) {
                for (o, r) in out.iter_mut().zip(r) {
                    *o += x * r;
                }
            }
            row.copy_from_slice(&out);
        }
    });
}

/// Orthonormal basis of the span of the columns, twice for the sake of rounding. Directions that vanish are replaced by
/// zeros, which the next products leave as they are.
fn orthonormalise(x: &mut [f64], width: usize) -> Result<()> {
    for _ in 0..2 {
        let (values, mut basis) = dense(&gram(x, x, width), width)?;
        let largest = values[0].max(0.0);
        for row in basis.chunks_exact_mut(width) {
            for (b, &v) in row.iter_mut().zip(&values) {
                *b = if v > 1e-28 * largest && v > 0.0 { *b / v.sqrt() } else { 0.0 };
            }
        }
        rotate(x, &basis, width);
    }
    Ok(())
}

/// |y_k - λ_k x_k| of every column.
fn residuals(x: &[f64], y: &[f64], values: &[f64], width: usize) -> Vec<f64> {
    let mut sum = vec![0.0; width];
    for (x, y) in x.chunks_exact(width).zip(y.chunks_exact(width)) {
        for k in 0..width {
            sum[k] += (y[k] - values[k] * x[k]).powi(2);
        }
    }
    sum.iter().map(|s: &f64| s.sqrt()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::CancelToken;

    fn dense_product(a: &[f64], n: usize, x: &[f64], width: usize, y: &mut [f64]) -> Result<()> {
        multiply_dense(a, n, x, width, y);
        Ok(())
    }

    #[test]
    fn pairs_of_a_matrix_with_known_spectrum() {
        // kernel of Brownian motion, min(i, j): eigenvalues 1 / (4 sin²((2k-1) π / (4n + 2)))
        let n = 300;
        let a: Vec<f64> = (0..n * n).map(|k| 1.0 + (k / n).min(k % n) as f64).collect();
        let job = Job::new(1, None, CancelToken::default());
        let out = leading(n, 12, |x, w, y| dense_product(&a, n, x, w, y), &job).unwrap();
        for k in 0..12 {
            let angle = (2 * k + 1) as f64 * std::f64::consts::PI / (4 * n + 2) as f64;
            let exact = 1.0 / (4.0 * angle.sin().powi(2));
            assert!((out.values[k] / exact - 1.0).abs() < 1e-8, "{k}: {} {exact}", out.values[k]);
        }
        let v = |i: usize, k: usize| out.vectors[i * 12 + k];
        for k in 0..12 {
            for l in 0..12 {
                let dot: f64 = (0..n).map(|i| v(i, k) * v(i, l)).sum();
                assert!((dot - f64::from(k == l)).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn equal_eigenvalues_and_rank_less_than_asked() {
        // two blocks of ones: eigenvalue n/2 twice, the rest 0
        let n = 64;
        let a: Vec<f64> = (0..n * n).map(|k| f64::from((k / n < n / 2) == (k % n < n / 2))).collect();
        let job = Job::new(1, None, CancelToken::default());
        let out = leading(n, 4, |x, w, y| dense_product(&a, n, x, w, y), &job).unwrap();
        assert!((out.values[0] - 32.0).abs() < 1e-9 && (out.values[1] - 32.0).abs() < 1e-9, "{:?}", out.values);
        assert!(out.values[2].abs() < 1e-9 && out.vectors.iter().all(|v| v.is_finite()));
    }
}
