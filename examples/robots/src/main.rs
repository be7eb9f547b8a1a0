//! Runs robots that avoid each other, checks what their controllers promise, and draws them.
//!
//! `cargo run --release -p robots` runs the scenario of Section V under three rules, then a leader with followers and a formation;
//! `-- --help` says what else there is. Everything is written to `examples/robots/out`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser as _;
use example_kit::say;
use example_kit::table::table;
use robots::arena::DIAMETER;
use robots::campaign::Tally;
use robots::command::{Command, Failure, Fleet, Kind, RuleName};
use robots::fleet::{EMITTED, text};
use robots::floor::picture;
use robots::pace::Pace;
use robots::page::{page, verdict};
use robots::rule::Rule;
use robots::run::{Fault, Run};
use robots::scenario::Scenario;

/// The rules that the runs of the paper's scenario compare.
const RULES: [RuleName; 3] = [RuleName::Tangent, RuleName::Plain, RuleName::Centres];
/// Robots of the campaign.
const NUMBERS: [usize; 7] = [2, 3, 4, 5, 6, 7, 8];

fn main() -> ExitCode {
    example_kit::conclude(run(&Command::parse()))
}

/// What was asked for; which promises were broken.
fn run(command: &Command) -> Result<Vec<String>, Failure> {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    if command.design {
        return Ok(std::fs::write(package.join("system.toml"), text(EMITTED, Pace::FAST)).map(|()| vec![])?);
    }
    if let Some(seeds) = command.campaign {
        return campaign(seeds, command.pace());
    }
    let output = Output::new(package)?;
    match command.kind() {
        None => all(&output, command.picture),
        Some(kind) => one(command, &output, kind),
    }
}

/// The paper's scenario under every rule, and what else three robots do.
fn all(output: &Output, renew: bool) -> Result<Vec<String>, Failure> {
    let mut broken = Vec::new();
    let (fast, slow) = (Fleet::new(EMITTED, Pace::FAST)?, Fleet::new(EMITTED, Pace::SLOW)?);
    for rule in RULES {
        broken.extend(output.show(&fast.run(&Scenario::paper(), rule.into(), None)?)?);
    }
    for scenario in [Scenario::leader(), Scenario::formation()] {
        broken.extend(output.show(&slow.run(&scenario, Rule::LineOfCentres, None)?)?);
    }
    if renew {
        let run = fast.run(&Scenario::paper(), RuleName::Tangent.into(), None)?;
        std::fs::write(output.package.join("robots.svg"), picture(&run).into_string())?;
    }
    Ok(broken)
}

fn one(command: &Command, output: &Output, kind: Kind) -> Result<Vec<String>, Failure> {
    let fleet = Fleet::new(command.robots.unwrap_or(EMITTED), command.pace())?;
    let scenario = command.scenario(kind, &fleet.space)?;
    if let Some(fault) = command.fault {
        check_fault(fault, &scenario)?;
    }
    let broken = output.show(&fleet.run(&scenario, command.rule(), command.fault)?)?;
    Ok(broken)
}

fn check_fault(fault: Fault, scenario: &Scenario) -> Result<(), Failure> {
    let robots = scenario.robots();
    if fault.robot >= robots {
        return Err(format!("there is no robot {} to fail: there are {robots}", fault.robot + 1).into());
    }
    if fault.from >= scenario.steps {
        return Err(format!("the run ends after {} steps, before step {}", scenario.steps, fault.from).into());
    }
    Ok(())
}

fn campaign(seeds: u64, pace: Pace) -> Result<Vec<String>, Failure> {
    let (mut rows, mut broken) = (Vec::new(), Vec::new());
    for robots in NUMBERS {
        let fleet = Fleet::new(robots, pace)?;
        for rule in RULES.map(Rule::from) {
            let tally = Tally::of(&fleet, robots, seeds, rule)?;
            let wrong = tally.collisions + tally.unguaranteed + tally.left + tally.strayed;
            broken.extend((wrong > 0).then(|| format!("{robots} robots, {}: {tally:?}", rule.name())));
            rows.push(tally.cells(robots, rule));
        }
    }
    say!("{}", table(&Tally::head(), &rows));
    Ok(broken)
}

/// Where files go.
struct Output {
    package: PathBuf,
    folder: PathBuf,
}

impl Output {
    fn new(package: &Path) -> Result<Self, Failure> {
        let folder = package.join("out");
        std::fs::create_dir_all(&folder)?;
        Ok(Self { package: package.to_owned(), folder })
    }

    /// Says what came of a run and draws it; the promises that it broke.
    fn show(&self, run: &Run) -> Result<Vec<String>, Failure> {
        let name = run.name();
        say!("{name}\n  {}", verdict(run));
        let file =
            name.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect::<Vec<_>>().join("_");
        std::fs::write(self.folder.join(format!("{file}.html")), page(run)?)?;
        std::fs::write(self.folder.join(format!("{file}.svg")), picture(run).into_string())?;
        say!("  Page: {}\n", self.folder.join(format!("{file}.html")).display());
        Ok(broken_promises(&name, run))
    }
}

fn broken_promises(name: &str, run: &Run) -> Vec<String> {
    let closest = run.smallest_distance();
    let touched = (closest < DIAMETER).then(|| format!("{name}: two robots were {closest:.2} cm apart"));
    let unsure = run.fault.is_none().then(|| run.unguaranteed()).filter(|steps| *steps > 0);
    let unsure = unsure.map(|steps| format!("{name}: {steps} steps without the guarantee"));
    let strayed = (run.strayed > 0).then(|| format!("{name}: {} times further off than declared", run.strayed));
    let left = (run.left > 0).then(|| format!("{name}: robots left the floor at {} steps", run.left));
    touched.into_iter().chain(unsure).chain(left).chain(strayed).collect()
}
