//! Lyapunov equations, spectral radii, and norms in which a matrix contracts.
#![expect(non_snake_case, reason = "the symbols of the literature")]

use nalgebra::linalg::Schur;
use nalgebra::linalg::balancing::balance_parlett_reinsch;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// The solution P of F'PF - P = -M for Schur F, by the squared Smith iteration. `None` where it does not converge.
pub fn lyapunov(F: &DMatrix<f64>, M: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let mut P = M.clone();
    let mut F_k = F.clone();
    for _ in 0..64 {
        let step = F_k.transpose() * &P * &F_k;
        P += &step;
        P = (&P + P.transpose()) * 0.5;
        if !P.norm().is_finite() {
            return None;
        }
        if step.norm() <= 1e-16 * P.norm() {
            return Some(P);
        }
        F_k = &F_k * &F_k;
    }
    None
}

/// Largest modulus of the eigenvalues of F; 0 for an empty matrix.
pub fn spectral_radius(F: &DMatrix<f64>) -> f64 {
    match eigenvalues(F) {
        Some(eigenvalues) => eigenvalues.iter().fold(0.0, |radius, (re, im)| radius.max(re.hypot(*im))),
        None => radius_by_squaring(F),
    }
}

/// Eigenvalues as (real, imaginary) parts; `None` where the iteration does not converge, as can happen with many equal
/// eigenvalues.
pub fn eigenvalues(F: &DMatrix<f64>) -> Option<Vec<(f64, f64)>> {
    if F.is_empty() {
        return Some(Vec::new());
    }
    let schur = [1.0, 1e3].into_iter().find_map(|loose| Schur::try_new(F.clone(), loose * f64::EPSILON, 1000));
    schur.map(|schur| schur.complex_eigenvalues().iter().map(|e| (e.re, e.im)).collect())
}

/// Gelfand's formula: |F^(2^k)|^(1/2^k) with F scaled after every squaring, so that only its logarithm grows.
fn radius_by_squaring(F: &DMatrix<f64>) -> f64 {
    let (mut power, mut logarithm, mut weight) = (F.clone(), 0.0, 1.0);
    for _ in 0..60 {
        let size = power.norm();
        if size == 0.0 || !size.is_finite() {
            return if size == 0.0 { 0.0 } else { f64::INFINITY };
        }
        logarithm += weight * size.ln();
        power /= size;
        power = &power * &power;
        weight *= 0.5;
    }
    f64::exp(logarithm)
}

/// A norm |x|_P = sqrt(x'Px) in which F contracts: |F x|_P <= lambda |x|_P, lambda < 1.
///
/// It is the proof that F is Schur, and the tail bound of every sum over powers of F.
#[derive(Debug, Clone)]
pub struct Contraction {
    pub P: DMatrix<f64>,
    pub lambda: f64,
    /// Units of the balanced coordinates x_k / unit_k: P >= diag(1 / unit_k^2).
    pub units: DVector<f64>,
    factor: Cholesky<f64, Dyn>,
}

impl Contraction {
    /// A contraction of F, or `None` where F is not Schur by a margin that double precision can prove.
    ///
    /// In balanced coordinates, so that units do not decide, P solves (F/lambda)'P(F/lambda) - P = -I; half of the
    /// identity must survive as lambda^2 P - F'PF, checked by a Cholesky factorisation, so rounding (about 1e-16 |P|)
    /// cannot have decided.
    pub fn new(F: &DMatrix<f64>) -> Option<Self> {
        let n = F.nrows();
        let radius = spectral_radius(F);
        if radius.is_nan() || radius >= 1.0 {
            return None;
        }
        let mut balanced = F.clone();
        // Powers of two: the similarity is exact.
        let units = balance_parlett_reinsch(&mut balanced);
        let lambda = 0.5 * (1.0 + radius);
        let P = lyapunov(&(&balanced / lambda), &DMatrix::identity(n, n))?;
        let decrease = &P * (lambda * lambda) - balanced.transpose() * &P * &balanced;
        let margin = DMatrix::identity(n, n) * (0.5 * lambda * lambda);
        Cholesky::new(decrease - margin)?;
        if P.norm() * n as f64 > 1e13 {
            return None;
        }
        let P = DMatrix::from_fn(n, n, |i, j| P[(i, j)] / (units[i] * units[j]));
        let factor = Cholesky::new(P.clone())?;
        Some(Self { P, lambda, units, factor })
    }

