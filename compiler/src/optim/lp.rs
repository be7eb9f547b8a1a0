//! A dense linear-programming solver for the many small problems of set computations.
#![expect(non_snake_case, reason = "the symbols of the literature")]

use nalgebra::{DMatrix, DVector};

/// What [`minimise`] found.
#[derive(Debug, Clone)]
pub enum Outcome {
    Optimal(Solution),
    /// No y >= 0 satisfies A y = b.
    Infeasible,
    /// c'y has no lower bound.
    Unbounded,
    /// The pivots did not end or the final basis is singular: no statement.
    Failed,
}

/// Optimal basic solution, recomputed from its basis.
#[derive(Debug, Clone)]
pub struct Solution {
    /// y >= 0 with A y = b up to rounding.
    pub y: DVector<f64>,
    /// Dual solution x: A'x <= c up to rounding, b'x = c'y.
    pub x: DVector<f64>,
    pub value: f64,
}

/// Minimise c'y subject to A y = b, y >= 0: the two-phase tableau simplex method. Steepest reduced cost first; after
/// a run of degenerate pivots Bland's rule, which cannot cycle.
///
/// With A = H', b = d, c = h it is the dual of "maximise d'x over {H x <= h}", and y is the certificate that d'x <=
/// c'y there: any y >= 0 with H'y = d gives a true upper bound, optimal or not.
pub fn minimise(c: &DVector<f64>, A: &DMatrix<f64>, b: &DVector<f64>) -> Outcome {
    let mut tableau = Tableau::new(A, b);
    if !tableau.eliminate_artificials() {
        return if tableau.gave_up { Outcome::Failed } else { Outcome::Infeasible };
    }
    tableau.price(c);
    match tableau.pivot_until_optimal(A.ncols()) {
        Run::Optimal => tableau.recompute(c, A, b).map_or(Outcome::Failed, Outcome::Optimal),
        Run::Unbounded => Outcome::Unbounded,
        // Rounding can keep reduced costs of the size of its noise alive: such a point is as good as optimal, and y
        // is a true certificate in any case.
        Run::GaveUp if tableau.worst_cost(A.ncols()) > -1e-7 => {
            tableau.recompute(c, A, b).map_or(Outcome::Failed, Outcome::Optimal)
        }
        Run::GaveUp => Outcome::Failed,
    }
}

const PIVOT: f64 = 1e-10;
const REDUCED_COST: f64 = 1e-11;
const RESIDUAL: f64 = 1e-10;

enum Run {
    Optimal,
    Unbounded,
    GaveUp,
}

/// Rows of the tableau are [A | I | b], the last row is the reduced costs.
struct Tableau {
    rows: usize,
    cols: usize,
    cells: Vec<f64>,
    basis: Vec<usize>,
    phase: Phase,
    gave_up: bool,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    One,
    Two,
}

impl Tableau {
    fn new(A: &DMatrix<f64>, b: &DVector<f64>) -> Self {
        let (m, n) = A.shape();
        let cols = n + m + 1;
        let mut cells = vec![0.0; (m + 1) * cols];
        for i in 0..m {
            let sign = if b[i] < 0.0 { -1.0 } else { 1.0 };
            for j in 0..n {
                cells[i * cols + j] = sign * A[(i, j)];
            }
            cells[i * cols + n + i] = 1.0;
            cells[i * cols + cols - 1] = sign * b[i];
        }
        let mut tableau = Self { rows: m, cols, cells, basis: (n..n + m).collect(), phase: Phase::One, gave_up: false };
        tableau.price_artificials(n);
        tableau
    }

    fn at(&self, i: usize, j: usize) -> f64 {
        self.cells[i * self.cols + j]
    }

    /// Phase-one costs: 1 for each artificial variable, reduced by the rows they are basic in.
    fn price_artificials(&mut self, n: usize) {
        for j in (0..n).chain([self.cols - 1]) {
            let sum: f64 = (0..self.rows).map(|i| self.at(i, j)).sum();
            self.cells[self.rows * self.cols + j] = -sum;
        }
    }

    /// Phase one; false where the constraints have no solution (or, with `gave_up`, where it did not end).
    fn eliminate_artificials(&mut self) -> bool {
        let n = self.cols - 1 - self.rows;
        let scale = (0..self.rows).map(|i| self.at(i, self.cols - 1).abs()).fold(1.0, f64::max);
        if !matches!(self.pivot_until_optimal(n), Run::Optimal) {
            self.gave_up = true;
            return false;
        }
        if -self.at(self.rows, self.cols - 1) > 1e-9 * scale {
            return false;
        }
        self.drive_out_artificials(n);
        true
    }

