//! Command lines: what may be asked, and who answers.

mod design;
mod report;
mod simulate;

use clap::{Parser, Subcommand};

/// Designs one predictive controller per subsystem of the network in FILE and writes them as Rust.
///
/// Prints margins, sets, sizes and what was written. Where FILE has mistakes, prints them, writes nothing, and ends
/// with exit code 1.
#[derive(Parser)]
#[command(version, args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct CommandLine {
    #[command(flatten)]
    design: Option<design::Arguments>,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand)]
enum Command {
    Report(report::Arguments),
    Simulate(simulate::Arguments),
}

impl CommandLine {
    /// Does what was asked.
    ///
    /// # Errors
    /// What to tell the user, who has nothing half-written then.
    pub fn run(self) -> Result<(), String> {
        match (self.command, self.design) {
            (Some(command), _) => command.run(),
            (None, Some(arguments)) => design::run(&arguments),
            (None, None) => unreachable!("clap asks for FILE where there is no command"),
        }
    }
}

impl Command {
    fn run(self) -> Result<(), String> {
        match self {
            Self::Report(arguments) => report::run(&arguments),
            Self::Simulate(arguments) => simulate::run_simulation(&arguments),
        }
    }
}
