#![expect(non_snake_case, reason = "the symbols of the literature")]

use nalgebra::{DMatrix, DVector};

use super::strips::{Multiplier, multipliers};
use crate::optim::block_lu::BlockLu;
use crate::optim::lyapunov::spectral_radius;
use crate::optim::sparse::Sparse;

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
    rpi_at_least(P, F, r, &DVector::zeros(r.len()))
}

/// [`rpi_on_normals`] among the sets with q >= `least`.
pub fn rpi_at_least(P: &DMatrix<f64>, F: &DMatrix<f64>, r: &DVector<f64>, least: &DVector<f64>) -> Option<Invariant> {
    let PF = P * F;
    let mut q = r.sup(least);
    for _ in 0..STEPS {
        let Lambda = multipliers(P, &q, &PF)?;
        let abs = abs_matrix(&Lambda);
        match fixed_point(&abs, r, least) {
            Some(next) if settled(&q, &next) => return Some(Invariant { q: next, Lambda }),
            Some(next) => q = next,
            None => q = (&abs * &q + r).sup(least),
        }
        if !q.amax().is_finite() || q.amax() > 1e9 * r.amax().max(least.amax()) {
            return None;
        }
    }
    None
}

/// Where no contracting choice of multipliers has shown by then, none does.
const STEPS: usize = 50;

/// The least q >= `least` with q >= |Lambda| q + r where the spectral radius is below 1.
fn fixed_point(abs: &DMatrix<f64>, r: &DVector<f64>, least: &DVector<f64>) -> Option<DVector<f64>> {
    if spectral_radius(abs) >= 1.0 - 1e-9 {
        return None;
    }
    let q = least_fixed_point(abs, r, least)?;
    q.iter().zip(r).all(|(q, r)| q.is_finite() && q >= r).then_some(q)
}

/// The least q with q = max(M q + r, least), M >= 0 of spectral radius below 1; r and `least` not negative. Policy
/// iteration: which of the two is larger is guessed row by row, a linear system solved, and the guess corrected; q rises
/// from one guess to the next. `None` where a system is singular or the guesses do not settle.
pub fn least_fixed_point(M: &DMatrix<f64>, r: &DVector<f64>, least: &DVector<f64>) -> Option<DVector<f64>> {
    let size = M.nrows();
    let (mut held, mut system, mut right) = (vec![false; size], DMatrix::identity(size, size) - M, r.clone());
    for _ in 0..2 * size + 2 {
        let q = system.clone().lu().solve(&right)?;
        let rise = M * &q + r;
        let change: Vec<usize> = (0..size)
            .filter(|&k| if held[k] { rise[k] > least[k] * (1.0 + 1e-12) } else { q[k] < least[k] && least[k] > 0.0 })
            .collect();
        if change.is_empty() {
            return Some(q);
        }
        for k in change {
            held[k] = !held[k];
            let row = DMatrix::from_fn(1, size, |_, j| f64::from(j == k) - if held[k] { 0.0 } else { M[(k, j)] });
            system.row_mut(k).copy_from(&row);
            right[k] = if held[k] { least[k] } else { r[k] };
        }
    }
    None
}

/// [`least_fixed_point`] of a sparse matrix in blocks; `starts` as in [`BlockLu::of_identity_minus`].
pub fn least_fixed_point_of_blocks(
    M: &Sparse,
    starts: &[usize],
    r: &DVector<f64>,
    least: &DVector<f64>,
) -> Option<DVector<f64>> {
    let size = M.nrows();
    let mut held = vec![false; size];
    for _ in 0..2 * size + 2 {
        let open = M.without_rows(&held);
        let right = DVector::from_fn(size, |k, _| if held[k] { least[k] } else { r[k] });
        let lu = BlockLu::of_identity_minus(&open, starts)?;
        let first = lu.solve(&right);
        let q = &first + lu.solve(&(&right - &first + open.times(&first)));
        let rise = M.times(&q) + r;
        let wrong =
            |k: usize| if held[k] { rise[k] > least[k] * (1.0 + 1e-12) } else { q[k] < least[k] && least[k] > 0.0 };
        let change: Vec<usize> = (0..size).filter(|&k| wrong(k)).collect();
        if change.is_empty() {
            return Some(q);
        }
        change.into_iter().for_each(|k| held[k] = !held[k]);
    }
    None
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
    fn least_offsets_raise_no_more_than_they_must() {
        let P = DMatrix::identity(2, 2);
        let free = rpi_on_normals(&P, &published(), &unit_box(&P)).unwrap();
        let least = DVector::from_vec(vec![2.0, 0.5]);
        let raised = rpi_at_least(&P, &published(), &unit_box(&P), &least).unwrap();
        assert!((raised.q[0] - 2.0).abs() < 1e-12 && raised.q[1] > free.q[1]);
        assert!((raised.q[1] - (1.17 * 2.0 + 1.0) / 0.97).abs() < 1e-9, "{}", raised.q[1]);
        let idle = rpi_at_least(&P, &published(), &unit_box(&P), &free.q.map(|q| 0.9 * q)).unwrap();
        assert!((idle.q - free.q).amax() < 1e-12);
    }

    #[test]
    fn blocks_have_the_fixed_point_of_the_dense_matrix() {
        let M =
            DMatrix::from_fn(6, 6, |i, j| if i.abs_diff(j) <= 2 { 0.1 + 0.02 * (i + 2 * j) as f64 / 6.0 } else { 0.0 });
        let (r, least) =
            (DVector::from_element(6, 1.0), DVector::from_fn(6, |k, _| if k % 2 == 0 { 2.5 } else { 0.0 }));
        let dense = least_fixed_point(&M, &r, &least).unwrap();
        let sparse = Sparse::from_blocks(6, 6, [((0, 0), &M)]);
        let blocks = least_fixed_point_of_blocks(&sparse, &[0, 2, 3, 6], &r, &least).unwrap();
        assert!((dense - blocks).amax() < 1e-12);
    }

    #[test]
    fn a_rotation_has_no_invariant_box() {
        let F = DMatrix::from_row_slice(2, 2, &[0.7, -0.7, 0.7, 0.7]);
        let P = DMatrix::identity(2, 2);
        assert!(rpi_on_normals(&P, &F, &unit_box(&P)).is_none());
    }
}
