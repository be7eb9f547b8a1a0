//! A history as one flat table: what the files are written from.

use super::history::{Column, History, Margin, Track};

/// Named columns of numbers, all as long as the history.
pub struct Columns<'a> {
    pub numbers: Vec<(String, Vec<f64>)>,
    /// Words, one per step; `left.status`.
    pub words: Vec<(String, &'a [String])>,
}

impl<'a> Columns<'a> {
    /// `time [s]`, then per subsystem `left.x.h1 [cm]`, `left.u.v1 [V]`, `left.y.h1 [cm]` and so on, then the coupling constraints.
    pub fn of(history: &'a History) -> Self {
        let mut numbers = vec![("time [s]".to_owned(), history.time.clone())];
        history.subsystems.iter().for_each(|track| numbers.extend(columns(track)));
        for coupling in &history.couplings {
            numbers.push(named("network.margin.", &coupling.margin));
        }
        numbers.push(("network.assumed".to_owned(), flags(&history.assumed)));
        let words = history.subsystems.iter().map(|track| (format!("{}.status", track.name), &track.words[..]));
        Self { numbers, words: words.collect() }
    }
}

fn columns(track: &Track) -> Vec<(String, Vec<f64>)> {
    let groups: [(&str, &[Column]); 12] = [
        ("x", &track.states),
        ("u", &track.inputs),
        ("y", &track.outputs),
        ("set_point", &track.set_points),
        ("y_ref", &track.y_ref),
        ("x_ref", &track.x_ref),
        ("u_ref", &track.u_ref),
        ("x_nom", &track.x_nom),
        ("u_nom", &track.u_nom),
        ("d", &track.loads),
        ("w", &track.disturbances),
        ("v", &track.errors),
    ];
    let signals = groups.iter().flat_map(|(group, columns)| {
        columns.iter().map(move |column| (format!("{}.{group}.{}", track.name, column.label()), column.values.clone()))
    });
    let margins = track.margins.iter().map(|margin| named(&format!("{}.margin.", track.name), margin));
    let guaranteed = (format!("{}.guaranteed", track.name), flags(&track.guaranteed));
    signals.chain(margins).chain([guaranteed]).collect()
}

fn named(prefix: &str, margin: &Margin) -> (String, Vec<f64>) {
    let unit = margin.unit.as_ref().map_or_else(String::new, |unit| format!(" [{unit}]"));
    (format!("{prefix}{}{unit}", margin.row), margin.values.clone())
}

fn flags(values: &[bool]) -> Vec<f64> {
    values.iter().map(|flag| f64::from(*flag)).collect()
}
