//! Where results go, and in which form.

use std::io::{self, Write};

use clap::{Args, ValueEnum};
use serde_json::Value;

/// What commands share that print results.
#[derive(Args, Debug, Clone, Copy, Default)]
pub struct Output {
    /// For whom: `json` prints one JSON object on the standard output and nothing else, mistakes included
    #[arg(long, value_enum, value_name = "FORMAT", default_value_t)]
    pub format: Format,
    /// No progress on the terminal
    #[arg(long, short)]
    pub quiet: bool,
}

#[derive(ValueEnum, Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Format {
    /// For people
    #[default]
    Text,
    /// For machines; see the documentation of `dpc_codegen::diagnostic::json`
    Json,
}

/// A reader that stops early, such as `head`, is no mistake of ours.
pub fn print(text: &str) -> io::Result<()> {
    match io::stdout().write_all(text.as_bytes()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(error),
        _ => Ok(()),
    }
}

pub fn print_json(value: &Value) -> io::Result<()> {
    print(&format!("{value:#}\n"))
}
