//! What the compiler has made of the plants.

pub mod size_2_1_3 {
    include!(concat!(env!("OUT_DIR"), "/size_2_1_3/mod.rs"));
}
pub mod size_4_2_10 {
    include!(concat!(env!("OUT_DIR"), "/size_4_2_10/mod.rs"));
}
pub mod size_4_2_20 {
    include!(concat!(env!("OUT_DIR"), "/size_4_2_20/mod.rs"));
}
pub mod size_6_3_15 {
    include!(concat!(env!("OUT_DIR"), "/size_6_3_15/mod.rs"));
}
pub mod size_10_4_30 {
    include!(concat!(env!("OUT_DIR"), "/size_10_4_30/mod.rs"));
}
pub mod four_tank {
    include!(concat!(env!("OUT_DIR"), "/four_tank/mod.rs"));
}
pub mod power_network {
    include!(concat!(env!("OUT_DIR"), "/power_network/mod.rs"));
}
pub mod mass_chain {
    include!(concat!(env!("OUT_DIR"), "/mass_chain/mod.rs"));
}
