//! The two loops over a dense symmetric matrix in which most of the time goes.
//!
//! Each is compiled for several instruction sets, without fused multiply-add, so that all of them
//! give the same bits.

// `multiversion` checks what the CPU has and then calls the version compiled for it.
#![allow(unsafe_code)]

use multiversion::multiversion;

/// A −= k₀g₀ᵀ + k₁g₁ᵀ for a matrix of rows of `stride` numbers, of which the first n = `g[0].len()`
/// of the first n rows count.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn subtract_rank_two(matrix: &mut [f64], stride: usize, k: [&[f64]; 2], g: [&[f64]; 2]) {
    let n = g[0].len();
    for (i, row) in matrix.chunks_exact_mut(stride).take(n).enumerate() {
        let (a, b) = (k[0][i], k[1][i]);
        let row = &mut row[..n];
        for ((value, g0), g1) in row.iter_mut().zip(g[0]).zip(g[1]) {
            *value -= a * g0 + b * g1;
        }
    }
}

/// Turns a symmetric positive definite matrix of n rows of `stride` numbers into its inverse, and
/// gives ln det of what it was; `None` if it is not positive definite.
///
/// The sweep operator, two pivots at a time (Lange, Numerical Analysis for Statisticians, 2010,
/// §7.4).
pub(super) fn invert(matrix: &mut [f64], stride: usize, n: usize) -> Option<f64> {
    let mut ln_det = 0.0;
    let mut columns = [vec![0.0; n], vec![0.0; n]];
    let mut scaled = [vec![0.0; n], vec![0.0; n]];
    for pivot in (0..n).step_by(2) {
        let at = |i: usize, j: usize| i * stride + j;
        let (p, q) = (pivot, pivot + 1);
        let (xx, xy, yy) = (matrix[at(p, p)], matrix[at(p, q)], matrix[at(q, q)]);
        let det = xx * yy - xy * xy;
        if !(xx > 0.0 && det > 0.0) {
            return None;
        }
        ln_det += libm::log(det);
        let inverse = [yy / det, -xy / det, xx / det];
        columns[0].copy_from_slice(&matrix[at(p, 0)..at(p, n)]);
        columns[1].copy_from_slice(&matrix[at(q, 0)..at(q, n)]);
        // Rows and columns of the pivot are set below; here they must stay out.
        for column in &mut columns {
            column[p] = 0.0;
            column[q] = 0.0;
        }
        for i in 0..n {
            let (a, b) = (columns[0][i], columns[1][i]);
            scaled[0][i] = inverse[0] * a + inverse[1] * b;
            scaled[1][i] = inverse[1] * a + inverse[2] * b;
        }
        let k = [&scaled[0][..], &scaled[1][..]];
        subtract_rank_two(matrix, stride, k, [&columns[0], &columns[1]]);
        for i in 0..n {
            for (row, values) in [p, q].into_iter().zip(&scaled) {
                matrix[at(row, i)] = values[i];
                matrix[at(i, row)] = values[i];
            }
        }
        matrix[at(p, p)] = -inverse[0];
        matrix[at(p, q)] = -inverse[1];
        matrix[at(q, p)] = -inverse[1];
        matrix[at(q, q)] = -inverse[2];
    }
    for row in matrix.chunks_exact_mut(stride).take(n) {
        row[..n].iter_mut().for_each(|value| *value = -*value);
    }
    Some(ln_det)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    #[test]
    fn the_sweep_inverts() {
        let n = 6;
        let root = DMatrix::from_fn(n, n, |i, j| ((3 * i + 7 * j) % 5) as f64 - 1.0);
        let matrix = &root * root.transpose() + DMatrix::identity(n, n);
        let stride = 8;
        let mut rows = vec![0.0; stride * n];
        for i in 0..n {
            for j in 0..n {
                rows[i * stride + j] = matrix[(i, j)];
            }
        }
        let ln_det = invert(&mut rows, stride, n).expect("positive definite");
        let expected = matrix.clone().try_inverse().expect("positive definite");
        for i in 0..n {
            for j in 0..n {
                assert!((rows[i * stride + j] - expected[(i, j)]).abs() < 1e-12);
            }
        }
        assert!((ln_det - matrix.determinant().ln()).abs() < 1e-12);
        rows[0] = -1.0;
        assert_eq!(invert(&mut rows, stride, n), None);
    }
}
