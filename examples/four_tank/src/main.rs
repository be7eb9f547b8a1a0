//! Runs the emitted controllers on the four-tank, checks what they promise at every step, and draws it.
//!
//! `cargo run --release -p four-tank` writes pictures and trajectories to `examples/four_tank/out`; with `-- --picture`
//! it also renews the picture beside the README.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use example_kit::say;
use four_tank::checks::Checks;
use four_tank::figure::closed_loop;
use four_tank::plant::{LinearTanks, NonlinearTanks, Plant, SAMPLE_TIME};
use four_tank::report::{End, Entry, counts, ends, margins};
use four_tank::runs::{Failure, Run, from_rest, planned, random};
use four_tank::scenario::Scenario;
use four_tank::sets::Promise;
use four_tank::{DESIGN_JSON, STARTED_DESIGN_JSON, SUMMARY};

const SEEDS: u64 = 100;
const STEPS: usize = 1000;
/// Sampling periods between upsets.
const BETWEEN: usize = 50;
/// Runge-Kutta steps per sampling period.
const SUBSTEPS: u32 = 10;
/// Distance at the end of run a2 from the nearest admissible set-point above which it has not come to rest, cm.
const CONVERGED: f64 = 1e-6;

fn main() -> ExitCode {
    example_kit::conclude(run())
}

/// All runs and all output; which promises were broken where the design makes them, on the linear plant.
fn run() -> Result<Vec<String>, Failure> {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let picture = wants_picture(std::env::args().skip(1))?.then(|| package.join("four_tank.svg"));
    say!("{SUMMARY}");
    let mut session = Session::new(package.join("out"))?;
    let nonlinear = NonlinearTanks::new(SUBSTEPS);
    let (nominal, clipping) = (Scenario::nominal(), Scenario::clipping());
    let first = session.single("a1", "linear plant, nominal set-points", &LinearTanks, &nominal)?;
    session.single("a2", "linear plant, y1 = 9 cm asked for", &LinearTanks, &clipping)?;
    session.single("a3", "linear plant, y1 = 2.5 cm asked for", &LinearTanks, &Scenario::held())?;
    session.seeded("b1", "linear plant, deviations at the start", None)?;
    session.seeded("b2", "linear plant, deviations every 25 s", Some(BETWEEN))?;
    session.started("d1", "linear plant, left tanks empty, right ones full at the start")?;
    session.single("c1", "nonlinear plant, nominal set-points", &nonlinear, &nominal)?;
    session.single("c2", "nonlinear plant, y1 = 9 cm asked for", &nonlinear, &clipping)?;
    if let Some(picture) = picture {
        std::fs::write(picture, first)?;
    }
    session.print(&nonlinear);
    Ok(session.broken_promises())
}

/// # Errors
/// An argument that is not `--picture`.
fn wants_picture(mut arguments: impl Iterator<Item = String>) -> Result<bool, Failure> {
    let first = arguments.next();
    match (first.as_deref(), arguments.next()) {
        (None, _) => Ok(false),
        (Some("--picture"), None) => Ok(true),
        _ => Err("usage: four-tank [--picture]; --picture renews examples/four_tank/four_tank.svg".into()),
    }
}

/// The runs so far.
struct Session {
    promise: Promise,
    out: PathBuf,
    entries: Vec<Entry>,
}

impl Session {
    fn new(out: PathBuf) -> Result<Self, Failure> {
        std::fs::create_dir_all(&out)?;
        Ok(Self { promise: Promise::new(DESIGN_JSON)?, out, entries: Vec::new() })
    }

    /// One run from rest, and its picture.
    fn single(
        &mut self,
        key: &'static str,
        name: &str,
        plant: &dyn Plant,
        scenario: &Scenario,
    ) -> Result<String, Failure> {
        let run = from_rest(plant, &self.promise, scenario)?;
        let ends = End::of(&run, &self.promise);
        let picture = self.write(key, name, &run)?;
        self.entries.push(Entry { key, name: name.to_owned(), checks: run.checks, ends });
        Ok(picture)
    }

    /// The run from the start of `designs/started.toml`, and its picture.
    fn started(&mut self, key: &'static str, name: &str) -> Result<(), Failure> {
        let promise = Promise::new(STARTED_DESIGN_JSON)?;
        let run = planned(&promise, &Scenario::nominal())?;
        self.write(key, name, &run)?;
        let ends = End::of(&run, &promise);
        self.entries.push(Entry { key, name: name.to_owned(), checks: run.checks, ends });
        Ok(())
    }

    /// Many random runs, and the picture of the first.
    fn seeded(&mut self, key: &'static str, name: &str, between: Option<usize>) -> Result<(), Failure> {
        let mut checks = Checks::new(&self.promise);
        for seed in 0..SEEDS {
            let run = random(&self.promise, seed, STEPS, between)?;
            if run.checks.violations() > 0 {
                eprintln!("{key}: {} violations with seed {seed}", run.checks.violations());
            }
            if seed == 0 {
                self.write(key, &format!("{name}, seed 0"), &run)?;
            }
            checks.absorb(&run.checks);
        }
        self.entries.push(Entry { key, name: format!("{name}, {SEEDS} seeds"), checks, ends: None });
        Ok(())
    }

    fn write(&self, key: &str, name: &str, run: &Run) -> Result<String, Failure> {
        let title = format!("Four-tank, {name}: deviations from the working point");
        let picture = closed_loop(&title, &run.trajectory, &self.promise).to_svg()?;
        std::fs::write(self.out.join(format!("{key}.svg")), &picture)?;
        std::fs::write(self.out.join(format!("{key}.csv")), run.trajectory.to_csv())?;
        Ok(picture)
    }

    fn print(&self, nonlinear: &NonlinearTanks) {
        say!("Closed loop, {SAMPLE_TIME} s per step; steps of both subsystems counted:\n\n{}", counts(&self.entries));
        say!("{}", margins(&self.entries));
        say!("{}", ends(&self.entries));
        let centre = nonlinear.centre().map(|level| format!("{level:.2}")).join(", ");
        say!("Deviations of the nonlinear plant are from its own rest at 3 V: h1 to h4 = {centre} cm.");
        say!("The guarantee is for the linear plant (a, b, d); what c shows is the model's error.");
        say!("Pictures and trajectories: {}", self.out.display());
    }

    fn broken_promises(&self) -> Vec<String> {
        let linear = self.entries.iter().filter(|entry| !entry.key.starts_with('c'));
        let violated = linear.filter(|entry| entry.checks.violations() > 0);
        let mut broken: Vec<_> =
            violated.map(|entry| format!("{}: {} violations", entry.key, entry.checks.violations())).collect();
        let clipped =
            self.entries.iter().filter(|entry| entry.key == "a2").flat_map(|entry| entry.ends.iter().flatten());
        broken.extend(
            clipped.filter(|end| end.error() > CONVERGED).map(|end| format!("a2: {} cm off at the end", end.error())),
        );
        broken
    }
}
