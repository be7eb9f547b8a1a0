//! The closed loop: plant, controllers and messages, one sampling period after the other.

use std::iter::zip;

use nalgebra::DVector;

use super::controllers::{Answer, Controller, Controllers, Given, Sent};
use super::history::History;
use super::plant::Plant;
use super::recorder::{Recorder, Sample};
use super::scenario::{Fate, Jump, Scenario, Start};
use super::separation::separation;
use crate::design::Design;
use crate::emit::hears;
use crate::network::Network;

/// Beyond what the design assumes by more than this, relative to the bound, is beyond it: the rest is rounding.
const ROUNDING: f64 = 1e-9;

/// Runs the controllers of `design` through `scenario`, which was drawn out for it. `progress` hears the number of each step.
///
/// Every step is, in this order: upsets; messages that are due arrive; changing constraints are redrawn; every controller decides
/// from what it measures; messages are sent, due at the next step; the plant moves on. Messages of the start are due at step 0.
///
/// # Errors
/// A controller refuses to start: which, and why.
pub fn run(
    design: &Design,
    scenario: &Scenario,
    controllers: &mut dyn Controllers,
    progress: &mut dyn FnMut(usize),
) -> Result<History, String> {
    let mut network = ClosedLoop::start(design, scenario, controllers)?;
    for step in 0..scenario.steps {
        network.step(step);
        progress(step);
    }
    Ok(network.recorder.history())
}

struct ClosedLoop<'a> {
    design: &'a Design,
    scenario: &'a Scenario,
    model: Plant,
    truth: Option<Plant>,
    nodes: Vec<Box<dyn Controller>>,
    /// Receivers of each subsystem's messages.
    heard_by: Vec<Vec<usize>>,
    bus: Vec<Datagram>,
    /// yref_{t+N-1} of all.
    newest: Vec<Vec<f64>>,
    x: Vec<DVector<f64>>,
    loads_before: Vec<Vec<f64>>,
    recorder: Recorder<'a>,
}

struct Datagram {
    /// The step before which it arrives.
    due: usize,
    from: usize,
    to: usize,
    bytes: Vec<u8>,
}

impl<'a> ClosedLoop<'a> {
    fn start(design: &'a Design, scenario: &'a Scenario, controllers: &mut dyn Controllers) -> Result<Self, String> {
        let network = &design.network;
        let all = 0..network.subsystems.len();
        let mut closed = Self {
            design,
            scenario,
            model: Plant::new(network),
            truth: scenario.plant.as_ref().map(Plant::new),
            nodes: Vec::new(),
            heard_by: heard_by(design),
            bus: Vec::new(),
            newest: Vec::new(),
            x: Vec::new(),
            loads_before: first_loads(&scenario.start),
            recorder: Recorder::new(design, scenario),
        };
        for i in all {
            let started = controllers.start(i, &scenario.start);
            let started = started.map_err(|why| refused(network, i, &scenario.start, &why))?;
            closed.x.push(first_state(&scenario.start, i, started.rest));
            closed.nodes.push(started.controller);
            closed.newest.push(started.message.y_ref);
            for to in closed.heard_by[i].clone() {
                closed.bus.push(Datagram { due: 0, from: i, to, bytes: started.message.bytes.clone() });
            }
        }
        Ok(closed)
    }

    fn step(&mut self, step: usize) {
        self.upset(step);
        self.deliver(step);
        self.redraw();
        let answers: Vec<Answer> = (0..self.nodes.len()).map(|i| self.decide(step, i)).collect();
        for (i, answer) in answers.iter().enumerate() {
            self.send(step, i, &answer.message);
        }
        self.newest = answers.iter().map(|answer| answer.message.y_ref.clone()).collect();
        let sample = Sample { step, x: &self.x, answers: &answers };
        self.recorder.record(&sample);
        self.advance(step, &answers);
    }

    fn upset(&mut self, step: usize) {
        for upset in self.scenario.upsets.iter().filter(|upset| upset.step == step) {
            let x = &mut self.x[upset.subsystem];
            let before = x.clone();
            match &upset.to {
                Jump::By(by) => *x += by,
                Jump::To(to) => x.copy_from(to),
            }
            self.recorder.upset(step, upset.subsystem, &(&*x - before));
        }
    }

    fn deliver(&mut self, step: usize) {
        let due: Vec<Datagram> = self.bus.extract_if(.., |datagram| datagram.due == step).collect();
        for Datagram { from, to, bytes, .. } in due {
            if let Err(why) = self.nodes[to].accept(from, &bytes) {
                self.recorder.refused(step, (from, to), &why);
            }
        }
    }

    /// All members of a constraint draw the same row, from the references they have told each other; one that has not heard a
    /// member refuses the row.
    fn redraw(&mut self) {
        let mut rows = vec![0; self.nodes.len()];
        for (constraint, rule) in zip(&self.design.network.changing_constraints, &self.scenario.rules) {
            let line = separation(self.design, rule, &constraint.members, &self.newest);
            for &i in &constraint.members {
                if let Some(row) = &line {
                    // What becomes of a row that is refused, the status of the step says.
                    let _ = self.nodes[i].redraw(rows[i], row);
                }
                rows[i] += 1;
            }
        }
    }

