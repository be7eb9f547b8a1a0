//! Why there is no plan, and how far the nearest start with one is.

use std::fmt;

use nalgebra::DVector;

use super::LONGEST;
use crate::diagnostic::{Diagnostic, code};
use crate::network::{Network, Start, Subsystem};
use crate::optim::rounding::to_digits;

/// Why a start has no plan.
#[derive(Debug, Clone, PartialEq)]
pub enum NoPlan {
    /// The start has the wrong number of subsystems, or of states or loads of the one given here.
    WrongShape { subsystem: usize },
    /// A state is no number or lies outside of X_i, or a load outside its bounds.
    Outside { subsystem: usize },
    /// There are changing constraints: plans know no rows.
    Changing,
    /// No window of up to [`LONGEST`] steps holds a plan.
    NoneFound {
        /// `None` where that could not be computed either.
        nearest: Option<Box<Nearest>>,
        /// What the solver said where it could not decide about a window.
        failed: Option<String>,
    },
}

/// The start nearest to the stated one that has a plan: one was made for it.
#[derive(Debug, Clone, PartialEq)]
pub struct Nearest {
    /// Per subsystem.
    pub x0: Vec<DVector<f64>>,
    /// What distances are measured in: the width of each state's range.
    pub ranges: Vec<DVector<f64>>,
    /// Every start with a plan over the longest window has a state that differs by at least this share of its range: the dual
    /// objective, hence true up to the solver's tolerance and the margins, some 1e-6.
    pub bound: f64,
    /// The rows that stop nearer starts, the weightiest first.
    pub rows: Vec<String>,
}

/// Moves smaller than this share of a state's range are not told.
const TOLD: f64 = 1e-6;

/// Digits of told numbers.
const DIGITS: usize = 6;

pub fn check(network: &Network, start: &Start) -> Result<(), NoPlan> {
    if !network.changing_constraints.is_empty() {
        return Err(NoPlan::Changing);
    }
    let count = network.subsystems.len();
    if start.x0.len() != count || start.d0.len() != count {
        return Err(NoPlan::WrongShape { subsystem: start.x0.len().min(start.d0.len()).min(count) });
    }
    for (subsystem, s) in network.subsystems.iter().enumerate() {
        let (x0, d0) = (&start.x0[subsystem], &start.d0[subsystem]);
        if x0.len() != s.n() || d0.len() != s.loads.len() {
            return Err(NoPlan::WrongShape { subsystem });
        }
        if !inside(s, x0, d0) {
            return Err(NoPlan::Outside { subsystem });
        }
    }
    Ok(())
}

fn inside(s: &Subsystem, x0: &DVector<f64>, d0: &DVector<f64>) -> bool {
    let states = x0.iter().all(|x| x.is_finite()) && (&s.X.H * x0).iter().zip(&s.X.h).all(|(value, h)| value <= h);
    states && (0..d0.len()).all(|k| (s.loads.min[k]..=s.loads.max[k]).contains(&d0[k]))
}

impl Nearest {
    /// The largest move of a state, as a share of its range.
    pub fn distance(&self, start: &Start) -> f64 {
        let moves = self.x0.iter().zip(&start.x0).zip(&self.ranges);
        moves.map(|((x, wanted), range)| (x - wanted).component_div(range).amax()).fold(0.0, f64::max)
    }

    /// `h1 = -11.9 instead of -12.4 cm (1.25 % of its range)` for every state of subsystem i that has to differ.
    fn moves(&self, s: &Subsystem, i: usize, start: &Start) -> Vec<String> {
        let (x, wanted, range) = (&self.x0[i], &start.x0[i], &self.ranges[i]);
        let told = (0..s.n()).filter(|k| (x[*k] - wanted[*k]).abs() > TOLD * range[*k]);
        let words = |k: usize| {
            let unit = s.states[k].unit.as_ref().map_or(String::new(), |unit| format!(" {unit}"));
            let share = to_digits(100.0 * (x[k] - wanted[k]).abs() / range[k], 3);
            let (name, x, wanted) = (&s.states[k].name, to_digits(x[k], DIGITS), to_digits(wanted[k], DIGITS));
            format!("{name} = {x}{unit} instead of {wanted} ({share} % of its range)")
        };
        told.map(words).collect()
    }
}

impl NoPlan {
    /// The mistake, with its places in the text that the start was read from.
    pub fn diagnostic(&self, network: &Network, start: &Start) -> Diagnostic {
        let error = Diagnostic::error(code::NO_START_PLAN, "no start-up plan leads from `x0` into the design");
        let error = match self {
            Self::NoneFound { nearest: Some(nearest), failed: None } => explained(error, network, start, nearest),
            other => labelled(error, network, start, |_| String::new()).note(other.to_string()),
        };
        if network.start_anywhere {
            return error.help("start nearer, or leave the references more room: a smaller epsilon, reserve or cover");
        }
        error.help("`start-anywhere = true` keeps every row in the on-line problems, so that plans may go beyond the references of (25b)")
    }
}

fn explained(error: Diagnostic, network: &Network, start: &Start, nearest: &Nearest) -> Diagnostic {
    let error = labelled(error, network, start, |i| nearest.moves(&network.subsystems[i], i, start).join("; "));
    let distance = to_digits(100.0 * nearest.distance(start), 3);
    let bound = to_digits(100.0 * nearest.bound, 3);
    let mut error = error.note(format!(
        "the nearest start with a plan moves no state by more than {distance} % of its range; by the dual solution, as accurate as the solver, {bound} % is the least, for windows of up to {LONGEST} steps"
    ));
    if !nearest.rows.is_empty() {
        error = error.note(format!("what stops nearer starts: {}", nearest.rows.join(", ")));
    }
    error
}

/// A label per stated start, or one at the first subsystem where none is stated.
fn labelled(mut error: Diagnostic, network: &Network, start: &Start, words: impl Fn(usize) -> String) -> Diagnostic {
    let mut unplaced = Vec::new();
    for (i, s) in network.subsystems.iter().enumerate() {
        let said = words(i);
        match &start.places[i] {
            Some(place) if said.is_empty() => error = error.at(place.clone(), "this start"),
            Some(place) => error = error.at(place.clone(), format!("nearest with a plan: {said}")),
            None if said.is_empty() => {}
            None => unplaced.push(format!("`{}`: nearest with a plan: {said}", s.name)),
        }
    }
    unplaced.into_iter().fold(error, Diagnostic::note)
}

impl fmt::Display for NoPlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::WrongShape { subsystem } => {
                write!(f, "the start does not fit the states and loads of subsystem {subsystem}")
            }
            Self::Outside { subsystem } => {
                write!(f, "the start of subsystem {subsystem} lies outside of X or of the loads' bounds")
            }
            Self::Changing => f.write_str("start-up plans know nothing of the rows of changing constraints"),
            Self::NoneFound { nearest: Some(nearest), .. } => {
                write!(
                    f,
                    "no plan of up to {LONGEST} steps; the nearest start with one is {:?}, stopped by {}",
                    nearest.x0,
                    nearest.rows.join(", ")
                )
            }
            Self::NoneFound { nearest: None, failed: Some(why) } => write!(f, "no plan was found: {why}"),
            Self::NoneFound { nearest: None, failed: None } => write!(f, "no plan of up to {LONGEST} steps"),
        }
    }
}

impl std::error::Error for NoPlan {}
