//! What epsilon, and reserve, cost in set-points.
#![expect(non_snake_case, reason = "the paper's symbols")]

use maud::{Markup, html};
use nalgebra::DVector;

use super::Report;
use super::equations::eq;
use super::frame::{Frame, place};
use super::words::{clipped, labelled};
use crate::convex::Box as Intervals;
use crate::sizing::{Sizes, SpeedPoint};
use crate::summary::short;

/// Outputs that get a chart of their own.
const MOST_OUTPUTS: usize = 8;

pub fn section(report: &Report) -> Markup {
    let sizing = &report.design.sizing;
    html! {
        section id="speed" {
            h2 { "Speed, reserve and set-points" }
            @if report.speed.is_empty() && sizing.trade.is_empty() {
                p.note { "Of a network this large, other designs are not computed for comparison." }
            } @else {
                p {
                    "Faster references and larger reserve are paid for with set-points " (eq("(25b)")) ". The design sits at ε = "
                    (short(sizing.epsilon)) " (marked); for other ε all sets are chosen anew, by the same weights."
                }
                div.charts {
                    @if !report.speed.is_empty() { (widths(report)) }
                    @if !sizing.trade.is_empty() { (reserve(report)) }
                    @if !report.speed.is_empty() {
                        @for (i, k) in outputs(report).into_iter().take(MOST_OUTPUTS) { (ends(report, i, k)) }
                    }
                }
            }
        }
    }
}

fn outputs(report: &Report) -> Vec<(usize, usize)> {
    let parts = report.design.network.subsystems.iter().enumerate();
    parts.flat_map(|(i, s)| (0..s.p()).map(move |k| (i, k))).collect()
}

fn geometric_mean(values: impl Iterator<Item = f64>) -> f64 {
    let logs: Vec<f64> = values.map(|value| value.max(0.0).ln()).collect();
    (logs.iter().sum::<f64>() / logs.len() as f64).exp()
}

/// Of the widths of all outputs.
fn mean_width<'a>(Y: impl Iterator<Item = &'a Intervals>) -> f64 {
    geometric_mean(Y.flat_map(|Y| Y.max.iter().zip(&Y.min).map(|(max, min)| max - min)))
}

fn mean_reserve<'a>(dz: impl Iterator<Item = &'a DVector<f64>>) -> f64 {
    geometric_mean(dz.flat_map(|dz| dz.iter().copied()))
}

fn widths(report: &Report) -> Markup {
    let all = &report.design.sizing.subsystems;
    let (width, reserve) = (mean_width(all.iter().map(|s| &s.Y)), mean_reserve(all.iter().map(|s| &s.dz)));
    let curve = |of: &dyn Fn(&Sizes) -> f64| -> Vec<[f64; 2]> {
        let point = |point: &SpeedPoint| point.sizes.as_ref().map(|found| [point.epsilon, of(found)]);
        report.speed.iter().filter_map(point).collect()
    };
    let mut curves = vec![("width of Y".to_owned(), "steady", curve(&|found| mean_width(found.Y.iter()) / width))];
    if reserve.is_finite() && reserve > 0.0 {
        curves.push(("reserve Δᶻ".to_owned(), "reserve", curve(&|found| mean_reserve(found.dz.iter()) / reserve)));
    }
    let chart = Chart {
        title: "Width of Y, and reserve, against ε",
        names: ["ε per step".to_owned(), "relative to this design".to_owned()],
        curves,
        mark: (report.design.sizing.epsilon, vec![1.0]),
        band: false,
    };
    chart.drawn(html! {
        p {
            "Geometric means over all outputs: " span.swatch.steady {} "widths of their ranges, " span.swatch.reserve {} "reserve Δᶻ. "
            (open_end(report))
        }
    })
}

/// Where no design exists beyond the curve.
fn open_end(report: &Report) -> String {
    let last = report.speed.iter().rev().find(|point| point.sizes.is_some());
    last.map_or(String::new(), |point| format!("Beyond about ε = {} there is no design.", short(point.epsilon)))
}

