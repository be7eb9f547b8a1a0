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
    /// Bytes came from a controller of another design: the neighbour, or this node, was not updated.
    OtherDesign,
    /// Bytes came that are no message of this neighbour: of another layout, scalar type, length or sender.
    Unreadable,
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
    /// Bytes of another layout: the sender has another version of the runtime.
    OtherLayout {
        expected: u8,
        got: u8,
    },
    /// Bytes of a controller that computes in another scalar type; in bytes per number.
    OtherScalar {
        expected: u8,
        got: u8,
    },
    /// Bytes of a controller of another design; the numbers are [`Sender::design`](crate::Sender::design).
    OtherDesign {
        expected: u64,
        got: u64,
    },
    /// Bytes of another subsystem than the link's, by their places in the network.
    OtherSender {
        expected: u32,
        got: u32,
    },
    /// Bytes of a subsystem, by its place in the network, that this one does not hear.
    NotHeard {
        sender: u32,
    },
    /// So many bytes are not the neighbour's message.
    Length {
        expected: usize,
        got: usize,
    },
    /// Bytes with sizes or flags that no sender writes.
    Malformed,
}

impl Refused {
    /// What the status says of a message that is refused so.
    pub(crate) fn delivery(&self) -> Delivery {
        match self {
            Self::OutOfSequence { got, .. } => Delivery::OutOfSequence(*got),
            Self::NotFinite => Delivery::NotFinite,
            Self::OtherDesign { .. } => Delivery::OtherDesign,
            Self::NoSuchSlot
            | Self::OtherLayout { .. }
            | Self::OtherScalar { .. }
            | Self::OtherSender { .. }
            | Self::NotHeard { .. }
            | Self::Length { .. }
            | Self::Malformed => Delivery::Unreadable,
        }
    }
}

impl fmt::Display for Delivery {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::InSequence => f.write_str("in sequence"),
            Self::Missing => f.write_str("missing"),
            Self::OutOfSequence(step) => write!(f, "out of sequence (of step {step})"),
            Self::NotFinite => f.write_str("not finite"),
            Self::OtherDesign => f.write_str("of another design"),
            Self::Unreadable => f.write_str("unreadable"),
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
            Self::OtherLayout { expected, got } => write!(f, "message in layout {got}, expected {expected}"),
            Self::OtherScalar { expected, got } => {
                write!(f, "message with numbers of {got} bytes, expected {expected}")
            }
            Self::OtherDesign { expected, got } => {
                write!(f, "message of design {got:016x}, this controller is of design {expected:016x}")
            }
            Self::OtherSender { expected, got } => write!(f, "message of subsystem {got}, expected {expected}"),
            Self::NotHeard { sender } => write!(f, "message of subsystem {sender}, which this one does not hear"),
            Self::Length { expected, got } => write!(f, "message of {got} bytes, expected {expected}"),
            Self::Malformed => f.write_str("message with sizes or flags that no sender writes"),
        }
    }
}

impl core::error::Error for Refused {}
