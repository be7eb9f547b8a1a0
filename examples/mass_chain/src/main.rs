//! Runs a chain of any length under its controllers, checks what they promise at every step, and draws it.
//!
//! `cargo run --release -p mass-chain` runs the emitted controllers of ten masses; `-- --length 30` designs for as many in
//! place and runs the same controllers from tables made at run time. Both write to `examples/mass_chain/out`; `-- --picture` also
//! renews the picture beside the README. `-- --gains` compares ways to gains, with a search of `--effort`. `-- --design` writes
//! `system.toml` anew.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use dpc_codegen::design::Design;
use dpc_codegen::export::design_json;
use example_kit::checks::Checks;
use example_kit::say;
use example_kit::sets::Promise;
use mass_chain::chain::{EMITTED, Gains, text};
use mass_chain::closed_loop::{Run, from_rest, upset};
use mass_chain::figure::closed_loop;
use mass_chain::node::Started;
use mass_chain::pattern::Patterns;
use mass_chain::report::{Entry, arrivals, counts, errors};
use mass_chain::stiff::{shown, source, ways};
use mass_chain::{DESIGN_JSON, emitted, tables};

type Failure = Box<dyn std::error::Error + Send + Sync>;

const USAGE: &str = "usage: mass-chain [--length 2..] [--picture] | --gains [EFFORT] | --design";
const SEEDS: u64 = 10;
/// Steps between upsets.
const BETWEEN: usize = 25;
/// Distance from the nearest admissible set-point above which a mass has not arrived, m.
const ARRIVED: f64 = 1e-5;

fn main() -> ExitCode {
    example_kit::conclude(run())
}

/// What was asked for; which promises were broken.
fn run() -> Result<Vec<String>, Failure> {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => ten(package, false),
        ["--picture"] => ten(package, true),
        ["--length", length] => any(package, length.parse().map_err(|_| USAGE)?),
        ["--gains"] => gains(2),
        ["--gains", effort] => gains(effort.parse().map_err(|_| USAGE)?),
        ["--design"] => {
            Ok(std::fs::write(package.join("system.toml"), text(EMITTED, Gains::Weighted)).map(|()| vec![])?)
        }
        _ => Err(USAGE.into()),
    }
}

fn gains(effort: u8) -> Result<Vec<String>, Failure> {
    let ways = ways(effort).map_err(|mistakes| mistakes.render(&source(EMITTED, Gains::Auto), false))?;
    say!("{}", shown(&ways));
    Ok(Vec::new())
}

/// The emitted controllers.
fn ten(package: &Path, picture: bool) -> Result<Vec<String>, Failure> {
    gains(0)?;
    let session = Session::new(package, EMITTED, DESIGN_JSON)?;
    say!("{EMITTED} masses, emitted controllers:\n");
    let broken = session.all(|| Ok(emitted::start()?))?;
    if picture {
        std::fs::copy(session.path("svg"), package.join("mass_chain.svg"))?;
    }
    Ok(broken)
}

/// Controllers from tables made now.
fn any(package: &Path, length: usize) -> Result<Vec<String>, Failure> {
    if length < 2 {
        return Err(USAGE.into());
    }
    let (source, clock) = (source(length, Gains::Weighted), Instant::now());
    let design = Design::new(source.clone()).map_err(|mistakes| mistakes.render(&source, false))?;
    say!("{length} masses, designed in {:.1} s, tables made at run time:\n", clock.elapsed().as_secs_f64());
    let masses = tables::tables(&design)?;
    Session::new(package, length, &design_json(&design))?.all(|| Ok(tables::start(&masses)?))
}

/// The runs of one chain.
struct Session {
    promise: Promise,
    patterns: Patterns,
    out: PathBuf,
    length: usize,
}

impl Session {
    fn new(package: &Path, length: usize, json: &str) -> Result<Self, Failure> {
        let promise = Promise::new(json)?;
        let patterns = Patterns::new(&promise, promise.epsilon);
        let out = package.join("out");
        std::fs::create_dir_all(&out)?;
        Ok(Self { promise, patterns, out, length })
    }

    fn all<'a>(&self, start: impl Fn() -> Result<Vec<Started<'a>>, Failure>) -> Result<Vec<String>, Failure> {
        let run = from_rest(start()?, &self.promise, &self.patterns)?;
        let mut upsets = Checks::new(&self.promise);
        for seed in 0..SEEDS {
            upsets.absorb(&upset(start()?, &self.promise, &self.patterns, BETWEEN, seed)?.checks);
        }
        self.write(&run)?;
        let errors = errors(&run, &self.promise, &self.patterns);
        let name = format!("the same, upsets every {BETWEEN} steps, {SEEDS} seeds");
        let entries = [
            Entry { name: "set-point patterns from rest".to_owned(), checks: run.checks },
            Entry { name, checks: upsets },
        ];
        say!("{}\n{}", counts(&entries), arrivals(&errors));
        say!("Picture and trajectory: {}", self.out.display());
        Ok(self.broken_promises(&entries, &errors))
    }

    fn broken_promises(&self, entries: &[Entry], errors: &[f64]) -> Vec<String> {
        let violated = entries.iter().filter(|entry| entry.checks.violations() > 0);
        let violated = violated.map(|entry| format!("{}: {} violations", entry.name, entry.checks.violations()));
        let late = errors.iter().filter(|error| self.patterns.arrive && **error > ARRIVED);
        violated.chain(late.map(|error| format!("a mass is {error:.1e} m off at the end of a pattern"))).collect()
    }

    fn path(&self, ending: &str) -> PathBuf {
        self.out.join(format!("chain_{}.{ending}", self.length))
    }

    fn write(&self, run: &Run) -> Result<(), Failure> {
        let title = format!("{} masses between two walls: set-point patterns from rest", self.length);
        std::fs::write(self.path("svg"), closed_loop(&title, run).to_svg()?)?;
        let columns: Vec<String> = (1..=self.length)
            .flat_map(|i| ["q_m", "v_m_s", "force_N", "set_point_m", "q_ref_m"].map(|name| format!("{name}_{i}")))
            .collect();
        let csv = run.trajectory.to_csv(&columns, |_, sample| {
            let masses = sample.nodes.iter();
            masses.flat_map(|node| [node.x[0], node.x[1], node.u[0], node.set_point[0], node.y_ref[0]]).collect()
        });
        Ok(std::fs::write(self.path("csv"), csv)?)
    }
}
