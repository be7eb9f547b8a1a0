//! Command lines: what may be asked, and who answers.

mod check;
mod completions;
mod design;
mod explain;
mod failure;
mod new;
mod output;
mod progress;
mod report;
mod simulate;

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
    design: design::Arguments,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand)]
enum Command {
    Check(check::Arguments),
    Explain(explain::Arguments),
    Completions(completions::Arguments),
    /// Begins a crate: a plant to change, its controllers, and a closed loop of them
    New(new::Arguments),
    Report(report::Arguments),
    Simulate(simulate::Arguments),
}

impl CommandLine {
    /// Does what was asked, and tells what went wrong; then nothing is half-written.
    pub fn run(self) -> Exit {
        let format = self.format();
        let done = match self.command {
            Some(command) => command.run(),
            None => design::run(&self.design),
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
        match &self.command {
            Some(Command::Check(arguments)) => arguments.output.format,
            Some(Command::Explain(arguments)) => arguments.format,
            Some(_) => Format::Text,
            None => self.design.output.format,
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
            Self::Report(arguments) => report::run(&arguments),
            Self::Simulate(arguments) => simulate::run(&arguments),
        }
    }
}
