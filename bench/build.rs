//! Designs and emits what `instructions` counts beside the four-tank.

fn main() {
    dpc_codegen::build::compile("../examples/power_network/system.toml");
    dpc_codegen::build::compile("online/plants/size_4_2_10.toml");
}
