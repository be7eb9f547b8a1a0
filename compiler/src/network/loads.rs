//! Measured disturbances: loads that act on a subsystem and that its controller knows when they do.

use nalgebra::{DMatrix, DVector};

use super::limits::Space;
use super::roster::Member;
use super::shape::{Shape, Side, vector};
use super::words::{names, number};
use super::{Loads, Signal};
use crate::diagnostic::{Diagnostic, Diagnostics, Place, code};
use crate::spec::{At, Bounds, PerSignal, Signals, Subsystem};

/// `loads`, `M`, `d` and `d-rate` of one subsystem; none of them where there is no load.
pub(super) fn loads(given: &Subsystem, member: &Member, errors: &mut Diagnostics) -> Option<Loads> {
    let Some(written) = &given.loads else {
        return no_orphans(given, errors).then(|| Loads::none(member.states.len()));
    };
    let signals: Vec<Signal> = written.value.iter().map(|signal| signal.value.clone()).collect();
    let before = errors.0.len();
    check_names(written, &signals, member, errors);
    let M = matrix(given, written, &signals, member, errors);
    let ends = ends(given, written, &signals, member, errors);
    let rate = rate(&given.d_rate, &signals, member, errors);
    let (M, (min, max), rate) = (M?, ends?, rate?);
    // A load cannot change by more than its range.
    let rate = rate.map_or(&max - &min, |rate| rate.inf(&(&max - &min)));
    (errors.0.len() == before).then_some(Loads { signals, M, min, max, rate })
}

fn no_orphans(given: &Subsystem, errors: &mut Diagnostics) -> bool {
    let places = [
        ("M", given.M.as_ref().map(|matrix| matrix.place.clone())),
        ("d", given.d.as_ref().map(|bounds| bounds.place.clone())),
        ("d-rate", given.d_rate.as_ref().map(PerSignal::place)),
    ];
    let before = errors.0.len();
    for (key, place) in places {
        let Some(place) = place else { continue };
        let title = format!("`{key}` of subsystem `{}` belongs to loads, and there are none", given.name.value);
        let error = Diagnostic::error(code::LOAD, title).at(place, "whose?");
        errors.push(error.help("name them: loads = [\"d1 [unit]\"]"));
    }
    errors.0.len() == before
}

fn check_names(written: &Signals, signals: &[Signal], member: &Member, errors: &mut Diagnostics) {
    let known = member.states.iter().chain(&member.inputs);
    for (k, (signal, at)) in signals.iter().zip(&written.value).enumerate() {
        let twice = signals[..k].iter().chain(known.clone()).any(|other| other.name == signal.name);
        if twice {
            let title = format!("subsystem `{}` has two signals `{}`", member.name, signal.name);
            errors.push(Diagnostic::error(code::DUPLICATE_NAME, title).at(at.place.clone(), "a load of this name"));
        }
    }
}

fn missing(key: &str, why: &str, example: String, place: &Place, member: &Member) -> Diagnostic {
    Diagnostic::error(code::LOAD, format!("subsystem `{}` has loads without `{key}`", member.name))
        .at(place.clone(), format!("needs `{key}` beside it: {why}"))
        .help(example)
}

fn matrix(
    given: &Subsystem,
    written: &Signals,
    signals: &[Signal],
    member: &Member,
    errors: &mut Diagnostics,
) -> Option<DMatrix<f64>> {
    let Some(M) = &given.M else {
        let row = format!("[{}]", vec!["0.1"; signals.len()].join(", "));
        let rows = vec![row; member.states.len().min(3)].join(", ");
        let rows = if member.states.len() > 3 { rows + ", .." } else { rows };
        let example = format!("write the matrix that takes loads to states, a row per state: M = [{rows}], say");
        errors.push(missing("M", "what they add to the states", example, &written.place, member));
        return None;
    };
    let what = format!("matrix `M` of subsystem `{}`", member.name);
    let rows = Side::Exactly(member.states.len(), member.per_state());
    Shape { what, rows, columns: Side::Exactly(signals.len(), per_load(signals)) }.read(M, errors)
}

fn per_load(signals: &[Signal]) -> String {
    format!("one per load: {}", names(signals))
}

