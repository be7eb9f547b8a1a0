//! Closed loops of emitted controllers, in the same words for a board without an operating system and for the host.
//!
//! | file | holds |
//! |---|---|
//! | `emitted` | what the compiler has made of the examples |
//! | `closed_loop` | controllers and the plant that their models make together |
//! | `networks` | the loops that are run |
//! | `process` | one controller with its inbox, and its part of the plant |
//! | `upset` | how far a state may be off its reference |
//! | `random` | numbers from a seed |
//! | `scalar` | what both types of number are asked for |
//! | `tally` | what came of a run |
//! | `fingerprint` | a hash of all its bits |
//! | `text` | lines without `core::fmt`, whose code can panic |
#![no_std]
#![forbid(unsafe_code)]

mod closed_loop;
mod emitted;
mod fingerprint;
mod networks;
mod process;
mod random;
mod scalar;
mod tally;
mod text;
mod upset;

pub use networks::run_all;
pub use tally::{Tally, Ticks};
pub use text::Line;

/// Where a program runs: what it prints to, and its clock.
pub trait Board {
    /// One line.
    fn print(&mut self, line: &Line);

    /// Time, in units of the board's own; always 0 where there is no clock.
    fn ticks(&mut self) -> Ticks;

    /// Time since then, if it is not too long ago for the clock.
    fn since(&mut self, before: Ticks) -> Ticks;

    /// What the processor does in one such unit.
    fn instructions_per_tick(&self) -> u64;
}
