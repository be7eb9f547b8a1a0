//! What `dpc-codegen` writes for the examples. Each module is a folder that the command in its files' headers makes
//! again; the test `freshness` compares them with what the compiler writes now.
#![no_std]
#![forbid(unsafe_code)]

#[rustfmt::skip]
pub mod four_tank;
