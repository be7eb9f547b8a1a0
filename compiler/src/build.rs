//! For build scripts: the compiler in one line.
//!
//! In `Cargo.toml`:
//!
//! ```toml
//! [dependencies]
//! dpc-runtime = "0.1"
//!
//! [build-dependencies]
//! dpc-codegen = { version = "0.1", default-features = false }
//!
//! [profile.dev.build-override] # and [profile.release.build-override]: designs are 25 times faster
//! opt-level = 3
//! ```
//!
//! In `build.rs`:
//!
//! ```no_run
//! fn main() {
//!     dpc_codegen::build::compile("system.toml");
//! }
//! ```
//!
//! In the crate, for a network whose `name` is `four-tank`:
//!
//! ```ignore
//! pub mod controllers {
//!     include!(concat!(env!("OUT_DIR"), "/four_tank/mod.rs"));
//! }
//! ```
//!
//! The bytes are those that `dpc-codegen system.toml` writes under `generated/four_tank/`. The firmware of one node
//! may as well include the file of its subsystem alone.

use std::path::{Path, PathBuf};

use crate::design::Design;
use crate::diagnostic::Source;
use crate::emit::{Emitted, package_folder};

/// Designs the network of `file` (relative to the package) and writes its controllers to
/// `$OUT_DIR/<name of the network>/`. Cargo runs the script again when the file changes.
///
/// Where the file has mistakes, prints them to the standard error stream, as the command does, and ends the build
/// script with exit code 1.
pub fn compile(file: impl AsRef<Path>) {
    let file = file.as_ref();
    println!("cargo::rerun-if-changed={}", file.display());
    if let Err(message) = try_compile(file) {
        eprintln!("{message}");
        std::process::exit(1);
    }
}

fn try_compile(file: &Path) -> Result<(), String> {
    let out =
        std::env::var_os("OUT_DIR").ok_or("dpc_codegen::build::compile is for build scripts: OUT_DIR is not set")?;
    let source = read(file)?;
    let design = Design::new(source.clone()).map_err(|mistakes| mistakes.render(&source, false))?;
    let folder = PathBuf::from(out).join(package_folder(&design.network));
    Emitted::new(&design).write(&folder).map_err(|error| error.to_string())?;
    Ok(())
}

/// The text of `file`.
///
/// # Errors
/// A sentence for the user, where it cannot be read.
pub fn read(file: &Path) -> Result<Source, String> {
    match std::fs::read_to_string(file) {
        Ok(text) => Ok(Source { path: file.display().to_string(), text }),
        Err(error) => Err(format!("error: cannot read {}: {error}", file.display())),
    }
}
