//! Signals over time: constants, steps, ramps, pulses, files, random ones.

use std::path::Path;

use nalgebra::DVector;

use super::names;
use super::{Acting, first_step, nuisance, out_of_range};
use crate::design::Design;
use crate::diagnostic::{Diagnostic, Diagnostics, code};
use crate::network::{Signal, Subsystem};
use crate::simulate::random::Random;
use crate::spec::At;
use crate::spec::scenario::{self as written, Change, Course, Move};

/// What courses are drawn out for.
pub struct Reader<'a> {
    pub design: &'a Design,
    /// Where files are looked for.
    pub folder: &'a Path,
    pub seed: u64,
    pub steps: usize,
}

/// Where a random course may go.
#[derive(Debug, Clone, Copy)]
pub struct Room {
    pub low: f64,
    pub high: f64,
    /// Largest change per step.
    pub rate: f64,
}

/// Steps from one random value to the next, where nothing else is said.
pub const EVERY: usize = 60;

impl Reader<'_> {
    /// What acts on each subsystem of the network.
    pub fn subsystems(&self, given: &written::Scenario, errors: &mut Diagnostics) -> Vec<Acting> {
        let network = &self.design.network;
        let rest = network.subsystems.iter().map(|s| Acting::at_rest(s, self.steps));
        let mut all: Vec<Acting> = rest.collect();
        for acting in &given.subsystems {
            if let Some(i) = names::subsystem(&acting.name, network, errors) {
                all[i] = self.acting(i, acting, errors);
            }
        }
        all
    }

    fn acting(&self, i: usize, given: &written::Acting, errors: &mut Diagnostics) -> Acting {
        let (s, sized) = (&self.design.network.subsystems[i], &self.design.sizing.subsystems[i]);
        let mut acting = Acting::at_rest(s, self.steps);
        let free = f64::INFINITY;
        let y = |k: usize| Room { low: sized.Y.min[k], high: sized.Y.max[k], rate: free };
        let of_set_points = Signals { what: "output", s, signals: &s.outputs, stream: stream(i, 0), room: &y };
        self.given(&of_set_points, &given.set_points, &mut acting.set_points, errors);
        let d = |k: usize| Room { low: s.loads.min[k], high: s.loads.max[k], rate: s.loads.rate[k] };
        let of_loads = Signals { what: "load", s, signals: &s.loads.signals, stream: stream(i, 1), room: &d };
        self.given(&of_loads, &given.loads, &mut acting.loads, errors);
        if let Some(nuisance) = &given.disturbance {
            let drawn = nuisance::disturbance(self, i, nuisance, stream(i, 2), errors);
            acting.disturbances = self.with_added(drawn, s, nuisance, errors);
        }
        if let Some(nuisance) = &given.measurement_error {
            let drawn = nuisance::error(self, i, nuisance, stream(i, 3), errors);
            acting.errors = self.with_added(drawn, s, nuisance, errors);
        }
        acting
    }

    /// What is added to states by name.
    fn with_added(
        &self,
        mut drawn: Vec<DVector<f64>>,
        s: &Subsystem,
        nuisance: &written::Nuisance,
        errors: &mut Diagnostics,
    ) -> Vec<DVector<f64>> {
        let nowhere = |_: usize| Room { low: 0.0, high: 0.0, rate: 0.0 };
        let mut added = vec![vec![0.0; self.steps]; s.n()];
        let states = Signals { what: "state", s, signals: &s.states, stream: 0, room: &nowhere };
        self.given(&states, &nuisance.add, &mut added, errors);
        for (k, column) in added.iter().enumerate() {
            drawn.iter_mut().zip(column).for_each(|(w, by)| w[k] += by);
        }
        drawn
    }

    fn given(
        &self,
        of: &Signals<'_>,
        courses: &[(At<String>, Course)],
        columns: &mut [Vec<f64>],
        errors: &mut Diagnostics,
    ) {
        for (name, course) in courses {
            let Some(k) = names::signal(name, of.what, &of.s.name, of.signals, errors) else { continue };
            let stream = of.stream.wrapping_add(k as u64 + 1);
            if let Some(values) = self.course(course, (of.room)(k), stream, errors) {
                columns[k] = values;
            }
        }
    }

    /// One value per step.
    fn course(&self, course: &Course, room: Room, stream: u64, errors: &mut Diagnostics) -> Option<Vec<f64>> {
        match course {
            Course::Constant(value) => Some(vec![value.value; self.steps]),
            Course::Moves(moves) => self.moves(&moves.value, errors),
            Course::Csv { file, column } => self.column(file, column, errors),
            Course::Random { place, every } => {
                if room.low >= room.high {
                    let error = Diagnostic::error(code::NO_SET, "nothing says in what range this is to be random");
                    errors.push(error.at(place.clone(), "needs a range").help("give a number or a list of moves"));
                    return None;
                }
                let every = match every {
                    Some(every) => self.periods(every, "`every` is too short", errors)?,
                    None => EVERY,
                };
                let mut random = Random::new(self.seed, stream);
                Some(random_course(&mut random, room, every, self.steps))
            }
        }
    }

    /// A time span as a number of sampling periods, at least one.
    pub fn periods(&self, span: &At<f64>, title: &str, errors: &mut Diagnostics) -> Option<usize> {
        let period = self.design.network.sample_time;
        let periods = (span.value / period).round();
        if periods >= 1.0 {
            return Some(periods as usize);
        }
        errors.push(out_of_range(title, span, &format!("expected at least one sampling period of {period} s")));
        None
    }

    fn moves(&self, moves: &[Move], errors: &mut Diagnostics) -> Option<Vec<f64>> {
        let before = errors.0.len();
        moves.iter().for_each(|one| self.check_move(one, errors));
        let steady = moves.iter().filter(|one| matches!(one.what, Change::To { .. }));
        let steady: Vec<&Move> = steady.collect();
        for pair in steady.windows(2) {
            if pair[1].at.value <= pair[0].at.value {
                let error = Diagnostic::error(code::SCENARIO_VALUE, "moves are not in order of time");
                let label = format!("{} s, after {} s", pair[1].at.value, pair[0].at.value);
                errors.push(error.at(pair[1].at.place.clone(), label));
            }
        }
        let period = self.design.network.sample_time;
        let value = |step: usize| at_step(moves, step as f64, period);
        (errors.0.len() == before).then(|| (0..self.steps).map(value).collect())
    }

    fn check_move(&self, one: &Move, errors: &mut Diagnostics) {
        super::step_of(&one.at, self.design.network.sample_time, self.steps, errors);
        let span = match &one.what {
            Change::To { over, .. } => over.as_ref(),
            Change::By { lasting, .. } => Some(lasting),
        };
        if let Some(span) = span.filter(|span| span.value <= 0.0) {
            errors.push(out_of_range("a move takes some time", span, "expected a positive number of s"));
        }
    }

    /// A column of a file of comma-separated values, one line per step; its last value stays.
    fn column(&self, file: &At<String>, column: &At<String>, errors: &mut Diagnostics) -> Option<Vec<f64>> {
        let refuse = |place: &At<String>, label: String| {
            Diagnostic::error(code::PROFILE, format!("`{}` cannot be used as a course", file.value))
                .at(place.place.clone(), label)
                .help("a line of column names, then a line of numbers per sampling period; the file is looked for beside the scenario")
        };
        let path = self.folder.join(&file.value);
        let mut reader = match csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(&path) {
            Ok(reader) => reader,
            Err(why) => {
                errors.push(refuse(file, format!("cannot be read: {why}")));
                return None;
            }
        };
        let names: Vec<String> = reader.headers().map(|names| names.iter().map(str::to_owned).collect()).ok()?;
        let known: Vec<&str> = names.iter().map(String::as_str).collect();
        let title = format!("`{}` has no column `{}`", file.value, column.value);
        let error = || Diagnostic::error(code::PROFILE, title);
        let k = names::find(column, &column.value, &known, "columns", error, errors)?;
        let mut values = Vec::new();
        for (line, record) in reader.records().enumerate() {
            let number =
                record.ok().and_then(|record| record.get(k)?.parse().ok()).filter(|value: &f64| value.is_finite());
            let Some(number) = number else {
                errors.push(refuse(column, format!("line {} has no finite number in this column", line + 2)));
                return None;
            };
            values.push(number);
        }
        let Some(last) = values.last().copied() else {
            errors.push(refuse(file, "has no line of numbers".to_owned()));
            return None;
        };
        values.resize(self.steps, last);
        Some(values)
    }
}

