//! Command lines: what may be asked, and who answers.

mod check;
mod completions;
mod design;
mod explain;
mod failure;
mod new;
mod output;
mod progress;

use clap::{Parser, Subcommand};
use failure::{EXIT_CODES, Exit, Failure};
use output::Format;

/// Designs one predictive controller per subsystem of the network in FILE and writes them as Rust.
///
/// Prints margins, sets, sizes and what was written. Where FILE has mistakes, prints them and writes nothing.
#[derive(Parser)]
#[command(version, args_conflicts_with_subcommands = true, subcommand_negates_reqs = true, after_help = EXIT_CODES)]
pub struct CommandLine {
    #[command(flatten)]
    design: Option<design::Arguments>,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand)]
enum Command {
    Check(check::Arguments),
    Explain(explain::Arguments),
    Completions(completions::Arguments),
    New(new::Arguments),
}

impl CommandLine {
    /// Does what was asked, and tells what went wrong; then nothing is half-written.
    pub fn run(self) -> Exit {
        let format = self.format();
        let done = match (self.command, self.design) {
            (Some(command), _) => command.run(),
            (None, Some(arguments)) => design::run(&arguments),
            (None, None) => unreachable!("clap asks for FILE where there is no command"),
        };
        match done {
            Ok(()) => Exit::Fine,
            Err(failure) => {
                failure.report(format);
                failure.exit()
            }
        }
    }

    /// For whom failures are told.
    fn format(&self) -> Format {
        match (&self.command, &self.design) {
            (Some(Command::Check(arguments)), _) => arguments.output.format,
            (Some(Command::Explain(arguments)), _) => arguments.format,
            (Some(Command::Completions(_) | Command::New(_)), _) | (None, None) => Format::Text,
            (None, Some(arguments)) => arguments.output.format,
        }
    }
}

impl Command {
    fn run(self) -> Result<(), Failure> {
        match self {
            Self::Check(arguments) => check::run(&arguments),
            Self::Explain(arguments) => explain::run(&arguments),
            Self::Completions(arguments) => completions::run(&arguments),
            Self::New(arguments) => new::run(&arguments),
        }
    }
}
