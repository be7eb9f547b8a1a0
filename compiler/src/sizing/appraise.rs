//! How good a design some gains allow, without making it.

use nalgebra::DVector;

use super::program::{Asks, Goal, Program};
use super::{Context, Failure, Proofs};
use crate::gains::Gains;
use crate::network::Network;
use crate::optim::conic::Answer;
use crate::sets::Sets;

/// What is compared between gains. A later stage is better than an earlier one, whatever the values; within a stage,
/// the larger value is better.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Merit {
    pub stage: Stage,
    pub value: f64,
}

/// How far the design comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Some loop is not stable; minus its spectral radius.
    Unstable,
    /// The small gain has not the wanted margin; minus its radius.
    Coupled,
    /// No invariant sets, or no answer from the program; minus the small-gain radius.
    Shapeless,
    /// What acts on the states leaves no set-point; the share of it that does.
    Disturbed,
    /// The given epsilon leaves no set-point; the largest one that does, relative.
    TooFast,
    /// The margins of changing constraints are out of reach; one less the share by which they are exceeded.
    Exposed,
    /// The wanted reserve is out of reach; the share that is not.
    Reserve,
    /// The set-points to cover are out of reach; the share that is not.
    Cover,
    /// A design; its objective, less what changing constraints are charged.
    Designed,
}

/// What gains are to be good for.
#[derive(Debug, Clone)]
pub enum Aim {
    /// The objective of [`super::Sizing`].
    Wishes,
    /// The largest epsilon that leaves the set-points to cover and this Delta_i^z; beside it the terminal sets, as the
    /// network's weights say.
    Speed { reserve: Vec<DVector<f64>> },
}

impl Aim {
    fn asks(&self) -> Asks {
        match self {
            Self::Wishes => Asks::default(),
            Self::Speed { reserve } => Asks { goal: Goal::Speed, reserve: Some(reserve.clone()), ..Asks::default() },
        }
    }

    /// Appraises from scratch; returns the multipliers too, which stay valid for all gains with the same K_i.
    pub fn appraise(&self, network: &Network, gains: &Gains, sets: &Sets) -> (Merit, Option<Vec<Proofs>>) {
        let context = Context { network, gains, sets };
        match context.optimise(&self.asks(), ROUNDS) {
            Ok((program, point)) => (designed(&context, &program, &point), Some(program.proofs)),
            Err(Failure::NoPoint(proofs, _)) => (self.shortfall(&context, &proofs), Some(proofs)),
            Err(Failure::NoProof(_)) => (shapeless(sets), None),
        }
    }

    /// Appraises with known multipliers: one program.
    pub fn appraise_with(&self, network: &Network, gains: &Gains, sets: &Sets, proofs: &[Proofs]) -> Merit {
        let context = Context { network, gains, sets };
        let program = Program::new(&context, proofs.to_vec(), &self.asks());
        match program.solve() {
            Answer::Point(point) => designed(&context, &program, &point),
            _ => self.shortfall(&context, proofs),
        }
    }

    /// The epsilon of [`Aim::Speed`]; `None` for another aim, or where there is none.
    pub fn covered_epsilon(&self, network: &Network, gains: &Gains, sets: &Sets) -> Option<f64> {
        if matches!(self, Self::Wishes) {
            return None;
        }
        let (program, point) = Context { network, gains, sets }.optimise(&self.asks(), super::ROUNDS).ok()?;
        Some(program.epsilon(&point))
    }

    /// Which wish fails first, and by how much; the order is that of the messages of [`super::Sizing::new`].
    fn shortfall(&self, context: &Context, proofs: &[Proofs]) -> Merit {
        let limit = |goal| {
            let program = Program::new(context, proofs.to_vec(), &Asks { goal, ..self.asks() });
            match program.solve() {
                Answer::Point(point) => Some(program.factor(&point).unwrap_or_else(|| program.epsilon(&point))),
                _ => None,
            }
        };
        if context.network.is_disturbed()
            && let Some(value) = limit(Goal::Disturbance).filter(|value| *value < 1.0 - 1e-6)
        {
            return Merit { stage: Stage::Disturbed, value };
        }
        if let Some(epsilon) = context.network.reference.epsilon
            && let Some(value) = limit(Goal::Epsilon).filter(|value| *value < epsilon * (1.0 + 1e-6))
        {
            return Merit { stage: Stage::TooFast, value: value / epsilon };
        }
        let margins = context.network.has_margins().then_some((Goal::Margin, Stage::Exposed));
        let wishes = [(Goal::Reserve, Stage::Reserve), (Goal::Cover, Stage::Cover)];
        for (goal, stage) in margins.into_iter().chain(wishes) {
            if let Some(value) = limit(goal).filter(|value| *value < 1.0 - 1e-6) {
                return Merit { stage, value };
            }
        }
        shapeless(context.sets)
    }
}

/// Rounds of better multipliers; the first ones gain most.
const ROUNDS: usize = 2;

/// Beside the objective counts what changing constraints are charged, as much as the ranges of the same outputs.
fn designed(context: &Context, program: &Program, point: &[f64]) -> Merit {
    let charged = context.network.wishes.y_weight * program.exposure(context, point);
    Merit { stage: Stage::Designed, value: program.objective(point) - charged }
}

fn shapeless(sets: &Sets) -> Merit {
    Merit { stage: Stage::Shapeless, value: -sets.rho_small_gain }
}
