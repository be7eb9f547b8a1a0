//! What measured loads take of a row of the references: both bounds, and what some loads that keep bounds and rates do take.
#![expect(non_snake_case, reason = "the paper's symbols")]

use dpc_codegen::network::Network;
use nalgebra::{DMatrix, DVector};

use crate::checker::Collective;
use crate::unknowns::{Load, Unknowns};

/// The response of (x, e) to all loads of a network.
pub struct LoadShares {
    calF: DMatrix<f64>,
    /// Mcal = diag([M_i; 0]).
    Mcal: DMatrix<f64>,
    /// (I - calF)^-1 Mcal and calF times that.
    steady: DMatrix<f64>,
    tail: DMatrix<f64>,
    loads: Vec<Load>,
}

/// The share of a row.
#[derive(Debug, Clone, Copy, Default)]
pub struct Share {
    /// At constant loads, whatever they are: the largest value.
    pub at_rest: f64,
    /// Largest difference to the steady state of the present loads, at full rates for ever.
    pub transient: f64,
    /// Over all sequences inside the bounds, whatever their rates.
    pub in_range: f64,
    /// Under some sequence that keeps both.
    pub attained: f64,
}

impl Share {
    /// The smaller of the two bounds.
    pub fn bound(&self) -> f64 {
        (self.at_rest + self.transient).min(self.in_range)
    }
}

/// Longest response that is summed.
const LONGEST: usize = 3_000_000;

/// Shares of the time a load needs through its range, by which a sequence turns early.
const LEADS: [f64; 3] = [0.0, 0.5, 1.0];

impl LoadShares {
    /// `None` where I - calF is singular.
    pub fn new(model: &Collective, network: &Network) -> Option<Self> {
        let calF = model.calF().clone();
        let n = calF.nrows();
        let unknowns: Vec<Unknowns> = network.subsystems.iter().map(Unknowns::of).collect();
        let blocks: Vec<_> = unknowns.iter().enumerate().map(|(i, own)| model.on_chi(i, &own.M)).collect();
        let columns: Vec<_> = blocks.iter().flat_map(|block| block.column_iter()).collect();
        let Mcal = if columns.is_empty() { DMatrix::zeros(n, 0) } else { DMatrix::from_columns(&columns) };
        let steady = (DMatrix::identity(n, n) - &calF).full_piv_lu().solve(&Mcal)?;
        let loads = unknowns.iter().flat_map(|own| own.loads.iter().copied()).collect();
        Some(Self { tail: &calF * &steady, calF, Mcal, steady, loads })
    }

    /// The share of the row d over (x, e).
    pub fn of(&self, d: &DVector<f64>) -> Share {
        if self.loads.is_empty() {
            return Share::default();
        }
        let at_rest = self.steady.tr_mul(d).iter().zip(&self.loads).map(|(g, load)| load.largest(*g)).sum();
        let mut share = Share { at_rest, ..Share::default() };
        let (mut row, mut impulses, mut quiet) = (d.clone(), Vec::new(), 0);
        while quiet <= 50 && impulses.len() < LONGEST {
            let (impulse, left) = (self.Mcal.tr_mul(&row), self.tail.tr_mul(&row));
            let moved: f64 = left.iter().zip(&self.loads).map(|(g, load)| g.abs() * load.rate).sum();
            let ranged: f64 = impulse.iter().zip(&self.loads).map(|(g, load)| load.largest(*g)).sum();
            share.transient += moved;
            share.in_range += ranged;
            let still = moved <= 1e-16 * share.transient && ranged <= 1e-16 * share.in_range;
            quiet = if still { quiet + 1 } else { 0 };
            impulses.push(impulse);
            row = self.calF.tr_mul(&row);
        }
        let of_load = |(k, load): (usize, &Load)| {
            let response: Vec<f64> = impulses.iter().map(|impulse| impulse[k]).collect();
            load.attained(&response)
        };
        share.attained = self.loads.iter().enumerate().map(of_load).sum();
        share
    }

    /// (x, e) at rest under the loads d, all outputs' references 0.
    pub fn rest(&self, d: &DVector<f64>) -> DVector<f64> {
        &self.steady * d
    }

    /// The direction in which each load should move now for the row d over (x, e) to be largest `left` steps later.
    pub fn wanted(&self, d: &DVector<f64>, left: usize) -> DVector<f64> {
        let mut row = d.clone();
        (0..left).for_each(|_| row = self.calF.tr_mul(&row));
        self.Mcal.tr_mul(&row)
    }

    /// The same for the steady state.
    pub fn wanted_at_rest(&self, d: &DVector<f64>) -> DVector<f64> {
        self.steady.tr_mul(d)
    }
}

impl Load {
    /// Largest g d.
    fn largest(&self, g: f64) -> f64 {
        (g * self.min).max(g * self.max)
    }

    fn end(&self, g: f64) -> f64 {
        if g > 0.0 { self.max } else { self.min }
    }

    /// The best of a few sequences for a response, entry k of which is worth what the load was k steps ago.
    fn attained(&self, response: &[f64]) -> f64 {
        let crossing = if self.rate > 0.0 { (self.max - self.min) / self.rate } else { 0.0 };
        let at_rest = self.largest(response.iter().sum());
        let leads = LEADS.map(|part| self.following(response, (part * crossing).min(1e9) as usize));
        leads.into_iter().fold(at_rest, f64::max)
    }

    /// At rest at first, then towards the end that the response wants `lead` steps later.
    fn following(&self, response: &[f64], lead: usize) -> f64 {
        let mut now = response.last().map_or(0.0, |g| self.end(*g));
        let mut sum = 0.0;
        for (k, g) in response.iter().enumerate().rev() {
            let wanted = self.end(response[k.saturating_sub(lead)]);
            now = wanted.clamp(now - self.rate, now + self.rate);
            sum += g * now;
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1, -1/2 and nothing: the best is the upper end now and the lower end before, as far as the rate allows.
    #[test]
    fn a_load_follows_what_the_response_wants() {
        let load = |rate: f64| Load { min: -1.0, max: 1.0, rate };
        let response = [1.0, -0.5];
        assert_eq!(load(2.0).attained(&response), 1.5);
        assert_eq!(load(1.0).attained(&response), 1.0);
        assert_eq!(load(0.0).attained(&response), 0.5);
    }
}