type Ends = (DVector<f64>, DVector<f64>);

fn ends(
    given: &Subsystem,
    written: &Signals,
    signals: &[Signal],
    member: &Member,
    errors: &mut Diagnostics,
) -> Option<Ends> {
    let Some(d) = &given.d else {
        let side = |end: &str| vec![end; signals.len()].join(", ");
        let example = format!(
            "write d = {{ min = [{}], max = [{}] }}, say: 0 is the load at the operating point",
            side("-0.1"),
            side("0.1")
        );
        errors.push(missing("d", "their bounds", example, &written.place, member));
        return None;
    };
    let space = Space { what: format!("`d` of subsystem `{}`", member.name), kind: "load", signals };
    let before = errors.0.len();
    let max = side(&space, d, 1.0, errors);
    let min = side(&space, d, -1.0, errors);
    if d.rows.is_some() {
        errors.push(unusable(&space, &d.place, "loads are bounded one by one: min and max"));
    }
    let (min, max) = (min?, max?);
    (errors.0.len() == before).then_some((min, max))
}

fn side(space: &Space<'_>, d: &Bounds, sign: f64, errors: &mut Diagnostics) -> Option<DVector<f64>> {
    let (key, given) = if sign > 0.0 { ("max", &d.max) } else { ("min", &d.min) };
    let ends = space.ends(key, given, errors)?;
    let before = errors.0.len();
    for (end, signal) in ends.iter().zip(space.signals) {
        match end {
            None => errors.push(unusable(space, &d.place, &format!("`{key}` is missing"))),
            Some(end) if sign * end.value < 0.0 || end.value.is_infinite() => {
                let label = format!("{key} of {}: {}", signal.name, number(end.value));
                errors.push(unusable(space, &end.place, &label));
            }
            Some(_) => {}
        }
    }
    let value = |end: &Option<At<f64>>| end.as_ref().map_or(0.0, |end| end.value);
    (errors.0.len() == before).then(|| DVector::from_iterator(ends.len(), ends.iter().map(value)))
}

fn unusable(space: &Space<'_>, place: &Place, label: &str) -> Diagnostic {
    Diagnostic::error(code::LOAD, format!("{} does not bound the loads", space.what)).at(place.clone(), label).help(
        "write { min = [..], max = [..] } with finite numbers, min <= 0 <= max: 0 is the load at the operating point",
    )
}

/// `Some(None)` where the file says nothing.
fn rate(
    given: &Option<PerSignal>,
    signals: &[Signal],
    member: &Member,
    errors: &mut Diagnostics,
) -> Option<Option<DVector<f64>>> {
    let what = format!("`d-rate` of subsystem `{}`", member.name);
    let rates = match given {
        None => return Some(None),
        Some(PerSignal::Every(every)) => vec![every.clone(); signals.len()],
        Some(PerSignal::Each(each)) => {
            vector(&what, each, signals.len(), &per_load(signals), errors)?;
            each.value.clone()
        }
    };
    if let Some(wrong) = rates.iter().find(|rate| rate.value < 0.0) {
        let label = format!("{}, expected a number of 0 or more", number(wrong.value));
        let error = Diagnostic::error(code::LOAD, format!("{what} is no bound")).at(wrong.place.clone(), label);
        errors.push(error.help("write the largest change per step, such as d-rate = 0.1, or one per load; without it a load may jump over its whole range"));
        return None;
    }
    Some(Some(DVector::from_iterator(rates.len(), rates.iter().map(|rate| rate.value))))
}

impl Loads {
    fn none(n: usize) -> Self {
        let empty = DVector::zeros(0);
        Self { signals: Vec::new(), M: DMatrix::zeros(n, 0), min: empty.clone(), max: empty.clone(), rate: empty }
    }

    pub fn len(&self) -> usize {
        self.signals.len()
    }

    pub fn is_empty(&self) -> bool {
        self.signals.is_empty()
    }

    /// How far a load can be from what it was `steps` steps before.
    pub fn change(&self, steps: usize) -> DVector<f64> {
        (&self.rate * steps as f64).inf(&(&self.max - &self.min))
    }
}
