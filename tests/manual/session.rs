//! Where the commands of a page are run.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::command::program;
use super::repository;

/// A shell that stays in the folder it went to.
pub struct Session {
    home: PathBuf,
    folder: PathBuf,
    /// Of cargo.
    target: PathBuf,
}

/// What a command did.
pub struct Outcome {
    /// Both streams, in the order of writing.
    pub printed: String,
    pub succeeded: bool,
}

impl Session {
    /// In a copy of the repository inside `tests`, the folder of tests, or in an empty folder beside a link to the repository. What cargo
    /// builds is shared with the tests of other users' crates.
    ///
    /// # Panics
    /// The file system does not let it.
    pub fn new(tests: &Path, is_empty: bool) -> Self {
        let home = tests.join("documentation");
        let folder = home.join(if is_empty { "empty" } else { "copy" });
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).expect("the folder for tests can be written to");
        if is_empty {
            link(&repository(), &home.join("dpc-codegen"));
        } else {
            copy(&repository(), &folder);
        }
        let programs = home.join("programs");
        fs::create_dir_all(&programs).expect("the folder for tests can be written to");
        link(program(), &programs.join("dpc-codegen"));
        Self { home, folder, target: tests.join("users") }
    }

    /// Runs a line of shell.
    ///
    /// # Panics
    /// There is no shell.
    pub fn run(&mut self, line: &str) -> Outcome {
        let left_in = self.home.join("left-in");
        // A copy of the compiler would be built anew.
        let line = line.replace("cargo run --release -p dpc-codegen -- ", "dpc-codegen ");
        let script = format!("exec 2>&1\n{line}\nstatus=$?\npwd >'{}'\nexit $status", left_in.display());
        let mut shell = Command::new("sh");
        shell.arg("-c").arg(script).current_dir(&self.folder).env("PATH", self.path()).env("COLUMNS", "100");
        shell.env("CARGO_TARGET_DIR", &self.target).env("CARGO_TERM_COLOR", "never");
        shell.env_remove("RUSTFLAGS").env_remove("CARGO_ENCODED_RUSTFLAGS");
        // The compiler unoptimised: it is built in a fifth of the time, and the designs here are small.
        shell.env("CARGO_PROFILE_DEV_BUILD_OVERRIDE_OPT_LEVEL", "0");
        self.lock();
        let output = shell.output().expect("there is a shell");
        if let Ok(folder) = fs::read_to_string(left_in) {
            self.folder = PathBuf::from(folder.trim_end());
        }
        Outcome { printed: String::from_utf8_lossy(&output.stdout).into_owned(), succeeded: output.status.success() }
    }

    /// A crate that has no versions yet gets those that are tested here, and are at hand.
    fn lock(&self) {
        let lock = self.folder.join("Cargo.lock");
        if self.folder.join("Cargo.toml").is_file() && !lock.exists() {
            fs::copy(repository().join("Cargo.lock"), lock).expect("the folder for tests can be written to");
        }
    }

    /// Writes a file that a page shows. Crates of the repository are named by where they are and not by the link: cargo takes these for
    /// others, and would build them again.
    ///
    /// # Panics
    /// The file system does not let it.
    pub fn write(&self, name: &str, text: &str) {
        let path = self.folder.join(name);
        let parent = path.parent().expect("a file is in a folder");
        let text = text.replace("\"../dpc-codegen/", &format!("\"{}/", repository().display()));
        fs::create_dir_all(parent)
            .and_then(|()| fs::write(&path, text))
            .expect("the folder for tests can be written to");
    }

    fn path(&self) -> String {
        let before = std::env::var("PATH").unwrap_or_default();
        format!("{}:{before}", self.home.join("programs").display())
    }
}

fn link(to: &Path, at: &Path) {
    let _ = fs::remove_file(at);
    std::os::unix::fs::symlink(to, at).expect("the folder for tests can be written to");
}

fn copy(from: &Path, to: &Path) {
    for entry in fs::read_dir(from).expect("the checkout can be read").flatten() {
        let (source, name) = (entry.path(), entry.file_name());
        let target = to.join(&name);
        match entry.file_type().expect("the checkout can be read") {
            kind if kind.is_dir() && (name == "target" || name == ".git") => {}
            kind if kind.is_dir() => {
                fs::create_dir_all(&target).expect("the folder for tests can be written to");
                copy(&source, &target);
            }
            kind if kind.is_file() => drop(fs::copy(source, target).expect("the folder for tests can be written to")),
            _ => {}
        }
    }
}
