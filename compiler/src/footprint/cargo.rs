//! Cargo, for packages around emitted files.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::target::Target;

/// How packages are built.
pub struct Cargo<'a> {
    pub target: &'a Target,
    /// For the compiler; those of unstable features too.
    pub flags: &'a str,
    /// Link-time optimisation, as the manifest has it: `off` or `fat`.
    pub lto: &'a str,
    /// Of what is made.
    pub out: &'a Path,
    /// What needs it, for complaints: `` `--measure` ``.
    pub purpose: &'a str,
}

impl Cargo<'_> {
    /// `cargo <arguments>` for the package or workspace in `folder`, with the release profile that its manifest states.
    ///
    /// # Errors
    /// A sentence for the user: cargo or the compiler is missing or fails.
    pub fn run(&self, folder: &Path, arguments: &[&str]) -> Result<(), String> {
        let Self { target, purpose, .. } = self;
        let cargo = std::env::var_os("CARGO").map_or_else(|| PathBuf::from("cargo"), PathBuf::from);
        let output = self.command(&cargo, folder, arguments)?.output();
        let output =
            output.map_err(|error| format!("error: cannot run {}, which {purpose} needs: {error}", cargo.display()))?;
        if output.status.success() {
            return Ok(());
        }
        let name = target.name()?;
        let complaint = String::from_utf8_lossy(&output.stderr);
        Err(format!(
            "error: the controllers cannot be built for {name}, which {purpose} needs:\n{}\n\
             help: `rustup target add` brings the core library of a machine; `RUSTC` names another compiler",
            complaint.trim()
        ))
    }

    fn command(&self, cargo: &Path, folder: &Path, arguments: &[&str]) -> Result<Command, String> {
        let Self { target, flags, lto, out, .. } = self;
        let mut command = Command::new(cargo);
        command.args(arguments).args(["--release", "--quiet", "--manifest-path"]).arg(folder.join("Cargo.toml"));
        command.arg("--target-dir").arg(out).env("RUSTC", target.rustc()).env("RUSTC_BOOTSTRAP", "1");
        // What is said of the profile must not be overridden; incremental compilation cuts crates into many units.
        command.env("CARGO_INCREMENTAL", "0");
        for (key, value) in
            [("OPT_LEVEL", "3"), ("LTO", *lto), ("CODEGEN_UNITS", "1"), ("PANIC", "abort"), ("DEBUG", "false")]
        {
            command.env(format!("CARGO_PROFILE_RELEASE_{key}"), value);
        }
        let cpu = target.cpu.as_ref().map(|cpu| format!(" -C target-cpu={cpu}")).unwrap_or_default();
        command.env_remove("CARGO_ENCODED_RUSTFLAGS").env("RUSTFLAGS", format!("{flags}{cpu}"));
        if let Some(triple) = &target.triple {
            command.args(["--target", triple]);
        }
        if target.has_core()? {
            command.arg("--offline");
        } else {
            command.args(["-Zbuild-std=core", "-Zbuild-std-features=compiler-builtins-mem"]);
        }
        Ok(command)
    }
}
