//! The merit of gains, at the price of as little of a design as possible.

use super::candidate::Candidate;
use super::{Progress, Watch};
use crate::diagnostic::Diagnostics;
use crate::gains::Gains;
use crate::network::Network;
use crate::sets::{Sets, Sums, small_gain_matrix};
use crate::sizing::{Aim, Merit, Proofs, Sizing, Stage};

/// Compares candidates and counts them.
pub struct Judge<'a> {
    pub network: &'a Network,
    pub aim: Aim,
    /// The largest small-gain radius that is not held against a candidate.
    pub most_gain: f64,
    /// By this and earlier judges of the same search.
    pub compared: usize,
    limit: usize,
    whole: usize,
    basis: Option<Basis>,
    watch: &'a mut dyn Watch,
}

/// Comparisons made before, to be made, and to be made by all judges of one search together.
#[derive(Debug, Clone, Copy)]
pub struct Budget {
    pub before: usize,
    pub share: usize,
    pub whole: usize,
}

/// What depends on the K_i alone.
struct Basis {
    candidate: Candidate,
    sets: Sets,
    proofs: Vec<Proofs>,
}

impl<'a> Judge<'a> {
    pub fn new(network: &'a Network, Budget { before, share, whole }: Budget, watch: &'a mut dyn Watch) -> Self {
        let (aim, most_gain) = (Aim::Wishes, f64::INFINITY);
        Self { network, aim, most_gain, compared: before, limit: before + share, whole, basis: None, watch }
    }

    pub fn left(&self) -> usize {
        self.limit.saturating_sub(self.compared)
    }

    /// Stages are passed in order, and the first that fails ends it.
    pub fn merit(&mut self, candidate: &Candidate) -> Merit {
        self.compared += 1;
        self.watch.searched(Progress { compared: self.compared.min(self.whole), budget: self.whole });
        let network = candidate.network(self.network);
        match Gains::new(&network) {
            Ok(gains) => self.of_stable(candidate, &network, &gains),
            Err(_) => Merit { stage: Stage::Unstable, value: -candidate.radii(self.network).largest() },
        }
    }

    fn of_stable(&mut self, candidate: &Candidate, network: &Network, gains: &Gains) -> Merit {
        if let Some(basis) = self.basis.as_ref().filter(|basis| basis.candidate.same_local(candidate)) {
            return match basis.sets.with_references(network, gains, Sums::Estimated) {
                Ok(sets) => self.aim.appraise_with(network, gains, &sets, &basis.proofs),
                Err(_) => Merit { stage: Stage::Shapeless, value: -basis.sets.rho_small_gain },
            };
        }
        let (_, radius) = small_gain_matrix(network, &gains.subsystems);
        if radius.is_nan() || radius > self.most_gain {
            return Merit { stage: Stage::Coupled, value: if radius.is_nan() { f64::NEG_INFINITY } else { -radius } };
        }
        let Ok(sets) = Sets::with_sums(network, gains, Sums::Estimated) else {
            return Merit { stage: Stage::Shapeless, value: -radius };
        };
        let (merit, proofs) = self.aim.appraise(network, gains, &sets);
        if let Some(proofs) = proofs {
            self.basis = Some(Basis { candidate: candidate.clone(), sets, proofs });
        }
        merit
    }

    /// Makes the multipliers anew at the next candidate.
    pub fn forget(&mut self) {
        self.basis = None;
    }

    /// The design these gains allow, by the stages of the pipeline, and its merit.
    ///
    /// # Errors
    /// The mistakes of the first stage that finds any.
    pub fn design(&self, candidate: &Candidate, sums: Sums) -> Result<Judged, Diagnostics> {
        let network = candidate.network(self.network);
        let gains = Gains::new(&network)?;
        let sets = Sets::with_sums(&network, &gains, sums)?;
        let sizing = Sizing::new(&network, &gains, &sets)?;
        let merit = self.aim.appraise(&network, &gains, &sets).0;
        let covered_epsilon = self.aim.covered_epsilon(&network, &gains, &sets);
        Ok(Judged { sizing, merit, covered_epsilon })
    }
}

/// A whole design.
pub struct Judged {
    pub sizing: Sizing,
    pub merit: Merit,
    /// The epsilon of [`Aim::Speed`].
    pub covered_epsilon: Option<f64>,
}
