//! Designs and emits the controllers; `system.toml` says for what.

fn main() {
    dpc_codegen::build::compile("system.toml");
}
