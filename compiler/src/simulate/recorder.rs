//! From samples to a [`History`].

use std::iter::zip;

use nalgebra::{DMatrix, DVector};

use super::controllers::Answer;
use super::history::{Column, CouplingTrack, Event, EventKind, History, Margin, Track};
use super::scenario::{Fate, Rule, Scenario};
use super::words::Words;
use crate::design::Design;
use crate::network::{NamedPolytope, Signal, Subsystem};
use crate::summary::short;

/// A margin below minus this, relative to the limit and at least to 1, is a violation: the rest is rounding.
pub const ROUNDING: f64 = 1e-9;

pub struct Recorder<'a> {
    design: &'a Design,
    scenario: &'a Scenario,
    words: Vec<Words>,
    history: History,
    /// Whether all that has acted so far is what the design assumes.
    assumed: bool,
    /// Per subsystem, the last step at which something was beyond it.
    beyond: Vec<Option<usize>>,
}

/// One step of the network.
pub struct Sample<'a> {
    pub step: usize,
    pub x: &'a [DVector<f64>],
    pub answers: &'a [Answer],
}

impl<'a> Recorder<'a> {
    pub fn new(design: &'a Design, scenario: &'a Scenario) -> Self {
        let network = &design.network;
        let subsystems: Vec<Track> = (0..network.subsystems.len()).map(|i| track(design, scenario, i)).collect();
        let history = History {
            network: network.name.clone(),
            scenario: scenario.name.clone(),
            seed: scenario.seed,
            sample_time: network.sample_time,
            time: Vec::new(),
            subsystems,
            couplings: couplings(design, scenario),
            assumed: Vec::new(),
            events: Vec::new(),
        };
        let words = (0..network.subsystems.len()).map(|i| Words::new(design, i)).collect();
        Self { design, scenario, words, history, assumed: true, beyond: vec![None; network.subsystems.len()] }
    }

    pub fn record(&mut self, sample: &Sample<'_>) {
        let time = self.time(sample.step);
        self.history.time.push(time);
        self.history.assumed.push(self.assumed);
        let outputs: Vec<DVector<f64>> =
            zip(&self.design.network.subsystems, sample.x).map(|(s, x)| &s.C * x).collect();
        for (i, answer) in sample.answers.iter().enumerate() {
            let s = &self.design.network.subsystems[i];
            let track = &mut self.history.subsystems[i];
            push(&mut track.states, sample.x[i].as_slice());
            push(&mut track.outputs, outputs[i].as_slice());
            push(&mut track.inputs, &answer.input);
            push(&mut track.y_ref, &answer.y_ref);
            push(&mut track.x_ref, &answer.x_ref);
            push(&mut track.u_ref, &answer.u_ref);
            push(&mut track.x_nom, &answer.x_nom);
            push(&mut track.u_nom, &answer.u_nom);
            let u = DVector::from_column_slice(&answer.input);
            let left = [&s.X.h - &s.X.H * &sample.x[i], &s.U.h - &s.U.H * &u];
            for (margin, left) in track.margins.iter_mut().zip(left.iter().flat_map(|left| left.iter())) {
                margin.values.push(*left);
            }
            track.words.push(self.words[i].status(&answer.status));
            track.guaranteed.push(answer.status.is_guaranteed());
            track.status.push(answer.status.clone());
        }
        let left = self.left(&outputs);
        for (coupling, left) in self.history.couplings.iter_mut().zip(left) {
            coupling.margin.values.push(left);
        }
        self.note(sample.step);
    }

    /// What is left of the coupling constraints in the true outputs.
    fn left(&self, y: &[DVector<f64>]) -> Vec<f64> {
        let network = &self.design.network;
        let fixed =
            network.coupling_constraints.iter().map(|c| c.l - c.H.iter().map(|(j, row)| row.dot(&y[*j])).sum::<f64>());
        let changing = zip(&network.changing_constraints, &self.scenario.rules).map(|(c, rule)| match rule {
            Rule::Apart { distance } | Rule::Tangent { distance, .. } => {
                (&y[c.members[0]] - &y[c.members[1]]).norm() - distance
            }
            Rule::Beyond { normal, bound } => DVector::from_column_slice(normal).dot(&y[c.members[0]]) - bound,
        });
        fixed.chain(changing).collect()
    }

    /// What has changed at this step.
    fn note(&mut self, step: usize) {
        let mut events = Vec::new();
        for i in 0..self.history.subsystems.len() {
            let track = &self.history.subsystems[i];
            events.extend(self.set_points(step, i));
            let (now, before) = (track.guaranteed[step], step == 0 || track.guaranteed[step - 1]);
            let status = &track.status[step];
            if let (Some(why), true) = (self.words[i].why_not(status), before) {
                events.push(self.event(step, i, EventKind::Lost, format!("no guarantee: {why}")));
            } else if now && !before {
                events.push(self.event(step, i, EventKind::Regained, "the guarantee holds again".to_owned()));
            }
            let held = |step: usize| held_up(&track.status[step].references);
            if held(step) && (step == 0 || !held(step - 1)) {
                events.push(self.event(step, i, EventKind::HeldUp, self.words[i].status(status)));
            }
            for margin in newly_violated(track.margins.iter(), step) {
                let words = violation(margin, step);
                events.push(self.event(step, i, EventKind::Violated, words));
            }
        }
        for margin in newly_violated(self.history.couplings.iter().map(|coupling| &coupling.margin), step) {
            let (time, words) = (self.time(step), violation(margin, step));
            events.push(Event { step, time, subsystem: None, kind: EventKind::Violated, words });
        }
        self.history.events.append(&mut events);
    }

