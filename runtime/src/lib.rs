//! Runs what `dpc-codegen` emits.
#![no_std]
#![forbid(unsafe_code)]

mod controller;
mod factor;
pub mod linear;
mod message;
pub mod problem;
pub mod reference;
pub mod solver;
mod start;
mod status;
pub mod tables;
mod trajectory;
mod version;

pub use controller::{Controller, Input, Outlook, Step, Telemetry};
pub use message::{Delivery, Inbox, Message, Refused};
pub use reference::ReferenceLayer;
pub use start::{StartError, SteadyState};
pub use status::{Control, References, Status};
pub use tables::{Link, Tables};
pub use version::fits;
