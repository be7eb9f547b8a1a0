//! What the runs amount to, as tables.

use crate::checks::{Checks, NodeChecks, Watch};
use crate::runs::Run;
use crate::scenario::output_ranges;
use crate::sets::Promise;
use crate::table::table;

/// One run, or several together.
#[derive(Debug, Clone)]
pub struct Entry {
    /// `b1`, as the tables call it.
    pub key: &'static str,
    pub name: String,
    pub checks: Checks,
    /// What a run from rest has come to, per output.
    pub ends: Option<[End; 2]>,
}

/// One output at the last step, cm.
#[derive(Debug, Clone, Copy)]
pub struct End {
    pub set_point: f64,
    /// The point of Y_i nearest to the set-point.
    pub nearest: f64,
    pub y: f64,
}

impl End {
    /// Of both outputs of a run.
    pub fn of(run: &Run, promise: &Promise) -> Option<[Self; 2]> {
        let last = run.trajectory.samples.last()?;
        let ranges = output_ranges(promise);
        Some([0, 1].map(|i| {
            let node = &last.nodes[i];
            let [low, high] = ranges[i];
            Self { set_point: node.set_point, nearest: node.set_point.clamp(low, high), y: node.x[0] }
        }))
    }

    /// Distance from the nearest admissible point, cm.
    pub fn error(&self) -> f64 {
        (self.y - self.nearest).abs()
    }
}

/// Steps, and at how many of them something was not as promised, added up over both subsystems.
pub fn counts(entries: &[Entry]) -> String {
    let head = ["run", "steps", "x not in X", "u not in U", "x-xhat not in E", "z-zref not in Z", "infeasible"];
    let head = head.into_iter().chain(["no guarantee", "fell back", "active"]).map(str::to_owned);
    let row = |entry: &Entry| {
        let checks = &entry.checks;
        let count = |of: fn(&NodeChecks) -> usize| checks.sum(of).to_string();
        let share = 100.0 * checks.sum(|node| node.active) as f64 / (2 * checks.steps) as f64;
        vec![
            format!("{} {}", entry.key, entry.name),
            checks.steps.to_string(),
            count(|node| node.states.violations),
            count(|node| node.inputs.violations),
            count(|node| node.tube.violations),
            count(|node| node.coupling.violations),
            count(|node| node.infeasible),
            count(|node| node.unguaranteed),
            count(|node| node.fell_back),
            format!("{share:.1} %"),
        ]
    };
    table(&head.collect::<Vec<_>>(), &entries.iter().map(row).collect::<Vec<_>>())
}

/// Per limit the smallest distance from it, one column per entry.
pub fn margins(entries: &[Entry]) -> String {
    let head = std::iter::once("smallest margin to".to_owned()).chain(entries.iter().map(|entry| entry.key.to_owned()));
    let mut rows = Vec::new();
    for (i, names) in [["h1", "h2", "v1"], ["h3", "h4", "v2"]].iter().enumerate() {
        rows.extend(limits(entries, i, &names[..2], "cm", |node| &node.states));
        rows.extend(limits(entries, i, &names[2..], "V", |node| &node.inputs));
    }
    for (what, of) in [("E", (|node| &node.tube) as fn(&NodeChecks) -> &Watch), ("Z", |node| &node.coupling)] {
        for i in 0..2 {
            let left =
                entries.iter().map(|entry| format!("{} %", fixed(100.0 * of(&entry.checks.nodes[i]).share_left(), 1)));
            rows.push(std::iter::once(format!("{what}_{}, share of it", i + 1)).chain(left).collect());
        }
    }
    table(&head.collect::<Vec<_>>(), &rows)
}

/// One row per limit of a set.
fn limits(
    entries: &[Entry],
    i: usize,
    names: &[&str],
    unit: &str,
    of: impl Fn(&NodeChecks) -> &Watch,
) -> Vec<Vec<String>> {
    let set = entries.first().map(|entry| of(&entry.checks.nodes[i]).set());
    let labels = set.into_iter().flat_map(|set| set.H.iter().zip(&set.h));
    let rows = labels.enumerate().map(|(row, (normal, limit))| {
        let margins =
            entries.iter().map(|entry| format!("{} {unit}", fixed(of(&entry.checks.nodes[i]).margins[row], 3)));
        std::iter::once(format!("{} {unit}", inequality(normal, *limit, names))).chain(margins).collect()
    });
    rows.collect()
}

/// `h1 >= -12.4`
fn inequality(normal: &[f64], limit: f64, names: &[&str]) -> String {
    let terms: Vec<_> = normal.iter().zip(names).filter(|(factor, _)| **factor != 0.0).collect();
    match terms[..] {
        [(factor, name)] if *factor < 0.0 => format!("{name} >= {}", limit / factor),
        [(factor, name)] => format!("{name} <= {}", limit / factor),
        _ => format!("{terms:?} <= {limit}"),
    }
}

/// Where the runs from rest ended.
pub fn ends(entries: &[Entry]) -> String {
    let head = ["run", "output", "set-point", "nearest point of Y", "at the end", "error"].map(str::to_owned);
    let rows = entries.iter().flat_map(|entry| {
        let outputs = entry.ends.iter().flatten().enumerate();
        outputs.map(|(i, end)| {
            let cm = |value: f64| format!("{value:.6} cm");
            let error = format!("{:.1e} cm", end.error());
            vec![entry.key.to_owned(), format!("y{}", i + 1), cm(end.set_point), cm(end.nearest), cm(end.y), error]
        })
    });
    table(&head, &rows.collect::<Vec<_>>())
}

/// With so many decimals; what rounds to zero has no sign.
fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    if text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') {
        text.trim_start_matches('-').to_owned()
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::{fixed, inequality};

    #[test]
    fn limits_read_as_the_user_wrote_them() {
        assert_eq!(inequality(&[0.0, -1.0], 1.4, &["h1", "h2"]), "h2 >= -1.4");
        assert_eq!(inequality(&[2.0, 0.0], 5.0, &["h1", "h2"]), "h1 <= 2.5");
    }

    #[test]
    fn only_true_negatives_have_a_sign() {
        assert_eq!([-1e-9, -0.06, 1.25].map(|value| fixed(value, 1)), ["0.0", "-0.1", "1.2"]);
    }
}
