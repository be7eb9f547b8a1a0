//! The package of a subsystem, and cargo.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::Command;

use super::target::Target;
use crate::dependency::{RUNTIME, dependency};
use crate::design::Design;
use crate::emit::{Emitted, entries, write_all};

/// In `Cargo.toml`. As firmware is built: no unwinding, and one unit of code per crate, so that the figures do not depend on how many there are.
/// Link-time optimisation is off, since it leaves no code in the library; it may only make code smaller.
pub const PROFILE: &str =
    "[profile.release]\nopt-level = 3\npanic = \"abort\"\ncodegen-units = 1\nlto = \"off\"\ndebug = false\n";

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
    run(target, packages, out)?;
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

/// A dependency in `Cargo.toml`: the runtime that this compiler was built with, where its sources still are, else any that fits.
pub fn runtime() -> String {
    dependency(RUNTIME, "")
}

fn run(target: &Target, folder: &Path, out: &Path) -> Result<(), String> {
    let cargo = std::env::var_os("CARGO").map_or_else(|| PathBuf::from("cargo"), PathBuf::from);
    let mut command = Command::new(&cargo);
    command.args(["build", "--release", "--quiet", "--manifest-path"]).arg(folder.join("Cargo.toml"));
    command.arg("--target-dir").arg(out).env("RUSTC", target.rustc()).env("RUSTC_BOOTSTRAP", "1");
    // What the header says of the profile must not be overridden.
    for (key, value) in
        [("OPT_LEVEL", "3"), ("LTO", "off"), ("CODEGEN_UNITS", "1"), ("PANIC", "abort"), ("DEBUG", "false")]
    {
        command.env(format!("CARGO_PROFILE_RELEASE_{key}"), value);
    }
    let cpu = target.cpu.as_ref().map(|cpu| format!(" -C target-cpu={cpu}")).unwrap_or_default();
    command.env_remove("CARGO_ENCODED_RUSTFLAGS").env("RUSTFLAGS", format!("{FLAGS}{cpu}"));
    if let Some(triple) = &target.triple {
        command.args(["--target", triple]);
    }
    if target.has_core()? {
        command.arg("--offline");
    } else {
        command.args(["-Zbuild-std=core", "-Zbuild-std-features=compiler-builtins-mem"]);
    }
    let output = command
        .output()
        .map_err(|error| format!("error: cannot run {}, which `--measure` needs: {error}", cargo.display()))?;
    if output.status.success() {
        return Ok(());
    }
    let name = target.name()?;
    let complaint = String::from_utf8_lossy(&output.stderr);
    Err(format!(
        "error: the controllers cannot be built for {name}, so `--measure` has nothing to read:\n{}\n\
         help: `rustup target add` brings the core library of a machine; `RUSTC` names another compiler",
        complaint.trim()
    ))
}
