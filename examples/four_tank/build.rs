//! Designs and emits the controllers of `system.toml`, and of the same plant with what it leaves out stated.

fn main() {
    dpc_codegen::build::compile("system.toml");
    dpc_codegen::build::compile("designs/disturbed.toml");
}
