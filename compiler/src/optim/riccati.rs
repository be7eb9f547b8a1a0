//! Discrete-time algebraic Riccati equation.
#![expect(non_snake_case, reason = "the symbols of the literature")]

use nalgebra::DMatrix;

/// Stabilising feedback u = K x of the linear-quadratic regulator for x+ = A x + B u with weights Q, R.
///
/// Structure-preserving doubling (Chu, Fan, Lin, Wang, "Structure-preserving algorithms for periodic discrete-time
/// algebraic Riccati equations", Int. J. Control 77, 2004). `None` where the iteration does not settle, which is
/// what an unstabilisable (A, B) does; the caller still has to check that A + B K is Schur.
pub fn lqr(A: &DMatrix<f64>, B: &DMatrix<f64>, Q: &DMatrix<f64>, R: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let X = solve(A, B, Q, R)?;
    let gram = R + B.transpose() * &X * B;
    let K = -(gram.cholesky()?.solve(&(B.transpose() * &X * A)));
    K.iter().all(|k| k.is_finite()).then_some(K)
}

/// The stabilising solution X of X = A'XA - A'XB (R + B'XB)^-1 B'XA + Q.
fn solve(A: &DMatrix<f64>, B: &DMatrix<f64>, Q: &DMatrix<f64>, R: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = A.nrows();
    let mut A_k = A.clone();
    let mut G_k = B * R.clone().cholesky()?.solve(&B.transpose());
    let mut H_k = Q.clone();
    for _ in 0..60 {
        let lu = (DMatrix::identity(n, n) + &G_k * &H_k).lu();
        let W_A = lu.solve(&A_k)?;
        let W_G = lu.solve(&G_k)?;
        let step = A_k.transpose() * &H_k * &W_A;
        G_k += &A_k * W_G * A_k.transpose();
        A_k = &A_k * W_A;
        H_k += &step;
        H_k = (&H_k + H_k.transpose()) * 0.5;
        // An unreachable unstable mode doubles the exponent of its cost in every step.
        let size = H_k.norm();
        if size.is_nan() || size > 1e30 * (1.0 + Q.norm()) {
            return None;
        }
        if step.norm() <= 1e-15 * H_k.norm() {
            return Some(H_k);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn residual_of_the_equation_is_at_rounding_level() {
        let A = DMatrix::from_row_slice(2, 2, &[1.0, 0.1, 0.0, 1.0]);
        let B = DMatrix::from_row_slice(2, 1, &[0.005, 0.1]);
        let (Q, R) = (DMatrix::identity(2, 2), DMatrix::identity(1, 1));
        let X = solve(&A, &B, &Q, &R).unwrap();
        let gain = (&R + B.transpose() * &X * &B).try_inverse().unwrap() * B.transpose() * &X * &A;
        let residual = A.transpose() * &X * &A - A.transpose() * &X * &B * gain + &Q - &X;
        assert!(residual.norm() < 1e-10 * X.norm());
    }

    #[test]
    fn scalar_case_has_the_closed_form() {
        // X = a^2 X - a^2 X^2 b^2 / (r + b^2 X) + q with a = 2, b = q = r = 1: X^2 - 4 X - 1 = 0.
        let one = DMatrix::from_element(1, 1, 1.0);
        let K = lqr(&DMatrix::from_element(1, 1, 2.0), &one, &one, &one).unwrap();
        let X = 2.0 + 5.0_f64.sqrt();
        assert!((K[(0, 0)] + 2.0 * X / (1.0 + X)).abs() < 1e-12);
    }

    #[test]
    fn an_uncontrollable_unstable_mode_has_no_solution() {
        let A = DMatrix::from_row_slice(2, 2, &[1.2, 0.0, 0.0, 0.5]);
        let B = DMatrix::from_row_slice(2, 1, &[0.0, 1.0]);
        assert!(lqr(&A, &B, &DMatrix::identity(2, 2), &DMatrix::identity(1, 1)).is_none());
    }
}
