//! A run drawn: positions, velocities and forces of a few masses.

use example_kit::plot::{Colour, Figure, Limit, Line, Panel, Stroke, colour};
use example_kit::trajectory::NodeSample;

use crate::chain::FORCE;
use crate::closed_loop::Run;

const COLOURS: [Colour; 5] = [colour::BLUE, colour::ORANGE, colour::VERMILION, colour::BLACK, colour::SKY];

/// Panels q with the set-points of the first, v and force.
pub fn closed_loop(title: &str, run: &Run) -> Figure {
    let shown = shown(run.trajectory.samples.first().map_or(0, |sample| sample.nodes.len()));
    let lines = |of: fn(&NodeSample) -> f64| -> Vec<Line> {
        let numbered = shown.iter().zip(COLOURS);
        numbered.map(|(&i, colour)| line(format!("mass {}", i + 1), run, i, of, Stroke::Solid, colour)).collect()
    };
    let mut positions = lines(|node| 1000.0 * node.x[0]);
    positions.push(line(
        "reference of mass 1".into(),
        run,
        0,
        |node| 1000.0 * node.y_ref[0],
        Stroke::Dashed,
        colour::GREY,
    ));
    let limit = |value: f64, label: &str| Limit { label: label.into(), value, show: true, colour: colour::GREY };
    let limits = vec![limit(FORCE, "|force| ≤ 1 N"), limit(-FORCE, "")];
    let panels = vec![
        panel("q [mm]", 190, positions, Vec::new()),
        panel("v [mm/s]", 120, lines(|node| 1000.0 * node.x[1]), Vec::new()),
        panel("force [N]", 150, lines(|node| node.u[0]), limits),
    ];
    Figure { title: title.to_owned(), end: run.trajectory.end(), panels, marks: Vec::new() }
}

/// Up to five masses, from one wall to the other.
fn shown(length: usize) -> Vec<usize> {
    let count = length.min(COLOURS.len());
    (0..count).map(|k| k * (length - 1) / (count - 1).max(1)).collect()
}

fn line(label: String, run: &Run, i: usize, of: fn(&NodeSample) -> f64, stroke: Stroke, colour: Colour) -> Line {
    Line { label, points: run.trajectory.signal(i, of), stroke, colour }
}

fn panel(axis: &str, height: u32, lines: Vec<Line>, limits: Vec<Limit>) -> Panel {
    Panel { axis: axis.to_owned(), height, lines, bands: Vec::new(), limits }
}
