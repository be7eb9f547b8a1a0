//! Runs the emitted controllers under the benchmark's loads, checks what they promise at every step, and draws it.
//!
//! `cargo run --release -p power-network` writes pictures and trajectories to `examples/power_network/out`; with
//! `-- --picture` it also renews the picture beside the README. `-- --shares` prints how much of the loads can be designed
//! for; `-- --designs` writes the TOML files anew.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use example_kit::checks::Checks;
use example_kit::say;
use power_network::areas::AREAS;
use power_network::figure::closed_loop;
use power_network::files::{Design, Plant};
use power_network::model::Model;
use power_network::report::{Entry, Outcome, counts, margins, outcomes};
use power_network::runs::{Failure, Run, from_rest, guaranteed, promise, random};
use power_network::scenario::Scenario;
use power_network::shares::shares;

const SEEDS: u64 = 25;
const STEPS: usize = 600;
/// Steps between upsets.
const BETWEEN: usize = 40;
/// |domega| over the last 10 s of a run above which frequencies are not back at zero, rad/s.
const AT_REST: f64 = 1e-6;

const USAGE: &str = "usage: power-network [--picture | --shares | --designs]";

fn main() -> ExitCode {
    example_kit::conclude(run())
}

/// What was asked for; which promises were broken where the design makes them.
fn run() -> Result<Vec<String>, Failure> {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => all_runs(package, None),
        ["--picture"] => all_runs(package, Some(package.join("power_network.svg"))),
        ["--shares"] => {
            say!("{}", shares());
            Ok(Vec::new())
        }
        ["--designs"] => write_designs(package),
        _ => Err(USAGE.into()),
    }
}

fn write_designs(package: &Path) -> Result<Vec<String>, Failure> {
    for design in Design::ALL {
        std::fs::write(package.join(design.path()), design.text())?;
        say!("Written: {}", design.path());
    }
    Ok(Vec::new())
}

fn all_runs(package: &Path, picture: Option<PathBuf>) -> Result<Vec<String>, Failure> {
    let mut session = Session::new(package.join("out"))?;
    let exact = Model::exact();
    let [measured, unknown, exact_measured, exact_unknown] = Design::ALL;
    session.benchmark("a1", measured, None)?;
    session.benchmark("a2", unknown, None)?;
    session.benchmark("a3", exact_measured, None)?;
    session.benchmark("a4", exact_unknown, None)?;
    session.seeded("b1", measured)?;
    session.seeded("b2", unknown)?;
    session.seeded("b3", exact_measured)?;
    session.seeded("b4", exact_unknown)?;
    session.benchmark("c1", measured, Some(&exact))?;
    session.benchmark("c2", unknown, Some(&exact))?;
    if let Some(picture) = picture {
        std::fs::copy(session.out.join("a3.svg"), picture)?;
    }
    session.print();
    say!("{}", shares());
    say!(
        "Designs and guarantees: a and b are on the plant that the design is for; c is not, and only its numbers speak."
    );
    say!("Pictures and trajectories: {}", session.out.display());
    Ok(session.broken_promises())
}

/// The runs so far.
struct Session {
    out: PathBuf,
    entries: Vec<Entry>,
}

impl Session {
    fn new(out: PathBuf) -> Result<Self, Failure> {
        std::fs::create_dir_all(&out)?;
        Ok(Self { out, entries: Vec::new() })
    }

    /// The benchmark's loads, on the plant that the design is for, or on another one.
    fn benchmark(&mut self, key: &'static str, design: Design, other: Option<&Model>) -> Result<(), Failure> {
        let plant = other.cloned().unwrap_or_else(|| guaranteed(design));
        let run = from_rest(design, &plant, &Scenario::benchmark())?;
        let on = if other.is_some() { ", run on the exact plant" } else { "" };
        let name = format!("design {design}{on}");
        self.write(key, &name, &run)?;
        let outcome = Some(Outcome::of(&run));
        let guaranteed = other.is_none() || design.plant == Plant::Exact;
        self.entries.push(Entry { key, name, guaranteed, checks: run.checks, outside: run.outside, outcome });
        Ok(())
    }

    /// Many random runs, and the picture of the first.
    fn seeded(&mut self, key: &'static str, design: Design) -> Result<(), Failure> {
        let (plant, mut checks) = (guaranteed(design), Checks::new(&promise(design)?));
        let mut outside = 0;
        let name = format!("the same, random loads, upsets every {BETWEEN} s, {SEEDS} seeds");
        for seed in 0..SEEDS {
            let run = random(design, &plant, seed, STEPS, BETWEEN)?;
            if run.checks.violations() > 0 {
                eprintln!("{key}: {} violations with seed {seed}", run.checks.violations());
            }
            if seed == 0 {
                self.write(key, &name, &run)?;
            }
            checks.absorb(&run.checks);
            outside += run.outside;
        }
        self.entries.push(Entry { key, name, guaranteed: true, checks, outside, outcome: None });
        Ok(())
    }

    fn write(&self, key: &str, name: &str, run: &Run) -> Result<(), Failure> {
        let title = format!("Four areas, {name}");
        std::fs::write(self.out.join(format!("{key}.svg")), closed_loop(&title, run).to_svg()?)?;
        let columns: Vec<String> = (1..=AREAS)
            .flat_map(|i| {
                let of_area = |name: &str| format!("{name}_{i}");
                ["dtheta_rad", "domega_rad_s", "dPm_pu", "dPv_pu", "dPref_pu", "dPL_pu", "dtheta_ref_rad"].map(of_area)
            })
            .collect();
        let csv = run.trajectory.to_csv(&columns, |step, sample| {
            let areas = sample.nodes.iter().zip(run.loads[step]);
            let of_area = |(node, load): (&example_kit::trajectory::NodeSample, f64)| {
                node.x.iter().copied().chain([node.u[0], load, node.y_ref[0]]).collect::<Vec<_>>()
            };
            areas.flat_map(of_area).collect()
        });
        std::fs::write(self.out.join(format!("{key}.csv")), csv)?;
        Ok(())
    }

    fn print(&self) {
        say!("Closed loop, 1 s per step; steps of all four areas counted:\n\n{}", counts(&self.entries));
        say!("{}", margins(&self.entries));
        say!("{}", outcomes(&self.entries));
        say!("eta of the benchmark's centralised predictive controller, on the exact plant: 0.0249; phi 0.0030.");
        say!("With unknown loads the angles rest off their set-points, and the frequencies at zero all the same.\n");
    }

    fn broken_promises(&self) -> Vec<String> {
        let promised = self.entries.iter().filter(|entry| entry.guaranteed);
        let violated = promised.filter(|entry| entry.checks.violations() > 0);
        let violated = violated.map(|entry| format!("{}: {} violations", entry.key, entry.checks.violations()));
        let moving = self.entries.iter().filter_map(|entry| {
            let left = entry.outcome?.frequency_left;
            (left > AT_REST).then(|| format!("{}: frequencies are {left:.1e} rad/s off at the end", entry.key))
        });
        violated.chain(moving).collect()
    }
}
