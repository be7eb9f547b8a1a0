#![expect(non_snake_case, reason = "the symbols of the literature")]

use nalgebra::{DMatrix, DVector};

use crate::optim::lyapunov::Contraction;

/// q of the ball B_q in (6); the support function of the ball is the dual norm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RateNorm {
    One,
    Two,
    Inf,
}

impl RateNorm {
    /// Support of the unit ball in direction g.
    pub fn dual(self, g: impl Iterator<Item = f64>) -> f64 {
        match self {
            Self::One => g.fold(0.0, |size, x| size.max(x.abs())),
            Self::Two => g.map(|x| x * x).sum::<f64>().sqrt(),
            Self::Inf => g.map(f64::abs).sum(),
        }
    }
}

/// The set sum over k >= 0 of F^k W prod_i B_q, F Schur, as a support function with a proved tail.
///
/// It is the minimal robust positively invariant set of x+ = F x + W b, b in the product of unit balls (Rakovic,
/// Kerrigan, Kouramas, Mayne, "Invariant approximations of the minimal robust positively invariant set", IEEE TAC
/// 50, 2005).
#[derive(Debug, Clone)]
pub struct PowerSum {
    F: DMatrix<f64>,
    W: DMatrix<f64>,
    /// Lengths of the blocks of the columns of W, one ball each.
    blocks: Vec<usize>,
    norm: RateNorm,
    contraction: Contraction,
    /// Bound of |W b|_P over the product of balls.
    reach: f64,
    /// Bound of |dW b|_P, dW the error of W.
    reach_error: f64,
    /// Frobenius norm of F in the balanced units of `contraction`.
    balanced_size: f64,
}

impl PowerSum {
    /// `error` bounds each column's error |W_true - W| in the norm of `contraction`.
    pub fn new(
        F: DMatrix<f64>,
        W: DMatrix<f64>,
        blocks: Vec<usize>,
        norm: RateNorm,
        contraction: Contraction,
        error: &[f64],
    ) -> Self {
        // |b_k| <= 1 in each of the three balls, so the sum over columns bounds the reach.
        let reach = W.column_iter().map(|w| contraction.norm(&w.into_owned())).sum::<f64>() * INFLATE;
        let reach_error = error.iter().sum::<f64>() * INFLATE;
        let units = &contraction.units;
        let balanced = DMatrix::from_fn(F.nrows(), F.ncols(), |i, j| F[(i, j)] * units[j] / units[i]);
        let balanced_size = balanced.norm() * INFLATE;
        Self { F, W, blocks, norm, contraction, reach, reach_error, balanced_size }
    }

    /// Upper bound of the support value in direction d: a finite sum, the tail |d F^s|_{P^-1} reach / (1 - lambda),
    /// and the same geometric bound for what rounding did to the powers. The sum ends when the tail hardly matters, or
    /// after `MOST_STEPS` with whatever tail is left.
    pub fn support(&self, d: &DVector<f64>) -> f64 {
        self.support_and_doubt(d).0
    }

    /// [`PowerSum::support`], and how much of it is tail and rounding: what a better bound could at most save.
    pub fn support_and_doubt(&self, d: &DVector<f64>) -> (f64, f64) {
        let (mut sum, mut drift, mut row) = (0.0_f64, 0.0, d.clone());
        let later = self.reach / (1.0 - self.contraction.lambda);
        let whole = self.contraction.dual_norm(d);
        // Where W does not act in direction d at all, the sum stays 0: then the tail ends at what counts as nothing.
        let nothing = 1e-12 * whole * later;
        for step in 0..MOST_STEPS {
            if step % CHECKED == 0 && self.contraction.dual_norm(&row) * later <= (1e-9 * sum).max(nothing) {
                break;
            }
            sum += self.ball_support(&row);
            drift += self.rounding(&row) * later;
            row = self.F.tr_mul(&row);
        }
        let tail = self.contraction.dual_norm(&row) * later;
        let error = whole * self.reach_error / (1.0 - self.contraction.lambda);
        let doubt = tail + drift + error;
        ((sum * (1.0 + MOST_STEPS as f64 * f64::EPSILON) + doubt) * INFLATE, doubt)
    }

