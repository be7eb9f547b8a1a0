//! By collective matrices.
#![expect(non_snake_case, reason = "the paper's symbols")]

use std::cell::OnceCell;
use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::{ReferenceShare, Shares, Sums, Transients, collective_floor, loads, sparse};
use crate::convex::PowerSum;
use crate::gains::Gains;
use crate::network::{Network, Subsystem};
use crate::optim::lyapunov::Contraction;
use crate::optim::responses::{Accuracy, power_sum};
use crate::optim::rounding::sum_upper;

/// The reference system's steady states and Delta^chi, (9)-(13).
pub struct References {
    steady: DMatrix<f64>,
    /// Per column of `steady`, its error in the norm of `contraction`.
    steady_error: Vec<f64>,
    sum: PowerSum,
    loads: Option<loads::Response>,
    /// What a step rounds, and calF.
    rounded: Option<(DVector<f64>, DMatrix<f64>)>,
    /// Bound of |(I - calF)^-1 w|_P over the floor boxes w of all states.
    drift: f64,
    contraction: Contraction,
    chi_offset: Vec<usize>,
    size: usize,
}

impl References {
    /// `None` where the steady states cannot be computed.
    pub fn new(
        network: &Network,
        gains: &Gains,
        contraction: &Contraction,
        arithmetic: Option<DVector<f64>>,
    ) -> Option<Self> {
        let steady = gains.steady()?;
        let (calF, calG) = (gains.calF.to_dense(), gains.calG.to_dense());
        let size = calF.nrows();
        let geometric = 1.0 / (1.0 - contraction.lambda);
        let blur = blur(&calF, &steady, &calG);
        let steady_error = steady_error(&calF, contraction, &steady, &calG);
        let W = -(&calF * &steady);
        // W = -F (I - F)^-1 G: what F does to the error of `steady` is smaller still in a norm that F contracts.
        let rounded = |j: usize| contraction.norm_of_box(&blur.column(j).into_owned());
        let error: Vec<f64> = (0..steady.ncols()).map(|j| steady_error[j] + rounded(j)).collect();
        let blocks = network.subsystems.iter().map(Subsystem::p).collect();
        let loads = loads::Response::new(network, gains, &calF, contraction)?;
        let rounded = arithmetic.map(|rounded| (rounded, calF.clone()));
        let sum = PowerSum::new(calF, W, blocks, network.reference.norm, contraction.clone(), &error);
        let drift = contraction.norm_of_box(&collective_floor(network, gains)) * geometric;
        let (contraction, chi_offset) = (contraction.clone(), gains.chi_offset.clone());
        Some(Self { steady, steady_error, sum, loads, rounded, drift, contraction, chi_offset, size })
    }

    /// Per subsystem, the rows of X_i on xref and of U_i on uref = calK chi.
    pub fn shares(&self, network: &Network, gains: &Gains, sums: Sums) -> Vec<Shares> {
        let parts = network.subsystems.iter().zip(&gains.subsystems);
        let rows: Vec<Vec<_>> = parts.map(|(s, g)| super::rows(s, g)).collect();
        let mut rates = self.rates(&rows, sums).into_iter();
        let better = OnceCell::new();
        let mut shares = Vec::new();
        for (i, rows) in rows.iter().enumerate() {
            let share = |(row, (rate, doubt)): (&DVector<f64>, (f64, f64))| {
                let share = self.share(&self.direction(i, row), rate);
                if doubt <= MOST_DOUBT * rate {
                    return share;
                }
                let sparse = better.get_or_init(|| {
                    by_sparse_rows(network, gains, self.rounded.as_ref().map(|(rounded, _)| rounded.clone()))
                });
                let other = sparse.as_ref().and_then(|sparse| sparse.whole_share(i, row));
                let better = other.filter(|other| other.rate < rate).unwrap_or(share);
                let summed = rate - doubt;
                ReferenceShare { doubt: better.rate - summed, ..better }
            };
            let mut x_rows: Vec<_> = rows.iter().zip(&mut rates).map(share).collect();
            let u_rows = x_rows.split_off(network.subsystems[i].X.h.len());
            shares.push((x_rows, u_rows));
        }
        shares
    }

    /// Support of Delta^chi in the given rows, one list per subsystem, and how much of it is tail and rounding. The set is
    /// symmetric: the two bounds of one signal need one sum.
    fn rates(&self, rows: &[Vec<DVector<f64>>], sums: Sums) -> Vec<(f64, f64)> {
        let (mut different, mut of) = (Vec::new(), Vec::new());
        for (i, list) in rows.iter().enumerate() {
            let (own, own_of) = super::different(list);
            of.extend(own_of.into_iter().map(|(k, _)| different.len() + k));
            different.extend(own.iter().map(|row| self.direction(i, row)));
        }
        let rates: Vec<(f64, f64)> = match sums {
            Sums::Proved => different.iter().map(|d| self.sum.support_and_doubt(d)).collect(),
            Sums::Estimated => self.sum.estimates(&different).into_iter().map(|rate| (rate, 0.0)).collect(),
        };
        of.into_iter().map(|k| rates[k]).collect()
    }

