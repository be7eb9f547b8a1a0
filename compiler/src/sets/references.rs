//! The reference system's steady states and Delta^chi, (9)-(13), in the rows of X_i and U_i: by collective matrices, or where a
//! network is large by sparse rows.

mod dense;
mod sparse;

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

pub use dense::steady_error;

use super::outputs::{self, OutputShare, OutputShares};
use super::{MOST_DRIFT, Scales, Sums, floor, loads};
use crate::convex::MOST_STEPS;
use crate::diagnostic::{Diagnostic, Diagnostics, code};
use crate::gains::{Gains, Proof, SubsystemGains};
use crate::network::{Network, Scalar, Subsystem};
use crate::rounding::Rounding;
use crate::sharing::spread;

/// What the references may take of one row of X_i x U_i, (25b).
#[derive(Debug, Clone)]
pub struct ReferenceShare {
    /// Support of Delta_i^chi in the row's direction, per unit of epsilon.
    pub rate: f64,
    /// The row on the steady state of (9): coefficients by entry of the collective y; those that are not listed are small, and
    /// charged by `rest`.
    pub steady: Vec<(usize, f64)>,
    /// Bound of the rounding error of each entry of `steady`.
    pub steady_error: f64,
    /// What the entries of the collective y that `steady` does not list take as long as none is larger than
    /// [`super::Scales::y_cap`].
    pub rest: f64,
    /// How much of `rate` could not be summed: bounds of what is left of sums that were ended, and of rounding.
    pub doubt: f64,
    /// Bound of the row on the transient of a start that drifts by the floor in every state of the network.
    pub drift: f64,
    /// Upper bound of the share in the row of the loads, see [`loads`], and of what rounding adds to the references, see
    /// [`crate::rounding`].
    pub load: f64,
}

/// Shares in the rows of X_i on xref, and of U_i on uref = calK chi.
pub type Shares = (Vec<ReferenceShare>, Vec<ReferenceShare>);

pub enum References {
    Dense(Box<dense::References>),
    Sparse(Box<sparse::References>),
}

impl References {
    /// `y_caps` as in [`super::Scales::y_cap`], one after the other.
    pub fn new(
        network: &Network,
        gains: &Gains,
        rounding: &[Rounding],
        y_caps: impl FnOnce() -> DVector<f64>,
    ) -> Result<Self, Diagnostics> {
        let rounded = rounded(network, rounding);
        let references = match &gains.proof {
            Proof::Norm(contraction) => {
                dense::References::new(network, gains, contraction, rounded).map(|dense| Self::Dense(Box::new(dense)))
            }
            Proof::Responses(responses) => {
                let sparse = sparse::References::new(network, gains, responses, y_caps(), rounded);
                sparse.map(|sparse| Self::Sparse(Box::new(sparse)))
            }
        };
        references.ok_or_else(|| no_steady_state(network).into())
    }

    pub fn shares(&self, network: &Network, gains: &Gains, sums: Sums) -> Vec<Shares> {
        match self {
            Self::Dense(dense) => dense.shares(network, gains, sums),
            Self::Sparse(sparse) => sparse.shares(network, gains, sums),
        }
    }

    /// Per coupling constraint and member: support of Delta_j^chi in the member's row, per unit of epsilon.
    pub fn coupling(&self, network: &Network) -> Vec<BTreeMap<usize, f64>> {
        match self {
            Self::Dense(dense) => dense.coupling(network),
            Self::Sparse(sparse) => sparse.coupling(network),
        }
    }

    /// Per subsystem: rows over the outputs, where it is in a changing constraint.
    pub fn outputs(&self, network: &Network, sums: Sums) -> Vec<OutputShares> {
        let of = |i: usize| match network.subsystems[i].exposed {
            Some(_) => self.outputs_of(network, i, sums),
            None => OutputShares::default(),
        };
        spread(network.subsystems.len(), of)
    }

    fn outputs_of(&self, network: &Network, i: usize, sums: Sums) -> OutputShares {
        let s = &network.subsystems[i];
        let shares = |rows: Vec<DVector<f64>>| -> Vec<OutputShare> {
            rows.into_iter().map(|row| self.output(i, &s.C.tr_mul(&row), sums).on(row)).collect()
        };
        let axes = shares(outputs::axes(s));
        let oblique = match &axes[..] {
            [one, other] if sums == Sums::Proved => shares(outputs::oblique([one.rate, other.rate])),
            _ => Vec::new(),
        };
        OutputShares { axes, oblique }
    }

    /// A row over x_i that is one over the outputs: C_i chi_ss = yref, whatever the loads, so steady states take nothing.
    fn output(&self, i: usize, row: &DVector<f64>, sums: Sums) -> Transients {
        match self {
            Self::Dense(dense) => dense.output(i, row, sums),
            Self::Sparse(sparse) => sparse.output(i, row, sums),
        }
    }

    /// Per coupling constraint: what transients of the loads take of it.
    pub fn coupling_loads(&self, network: &Network) -> Vec<f64> {
        match self {
            Self::Dense(dense) => dense.coupling_loads(network),
            Self::Sparse(sparse) => sparse.coupling_loads(network),
        }
    }
}

/// What transients of the references take of a row in either direction.
pub struct Transients {
    /// Per unit of epsilon.
    rate: f64,
    load: f64,
    /// Of a start that drifts by the floor.
    drift: f64,
}

impl Transients {
    const UNKNOWN: Self = Self { rate: f64::INFINITY, load: f64::INFINITY, drift: f64::INFINITY };

