//! Parameters that are drawn, and what the runtime's solver does with them.

use dpc_runtime::solver::{Outcome, Side, Solver, WorkingSet};
use nalgebra::DVector;

use super::instance::{Instance, Task, with_room};
use super::space::Space;
use crate::problems::{DpcProblem, NO_ROW};

/// Numbers that are the same everywhere (SplitMix64).
#[derive(Debug, Clone)]
pub struct Random(pub u64);

impl Random {
    /// Evenly from [-1, 1).
    pub fn signed(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// 1 or -1.
    pub fn sign(&mut self) -> f64 {
        if self.signed() < 0.0 { -1.0 } else { 1.0 }
    }
}

/// The most changes of the working set that were seen.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Seen {
    /// Parameters with a solution.
    pub parameters: usize,
    /// From no row, and from the shifted set of the parameter before.
    pub cold: usize,
    pub warm: usize,
    /// Before it was proved that there is no solution, just outside.
    pub infeasible: usize,
    /// Solves that came to no end.
    pub undecided: usize,
}

/// Changes that no solve of a sample is stopped before.
pub const ENOUGH: usize = 100_000;

/// Facets of the set of parameters with a solution that are kept.
const MOST_FACETS: usize = 400;

/// A walk of `samples` parameters with a solution, most of them at the edge: from each the next lies in a random direction, up to where
/// there is no solution. What stops it there, by the solver's certificate, is a facet of that set, and is added to the space.
///
/// The box of the space is as small as these facets allow in the end. `None` where there is no solver of that size.
pub fn walk(dpc: &DpcProblem, space: &mut Space, samples: usize) -> Option<Seen> {
    let seen = with_room(dpc.V.ncols(), Walk { dpc, space, samples });
    space.tighten(dpc);
    seen
}

struct Walk<'a> {
    dpc: &'a DpcProblem,
    space: &'a mut Space,
    samples: usize,
}

impl Task for Walk<'_> {
    type Output = Seen;

    fn run<const NV: usize>(self) -> Seen {
        let Self { dpc, space, samples } = self;
        let (mut random, mut seen) = (Random(1), Seen::default());
        let Some(mut instance) = Instance::<NV>::new(dpc) else { return seen };
        let mut solver = Box::new(Solver::<NV>::NEW);
        let shift = dpc.shift();
        let mut at = vec![0.0; space.dimension()];
        let mut warm = WorkingSet::EMPTY;
        for _ in 0..samples {
            let direction: Vec<f64> = (0..at.len()).map(|_| random.signed().powi(3)).collect();
            let reach = space.reach_from(&at, &direction);
            if !reach.is_finite() {
                break;
            }
            // Often at the very edge.
            let mut share = (1.2 * 0.5 * (1.0 + random.signed())).min(1.0 - 1e-9);
            for _ in 0..TRIES {
                let next: Vec<f64> = at.iter().zip(&direction).map(|(p, d)| p + share * reach * d).collect();
                instance.at(space, &next);
                match solver.solve(&instance, &WorkingSet::EMPTY, ENOUGH) {
                    Outcome::Optimal { iterations } => {
                        seen.parameters += 1;
                        seen.cold = seen.cold.max(iterations);
                        let cold = shifted(&solver.working_set(), &shift);
                        match solver.solve(&instance, &warm, ENOUGH) {
                            Outcome::Optimal { iterations } => seen.warm = seen.warm.max(iterations),
                            _ => seen.undecided += 1,
                        }
                        (warm, at) = (cold, next);
                        break;
                    }
                    Outcome::Infeasible { .. } => {
                        seen.infeasible = seen.infeasible.max(solver.iterations());
                        space.learn(solver.certificate(), &next);
                    }
                    Outcome::IterationLimit => seen.undecided += 1,
                }
                share *= 0.7;
            }
        }
        seen
    }
}

/// Shorter steps in one direction.
const TRIES: usize = 30;

/// The rows that ask the same one stage earlier.
pub fn shifted<const NV: usize>(set: &WorkingSet<NV>, shift: &[usize]) -> WorkingSet<NV> {
    let mut next = WorkingSet::EMPTY;
    for (row, side) in set.iter().filter(|(row, _)| shift[*row] != NO_ROW) {
        next.push(shift[row], side);
    }
    next
}

impl Space {
    /// How far it is to the edge of the space.
    fn reach_from(&self, at: &[f64], direction: &[f64]) -> f64 {
        let wall = |p: f64, d: f64| if d == 0.0 { f64::INFINITY } else { (d.signum() - p) / d };
        let walls = at.iter().zip(direction).map(|(p, d)| wall(*p, *d)).fold(f64::INFINITY, f64::min);
        let facet = |c: &DVector<f64>| {
            let (room, pace) = c
                .iter()
                .skip(1)
                .zip(at.iter().zip(direction))
                .fold((c[0], 0.0), |(room, pace), (c, (p, d))| (room + c * p, pace - c * d));
            if pace > 0.0 { room.max(0.0) / pace } else { f64::INFINITY }
        };
        self.facets.iter().map(facet).fold(walls, f64::min)
    }

    /// Cuts off what a contradiction at `p` says has no solution: rows w >= limit, each times its weight, add up to 0 >= that of the
    /// limits.
    fn learn(&mut self, certificate: impl Iterator<Item = (usize, Side, f64)>, p: &[f64]) {
        if self.facets.len() >= MOST_FACETS {
            return;
        }
        let mut facet = DVector::zeros(1 + self.dimension());
        for (row, side, weight) in certificate {
            match side {
                Side::Lower => facet -= self.lower.row(row).transpose() * weight,
                Side::Upper => facet += self.upper.row(row).transpose() * weight,
            }
        }
        let size = facet.rows_range(1..).norm();
        let at = |facet: &DVector<f64>| facet[0] + facet.iter().skip(1).zip(p).map(|(c, p)| c * p).sum::<f64>();
        if size > 0.0 && at(&facet) < 0.0 {
            facet /= size;
            // The sum of the rows is zero but for rounding.
            facet[0] += LOOSE;
            if self.facets.iter().all(|other| (other - &facet).amax() > 1e-7) {
                self.facets.push(facet);
            }
        }
    }
}

/// What a facet of the set with solutions is moved out by, in units of the box.
const LOOSE: f64 = 1e-9;
