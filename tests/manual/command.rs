//! The program, and what it says of itself.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;

/// The program `dpc-codegen`, built as this one was.
///
/// # Panics
/// It cannot be built.
pub fn program() -> &'static Path {
    static PROGRAM: LazyLock<PathBuf> = LazyLock::new(built);
    &PROGRAM
}

fn built() -> PathBuf {
    let this = std::env::current_exe().expect("the system says what it runs");
    let profile = this.ancestors().find(|folder| folder.join("deps").is_dir()).expect("cargo's folder of a profile");
    let name = profile.file_name().expect("a folder has a name").to_string_lossy().into_owned();
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["build", "--quiet", "--package", "dpc-codegen", "--bin", "dpc-codegen"]);
    cargo.args(["--profile", if name == "debug" { "dev" } else { &name }]);
    cargo.arg("--target-dir").arg(profile.parent().expect("profiles have folders in the target folder"));
    let status = cargo.current_dir(super::repository()).status().expect("cargo can be started");
    assert!(status.success(), "dpc-codegen cannot be built");
    profile.join(format!("dpc-codegen{}", std::env::consts::EXE_SUFFIX))
}

/// The page of the command line: what `frame` says, with the help of every command in place of `{{commands}}`.
///
/// # Panics
/// The program does not say what it can do.
pub fn page(frame: &str) -> String {
    let mut sections = vec![section(&[])];
    sections.extend(commands(&help(&[])).iter().map(|command| section(&[command])));
    frame.replace("{{commands}}", sections.join("\n").trim_end())
}

fn section(command: &[&str]) -> String {
    let name = ["dpc-codegen"].into_iter().chain(command.iter().copied()).collect::<Vec<_>>().join(" ");
    let title = if command.is_empty() { "dpc-codegen FILE" } else { &name };
    format!("## `{title}`\n\n```text\n{}\n```\n", help(command).trim_end())
}

/// What `dpc-codegen COMMAND --help` prints, in lines without trailing spaces.
pub fn help(command: &[&str]) -> String {
    let mut called = Command::new(program());
    let output = called.args(command).arg("--help").env("COLUMNS", "100").output().expect("it can be started");
    let text = String::from_utf8(output.stdout).expect("help is text");
    assert!(output.status.success() && !text.is_empty(), "no help for {command:?}");
    text.lines().map(str::trim_end).collect::<Vec<_>>().join("\n")
}

/// The commands that a help lists.
pub fn commands(help: &str) -> Vec<String> {
    let listed = help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    let names = listed.filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    let names = names.filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help");
    names.map(str::to_owned).collect()
}
