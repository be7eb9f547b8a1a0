//! Plant, controllers and bus, one sampling period after the other.

use example_kit::bus::{Bus, Datagram, NotReceived};
use example_kit::checks::{Checks, View};
use example_kit::random::Random;
use example_kit::sets::Promise;
use example_kit::trajectory::{NodeSample, Sample, Trajectory};

use crate::chain::{SAMPLE_TIME, advance, neighbours};
use crate::node::{Node, Started};
use crate::pattern::Patterns;

/// The chain under control.
struct ClosedLoop<'a> {
    promise: &'a Promise,
    nodes: Vec<Box<dyn Node + 'a>>,
    bus: Bus,
    x: Vec<[f64; 2]>,
}

/// What happened in a run, and what the checks say of it.
#[derive(Debug, Clone)]
pub struct Run {
    pub trajectory: Trajectory,
    pub checks: Checks,
}

/// From rest at q = 0 through `patterns`.
///
/// # Errors
/// A message got lost in the bus.
pub fn from_rest(started: Vec<Started<'_>>, promise: &Promise, patterns: &Patterns) -> Result<Run, NotReceived> {
    follow(started, promise, patterns, |_, _| {})
}

/// The same; every `between` steps all masses are put in a random direction from their references, a random share of the way to
/// the edge of what is feasible for the i-DPC problem, or, one time in four, onto it.
///
/// # Errors
/// As [`from_rest`].
pub fn upset(
    started: Vec<Started<'_>>,
    promise: &Promise,
    patterns: &Patterns,
    between: usize,
    seed: u64,
) -> Result<Run, NotReceived> {
    let mut random = Random::new(seed);
    follow(started, promise, patterns, |step, chain| {
        if step.is_multiple_of(between) {
            for (node, x) in chain.nodes.iter_mut().zip(&mut chain.x) {
                *x = admitted_state(node.as_mut(), &mut random);
            }
        }
    })
}

fn follow<'a>(
    started: Vec<Started<'a>>,
    promise: &'a Promise,
    patterns: &Patterns,
    mut before: impl FnMut(usize, &mut ClosedLoop),
) -> Result<Run, NotReceived> {
    let mut chain = ClosedLoop::new(started, promise);
    let mut run = Run { trajectory: Trajectory::new(SAMPLE_TIME), checks: Checks::new(promise) };
    for step in 0..patterns.steps() {
        before(step, &mut chain);
        let sample = chain.step(patterns.set_points(step))?;
        run.checks.look(sample.nodes.iter().map(View::from));
        run.trajectory.samples.push(sample);
    }
    Ok(run)
}

impl<'a> ClosedLoop<'a> {
    fn new(started: Vec<Started<'a>>, promise: &'a Promise) -> Self {
        let x = vec![[0.0; 2]; started.len()];
        let mut chain = Self { promise, nodes: Vec::new(), bus: Bus::default(), x };
        for (i, (node, message)) in started.into_iter().enumerate() {
            chain.nodes.push(node);
            chain.send(i, &message);
        }
        chain
    }

    fn step(&mut self, set_points: &[f64]) -> Result<Sample, NotReceived> {
        for (i, node) in self.nodes.iter_mut().enumerate() {
            self.bus.receive(i).try_for_each(|datagram| node.receive(&datagram))?;
        }
        let nodes: Vec<_> = (0..self.nodes.len()).map(|i| self.step_mass(i, set_points[i])).collect();
        let u: Vec<f64> = nodes.iter().map(|node| node.u[0]).collect();
        self.x = advance(&self.x, &u);
        Ok(Sample { nodes })
    }

    fn step_mass(&mut self, i: usize, set_point: f64) -> NodeSample {
        let x = self.x[i];
        let answer = self.nodes[i].step(&x, set_point);
        self.send(i, &answer.message);
        let told = &answer.telemetry;
        NodeSample {
            x: x.to_vec(),
            u: vec![answer.input],
            set_point: vec![set_point],
            y_ref: told.y_ref.to_vec(),
            x_nom: told.x_nom.to_vec(),
            z_ref: self.promise.subsystems[i].coupling_output(&told.x_ref, &told.u_ref),
            control: answer.control,
            unguaranteed: answer.unguaranteed,
        }
    }

    fn send(&mut self, from: usize, bytes: &[u8]) {
        let length = self.nodes.len().max(self.x.len());
        neighbours(from, length).for_each(|to| self.bus.pass(Datagram { from, to, bytes: bytes.to_vec() }));
    }
}

/// Halvings of the interval in which the edge of what is feasible lies: to 1e-12 of the deviation.
const HALVINGS: usize = 40;

fn admitted_state(node: &mut dyn Node, random: &mut Random) -> [f64; 2] {
    let centre = node.probe(&[0.0; 2]).telemetry.x_ref;
    let direction: [f64; 2] = random.direction();
    let at = |distance: f64| [0, 1].map(|k| centre[k] + distance * direction[k]);
    let share = if random.integer(0, 3) == 0 { 1.0 } else { random.between(0.0, 1.0) };
    at(share * edge(|distance| node.probe(&at(distance)).control.is_admissible()))
}

/// The largest distance that is admitted; what lies between admitted distances is too.
fn edge(mut admitted: impl FnMut(f64) -> bool) -> f64 {
    let mut outside = 1e-4;
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
