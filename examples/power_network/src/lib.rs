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
    include!(concat!(env!("OUT_DIR"), "/power_network/mod.rs"));
}

/// The same of `designs/unknown.toml`.
pub mod unknown {
    include!(concat!(env!("OUT_DIR"), "/power_network_unknown/mod.rs"));
}

/// The same of `designs/exact.toml`.
pub mod exact {
    include!(concat!(env!("OUT_DIR"), "/power_network_exact/mod.rs"));
}

/// The same of `designs/exact_unknown.toml`.
pub mod exact_unknown {
    include!(concat!(env!("OUT_DIR"), "/power_network_exact_unknown/mod.rs"));
}
