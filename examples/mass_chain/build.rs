//! Designs and emits the controllers of `system.toml`: ten masses.

fn main() {
    dpc_codegen::build::compile("system.toml");
}
