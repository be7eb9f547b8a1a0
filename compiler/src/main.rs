//! The program `dpc-codegen`; what it does is in the library, and one module of `cli` per command line.

mod cli;

use std::process::ExitCode;

use clap::Parser;
use cli::CommandLine;

fn main() -> ExitCode {
    CommandLine::parse().run().into()
}
