//! `dpc-codegen report system.toml`: one page about a design.

use std::path::{Path, PathBuf};

use clap::Args;
use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::Source;
use dpc_codegen::emit::{Emitted, package_folder, write_all};
use dpc_codegen::report::Report;
use dpc_codegen::simulate::History;

use super::failure::{Failure, say};

/// Write one page about a design: its sets, margins, ranges and a simulation, as HTML that needs no network
#[derive(Args)]
pub struct Arguments {
    /// The network: model, constraints, weights (TOML)
    file: PathBuf,
    /// The page [default: <name of the network>.html]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// What is simulated (TOML), as of `simulate` [default: set-points visit the ends of Y in turn; nothing where constraints change
    /// while running, since a scenario has to say how]
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
    /// Leave the simulation out, for which the controllers would be compiled
    #[arg(long, conflicts_with = "scenario")]
    no_simulation: bool,
    /// Where compiled controllers are kept
    #[arg(long, value_name = "FOLDER")]
    cache: Option<PathBuf>,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let source = Source::read(&arguments.file)?;
    if let Some(out) = &arguments.out {
        arguments.check_target(out).map_err(Failure::Usage)?;
    }
    let (design, emitted, history) = arguments.performed(&source)?;
    let report = Report::new(&design, &emitted);
    let page = match &history {
        Some(history) => report.with_history(history).html(),
        None => report.html(),
    };
    let default = || PathBuf::from(package_folder(&design.network) + ".html");
    let out = arguments.out.clone().unwrap_or_else(default);
    let changed =
        write_all(&[(out.clone(), page.as_str())]).map_err(|error| Failure::System(format!("error: {error}")))?;
    let word = if changed[0] { "Written:  " } else { "Unchanged:" };
    say(&format!("{word} {}\n", out.display()))
}

impl Arguments {
    /// The design, and what happened in the simulation where there is to be one.
    fn performed(&self, source: &Source) -> Result<(Design, Emitted, Option<History>), Failure> {
        if self.scenario.is_none() {
            let design = Design::new(source.clone()).map_err(|mistakes| Failure::mistakes(source.clone(), mistakes))?;
            let undecided = !design.network.changing_constraints.is_empty();
            if undecided && !self.no_simulation {
                eprintln!(
                    "note: nothing is simulated: constraints change while running, and only a --scenario says how"
                );
            }
            if undecided || self.no_simulation {
                let emitted = Emitted::new(&design);
                return Ok((design, emitted, None));
            }
        }
        let asked = super::simulate::Arguments {
            file: self.file.clone(),
            scenario: self.scenario.clone(),
            out: None,
            format: Vec::new(),
            no_plots: true,
            seed: None,
            cache: self.cache.clone(),
        };
        let (design, emitted, history) = super::simulate::performed(&asked, source)?;
        Ok((design, emitted, Some(history)))
    }

    /// Nothing that is read may be written, and no folder can be.
    fn check_target(&self, out: &Path) -> Result<(), String> {
        let same = |input: &PathBuf| matches!((input.canonicalize(), out.canonicalize()), (Ok(a), Ok(b)) if a == b);
        let shown = out.display();
        if [Some(&self.file), self.scenario.as_ref()].into_iter().flatten().any(same) {
            return Err(format!("error: --out {shown} would overwrite an input; choose another file"));
        }
        if out.is_dir() {
            return Err(format!("error: --out {shown} is a folder; name a file in it"));
        }
        Ok(())
    }
}
