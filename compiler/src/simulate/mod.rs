//! Closed loops without writing any Rust: the true plant, stepped here, under the emitted controllers.

mod history;

pub use history::{Column, CouplingTrack, Event, EventKind, History, Margin, Status, Track};
