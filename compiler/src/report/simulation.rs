//! A closed loop over time, with its limits.

use maud::{Markup, html};

use super::curve::{held, thinned};
use super::equations::eq;
use super::frame::{Frame, padded, place, ticks};
use super::words::{clipped, counted, labelled, measured};
use crate::simulate::{Column, CouplingTrack, Event, EventKind, History, Margin, Track};
use crate::summary::short;

/// Subsystems whose histories are drawn, and how many are open at first.
const MOST_DRAWN: usize = 120;
const MOST_OPEN: usize = 4;
/// Points of all curves together.
const POINTS: usize = 120_000;
/// Events that are listed, and that are marked in every chart.
const MOST_LISTED: usize = 300;
const MOST_MARKED: usize = 30;

pub fn section(history: &History) -> Markup {
    let drawing = Drawing::new(history);
    html! {
        section id="simulation" {
            h2 { "Simulation" }
            p {
                "Scenario “" (history.scenario) "”: " (counted(history.steps(), "step")) ", " (short(history.end())) " s, seed " (history.seed) ". "
                (outcome(history))
            }
            (least_margins(history))
            @for (i, track) in history.subsystems.iter().take(MOST_DRAWN).enumerate() {
                details.subsystem open[history.subsystems.len() <= MOST_OPEN] {
                    summary { h3 { (track.name) } span.note { (said(track)) } }
                    (drawing.track(track, i))
                }
            }
            @if history.subsystems.len() > MOST_DRAWN { p.note { "Histories are drawn for the first " (MOST_DRAWN) " subsystems." } }
            @if !history.couplings.is_empty() {
                details open[history.couplings.len() <= MOST_OPEN] {
                    summary { h3 { "Coupling constraints" } span.note { "what is left of each in the true outputs" } }
                    figure.charts-over-time { @for coupling in history.couplings.iter().take(MOST_DRAWN) { (drawing.coupling(coupling)) } (caption()) }
                }
            }
            (events(history))
        }
    }
}

/// Whether everything was kept, in a sentence.
fn outcome(history: &History) -> String {
    let all =
        history.subsystems.iter().flat_map(|track| &track.margins).chain(history.couplings.iter().map(|c| &c.margin));
    let violated = all
        .filter(|margin| margin.least().is_some_and(|(_, value)| value.is_nan() || value < -1e-9 * margin.limit.abs()))
        .count();
    let beyond = history.assumed.iter().filter(|assumed| !**assumed).count();
    let unguaranteed = (0..history.steps()).filter(|&step| !history.is_guaranteed(step)).count();
    let kept = match violated {
        0 => "Every limit was kept".to_owned(),
        1 => "1 limit was violated".to_owned(),
        count => format!("{count} limits were violated"),
    };
    let beyond = match beyond {
        0 => "what acted on the network was within what the design assumes at every step".to_owned(),
        count => {
            format!("what acted on the network was beyond what the design assumes before {}", counted(count, "step"))
        }
    };
    let guarantee = match unguaranteed {
        0 => "every controller said so at every step".to_owned(),
        count => format!("controllers did not vouch for the guarantee at {}", counted(count, "step")),
    };
    format!("{kept}; {beyond}; {guarantee}.")
}

fn said(track: &Track) -> String {
    let guaranteed = track.guaranteed.iter().filter(|guaranteed| **guaranteed).count();
    format!("guaranteed at {guaranteed} of {}", counted(track.guaranteed.len(), "step"))
}

