//! Designs and emits the controllers of `system.toml`, of the same plant with what it leaves out stated, and of its start
//! away from rest.

fn main() {
    dpc_codegen::build::compile("system.toml");
    dpc_codegen::build::compile("designs/disturbed.toml");
    dpc_codegen::build::compile("designs/started.toml");
}
