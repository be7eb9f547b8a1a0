//! Designs and emits the controllers of `system.toml`, and of the same network for unknown loads and for the exact plant.

fn main() {
    dpc_codegen::Build::new("system.toml").compile();
    dpc_codegen::Build::new("designs/unknown.toml").compile();
    dpc_codegen::Build::new("designs/exact.toml").compile();
    dpc_codegen::Build::new("designs/exact_unknown.toml").compile();
}
