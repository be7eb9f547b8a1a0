//! Names and lengths of a scenario against those of its network.

use nalgebra::DVector;

use crate::diagnostic::{Diagnostic, Diagnostics, code};
use crate::network::{Network, Signal};
use crate::spec::{At, Row, did_you_mean};

/// Index of a subsystem.
pub fn subsystem(name: &At<String>, network: &Network, errors: &mut Diagnostics) -> Option<usize> {
    let known: Vec<&str> = network.subsystems.iter().map(|s| &*s.name).collect();
    let title = format!("there is no subsystem `{}`", name.value);
    find(name, &name.value, &known, "subsystems", || Diagnostic::error(code::UNKNOWN_SUBSYSTEM, title), errors)
}

/// Index of a signal, which may be written with its unit: `h1` or `h1 [cm]`.
pub fn signal(name: &At<String>, what: &str, of: &str, signals: &[Signal], errors: &mut Diagnostics) -> Option<usize> {
    let (plain, unit) = match name.value.split_once('[') {
        Some((plain, unit)) => (plain.trim_end(), unit.strip_suffix(']').map(str::trim)),
        None => (&*name.value, None),
    };
    let known: Vec<&str> = signals.iter().map(|signal| &*signal.name).collect();
    let title = format!("subsystem `{of}` has no {what} `{plain}`");
    let error = || Diagnostic::error(code::UNKNOWN_SIGNAL, title);
    let index = find(name, plain, &known, &format!("{what}s"), error, errors)?;
    let declared = signals[index].unit.as_deref();
    if unit.is_some() && unit != declared {
        let error = Diagnostic::error(code::UNIT, format!("`{plain}` is in another unit"));
        let label = declared.map_or("it has no unit".to_owned(), |declared| format!("it is in {declared}"));
        errors.push(error.at(name.place.clone(), label).help("numbers are in the units of the network's file"));
        return None;
    }
    Some(index)
}

/// Index of a name among those there are.
pub fn find(
    at: &At<String>,
    name: &str,
    known: &[&str],
    what: &str,
    error: impl FnOnce() -> Diagnostic,
    errors: &mut Diagnostics,
) -> Option<usize> {
    let found = known.iter().position(|candidate| *candidate == name);
    if found.is_none() {
        let error = match did_you_mean(name, known.iter().copied()) {
            Some(near) => error().at(at.place.clone(), format!("did you mean `{near}`?")),
            None if known.is_empty() => error().at(at.place.clone(), format!("there are no {what}")),
            None => {
                let all = known.join(", ");
                error().at(at.place.clone(), "not in the network").help(format!("the {what} are {all}"))
            }
        };
        errors.push(error);
    }
    found
}

/// One number per signal.
pub fn vector(what: &str, row: &Row, signals: &[Signal], errors: &mut Diagnostics) -> Option<DVector<f64>> {
    if row.value.len() == signals.len() {
        return Some(DVector::from_iterator(row.value.len(), row.value.iter().map(|entry| entry.value)));
    }
    let names: Vec<&str> = signals.iter().map(|signal| &*signal.name).collect();
    let plural = if row.value.len() == 1 { "" } else { "s" };
    let label = match &names[..] {
        [] => format!("{} number{plural}, expected none", row.value.len()),
        names => format!("{} number{plural}, expected {}: {}", row.value.len(), names.len(), names.join(", ")),
    };
    errors.push(Diagnostic::error(code::SHAPE, format!("{what} has the wrong length")).at(row.place.clone(), label));
    None
}
