//! The runs that the program and the tests make.

use example_kit::checks::{Checks, View};
use example_kit::random::Random;
use example_kit::sets::Promise;
use example_kit::trajectory::{Sample, Trajectory};

use crate::areas::{AREAS, NX, SAMPLE_TIME};
use crate::closed_loop::ClosedLoop;
use crate::files::{Design, Known, Plant};
use crate::model::Model;
use crate::node::Node;
use crate::scenario::Scenario;

/// Why a run could not be made.
pub type Failure = Box<dyn std::error::Error + Send + Sync>;

/// What happened in a run, and what the checks say of it.
#[derive(Debug, Clone)]
pub struct Run {
    pub trajectory: Trajectory,
    pub checks: Checks,
    /// Loads of each step.
    pub loads: Vec<[f64; AREAS]>,
    /// Steps of an area at which the load was not what the design assumes.
    pub outside: usize,
}

/// What the design promises.
///
/// # Errors
/// What is wrong with its `design.json`.
pub fn promise(design: Design) -> Result<Promise, Failure> {
    let json = match (design.plant, design.loads) {
        (Plant::Held, Known::Measured) => include_str!(concat!(env!("OUT_DIR"), "/power_network/design.json")),
        (Plant::Held, Known::Unknown) => include_str!(concat!(env!("OUT_DIR"), "/power_network_unknown/design.json")),
        (_, Known::Measured) => include_str!(concat!(env!("OUT_DIR"), "/power_network_exact/design.json")),
        (_, Known::Unknown) => {
            include_str!(concat!(env!("OUT_DIR"), "/power_network_exact_unknown/design.json"))
        }
    };
    Ok(Promise::new(json)?)
}

/// The plant that the design's guarantee is for.
pub fn guaranteed(design: Design) -> Model {
    match design.plant {
        Plant::Held => design.model(),
        Plant::Exact | Plant::ExactByAngles => Model::exact(),
    }
}

/// From rest through `scenario` on `plant`.
///
/// # Errors
/// The controllers refuse to start, or a message got lost.
pub fn from_rest(design: Design, plant: &Model, scenario: &Scenario) -> Result<Run, Failure> {
    follow(design, plant, scenario, |_, _| {})
}

/// The same with random loads and set-points; every `between` steps all areas are put in a random direction from their
/// references, a random share of the way to the edge of what is feasible for the i-DPC problem, or, one time in four, onto it.
///
/// # Errors
/// As [`from_rest`].
pub fn random(design: Design, plant: &Model, seed: u64, steps: usize, between: usize) -> Result<Run, Failure> {
    let mut random = Random::new(seed);
    let scenario = Scenario::random(&mut random, &promise(design)?.output_ranges(), steps);
    follow(design, plant, &scenario, |step, network| {
        if step.is_multiple_of(between) {
            (0..AREAS).for_each(|i| network.upset(i, |node| upset(node, &mut random)));
        }
    })
}

fn follow(
    design: Design,
    plant: &Model,
    scenario: &Scenario,
    mut before: impl FnMut(usize, &mut ClosedLoop),
) -> Result<Run, Failure> {
    let promise = promise(design)?;
    let mut network = ClosedLoop::at_rest(design, plant, &promise)?;
    let (mut checks, mut trajectory) = (Checks::new(&promise), Trajectory::new(SAMPLE_TIME));
    let loads: Vec<_> = (0..scenario.steps).map(|step| scenario.loads(step)).collect();
    for (step, loads) in loads.iter().enumerate() {
        before(step, &mut network);
        let sample: Sample = network.step(loads, &scenario.set_points(step))?;
        checks.look(sample.nodes.iter().map(View::from));
        trajectory.samples.push(sample);
    }
    Ok(Run { trajectory, checks, loads, outside: network.outside })
}

/// Halvings of the interval in which the edge of what is feasible lies: to 1e-12 of the deviation.
const HALVINGS: usize = 40;

/// A state of the node's area in a random direction from its reference.
fn upset(node: &mut dyn Node, random: &mut Random) -> [f64; NX] {
    let centre = node.probe(&[0.0; NX]).telemetry.x_ref;
    let direction: [f64; NX] = random.direction();
    // In steps of each state's own size: radians are small numbers.
    let size = [0.01, 0.01, 0.3, 0.3];
    let at = |distance: f64| -> [f64; NX] { std::array::from_fn(|k| centre[k] + distance * size[k] * direction[k]) };
    let share = if random.integer(0, 3) == 0 { 1.0 } else { random.between(0.0, 1.0) };
    at(share * edge(|distance| node.probe(&at(distance)).control.is_admissible()))
}

/// The largest distance that is admitted; 0 is, unless the state has left the reference's tube, and what lies between admitted
/// distances is too.
fn edge(mut admitted: impl FnMut(f64) -> bool) -> f64 {
    let mut outside = 1e-3;
    while admitted(outside) {
        outside *= 2.0;
    }
    let mut inside = 0.0;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (inside + outside);
        if admitted(middle) { inside = middle } else { outside = middle }
    }
    inside
}
