//! Does a release build of the runtime, or of what it has for robots in the plane, contain a panic, an allocation, or a call to anything but memcpy and its like?

use std::path::{Path, PathBuf};
use std::process::Command;

/// What the compiler itself asks for in code without a standard library.
const ALLOWED: [&str; 4] = ["memcpy", "memmove", "memset", "memcmp"];

#[test]
fn object_code_calls_nothing_but_memory_moves() {
    let package = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/no_panic");
    let objects = objects(&package, Path::new(env!("CARGO_TARGET_TMPDIR")));
    let defined: Vec<String> = objects.iter().flat_map(|object| symbols(object, "--defined-only")).collect();
    for asked in ["robots", "line_of_centres"] {
        assert!(defined.iter().any(|symbol| symbol.contains(asked)), "{asked} is in no object");
    }
    for object in &objects {
        let mut foreign = symbols(object, "--undefined-only");
        foreign.retain(|symbol| !defined.contains(symbol) && !is_allowed(symbol, object));
        assert!(foreign.is_empty(), "{} needs {foreign:#?}", object.display());
    }
}

/// The libraries' own objects also hold the `Display` and `Debug` implementations, which no controller calls.
fn is_allowed(symbol: &str, object: &Path) -> bool {
    let is_library = object.file_name().is_some_and(|name| name.to_string_lossy().starts_with("dpc_"));
    let is_formatter = symbol.contains("4core3fmt") && !symbol.contains("panic");
    ALLOWED.contains(&symbol.trim_start_matches('_')) || (is_library && is_formatter)
}

/// The object files of the package and of the libraries, compiled without its tests and for release.
fn objects(package: &Path, target: &Path) -> Vec<PathBuf> {
    let target = target.join("no-panic");
    let _ = std::fs::remove_dir_all(&target);
    let status = Command::new(env!("CARGO"))
        .args(["build", "--release", "--offline", "--quiet", "--manifest-path"])
        .arg(package.join("Cargo.toml"))
        .arg("--target-dir")
        .arg(&target)
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        .env("RUSTFLAGS", "--emit=obj,metadata,link -C lto=off")
        .status()
        .expect("cargo runs");
    assert!(status.success());
    let files = std::fs::read_dir(target.join("release/deps")).expect("cargo has written objects");
    let objects: Vec<PathBuf> =
        files.map(|file| file.unwrap().path()).filter(|path| path.extension().is_some_and(|end| end == "o")).collect();
    assert_eq!(objects.len(), 3, "one object of the package, one of each library: {objects:?}");
    objects
}

fn symbols(object: &Path, which: &str) -> Vec<String> {
    let output =
        Command::new("nm").arg("-P").arg(which).arg(object).output().expect("nm, part of every C compiler, runs");
    assert!(output.status.success());
    let text = String::from_utf8(output.stdout).expect("symbols are ASCII");
    text.lines().filter_map(|line| line.split_whitespace().next()).map(String::from).collect()
}
