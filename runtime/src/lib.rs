//! Runs what `dpc-codegen` emits.
#![no_std]
#![forbid(unsafe_code)]

mod factor;
pub mod linear;
pub mod solver;
pub mod tables;