    /// Support values in several directions, for comparisons: with a tail of at most one percent, or what is left of it
    /// after a few thousand steps, and without a bound of the rounding.
    pub fn estimates(&self, directions: &[DVector<f64>]) -> Vec<f64> {
        let mut rows = DMatrix::from_fn(self.F.nrows(), directions.len(), |i, j| directions[j][i]);
        let (F, W) = (self.F.transpose(), self.W.transpose());
        let geometric = self.reach / (1.0 - self.contraction.lambda);
        let (mut sums, mut steps) = (vec![0.0; directions.len()], 0);
        loop {
            for _ in 0..STRIDE {
                let g = &W * &rows;
                g.column_iter().zip(&mut sums).for_each(|(g, sum)| *sum += self.on_balls(g.as_slice()));
                rows = &F * rows;
            }
            steps += STRIDE;
            let tails = rows.column_iter().map(|row| self.contraction.dual_norm(&row.into_owned()) * geometric);
            let with_tails: Vec<f64> = sums.iter().zip(tails).map(|(sum, tail)| sum + tail).collect();
            let close = with_tails.iter().zip(&sums).all(|(with, sum)| *with <= 1.01 * sum);
            if close || steps >= MOST_ESTIMATED {
                return with_tails;
            }
        }
    }

    /// Support of W prod B_q in direction `row`, and the relative error of its products.
    fn ball_support(&self, row: &DVector<f64>) -> f64 {
        self.on_balls(self.W.tr_mul(row).as_slice())
    }

    /// Support of prod B_q in direction g.
    fn on_balls(&self, g: &[f64]) -> f64 {
        let mut start = 0;
        let mut value = 0.0;
        for &length in &self.blocks {
            value += self.norm.dual(g[start..start + length].iter().copied());
            start += length;
        }
        value
    }

    /// Upper bound of the dual norm of the errors of the products row F and W'row, in double precision.
    ///
    /// They are below unit (|row| |F| + |row|) componentwise; in balanced units u, the Euclidean norm of |row| |F| is at
    /// most that of row times the Frobenius norm of the balanced |F|.
    fn rounding(&self, row: &DVector<f64>) -> f64 {
        let unit = 2.0 * (row.len() + 4) as f64 * f64::EPSILON;
        unit * (self.balanced_size + 1.0) * self.contraction.dual_norm_of_box(&row.abs())
    }
}

/// Covers the rounding of the bounds themselves.
const INFLATE: f64 = 1.0 + 1e-9;
/// Enough for 1e-9 where the slowest mode is 0.9999.
pub const MOST_STEPS: usize = 200_000;
/// The tail is looked at once in so many steps.
const CHECKED: usize = 32;
/// Steps of an estimate, and those between two looks at its tail.
const MOST_ESTIMATED: usize = 4096;
const STRIDE: usize = 32;

#[cfg(test)]
mod tests {
    use super::*;

    fn power_sum(F: DMatrix<f64>, norm: RateNorm) -> PowerSum {
        let contraction = Contraction::new(&F).unwrap();
        let n = F.nrows();
        PowerSum::new(F, DMatrix::identity(n, n), vec![n], norm, contraction, &vec![0.0; n])
    }

    #[test]
    fn scalar_sum_is_the_geometric_series() {
        let set = power_sum(DMatrix::from_element(1, 1, 0.999), RateNorm::Inf);
        let value = set.support(&DVector::from_element(1, 2.0));
        assert!((2000.0..2000.0 * (1.0 + 1e-8)).contains(&value), "{value}");
    }

    /// F = [-0.17 -0.03; -1.17 -0.03] with the unit inf-ball: the supports of the minimal set along the axes by summing
    /// the 1-norms of the rows of the powers of F.
    #[test]
    fn supports_are_above_the_plain_sum_and_close_to_it() {
        let F = DMatrix::from_row_slice(2, 2, &[-0.17, -0.03, -1.17, -0.03]);
        let set = power_sum(F.clone(), RateNorm::Inf);
        for k in 0..2 {
            let axis = DVector::from_fn(2, |j, _| f64::from(j == k));
            let (mut row, mut plain) = (axis.clone(), 0.0);
            for _ in 0..200 {
                plain += row.abs().sum();
                row = F.tr_mul(&row);
            }
            let value = set.support(&axis);
            assert!(plain <= value && value <= plain * (1.0 + 1e-8), "{plain} {value}");
        }
    }

    #[test]
    fn estimates_are_close_above_the_proved_values() {
        let F = DMatrix::from_row_slice(2, 2, &[0.9, 0.3, -0.1, 0.8]);
        let set = power_sum(F, RateNorm::Two);
        let directions = [DVector::from_vec(vec![1.0, 0.0]), DVector::from_vec(vec![-2.0, 1.0])];
        for (estimate, d) in set.estimates(&directions).into_iter().zip(&directions) {
            let proved = set.support(d);
            assert!(proved * 0.999 <= estimate && estimate <= proved * 1.011, "{estimate} {proved}");
        }
    }

    #[test]
    fn the_dual_norms_are_those_of_the_balls() {
        let g = [3.0, -4.0];
        assert_eq!(RateNorm::Inf.dual(g.into_iter()), 7.0);
        assert_eq!(RateNorm::Two.dual(g.into_iter()), 5.0);
        assert_eq!(RateNorm::One.dual(g.into_iter()), 4.0);
    }
}
