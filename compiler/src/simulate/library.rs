//! The emitted controllers as a shared library, compiled once and kept.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::design::Design;
use crate::emit::c::Package;
use crate::emit::{Emitted, runtime, write_all};

/// The crate of a network's controllers in a cache, and what cargo makes of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Library {
    /// The shared library, once it is built.
    pub file: PathBuf,
    /// Of what the functions of each subsystem begin with, in the order of the network.
    pub prefixes: Vec<String>,
    /// What those of the network begin with.
    pub network: String,
    /// Of the crate, named after a hash of all that goes into it.
    package: PathBuf,
    name: String,
    /// What cargo builds in, shared by all libraries of a cache.
    target: PathBuf,
    files: Vec<(PathBuf, String)>,
}

/// Compiled for speed of compilation: optimisation changes no bit of a result, and a step takes microseconds all the same.
const PROFILE: [(&str, &str); 2] =
    [("CARGO_PROFILE_RELEASE_OPT_LEVEL", "1"), ("CARGO_PROFILE_RELEASE_CODEGEN_UNITS", "16")];

impl Library {
    /// Where libraries are kept that nobody asked for elsewhere: the user's cache.
    pub fn default_folder() -> PathBuf {
        let variable = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
        let cache = variable("XDG_CACHE_HOME").or_else(|| variable("LOCALAPPDATA"));
        let cache = cache.or_else(|| std::env::home_dir().map(|home| home.join(".cache")));
        // Nowhere that others may write: what is built there is loaded.
        cache.unwrap_or_else(|| PathBuf::from("target")).join("dpc-codegen").join("controllers")
    }

    /// The package for C of `emitted`, which was made of `design`, in the folder `cache`.
    pub fn of(design: &Design, emitted: &Emitted, cache: &Path) -> Self {
        let Package { files, name: network, prefixes, .. } = Package::new(design, emitted);
        // No two packages in one target folder may have the same name.
        let name = format!("dpc_controllers_{:016x}", hash(&files));
        let package = cache.join(&name);
        let named = |text: String| text.replacen(&format!("name = \"{network}\""), &format!("name = \"{name}\""), 1);
        let files = files.into_iter().map(|(path, text)| {
            let text = if path == "Cargo.toml" { named(text) } else { text };
            (package.join(path), text)
        });
        let files = files.collect();
        let built = format!("{}{name}{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
        Self { file: package.join(built), prefixes, network, package, name, target: cache.join("target"), files }
    }

    pub fn is_built(&self) -> bool {
        self.file.is_file()
    }

    /// Compiles it, where that was not done before.
    ///
    /// # Errors
    /// There is no cargo, or it complains; as text for the user.
    pub fn build(&self) -> Result<(), String> {
        if self.is_built() {
            return Ok(());
        }
        write_all(&self.files).map_err(|error| format!("error: {error}"))?;
        self.compile()?;
        let made = self.target.join("release").join(self.file.file_name().unwrap_or_default());
        // Under its final name only when it is whole.
        let copy = self.package.join(format!("{}.{}.tmp", self.name, std::process::id()));
        let copied = std::fs::copy(&made, &copy).and_then(|_| std::fs::rename(&copy, &self.file));
        copied.map_err(|error| format!("error: cannot keep {}: {error}", made.display()))
    }

    fn compile(&self) -> Result<(), String> {
        let cargo = std::env::var_os("CARGO").map_or_else(|| PathBuf::from("cargo"), PathBuf::from);
        let mut command = Command::new(&cargo);
        command.args([
            "rustc",
            "--release",
            "--quiet",
            "--lib",
            "--crate-type",
            "cdylib",
            "--features",
            "std",
            "--manifest-path",
        ]);
        command.arg(self.package.join("Cargo.toml")).envs(PROFILE);
        command.arg("--target-dir").arg(&self.target).env("CARGO_INCREMENTAL", "0");
        // Flags of a surrounding build are not meant for this one.
        for variable in
            ["CARGO_ENCODED_RUSTFLAGS", "RUSTFLAGS", "CARGO_BUILD_TARGET", "RUSTC_WRAPPER", "RUSTC_WORKSPACE_WRAPPER"]
        {
            command.env_remove(variable);
        }
        let output = command.output().map_err(|error| {
            format!("error: cannot run {}, which compiles the controllers: {error}\nhelp: install Rust from https://rustup.rs", cargo.display())
        })?;
        if output.status.success() {
            return Ok(());
        }
        let complaint = String::from_utf8_lossy(&output.stderr);
        Err(format!("error: the controllers do not compile:\n{}", complaint.trim()))
    }
}

/// Of everything that decides what the library does: the texts, and the runtime where that is at hand as source.
fn hash(files: &[(String, String)]) -> u64 {
    let mut hasher = DefaultHasher::new();
    (files, PROFILE, env!("CARGO_PKG_VERSION"), runtime()).hash(&mut hasher);
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../runtime/src"));
    let mut sources: Vec<PathBuf> =
        std::fs::read_dir(folder).into_iter().flatten().filter_map(|entry| Some(entry.ok()?.path())).collect();
    sources.sort();
    for source in sources {
        std::fs::read(source).ok().hash(&mut hasher);
    }
    hasher.finish()
}
