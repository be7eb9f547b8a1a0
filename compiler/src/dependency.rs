//! Lines of `Cargo.toml` that bring in this compiler's packages.

use std::path::Path;

/// A package beside this one: its name, and its folder in the sources.
pub type Package = (&'static str, &'static str);

pub const RUNTIME: Package = ("dpc-runtime", "runtime");
pub const COMPILER: Package = ("dpc-codegen", "compiler");

/// A line for `[dependencies]`: the package that this compiler was built with, where its sources still are, else the one of its
/// version. `more` are further keys.
pub fn dependency((name, folder): Package, more: &str) -> String {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join(folder);
    let path = path.canonicalize().ok().filter(|path| path.join("Cargo.toml").is_file());
    let more = if more.is_empty() { String::new() } else { format!(", {more}") };
    let version = env!("CARGO_PKG_VERSION");
    match path {
        Some(path) => format!("{name} = {{ path = {path:?}{more} }}\n"),
        None => format!("{name} = {{ version = \"{version}\"{more} }}\n"),
    }
}
