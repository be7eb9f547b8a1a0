//! `dpc-codegen report system.toml`: one page about a design.

use std::io::IsTerminal;
use std::path::PathBuf;

use clap::Args;
use dpc_codegen::build;
use dpc_codegen::design::Design;
use dpc_codegen::emit::{Emitted, package_folder, write_all};
use dpc_codegen::report::Report;
use dpc_codegen::tuning::Effort;

/// Writes one page about a design: its sets, margins, ranges and a simulation, as HTML that needs no network.
#[derive(Args)]
pub struct Arguments {
    /// The network: model, constraints, weights (TOML)
    file: PathBuf,
    /// The page [default: <name of the network>.html]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// How long to search for better gains: 0 not at all, 3 longest [default: `effort` in the file, else 0]
    #[arg(long, value_name = "LEVEL", value_parser = clap::value_parser!(u8).range(0..=i64::from(Effort::MOST)))]
    effort: Option<u8>,
}

pub fn run(arguments: &Arguments) -> Result<(), String> {
    let source = build::read(&arguments.file)?;
    let effort = arguments.effort.and_then(Effort::new);
    let design = Design::watched(source.clone(), effort, &mut ());
    let design = design.map_err(|mistakes| mistakes.render(&source, std::io::stderr().is_terminal()))?;
    let emitted = Emitted::new(&design);
    let default = || PathBuf::from(package_folder(&design.network) + ".html");
    let out = arguments.out.clone().unwrap_or_else(default);
    let page = Report::new(&design, &emitted).html();
    let changed = write_all(&[(out.clone(), page.as_str())]).map_err(|error| format!("error: {error}"))?;
    let word = if changed[0] { "Written:" } else { "Unchanged:" };
    println!("{word} {}", out.display());
    Ok(())
}