/// Limits with the least left, relative.
fn least_margins(history: &History) -> Markup {
    let of_track = |track: &Track| -> Vec<(String, Margin)> {
        track.margins.iter().map(|margin| (track.name.clone(), margin.clone())).collect()
    };
    let couplings = history.couplings.iter().map(|coupling| (coupling.members.join(", "), coupling.margin.clone()));
    let all = history.subsystems.iter().flat_map(of_track).chain(couplings);
    let share = |margin: &Margin, value: f64| value / margin.limit.abs().max(1e-300);
    let mut rows: Vec<(String, Margin, usize, f64)> =
        all.filter_map(|(name, margin)| margin.least().map(|(step, value)| (name, margin, step, value))).collect();
    rows.sort_by(|a, b| share(&a.1, a.3).total_cmp(&share(&b.1, b.3)));
    rows.truncate(8);
    html! {
        details {
            summary { "Limits that came closest" }
            div.wide {
                table {
                    thead { tr { th scope="col" { "Subsystem" } th scope="col" { "Limit" } th scope="col" { "Least left" } th scope="col" { "of the limit" } th scope="col" { "at" } } }
                    tbody {
                        @for (name, margin, step, value) in &rows {
                            tr {
                                td { (name) } td { (margin.row) } td.number { (measured(*value, margin.unit.as_deref())) }
                                td.number { (short(100.0 * share(margin, *value))) " %" } td.number { (short(history.time[*step])) " s" }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn caption() -> Markup {
    html! { figcaption { output.readout { "Point into a chart." } } }
}

/// What all charts share.
struct Drawing<'a> {
    history: &'a History,
    /// Points per curve.
    most: usize,
    marks: Vec<(f64, &'a Event)>,
}

/// One line of a chart.
struct Line<'a> {
    name: String,
    class: &'static str,
    values: &'a [f64],
    /// Constant between samples.
    held: bool,
}

impl<'a> Drawing<'a> {
    fn new(history: &'a History) -> Self {
        let drawn = history.subsystems.iter().take(MOST_DRAWN);
        let curves: usize = drawn.map(|t| 3 * t.outputs.len() + 2 * t.inputs.len() + 2 * t.states.len()).sum();
        let telling = history.events.iter().filter(|event| event.kind != EventKind::SetPoint);
        let marks = telling.take(MOST_MARKED).map(|event| (event.time, event)).collect();
        Self { history, most: (POINTS / (curves + history.couplings.len()).max(1)).clamp(40, 900), marks }
    }

    fn track(&self, track: &Track, i: usize) -> Markup {
        html! {
            figure.charts-over-time {
                @for k in 0..track.outputs.len() {
                    (self.chart(&track.outputs[k], &[
                        line("ỹ", "moving", &track.y_ref[k], true), line("set-point", "goal", &track.set_points[k], true), line("y", "steady", &track.outputs[k], false),
                    ], "Y", i))
                }
                @for k in 0..track.inputs.len() {
                    (self.chart(&track.inputs[k], &[line("ũ", "moving", &track.u_ref[k], true), line("u", "tube", &track.inputs[k], true)], "U", i))
                }
                @for load in &track.loads { (self.chart(load, &[line("d", "loads", load, true)], "bounds", i)) }
                (self.strip(track))
                figcaption {
                    output.readout { "Point into a chart." }
                    ul.legend {
                        li { span.swatch.steady {} "output y, in the band Y of set-points that can be reached " (eq("(31)")) }
                        li { span.swatch.goal {} "set-point" }
                        li { span.swatch.moving {} "references ỹ, ũ " (eq("(7), (29)")) }
                        li { span.swatch.tube {} "input u " (eq("(38)")) " between its limits U" }
                    }
                }
            }
            details {
                summary { "States" }
                figure.charts-over-time {
                    @for k in 0..track.states.len() {
                        (self.chart(&track.states[k], &[line("x̃", "moving", &track.x_ref[k], false), line("x", "disturbances", &track.states[k], false)], "X", i))
                    }
                    figcaption {
                        output.readout { "Point into a chart." }
                        ul.legend {
                            li { span.swatch.disturbances {} "state x between its limits X" }
                            li { span.swatch.moving {} "reference x̃ " (eq("(7)")) }
                        }
                    }
                }
            }
        }
    }

    fn coupling(&self, coupling: &CouplingTrack) -> Markup {
        let name = format!("{} left", coupling.name);
        let column =
            Column { name, unit: coupling.margin.unit.clone(), low: Some(0.0), high: None, values: Vec::new() };
        let left = Line { name: "left".to_owned(), class: "reserve", values: &coupling.margin.values, held: false };
        self.chart(&column, &[left], "limit", usize::MAX)
    }

    /// `column` says what it is and where its limits are.
    fn chart(&self, column: &Column, lines: &[Line], limits: &str, subsystem: usize) -> Markup {
        let frame = self.frame(column, lines);
        let name = labelled(&column.name, column.unit.as_deref());
        html! {
            svg.plot.time viewBox="0 0 860 150" data-frame=(frame.data()) data-kind="curve" data-x="t [s]" data-y=(name) tabindex="0" role="group" aria-label=(format!("{name} over time")) {
                (self.band(&frame, column, limits))
                (frame.axes("", &clipped(&name, 18)))
                @for (time, event) in self.marks.iter().filter(|(_, event)| event.subsystem.is_none_or(|of| of == subsystem)) {
                    line.event x1=(place(frame.px(*time))) x2=(place(frame.px(*time))) y1=(place(frame.top)) y2=(place(frame.bottom())) { title { (short(*time)) " s: " (event.words) } }
                }
                @for line in lines { polyline.curve.(line.class) points=(frame.points(&self.points(line))) data-name=(line.name) {} }
                g.cross {}
            }
        }
    }

    fn points(&self, line: &Line) -> Vec<[f64; 2]> {
        let pairs: Vec<[f64; 2]> = self.history.time.iter().zip(line.values).map(|(t, v)| [*t, *v]).collect();
        let pairs = if line.held { held(&pairs, self.history.end()) } else { pairs };
        thinned(&pairs, self.most)
    }

    /// Around the curves, and around limits that are not far from them.
    fn frame(&self, column: &Column, lines: &[Line]) -> Frame {
        let finite = lines.iter().flat_map(|line| line.values).copied().filter(|value| value.is_finite());
        let [low, high] = finite.fold([0.0, 0.0], |[low, high]: [f64; 2], value| [low.min(value), high.max(value)]);
        let width = (high - low).max(1e-9);
        let near = |limit: &f64| *limit > low - 4.0 * width && *limit < high + 4.0 * width;
        let low = column.low.filter(near).map_or(low, |limit| low.min(limit));
        let high = column.high.filter(near).map_or(high, |limit| high.max(limit));
        let x = [0.0, self.history.end().max(1e-9)];
        Frame { left: 62.0, top: 8.0, width: 780.0, height: 118.0, x, y: padded([low, high], 0.07) }
    }

    /// What is allowed, and lines at its ends.
    fn band(&self, frame: &Frame, column: &Column, limits: &str) -> Markup {
        let [low, high] =
            [column.low.unwrap_or(frame.y[0]).max(frame.y[0]), column.high.unwrap_or(frame.y[1]).min(frame.y[1])];
        let unit = column.unit.as_deref();
        html! {
            @if (column.low.is_some() || column.high.is_some()) && high > low {
                rect.allowed x=(place(frame.left)) y=(place(frame.py(high))) width=(place(frame.width)) height=(place(frame.py(low) - frame.py(high))) {}
            }
            @for limit in column.low.iter().chain(&column.high).filter(|limit| (frame.y[0]..=frame.y[1]).contains(*limit)) {
                line.limit x1=(place(frame.left)) x2=(place(frame.right())) y1=(place(frame.py(*limit))) y2=(place(frame.py(*limit))) {
                    title { "end of " (limits) ": " (measured(*limit, unit)) }
                }
            }
        }
    }

    /// What the controller said at every step, runs of equal words as one field.
    fn strip(&self, track: &Track) -> Markup {
        let x = [0.0, self.history.end().max(1e-9)];
        let frame = Frame { left: 62.0, top: 4.0, width: 780.0, height: 14.0, x, y: [0.0, 1.0] };
        let end = |step: usize| self.history.time.get(step).copied().unwrap_or(self.history.end());
        html! {
            svg.strip viewBox="0 0 860 38" role="group" aria-label="What the controller said" {
                text.name x="56" y="15" text-anchor="end" { "status" }
                @for (from, to) in runs(track, self.most.max(200)) {
                    @let (left, right) = (frame.px(end(from)), frame.px(end(to)));
                    rect.status.lost[!track.guaranteed[from]] x=(place(left)) y="4" width=(place((right - left).max(0.4))) height="14" {
                        title { (short(end(from))) " s to " (short(end(to))) " s: " (track.words[from]) }
                    }
                }
                @for t in ticks(x, 8) { text.tick x=(place(frame.px(t))) y="32" text-anchor="middle" { (short(t)) } }
                text.tick x="56" y="32" text-anchor="end" { "t [s]" }
            }
        }
    }
}

fn line<'a>(symbol: &str, class: &'static str, column: &'a Column, held: bool) -> Line<'a> {
    let name = if symbol == column.name { symbol.to_owned() } else { format!("{symbol}: {}", column.name) };
    Line { name, class, values: &column.values, held }
}

/// First and past-the-end step of each run of equal words; where there are too many, of equal guarantees.
fn runs(track: &Track, most: usize) -> Vec<(usize, usize)> {
    let split = |same: &dyn Fn(usize, usize) -> bool| {
        let mut runs: Vec<(usize, usize)> = Vec::new();
        for step in 0..track.words.len() {
            match runs.last_mut() {
                Some((from, to)) if same(*from, step) => *to = step + 1,
                _ => runs.push((step, step + 1)),
            }
        }
        runs
    };
    let by_words = split(&|a, b| track.words[a] == track.words[b] && track.guaranteed[a] == track.guaranteed[b]);
    if by_words.len() <= most { by_words } else { split(&|a, b| track.guaranteed[a] == track.guaranteed[b]) }
}

fn events(history: &History) -> Markup {
    let name = |event: &Event| event.subsystem.and_then(|i| history.subsystems.get(i)).map_or("", |track| &*track.name);
    let more = history.events.len().saturating_sub(MOST_LISTED);
    html! {
        @if !history.events.is_empty() {
            details {
                summary { (counted(history.events.len(), "event")) }
                div.wide {
                    table {
                        thead { tr { th scope="col" { "t" } th scope="col" { "Step" } th scope="col" { "Subsystem" } th scope="col" { "What happened" } } }
                        tbody {
                            @for event in history.events.iter().take(MOST_LISTED) {
                                tr.alarm[matches!(event.kind, EventKind::Violated | EventKind::Lost | EventKind::Beyond)] {
                                    td.number { (short(event.time)) " s" } td.number { (event.step) } td { (name(event)) } td { (event.words) }
                                }
                            }
                        }
                    }
                }
                @if more > 0 { p.note { "and " (more) " more" } }
            }
        }
    }
}
