//! What stands against a start.

use core::fmt;

/// Why a controller was not started. There is no plan for such a state, so none is guessed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StartError {
    /// A number of the start is not finite.
    NotFinite,
    /// The output C x does not lie in Y_i.
    OutputOutside,
    /// An input lies outside its limits.
    InputOutside {
        /// Which.
        input: usize,
    },
    /// No sum of errors eref gives this input at this state by (7f). Only possible with more inputs than outputs.
    InputOutOfReach,
    /// A measured load is not a number, or outside the bounds the design was made for.
    LoadOutside {
        /// Which.
        load: usize,
    },
    /// The start-up plan was made for other tables: another subsystem, or another design.
    OtherDesign,
    /// The start-up plan has fewer than N + 1 points.
    PlanTooShort,
    /// There are changing coupling constraints, whose rows no start-up plan knows.
    ChangingConstraints,
    /// The start-up plan has the number 0, which stands for no plan.
    NoPlan,
    /// The measured state does not fit the start-up plan: the first i-DPC problem has no solution.
    StateDoesNotFit {
        /// The row that could not be satisfied, an index into the emitted row names.
        row: usize,
    },
    /// The iteration budget did not suffice to find out whether the measured state fits the start-up plan, and the plan's own
    /// solution is none for this state.
    Undecided,
}

impl fmt::Display for StartError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite => f.write_str("the start is not finite"),
            Self::OutputOutside => f.write_str("the output to rest at lies outside Y"),
            Self::InputOutside { input } => write!(f, "input {input} to rest at lies outside its limits"),
            Self::LoadOutside { load } => write!(f, "load {load} lies outside its bounds"),
            Self::InputOutOfReach => f.write_str("the gain Ke reaches no reference with the steady state's input"),
            Self::OtherDesign => f.write_str("the start-up plan belongs to another subsystem or another design"),
            Self::ChangingConstraints => f.write_str("start-up plans know no changing coupling constraints"),
            Self::NoPlan => f.write_str("the start-up plan has no number"),
            Self::PlanTooShort => f.write_str("the start-up plan is shorter than the horizon"),
            Self::StateDoesNotFit { row } => {
                write!(f, "the measured state does not fit the start-up plan (row {row} of the first problem)")
            }
            Self::Undecided => {
                f.write_str("the iteration budget was used up before the measured state was seen to fit")
            }
        }
    }
}

impl core::error::Error for StartError {}
