//! A run drawn: frequencies, angles, inputs and loads of the four areas.

use example_kit::plot::{Colour, Figure, Limit, Line, Panel, Stroke, colour, number};
use example_kit::trajectory::NodeSample;

use crate::areas::{ANGLE, AREA, AREAS, Area, SAMPLE_TIME};
use crate::runs::Run;

/// What is drawn of a run, in s: as long as the benchmark's scenario is.
const END: f64 = 100.0;

/// Panels domega, dtheta, dPref and dPL.
pub fn closed_loop(title: &str, run: &Run) -> Figure {
    let panels = vec![
        panel("domega [rad/s]", 150, lines(run, "area", |node| node.x[1]), Vec::new()),
        panel("dtheta [rad]", 150, lines(run, "area", |node| node.x[0]), both("dtheta", ANGLE, colour::GREY, false)),
        panel("dPref [pu]", 165, lines(run, "area", |node| node.u[0]), powers()),
        panel("dPL [pu]", 120, loads(run), Vec::new()),
    ];
    Figure { title: title.to_owned(), end: END, panels, marks: Vec::new() }
}

/// Colour of each area.
const OF_AREA: [Colour; AREAS] = [colour::BLUE, colour::ORANGE, colour::VERMILION, colour::BLACK];

fn panel(axis: &str, height: u32, lines: Vec<Line>, limits: Vec<Limit>) -> Panel {
    Panel { axis: axis.to_owned(), height, lines, bands: Vec::new(), limits }
}

fn lines(run: &Run, name: &str, of: fn(&NodeSample) -> f64) -> Vec<Line> {
    let line = |i: usize| Line {
        label: format!("{name} {}", i + 1),
        points: drawn(run.trajectory.signal(i, of)),
        stroke: Stroke::Solid,
        colour: OF_AREA[i],
    };
    (0..AREAS).map(line).collect()
}

fn drawn(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    points.into_iter().take_while(|(time, _)| *time <= END).collect()
}

/// As stairs: a load is constant over a period.
fn loads(run: &Run) -> Vec<Line> {
    let line = |i: usize| {
        let stairs = run
            .loads
            .iter()
            .enumerate()
            .flat_map(|(step, loads)| [step, step + 1].map(|end| (end as f64 * SAMPLE_TIME, loads[i])));
        Line {
            label: format!("load {}", i + 1),
            points: drawn(stairs.collect()),
            stroke: Stroke::Solid,
            colour: OF_AREA[i],
        }
    };
    (0..AREAS).map(line).collect()
}

/// One label for all of them: the colours say whose they are.
fn powers() -> Vec<Limit> {
    let of_area = |(area, colour): (&Area, Colour)| both("", area.power, colour, true);
    let mut limits: Vec<Limit> = AREA.iter().zip(OF_AREA).flat_map(of_area).collect();
    limits.iter_mut().for_each(|limit| limit.label = String::new());
    limits.iter_mut().take(1).for_each(|limit| limit.label = "limits of each area".to_owned());
    limits
}

/// Limits to both sides.
fn both(name: &str, value: f64, colour: Colour, show: bool) -> Vec<Limit> {
    let label = format!("|{name}| ≤ {}", number(value));
    vec![Limit { label, value, show, colour }, Limit { label: String::new(), value: -value, show, colour }]
}
