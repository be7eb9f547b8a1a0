//! Closed loops without writing any Rust: the true plant, stepped here, under the emitted controllers.
//!
//! ```text
//! Design, scenario.toml -> Scenario    what acts and what is asked, drawn out for every step
//! Design, Emitted       -> Shared      the emitted controllers, compiled and loaded
//! run(Design, Scenario, Controllers) -> History -> Findings, tables, pictures
//! ```
//!
//! The controllers are the emitted ones, bit by bit: their package for C ([`crate::emit::c`]) is compiled as a shared library, kept in
//! a cache, and talks in the bytes that cross the wire. The plant is the linear model (5a) of the whole network, or of another file, with
//! disturbances w, measurement errors v and measured loads d.
//!
//! # The file of a scenario
//! Every key is optional; times are in s, numbers in the units of the network's file, as deviations from its operating point. A time
//! belongs to the first step at or after it.
//!
//! ```toml
//! name = "upsets"                  # of the folder that is written; default: the file's
//! duration = 120.0                 # or steps = 240; default: 500 steps
//! seed = 1                         # of all that is random; default 0
//! plant = "truth.toml"             # the true plant, where it is not the model: the file of a network of the same shape
//!
//! [subsystem.left]
//! start = { outputs = [0.5], deviation = [2.0, 0.1] }   # references rest at these outputs, the state is off that; default 0
//! # start = { x0 = [-6.0, 0.5], d0 = [0.0] }            # or anywhere, by a start-up plan of the whole network
//! disturbance = "random"           # uniform in W; or "worst-case", its corners; default "none"
//! # disturbance = { kind = "random", share = 0.5, add = { h2 = [{ at = 30.0, by = 0.1, for = 2.0 }] } }
//! measurement-error = "random"     # likewise
//!
//! [subsystem.left.set-point]       # by output; a course is one of
//! h1 = 1.0                         #   a constant
//! # h1 = [{ at = 10.0, to = 1.0 }, { at = 50.0, to = 2.0, over = 20.0 }]   # steps and ramps, 0 before the first
//! # h1 = "random"                  #   in Y, or for loads within bounds and rates; { kind = "random", every = 20.0 }
//! # h1 = { csv = "profile.csv", column = "h1" }   # a line per step
//!
//! [subsystem.left.loads]           # by load, likewise
//! q1 = 0.01
//!
//! [[upset]]                        # a state jumps; or to = [..]
//! at = 50.0
//! subsystem = "left"
//! by = [0.0, 2.0]
//!
//! [[lost]]                         # messages by the time they are sent, of one link or, without from or to, of all
//! from = "left"
//! to = "right"
//! at = [60.0, 61.5]                # or during = [60.0, 80.0], with a probability or without
//!
//! [[late]]
//! probability = 0.01
//! by = 2                           # periods
//!
//! [[rule]]                         # how constraints that change while running are drawn, where there are any
//! kind = "tangent"                 # two points in the plane pass each other; "apart": along the line of centres;
//! distance = 15.0                  # "beyond" with normal and bound: normal . y >= bound, for one subsystem
//! # constraint = "robots 1 and 2"  # default: all
//! ```
//!
//! # What a violation means
//! Theorem 1 promises that no constraint is violated while every subsystem says that the guarantee holds. [`Findings::broken`] lists
//! what contradicts that. Violations at other steps, after an upset or a lost message, are the scenario's.

mod columns;
mod controllers;
mod files;
mod findings;
mod history;
mod library;
mod pictures;
mod plant;
mod random;
mod reals;
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
