//! Designs and emits the controllers of `system.toml`: three robots.

fn main() {
    dpc_codegen::Build::new("system.toml").compile();
}
