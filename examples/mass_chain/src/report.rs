//! What the runs amount to, as tables.

use example_kit::checks::{Checks, NodeChecks};
use example_kit::sets::Promise;
use example_kit::table::table;

use crate::closed_loop::Run;
use crate::pattern::{NAMES, Patterns};

/// One run, or several together.
#[derive(Debug, Clone)]
pub struct Entry {
    pub name: String,
    pub checks: Checks,
}

/// Steps, and at how many of them something was not as promised, added up over all masses.
pub fn counts(entries: &[Entry]) -> String {
    let head = ["run", "steps", "x not in X", "u not in U", "x-xhat not in E", "z-zref not in Z", "infeasible"];
    let head = head.into_iter().chain(["no guarantee", "active", "force left"]).map(str::to_owned);
    let row = |entry: &Entry| {
        let checks = &entry.checks;
        let count = |of: fn(&NodeChecks) -> usize| checks.sum(of).to_string();
        let share = 100.0 * checks.sum(|node| node.active) as f64 / (checks.nodes.len() * checks.steps) as f64;
        let force = checks.nodes.iter().map(|node| node.inputs.share_left()).fold(f64::INFINITY, f64::min);
        vec![
            entry.name.clone(),
            checks.steps.to_string(),
            count(|node| node.states.violations),
            count(|node| node.inputs.violations),
            count(|node| node.tube.violations),
            count(|node| node.coupling.violations),
            count(|node| node.infeasible),
            count(|node| node.unguaranteed),
            format!("{share:.1} %"),
            format!("{:.1} %", 100.0 * force),
        ]
    };
    table(&head.collect::<Vec<_>>(), &entries.iter().map(row).collect::<Vec<_>>())
}

/// Largest distance of any mass from the point of Y nearest to its set-point at the end of each pattern, m.
pub fn errors(run: &Run, promise: &Promise, patterns: &Patterns) -> Vec<f64> {
    let ranges = promise.output_ranges();
    let error = |step: usize| {
        let nodes = run.trajectory.samples[step].nodes.iter().zip(&ranges);
        nodes.map(|(node, [low, high])| (node.x[0] - node.set_point[0].clamp(*low, *high)).abs()).fold(0.0, f64::max)
    };
    patterns.ends().map(error).collect()
}

/// The same as a table.
pub fn arrivals(errors: &[f64]) -> String {
    let head = ["pattern", "largest error at its end"].map(str::to_owned);
    let row = |(name, error): (&&str, &f64)| vec![(*name).to_owned(), format!("{error:.1e} m")];
    table(&head, &NAMES.iter().zip(errors).map(row).collect::<Vec<_>>())
}
