//! The collective model (5) cut along a partition.

use std::collections::BTreeMap;

use nalgebra::DMatrix;

use super::Signal;
use super::blocks::Coupling;
use super::model::Local;
use super::roster::{Member, Roster, check_unique, signals, suggest};
use super::rows::hstack;
use super::shape::{Shape, Side, entry_place};
use super::words::{names, number};
use crate::diagnostic::{Diagnostic, Diagnostics, Place, code};
use crate::spec::{At, Collective, Signals, Spec, Subsystem};

/// A, B, C of (5).
struct Matrices {
    A: DMatrix<f64>,
    B: DMatrix<f64>,
    C: DMatrix<f64>,
}

/// Which rows and columns of (5) each subsystem owns, in its own order.
struct Partition {
    states: Vec<Vec<usize>>,
    inputs: Vec<Vec<usize>>,
    outputs: Vec<Vec<usize>>,
}

pub(super) fn models(
    given: &Collective,
    spec: &Spec,
    roster: &Roster,
    errors: &mut Diagnostics,
) -> Option<(Vec<Local>, Coupling)> {
    let matrices = matrices(given, errors);
    let partition = partition(given, &spec.subsystems, errors);
    refuse_imports(&spec.subsystems, errors);
    let (matrices, partition) = (matrices?, partition?);
    check_outputs(given, &matrices.C, &partition, roster, errors);
    let members = 0..roster.members.len();
    let locals = members.clone().map(|i| partition.local(i, &matrices)).collect();
    let pairs = members.clone().flat_map(|i| members.clone().filter(move |j| *j != i).map(move |j| (i, j)));
    let coupling = pairs.map(|(i, j)| ((i, j), partition.block(i, j, &matrices))).collect();
    Some((locals, Coupling(coupling)))
}

fn matrices(given: &Collective, errors: &mut Diagnostics) -> Option<Matrices> {
    let side = |what: &str, list: &Signals| {
        Side::Exactly(list.value.len(), format!("one per collective {what}: {}", names(&signals(list))))
    };
    let what = |key: &str| format!("collective matrix `{key}`");
    let states = || side("state", &given.states);
    let A = Shape { what: what("A"), rows: states(), columns: states() }.read(&given.A, errors);
    let B = Shape { what: what("B"), rows: states(), columns: side("input", &given.inputs) }.read(&given.B, errors);
    let C = Shape { what: what("C"), rows: side("output", &given.outputs), columns: states() }.read(&given.C, errors);
    Some(Matrices { A: A?, B: B?, C: C? })
}

fn partition(given: &Collective, subsystems: &[Subsystem], errors: &mut Diagnostics) -> Option<Partition> {
    let states = cut("state", &given.states, subsystems, |s| &s.states, errors);
    let inputs = cut("input", &given.inputs, subsystems, |s| &s.inputs, errors);
    let outputs = cut("output", &given.outputs, subsystems, |s| &s.outputs, errors);
    Some(Partition { states: states?, inputs: inputs?, outputs: outputs? })
}

/// The indices each subsystem owns of one collective list; every name must be owned exactly once.
fn cut(
    what: &str,
    collective: &Signals,
    subsystems: &[Subsystem],
    list: fn(&Subsystem) -> &Signals,
    errors: &mut Diagnostics,
) -> Option<Vec<Vec<usize>>> {
    let mut seen = BTreeMap::new();
    for signal in &collective.value {
        check_unique(&format!("a collective {what}"), &signal.value.name, &signal.place, &mut seen, errors);
    }
    if seen.len() < collective.value.len() {
        return None;
    }
    let mut owners: BTreeMap<usize, &Place> = BTreeMap::new();
    let mut all = Vec::new();
    for subsystem in subsystems {
        let owned = list(subsystem).value.iter().map(|signal| own(what, signal, collective, &mut owners, errors));
        all.push(owned.collect::<Vec<_>>());
    }
    for (k, signal) in collective.value.iter().enumerate().filter(|(k, _)| !owners.contains_key(k)) {
        let title = format!("{what} `{}` belongs to no subsystem", collective.value[k].value.name);
        let error = Diagnostic::error(code::PARTITION, title).at(signal.place.clone(), "not in any subsystem's list");
        errors.push(error.help(format!("add it to the `{what}s` of one subsystem")));
    }
    all.into_iter().map(|owned| owned.into_iter().collect()).collect()
}