/// The signals of one kind of a subsystem.
struct Signals<'a> {
    what: &'static str,
    s: &'a Subsystem,
    signals: &'a [Signal],
    /// Of random numbers.
    stream: u64,
    room: &'a dyn Fn(usize) -> Room,
}

/// A stream of random numbers per subsystem and kind of signal: what one draws does not depend on what others do.
fn stream(i: usize, kind: u64) -> u64 {
    ((i as u64) << 20) + (kind << 16)
}

/// 0 before the first move.
fn at_step(moves: &[Move], step: f64, period: f64) -> f64 {
    let mut value = 0.0;
    let mut pulses = 0.0;
    for one in moves {
        let from = first_step(one.at.value, period);
        match &one.what {
            Change::To { value: to, over: None } if from <= step => value = to.value,
            Change::To { value: to, over: Some(over) } if from <= step => {
                let share = ((step * period - one.at.value) / over.value).clamp(0.0, 1.0);
                value += share * (to.value - value);
            }
            Change::By { value: by, lasting }
                if (from..first_step(one.at.value + lasting.value, period)).contains(&step) =>
            {
                pulses += by.value;
            }
            _ => {}
        }
    }
    value + pulses
}

/// A value in the room, drawn anew after so many steps and approached at the rate.
pub fn random_course(random: &mut Random, room: Room, every: usize, steps: usize) -> Vec<f64> {
    let mut wanted = 0.0_f64.clamp(room.low, room.high);
    let mut value = wanted;
    let mut drawn = |step: usize| {
        if step.is_multiple_of(every) {
            wanted = random.between(room.low, room.high);
        }
        value += (wanted - value).clamp(-room.rate, room.rate);
        value
    };
    (0..steps).map(&mut drawn).collect()
}
