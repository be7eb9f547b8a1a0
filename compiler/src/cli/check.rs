//! `dpc-codegen check system.toml`: the whole design, and nothing written.

use clap::Args;
use dpc_codegen::emit::Emitted;
use dpc_codegen::summary::Summary;
use serde_json::json;

use super::design::{Question, designed};
use super::failure::{Failure, say};
use super::output::{Format, Output, print_json};
use super::progress::Progressing;

/// Validate the network in FILE and design it: every assumption with its margin, and nothing is written
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    question: Question,
    #[command(flatten)]
    pub output: Output,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut watch = Progressing::new(arguments.output.quiet);
    let design = designed(&arguments.question, &mut watch)?;
    let emitted = Emitted::new(&design);
    watch.end();
    let summary = Summary::new(&design, &emitted);
    match arguments.output.format {
        Format::Text => say(&summary.to_string()),
        Format::Json => print_json(&json!({ "outcome": "done", "diagnostics": [], "summary": summary.to_json() }))
            .map_err(|error| Failure::System(format!("error: cannot print: {error}"))),
    }
}
