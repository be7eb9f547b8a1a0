//! Designs and emits the problems, and compiles the peers that `peers/fetch` has brought.

use std::path::{Path, PathBuf};

/// The five sizes, and every example.
const FILES: [&str; 8] = [
    "plants/size_2_1_3.toml",
    "plants/size_4_2_10.toml",
    "plants/size_4_2_20.toml",
    "plants/size_6_3_15.toml",
    "plants/size_10_4_30.toml",
    "../../examples/four_tank/system.toml",
    "../../examples/power_network/system.toml",
    "../../examples/mass_chain/system.toml",
];

fn main() {
    FILES.iter().for_each(|file| dpc_codegen::Build::new(file).compile());
    println!("cargo::rerun-if-changed=peers");
    peer("daqp", "daqp/csrc/src", &["daqp/csrc/include"], "peers/daqp_shim.c");
    peer("quadprog", "quadprog/quadprog", &[], "peers/quadprog_shim.c");
}

/// Compiles the C files of a folder and the shim in front of them as their authors would, and tells the program that the
/// peer is there.
fn peer(name: &str, folder: &str, includes: &[&str], shim: &str) {
    println!("cargo::rustc-check-cfg=cfg({name})");
    let folder = Path::new("peers").join(folder);
    let Ok(entries) = std::fs::read_dir(&folder) else {
        println!("cargo::warning={name} is not there: `bench/online/peers/fetch` brings it");
        return;
    };
    let mut files: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    files.retain(|file| file.extension().is_some_and(|end| end == "c"));
    files.sort();
    let mut build = cc::Build::new();
    build.files(files).file(shim).opt_level(3).warnings(false);
    includes.iter().for_each(|include| {
        build.include(Path::new("peers").join(include));
    });
    build.compile(&format!("peer_{name}"));
    println!("cargo::rustc-cfg={name}");
}