fn own<'a>(
    what: &str,
    signal: &'a At<Signal>,
    collective: &Signals,
    owners: &mut BTreeMap<usize, &'a Place>,
    errors: &mut Diagnostics,
) -> Option<usize> {
    let name = &signal.value.name;
    let Some(index) = collective.value.iter().position(|known| known.value.name == *name) else {
        let written = At::new(name.clone(), signal.place.clone());
        let known = collective.value.iter().map(|known| &*known.value.name);
        let title = format!("there is no {what} `{name}` in the collective model");
        errors.push(suggest(code::UNKNOWN_SIGNAL, title, &written, known, &format!("its {what}s are")));
        return None;
    };
    if let Some(first) = owners.insert(index, &signal.place) {
        let error = Diagnostic::error(code::PARTITION, format!("{what} `{name}` belongs to two subsystems"));
        errors.push(error.at(signal.place.clone(), "owned again here").at(first.clone(), "first owned here"));
        return None;
    }
    Some(index)
}

fn refuse_imports(subsystems: &[Subsystem], errors: &mut Diagnostics) {
    for import in subsystems.iter().flat_map(|subsystem| &subsystem.from) {
        let error = Diagnostic::error(code::MIXED_FORMS, "a `from` table has no place beside a collective model");
        let label = "the couplings stand in the collective `A` and `B`";
        errors.push(error.at(import.neighbour.place.clone(), label));
    }
}

/// C = diag(C_1, ..., C_M).
fn check_outputs(
    given: &Collective,
    C: &DMatrix<f64>,
    partition: &Partition,
    roster: &Roster,
    errors: &mut Diagnostics,
) {
    for (i, outputs) in partition.outputs.iter().enumerate() {
        let foreign = |state: &usize| !partition.states[i].contains(state);
        for (&row, column) in outputs.iter().flat_map(|row| (0..C.ncols()).filter(foreign).map(move |c| (row, c))) {
            if C[(row, column)] != 0.0 {
                errors.push(coupled(given, row, column, C[(row, column)], &roster.members[i]));
            }
        }
    }
}

fn coupled(given: &Collective, row: usize, column: usize, value: f64, owner: &Member) -> Diagnostic {
    let (output, state) = (&given.outputs.value[row].value.name, &given.states.value[column].value.name);
    let title = format!("output `{output}` of subsystem `{}` reads state `{state}` of another subsystem", owner.name);
    Diagnostic::error(code::COUPLED_OUTPUT, title)
        .at(entry_place(&given.C, row, column), format!("{} times `{state}`", number(value)))
        .note("the method needs a block-diagonal C: every output is read from its own subsystem's states")
        .help(format!("give `{state}` and `{output}` to the same subsystem, or put 0 here"))
}

impl Partition {
    fn local(&self, i: usize, whole: &Matrices) -> Local {
        Local {
            A: pick(&whole.A, &self.states[i], &self.states[i]),
            B: pick(&whole.B, &self.states[i], &self.inputs[i]),
            C: pick(&whole.C, &self.outputs[i], &self.states[i]),
        }
    }

    fn block(&self, i: usize, j: usize, whole: &Matrices) -> DMatrix<f64> {
        let rows = &self.states[i];
        hstack(&pick(&whole.A, rows, &self.states[j]), &pick(&whole.B, rows, &self.inputs[j]))
    }
}

fn pick(whole: &DMatrix<f64>, rows: &[usize], columns: &[usize]) -> DMatrix<f64> {
    whole.select_rows(rows).select_columns(columns)
}
