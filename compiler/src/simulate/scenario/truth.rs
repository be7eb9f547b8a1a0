//! A true plant that is not the model.

use std::path::Path;

use crate::diagnostic::{Diagnostic, Diagnostics, Source, code};
use crate::network::{Network, Signal, Subsystem};
use crate::spec::{At, Spec};

/// The network of another file, with the same subsystems and signals.
pub fn of(file: &At<String>, folder: &Path, network: &Network, errors: &mut Diagnostics) -> Option<Network> {
    let refuse = |label: String, note: Option<String>| {
        let error = Diagnostic::error(code::TRUE_PLANT, format!("`{}` cannot be the true plant", file.value));
        let error = error.at(file.place.clone(), label);
        let error = note.into_iter().fold(error, Diagnostic::note);
        error.help("the file of a network with the same subsystems, states, inputs and outputs; looked for beside the scenario")
    };
    let path = folder.join(&file.value);
    let source = match std::fs::read_to_string(&path) {
        Ok(text) => Source { path: path.display().to_string(), text },
        Err(why) => {
            errors.push(refuse(format!("cannot be read: {why}"), None));
            return None;
        }
    };
    let truth = Spec::parse(&source).and_then(|spec| Network::new(&spec, source.clone()));
    match truth.map(|truth| (difference(&truth, network), truth)) {
        Ok((None, truth)) => Some(truth),
        Ok((Some(difference), _)) => {
            errors.push(refuse(difference, None));
            None
        }
        Err(mistakes) => {
            errors.push(refuse("has mistakes of its own".to_owned(), first(&mistakes)));
            None
        }
    }
}

/// The first mistake, and how many there are.
fn first(mistakes: &Diagnostics) -> Option<String> {
    let first = mistakes.0.first()?;
    let more = mistakes.0.len() - 1;
    let more = if more == 0 { String::new() } else { format!("; {more} more, which a design of that file shows") };
    Some(format!("{}: {}{more}", first.code, first.title))
}

/// In what the two do not fit each other.
fn difference(truth: &Network, network: &Network) -> Option<String> {
    if truth.subsystems.len() != network.subsystems.len() {
        let [theirs, ours] = [truth, network].map(|network| network.subsystems.len());
        return Some(format!("it has {theirs} subsystems, and the network has {ours}"));
    }
    if (truth.sample_time - network.sample_time).abs() > 1e-9 * network.sample_time {
        return Some(format!(
            "its sample-time is {} s, and the network's {} s",
            truth.sample_time, network.sample_time
        ));
    }
    let pairs = truth.subsystems.iter().zip(&network.subsystems);
    pairs.into_iter().find_map(|(theirs, ours)| {
        let differs = |kind: &str, of: fn(&Subsystem) -> &[Signal]| {
            let names = |s: &Subsystem| of(s).iter().map(|signal| signal.name.clone()).collect::<Vec<_>>();
            (names(theirs) != names(ours)).then(|| format!("the {kind} of its subsystem `{}` are others", theirs.name))
        };
        (theirs.name != ours.name)
            .then(|| format!("its subsystem `{}` stands where the network has `{}`", theirs.name, ours.name))
            .or_else(|| differs("states", |s| &s.states))
            .or_else(|| differs("inputs", |s| &s.inputs))
            .or_else(|| differs("outputs", |s| &s.outputs))
            .or_else(|| differs("loads", |s| &s.loads.signals))
    })
}
