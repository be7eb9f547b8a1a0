//! Designs and emits the controllers of `system.toml`, of the same plant with what it leaves out stated, and of its start
//! away from rest.

fn main() {
    dpc_codegen::Build::new("system.toml").compile();
    dpc_codegen::Build::new("designs/disturbed.toml").compile();
    dpc_codegen::Build::new("designs/started.toml").compile();
}
