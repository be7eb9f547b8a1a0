//! The four-tank of Section VI of the paper, in closed loop with the controllers that were emitted for it.

pub use example_kit::{bus, checks, plot, random, sets, table};

pub mod closed_loop;
pub mod disturbed;
pub mod figure;
pub mod inflow;
pub mod node;
pub mod nuisance;
pub mod plant;
pub mod report;
pub mod runs;
pub mod scenario;
pub mod trajectory;
pub mod upset;

/// What the compiler emitted for `system.toml` when this package was built.
pub mod controllers {
    dpc_runtime::include_controllers!("four_tank");
}

/// What it emitted for `designs/disturbed.toml`.
pub mod disturbed_controllers {
    dpc_runtime::include_controllers!("four_tank_disturbed");
}

/// What it emitted for `designs/started.toml`.
pub mod started_controllers {
    dpc_runtime::include_controllers!("four_tank_started");
}

/// The summary of the design, as the compiler's command prints it.
pub const SUMMARY: &str = include_str!(concat!(env!("OUT_DIR"), "/four_tank/summary.txt"));

/// The design as the compiler states it for other tools.
pub const DESIGN_JSON: &str = include_str!(concat!(env!("OUT_DIR"), "/four_tank/design.json"));

/// The same of `designs/disturbed.toml`.
pub const DISTURBED_DESIGN_JSON: &str = include_str!(concat!(env!("OUT_DIR"), "/four_tank_disturbed/design.json"));

/// The same of `designs/started.toml`.
pub const STARTED_DESIGN_JSON: &str = include_str!(concat!(env!("OUT_DIR"), "/four_tank_started/design.json"));
