//! Singular values by one-sided Jacobi rotations.
//!
//! nalgebra's own decomposition fails on many singular matrices (0.35: of random 16 x 16 ones of rank 3, values and
//! product of the factors are off by up to the size of the matrix), and an interior-point method ends near singular ones. Jacobi's method is the most accurate there is and, for
//! the sizes of a semidefinite cone, fast enough (Demmel and Veselic, "Jacobi's method is more accurate than QR",
//! SIAM J. Matrix Anal. Appl. 13, 1992).

use nalgebra::{DMatrix, DVector};

use crate::arguments::View;

/// A = U diag(values) V', values descending, k = min(m, n) of them.
pub(crate) struct Svd {
    pub values: DVector<f64>,
    /// m x k, orthonormal columns.
    pub u: DMatrix<f64>,
    /// n x k, orthonormal columns.
    pub v: DMatrix<f64>,
}

/// `None` where an entry is not finite or the rotations do not end.
pub(crate) fn svd(a: &View<'_>) -> Option<Svd> {
    if a.iter().any(|entry| !entry.is_finite()) {
        return None;
    }
    if a.nrows() >= a.ncols() {
        return tall(a.clone_owned());
    }
    let Svd { values, u, v } = tall(a.transpose())?;
    Some(Svd { values, u: v, v: u })
}

/// Singular values of a matrix, descending, min(rows, columns) of them; `None` where an entry is not finite.
///
/// Each is off by at most a small multiple of the rounding unit times the largest, singular matrices included.
pub fn singular_values(a: &DMatrix<f64>) -> Option<DVector<f64>> {
    if a.iter().any(|entry| !entry.is_finite()) {
        return None;
    }
    let tall_one = if a.nrows() >= a.ncols() { a.clone() } else { a.transpose() };
    tall(tall_one).map(|svd| svd.values)
}

/// At least as many rows as columns: rotates pairs of columns until all are orthogonal.
fn tall(mut a: DMatrix<f64>) -> Option<Svd> {
    let n = a.ncols();
    let scale = a.amax();
    if scale > 0.0 {
        a /= scale;
    }
    let mut v = DMatrix::identity(n, n);
    let negligible = f64::EPSILON * n as f64 * a.norm();
    let settled = (0..MOST_SWEEPS).any(|_| !sweep(&mut a, &mut v, negligible));
    settled.then(|| sorted(a, v, scale, negligible))
}

/// Sweeps until convergence are five to ten; it is quadratic at the end.
const MOST_SWEEPS: usize = 60;

/// Every pair of columns once; whether any was rotated.
fn sweep(a: &mut DMatrix<f64>, v: &mut DMatrix<f64>, negligible: f64) -> bool {
    let (n, mut rotated) = (a.ncols(), false);
    for p in 0..n {
        for q in p + 1..n {
            let (one, other) = (a.column(p).norm_squared(), a.column(q).norm_squared());
            let product = a.column(p).dot(&a.column(q));
            // A column that is rounding error has no direction to settle.
            let noise = one.min(other).sqrt() <= negligible;
            if noise || product.abs() <= 4.0 * f64::EPSILON * (one * other).sqrt() {
                continue;
            }
            let zeta = (other - one) / (2.0 * product);
            let tangent = zeta.signum() / (zeta.abs() + zeta.hypot(1.0));
            let cosine = 1.0 / tangent.hypot(1.0);
            rotate(a, p, q, cosine, cosine * tangent);
            rotate(v, p, q, cosine, cosine * tangent);
            rotated = true;
        }
    }
    rotated
}

fn rotate(matrix: &mut DMatrix<f64>, p: usize, q: usize, cosine: f64, sine: f64) {
    let rows = matrix.nrows();
    let (before, from_q) = matrix.as_mut_slice().split_at_mut(q * rows);
    for (x, y) in before[p * rows..(p + 1) * rows].iter_mut().zip(&mut from_q[..rows]) {
        (*x, *y) = (cosine * *x - sine * *y, sine * *x + cosine * *y);
    }
}

/// The norms of the columns are the singular values, and their directions U.
fn sorted(a: DMatrix<f64>, v: DMatrix<f64>, scale: f64, negligible: f64) -> Svd {
    let norms: Vec<f64> = a.column_iter().map(|column| column.norm()).collect();
    let mut order: Vec<usize> = (0..norms.len()).collect();
    order.sort_by(|&i, &j| norms[j].total_cmp(&norms[i]));
    let mut u = a.select_columns(&order);
    for (k, &column) in order.iter().enumerate() {
        let direction = if norms[column] > negligible { u.column(k) / norms[column] } else { free(&u, k) };
        u.set_column(k, &direction);
    }
    Svd { values: DVector::from_fn(order.len(), |k, _| scale * norms[order[k]]), u, v: v.select_columns(&order) }
}

/// A unit vector orthogonal to the first `k` columns: the axis that is furthest from them, made orthogonal twice, which
/// is enough.
fn free(u: &DMatrix<f64>, k: usize) -> DVector<f64> {
    let known = u.columns(0, k);
    let shares = DVector::from_fn(u.nrows(), |i, _| known.row(i).norm_squared());
    let mut axis = DVector::zeros(u.nrows());
    axis[shares.imin()] = 1.0;
    for _ in 0..2 {
        let inside = known * known.tr_mul(&axis);
        axis = (axis - inside).normalize();
    }
    axis
}