    fn share(&self, d: &DVector<f64>, rate: f64) -> ReferenceShare {
        let worst = self.steady_error.iter().copied().fold(0.0, f64::max);
        let rounding = 2.0 * (d.len() + 4) as f64 * f64::EPSILON * self.steady.amax() * d.abs().sum();
        ReferenceShare {
            rate,
            doubt: 0.0,
            steady: self.steady.tr_mul(d).iter().copied().enumerate().collect(),
            steady_error: self.contraction.dual_norm(d) * worst + rounding,
            rest: 0.0,
            drift: self.contraction.dual_norm(d) * self.drift,
            load: self.load(d),
        }
    }

    fn load(&self, d: &DVector<f64>) -> f64 {
        let loads = self.loads.as_ref().map_or(0.0, |loads| loads.share(d, self.contraction.dual_norm(d)));
        loads + self.rounding(d)
    }

    /// Upper bound of the sum over k of |d calF^k| on what a step rounds.
    fn rounding(&self, d: &DVector<f64>) -> f64 {
        let Some((rounded, calF)) = &self.rounded else { return 0.0 };
        let (row, columns) = (DMatrix::from_row_slice(1, d.len(), d.as_slice()), DMatrix::from_diagonal(rounded));
        power_sum(&row, calF, &self.contraction, &columns, Accuracy::LOOSE).sum()
    }

    /// A row over chi_i as a row over the collective chi; entries past the given ones are zero.
    fn direction(&self, i: usize, row: &DVector<f64>) -> DVector<f64> {
        let mut d = DVector::zeros(self.size);
        d.rows_mut(self.chi_offset[i], row.len()).copy_from(row);
        d
    }

    pub fn coupling_loads(&self, network: &Network) -> Vec<f64> {
        let taken = |j: usize, H: &DVector<f64>| self.load(&self.direction(j, &network.subsystems[j].C.tr_mul(H)));
        let constraints = network.coupling_constraints.iter();
        constraints.map(|c| sum_upper(c.H.iter().map(|(&j, H)| taken(j, H)))).collect()
    }

    /// A row over x_i, in either direction.
    pub fn output(&self, i: usize, row: &DVector<f64>, sums: Sums) -> Transients {
        let d = self.direction(i, row);
        let dual = self.contraction.dual_norm(&d);
        let rate = match sums {
            Sums::Proved => self.sum.support(&d),
            Sums::Estimated => self.sum.estimates(std::slice::from_ref(&d)).into_iter().fold(0.0, f64::max),
        };
        let load = self.load(&d).max(self.load(&-&d));
        Transients { rate, load, drift: dual * self.drift }
    }

    pub fn coupling(&self, network: &Network) -> Vec<BTreeMap<usize, f64>> {
        let rate =
            |j: usize, H: &DVector<f64>| self.sum.support(&self.direction(j, &network.subsystems[j].C.tr_mul(H)));
        let constraints = network.coupling_constraints.iter();
        constraints.map(|c| c.H.iter().map(|(&j, H)| (j, rate(j, H))).collect()).collect()
    }
}

/// Where so much of a support value, relative, is tail and rounding, another way to bound it is tried: one norm for the whole
/// network charges a row for the slowest mode of all, whether it has a part in it or not.
const MOST_DOUBT: f64 = 1e-5;

fn by_sparse_rows(network: &Network, gains: &Gains, rounded: Option<DVector<f64>>) -> Option<sparse::References> {
    let responses = gains.responses(network)?;
    // Nothing is left out of the rows.
    let caps = DVector::from_element(gains.calG.ncols(), f64::INFINITY);
    sparse::References::new(network, gains, &responses, caps, rounded)
}

/// What double precision may have done to an entry of (I - F) `steady` - G.
fn blur(F: &DMatrix<f64>, steady: &DMatrix<f64>, G: &DMatrix<f64>) -> DMatrix<f64> {
    let (abs_F, abs_steady) = (F.abs(), steady.abs());
    (&abs_F * &abs_steady + &abs_steady + G.abs()) * (4.0 * (steady.nrows() + 4) as f64 * f64::EPSILON)
}

/// Per column of `steady`, a bound of its distance from (I - F)^-1 G in the norm of the contraction.
pub fn steady_error(F: &DMatrix<f64>, contraction: &Contraction, steady: &DMatrix<f64>, G: &DMatrix<f64>) -> Vec<f64> {
    let blur = blur(F, steady, G);
    let geometric = 1.0 / (1.0 - contraction.lambda);
    let blurred = |matrix: &DMatrix<f64>, j: usize| {
        let column = matrix.column(j).into_owned();
        contraction.norm(&column) + contraction.norm_of_box(&blur.column(j).into_owned())
    };
    let defect = steady - F * steady - G;
    (0..steady.ncols()).map(|j| blurred(&defect, j) * geometric).collect()
}
