//! Designs and emits what `instructions` counts beside the four-tank.

fn main() {
    dpc_codegen::Build::new("../examples/power_network/system.toml").compile();
    dpc_codegen::Build::new("online/plants/size_4_2_10.toml").compile();
}
