//! The closed loop drawn like Fig. 6 of the paper, with the inputs and the upper tanks below.

use crate::plot::{Band, Colour, Figure, Limit, Line, Panel, Stroke, colour, number};
use crate::sets::{Promise, Subsystem};
use crate::trajectory::{NodeSample, Trajectory};

/// Panels y1, y2, (u1, u2), (h2, h4); deviations from the working point.
pub fn closed_loop(title: &str, trajectory: &Trajectory, promise: &Promise) -> Figure {
    let nodes = &promise.subsystems;
    let mut panels: Vec<_> = (0..nodes.len()).map(|i| outputs(i, trajectory, &nodes[i])).collect();
    panels.push(inputs(trajectory, nodes));
    panels.push(upper_tanks(trajectory, nodes));
    Figure { title: title.to_owned(), end: trajectory.end(), panels, marks: Vec::new() }
}

/// Set-point, output and reference of one subsystem on the band Y_i.
fn outputs(i: usize, trajectory: &Trajectory, node: &Subsystem) -> Panel {
    let name = i + 1;
    let line = |label, stroke, colour, of: fn(&NodeSample) -> f64| {
        let points = trajectory.signal(i, of);
        Line { label, points, stroke, colour }
    };
    let [low, high] = node.y_set.interval(0);
    Panel {
        axis: format!("y{name} [cm]"),
        height: 165,
        lines: vec![
            line(format!("set-point {name}"), Stroke::DashDotted, colour::GREY, |node| node.set_point),
            line(format!("y{name}"), Stroke::Solid, OF_NODE[i], |node| node.x[0]),
            line(format!("y{name} reference"), Stroke::Dashed, colour::BLACK, |node| node.y_ref),
        ],
        bands: vec![Band { label: format!("Y{name}"), low, high, colour: colour::SKY }],
        limits: limits(&format!("y{name}"), "cm", node.X.interval(0), OF_NODE[i]),
    }
}

fn inputs(trajectory: &Trajectory, nodes: &[Subsystem]) -> Panel {
    let line = |i: usize| signal(format!("u{}", i + 1), i, trajectory, |node| node.u[0]);
    let ends = nodes.iter().flat_map(|node| node.U.interval(0)).enumerate();
    let limit = |(k, value)| {
        let label = if k == 0 { "limits" } else { "" };
        Limit { label: label.to_owned(), value, show: true, colour: colour::VERMILION }
    };
    Panel {
        axis: "u1, u2 [V]".to_owned(),
        height: 130,
        lines: (0..nodes.len()).map(line).collect(),
        bands: Vec::new(),
        limits: ends.map(limit).collect(),
    }
}

fn upper_tanks(trajectory: &Trajectory, nodes: &[Subsystem]) -> Panel {
    let name = |i: usize| format!("h{}", 2 * i + 2);
    let line = |i: usize| signal(name(i), i, trajectory, |node| node.x[1]);
    let limits = |i: usize| limits(&name(i), "cm", nodes[i].X.interval(1), OF_NODE[i]);
    Panel {
        axis: "h2, h4 [cm]".to_owned(),
        height: 130,
        lines: (0..nodes.len()).map(line).collect(),
        bands: Vec::new(),
        limits: (0..nodes.len()).flat_map(limits).collect(),
    }
}

/// Colour of each subsystem.
const OF_NODE: [Colour; 2] = [colour::BLUE, colour::ORANGE];

fn signal(label: String, i: usize, trajectory: &Trajectory, of: fn(&NodeSample) -> f64) -> Line {
    Line { label, points: trajectory.signal(i, of), stroke: Stroke::Solid, colour: OF_NODE[i] }
}

/// Limits that are drawn where the signals come near them.
fn limits(name: &str, unit: &str, [low, high]: [f64; 2], colour: Colour) -> Vec<Limit> {
    let limit =
        |sign, value| Limit { label: format!("{name} {sign} {} {unit}", number(value)), value, show: false, colour };
    vec![limit('≥', low), limit('≤', high)]
}
