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
//! In `main` of `build.rs`:
//!
//! ```no_run
//! dpc_codegen::build::compile("system.toml");
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
//! Beside `mod.rs` lie `summary.txt`, what the command prints of the design, and `design.json`. The Rust bytes are
//! those that `dpc-codegen system.toml` writes under `generated/four_tank/`. The firmware of one node
//! may as well include the file of its subsystem alone.

use std::path::{Path, PathBuf};

use crate::design::Design;
use crate::diagnostic::Source;
use crate::emit::{Emitted, package_folder, write_all};
use crate::export::design_json;
use crate::spec::Spec;
use crate::summary::Summary;

/// Designs the network of `file` (relative to the package) and writes its controllers to
/// `$OUT_DIR/<name of the network>/`. Cargo runs the script again when the file changes, or one that it takes matrices
/// from.
///
/// Where the file has mistakes, prints them to the standard error stream, as the command does, and ends the build
/// script with exit code 1.
pub fn compile(file: impl AsRef<Path>) {
    let file = file.as_ref();
    println!("cargo::rerun-if-changed={}", file.display());
    for imported in read(file).map(|source| Spec::files(&source)).unwrap_or_default() {
        println!("cargo::rerun-if-changed={}", imported.display());
    }
    let out = std::env::var_os("OUT_DIR").ok_or("error: only cargo can run a build script: OUT_DIR is not set");
    if let Err(message) = out.map_err(str::to_owned).and_then(|out| compile_into(file, Path::new(&out))) {
        eprintln!("{message}");
        std::process::exit(1);
    }
}

/// Designs the network of `file` and writes its controllers to `<out>/<name of the network>/`, which is returned; with
/// them `summary.txt`, what the command prints of the design, and `design.json`.
///
/// # Errors
/// The mistakes in the file, or what the file system reports, as text for the user; then nothing is written.
pub fn compile_into(file: &Path, out: &Path) -> Result<PathBuf, String> {
    let source = read(file)?;
    let design = Design::new(source.clone()).map_err(|mistakes| mistakes.render(&source, false))?;
    let folder = out.join(package_folder(&design.network));
    let emitted = Emitted::new(&design);
    let (summary, json) = (Summary::new(&design, &emitted).to_string(), design_json(&design));
    let mut files = emitted.paths(&folder);
    files.extend([(folder.join("summary.txt"), &*summary), (folder.join("design.json"), &*json)]);
    write_all(&files).map_err(|error| format!("error: {error}"))?;
    Ok(folder)
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
