//! Load-frequency control of four areas with emitted controllers: loads measured and unknown, on the model and on the exact plant.

pub mod areas;
pub mod closed_loop;
pub mod figure;
pub mod files;
pub mod model;
pub mod node;
pub mod report;
pub mod runs;
pub mod scenario;
pub mod shares;

/// What the compiler emitted for `system.toml` when this package was built.
pub mod measured {
    dpc_runtime::include_controllers!("power_network");
}

/// The same of `designs/unknown.toml`.
pub mod unknown {
    dpc_runtime::include_controllers!("power_network_unknown");
}

/// The same of `designs/exact.toml`.
pub mod exact {
    dpc_runtime::include_controllers!("power_network_exact");
}

/// The same of `designs/exact_unknown.toml`.
pub mod exact_unknown {
    dpc_runtime::include_controllers!("power_network_exact_unknown");
}
