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
}

/// What a command did.
pub struct Outcome {
    /// Both streams, in the order of writing.
    pub printed: String,
    pub succeeded: bool,
}

impl Session {
    /// In a copy of the repository inside `home`, or beside one in an empty folder. The copy is a link for what is built in place: paths
    /// of crates must not change from run to run, or all of them would be built again.
    ///
    /// # Panics
    /// The file system does not let it.
    pub fn new(home: &Path, is_empty: bool) -> Self {
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
        Self { home: home.to_path_buf(), folder }
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
        shell.env("CARGO_TARGET_DIR", self.home.join("target")).env("CARGO_TERM_COLOR", "never");
        let output = shell.output().expect("there is a shell");
        if let Ok(folder) = fs::read_to_string(left_in) {
            self.folder = PathBuf::from(folder.trim_end());
        }
        Outcome { printed: String::from_utf8_lossy(&output.stdout).into_owned(), succeeded: output.status.success() }
    }

    /// Writes a file that a page shows.
    ///
    /// # Panics
    /// The file system does not let it.
    pub fn write(&self, name: &str, text: &str) {
        let path = self.folder.join(name);
        let parent = path.parent().expect("a file is in a folder");
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
