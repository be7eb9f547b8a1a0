//! Unicycle robots of Section V that avoid each other: emitted controllers for three of them, the same controllers from tables
//! made at run time for any number, and simulated e-pucks that they drive.

pub mod arena;
pub mod campaign;
pub mod class;
pub mod command;
pub mod declared;
pub mod emitted;
pub mod epuck;
pub mod fleet;
pub mod floor;
pub mod following;
pub mod pace;
pub mod page;
pub mod robot;
pub mod rule;
pub mod run;
pub mod scenario;
pub mod tables;
pub mod track;

/// What the compiler emitted for `system.toml` when this package was built.
pub mod controllers {
    dpc_runtime::include_controllers!("robots");
}

/// The design of `system.toml` as the compiler states it for other tools.
pub const DESIGN_JSON: &str = include_str!(concat!(env!("OUT_DIR"), "/robots/design.json"));
