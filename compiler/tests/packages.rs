//! Is each crate of `--crate` complete: does it build, is its manual true and without a broken line, and do its examples compile?

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const TANKS: &str = include_str!("../../examples/four_tank/system.toml");
const LOADS: &str = include_str!("../src/scaffold/files/rooms/system.toml");
const CHANGING: &str = include_str!("../../tests/cases/emit/changing.toml");
const SINGLE: &str = include_str!("../../tests/cases/emit/single.toml");

#[test]
fn crates_build_and_their_manuals_hold() {
    let root = fresh("packages");
    for (network, text) in [("tanks", TANKS), ("rooms", LOADS), ("changing", CHANGING), ("single", SINGLE)] {
        fs::write(root.join("system.toml"), text).unwrap();
        written(&root, &["system.toml", "--crate", network]);
    }
    fs::write(root.join("Cargo.toml"), "[workspace]\nresolver = \"3\"\nmembers = [\"*/*\"]\nexclude = [\"target\"]\n")
        .unwrap();
    cargo(&root, &["test", "--quiet"], "");
    cargo(&root, &["clippy", "--quiet", "--", "-D", "warnings", "-W", "clippy::pedantic"], "");
    cargo(&root, &["doc", "--quiet", "--no-deps"], "-D warnings");
}

#[test]
fn a_manual_says_what_a_node_needs() {
    let root = fresh("manual");
    fs::write(root.join("system.toml"), TANKS).unwrap();
    written(&root, &["system.toml", "--crate", "nodes", "--measure"]);
    assert!(!root.join("generated").exists(), "controllers alone were not asked for");
    let manifest = fs::read_to_string(root.join("nodes/left/Cargo.toml")).unwrap();
    let pinned = concat!("dpc-runtime = { version = \"=", env!("CARGO_PKG_VERSION"), "\"");
    assert!(manifest.contains(pinned) && manifest.contains("four_tank_left"), "{manifest}");
    let manual = fs::read_to_string(root.join("nodes/left/README.md")).unwrap();
    for part in [
        "# `four_tank_left`",
        "\n        while let Some(bytes) = machine.received() {\n",
        "2 states, 1 input, 1 output",
        "one step every 0.5 s, 3 steps ahead, in `f64`",
        "| state 0 | `h1 [cm]` | `h1 <= 27.6 cm`, `h1 >= -12.4 cm` |",
        "| input 0 | `v1 [V]` | `v1 <= 3 V`, `v1 >= -3 V` |",
        "| Y (31) | set-points of `h1 [cm]` that are reached | from -1.0000 to 3.9519 |",
        "| `right` | 48 | `0.0206 h4 + 0.000247 v2` | `FROM_RIGHT` |",
        "It is heard by `right`.",
        "Its message: 48 bytes",
        "| 32 to 39 | f64 | yref of `h1 [cm]` |",
        "Tables: ",
        "x86_64",
        "at most 64 changes",
        "MIT or Apache-2.0",
    ] {
        assert!(manual.contains(part), "no {part} in {manual}");
    }
    // Figures stay while the controllers do.
    let again = written(&root, &["system.toml", "--crate", "nodes"]);
    assert!(!again.contains("Written:") && again.matches("Unchanged:").count() == 8, "{again}");
}

/// Every variant of the runtime's statuses is in the manual, and no other.
#[test]
fn the_manual_knows_every_status() {
    let root = fresh("statuses");
    fs::write(root.join("system.toml"), TANKS).unwrap();
    written(&root, &["system.toml", "--crate", "nodes"]);
    let manual = fs::read_to_string(root.join("nodes/left/README.md")).unwrap();
    let start = manual.find("## Statuses").unwrap();
    let section = &manual[start..start + manual[start..].find("\n## ").unwrap()];
    let runtime = Path::new(env!("CARGO_MANIFEST_DIR")).join("../runtime/src");
    for (file, name) in [("status.rs", "Control"), ("status.rs", "References"), ("delivery.rs", "Delivery")] {
        let table = section.split("| `status.").find(|table| table.starts_with(&field(name))).unwrap();
        let told: Vec<&str> = table
            .lines()
            .skip(1)
            .filter(|line| line.starts_with("| `"))
            .flat_map(|line| line.split('|').nth(1).unwrap().split('`').skip(1).step_by(2))
            .collect();
        let mut told: Vec<String> = told.into_iter().map(str::to_owned).collect();
        let mut known = variants(&fs::read_to_string(runtime.join(file)).unwrap(), name);
        told.sort();
        known.sort();
        assert_eq!(told, known, "{name}");
    }
}

fn field(name: &str) -> String {
    if name == "Delivery" { "deliveries".to_owned() } else { name.to_lowercase() }
}

fn variants(source: &str, name: &str) -> Vec<String> {
    let file = syn::parse_file(source).unwrap();
    let item = file.items.into_iter().find_map(|item| match item {
        syn::Item::Enum(item) if item.ident == name => Some(item),
        _ => None,
    });
    item.unwrap().variants.iter().map(|variant| variant.ident.to_string()).collect()
}

fn written(root: &Path, arguments: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dpc-codegen"));
    let output = command.args(arguments).current_dir(root).env("CARGO_TARGET_DIR", target()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn cargo(root: &Path, arguments: &[&str], rustdoc: &str) {
    let mut command = Command::new(env!("CARGO"));
    command.args(arguments).current_dir(root).env_remove("RUSTFLAGS").env_remove("CARGO_ENCODED_RUSTFLAGS");
    let output = command.env("CARGO_TARGET_DIR", target()).env("RUSTDOCFLAGS", rustdoc).output().unwrap();
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

fn target() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("nodes-target")
}

fn fresh(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}
