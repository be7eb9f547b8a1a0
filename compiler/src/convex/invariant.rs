#![expect(non_snake_case, reason = "the symbols of the literature")]

use nalgebra::{DMatrix, DVector};

use super::strips::{Multiplier, multipliers};
use crate::optim::lyapunov::spectral_radius;

/// {x : |P x| <= q} with the proof that F maps it, plus a disturbance w with |P w| <= r, into itself: rows lambda_k
/// with lambda_k P = (P F)_k and |Lambda| q + r <= q.
#[derive(Debug, Clone)]
pub struct Invariant {
    pub q: DVector<f64>,
    pub Lambda: Vec<Multiplier>,
}

impl Invariant {
    /// |Lambda|, r x r.
    pub fn abs_Lambda(&self) -> DMatrix<f64> {
        abs_matrix(&self.Lambda)
    }
}

/// The smallest set {|P x| <= q} that is robustly positively invariant for x+ = F x + w, |P w| <= r.
///
/// The offsets are the least fixed point of q = h(F S(q)) + r, the one-step problem of Trodden ("A one-step approach
/// to computing a polytopic robust positively invariant set", IEEE TAC 61, 2016), found here by policy iteration:
/// for fixed multipliers the fixed point is a linear system, and each choice of better multipliers can only shrink
/// it. Until a choice with a contracting |Lambda| is known, plain fixed-point steps from below are taken. `None`
/// where these normals admit no such set, or none was found in the step limit.
pub fn rpi_on_normals(P: &DMatrix<f64>, F: &DMatrix<f64>, r: &DVector<f64>) -> Option<Invariant> {
    let PF = P * F;
    let mut q = r.clone();
    for _ in 0..STEPS {
        let Lambda = multipliers(P, &q, &PF)?;
        let abs = abs_matrix(&Lambda);
        match fixed_point(&abs, r) {
            Some(next) if settled(&q, &next) => return Some(Invariant { q: next, Lambda }),
            Some(next) => q = next,
            None => q = &abs * &q + r,
        }
        if !q.amax().is_finite() || q.amax() > 1e9 * r.amax() {
            return None;
        }
    }
    None
}

/// Where no contracting choice of multipliers has shown by then, none does.
const STEPS: usize = 50;

/// q = |Lambda| q + r where the spectral radius is below 1.
fn fixed_point(abs: &DMatrix<f64>, r: &DVector<f64>) -> Option<DVector<f64>> {
    if spectral_radius(abs) >= 1.0 - 1e-9 {
        return None;
    }
    let q = (DMatrix::identity(abs.nrows(), abs.nrows()) - abs).lu().solve(r)?;
    q.iter().zip(r).all(|(q, r)| q.is_finite() && q >= r).then_some(q)
}

fn settled(q: &DVector<f64>, next: &DVector<f64>) -> bool {
    q.iter().zip(next).all(|(q, next)| (q - next).abs() <= 1e-12 * next.abs())
}

fn abs_matrix(Lambda: &[Multiplier]) -> DMatrix<f64> {
    let r = Lambda.len();
    DMatrix::from_fn(r, r, |i, j| Lambda[i].mu[j].abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn published() -> DMatrix<f64> {
        DMatrix::from_row_slice(2, 2, &[-0.17, -0.03, -1.17, -0.03])
    }

    /// Support of the unit inf-ball in the rows of P: their 1-norms.
    fn unit_box(P: &DMatrix<f64>) -> DVector<f64> {
        DVector::from_fn(P.nrows(), |i, _| P.row(i).iter().map(|p| p.abs()).sum())
    }

    #[test]
    fn axis_normals_give_the_published_box() {
        let P = DMatrix::identity(2, 2);
        let set = rpi_on_normals(&P, &published(), &unit_box(&P)).unwrap();
        assert!((set.q[0] - 1.298701).abs() < 1e-6 && (set.q[1] - 2.597403).abs() < 1e-6);
    }

    #[test]
    fn eight_normals_give_the_published_offsets() {
        let angle = std::f64::consts::FRAC_PI_4;
        let P = DMatrix::from_fn(4, 2, |k, j| if j == 0 { (k as f64 * angle).cos() } else { (k as f64 * angle).sin() });
        let set = rpi_on_normals(&P, &published(), &unit_box(&P)).unwrap();
        for (q, expected) in set.q.iter().zip([1.298701, 2.754961, 2.597403, 2.332534]) {
            assert!((q - expected).abs() < 1e-6, "{q} {expected}");
        }
    }

    #[test]
    fn a_rotation_has_no_invariant_box() {
        let F = DMatrix::from_row_slice(2, 2, &[0.7, -0.7, 0.7, 0.7]);
        let P = DMatrix::identity(2, 2);
        assert!(rpi_on_normals(&P, &F, &unit_box(&P)).is_none());
    }
}
