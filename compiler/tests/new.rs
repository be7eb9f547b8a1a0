//! Does `dpc-codegen new demo && cd demo && cargo run` work for every template and show a closed loop, and is nothing lost or
//! half-written where it refuses?

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

#[test]
fn tanks_run() {
    runs("tanks", &[]);
}

#[test]
fn vehicles_run() {
    runs("vehicles", &["--template", "vehicles"]);
}

#[test]
fn rooms_run() {
    runs("rooms", &["--template", "rooms", "--name", "my-rooms"]);
}

/// A subsystem more, and nothing else changed.
#[test]
fn a_subsystem_is_added_in_the_file_alone() {
    let folder = made("more", &[]);
    let file = folder.join("system.toml");
    let text = fs::read_to_string(&file).unwrap();
    let right = text.find("[subsystem.right]").unwrap();
    let end = text.find("[[coupling-constraint]]").unwrap();
    let last = text[right..end].replace("right", "last").replace("from.middle", "from.right");
    let text = format!("{}{last}\n[subsystem.right.from.last]\nA = [[0.04]]\n\n{}", &text[..end], &text[end..]);
    let text = text.replacen(
        "A = [[0.94]]\nB = [[0.25]]\nC = [[1.0]]\nx = { min = [-10.0], max = [10.0] }\nu",
        "A = [[0.90]]\nB = [[0.25]]\nC = [[1.0]]\nx = { min = [-10.0], max = [10.0] }\nu",
        1,
    );
    fs::write(file, text).unwrap();
    let shown = cargo(&folder, &["run"]);
    assert!(shown.contains("last: level [cm]"), "{shown}");
    assert_verdict(&shown);
}

#[test]
fn what_is_there_is_not_touched() {
    let root = fresh("refused");
    fs::create_dir_all(root.join("full")).unwrap();
    fs::write(root.join("full/precious"), "precious").unwrap();
    fs::write(root.join("file"), "precious").unwrap();
    for arguments in
        [&["full"][..], &["file"], &["file/inside"], &["fn"], &["1st"], &["ok", "--name", "my crate"], &["std"]]
    {
        let output = new(&root, arguments);
        assert!(!output.status.success(), "{arguments:?}");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(said.starts_with("error: "), "{arguments:?}: {said}");
        assert_eq!(String::from_utf8_lossy(&output.stdout), "", "{arguments:?}");
    }
    let mut left: Vec<_> = fs::read_dir(&root).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    left.sort();
    assert_eq!(left, ["file", "full"]);
    assert_eq!(fs::read_dir(root.join("full")).unwrap().count(), 1);
    assert_eq!(fs::read_to_string(root.join("full/precious")).unwrap(), "precious");
}

/// As the last lines of `dpc-codegen new` say, and with every check that a user may run.
fn runs(name: &str, arguments: &[&str]) {
    let folder = made(name, arguments);
    let shown = cargo(&folder, &["run"]);
    assert!(shown.contains("time [s]") && shown.contains("holds"), "{shown}");
    assert_verdict(&shown);
    cargo(&folder, &["test"]);
    cargo(&folder, &["clippy", "--all-targets", "--", "-D", "warnings"]);
    cargo(&folder, &["fmt", "--check"]);
}

fn assert_verdict(shown: &str) {
    let counts = |line: &str| -> Vec<usize> { line.split_whitespace().filter_map(|word| word.parse().ok()).collect() };
    let line = |start: &str| shown.lines().find(|line| line.starts_with(start)).unwrap_or_else(|| panic!("{shown}"));
    let limits = counts(line("Limits:"));
    assert!(limits[0] == limits[1] && limits[0] >= 6 && limits[2] > 50, "{shown}");
    let steps = counts(line("Guarantee:"));
    assert_eq!(steps[0], steps[1], "{shown}");
}

fn made(name: &str, arguments: &[&str]) -> PathBuf {
    let root = fresh(&format!("new-{name}"));
    let output = new(&root, &[&["demo"], arguments].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    // The versions that are tested here, and are at hand.
    fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("../Cargo.lock"), root.join("demo/Cargo.lock")).unwrap();
    // The style of a machine without settings, wherever the target folder lies.
    fs::write(root.join("rustfmt.toml"), "").unwrap();
    root.join("demo")
}

fn new(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_dpc-codegen")).arg("new").args(arguments).current_dir(folder).output().unwrap()
}

fn fresh(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// What cargo's program prints.
fn cargo(folder: &Path, arguments: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO"));
    command.args(arguments).current_dir(folder).env_remove("RUSTFLAGS").env_remove("CARGO_ENCODED_RUSTFLAGS");
    command.env("CARGO_TARGET_DIR", Path::new(env!("CARGO_TARGET_TMPDIR")).join("users"));
    // The compiler unoptimised: it is built in a fifth of the time, and the designs here are small.
    command.env("CARGO_PROFILE_DEV_BUILD_OVERRIDE_OPT_LEVEL", "0");
    let output = command.output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(output.status.success(), "{arguments:?}: {}\n{}", text(&output.stderr), text(&output.stdout));
    text(&output.stdout)
}
