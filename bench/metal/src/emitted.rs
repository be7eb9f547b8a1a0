//! What the compiler has made of the examples, in the folder that `METAL_EMITTED` names.

pub mod four_tank {
    include!(concat!(env!("METAL_EMITTED", "see .ci/metal"), "/four_tank/mod.rs"));
}

pub mod four_tank_single {
    include!(concat!(env!("METAL_EMITTED", "see .ci/metal"), "/four_tank_single/mod.rs"));
}

pub mod mass_chain {
    include!(concat!(env!("METAL_EMITTED", "see .ci/metal"), "/mass_chain/mod.rs"));
}
