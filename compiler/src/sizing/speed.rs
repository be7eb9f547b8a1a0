//! What another epsilon would mean for the set-points.
#![expect(non_snake_case, reason = "the paper's symbols")]

use super::program::{Asks, Goal, Program};
use super::{Context, FEW_ROUNDS, Sizing};
use crate::convex::Box;
use crate::gains::Gains;
use crate::network::Network;
use crate::optim::conic::Answer;
use crate::sets::Sets;
use crate::sharing::spread;

/// The sizes that the program finds where epsilon is given, all else being chosen anew by the same weights; neither rounded nor
/// verified.
#[derive(Debug, Clone)]
pub struct SpeedPoint {
    /// In output units per step.
    pub epsilon: f64,
    /// Y_i of every subsystem; `None` where no design exists at this epsilon.
    pub Y: Option<Vec<Box>>,
}

impl Sizing {
    /// Points at `count` values of epsilon that are spread up to about the largest one for which there is a design, and at the design's.
    /// None in a large network, whose programs take too long.
    pub fn against_epsilon(&self, network: &Network, gains: &Gains, sets: &Sets, count: usize) -> Vec<SpeedPoint> {
        let context = Context { network, gains, sets };
        if context.is_large() {
            return Vec::new();
        }
        let largest = context.largest_epsilon(self.epsilon);
        let least = 0.02 * largest;
        let step = (largest - least) / (count.max(2) - 1) as f64;
        let spread_out = (0..count).map(|k| least + k as f64 * step);
        let mut epsilons: Vec<f64> = spread_out.chain([self.epsilon]).collect();
        epsilons.sort_by(f64::total_cmp);
        spread(epsilons.len(), |k| context.at_epsilon(epsilons[k]))
    }
}

/// Halvings of the interval that holds the largest epsilon; it is known to some percent of the interval then.
const HALVINGS: usize = 6;

impl Context<'_> {
    /// Near the largest epsilon for which there is a design; there is one at `known`.
    fn largest_epsilon(&self, known: f64) -> f64 {
        let (mut low, mut high) = (known, self.beyond().unwrap_or(known).max(known));
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if self.at_epsilon(middle).Y.is_some() { low = middle } else { high = middle }
        }
        low
    }

    /// The largest epsilon that leaves any set-point, with reserve, cover and margins dropped.
    fn beyond(&self) -> Option<f64> {
        let program = Program::new(self, self.nominal_proofs().ok()?, &Asks { goal: Goal::Epsilon, ..Asks::default() });
        match program.solve() {
            Answer::Point(point) => Some(program.epsilon(&point)).filter(|epsilon| epsilon.is_finite()),
            _ => None,
        }
    }

    fn at_epsilon(&self, epsilon: f64) -> SpeedPoint {
        let asks = Asks { epsilon: Some(epsilon), ..Asks::default() };
        let found = self.optimise(&asks, FEW_ROUNDS).ok();
        let ranges = |(program, point): (Program, Vec<f64>)| {
            let of = |i: usize| {
                let (max, min) = program.y_ends(&point, i);
                Box { max, min: -min }
            };
            (0..self.network.subsystems.len()).map(of).collect()
        };
        SpeedPoint { epsilon, Y: found.map(ranges) }
    }
}
