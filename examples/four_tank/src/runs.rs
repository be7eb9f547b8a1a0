//! The runs that the program and the tests make.

use dpc_runtime::Message;

use crate::checks::Checks;
use crate::closed_loop::ClosedLoop;
use crate::controllers::{left, right};
use crate::node::{Node, Process};
use crate::plant::{Levels, LinearTanks, Plant};
use crate::random::Random;
use crate::scenario::{Scenario, output_ranges};
use crate::sets::Promise;
use crate::started_controllers as started;
use crate::trajectory::Trajectory;
use crate::upset::admitted_state;

/// Why a run could not be made.
pub type Failure = Box<dyn std::error::Error + Send + Sync>;

/// What happened in a run, and what the checks say of it.
#[derive(Debug, Clone)]
pub struct Run {
    pub trajectory: Trajectory,
    pub checks: Checks,
}

/// From rest at zero deviation through `scenario`.
///
/// # Errors
/// The controllers refuse to start, or a message got lost.
pub fn from_rest(plant: &dyn Plant, promise: &Promise, scenario: &Scenario) -> Result<Run, Failure> {
    follow(at_rest(plant, promise)?, promise, scenario, |_, _| {})
}

/// The start-up plan of one side, as emitted files and the compiler's library give it.
pub type Plan = started::left::StartPlan<'static>;

/// From the start that `designs/started.toml` states, by its start-up plan, through `scenario`; `promise` is that design's.
///
/// # Errors
/// As [`from_rest`].
pub fn planned(promise: &Promise, scenario: &Scenario) -> Result<Run, Failure> {
    let ([h1, h2], [h3, h4]) = (started::left::START_X, started::right::START_X);
    planned_from(promise, [&started::left::START, &started::right::START], [h1, h2, h3, h4], scenario)
}

/// From any levels, by the plans for them, which may be of any time.
///
/// # Errors
/// As [`from_rest`]: among others, the levels do not fit the plans.
pub fn planned_from(
    promise: &Promise,
    plans: [&'static Plan; 2],
    levels: Levels,
    scenario: &Scenario,
) -> Result<Run, Failure> {
    let [h1, h2, h3, h4] = levels;
    let (first, to_right) = started::left::start_planned(plans[0], &[h1, h2])?;
    let (second, to_left) = started::right::start_planned(plans[1], &[h3, h4])?;
    let first = Process::new(first, started::left::FROM_RIGHT);
    let second = Process::new(second, started::right::FROM_LEFT);
    let nodes: [Started; 2] = [(Box::new(first), to_right), (Box::new(second), to_left)];
    follow(ClosedLoop::new(&LinearTanks, promise, nodes, levels), promise, scenario, |_, _| {})
}

/// Tanks and controllers at rest at zero deviation.
///
/// # Errors
/// The controllers refuse to start.
pub fn at_rest<'a>(plant: &'a dyn Plant, promise: &'a Promise) -> Result<ClosedLoop<'a>, Failure> {
    Ok(ClosedLoop::new(plant, promise, start([0.0; 2])?, [0.0; 4]))
}

/// On the linear plant, references at rest somewhere in Y, the tanks where the design admits it, random set-points inside
/// and outside Y; where `between` says so, in steps, the tanks are put elsewhere again.
///
/// Tanks are always put in a random direction from the reference: a random share of the way to the edge of what is feasible
/// for the i-DPC problem, or, one time in four, onto the edge.
///
/// # Errors
/// As [`from_rest`].
pub fn random(promise: &Promise, seed: u64, steps: usize, between: Option<usize>) -> Result<Run, Failure> {
    let mut random = Random::new(seed);
    let ranges = output_ranges(promise);
    let scenario = Scenario::random(&mut random, ranges, steps);
    let rest = ranges.map(|[low, high]| random.between(low, high));
    let tanks = ClosedLoop::new(&LinearTanks, promise, start(rest)?, [0.0; 4]);
    follow(tanks, promise, &scenario, |step, tanks| {
        if step == 0 || between.is_some_and(|between| step.is_multiple_of(between)) {
            (0..2).for_each(|i| tanks.upset(i, |node| upset(node, &mut random)));
        }
    })
}

fn upset(node: &mut dyn Node, random: &mut Random) -> [f64; 2] {
    let share = if random.integer(0, 3) == 0 { 1.0 } else { random.between(0.0, 1.0) };
    admitted_state(node, random, share)
}

/// Runs a closed loop through a scenario; `before` may interfere before each step.
fn follow<'a>(
    mut tanks: ClosedLoop<'a>,
    promise: &Promise,
    scenario: &Scenario,
    mut before: impl FnMut(usize, &mut ClosedLoop<'a>),
) -> Result<Run, Failure> {
    let mut run = Run { trajectory: Trajectory::default(), checks: Checks::new(promise) };
    for step in 0..scenario.steps {
        before(step, &mut tanks);
        let sample = tanks.step(scenario.set_points(step))?;
        run.checks.look(sample.views());
        run.trajectory.samples.push(sample);
    }
    Ok(run)
}

/// A controller in its process, and what it sends first.
pub type Started = (Box<dyn Node>, Message<1, 1>);

/// Both controllers with their references at rest at the outputs `y`.
fn start(y: [f64; 2]) -> Result<[Started; 2], Failure> {
    let (first, to_right) = left::start(&left::steady_state(&y))?;
    let (second, to_left) = right::start(&right::steady_state(&y))?;
    let first = Process::new(first, left::FROM_RIGHT);
    let second = Process::new(second, right::FROM_LEFT);
    Ok([(Box::new(first), to_right), (Box::new(second), to_left)])
}
