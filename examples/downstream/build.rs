//! Designs the controllers of `system.toml`, when it has changed.

fn main() {
    dpc_codegen::Build::new("system.toml").compile();
}
