//! Runs what `dpc-codegen` emits.
#![no_std]
#![forbid(unsafe_code)]

pub mod tables;
