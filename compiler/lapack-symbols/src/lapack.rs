//! Factorisations and what is solved with them.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::arguments::{Triangle, View, ViewMut};
use crate::blas::symmetric;

/// Cholesky factor in the place of its triangle.
///
/// # Errors
/// The order of the first leading minor that is not positive.
pub(crate) fn potrf(triangle: Triangle, a: &mut ViewMut<'_>) -> Result<(), usize> {
    // Both triangles as the lower one: U of A = U'U is L' of A = L L'.
    let at = |i: usize, j: usize| if triangle == Triangle::Lower { (i, j) } else { (j, i) };
    for j in 0..a.nrows() {
        let square = a[at(j, j)] - (0..j).map(|k| a[at(j, k)] * a[at(j, k)]).sum::<f64>();
        if square.is_nan() || square <= 0.0 {
            return Err(j + 1);
        }
        let pivot = square.sqrt();
        a[at(j, j)] = pivot;
        for i in j + 1..a.nrows() {
            let product: f64 = (0..j).map(|k| a[at(i, k)] * a[at(j, k)]).sum();
            a[at(i, j)] = (a[at(i, j)] - product) / pivot;
        }
    }
    Ok(())
}

/// Solves A X = B in the place of B, with the factor from [`potrf`].
pub(crate) fn potrs(triangle: Triangle, factor: &View<'_>, b: &mut ViewMut<'_>) {
    // The diagonal of a Cholesky factor is positive, so the substitutions cannot fail.
    let _ = match triangle {
        Triangle::Lower => factor.solve_lower_triangular_mut(b) && factor.tr_solve_lower_triangular_mut(b),
        Triangle::Upper => factor.tr_solve_upper_triangular_mut(b) && factor.solve_upper_triangular_mut(b),
    };
}

/// Solves A X = B in the place of B; A becomes L and U, `pivots[k]` the row (from 0) that row k was exchanged with.
///
/// # Errors
/// k + 1 where U has a zero in place k; then B is not solved.
pub(crate) fn gesv(a: &mut ViewMut<'_>, pivots: &mut [usize], b: &mut ViewMut<'_>) -> Result<(), usize> {
    let singular = eliminate(a, pivots);
    if let Some(k) = singular {
        return Err(k + 1);
    }
    for (k, &p) in pivots.iter().enumerate() {
        b.swap_rows(k, p);
    }
    let unit_lower = DMatrix::from_fn(a.nrows(), a.nrows(), |i, j| match i.cmp(&j) {
        std::cmp::Ordering::Less => 0.0,
        std::cmp::Ordering::Equal => 1.0,
        std::cmp::Ordering::Greater => a[(i, j)],
    });
    // Neither has a zero on its diagonal.
    let _ = unit_lower.solve_lower_triangular_mut(b) && a.solve_upper_triangular_mut(b);
    Ok(())
}

/// LU with partial pivoting; the place of the first zero pivot.
fn eliminate(a: &mut ViewMut<'_>, pivots: &mut [usize]) -> Option<usize> {
    let n = a.nrows();
    let mut singular = None;
    for k in 0..n {
        let p = (k..n).max_by(|&i, &j| a[(i, k)].abs().total_cmp(&a[(j, k)].abs()).then(j.cmp(&i))).unwrap_or(k);
        pivots[k] = p;
        a.swap_rows(k, p);
        if a[(k, k)] == 0.0 {
            singular = singular.or(Some(k));
            continue;
        }
        for i in k + 1..n {
            a[(i, k)] /= a[(k, k)];
            for j in k + 1..n {
                a[(i, j)] -= a[(i, k)] * a[(k, j)];
            }
        }
    }
    singular
}

/// Eigenvalues in ascending order, and where wanted the eigenvectors as columns in the same order.
///
/// `None` where the entries are not finite or the iteration does not end.
pub(crate) fn eigen(a: &View<'_>, triangle: Triangle, vectors: bool) -> Option<(DVector<f64>, Option<DMatrix<f64>>)> {
    let whole = symmetric(a, triangle);
    if whole.iter().any(|entry| !entry.is_finite()) {
        return None;
    }
    if whole.is_empty() {
        return Some((DVector::zeros(0), vectors.then(|| DMatrix::zeros(0, 0))));
    }
    if !vectors {
        let mut values = whole.symmetric_eigenvalues();
        values.as_mut_slice().sort_by(f64::total_cmp);
        return Some((values, None));
    }
    let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::try_new(whole, f64::EPSILON, ITERATIONS)?;
    let mut order: Vec<usize> = (0..eigenvalues.len()).collect();
    order.sort_by(|&i, &j| eigenvalues[i].total_cmp(&eigenvalues[j]));
    let values = DVector::from_fn(order.len(), |k, _| eigenvalues[order[k]]);
    Some((values, Some(eigenvectors.select_columns(&order))))
}

/// Far beyond need: the iteration takes two or three steps per row.
const ITERATIONS: usize = 100_000;
