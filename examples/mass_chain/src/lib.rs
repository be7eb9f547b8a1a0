//! Masses in a row between two walls, one force and one controller on each: emitted controllers for ten masses, and the same
//! controllers from tables that are made at run time for any number of them.

pub mod chain;
pub mod closed_loop;
pub mod emitted;
pub mod figure;
pub mod node;
pub mod pattern;
pub mod report;
pub mod stiff;
pub mod tables;

/// What the compiler emitted for `system.toml` when this package was built.
pub mod controllers {
    dpc_runtime::include_controllers!("mass_chain");
}

/// The design of `system.toml` as the compiler states it for other tools.
pub const DESIGN_JSON: &str = include_str!(concat!(env!("OUT_DIR"), "/mass_chain/design.json"));