    /// Set-points that are others than at the step before, where that is not one of many changes.
    fn set_points(&self, step: usize, i: usize) -> Vec<Event> {
        let track = &self.history.subsystems[i];
        let changes = |column: &Column, step: usize| step > 0 && column.values[step] != column.values[step - 1];
        let begins = track.set_points.iter().filter(|column| changes(column, step) && !changes(column, step - 1));
        let words = begins.map(|column| {
            let unit = column.unit.as_ref().map_or_else(String::new, |unit| format!(" {unit}"));
            format!("set-point of `{}` goes to {}{unit}", column.name, short(column.values[step]))
        });
        words.map(|words| self.event(step, i, EventKind::SetPoint, words)).collect()
    }

    pub fn upset(&mut self, step: usize, i: usize, by: &DVector<f64>) {
        self.assumed = false;
        let s = &self.design.network.subsystems[i];
        let moved = zip(&s.states, by.iter()).filter(|(_, by)| **by != 0.0);
        let moved: Vec<String> =
            moved.map(|(state, by)| format!("`{}` by {}{}", state.name, short(*by), state.unit_suffix())).collect();
        let words = format!("upset moves {}", if moved.is_empty() { "nothing".to_owned() } else { moved.join(", ") });
        self.push(step, i, EventKind::Upset, words);
    }

    pub fn refused(&mut self, step: usize, (from, to): (usize, usize), why: &str) {
        let words = format!("message of `{}` refused: {why}", self.name(from));
        self.push(step, to, EventKind::Message, words);
    }

    pub fn trouble(&mut self, step: usize, (from, to): (usize, usize), fate: Fate) {
        let words = match fate {
            Fate::Lost => format!("message of `{}` lost", self.name(from)),
            Fate::Late(1) => format!("message of `{}` late by 1 period", self.name(from)),
            Fate::Late(periods) => format!("message of `{}` late by {periods} periods", self.name(from)),
        };
        self.push(step, to, EventKind::Message, words);
    }

    /// Said once, until all was as assumed for a step.
    pub fn beyond(&mut self, step: usize, i: usize, what: String) {
        self.assumed = false;
        let before = self.beyond[i].replace(step);
        if before.is_none_or(|before| before + 1 < step) {
            self.push(step, i, EventKind::Beyond, what);
        }
    }

    pub fn history(mut self) -> History {
        self.history.events.sort_by_key(|event| (event.step, event.subsystem));
        self.history
    }

    fn push(&mut self, step: usize, i: usize, kind: EventKind, words: String) {
        let event = self.event(step, i, kind, words);
        self.history.events.push(event);
    }

    fn event(&self, step: usize, i: usize, kind: EventKind, words: String) -> Event {
        Event { step, time: self.time(step), subsystem: Some(i), kind, words }
    }

    fn name(&self, i: usize) -> &str {
        &self.design.network.subsystems[i].name
    }

    fn time(&self, step: usize) -> f64 {
        step as f64 * self.history.sample_time
    }
}

/// Whether a margin is a violation.
pub fn is_violated(margin: &Margin, step: usize) -> bool {
    let value = margin.values[step];
    value.is_nan() || value < -ROUNDING * margin.limit.abs()
}

fn newly_violated<'a>(margins: impl Iterator<Item = &'a Margin>, step: usize) -> Vec<&'a Margin> {
    margins.filter(|margin| is_violated(margin, step) && (step == 0 || !is_violated(margin, step - 1))).collect()
}

fn violation(margin: &Margin, step: usize) -> String {
    let unit = margin.unit.as_ref().map_or_else(String::new, |unit| format!(" {unit}"));
    format!("`{}` violated by {}{unit}", margin.row, short(-margin.values[step]))
}

fn held_up(references: &dpc_runtime::References) -> bool {
    use dpc_runtime::References::{Blocked, Deadlock};
    matches!(references, Blocked { .. } | Deadlock { .. })
}

fn push(columns: &mut [Column], values: &[f64]) {
    columns.iter_mut().zip(values).for_each(|(column, value)| column.values.push(*value));
}

