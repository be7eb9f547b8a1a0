//! What becomes of messages.

use core::fmt;

/// What has become of a neighbour's message of the expected step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Delivery {
    /// It arrived in time.
    InSequence,
    /// Nothing arrived.
    #[default]
    Missing,
    /// Only a message of this other step arrived: late, repeated, or from a neighbour that was started anew.
    OutOfSequence(i64),
    /// It held a number that is not finite.
    NotFinite,
}

/// Why the inbox did not take a message. The step that needed it will say so in its status.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refused {
    /// It is neither of the step expected next nor of the one after.
    OutOfSequence {
        expected: i64,
        got: i64,
    },
    NotFinite,
    /// The link points outside the inbox: it belongs to another subsystem.
    NoSuchSlot,
}

impl fmt::Display for Delivery {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::InSequence => f.write_str("in sequence"),
            Self::Missing => f.write_str("missing"),
            Self::OutOfSequence(step) => write!(f, "out of sequence (of step {step})"),
            Self::NotFinite => f.write_str("not finite"),
        }
    }
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutOfSequence { expected, got } => {
                write!(f, "message of step {got}, expected that of step {expected}")
            }
            Self::NotFinite => f.write_str("message holds a number that is not finite"),
            Self::NoSuchSlot => f.write_str("link points outside the inbox"),
        }
    }
}

impl core::error::Error for Refused {}
