//! What `dpc-codegen` writes for the examples; `cargo run --release -p dpc-codegen -- examples/four_tank/system.toml` makes it
//! again. The test `freshness` compares it with what the compiler writes now.
#![no_std]
#![forbid(unsafe_code)]

#[rustfmt::skip]
pub mod four_tank;
/// The same in single precision: `--scalar f32`.
#[rustfmt::skip]
pub mod four_tank_single;