    /// Artificial variables that stay basic at zero would hide dependent rows: exchange them where a pivot exists.
    fn drive_out_artificials(&mut self, n: usize) {
        for i in 0..self.rows {
            if self.basis[i] < n {
                continue;
            }
            let best = (0..n).max_by(|&j, &k| self.at(i, j).abs().total_cmp(&self.at(i, k).abs()));
            if let Some(j) = best.filter(|&j| self.at(i, j).abs() > PIVOT) {
                self.pivot(i, j);
            }
        }
    }

    /// Phase-two costs, reduced by the basis.
    fn price(&mut self, c: &DVector<f64>) {
        self.phase = Phase::Two;
        let last = self.rows * self.cols;
        self.cells[last..].fill(0.0);
        self.cells[last..last + c.len()].copy_from_slice(c.as_slice());
        for i in 0..self.rows {
            let cost = if self.basis[i] < c.len() { c[self.basis[i]] } else { 0.0 };
            if cost != 0.0 {
                for j in 0..self.cols {
                    self.cells[last + j] -= cost * self.cells[i * self.cols + j];
                }
            }
        }
    }

    fn pivot_until_optimal(&mut self, n: usize) -> Run {
        let mut degenerate = 0;
        for _ in 0..200 * (self.rows + 10) {
            let Some(j) = self.entering(n, degenerate > 2 * self.rows + 20) else { return Run::Optimal };
            let Some(i) = self.leaving(j) else { return Run::Unbounded };
            degenerate = if self.at(i, self.cols - 1) <= 1e-13 { degenerate + 1 } else { 0 };
            self.pivot(i, j);
        }
        Run::GaveUp
    }

