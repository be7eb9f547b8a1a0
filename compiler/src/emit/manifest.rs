//! What `Cargo.toml` of a package around emitted files says.

use std::path::Path;

/// As firmware is built: no unwinding, and one unit of code per crate, so that its size does not depend on how many there are.
/// Link-time optimisation is off, since it leaves no code in a static library; it may only make code smaller.
pub const PROFILE: &str =
    "[profile.release]\nopt-level = 3\npanic = \"abort\"\ncodegen-units = 1\nlto = \"off\"\ndebug = false\n";

/// A dependency: the runtime that this compiler was built with, where its sources still are, else any that fits.
pub fn runtime() -> String {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../runtime"));
    match folder.join("Cargo.toml").is_file() {
        true => format!("dpc-runtime = {{ path = {folder:?} }}\n"),
        false => format!("dpc-runtime = \"{}\"\n", env!("CARGO_PKG_VERSION")),
    }
}
