//! Closed loops without writing any Rust: the true plant, stepped here, under the emitted controllers.
//!
//! ```text
//! Design, scenario.toml -> Scenario    what acts and what is asked, drawn out for every step
//! Design, Emitted       -> Shared      the emitted controllers, compiled and loaded
//! run(Design, Scenario, Controllers) -> History -> Findings, tables, pictures
//! ```
//!
//! The controllers are the emitted ones, bit by bit: their crate with the C interface is compiled as a shared library, kept in a
//! cache, and talks in the bytes that cross the wire. The plant is the linear model (5a) of the whole network, or of another file, with
//! disturbances w, measurement errors v and measured loads d.
//!
//! # What a violation means
//! Theorem 1 promises that no constraint is violated while every subsystem says that the guarantee holds. [`Findings::broken`] lists
//! what contradicts that. Violations at other steps, after an upset or a lost message, are the scenario's.

mod columns;
mod controllers;
mod files;
mod findings;
mod glue;
mod history;
mod library;
mod pictures;
mod plant;
mod random;
mod recorder;
mod run;
mod scenario;
mod separation;
mod settling;
mod shared;
mod summary;
mod words;

pub use controllers::{Answer, Controller, Controllers, Given, HalfSpace, Sent, Started};
pub use files::Format;
pub use findings::{Broken, Findings, Least, NodeFindings, Spell};
pub use history::{Column, CouplingTrack, Event, EventKind, History, Margin, Status, Track};
pub use library::Library;
pub use pictures::picture;
pub use plant::Plant;
pub use run::run;
pub use scenario::{Acting, Fate, Fates, Jump, Rule, Scenario, Start, Upset, is_planned};
pub use settling::Settling;
pub use shared::Shared;
pub use summary::Report;
pub use words::Words;
