//! How many changes of the working set the on-line solver makes, and the limit that is baked in.
//!
//! # The limit
//! Without [`Design::counted`](crate::design::Design::counted) it is [`limit_by_size`]. With it, parameters are drawn (`sample`),
//! the network is run in a closed loop (`closed_loop`), and problems of at most eight unknowns are certified (`certify`). What was
//! seen, [`FACTOR`] times, is then the least the limit may be; and a certificate, where there is one, takes the place of the
//! formula: the certified number and [`reserve`]. In any case the shifted candidate (47) stands behind it.
//!
//! # What a certificate says
//! The limits of the rows are affine in the parameters ([`Space`]), hence so are w and the multipliers over each working set, and
//! the parameters on which the solver goes one way or the other are polyhedra. The solver's run is followed on all of them (as
//! for primal and dual active-set methods in Cimini and Bemporad, "Exact complexity certification of active-set methods for
//! quadratic programming", IEEE TAC 2017, and Arnström and Axehill, "A unifying complexity certification framework for
//! active-set methods for convex quadratic programming", IEEE TAC 2022), from no row and from every part of a shifted working set that
//! holds at some solution, until no new set comes up.
//!
//! It assumes exact arithmetic. A region is left out only where a Farkas certificate proves that no ball of radius
//! [`Certificate::thickest`] of the (scaled) parameters fits into it. On what is nearer than that to two ways of going on, and where
//! rounding turns a decision (the solver keeps multipliers down to -1e-6 of the largest at a start), the run may differ by a few
//! changes: that is what the reserve is for.
#![expect(non_snake_case, reason = "the symbols of the literature")]

mod certify;
mod closed_loop;
mod instance;
mod region;
mod sample;
mod space;
mod working;

use std::collections::BTreeSet;

use dpc_runtime::solver::Side;

use crate::design::Design;
use crate::network::Scalar;
use crate::problems::DpcProblem;
use crate::sharing::spread;
pub use certify::certify;
pub use instance::Instance;
pub use sample::{Seen, walk};
pub use space::{Parameters, Quantity, Space};

/// What is known of the solver's runs on one problem.
#[derive(Debug, Clone)]
pub struct Iterations {
    /// On parameters that were drawn; `None` where the problem is too large for the compiler's copy of the solver.
    pub seen: Option<Seen>,
    /// In closed loops.
    pub run: Option<Seen>,
    pub certificate: Result<Certificate, Uncertified>,
}

/// The longest runs of the solver over all admissible parameters.
#[derive(Debug, Clone, Default)]
pub struct Certificate {
    /// Changes of the working set where there is a solution: `Outcome::Optimal::iterations`.
    pub most: usize,
    /// Changes before it is proved that there is none, on what parameters outside were looked at; `None`: on none.
    pub infeasible: Option<usize>,
    /// Rows that a start may drop before the first look at all rows, which is no change of the working set.
    pub dropped: usize,
    /// Where the longest run is made.
    pub extreme: Option<Extreme>,
    /// Working sets that hold at some solution, as facets.
    pub sets: BTreeSet<Vec<usize>>,
    /// Starts: parts of shifted ones of these.
    pub starts: usize,
    pub regions: usize,
    /// Questions whether a region is empty that took a solver.
    pub questions: usize,
    /// No region was left out that a ball of this radius fits into, in parameters that are scaled to the box |p_k| <= 1.
    pub thickest: f64,
}

/// A parameter, and the start from which the solver's run is the longest there.
#[derive(Debug, Clone)]
pub struct Extreme {
    pub changes: usize,
    pub start: Vec<(usize, Side)>,
    /// In the coordinates of [`Space`].
    pub p: Vec<f64>,
    /// The run is the same for all parameters this near.
    pub radius: f64,
}

/// Why there is no certificate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Uncertified {
    /// So many unknowns: the solver goes on with rows that it has seen before then, and no working set says which.
    Unknowns(usize),
    /// So many parameters are too many.
    Parameters(usize),
    /// After so many questions whether a region is empty it was given up.
    Work(usize),
    /// Of some region it could not be told whether it is empty.
    Undecided,
    /// A certificate is about exact arithmetic with the thresholds of double precision.
    Precision,
}

/// What the limit is at least of what was seen.
pub const FACTOR: usize = 3;

/// Questions of a certificate per sample.
const QUESTIONS: usize = 100;

/// Limit of a problem that nothing more is known of. A dual active-set method changes its working set a few times the
/// number of active rows; this is generous.
pub fn limit_by_size(rows: usize, unknowns: usize) -> usize {
    4 * (rows + unknowns)
}

/// Changes beyond a certified number that rounding may cost: each unknown's row once out and once in.
pub fn reserve(unknowns: usize) -> usize {
    2 * unknowns
}

/// Draws about `samples` parameters for every problem of a design, lets it run as long in closed loops, and tries to certify it.
pub fn count(design: &Design, samples: usize) -> Vec<Iterations> {
    let runs = closed_loop::run(design, samples);
    let drawn = spread(runs.len(), |i| {
        let (s, sized) = (&design.network.subsystems[i], &design.sizing.subsystems[i]);
        let dpc = &design.problems.subsystems[i].dpc;
        let mut space = Space::new(dpc, s, sized, &design.network);
        let seen = walk(dpc, &mut space, samples);
        let certificate = match design.network.scalar {
            Scalar::Double => certify(dpc, &space, QUESTIONS * samples),
            Scalar::Single => Err(Uncertified::Precision),
        };
        (seen, certificate)
    });
    let both = drawn.into_iter().zip(runs);
    both.map(|((seen, certificate), run)| Iterations { seen, run, certificate }).collect()
}

impl Iterations {
    /// The limit to be baked in.
    pub fn limit(&self, dpc: &DpcProblem) -> usize {
        let (rows, unknowns) = dpc.V.shape();
        let (seen, _) = self.most_seen();
        match &self.certificate {
            Ok(certificate) => {
                (certificate.most.max(certificate.infeasible.unwrap_or(0)) + reserve(unknowns)).max(seen + 1)
            }
            Err(_) => limit_by_size(rows, unknowns).max(FACTOR * seen),
        }
    }

    /// The most changes that were seen, with and without solution, and how many problems had one.
    fn most_seen(&self) -> (usize, usize) {
        let all = || self.seen.iter().chain(&self.run);
        let most = all().map(|seen| seen.cold.max(seen.warm).max(seen.infeasible)).max();
        (most.unwrap_or(0), all().map(|seen| seen.parameters).sum())
    }

    /// Where the limit comes from, and why not from a certificate.
    pub fn origin(&self) -> (String, Option<Uncertified>) {
        let (seen, problems) = self.most_seen();
        match &self.certificate {
            Ok(Certificate { most, .. }) => {
                (format!("certified: at most {most} changes where there is a solution, rounding apart"), None)
            }
            Err(Uncertified::Precision) => {
                (format!("sampled in f64: at most {seen} changes in {problems} problems"), Some(Uncertified::Precision))
            }
            Err(why) => (format!("sampled: at most {seen} changes in {problems} problems"), Some(*why)),
        }
    }
}

impl std::fmt::Display for Uncertified {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Unknowns(count) => write!(f, "too many unknowns to certify ({count})"),
            Self::Parameters(count) => write!(f, "too many parameters to certify ({count})"),
            Self::Work(questions) => write!(f, "not certified after {questions} questions"),
            Self::Undecided => write!(f, "not certified, rounding"),
            Self::Precision => write!(f, "f32 is not certified"),
        }
    }
}