fn ends(report: &Report, i: usize, k: usize) -> Markup {
    let s = &report.design.network.subsystems[i];
    let of = |end: fn(&Intervals) -> &DVector<f64>| -> Vec<[f64; 2]> {
        let point = |point: &SpeedPoint| point.sizes.as_ref().map(|found| [point.epsilon, end(&found.Y[i])[k]]);
        report.speed.iter().filter_map(point).collect()
    };
    let Y = &report.design.sizing.subsystems[i].Y;
    let title = format!("Y of {} in {}", s.outputs[k].name, s.name);
    let chart = Chart {
        title: &title,
        names: ["ε per step".to_owned(), labelled(&s.outputs[k].name, s.outputs[k].unit.as_deref())],
        curves: vec![
            ("upper end".to_owned(), "steady", of(|Y| &Y.max)),
            ("lower end".to_owned(), "steady", of(|Y| &Y.min)),
        ],
        mark: (report.design.sizing.epsilon, vec![Y.max[k], Y.min[k]]),
        band: true,
    };
    chart.drawn(html! {})
}

fn reserve(report: &Report) -> Markup {
    let found = report.design.sizing.trade.iter().filter_map(|point| Some([point.reserve, point.y_volume?]));
    let outputs = outputs(report).len().max(1) as f64;
    let curve: Vec<[f64; 2]> = found.map(|[reserve, volume]| [reserve, volume.powf(1.0 / outputs)]).collect();
    let chart = Chart {
        title: "Width of Y against reserve",
        names: ["reserve Δᶻ, relative".to_owned(), "mean width of Y, relative".to_owned()],
        curves: vec![("width of Y".to_owned(), "reserve", curve)],
        mark: (1.0, vec![1.0]),
        band: false,
    };
    chart.drawn(html! { p { "All of Δᶻ times a factor, at the ε of the design: upsets it can absorb " (eq("(22), (23)")) "." } })
}

/// Curves over one quantity, and where the design is on them.
struct Chart<'a> {
    title: &'a str,
    names: [String; 2],
    /// Name, class, points.
    curves: Vec<(String, &'static str, Vec<[f64; 2]>)>,
    mark: (f64, Vec<f64>),
    /// Whether what is between the first two curves is filled.
    band: bool,
}

impl Chart<'_> {
    fn drawn(&self, caption: Markup) -> Markup {
        let frame = self.frame();
        let [x, y] = &self.names;
        html! {
            figure.plane {
                svg.plot viewBox="0 0 404 250" data-frame=(frame.data()) data-kind="curve" data-x=(x) data-y=(y) tabindex="0" role="group" aria-label=(self.title) {
                    (frame.axes(x, &clipped(y, 30)))
                    @if self.band { (self.between(&frame)) }
                    line.mark x1=(place(frame.px(self.mark.0))) x2=(place(frame.px(self.mark.0))) y1=(place(frame.top)) y2=(place(frame.bottom())) {}
                    @for (name, class, points) in &self.curves {
                        polyline.curve.(class) points=(frame.points(points)) data-name=(name) {}
                        @for point in points { circle.dot.(class) cx=(place(frame.px(point[0]))) cy=(place(frame.py(point[1]))) r="2" {} }
                    }
                    @for y in &self.mark.1 { circle.here cx=(place(frame.px(self.mark.0))) cy=(place(frame.py(*y))) r="5" { title { "this design" } } }
                    g.cross {}
                }
                figcaption { strong { (self.title) } output.readout { "Point into the chart." } (caption) }
            }
        }
    }

    fn frame(&self) -> Frame {
        let all: Vec<[f64; 2]> = self.curves.iter().flat_map(|(_, _, points)| points.iter().copied()).collect();
        let marks = self.mark.1.iter().map(|y| [self.mark.0, *y]);
        let all: Vec<[f64; 2]> = all.into_iter().chain(marks).collect();
        let range =
            |axis: usize| all.iter().fold([0.0, 0.0], |[low, high]: [f64; 2], p| [low.min(p[axis]), high.max(p[axis])]);
        let with_room = |[low, high]: [f64; 2]| {
            let width = if high > low { high - low } else { 1.0 };
            [if low < 0.0 { low - 0.05 * width } else { low }, high + 0.05 * width]
        };
        Frame { left: 62.0, top: 10.0, width: 330.0, height: 202.0, x: with_room(range(0)), y: with_room(range(1)) }
    }

    fn between(&self, frame: &Frame) -> Markup {
        let [(_, class, upper), (_, _, lower), ..] = &self.curves[..] else { return html! {} };
        let around: Vec<[f64; 2]> = upper.iter().chain(lower.iter().rev()).copied().collect();
        html! { polygon.band.(class) points=(frame.points(&around)) {} }
    }
}
