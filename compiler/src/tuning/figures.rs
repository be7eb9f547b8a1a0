//! What two designs are compared by.

#![expect(non_snake_case, reason = "the paper's symbols")]

use super::candidate::Candidate;
use super::coupling;
use super::judge::Judged;
use crate::diagnostic::Diagnostics;
use crate::network::Network;
use crate::sizing::Sizing;

/// The figures of one design, as far as it comes.
#[derive(Debug, Clone, PartialEq)]
pub struct Figures {
    /// Spectral radius of A + BK (Assumption 1).
    pub rho_F: f64,
    /// Spectral radius of calF (Assumption 3).
    pub rho_calF: f64,
    /// Small-gain radius (Assumption 4); `None` where some F_ii is not stable.
    pub rho_small_gain: Option<f64>,
    /// The finished design, or why there is none.
    pub design: Result<DesignFigures, String>,
}

/// What a finished design offers.
#[derive(Debug, Clone, PartialEq)]
pub struct DesignFigures {
    pub epsilon: f64,
    /// Volume of the product of the Y_i.
    pub y_volume: f64,
    /// Geometric mean of the half-widths of all Delta_i^z; `None` where nothing is exported.
    pub reserve: Option<f64>,
    /// What the sizing program maximised.
    pub objective: f64,
    /// The largest epsilon that leaves the set-points to cover and the reserve of the plain design, where that was
    /// sought.
    pub covered_epsilon: Option<f64>,
}

impl Figures {
    pub(super) fn new(candidate: &Candidate, network: &Network, design: &Result<Judged, Diagnostics>) -> Self {
        let radii = candidate.radii(network);
        Self {
            rho_F: radii.F,
            rho_calF: radii.calF,
            rho_small_gain: coupling::radius(network, candidate),
            design: design.as_ref().map(DesignFigures::new).map_err(why),
        }
    }
}

impl DesignFigures {
    fn new(design: &Judged) -> Self {
        let sizing = &design.sizing;
        Self {
            epsilon: sizing.epsilon,
            y_volume: sizing.subsystems.iter().map(|s| s.Y.volume()).product(),
            reserve: reserve(sizing),
            objective: sizing.objective,
            covered_epsilon: design.covered_epsilon,
        }
    }
}

fn reserve(sizing: &Sizing) -> Option<f64> {
    let logs: Vec<f64> = sizing.subsystems.iter().flat_map(|s| s.dz.iter().map(|dz| dz.ln())).collect();
    (!logs.is_empty()).then(|| (logs.iter().sum::<f64>() / logs.len() as f64).exp())
}

fn why(mistakes: &Diagnostics) -> String {
    mistakes.0.first().map(|first| format!("{} ({})", first.title, first.code)).unwrap_or_default()
}
