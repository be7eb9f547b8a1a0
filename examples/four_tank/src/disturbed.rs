//! The design that knows of disturbances and measurement errors, under the worst of both.

use crate::checks::Checks;
use crate::closed_loop::ClosedLoop;
use crate::disturbed_controllers::{left, right};
use crate::node::Process;
use crate::nuisance::{Adversary, Nuisance};
use crate::plant::LinearTanks;
use crate::random::Random;
use crate::runs::{Failure, Run, Started};
use crate::scenario::Scenario;
use crate::sets::Promise;
use crate::trajectory::Trajectory;
use crate::upset::admitted_state;

/// On the linear plant: random set-points inside and outside Y, tanks that start where the design admits it by what is
/// measured of them, one time in four at the edge; from then on disturbances and measurement errors at `excess` times their bounds.
///
/// # Errors
/// The controllers refuse to start, or a message got lost.
pub fn run(promise: &Promise, seed: u64, steps: usize, excess: f64) -> Result<Run, Failure> {
    let mut random = Random::new(seed);
    let ranges = promise.output_ranges();
    let scenario = Scenario::random(&mut random, ranges, steps);
    let rest = ranges.map(|[low, high]| random.between(low, high));
    follow(promise, rest, &scenario, excess, &mut random, true)
}

/// From rest at zero deviation, measured with the worst error, to `scenario`'s set-points.
///
/// # Errors
/// As [`run`].
pub fn from_rest(promise: &Promise, seed: u64, scenario: &Scenario) -> Result<Run, Failure> {
    follow(promise, [0.0; 2], scenario, 1.0, &mut Random::new(seed), false)
}

fn follow(
    promise: &Promise,
    rest: [f64; 2],
    scenario: &Scenario,
    excess: f64,
    random: &mut Random,
    upset: bool,
) -> Result<Run, Failure> {
    let mut tanks = ClosedLoop::new(&LinearTanks, promise, start(rest)?, rest_levels(rest));
    let mut adversaries = [0, 1].map(|i| Adversary::new(&promise.subsystems[i], excess));
    let mut run = Run { trajectory: Trajectory::default(), checks: Checks::new(promise) };
    for step in 0..scenario.steps {
        let last = run.trajectory.samples.last();
        let acting: [Nuisance; 2] = [0, 1].map(|i| adversaries[i].choose(last.map(|sample| &sample.nodes[i]), random));
        if step == 0 && upset {
            let share = if random.integer(0, 3) == 0 { 1.0 } else { random.between(0.0, 1.0) };
            for (i, nuisance) in acting.iter().enumerate() {
                tanks.upset(i, |node| {
                    let measured = admitted_state(node, random, share);
                    [0, 1].map(|k| measured[k] - nuisance.v[k])
                });
            }
        }
        let sample = tanks.step_under(scenario.set_points(step), acting)?;
        run.checks.look(&sample);
        run.trajectory.samples.push(sample);
    }
    Ok(run)
}

/// Levels at which the outputs rest at `y`.
fn rest_levels(y: [f64; 2]) -> [f64; 4] {
    let [[a, b], [c, d]] = [left::steady_state(&y).x, right::steady_state(&y).x];
    [a, b, c, d]
}

fn start(y: [f64; 2]) -> Result<[Started; 2], Failure> {
    let (first, to_right) = left::start(&left::steady_state(&y))?;
    let (second, to_left) = right::start(&right::steady_state(&y))?;
    let first = Process::new(first, left::FROM_RIGHT);
    let second = Process::new(second, right::FROM_LEFT);
    Ok([(Box::new(first), to_right), (Box::new(second), to_left)])
}
