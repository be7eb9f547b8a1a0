//! The reference-output problem (29)-(31) with (28).

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::diagnostic::{Diagnostic, code};
use crate::network::{Network, Norm, Subsystem};
use crate::sizing::SubsystemSizing;

/// (29)-(31) with (28).
#[derive(Debug)]
pub enum ReferenceProblem {
    /// An interval per output: one output, or T_i diagonal, q = inf and every coupling row on one output only; no changing
    /// constraint.
    Clamp {
        /// t / (t + gamma) per output.
        weight: DVector<f64>,
        /// Per coupling row of this subsystem: output it acts on, coefficient.
        rows: Vec<(usize, f64)>,
    },
    /// A least-distance problem in the eigenbasis of T_i; rows as in `dpc_runtime::tables::Nearest`.
    Nearest {
        basis: DMatrix<f64>,
        weights: DVector<f64>,
        set: DMatrix<f64>,
        set_limit: DVector<f64>,
        rate: DMatrix<f64>,
        euclidean: bool,
        coupling: DMatrix<f64>,
    },
}

impl ReferenceProblem {
    pub fn new(network: &Network, i: usize, sized: &SubsystemSizing) -> Result<Self, Diagnostic> {
        let s = &network.subsystems[i];
        let constraints = network.coupling_constraints.iter();
        let coupling: Vec<&DVector<f64>> = constraints.filter_map(|c| c.H.get(&i)).collect();
        match clamp_rows(network, s, &coupling) {
            Some(rows) => Ok(Self::clamp(network, s, rows)),
            None => Self::nearest(network, s, sized, &coupling),
        }
    }

    fn clamp(network: &Network, s: &Subsystem, rows: Vec<(usize, f64)>) -> Self {
        let weight = DVector::from_fn(s.p(), |k, _| s.T[(k, k)] / (s.T[(k, k)] + network.reference.gamma));
        Self::Clamp { weight, rows }
    }

    fn nearest(
        network: &Network,
        s: &Subsystem,
        sized: &SubsystemSizing,
        coupling: &[&DVector<f64>],
    ) -> Result<Self, Diagnostic> {
        let p = s.p();
        let eigen = SymmetricEigen::new(s.T.clone());
        let rate = match network.reference.norm {
            Norm::Inf => axes(p),
            Norm::One if p <= MOST_OUTPUTS => signs(p),
            Norm::One => return Err(too_many_outputs(network, s)),
            Norm::Two => DMatrix::zeros(0, p),
        };
        Ok(Self::Nearest {
            basis: eigen.eigenvectors,
            weights: eigen.eigenvalues,
            set: axes(p),
            set_limit: DVector::from_fn(2 * p, |r, _| if r < p { sized.Y.max[r] } else { -sized.Y.min[r - p] }),
            rate,
            euclidean: network.reference.norm == Norm::Two,
            coupling: DMatrix::from_fn(coupling.len(), p, |h, k| coupling[h][k]),
        })
    }
}

/// The ball of q = 1 has 2^p facets.
const MOST_OUTPUTS: usize = 6;

/// The coupling rows as (output, coefficient) where (29) splits into one interval per output.
fn clamp_rows(network: &Network, s: &Subsystem, coupling: &[&DVector<f64>]) -> Option<Vec<(usize, f64)>> {
    let diagonal = (0..s.p()).all(|i| (0..s.p()).all(|j| i == j || s.T[(i, j)] == 0.0));
    // The interval of each output would change with the rows.
    if s.exposed.is_some() || s.p() > 1 && (!diagonal || network.reference.norm != Norm::Inf) {
        return None;
    }
    let single = |row: &&DVector<f64>| {
        let mut entries = row.iter().enumerate().filter(|(_, value)| **value != 0.0);
        let (k, value) = entries.next()?;
        entries.next().is_none().then_some((k, *value))
    };
    coupling.iter().map(single).collect()
}

/// [I; -I].
fn axes(p: usize) -> DMatrix<f64> {
    DMatrix::from_fn(2 * p, p, |r, k| f64::from(r == k) - f64::from(r == k + p))
}

/// Every row of signs.
fn signs(p: usize) -> DMatrix<f64> {
    DMatrix::from_fn(1 << p, p, |r, k| if r >> k & 1 == 0 { 1.0 } else { -1.0 })
}

fn too_many_outputs(network: &Network, s: &Subsystem) -> Diagnostic {
    Diagnostic::error(code::TOO_MANY_OUTPUTS, format!("norm = 1 with {} outputs in subsystem `{}`", s.p(), s.name))
        .at(network.places.epsilon.clone().unwrap_or_else(|| s.places.header.clone()), "the rate limit of (30)")
        .note(format!(
            "the 1-norm ball has 2^p facets, at most {MOST_OUTPUTS} outputs per subsystem are supported with it"
        ))
        .help("use norm = \"inf\" or 2, or split the subsystem")
}
