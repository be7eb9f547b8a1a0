//! Discrete models of the network under inputs and loads that are constant over a sampling period.
#![expect(non_snake_case, reason = "the paper's symbols")]

use crate::areas::{AREA, AREAS, NX, SAMPLE_TIME, TIE, neighbours};
use example_kit::matrix::Matrix;

/// x+ = A x + B u + M d over the states of all areas, inputs dPref and loads dPL.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// 16 x 16.
    pub A: Matrix,
    /// 16 x 4.
    pub B: Matrix,
    /// 16 x 4.
    pub M: Matrix,
}

impl Model {
    /// The exact discretisation of the whole network: every area acts on every other one within a period.
    pub fn exact() -> Self {
        let mut dynamics = Matrix::zeros(AREAS * NX, AREAS * NX);
        let mut from = Matrix::zeros(AREAS * NX, 2 * AREAS);
        for i in 0..AREAS {
            let (own, inputs) = area(i);
            dynamics.put(NX * i, NX * i, &own);
            for j in neighbours(i) {
                dynamics.rows[NX * i + 1][NX * j] = TIE[i][j] / (2.0 * AREA[i].H);
            }
            from.put(NX * i, i, &inputs.block(0..NX, 0..1));
            from.put(NX * i, AREAS + i, &inputs.block(0..NX, 1..2));
        }
        let (A, from) = held(&dynamics, &from);
        let all = 0..AREAS * NX;
        Self { A, B: from.block(all.clone(), 0..AREAS), M: from.block(all, AREAS..2 * AREAS) }
    }

    /// Neighbours' angles held over a period: the benchmark's own model for distributed controllers.
    pub fn angles_held() -> Self {
        let mut model = Self::nothing();
        for i in 0..AREAS {
            let (own, inputs) = area(i);
            let mut from = Matrix::zeros(NX, 2 + AREAS);
            from.put(0, 0, &inputs);
            neighbours(i).for_each(|j| from.rows[1][2 + j] = TIE[i][j] / (2.0 * AREA[i].H));
            let (A, from) = held(&own, &from);
            model.A.put(NX * i, NX * i, &A);
            neighbours(i).for_each(|j| model.A.put(NX * i, NX * j, &from.block(0..NX, 2 + j..3 + j)));
            model.B.put(NX * i, i, &from.block(0..NX, 0..1));
            model.M.put(NX * i, i, &from.block(0..NX, 1..2));
        }
        model
    }

    /// What the exact model says of each area itself, and of its neighbours' angles and frequencies: that much can be told by
    /// the neighbours alone.
    pub fn frequencies_told() -> Self {
        let (exact, mut model) = (Self::exact(), Self::nothing());
        for i in 0..AREAS {
            let rows = NX * i..NX * (i + 1);
            model.A.put(NX * i, NX * i, &exact.A.block(rows.clone(), rows.clone()));
            for j in neighbours(i) {
                model.A.put(NX * i, NX * j, &exact.A.block(rows.clone(), NX * j..NX * j + 2));
            }
            model.B.put(NX * i, i, &exact.B.block(rows.clone(), i..i + 1));
            model.M.put(NX * i, i, &exact.M.block(rows, i..i + 1));
        }
        model
    }

    /// With 12 significant digits, as the files have it.
    pub fn rounded(&self) -> Self {
        let round = |matrix: &Matrix| matrix.map(|x| significant(x, 12));
        Self { A: round(&self.A), B: round(&self.B), M: round(&self.M) }
    }

    pub fn next(&self, x: &[f64], u: &[f64], d: &[f64]) -> Vec<f64> {
        let (drift, input, load) = (self.A.apply(x), self.B.apply(u), self.M.apply(d));
        drift.iter().zip(&input).zip(&load).map(|((a, b), c)| a + b + c).collect()
    }

    /// Per state the most that the next one can differ from `other`'s, where |x|, |u|, |d| stay below these limits.
    pub fn apart(&self, other: &Self, x: &[f64], u: &[f64], d: &[f64]) -> Vec<f64> {
        let off = |a: &Matrix, b: &Matrix, limits: &[f64]| a.zip(b, |a, b| (a - b).abs()).apply(limits);
        let (of_x, of_u, of_d) = (off(&self.A, &other.A, x), off(&self.B, &other.B, u), off(&self.M, &other.M, d));
        of_x.iter().zip(&of_u).zip(&of_d).map(|((a, b), c)| a + b + c).collect()
    }

    fn nothing() -> Self {
        let n = AREAS * NX;
        Self { A: Matrix::zeros(n, n), B: Matrix::zeros(n, AREAS), M: Matrix::zeros(n, AREAS) }
    }
}

/// Area i alone: from its states, and from (dPref, dPL), to their derivatives.
fn area(i: usize) -> (Matrix, Matrix) {
    let a = AREA[i];
    let tie: f64 = TIE[i].iter().sum();
    let own = vec![
        vec![0.0, 1.0, 0.0, 0.0],
        vec![-tie / (2.0 * a.H), -a.D / (2.0 * a.H), 1.0 / (2.0 * a.H), 0.0],
        vec![0.0, 0.0, -1.0 / a.Tt, 1.0 / a.Tt],
        vec![0.0, -1.0 / (a.R * a.Tg), 0.0, -1.0 / a.Tg],
    ];
    let inputs = vec![vec![0.0, 0.0], vec![0.0, -1.0 / (2.0 * a.H)], vec![0.0, 0.0], vec![1.0 / a.Tg, 0.0]];
    (Matrix { rows: own }, Matrix { rows: inputs })
}

/// One sampling period of x' = dynamics x + from v, v constant.
fn held(dynamics: &Matrix, from: &Matrix) -> (Matrix, Matrix) {
    let (n, m) = (dynamics.rows.len(), from.rows[0].len());
    let mut both = Matrix::zeros(n + m, n + m);
    both.put(0, 0, &dynamics.map(|x| x * SAMPLE_TIME));
    both.put(0, n, &from.map(|x| x * SAMPLE_TIME));
    let after = both.exponential();
    (after.block(0..n, 0..n), after.block(0..n, n..n + m))
}

/// The nearest number with so many significant decimal digits.
pub fn significant(value: f64, digits: usize) -> f64 {
    let text = format!("{value:.*e}", digits - 1);
    text.parse().unwrap_or(value)
}