    /// |x|_P.
    pub fn norm(&self, x: &DVector<f64>) -> f64 {
        (self.factor.l().transpose() * x).norm()
    }

    /// Upper bound of |x|_P over all |x_k| <= size_k.
    pub fn norm_of_box(&self, size: &DVector<f64>) -> f64 {
        size.iter().zip(self.P.diagonal().iter()).map(|(size, p)| size * p.sqrt()).sum()
    }

    /// Dual norm: the largest d'x over |x|_P <= 1.
    pub fn dual_norm(&self, d: &DVector<f64>) -> f64 {
        self.factor.l().solve_lower_triangular(d).map_or(f64::INFINITY, |y| y.norm())
    }

    /// Upper bound of the dual norm over all |d_k| <= size_k: P >= diag(1 / unit_k^2).
    pub fn dual_norm_of_box(&self, size: &DVector<f64>) -> f64 {
        size.component_mul(&self.units).norm()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scalar_lyapunov_has_the_closed_form() {
        let P = lyapunov(&DMatrix::from_element(1, 1, 0.5), &DMatrix::from_element(1, 1, 3.0)).unwrap();
        assert!((P[(0, 0)] - 4.0).abs() < 1e-14);
    }

    #[test]
    fn radius_of_a_rotation_is_its_scale() {
        let F = DMatrix::from_row_slice(2, 2, &[0.0, -0.9, 0.9, 0.0]);
        assert!((spectral_radius(&F) - 0.9).abs() < 1e-12);
    }

    #[test]
    fn squaring_gives_the_same_radius() {
        let F = DMatrix::from_row_slice(3, 3, &[0.9, 5.0, 0.1, 0.0, 0.95, -2.0, 0.1, 0.0, 0.3]);
        assert!((radius_by_squaring(&F) - spectral_radius(&F)).abs() < 1e-9);
        let many_equal = DMatrix::from_diagonal_element(9, 9, 0.5);
        assert!((spectral_radius(&many_equal) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn contraction_bounds_every_step() {
        let F = DMatrix::from_row_slice(2, 2, &[0.99, 5.0, 0.0, 0.98]);
        let contraction = Contraction::new(&F).unwrap();
        let mut x = DVector::from_vec(vec![0.3, -1.0]);
        for _ in 0..50 {
            let next = &F * &x;
            assert!(contraction.norm(&next) <= contraction.lambda * contraction.norm(&x) * (1.0 + 1e-9));
            x = next;
        }
    }

    #[test]
    fn dual_norm_bounds_the_product() {
        let F = DMatrix::from_row_slice(2, 2, &[0.5, 0.4, -0.3, 0.2]);
        let contraction = Contraction::new(&F).unwrap();
        let (d, x) = (DVector::from_vec(vec![1.0, -2.0]), DVector::from_vec(vec![0.4, 0.7]));
        let product: f64 = d.dot(&x);
        assert!(product.abs() <= contraction.dual_norm(&d) * contraction.norm(&x) * (1.0 + 1e-12));
    }

    /// A double integrator in micrometres and metres per second: the same system as in metres.
    #[test]
    fn units_do_not_decide() {
        let metres = DMatrix::from_row_slice(2, 2, &[0.9, 0.1, -0.5, 0.5]);
        let mixed = DMatrix::from_row_slice(2, 2, &[0.9, 0.1e9, -0.5e-9, 0.5]);
        assert!(Contraction::new(&metres).is_some());
        let contraction = Contraction::new(&mixed).unwrap();
        for x in [[1.0, 0.0], [0.0, 1e-9], [1.0, -1e-9], [3.0, 2e-9]].map(|x| DVector::from_row_slice(&x)) {
            assert!(contraction.norm(&(&mixed * &x)) <= contraction.lambda * contraction.norm(&x) * (1.0 + 1e-9));
            assert!(contraction.norm(&x) <= contraction.norm_of_box(&x.abs()) * (1.0 + 1e-9));
            assert!(contraction.dual_norm(&x) <= contraction.dual_norm_of_box(&x.abs()) * (1.0 + 1e-9));
        }
    }

    #[test]
    fn an_unstable_matrix_has_no_contraction() {
        assert!(Contraction::new(&DMatrix::from_element(1, 1, 1.0)).is_none());
    }
}
