//! Modes of a matrix as directions.
#![expect(non_snake_case, reason = "the symbols of the literature")]

use nalgebra::{Complex, DMatrix, DVector};

use super::lyapunov::eigenvalues;

/// Normals of a set that F contracts, as rows: the left eigenvector of each real eigenvalue, and for each complex pair
/// of modulus r the directions Re(exp(i k pi / m) v), k < m, of its left eigenvector v. Rotation by any angle fits the
/// polygon of these 2 m facets into itself scaled by 1 / cos(pi / (2 m)), so m is chosen for r < cos(pi / (2 m)).
///
/// Fewer rows than states come back where F cannot be diagonalised.
pub fn modal_normals(F: &DMatrix<f64>) -> DMatrix<f64> {
    let n = F.nrows();
    let mut rows: Vec<DVector<f64>> = Vec::new();
    for (re, im) in eigenvalues(F).unwrap_or_default().into_iter().filter(|(_, im)| *im >= 0.0) {
        let Some(v) = left_eigenvector(F, Complex::new(re, im)) else { continue };
        let m = if im == 0.0 { 1 } else { polygon(re.hypot(im)) };
        for k in 0..m {
            let turn = Complex::from_polar(1.0, std::f64::consts::PI * k as f64 / m as f64);
            rows.push(v.map(|entry| (entry * turn).re));
        }
    }
    DMatrix::from_fn(rows.len(), n, |i, j| rows[i][j])
}

/// Strips of a polygon that a rotation contracted by `r` maps well into itself; at most 60.
fn polygon(r: f64) -> usize {
    let half_way = 0.5 * (1.0 + r);
    let m = (std::f64::consts::FRAC_PI_2 / half_way.min(1.0).acos().max(0.01)).ceil();
    (m as usize).clamp(2, 60)
}

/// v with v F = lambda v, by inverse iteration; of real eigenvalues a real one.
fn left_eigenvector(F: &DMatrix<f64>, lambda: Complex<f64>) -> Option<DVector<Complex<f64>>> {
    let n = F.nrows();
    // A shift next to the eigenvalue keeps the factorisation regular.
    let shift = lambda * (1.0 + 1e-9) + Complex::new(1e-12, 0.0);
    let shifted = F.transpose().map(|entry| Complex::new(entry, 0.0)) - DMatrix::from_diagonal_element(n, n, shift);
    let lu = shifted.lu();
    let mut v = DVector::from_fn(n, |k, _| Complex::new(1.0 + 0.1 * k as f64, 0.0));
    for _ in 0..4 {
        v = lu.solve(&v)?;
        let largest = v.iter().copied().max_by(|a, b| a.norm().total_cmp(&b.norm()))?;
        v /= largest;
    }
    v.iter().all(|entry| entry.re.is_finite() && entry.im.is_finite()).then_some(v)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::convex::rpi_on_normals;

    /// A slow rotation has no invariant box, and needs many facets: the modes give them.
    #[test]
    fn a_slow_rotation_gets_an_invariant_polygon() {
        let (sin, cos) = 0.3_f64.sin_cos();
        let F = DMatrix::from_row_slice(2, 2, &[cos, -2.0 * sin, 0.5 * sin, cos]) * 0.995;
        let P = modal_normals(&F);
        let set = rpi_on_normals(&P, &F, &DVector::from_element(P.nrows(), 1.0));
        assert!(set.is_some_and(|set| set.q.amax() < 1000.0));
    }

    #[test]
    fn real_modes_are_left_eigenvectors() {
        let F = DMatrix::from_row_slice(2, 2, &[0.9, 1.0, 0.0, 0.5]);
        let P = modal_normals(&F);
        for row in P.row_iter() {
            let image = row * &F;
            assert!((image[0] * row[1] - image[1] * row[0]).abs() < 1e-9);
        }
        assert_eq!(P.nrows(), 2);
    }
}
