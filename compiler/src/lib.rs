//! Compiler for distributed predictive control (Farina, Betti, Giulioni, Scattolini).
//!
//! `text -> Spec -> Network -> Gains -> Sets -> Sizing -> Problems -> Emitted`: see [`design::Design`].

pub mod build;
pub mod convex;
pub mod design;
pub mod diagnostic;
pub mod emit;
pub mod export;
pub mod gains;
pub mod network;
pub mod optim;
pub mod problems;
pub mod sets;
pub mod sizing;
pub mod spec;
pub mod summary;
