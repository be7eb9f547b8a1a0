//! What the compiler has made of the plants.

pub mod size_2_1_3 {
    dpc_runtime::include_controllers!("size_2_1_3");
}
pub mod size_4_2_10 {
    dpc_runtime::include_controllers!("size_4_2_10");
}
pub mod size_4_2_20 {
    dpc_runtime::include_controllers!("size_4_2_20");
}
pub mod size_6_3_15 {
    dpc_runtime::include_controllers!("size_6_3_15");
}
pub mod size_10_4_30 {
    dpc_runtime::include_controllers!("size_10_4_30");
}
pub mod four_tank {
    dpc_runtime::include_controllers!("four_tank");
}
pub mod power_network {
    dpc_runtime::include_controllers!("power_network");
}
pub mod mass_chain {
    dpc_runtime::include_controllers!("mass_chain");
}
