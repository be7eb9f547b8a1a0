//! Lines of `Cargo.toml` that bring in this compiler's packages.

use std::path::Path;

/// A package beside this one: its name, and its folder in the sources.
pub type Package = (&'static str, &'static str);

pub const RUNTIME: Package = ("dpc-runtime", "runtime");
pub const COMPILER: Package = ("dpc-codegen", "compiler");

/// A line for `[dependencies]`: the package that this compiler was built with, where its sources still are, else the one of its
/// version. `more` are further keys.
pub fn dependency(package: Package, more: &str) -> String {
    let version = format!("version = {VERSION:?}");
    line(package, &[&path(package).unwrap_or(version), more])
}

/// The same, and no other version than this one.
pub fn pinned(package: Package) -> String {
    line(package, &[&format!("version = \"={VERSION}\""), &path(package).unwrap_or_default()])
}

const VERSION: &str = env!("CARGO_PKG_VERSION");

fn path((_, folder): Package) -> Option<String> {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join(folder).canonicalize().ok()?;
    path.join("Cargo.toml").is_file().then(|| format!("path = {path:?}"))
}

fn line((name, _): Package, keys: &[&str]) -> String {
    let keys: Vec<&str> = keys.iter().copied().filter(|key| !key.is_empty()).collect();
    format!("{name} = {{ {} }}\n", keys.join(", "))
}
