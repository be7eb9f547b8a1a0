//! A history as pictures, one per subsystem.

use dpc_plot::{Band, Colour, DrawError, Figure, Limit, Line, Mark, Panel, Stroke, colour};
use dpc_runtime::Control;

use super::history::{Column, EventKind, History, Track};

/// Heights of panels, px.
const TALL: u32 = 150;
const LOW: u32 = 56;

/// A limit is drawn where the signal comes as near to it as this share of the way between its limits, or as it moves itself.
const NEAR: f64 = 0.2;

/// Outputs with set-points, references and Y; inputs, states and loads with their limits; statuses; events as thin lines: SVG.
///
/// # Errors
/// What the drawing library reports.
pub fn picture(history: &History, i: usize) -> Result<String, DrawError> {
    let track = &history.subsystems[i];
    let mut panels: Vec<Panel> = (0..track.outputs.len()).map(|k| output(history, track, k)).collect();
    panels.extend(
        track.inputs.iter().enumerate().map(|(k, column)| signal(history, column, Some(&track.u_ref[k]), "input")),
    );
    let shown: Vec<&str> = track.outputs.iter().map(|column| &*column.name).collect();
    let states = track.states.iter().enumerate().filter(|(_, column)| !shown.contains(&&*column.name));
    panels.extend(states.map(|(k, column)| signal(history, column, Some(&track.x_ref[k]), "state")));
    panels.extend(track.loads.iter().map(|column| signal(history, column, None, "load")));
    panels.push(status(history, track));
    let title = format!("{}, subsystem {}: {}", history.network, track.name, history.scenario);
    Figure { title, end: history.end(), panels, marks: marks(history, i) }.to_svg()
}

fn output(history: &History, track: &Track, k: usize) -> Panel {
    let column = &track.outputs[k];
    let line = |label: &str, column: &Column, stroke, colour| line(history, label, &column.values, stroke, colour);
    let lines = vec![
        line("set-point", &track.set_points[k], Stroke::Dashed, colour::ORANGE),
        line("reference", &track.y_ref[k], Stroke::DashDotted, colour::VERMILION),
        line("output", column, Stroke::Solid, colour::BLUE),
    ];
    let band = column.low.zip(column.high).map(|(low, high)| {
        let label = "Y".to_owned();
        Band { label, low, high, colour: colour::SKY }
    });
    let state = track.states.iter().find(|state| state.name == column.name);
    let limits = state.map(limits).unwrap_or_default();
    Panel { axis: column.label(), height: TALL, lines, bands: band.into_iter().collect(), limits }
}

fn signal(history: &History, column: &Column, reference: Option<&Column>, what: &str) -> Panel {
    let reference =
        reference.map(|reference| line(history, "reference", &reference.values, Stroke::DashDotted, colour::VERMILION));
    let own = line(history, what, &column.values, Stroke::Solid, colour::BLUE);
    let lines = reference.into_iter().chain([own]).collect();
    Panel { axis: column.label(), height: TALL, lines, bands: Vec::new(), limits: limits(column) }
}

fn limits(column: &Column) -> Vec<Limit> {
    let unit = column.unit.as_ref().map_or_else(String::new, |unit| format!(" {unit}"));
    let (least, most) = range(&column.values);
    let between = column.low.zip(column.high).map_or(0.0, |(low, high)| high - low);
    let near = f64::max(NEAR * between, most - least);
    let limit = |sign: &str, value: f64, distance: f64| Limit {
        label: format!("{} {sign} {}{unit}", column.name, dpc_plot::number(value)),
        value,
        show: distance <= near,
        colour: colour::GREY,
    };
    let low = column.low.map(|low| limit("≥", low, least - low));
    let high = column.high.map(|high| limit("≤", high, high - most));
    low.into_iter().chain(high).collect()
}

/// 0 at the reference, 1 solved, 2 solved with active rows, 3 shifted candidate, 4 no solution; and whether the guarantee holds.
fn status(history: &History, track: &Track) -> Panel {
    let level = |control: &Control| match control {
        Control::AtReference => 0.0,
        Control::Optimal { active: 0, .. } => 1.0,
        Control::Optimal { .. } => 2.0,
        Control::Candidate => 3.0,
        Control::Infeasible { .. } | Control::IterationLimit | Control::NotFinite => 4.0,
    };
    let levels: Vec<f64> = track.status.iter().map(|status| level(&status.control)).collect();
    let lost: Vec<f64> = track.guaranteed.iter().map(|guaranteed| if *guaranteed { 0.0 } else { 4.0 }).collect();
    let mut lines = vec![stairs(
        history,
        "0 at reference, 1 solved, 2 rows active, 3 shifted plan, 4 infeasible",
        &levels,
        colour::BLUE,
    )];
    if lost.iter().any(|lost| *lost > 0.0) {
        lines.push(stairs(history, "no guarantee", &lost, colour::VERMILION));
    }
    let limit = Limit { label: String::new(), value: 4.0, show: true, colour: Colour(255, 255, 255) };
    Panel { axis: "status".to_owned(), height: LOW, lines, bands: Vec::new(), limits: vec![limit] }
}

fn line(history: &History, label: &str, values: &[f64], stroke: Stroke, colour: Colour) -> Line {
    let points = history.time.iter().copied().zip(values.iter().copied()).filter(|(_, value)| value.is_finite());
    Line { label: label.to_owned(), points: points.collect(), stroke, colour }
}

/// Held over each period.
fn stairs(history: &History, label: &str, values: &[f64], colour: Colour) -> Line {
    let period = history.sample_time;
    let points = history.time.iter().zip(values).flat_map(|(t, value)| [(*t, *value), (t + period, *value)]);
    Line { label: label.to_owned(), points: points.collect(), stroke: Stroke::Solid, colour }
}

fn marks(history: &History, i: usize) -> Vec<Mark> {
    let own = history.events.iter().filter(|event| event.subsystem.is_none_or(|subsystem| subsystem == i));
    let shown = own.filter_map(|event| {
        let colour = match event.kind {
            EventKind::Upset | EventKind::Beyond => colour::ORANGE,
            EventKind::Lost | EventKind::Violated => colour::VERMILION,
            EventKind::Message => colour::GREY,
            EventKind::SetPoint | EventKind::Regained | EventKind::HeldUp => return None,
        };
        Some(Mark { time: event.time, colour })
    });
    shown.collect()
}

fn range(values: &[f64]) -> (f64, f64) {
    let finite = values.iter().copied().filter(|value| value.is_finite());
    finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
}