/// Without samples; what the scenario gives is there already.
fn track(design: &Design, scenario: &Scenario, i: usize) -> Track {
    let (s, sized, acting) = (&design.network.subsystems[i], &design.sizing.subsystems[i], &scenario.subsystems[i]);
    let free = |signals: &[Signal]| signals.iter().map(|signal| Column::new(signal, (None, None))).collect::<Vec<_>>();
    let limited = |signals: &[Signal], set: &NamedPolytope| {
        let column = |(k, signal)| Column::new(signal, interval(set, k));
        signals.iter().enumerate().map(column).collect::<Vec<_>>()
    };
    let outputs = s.outputs.iter().enumerate();
    let outputs = outputs.map(|(k, signal)| Column::new(signal, (Some(sized.Y.min[k]), Some(sized.Y.max[k]))));
    let loads = s.loads.signals.iter().enumerate().map(|(k, signal)| {
        let values = acting.loads[k].clone();
        Column { values, ..Column::new(signal, (Some(s.loads.min[k]), Some(s.loads.max[k]))) }
    });
    let set_points = zip(&s.outputs, &acting.set_points);
    let set_points =
        set_points.map(|(signal, values)| Column { values: values.clone(), ..Column::new(signal, (None, None)) });
    let over_time = |by_step: &[DVector<f64>]| {
        let column = |(k, signal)| {
            let values = by_step.iter().map(|entry| entry[k]).collect();
            Column { values, ..Column::new(signal, (None, None)) }
        };
        s.states.iter().enumerate().map(column).collect::<Vec<_>>()
    };
    Track {
        name: s.name.clone(),
        states: limited(&s.states, &s.X),
        inputs: limited(&s.inputs, &s.U),
        outputs: outputs.collect(),
        set_points: set_points.collect(),
        y_ref: free(&s.outputs),
        x_ref: free(&s.states),
        u_ref: free(&s.inputs),
        x_nom: free(&s.states),
        u_nom: free(&s.inputs),
        loads: loads.collect(),
        disturbances: over_time(&acting.disturbances),
        errors: over_time(&acting.errors),
        margins: margins(s),
        status: Vec::new(),
        guaranteed: Vec::new(),
        words: Vec::new(),
    }
}

fn margins(s: &Subsystem) -> Vec<Margin> {
    let of = |set: &NamedPolytope, signals: &[Signal]| {
        let row = |r: usize| Margin {
            row: set.rows[r].clone(),
            limit: set.h[r],
            unit: unit(&set.H, r, signals),
            values: Vec::new(),
        };
        (0..set.h.len()).map(row).collect::<Vec<_>>()
    };
    [of(&s.X, &s.states), of(&s.U, &s.inputs)].concat()
}

/// The unit that all signals of a row share, where its coefficients are 1 or -1.
fn unit(rows: &DMatrix<f64>, r: usize, signals: &[Signal]) -> Option<String> {
    let row = rows.row(r);
    let mut read = zip(row.iter(), signals).filter(|(entry, _)| **entry != 0.0);
    let first = read.clone().next()?.1.unit.clone()?;
    read.all(|(entry, signal)| entry.abs() == 1.0 && signal.unit.as_ref() == Some(&first)).then_some(first)
}

/// The interval of signal `k` by the rows that read it alone.
fn interval(set: &NamedPolytope, k: usize) -> (Option<f64>, Option<f64>) {
    let mut ends = (None::<f64>, None::<f64>);
    for (row, limit) in set.H.row_iter().zip(&set.h) {
        let alone = row.iter().enumerate().all(|(j, entry)| (j == k) == (*entry != 0.0));
        let end = limit / row[k];
        match row[k] {
            _ if !alone => {}
            entry if entry > 0.0 => ends.1 = Some(ends.1.map_or(end, |high| high.min(end))),
            _ => ends.0 = Some(ends.0.map_or(end, |low| low.max(end))),
        }
    }
    ends
}

fn couplings(design: &Design, scenario: &Scenario) -> Vec<CouplingTrack> {
    let network = &design.network;
    let names = |members: &[usize]| members.iter().map(|j| network.subsystems[*j].name.clone()).collect::<Vec<_>>();
    let unit = |members: &[usize]| {
        let units = members.iter().flat_map(|j| network.subsystems[*j].outputs.iter().map(|y| y.unit.clone()));
        let units: std::collections::BTreeSet<_> = units.collect();
        if units.len() == 1 { units.into_iter().next().flatten() } else { None }
    };
    let track = |name: &str, members: &[usize], limit: f64| CouplingTrack {
        name: name.to_owned(),
        members: names(members),
        margin: Margin { row: name.to_owned(), limit, unit: unit(members), values: Vec::new() },
    };
    let fixed =
        network.coupling_constraints.iter().map(|c| track(&c.name, &c.H.keys().copied().collect::<Vec<_>>(), c.l));
    let changing = zip(&network.changing_constraints, &scenario.rules).map(|(c, rule)| {
        let limit = match rule {
            Rule::Apart { distance } | Rule::Tangent { distance, .. } => *distance,
            Rule::Beyond { bound, .. } => *bound,
        };
        track(&c.name, &c.members, limit)
    });
    fixed.chain(changing).collect()
}
