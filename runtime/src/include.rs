//! The one line that brings emitted controllers into a crate.

/// Includes the controllers that `dpc_codegen::Build` wrote for a network: a module per subsystem, and `network`, all of them
/// together with the plant. The argument is the network's `name` as a Rust identifier: `"four_tank"` for `name = "four-tank"`.
///
/// ```ignore
/// pub mod controllers {
///     dpc_runtime::include_controllers!("four_tank");
/// }
/// ```
///
/// Where `system.toml` has mistakes, they are the compiler's errors, with line and column in that file.
#[macro_export]
macro_rules! include_controllers {
    ($network:literal) => {
        ::core::include!(::core::concat!(::core::env!("OUT_DIR"), "/", $network, "/mod.rs"));
    };
}
