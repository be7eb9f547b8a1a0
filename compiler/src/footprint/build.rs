//! The package of a subsystem, and cargo.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

use super::cargo::Cargo;
use super::target::Target;
use crate::design::Design;
use crate::emit::{Emitted, PROFILE, entries, runtime, write_all};

/// Each function tells its stack.
const FLAGS: &str = "-Z emit-stack-sizes -C no-redzone";

const PANIC: &str = "#[panic_handler]\nfn panic(_: &core::panic::PanicInfo<'_>) -> ! {\n    loop {}\n}\n";

/// The root of a crate around the emitted `file` of subsystem `i`, a path: entries with C's calling convention and plain names.
/// A program with a standard library may have it as a dependency; a static library needs a panic handler besides.
pub fn source(design: &Design, i: usize, file: &Path) -> String {
    entries::library(design, i, &file.display().to_string())
}

/// Where packages are written and built. Folders are made where they are missing, and stay.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Workshop {
    /// Of the packages.
    pub packages: PathBuf,
    /// Of what cargo makes of them. Those who use one folder must do so one after the other.
    pub out: PathBuf,
}

impl Workshop {
    pub fn new(packages: PathBuf) -> Self {
        let out = packages.join("target");
        Self { packages, out }
    }
}

/// The static libraries of the subsystems, in their order.
pub fn libraries(
    design: &Design,
    emitted: &Emitted,
    target: &Target,
    workshop: &Workshop,
) -> Result<Vec<PathBuf>, String> {
    let Workshop { packages, out } = workshop;
    let names: Vec<String> = emitted.files.iter().skip(1).map(|(_, text)| name(packages, text)).collect();
    let files = workspace(design, emitted, &names);
    let files: Vec<_> = files.iter().map(|(name, text)| (packages.join(name), text.as_str())).collect();
    write_all(&files).map_err(|error| format!("error: {error}"))?;
    Cargo { target, flags: FLAGS, lto: "off", out, purpose: "`--measure`" }.run(packages, &["build"])?;
    let out = target.triple.as_ref().map_or(out.clone(), |triple| out.join(triple)).join("release");
    Ok(names.iter().map(|name| out.join(format!("lib{name}.a"))).collect())
}

/// Of a package, and like no other's: cargo does not bring back a library that another package of the same name has replaced.
fn name(packages: &Path, text: &str) -> String {
    let mut hasher = DefaultHasher::new();
    (packages, text).hash(&mut hasher);
    format!("node_{:016x}", hasher.finish())
}

/// Names and texts of the files of a workspace with a package per subsystem.
fn workspace(design: &Design, emitted: &Emitted, names: &[String]) -> Vec<(String, String)> {
    let members: Vec<String> = (0..names.len()).map(|i| format!("\"node_{i}\"")).collect();
    let root = format!("[workspace]\nresolver = \"3\"\nmembers = [{}]\n\n{PROFILE}", members.join(", "));
    let mut files = vec![("Cargo.toml".to_owned(), root)];
    for (i, ((_, text), name)) in emitted.files.iter().skip(1).zip(names).enumerate() {
        let manifest = format!(
            "[package]\nname = \"{name}\"\nversion = \"0.0.0\"\nedition = \"2024\"\n\n\
             [lib]\ncrate-type = [\"staticlib\"]\n\n[dependencies]\n{}",
            runtime()
        );
        files.push((format!("node_{i}/Cargo.toml"), manifest));
        files.push((format!("node_{i}/src/lib.rs"), source(design, i, Path::new("controller.rs")) + PANIC));
        files.push((format!("node_{i}/src/controller.rs"), text.clone()));
    }
    files
}
