//! Designs and emits the controllers of `system.toml`.

fn main() {
    dpc_codegen::build::compile("system.toml");
}
