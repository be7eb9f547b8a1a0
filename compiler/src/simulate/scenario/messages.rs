//! What becomes of messages that do not arrive in time.

use std::collections::BTreeMap;

use super::courses::Reader;
use super::{names, out_of_range};
use crate::diagnostic::{Diagnostic, Diagnostics, code};
use crate::emit::hears;
use crate::simulate::random::Random;
use crate::spec::At;
use crate::spec::scenario::{self as written, Trouble};

/// By the step a message is sent at, its sender and its receiver.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Fates(BTreeMap<(usize, usize, usize), Fate>);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fate {
    Lost,
    /// By so many periods.
    Late(usize),
}

impl Fates {
    /// `None`: it arrives in time.
    pub fn of_message(&self, step: usize, from: usize, to: usize) -> Option<Fate> {
        self.0.get(&(step, from, to)).copied()
    }

    pub(super) fn of(given: &written::Scenario, reader: &Reader<'_>, errors: &mut Diagnostics) -> Self {
        let mut fates = Self::default();
        // What is lost cannot be late.
        for (k, trouble) in given.late.iter().chain(&given.lost).enumerate() {
            let Some(fate) = fate(trouble, errors) else { continue };
            let before = errors.0.len();
            for (from, to) in links(trouble, reader, errors) {
                // What is wrong is so for every link.
                if errors.0.len() > before {
                    break;
                }
                for step in steps(trouble, reader, (k, from, to), errors) {
                    fates.0.insert((step, from, to), fate);
                }
            }
        }
        fates
    }
}

fn fate(trouble: &Trouble, errors: &mut Diagnostics) -> Option<Fate> {
    match &trouble.by {
        None => Some(Fate::Lost),
        Some(by) if by.value >= 1 => Some(Fate::Late(by.value as usize)),
        Some(by) => {
            errors.push(out_of_range("a late message is late by some periods", by, "expected 1 or more"));
            None
        }
    }
}

/// Sender and receiver of every link that the trouble is on.
fn links(trouble: &Trouble, reader: &Reader<'_>, errors: &mut Diagnostics) -> Vec<(usize, usize)> {
    let network = &reader.design.network;
    let before = errors.0.len();
    let [from, to] =
        [&trouble.from, &trouble.to].map(|name| name.as_ref().and_then(|name| names::subsystem(name, network, errors)));
    if errors.0.len() > before {
        return Vec::new();
    }
    let all = || (0..network.subsystems.len()).flat_map(|i| hears(reader.design, i).into_iter().map(move |j| (j, i)));
    let chosen = all().filter(|(j, i)| from.is_none_or(|from| from == *j) && to.is_none_or(|to| to == *i));
    let chosen: Vec<_> = chosen.collect();
    if chosen.is_empty() {
        let name =
            |end: &Option<At<String>>| end.as_ref().map_or("anyone".to_owned(), |end| format!("`{}`", end.value));
        let title = format!("no messages go from {} to {}", name(&trouble.from), name(&trouble.to));
        let place =
            trouble.from.as_ref().or(trouble.to.as_ref()).map_or(trouble.place.clone(), |end| end.place.clone());
        let pairs: Vec<String> =
            all().map(|(j, i)| format!("{} to {}", network.subsystems[j].name, network.subsystems[i].name)).collect();
        let listed = if pairs.is_empty() { "none: nobody hears anybody".to_owned() } else { pairs.join(", ") };
        let error = Diagnostic::error(code::NO_LINK, title).at(place, "not a neighbour");
        errors.push(error.help(format!("messages go from {listed}")));
    }
    chosen
}

/// Steps whose messages are in trouble on one link.
fn steps(
    trouble: &Trouble,
    reader: &Reader<'_>,
    (k, from, to): (usize, usize, usize),
    errors: &mut Diagnostics,
) -> Vec<usize> {
    let period = reader.design.network.sample_time;
    if let Some(at) = &trouble.at {
        let steps = at.value.iter().filter_map(|time| super::step_of(time, period, reader.steps, errors));
        return steps.collect();
    }
    let during = trouble.during.as_ref().map_or((0.0, f64::INFINITY), |during| during.value);
    let within = |step: usize| {
        let step = step as f64;
        super::first_step(during.0, period) <= step && step < super::first_step(during.1, period)
    };
    let probability = match &trouble.probability {
        None if trouble.during.is_none() => {
            let error = Diagnostic::error(code::SCENARIO_VALUE, "nothing says which messages");
            let error = error.at(trouble.place.clone(), "needs `at`, `during` or `probability`");
            errors.push(error.help("write at = [10.0, 12.5] (s), during = [10.0, 20.0], or probability = 0.01"));
            return Vec::new();
        }
        None => 1.0,
        Some(given) if (0.0..=1.0).contains(&given.value) => given.value,
        Some(given) => {
            errors.push(out_of_range("this is no probability", given, "expected 0 to 1"));
            return Vec::new();
        }
    };
    let stream = (1 << 40) + ((k as u64) << 32) + ((from as u64) << 16) + to as u64;
    let mut random = Random::new(reader.seed, stream);
    let steps = (0..reader.steps).filter(|step| random.unit() < probability && within(*step));
    steps.collect()
}
