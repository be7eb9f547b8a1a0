// Controllers of network `four-tank`.
//
// Written by dpc-codegen 0.1.0 from system.toml; do not edit. To make it again:
//
//     dpc-codegen system.toml --out four_tank_single --scalar f32
//
// Fits dpc-runtime 0.1. Numbers are in the units of system.toml, as deviations from its operating point.
//
// One step every 0.5 s. Who hears whom:
//
//     left: hears right (0.0206 h4 + 0.000247 v2)
//     right: hears left (0.0165 h2 + 0.00013 v1)

/// Subsystem `left`: states `h1 [cm]`, `h2 [cm]`, inputs `v1 [V]`, outputs `h1 [cm]`.
#[rustfmt::skip]
#[allow(unused, reason = "a node uses the part that it needs")]
#[allow(clippy::approx_constant, reason = "a number of the design may lie near a famous one")]
pub mod left;

/// Subsystem `right`: states `h3 [cm]`, `h4 [cm]`, inputs `v2 [V]`, outputs `h3 [cm]`.
#[rustfmt::skip]
#[allow(unused, reason = "a node uses the part that it needs")]
#[allow(clippy::approx_constant, reason = "a number of the design may lie near a famous one")]
pub mod right;
