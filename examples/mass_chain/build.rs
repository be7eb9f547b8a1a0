//! Designs and emits the controllers of `system.toml`: ten masses.

fn main() {
    dpc_codegen::Build::new("system.toml").compile();
}
