//! What the runs amount to, as tables.

use example_kit::checks::{Checks, NodeChecks};
use example_kit::table::table;

use crate::areas::{ANGLE, AREA, AREAS, INPUT_WEIGHT, STATE_WEIGHT, TIE};
use crate::runs::Run;

/// One run, or several together.
#[derive(Debug, Clone)]
pub struct Entry {
    /// `b1`, as the tables call it.
    pub key: &'static str,
    pub name: String,
    /// Whether the design promises anything of this plant.
    pub guaranteed: bool,
    pub checks: Checks,
    pub outside: usize,
    /// Of a run of the benchmark's loads.
    pub outcome: Option<Outcome>,
}

/// What came of a run of the benchmark's loads.
#[derive(Debug, Clone, Copy)]
pub struct Outcome {
    /// Largest |domega| of all areas, rad/s: at any time, and over the last 10 s.
    pub frequency: f64,
    pub frequency_left: f64,
    /// Largest |dtheta|, rad: at any time, and at the end.
    pub angle: f64,
    pub angle_left: f64,
    /// Largest share of its limit that an input used.
    pub power: f64,
    /// The benchmark's figures over its 100 s.
    pub eta: f64,
    pub phi: f64,
}

/// Steps of the benchmark's figures.
const BENCHMARK_STEPS: usize = 100;

impl Outcome {
    pub fn of(run: &Run) -> Self {
        let samples = &run.trajectory.samples;
        let end = samples.len();
        let largest = |from: usize, k: usize| {
            let nodes = samples[from..].iter().flat_map(|sample| &sample.nodes);
            nodes.map(|node| node.x[k].abs()).fold(0.0, f64::max)
        };
        let used = samples
            .iter()
            .flat_map(|sample| sample.nodes.iter().zip(AREA).map(|(node, area)| node.u[0].abs() / area.power));
        Self {
            frequency: largest(0, 1),
            frequency_left: largest(end - 10, 1),
            angle: largest(0, 0),
            angle_left: largest(end - 1, 0),
            power: used.fold(0.0, f64::max),
            eta: eta(run),
            phi: phi(run),
        }
    }
}

/// Mean of |x - x°|_Q^2 + |u - u°|_R^2, with x° = (0, 0, dPL, dPL) and u° = dPL at the load of the step.
fn eta(run: &Run) -> f64 {
    let steps = run.trajectory.samples.iter().zip(&run.loads).take(BENCHMARK_STEPS);
    let cost = steps.flat_map(|(sample, loads)| sample.nodes.iter().zip(loads)).map(|(node, load)| {
        let rest = [0.0, 0.0, *load, *load];
        let of_x: f64 = (0..4).map(|k| STATE_WEIGHT[k] * (node.x[k] - rest[k]).powi(2)).sum();
        of_x + INPUT_WEIGHT * (node.u[0] - load).powi(2)
    });
    cost.sum::<f64>() / BENCHMARK_STEPS as f64
}

/// Mean of the power exchanged over all tie lines.
fn phi(run: &Run) -> f64 {
    let exchanged = run.trajectory.samples.iter().take(BENCHMARK_STEPS).map(|sample| {
        let angle = |i: usize| sample.nodes[i].x[0];
        let lines = (0..AREAS).flat_map(|i| (0..i).map(move |j| (i, j)));
        lines.map(|(i, j)| (TIE[i][j] * (angle(i) - angle(j))).abs()).sum::<f64>()
    });
    exchanged.sum::<f64>() / BENCHMARK_STEPS as f64
}

/// Steps, and at how many of them something was not as promised, added up over all areas.
pub fn counts(entries: &[Entry]) -> String {
    let head = ["run", "steps", "x not in X", "u not in U", "x-xhat not in E", "z-zref not in Z", "infeasible"];
    let head = head.into_iter().chain(["no guarantee", "load outside", "active"]).map(str::to_owned);
    let row = |entry: &Entry| {
        let checks = &entry.checks;
        let count = |of: fn(&NodeChecks) -> usize| checks.sum(of).to_string();
        let share = 100.0 * checks.sum(|node| node.active) as f64 / (AREAS * checks.steps) as f64;
        vec![
            format!("{} {}", entry.key, entry.name),
            checks.steps.to_string(),
            count(|node| node.states.violations),
            count(|node| node.inputs.violations),
            count(|node| node.tube.violations),
            count(|node| node.coupling.violations),
            count(|node| node.infeasible),
            count(|node| node.unguaranteed),
            entry.outside.to_string(),
            format!("{share:.1} %"),
        ]
    };
    table(&head.collect::<Vec<_>>(), &entries.iter().map(row).collect::<Vec<_>>())
}

/// What the benchmark's loads have come to.
pub fn outcomes(entries: &[Entry]) -> String {
    let head = ["run", "|domega|, rad/s", "last 10 s", "|dtheta|, rad", "of its limit", "at the end"];
    let head = head.into_iter().chain(["input, of its limit", "eta", "phi"]).map(str::to_owned);
    let row = |entry: &Entry| {
        let outcome = entry.outcome?;
        Some(vec![
            entry.key.to_owned(),
            format!("{:.4}", outcome.frequency),
            format!("{:.1e}", outcome.frequency_left),
            format!("{:.4}", outcome.angle),
            format!("{:.0} %", 100.0 * outcome.angle / ANGLE),
            format!("{:.1e}", outcome.angle_left),
            format!("{:.0} %", 100.0 * outcome.power),
            format!("{:.4}", outcome.eta),
            format!("{:.4}", outcome.phi),
        ])
    };
    table(&head.collect::<Vec<_>>(), &entries.iter().filter_map(row).collect::<Vec<_>>())
}

/// How close states, inputs, tubes and coupling outputs came to what is promised: the least that was left, as a share.
pub fn margins(entries: &[Entry]) -> String {
    let head = std::iter::once("smallest margin, of its limit".to_owned());
    let head = head.chain(entries.iter().map(|entry| entry.key.to_owned())).collect::<Vec<_>>();
    let left = |what: &str, of: fn(&NodeChecks) -> f64| {
        let least = |entry: &Entry| entry.checks.nodes.iter().map(of).fold(f64::INFINITY, f64::min);
        let cells = entries.iter().map(|entry| percent(least(entry)));
        std::iter::once(what.to_owned()).chain(cells).collect::<Vec<_>>()
    };
    let rows = [
        left("x in X", |node| node.states.share_left()),
        left("u in U", |node| node.inputs.share_left()),
        left("x - xhat in E", |node| node.tube.share_left()),
        left("z - zref in Z", |node| node.coupling.share_left()),
    ];
    table(&head, &rows)
}

/// With one decimal; what rounds to zero has no sign.
fn percent(share: f64) -> String {
    let text = format!("{:.1} %", 100.0 * share);
    if text == "-0.0 %" { "0.0 %".to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::percent;

    #[test]
    fn only_true_negatives_have_a_sign() {
        assert_eq!([-1e-9, -0.006, 0.125].map(percent), ["0.0 %", "-0.6 %", "12.5 %"]);
    }
}
