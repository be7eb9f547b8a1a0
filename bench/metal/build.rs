//! Where the firmware lies in the board's memory.

fn main() {
    let folder = std::env::var("CARGO_MANIFEST_DIR").expect("cargo says where the package is");
    println!("cargo::rustc-link-arg-bin=firmware=-T{folder}/board.ld");
    println!("cargo::rerun-if-changed=board.ld");
}