    fn decide(&mut self, step: usize, i: usize) -> Answer {
        let acting = &self.scenario.subsystems[i];
        let at = |columns: &[Vec<f64>]| columns.iter().map(|column| column[step]).collect::<Vec<f64>>();
        let x = &self.x[i] + &acting.errors[step];
        let (set_point, loads) = (at(&acting.set_points), at(&acting.loads));
        self.nodes[i].step(&Given { x: x.as_slice(), set_point: &set_point, loads: &loads })
    }

    fn send(&mut self, step: usize, from: usize, message: &Sent) {
        for to in self.heard_by[from].clone() {
            let fate = self.scenario.fates.of_message(step, from, to);
            if let Some(fate) = fate {
                self.recorder.trouble(step, (from, to), fate);
            }
            let late = match fate {
                Some(Fate::Lost) => continue,
                Some(Fate::Late(periods)) => periods,
                None => 0,
            };
            self.bus.push(Datagram { due: step + 1 + late, from, to, bytes: message.bytes.clone() });
        }
    }

    /// The plant one period later, and whether all that acted on it is what the design assumes.
    fn advance(&mut self, step: usize, answers: &[Answer]) {
        let u: Vec<Vec<f64>> = answers.iter().map(|answer| answer.input.clone()).collect();
        let acting = &self.scenario.subsystems;
        let of_step = |one: &super::scenario::Acting| one.loads.iter().map(|column| column[step]).collect();
        let d: Vec<Vec<f64>> = acting.iter().map(of_step).collect();
        let by_model = self.model.advance(&self.x, &u, &d);
        let mut next = self.truth.as_ref().map_or_else(|| by_model.clone(), |truth| truth.advance(&self.x, &u, &d));
        for (i, (x, one)) in next.iter_mut().zip(acting).enumerate() {
            *x += &one.disturbances[step];
            let (w, v) = (&*x - &by_model[i], &one.errors[step]);
            let size = x.amax().max(by_model[i].amax());
            if let Some(what) = beyond(self.design, i, &w, v, size) {
                self.recorder.beyond(step, i, what);
            }
            if let Some(load) = load_beyond(self.design, i, &self.loads_before[i], &d[i]) {
                self.recorder.beyond(step, i, format!("load `{load}` left its bounds or rates"));
            }
        }
        self.loads_before = d;
        self.x = next;
    }
}

fn heard_by(design: &Design) -> Vec<Vec<usize>> {
    let mut heard_by = vec![Vec::new(); design.network.subsystems.len()];
    for i in 0..heard_by.len() {
        hears(design, i).into_iter().for_each(|j| heard_by[j].push(i));
    }
    heard_by
}

fn refused(network: &Network, i: usize, start: &Start, why: &str) -> String {
    let help = match start {
        Start::Rest { .. } => "help: choose `outputs` inside Y, which the design's summary shows",
        Start::Planned(_) => "help: the plan was made for this state; measurement errors at step 0 may move it too far",
    };
    format!("error: the controller of `{}` does not start: {why}\n{help}", network.subsystems[i].name)
}

fn first_state(start: &Start, i: usize, rest: Option<DVector<f64>>) -> DVector<f64> {
    match start {
        Start::Planned(start) => start.x0[i].clone(),
        Start::Rest { deviation, .. } => match rest {
            Some(rest) => rest + &deviation[i],
            None => deviation[i].clone(),
        },
    }
}

fn first_loads(start: &Start) -> Vec<Vec<f64>> {
    let loads = match start {
        Start::Planned(start) => &start.d0,
        Start::Rest { loads, .. } => loads,
    };
    loads.iter().map(|d| d.as_slice().to_vec()).collect()
}

/// In what an effective disturbance and a measurement error leave what the design assumes; `size` is that of the numbers that w is a
/// difference of.
fn beyond(design: &Design, i: usize, w: &DVector<f64>, v: &DVector<f64>, size: f64) -> Option<String> {
    let s = &design.network.subsystems[i];
    let allowed = ROUNDING * size;
    let outside = s.w.as_ref().map_or(w.amax(), |set| set.set.violation(w)) > allowed;
    let mistaken = (0..v.len()).find(|k| v[*k].abs() > s.measurement_error[*k] * (1.0 + ROUNDING));
    match (outside, mistaken) {
        (true, _) if s.w.is_none() => Some("a disturbance acts, and the design knows of none".to_owned()),
        (true, _) => Some("the disturbance left W".to_owned()),
        (false, Some(k)) => Some(format!("the measurement error of `{}` left its bound", s.states[k].name)),
        (false, None) => None,
    }
}

/// The name of the first load that is outside of its bounds, or has changed by more than its rate.
fn load_beyond<'a>(design: &'a Design, i: usize, before: &[f64], now: &[f64]) -> Option<&'a str> {
    let loads = &design.network.subsystems[i].loads;
    let outside = |k: &usize| {
        let allowed = ROUNDING * (loads.max[*k] - loads.min[*k]);
        let (low, high) = (loads.min[*k] - allowed, loads.max[*k] + allowed);
        !(low..=high).contains(&now[*k]) || (now[*k] - before[*k]).abs() > loads.rate[*k] + allowed
    };
    (0..now.len()).find(outside).map(|k| &*loads.signals[k].name)
}
