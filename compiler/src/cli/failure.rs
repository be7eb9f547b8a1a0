//! How a command ends: exit codes, and what is told about a failure.

use std::io::IsTerminal;
use std::process::ExitCode;

use dpc_codegen::diagnostic::{Diagnostics, Source, Unreadable};
use serde_json::{Value, json};

use super::output::{Format, print, print_json};

/// What the process ends with. For `--help`, [`EXIT_CODES`] says it in words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exit {
    Fine = 0,
    /// The input has mistakes; they were told, and nothing was written.
    Mistakes = 1,
    /// The command line makes no sense (clap ends with this too).
    Usage = 2,
    /// The file system, or a program that was called, failed.
    System = 3,
    /// A simulation broke a promise of the design.
    Broken = 4,
}

pub const EXIT_CODES: &str = "\
Exit codes:
  0  done
  1  the input has mistakes, which are shown; nothing was written
  2  the command line makes no sense
  3  the file system failed, or a program that was called
  4  `simulate`: a constraint was violated although every controller said that the guarantee holds";

/// Why a command did not do what was asked.
#[derive(Debug)]
pub enum Failure {
    /// Mistakes with their places in a text.
    Mistakes(Box<(Source, Diagnostics)>),
    /// Other mistakes in the input, as text for the user.
    Input(String),
    Usage(String),
    System(String),
    Broken(String),
}

/// A plain message is about the input.
impl From<String> for Failure {
    fn from(message: String) -> Self {
        Self::Input(message)
    }
}

impl From<Unreadable> for Failure {
    fn from(why: Unreadable) -> Self {
        match why {
            Unreadable::System(why) => Self::System(format!("error: {why}")),
            Unreadable::NotText(source, mistakes) => Self::mistakes(source, mistakes),
        }
    }
}

impl Failure {
    pub fn mistakes(source: Source, mistakes: Diagnostics) -> Self {
        Self::Mistakes(Box::new((source, mistakes)))
    }

    pub fn exit(&self) -> Exit {
        match self {
            Self::Mistakes(_) | Self::Input(_) => Exit::Mistakes,
            Self::Usage(_) => Exit::Usage,
            Self::System(_) => Exit::System,
            Self::Broken(_) => Exit::Broken,
        }
    }

    /// Tells people on the standard error stream, or machines on the standard output.
    pub fn report(&self, format: Format) {
        match format {
            Format::Text => eprintln!("{}", self.text(std::io::stderr().is_terminal())),
            // Whoever does not listen any more gets the exit code all the same.
            Format::Json => drop(print_json(&self.json())),
        }
    }

    fn text(&self, styled: bool) -> String {
        match self {
            Self::Mistakes(told) => {
                let (source, mistakes) = &**told;
                let hint = mistakes.hint().map_or(String::new(), |hint| format!("\n\n{hint}"));
                mistakes.render(source, styled) + &hint
            }
            Self::Input(message) | Self::Usage(message) | Self::System(message) | Self::Broken(message) => {
                message.trim_end().to_owned()
            }
        }
    }

    fn json(&self) -> Value {
        match self {
            Self::Mistakes(told) => json!({ "outcome": "mistakes", "diagnostics": told.1.to_json(&told.0) }),
            Self::Input(message) => json!({ "outcome": "mistakes", "diagnostics": [], "message": plain(message) }),
            Self::Usage(message) => json!({ "outcome": "usage", "diagnostics": [], "message": plain(message) }),
            Self::Broken(message) => json!({ "outcome": "broken", "diagnostics": [], "message": plain(message) }),
            Self::System(message) => json!({ "outcome": "system", "diagnostics": [], "message": plain(message) }),
        }
    }
}

fn plain(message: &str) -> &str {
    message.trim_end().trim_start_matches("error: ")
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// Prints `text`, as [`print`] does.
///
/// # Errors
/// The stream is closed for another reason than a reader that stopped early.
pub fn say(text: &str) -> Result<(), Failure> {
    print(text).map_err(|error| Failure::System(format!("error: cannot print: {error}")))
}
