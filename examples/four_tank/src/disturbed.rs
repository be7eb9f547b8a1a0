//! The design that knows of disturbances, measurement errors and loads, under the worst of all.

use dpc_runtime::{Input, Step};

use crate::bus::{Datagram, decode};
use crate::checks::Checks;
use crate::closed_loop::ClosedLoop;
use crate::disturbed_controllers::{left, right};
use crate::inflow::Inflow;
use crate::node::{Node, NotReceived, Process};
use crate::nuisance::{Adversary, Nuisance};
use crate::plant::LinearTanks;
use crate::random::Random;
use crate::runs::{Failure, Run, Started};
use crate::scenario::{Scenario, output_ranges};
use crate::sets::Promise;
use crate::trajectory::Trajectory;
use crate::upset::admitted_state;

/// How much of what the design knows acts, and from where the tanks start.
#[derive(Debug, Clone, Copy)]
pub struct Weather {
    /// Disturbances and measurement errors at this multiple of their bounds.
    pub excess: f64,
    /// Loads change until this step, and rest from then on.
    pub loads_until: usize,
    /// Whether the tanks start where the design admits it by what is measured of them, one time in four at the edge, instead of
    /// at rest.
    pub upset: bool,
    /// At this step h4 is pushed further than the design admits.
    pub breach: Option<usize>,
}

/// How far, in cm: more than the tube and the terminal set hold, less than what the tank does.
const BREACH: f64 = 1.5;

/// On the linear plant, with random set-points inside and outside Y.
///
/// # Errors
/// The controllers refuse to start, or a message got lost.
pub fn run(promise: &Promise, seed: u64, steps: usize, weather: Weather) -> Result<Run, Failure> {
    let mut random = Random::new(seed);
    let ranges = output_ranges(promise);
    let scenario = Scenario::random(&mut random, ranges, steps);
    let rest = ranges.map(|[low, high]| random.between(low, high));
    follow(promise, rest, &scenario, weather, &mut random)
}

/// From rest at zero outputs through `scenario`.
///
/// # Errors
/// As [`run`].
pub fn from_rest(promise: &Promise, seed: u64, scenario: &Scenario, weather: Weather) -> Result<Run, Failure> {
    follow(promise, [0.0; 2], scenario, weather, &mut Random::new(seed))
}

fn follow(
    promise: &Promise,
    rest: [f64; 2],
    scenario: &Scenario,
    weather: Weather,
    random: &mut Random,
) -> Result<Run, Failure> {
    let mut inflow = Inflow::new(&promise.subsystems[0], random);
    let loads = [inflow.d[0], inflow.d[1]];
    let mut tanks = ClosedLoop::new(&LinearTanks, promise, start(rest, loads)?, rest_levels(rest, loads));
    let mut adversaries = [0, 1].map(|i| Adversary::new(&promise.subsystems[i], weather.excess));
    let mut run = Run { trajectory: Trajectory::default(), checks: Checks::new(promise) };
    for step in 0..scenario.steps {
        let last = run.trajectory.samples.last();
        let mut acting: [Nuisance; 2] =
            [0, 1].map(|i| adversaries[i].choose(last.map(|sample| &sample.nodes[i]), random));
        if step == 0 && weather.upset {
            upset(&mut tanks, &acting, random);
        }
        if weather.breach == Some(step) {
            tanks.push(1, [0.0, BREACH]);
        }
        if step < weather.loads_until {
            inflow.advance(random);
        }
        tanks.measure(0, &inflow.d);
        let push = promise.subsystems[0].push(&inflow.d);
        acting[0].w = [0, 1].map(|k| acting[0].w[k] + push[k]);
        let sample = tanks.step_under(scenario.set_points(step), acting)?;
        run.checks.look(sample.views());
        run.trajectory.samples.push(sample);
    }
    Ok(run)
}

fn upset(tanks: &mut ClosedLoop, acting: &[Nuisance; 2], random: &mut Random) {
    let share = if random.integer(0, 3) == 0 { 1.0 } else { random.between(0.0, 1.0) };
    for (i, nuisance) in acting.iter().enumerate() {
        tanks.upset(i, |node| {
            let measured = admitted_state(node, random, share);
            [0, 1].map(|k| measured[k] - nuisance.v[k])
        });
    }
}

/// Levels at which the outputs rest at `y` under the loads `d`.
fn rest_levels(y: [f64; 2], d: [f64; 2]) -> [f64; 4] {
    let [[a, b], [c, e]] = [left::steady_state(&y, &d).x, right::steady_state(&y, &d).x];
    [a, b, c, e]
}

fn start(y: [f64; 2], d: [f64; 2]) -> Result<[Started; 2], Failure> {
    let (controller, loads, to_right) = left::start(&left::steady_state(&y, &d), &d)?;
    let (second, to_left) = right::start(&right::steady_state(&y, &d))?;
    let first = Left { controller, inbox: left::Inbox::new(), loads, now: None };
    Ok([(Box::new(first), to_right), (Box::new(Process::new(second, right::FROM_LEFT)), to_left)])
}

/// The node that has loads.
struct Left {
    controller: left::Controller,
    inbox: left::Inbox,
    loads: left::Loads,
    /// Of this step, once measured.
    now: Option<left::Load>,
}

impl Node for Left {
    fn receive(&mut self, datagram: &Datagram) -> Result<(), NotReceived> {
        let message = decode(&datagram.bytes).map_err(NotReceived::WrongLength)?;
        self.inbox.accept(&left::FROM_RIGHT, &message).map_err(NotReceived::Refused)
    }

    fn measure(&mut self, loads: &[f64]) {
        let load = self.loads.admit(&std::array::from_fn(|k| loads[k]));
        assert!(load.within, "loads keep their rates: {loads:?}");
        self.now = Some(load);
    }

    fn probe(&mut self, x: &[f64; 2]) -> Input<2, 1, 1> {
        self.controller.input(x)
    }

    fn step(&mut self, x: &[f64; 2], set_point: f64) -> Step<2, 1, 1, 1, 1> {
        match self.now.take() {
            Some(load) => self.controller.step_under(x, &[set_point], &load, &mut self.inbox),
            None => self.controller.step(x, &[set_point], &mut self.inbox),
        }
    }
}