    fn entering(&self, n: usize, bland: bool) -> Option<usize> {
        let costs = &self.cells[self.rows * self.cols..][..n];
        if bland {
            return costs.iter().position(|&cost| cost < -REDUCED_COST);
        }
        let (j, cost) = costs.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1))?;
        (*cost < -REDUCED_COST).then_some(j)
    }

    fn worst_cost(&self, n: usize) -> f64 {
        self.cells[self.rows * self.cols..][..n].iter().copied().fold(0.0, f64::min)
    }

    /// Smallest ratio; among ties the smallest basic index (Bland).
    fn leaving(&self, j: usize) -> Option<usize> {
        let mut best: Option<(f64, usize)> = None;
        for i in 0..self.rows {
            let pivot = self.at(i, j);
            // After phase one a dependent row keeps its artificial variable at zero: it may not grow again.
            let artificial = self.basis[i] >= self.cols - 1 - self.rows;
            let stuck = self.phase == Phase::Two && artificial && pivot < -PIVOT;
            if pivot <= PIVOT && !stuck {
                continue;
            }
            let ratio = if stuck { 0.0 } else { self.at(i, self.cols - 1).max(0.0) / pivot };
            let better = best.is_none_or(|(r, k)| ratio < r || (ratio == r && self.basis[i] < self.basis[k]));
            if better {
                best = Some((ratio, i));
            }
        }
        best.map(|(_, i)| i)
    }

    fn pivot(&mut self, i: usize, j: usize) {
        let cols = self.cols;
        let inverse = 1.0 / self.at(i, j);
        let row: Vec<f64> = self.cells[i * cols..(i + 1) * cols].iter().map(|c| c * inverse).collect();
        for (k, other) in self.cells.chunks_exact_mut(cols).enumerate() {
            let factor = other[j];
            if k == i {
                other.copy_from_slice(&row);
            } else if factor != 0.0 {
                other.iter_mut().zip(&row).for_each(|(cell, r)| *cell -= factor * r);
                other[j] = 0.0;
            }
        }
        self.basis[i] = j;
    }

    /// The basic solution from the original data, free of the pivots' accumulated rounding.
    fn recompute(&self, c: &DVector<f64>, A: &DMatrix<f64>, b: &DVector<f64>) -> Option<Solution> {
        let m = self.rows;
        let n = A.ncols();
        let column = |j: usize, i: usize| if j < n { A[(i, j)] } else { f64::from(j - n == i) };
        let B = DMatrix::from_fn(m, m, |i, k| column(self.basis[k], i));
        let c_B = DVector::from_fn(m, |k, _| if self.basis[k] < n { c[self.basis[k]] } else { 0.0 });
        let y_B = B.clone().lu().solve(b)?;
        let x = B.transpose().lu().solve(&c_B)?;
        let mut y = DVector::zeros(n);
        for (k, &j) in self.basis.iter().enumerate().filter(|(_, j)| **j < n) {
            y[j] = y_B[k].max(0.0);
        }
        let value = c.dot(&y);
        // A certificate is worth what A y = b is worth, whatever the pivots did.
        let size = b.amax() + A.amax() * y.amax();
        ((A * &y - b).amax() <= RESIDUAL * size).then_some(Solution { y, x, value })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn optimal(outcome: Outcome) -> Solution {
        match outcome {
            Outcome::Optimal(solution) => solution,
            other => panic!("{other:?}"),
        }
    }

    /// Support of the unit square in direction (1, 2) through its dual.
    #[test]
    fn support_of_a_square() {
        let H = DMatrix::from_row_slice(4, 2, &[1.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, -1.0]);
        let h = DVector::from_element(4, 1.0);
        let solution = optimal(minimise(&h, &H.transpose(), &DVector::from_vec(vec![1.0, 2.0])));
        assert!((solution.value - 3.0).abs() < 1e-12);
        assert!((&solution.x - DVector::from_vec(vec![1.0, 1.0])).norm() < 1e-12);
    }

    #[test]
    fn infeasible_and_unbounded_are_told_apart() {
        let A = DMatrix::from_row_slice(1, 2, &[1.0, 1.0]);
        assert!(matches!(minimise(&DVector::zeros(2), &A, &DVector::from_element(1, -1.0)), Outcome::Infeasible));
        let A = DMatrix::from_row_slice(1, 2, &[1.0, -1.0]);
        let c = DVector::from_vec(vec![0.0, -1.0]);
        assert!(matches!(minimise(&c, &A, &DVector::from_element(1, 1.0)), Outcome::Unbounded));
    }

    /// Primal and dual feasible with no gap is optimal.
    #[test]
    fn random_problems_are_solved_to_optimality() {
        let mut state = 1u64;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            ((state >> 33) as f64 / f64::from(1u32 << 31) * 20.0).round() / 10.0 - 1.0
        };
        for case in 0..400 {
            let (m, n) = (2 + case % 9, 6 + case % 23);
            let A = DMatrix::from_fn(m, 2 * n, |_, _| next());
            let inside = DVector::from_fn(2 * n, |_, _| next().max(0.0));
            let b = &A * inside;
            let c = DVector::from_fn(2 * n, |_, _| next().abs());
            let solution = optimal(minimise(&c, &A, &b));
            assert!(solution.y.min() >= 0.0 && (&A * &solution.y - &b).amax() < 1e-9);
            assert!((A.transpose() * &solution.x - &c).max() < 1e-8, "dual feasible");
            assert!((b.dot(&solution.x) - solution.value).abs() < 1e-8 * (1.0 + solution.value.abs()), "no gap");
        }
    }

    /// In phase one artificial variables may grow: a pivot that forbids it would leave y < 0, which is no certificate.
    /// Zeros in b bring such pivots about.
    #[test]
    fn certificates_satisfy_their_equations() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / (1u64 << 30) as f64 - 1.0
        };
        let mut solved = 0;
        for _ in 0..500 {
            let A = DMatrix::from_fn(6, 18, |_, _| if random() > 0.2 { random() } else { 0.0 });
            let b = DVector::from_fn(6, |i, _| if i % 2 == 0 { random() } else { 0.0 });
            let c = DVector::from_fn(18, |_, _| random().abs());
            if let Outcome::Optimal(solution) = minimise(&c, &A, &b) {
                assert!((&A * &solution.y - &b).amax() < 1e-9 && (solution.value - b.dot(&solution.x)).abs() < 1e-9);
                assert!((A.transpose() * &solution.x - &c).max() < 1e-9);
                solved += 1;
            }
        }
        assert!(solved > 100, "{solved}");
    }

    #[test]
    fn dependent_rows_do_no_harm() {
        let A = DMatrix::from_row_slice(3, 3, &[1.0, 1.0, 0.0, 2.0, 2.0, 0.0, 0.0, 1.0, 1.0]);
        let b = DVector::from_vec(vec![1.0, 2.0, 1.0]);
        let solution = optimal(minimise(&DVector::from_vec(vec![1.0, 3.0, 1.0]), &A, &b));
        assert!((solution.value - 2.0).abs() < 1e-12);
        assert!((&A * &solution.y - b).norm() < 1e-12);
    }

    /// Cross-polytopes: 2^d facets meet at each vertex, every facet listed twice.
    #[test]
    fn degenerate_cross_polytope() {
        for d in [2usize, 4, 6] {
            let facets = 1usize << d;
            let H = DMatrix::from_fn(2 * facets, d, |i, j| if (i % facets) >> j & 1 == 1 { 1.0 } else { -1.0 });
            let c = DVector::from_element(2 * facets, 1.0);
            let direction = DVector::from_fn(d, |j, _| if j % 2 == 0 { 1.0 } else { -1.0 });
            let solution = optimal(minimise(&c, &H.transpose(), &direction));
            assert!((solution.value - 1.0).abs() < 1e-12, "{d}: {}", solution.value);
        }
    }
}
