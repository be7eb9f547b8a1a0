//! `dpc-codegen completions bash`: what a shell needs to complete command lines.

use clap::{Args, CommandFactory};
use clap_complete::{Shell, generate};

use super::CommandLine;
use super::failure::{Failure, say};

/// Print the completions for a shell
///
/// For bash: dpc-codegen completions bash > ~/.local/share/bash-completion/completions/dpc-codegen
#[derive(Args)]
pub struct Arguments {
    /// Whose completions
    shell: Shell,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut script = Vec::new();
    generate(arguments.shell, &mut CommandLine::command(), "dpc-codegen", &mut script);
    say(&String::from_utf8_lossy(&script))
}
