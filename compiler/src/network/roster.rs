//! Who is in the network: names of subsystems, states, inputs and outputs, and who names whom.

use std::collections::BTreeMap;

use super::Signal;
use super::words::{count, names};
use crate::diagnostic::{Diagnostic, Diagnostics, Place, code};
use crate::spec::{At, Collective, Signals, Spec, Subsystem, did_you_mean};

/// The names of one subsystem.
pub(super) struct Member {
    pub name: String,
    pub header: Place,
    pub states: Vec<Signal>,
    pub inputs: Vec<Signal>,
    pub outputs: Vec<Signal>,
}

pub(super) struct Roster {
    /// In the order of the file.
    pub members: Vec<Member>,
    /// Where each name stands among them; of equal names the first.
    indices: BTreeMap<String, usize>,
}

impl Roster {
    /// After this: names differ where they must, every subsystem has a state, an input and an output, and p_i <= m_i.
    pub fn new(spec: &Spec, errors: &mut Diagnostics) -> Self {
        check_subsystem_names(&spec.subsystems, errors);
        spec.subsystems.iter().for_each(|subsystem| check_signals(subsystem, errors));
        let members: Vec<_> = spec.subsystems.iter().map(|given| member(given, spec.collective.as_ref())).collect();
        let indices = members.iter().enumerate().rev().map(|(i, member)| (member.name.clone(), i)).collect();
        Self { members, indices }
    }

    /// Whether every subsystem has a state, an input and an output: without them there are no shapes to check.
    pub fn is_named(&self) -> bool {
        let all = self.members.iter().flat_map(|member| [&member.states, &member.inputs, &member.outputs]);
        !self.members.is_empty() && all.into_iter().all(|signals| !signals.is_empty())
    }

    /// The index of the subsystem of this name.
    pub fn index(&self, name: &str) -> Option<usize> {
        self.indices.get(name).copied()
    }

    /// The index of the subsystem that `name` means.
    pub fn find(&self, name: &At<String>, errors: &mut Diagnostics) -> Option<usize> {
        let found = self.index(&name.value);
        if found.is_none() {
            let title = format!("there is no subsystem `{}`", name.value);
            let known = || self.members.iter().map(|member| &*member.name);
            errors.push(suggest(code::UNKNOWN_SUBSYSTEM, title, name, known(), "the subsystems are"));
        }
        found
    }
}

impl Member {
    pub fn find_output(&self, name: &At<String>, errors: &mut Diagnostics) -> Option<usize> {
        let found = self.outputs.iter().position(|output| output.name == name.value);
        if found.is_none() {
            let title = format!("subsystem `{}` has no output `{}`", self.name, name.value);
            let known = self.outputs.iter().map(|output| &*output.name);
            errors.push(suggest(code::UNKNOWN_SIGNAL, title, name, known, "its outputs are"));
        }
        found
    }

    /// `one per state: h1, h2`, for messages on shapes.
    pub fn per_state(&self) -> String {
        format!("one per state: {}", names(&self.states))
    }
    pub fn per_input(&self) -> String {
        format!("one per input: {}", names(&self.inputs))
    }
    pub fn per_output(&self) -> String {
        format!("one per output: {}", names(&self.outputs))
    }
}

/// Refuses `name`, with the nearest of the `known` names or with all of them.
pub(super) fn suggest<'a>(
    code: &'static str,
    title: String,
    name: &At<String>,
    known: impl Iterator<Item = &'a str>,
    introduction: &str,
) -> Diagnostic {
    let known: Vec<_> = known.collect();
    let error = Diagnostic::error(code, title);
    match did_you_mean(&name.value, known.iter().copied()) {
        Some(near) => error.at(name.place.clone(), format!("did you mean `{near}`?")),
        None => error
            .at(name.place.clone(), "not declared in this file")
            .help(format!("{introduction}: {}", known.join(", "))),
    }
}

