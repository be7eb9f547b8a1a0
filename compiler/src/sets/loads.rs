//! Measured disturbances (loads): x+ = A_ii x + B_ii u + E_i s + M_i d, d_t known to the controller of i when it acts.
//!
//! The loads stay in a box D_i and change by at most delta_i (componentwise) per step.
//!
//! # The timeline
//! At step t the references are extended to t + N, which takes the load at t + N - 1; only d_t is known. The reference
//! model (7a) and the nominal model (15) are both driven by the load delayed by the lead,
//!
//! ```text
//! xref_{k+1} = A_ii xref_k + B_ii uref_k + E_i sref_k + M_i dref_k,       dref_k = d_{k-(N-1)}
//! ```
//!
//! (d of the start for k < N - 1). Their difference stays autonomous, so (33)-(36) and the on-line problem do not
//! change at all. What is left between plant and nominal model,
//!
//! ```text
//! eps_{t+1} = F_ii eps_t + ... + M_i (d_t - dref_t),        |d_t - dref_t| <= min((N - 1) delta_i, dmax_i - dmin_i),
//! ```
//!
//! is a box that joins W_i as a constant term beside those of [`super::exogenous`]. It is empty for N = 1, and vanishes N - 1
//! steps after a load has come to rest: outputs then reach their set-points exactly, since (7b) integrates.
//!
//! # The references
//! With Mcal = diag([M_i; 0]) (8) is chi_{t+1} = calF chi_t + calG yref_{t+1} + Mcal dref_t. Let chi_ss_t = (I - calF)^-1 (calG
//! yref_t + Mcal dref_{t-1}). Then, as in (10)-(12),
//!
//! ```text
//! chi_{t+1} - chi_ss_{t+1} = calF (chi_t - chi_ss_t) - calF (I - calF)^-1 (calG (yref_{t+1} - yref_t) + Mcal (dref_t - dref_{t-1})).
//! ```
//!
//! chi is linear in (yref, dref); the share of dref in a row r is bounded in two ways, and the smaller one is charged to (25b):
//! - steady state and transient: max over D of r (I - calF)^-1 Mcal d, plus sum over k of |r calF^(k+1) (I - calF)^-1 Mcal| delta;
//! - any sequence in D: sum over k of the support of D in r calF^k Mcal. (The start, at rest under d_0, is the sequence that
//!   was d_0 for ever.)
//!
//! C_i chi_ss = yref whatever the load is, so that (26) is charged the transient only. What arrives at the neighbours is in
//! zref_i, since chi_i has felt dref_i when zref_i is computed.
//!
//! # What is guaranteed
//! Theorem 1, if the loads keep their bounds and rates: constraints at all times; yref converges; y converges to the
//! feasible set-point where the loads come to rest, and to its neighbourhood where they do not. The runtime confines dref to D
//! and delta, so that references stay admissible even where a load does not keep its bounds; then only d_t - dref_t leaves W_i.
#![expect(non_snake_case, reason = "the paper's symbols")]

use nalgebra::{DMatrix, DVector};

use super::references::steady_error;
use crate::convex::{PowerSum, RateNorm};
use crate::gains::Gains;
use crate::network::Network;
use crate::optim::lyapunov::Contraction;
use crate::optim::rounding::sum_upper;

/// Mcal = diag([M_i; 0]) over chi and all loads of the network.
pub fn collective(network: &Network, gains: &Gains) -> DMatrix<f64> {
    let count = network.subsystems.iter().map(|s| s.loads.len()).sum();
    let mut Mcal = DMatrix::zeros(gains.calF.nrows(), count);
    let mut column = 0;
    for (i, s) in network.subsystems.iter().enumerate() {
        Mcal.view_mut((gains.chi_offset[i], column), s.loads.M.shape()).copy_from(&s.loads.M);
        column += s.loads.len();
    }
    Mcal
}

/// (I - calF)^-1 Mcal: chi at rest under constant loads; `None` only where rounding defeats the solution.
pub fn steady(network: &Network, gains: &Gains) -> Option<DMatrix<f64>> {
    let size = gains.calF.nrows();
    (DMatrix::identity(size, size) - gains.calF.to_dense()).lu().solve(&collective(network, gains))
}

/// The share of the loads in the references.
pub struct Response {
    steady: DMatrix<f64>,
    /// Of every column of `steady`, in the norm of the contraction.
    error: Vec<f64>,
    min: DVector<f64>,
    max: DVector<f64>,
    /// Transient at full rate, and any sequence inside half of the range.
    at_rate: PowerSum,
    in_range: PowerSum,
}

impl Response {
    /// `Some(None)` without loads, `None` where the steady states cannot be computed.
    pub fn new(
        network: &Network,
        gains: &Gains,
        calF: &DMatrix<f64>,
        contraction: &Contraction,
    ) -> Option<Option<Self>> {
        let Mcal = collective(network, gains);
        if Mcal.ncols() == 0 {
            return Some(None);
        }
        let all = |of: fn(&crate::network::Loads) -> &DVector<f64>| {
            let parts = network.subsystems.iter().flat_map(|s| of(&s.loads).iter().copied());
            DVector::from_vec(parts.collect())
        };
        let (min, max, rate) = (all(|d| &d.min), all(|d| &d.max), all(|d| &d.rate));
        let steady = steady(network, gains)?;
        let error = steady_error(calF, contraction, &steady, &Mcal);
        let sum = |W: DMatrix<f64>, size: &DVector<f64>, error: &[f64]| {
            let W = W * DMatrix::from_diagonal(size);
            let error: Vec<f64> = error.iter().zip(size).map(|(error, size)| error * size).collect();
            let blocks = vec![size.len()];
            PowerSum::new(calF.clone(), W, blocks, RateNorm::Inf, contraction.clone(), &error)
        };
        // Twice: once for `steady`, once for its product with calF.
        let of_product: Vec<f64> = error.iter().map(|error| 2.0 * error).collect();
        let at_rate = sum(-(calF * &steady), &rate, &of_product);
        let half = (&max - &min) * 0.5;
        let in_range = sum(Mcal, &half, &vec![0.0; half.len()]);
        Some(Some(Self { steady, error, min, max, at_rate, in_range }))
    }

    /// Upper bound of the loads' share in row d over chi; `dual` is its dual norm.
    pub fn share(&self, d: &DVector<f64>, dual: f64) -> f64 {
        let row = self.steady.tr_mul(d);
        let slack = |k: usize| {
            let rounding = 2.0 * (d.len() + 4) as f64 * f64::EPSILON * self.steady.column(k).abs().dot(&d.abs());
            (self.error[k] * dual + rounding) * self.max[k].max(-self.min[k])
        };
        let ends = |k: usize| (row[k] * self.max[k]).max(row[k] * self.min[k]) + slack(k);
        let centre = |k: usize| row[k] * 0.5 * (self.max[k] + self.min[k]) + slack(k);
        let total = |of: &dyn Fn(usize) -> f64| sum_upper((0..row.len()).map(of));
        let by_rate = sum_upper([total(&ends), self.at_rate.support(d)]);
        let by_range = sum_upper([total(&centre), self.in_range.support(d)]);
        by_rate.min(by_range)
    }
}