    fn on(self, row: DVector<f64>) -> OutputShare {
        let Self { rate, load, drift } = self;
        OutputShare { row, rate, load, drift: drift * MOST_DRIFT }
    }
}

/// The rows of X_i and of U_i over chi_i.
fn rows(s: &Subsystem, g: &SubsystemGains) -> Vec<DVector<f64>> {
    let size = s.n() + s.p();
    let rows = |rows: DMatrix<f64>| -> Vec<_> { rows.row_iter().map(|row| row.transpose()).collect() };
    [rows(s.X.H.clone().resize_horizontally(size, 0.0)), rows(&s.U.H * g.calK())].concat()
}

/// The rows that are different but for their sign, and for each of `rows` which it is, with its sign.
fn different(rows: &[DVector<f64>]) -> (Vec<DVector<f64>>, Vec<(usize, f64)>) {
    let mut different: Vec<DVector<f64>> = Vec::new();
    let mut of = Vec::new();
    for row in rows {
        let opposite = -row;
        let known = different.iter().position(|known| known == row || *known == opposite);
        let k = known.unwrap_or(different.len());
        if known.is_none() {
            different.push(row.clone());
        }
        of.push((k, if different[k] == *row { 1.0 } else { -1.0 }));
    }
    (different, of)
}

/// What a step of the references rounds, in the places of the collective chi; `None` where that is nothing.
fn rounded(network: &Network, rounding: &[Rounding]) -> Option<DVector<f64>> {
    (network.scalar == Scalar::Single)
        .then(|| DVector::from_vec(rounding.iter().flat_map(|rounding| rounding.chi.iter().copied()).collect()))
}

/// The floor of every state of the network, in the places of the collective chi.
fn collective_floor(network: &Network, gains: &Gains) -> DVector<f64> {
    let mut whole = DVector::zeros(gains.calF.nrows());
    for (s, &start) in network.subsystems.iter().zip(&gains.chi_offset) {
        whole.rows_mut(start, s.n()).copy_from(&floor(s));
    }
    whole
}

/// Refuses references that would be charged many times what they take: such a design keeps its promises and is good for
/// nothing. Of a row that only the slowest mode of calF acts on, the steps that are summed make a known share; where they
/// make far less of what is charged, the rest is not what references take but what the proof could not follow.
///
/// # Errors
/// E0304, with the worst row.
pub fn check_charges(
    network: &Network,
    gains: &Gains,
    scales: &[Scales],
    shares: &[Shares],
) -> Result<(), Diagnostics> {
    let summed = 1.0 - gains.rho_calF.powf(MOST_STEPS as f64);
    let widest = scales.iter().map(|scales| scales.y.amax()).fold(0.0, f64::max);
    let fastest = network.reference.epsilon.unwrap_or(widest);
    let rows = network.subsystems.iter().zip(shares).flat_map(|(s, (x_rows, u_rows))| {
        let names = s.X.rows.iter().chain(&s.U.rows).zip(s.X.h.iter().chain(&s.U.h));
        let times = move |share: &ReferenceShare| summed * share.rate / (share.rate - share.doubt);
        // Of a row that references do not move, all is doubt, and none of it matters.
        let told =
            names.zip(x_rows.iter().chain(u_rows)).filter(move |((_, h), share)| share.doubt * fastest > LITTLE * *h);
        told.map(move |((name, _), share)| (s, name, times(share)))
    });
    let worst = rows.filter(|(.., times)| !times.is_nan()).max_by(|(.., a), (.., b)| a.total_cmp(b));
    match worst {
        Some((s, row, times)) if times > MOST_TIMES => Err(too_slow(network, gains, s, row, times).into()),
        _ => Ok(()),
    }
}

/// Shares of a limit up to here are nothing.
const LITTLE: f64 = 1e-6;

/// How many times too much a row may be charged.
const MOST_TIMES: f64 = 10.0;

fn too_slow(network: &Network, gains: &Gains, s: &Subsystem, row: &str, times: f64) -> Diagnostic {
    let decay = 1.0 - gains.rho_calF;
    let error =
        Diagnostic::error(code::STEADY_STATE, "the references settle too slowly for their transients to be bounded")
            .at(s.places.header.clone(), format!("`{row}` would be charged over {times:.1e} times what they take"))
            .note(format!(
                "the slowest mode of calF decays by {decay:.1e} per step: it takes {:.1e} s to halve",
                std::f64::consts::LN_2 / decay * network.sample_time
            ));
    let error = match gains.rank_margin.filter(|margin| *margin < 1e-3) {
        Some(margin) => error.note(format!(
            "outputs that the inputs hardly hold make such modes: the smallest singular value of Assumption 2 is {margin:.1e} of the largest (rows and columns scaled)"
        )),
        _ => error,
    };
    error.help("choose faster reference gains (a larger Qe in `reference-weights`: the outputs may be in a unit that is far too large), other outputs, or --effort 2")
}

fn no_steady_state(network: &Network) -> Diagnostic {
    let mut error = Diagnostic::error(
        code::STEADY_STATE,
        "the steady states of the references cannot be computed to working accuracy",
    );
    for s in &network.subsystems {
        error = error.at(s.places.header.clone(), "one of the subsystems");
    }
    error
        .note(
            "I - calF is singular in double precision although calF is stable: some closed-loop mode is extremely slow",
        )
        .help("choose faster gains (a larger Qe in `reference-weights`) or a longer sample time")
}