/// Reports the second and later of equal names; `seen` maps what was seen to its place.
pub(super) fn check_unique(
    what: &str,
    name: &str,
    place: &Place,
    seen: &mut BTreeMap<String, Place>,
    errors: &mut Diagnostics,
) {
    if let Some(first) = seen.get(name) {
        let error = Diagnostic::error(code::DUPLICATE_NAME, format!("the name `{name}` is used twice for {what}"));
        errors.push(error.at(place.clone(), "used again here").at(first.clone(), "first used here"));
    } else {
        seen.insert(name.to_string(), place.clone());
    }
}

fn member(given: &Subsystem, collective: Option<&Collective>) -> Member {
    let own = |own: &Signals, list: fn(&Collective) -> &Signals| {
        let declared = collective.map(|collective| signals(list(collective))).unwrap_or_default();
        with_units(signals(own), &declared)
    };
    let states = own(&given.states, |collective| &collective.states);
    let inputs = own(&given.inputs, |collective| &collective.inputs);
    let outputs = with_units(own(&given.outputs, |collective| &collective.outputs), &states);
    Member { name: given.name.value.clone(), header: given.name.place.clone(), states, inputs, outputs }
}

pub(super) fn signals(given: &Signals) -> Vec<Signal> {
    given.value.iter().map(|signal| signal.value.clone()).collect()
}

/// A signal without a unit takes the unit of its namesake: an output that of a state, an owned signal that of the
/// collective one.
fn with_units(signals: Vec<Signal>, namesakes: &[Signal]) -> Vec<Signal> {
    let unit = |name: &str| namesakes.iter().find(|other| other.name == name).and_then(|other| other.unit.clone());
    let complete = |Signal { name, unit: own }| Signal { unit: own.or_else(|| unit(&name)), name };
    signals.into_iter().map(complete).collect()
}

/// Files and Rust modules are named after subsystems, so names that differ in case or in `-` and `_` only will not do.
fn check_subsystem_names(subsystems: &[Subsystem], errors: &mut Diagnostics) {
    let mut seen = BTreeMap::new();
    for name in subsystems.iter().map(|subsystem| &subsystem.name) {
        let file = name.value.to_lowercase().replace('-', "_");
        check_unique("a subsystem (case, `-` and `_` make no difference)", &file, &name.place, &mut seen, errors);
    }
}

fn check_signals(given: &Subsystem, errors: &mut Diagnostics) {
    let owner = &given.name.value;
    let mut variables = BTreeMap::new();
    for signal in given.states.value.iter().chain(&given.inputs.value) {
        let what = format!("a state or input of subsystem `{owner}`");
        check_unique(&what, &signal.value.name, &signal.place, &mut variables, errors);
    }
    let mut outputs = BTreeMap::new();
    for signal in &given.outputs.value {
        let what = format!("an output of subsystem `{owner}`");
        check_unique(&what, &signal.value.name, &signal.place, &mut outputs, errors);
    }
    for (what, signals) in [("state", &given.states), ("input", &given.inputs), ("output", &given.outputs)] {
        check_some(owner, what, signals, errors);
    }
    check_output_count(given, errors);
}

fn check_some(owner: &str, what: &str, signals: &Signals, errors: &mut Diagnostics) {
    if signals.value.is_empty() {
        let error = Diagnostic::error(code::SHAPE, format!("subsystem `{owner}` has no {what}"));
        errors.push(error.at(signals.place.clone(), format!("name at least one {what}")));
    }
}

fn check_output_count(given: &Subsystem, errors: &mut Diagnostics) {
    let (p, m) = (given.outputs.value.len(), given.inputs.value.len());
    if p > m {
        let title = format!("subsystem `{}` has more outputs than inputs", given.name.value);
        let error = Diagnostic::error(code::MORE_OUTPUTS_THAN_INPUTS, title)
            .at(given.outputs.place.clone(), count(p, "output"))
            .at(given.inputs.place.clone(), count(m, "input"))
            .note("each output follows a set-point of its own, which takes an input each (p_i <= m_i)")
            .help("leave out an output, or move the subsystem's border so that it owns another input");
        errors.push(error);
    }
}
