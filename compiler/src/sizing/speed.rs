//! What another epsilon would mean for the set-points.
#![expect(non_snake_case, reason = "the paper's symbols")]

use nalgebra::DVector;

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
    /// What was found; `None` where there is no design at this epsilon.
    pub sizes: Option<Sizes>,
}

#[derive(Debug, Clone)]
pub struct Sizes {
    /// Y_i of every subsystem.
    pub Y: Vec<Box>,
    /// Half-widths of its Delta_i^z.
    pub dz: Vec<DVector<f64>>,
    /// The weighted sum of logarithms at the optimum: never more than at a smaller epsilon.
    pub objective: f64,
}

type Solution = (Program, Vec<f64>);

impl Sizing {
    /// Points at `count` values of epsilon that are spread up to about the largest one for which there is a design, and at the
    /// design's; in order of epsilon. None in a large network, whose programs take too long.
    pub fn against_epsilon(&self, network: &Network, gains: &Gains, sets: &Sets, count: usize) -> Vec<SpeedPoint> {
        let context = Context { network, gains, sets };
        if context.is_large() {
            return Vec::new();
        }
        let largest = context.largest_epsilon(self.epsilon);
        let least = LEAST * largest;
        let step = (largest - least) / (count.max(2) - 1) as f64;
        let spread_out = (0..count).map(|k| least + k as f64 * step);
        let mut epsilons: Vec<f64> = spread_out.chain([self.epsilon]).collect();
        epsilons.sort_by(f64::total_cmp);
        let alone = spread(epsilons.len(), |k| context.at_epsilon(epsilons[k]));
        context.descending(&epsilons, alone)
    }
}

/// The smallest epsilon, relative to the largest.
const LEAST: f64 = 0.02;
/// Halvings of the interval that holds the largest epsilon; it is known to some percent of the interval then.
const HALVINGS: usize = 6;

impl Context<'_> {
    /// Near the largest epsilon for which there is a design; there is one at `known`.
    fn largest_epsilon(&self, known: f64) -> f64 {
        let (mut low, mut high) = (known, self.beyond().unwrap_or(known).max(known));
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if self.at_epsilon(middle).is_some() { low = middle } else { high = middle }
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

    fn at_epsilon(&self, epsilon: f64) -> Option<Solution> {
        self.optimise(&at(epsilon), FEW_ROUNDS).ok()
    }

    /// The better of what each epsilon finds alone and by the multipliers of the next larger one, which are good for it too.
    fn descending(&self, epsilons: &[f64], alone: Vec<Option<Solution>>) -> Vec<SpeedPoint> {
        let mut larger: Option<Solution> = None;
        let mut points = Vec::new();
        for (&epsilon, alone) in epsilons.iter().zip(alone).rev() {
            let handed_on = larger.take().and_then(|(program, _)| self.by_proofs(epsilon, program));
            let worth = |(program, point): &Solution| program.objective(point);
            larger = alone.into_iter().chain(handed_on).max_by(|a, b| worth(a).total_cmp(&worth(b)));
            points.push(SpeedPoint { epsilon, sizes: larger.as_ref().map(|solution| self.sizes(solution)) });
        }
        points.reverse();
        points
    }

    fn by_proofs(&self, epsilon: f64, Program { proofs, .. }: Program) -> Option<Solution> {
        let program = Program::new(self, proofs, &at(epsilon));
        let Answer::Point(point) = program.solve() else { return None };
        Some(self.improved(program, point, &at(epsilon), FEW_ROUNDS))
    }

    fn sizes(&self, (program, point): &Solution) -> Sizes {
        let of = |i: usize| {
            let (max, min) = program.y_ends(point, i);
            Box { max, min: -min }
        };
        let count = self.network.subsystems.len();
        Sizes {
            Y: (0..count).map(of).collect(),
            dz: (0..count).map(|i| program.dz(point, i)).collect(),
            objective: program.objective(point),
        }
    }
}

fn at(epsilon: f64) -> Asks {
    Asks { epsilon: Some(epsilon), ..Asks::default() }
}
