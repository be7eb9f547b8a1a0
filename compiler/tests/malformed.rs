//! Does the program end as it says on files that are nearly networks: exit code, a place, and all of the output or none?

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

#[path = "../../tests/mutations.rs"]
mod mutations;

use mutations::{Mutant, Mutations, extremes};

const GOOD: &str = include_str!("../../examples/four_tank/system.toml");

/// Far beyond anything but a file that is worked at for ever.
const PATIENCE: Duration = Duration::from_secs(600);

#[test]
fn mutated_files_leave_all_of_the_output_or_none() {
    let mut mutations = Mutations::new(11, vec![GOOD.to_owned()]);
    let codes: Vec<i32> = (0..60).map(|_| judged("mutated", &mutations.draw())).collect();
    assert!([0, 1].iter().all(|code| codes.contains(code)), "{codes:?}");
}

#[test]
fn files_beyond_all_measure_end_too() {
    let codes: Vec<i32> = extremes(GOOD).iter().map(|mutant| judged("extreme", mutant)).collect();
    assert!([0, 1].iter().all(|code| codes.contains(code)), "{codes:?}");
}

/// The exit code, after all that can be said about it.
fn judged(place: &str, mutant: &Mutant) -> i32 {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(place);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(folder.join("there")).unwrap();
    fs::write(folder.join("there/left.rs"), "precious").unwrap();
    fs::write(folder.join("system.toml"), &mutant.bytes).unwrap();
    let (fresh, over) = (run(&folder, "fresh"), run(&folder, "there"));
    let code = fresh.status.code().expect("nobody kills it");
    let said = String::from_utf8_lossy(&fresh.stderr).into_owned();
    assert_eq!(over.status.code(), Some(code), "{}: {said}", mutant.kind);
    let untouched = fs::read_to_string(folder.join("there/left.rs")).unwrap() == "precious";
    match code {
        0 => assert!(folder.join("fresh/mod.rs").exists(), "{}", mutant.kind),
        1 => {
            assert!(!folder.join("fresh").exists() && untouched, "{}", mutant.kind);
            assert_eq!(files(&folder.join("there")), 1, "{}", mutant.kind);
            assert!(said.starts_with("error[E0") && said.contains("system.toml:"), "{}: {said}", mutant.kind);
        }
        other => panic!("{} ends with {other}: {said}", mutant.kind),
    }
    fs::remove_dir_all(&folder).unwrap();
    code
}

fn files(folder: &Path) -> usize {
    fs::read_dir(folder).unwrap().count()
}

fn run(folder: &Path, out: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dpc-codegen"));
    command.args(["system.toml", "--out", out]).current_dir(folder).stdout(Stdio::null());
    let errors = folder.join("said");
    let mut child = command.stderr(fs::File::create(&errors).unwrap()).spawn().unwrap();
    let start = Instant::now();
    let status = loop {
        match child.try_wait().unwrap() {
            Some(status) => break status,
            None if start.elapsed() > PATIENCE => panic!("{}: still at work", kill(&mut child, folder).display()),
            None => thread::sleep(Duration::from_millis(2)),
        }
    };
    Output { status, stdout: Vec::new(), stderr: fs::read(errors).unwrap() }
}

fn kill(child: &mut std::process::Child, folder: &Path) -> PathBuf {
    child.kill().unwrap();
    folder.join("system.toml")
}
