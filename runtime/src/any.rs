// The runtime in one scalar type: compiled once per module that says which (`double`, `single`). A module instead of a type
// parameter: literals stay literals, no signature carries bounds, and thresholds are constants of their precision.

use super::{Real, precision};

/// By how much of a limit a start may exceed it and still be taken to be inside.
pub const KEPT: Real = precision::KEPT;

mod changing;
mod controller;
mod factor;
mod linear;
mod load;
mod message;
mod plan;
pub mod problem;
pub mod reference;
pub mod solver;
mod start;
pub mod tables;
mod trajectory;
mod wire;

pub use changing::{HalfSpace, Meeting, NotRedrawn, Pair};
pub use controller::{Controller, Input, Outlook, Step, Telemetry};
pub use load::{Load, Loads};
pub use message::{Inbox, Message};
pub use plan::{PlannedPoint, StartPlan};
pub use reference::{ReferenceLayer, Share};
pub use start::SteadyState;
pub use tables::{Link, Tables};
