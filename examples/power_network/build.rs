//! Designs and emits the controllers of `system.toml`, and of the same network for unknown loads and for the exact plant.

fn main() {
    dpc_codegen::build::compile("system.toml");
    dpc_codegen::build::compile("designs/unknown.toml");
    dpc_codegen::build::compile("designs/exact.toml");
    dpc_codegen::build::compile("designs/exact_unknown.toml");
}
