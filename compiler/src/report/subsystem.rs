//! One subsystem: its sets in planes, where its ranges go, and its numbers.

use maud::{Markup, html};

use super::Report;
use super::budget::{self, Budget, Part, Side};
use super::equations::eq;
use super::frame::{Frame, place};
use super::planes::{self, Family, Kind, Plane, Shape};
use super::steady::SteadyStates;
use super::words::{clipped, counted, label, measured};
use crate::network::{Signal, Subsystem};
use crate::summary::short;

/// Subsystems whose sections are open at first.
const MOST_OPEN: usize = 6;
/// Subsystems with figures.
const MOST_DRAWN: usize = 150;

pub fn section(report: &Report) -> Markup {
    let parts = &report.design.network.subsystems;
    let steady = SteadyStates::new(report.design);
    html! {
        section id="subsystems" {
            h2 { "Subsystems" }
            p {
                "A bar is the range of an input or a bounded state. From 0 outwards, each bound gives it away in parts that sum to it: the largest value "
                "at rest for any set-points in Y, the support of Δᵡ, what measured loads add to references, the support of Σ (through K for inputs), and "
                "the tube ℰ (likewise), which is what the tightening X̂ = X ⊖ ℰ, Û = U ⊖ Kℰ takes, split by what acts on it."
            }
            p {
                "A plane shows projections of sets, by their own vertices, which support functions find: outlines are exact to a 2000th of the frame. "
                "Σ and ℰ are about 0: they are what may be added to a reference and to a plan."
            }
            @for (i, s) in parts.iter().enumerate() {
                details.subsystem id=(format!("s-{i}")) open[parts.len() <= MOST_OPEN] {
                    summary { h3 { (s.name) } span.note { (in_short(report, i)) } }
                    @if i < MOST_DRAWN { (figures(report, &steady, i)) }
                    (numbers(report, i))
                }
            }
            @if parts.len() > MOST_DRAWN { p.note { "Figures are drawn for the first " (MOST_DRAWN) " subsystems." } }
        }
    }
}

fn in_short(report: &Report, i: usize) -> String {
    let s = &report.design.network.subsystems[i];
    let sizes = [(s.n(), "state"), (s.m(), "input"), (s.p(), "output"), (s.nz(), "coupling output")];
    let neighbours = counted(s.L.len(), "neighbour");
    sizes.map(|(number, noun)| counted(number, noun)).join(", ") + ", " + &neighbours
}

fn figures(report: &Report, steady: &SteadyStates, i: usize) -> Markup {
    let design = report.design;
    let s = &design.network.subsystems[i];
    let few = design.network.subsystems.len() <= 10;
    let pairs = planes::state_pairs(design, i, if few { 15 } else { 2 });
    let all = s.n() * s.n().saturating_sub(1) / 2;
    html! {
        (ranges(design, i))
        @if !pairs.is_empty() {
            div.planes data-choose="states" {
                h4 { "States" }
                @for axes in &pairs {
                    @let both = planes::states(design, steady, i, *axes);
                    div.pair data-pair=(pair_name(&s.states, *axes)) {
                        (plane(&both.places, "Where states may be", all > pairs.len()))
                        (plane(&both.errors, "How far they may be off, about 0", false))
                    }
                }
            }
        }
        div.charts {
            @if s.m() > 1 { (planes_of("Inputs", &s.inputs, few, |axes| planes::inputs(design, steady, i, axes))) }
            @if s.p() > 1 { (planes_of("Outputs", &s.outputs, few, |axes| planes::outputs(design, i, axes))) }
            @if s.nz() > 1 {
                @let signals: Vec<Signal> = s.coupling_outputs.iter().map(|name| Signal { name: clipped(name, 40), unit: None }).collect();
                (planes_of("Coupling outputs", &signals, few, |axes| planes::coupling_outputs(design, i, axes)))
            }
        }
    }
}

/// Planes of all pairs, or of a few.
fn planes_of(title: &str, signals: &[Signal], few: bool, make: impl Fn([usize; 2]) -> Plane) -> Markup {
    let pairs = (0..signals.len()).flat_map(|b| (0..b).map(move |a| [a, b])).take(if few { 6 } else { 1 });
    html! {
        div.planes data-choose=(title.to_lowercase()) {
            h4 { (title) }
            @for axes in pairs {
                div.pair data-pair=(pair_name(signals, axes)) { (plane(&make(axes), title, false)) }
            }
        }
    }
}

fn pair_name(signals: &[Signal], axes: [usize; 2]) -> String {
    format!("{} and {}", signals[axes[0]].name, signals[axes[1]].name)
}

impl Kind {
    /// Class in the style sheet, meaning, equations.
    fn words(self) -> (&'static str, &'static str, &'static str) {
        match self {
            Self::Limits => ("limits", "limits as given", ""),
            Self::Tightened => ("tightened", "what is left for plans", "(35c), (35d)"),
            Self::SteadyStates => ("steady", "at rest, for all set-points of the network", "(9), (25b)"),
            Self::Tube => ("tube", "off the plan: neighbours and disturbances", "(18), (35a)"),
            Self::Terminal => ("terminal", "off the reference where a plan ends", "(24), (36)"),
            Self::SetPoints => ("steady", "set-points that can be reached", "(25b), (31)"),
            Self::Contract => ("contract", "z − z̃, what neighbours reckon with", "(21)"),
            Self::Reserve => ("reserve", "ẑ − z̃, what a plan may be off", "(22), (35b)"),
        }
    }

    /// As it is seen over these signals.
    fn symbol(self, of: Family) -> &'static str {
        match (self, of) {
            (Self::Limits, Family::Inputs) => "U",
            (Self::Limits, Family::Outputs) => "CX",
            (Self::Limits, _) => "X",
            (Self::Tightened, Family::Inputs) => "Û",
            (Self::Tightened, Family::Outputs) => "CX̂",
            (Self::Tightened, _) => "X̂",
            (Self::SteadyStates, Family::Inputs) => "ũ(Y)",
            (Self::SteadyStates, _) => "x̃(Y)",
            (Self::Tube, Family::States) => "ℰ",
            (Self::Tube, Family::Inputs) => "Kℰ",
            (Self::Tube, _) => "(C_z + D_zK)ℰ",
            (Self::Terminal, Family::States) => "Σ",
            (Self::Terminal, Family::Inputs) => "KΣ",
            (Self::Terminal, _) => "(C_z + D_zK)Σ",
            (Self::SetPoints, _) => "Y",
            (Self::Contract, _) => "Z",
            (Self::Reserve, _) => "Δᶻ",
        }
    }
}

/// Size of a plane's frame.
const WIDTH: f64 = 330.0;
const HEIGHT: f64 = 264.0;

fn plane(plane: &Plane, title: &str, more: bool) -> Markup {
    let frame = Frame { left: 62.0, top: 10.0, width: WIDTH, height: HEIGHT, x: plane.ranges[0], y: plane.ranges[1] };
    let [x, y] = &plane.names;
    html! {
        figure.plane {
            svg.plot viewBox="0 0 404 312" data-frame=(frame.data()) data-kind="plane" data-x=(x) data-y=(y) tabindex="0" role="group" aria-label=(format!("{title}: {x}, {y}")) {
                (frame.axes(&clipped(x, 44), &clipped(y, 34)))
                @for shape in &plane.shapes { (drawn(&frame, plane.of, shape)) }
                (origin(&frame))
                g.cross {}
            }
            figcaption {
                @if plane.of == Family::States { strong { (title) } }
                output.readout { "Point into the plane." }
                ul.legend { @for shape in &plane.shapes { (entry(plane, shape)) } }
                @if more { p { "Further pairs of states are left out of this page." } }
            }
        }
    }
}

fn drawn(frame: &Frame, of: Family, shape: &Shape) -> Markup {
    let ((class, meaning, _), symbol) = (shape.kind.words(), shape.kind.symbol(of));
    let Some(outline) = &shape.outline else { return html! {} };
    html! {
        polygon.shape.(class) points=(frame.points(&outline.vertices)) data-set=(symbol) { title { (symbol) ": " (meaning) } }
    }
}

/// Lines through 0 where the frame shows it.
fn origin(frame: &Frame) -> Markup {
    html! {
        g.origin {
            @if frame.x[0] < 0.0 && frame.x[1] > 0.0 {
                line x1=(place(frame.px(0.0))) x2=(place(frame.px(0.0))) y1=(place(frame.top)) y2=(place(frame.bottom())) {}
            }
            @if frame.y[0] < 0.0 && frame.y[1] > 0.0 {
                line y1=(place(frame.py(0.0))) y2=(place(frame.py(0.0))) x1=(place(frame.left)) x2=(place(frame.right())) {}
            }
        }
    }
}

fn entry(plane: &Plane, shape: &Shape) -> Markup {
    let (class, meaning, equations) = shape.kind.words();
    html! {
        li {
            span.swatch.(class) {} b { (shape.kind.symbol(plane.of)) } " " (meaning) " " (eq(equations))
            @if shape.is_cut { em { " goes on beyond the frame" } }
            @else if shape.outline.is_none() { em { " not found" } }
            @else if plane.hides(shape) { em { " a point at this scale" } }
        }
    }
}

impl Part {
    /// Class in the style sheet, name, equations.
    fn words(self) -> (&'static str, &'static str, &'static str) {
        match self {
            Self::SetPoints => ("steady", "at rest, for set-points in Y", "(9), (25b)"),
            Self::Moving => ("moving", "references that move: Δᵡ", "(12), (13)"),
            Self::Loads => ("loads", "references that follow measured loads", "(25b')"),
            Self::Terminal => ("terminal", "plans off their references: Σ", "(24), (36)"),
            Self::Disturbances => ("disturbances", "tube, by its own disturbances", "(18), (20')"),
            Self::Neighbours => ("tube", "tube, by its neighbours", "(18), (20)"),
            Self::Left => ("left", "left over", "(25b)"),
        }
    }
}

/// Stacked bars of inputs and bounded states.
fn ranges(design: &crate::design::Design, i: usize) -> Markup {
    let (inputs, states) = (budget::inputs(design, i), budget::states(design, i));
    let count = inputs.len() + states.len();
    if count == 0 {
        return html! { p.note { "Neither inputs nor states are bounded." } };
    }
    let height = 8.0 + ROW * count as f64;
    let all: Vec<&Budget> = inputs.iter().chain(&states).collect();
    let used: Vec<Part> = Part::ALL.into_iter().filter(|part| all.iter().any(|budget| budget.takes(*part))).collect();
    html! {
        h4 { "Where the ranges go" }
        figure {
            svg.bars viewBox=(format!("0 0 860 {}", place(height))) role="group" aria-label="Where the ranges of inputs and states go" {
                @for (k, budget) in all.iter().enumerate() { (bar(budget, 4.0 + ROW * k as f64)) }
            }
            figcaption {
                output.readout { "Point at a part of a bar." }
                ul.legend {
                    @for part in used { @let (class, name, equations) = part.words(); li { span.swatch.(class) {} (name) " " (eq(equations)) } }
                }
            }
        }
        (parts_table(&all))
    }
}

/// Height of a bar with its room.
const ROW: f64 = 42.0;
const BAR_LEFT: f64 = 130.0;
const BAR_WIDTH: f64 = 700.0;

impl Budget {
    fn sides(&self) -> impl Iterator<Item = (f64, &Side)> {
        let low = self.low.iter().map(|side| (-1.0, side));
        low.chain(self.high.iter().map(|side| (1.0, side)))
    }

    /// More than can be seen.
    fn takes(&self, part: Part) -> bool {
        self.sides().any(|(_, side)| side.parts[part as usize] > 5e-4 * side.limit)
    }
}

fn bar(budget: &Budget, top: f64) -> Markup {
    let reach = |side: &Option<Side>| side.as_ref().map_or(0.0, |side| side.limit);
    let (low, high) = (reach(&budget.low), reach(&budget.high));
    let at = |value: f64| BAR_LEFT + BAR_WIDTH * (value + low) / (low + high);
    let unit = budget.unit.as_deref();
    html! {
        text.name x=(place(BAR_LEFT - 8.0)) y=(place(top + 16.0)) text-anchor="end" { (clipped(&budget.name, 20)) title { (budget.name) } }
        @for (sign, side) in budget.sides() {
            @for (part, [from, to]) in stacked(side) {
                @let (class, name, _) = part.words();
                @let ends = [at(sign * from), at(sign * to)];
                @if (ends[1] - ends[0]).abs() > 0.02 {
                    rect.part.(class) tabindex="0" x=(place(ends[0].min(ends[1]))) y=(place(top)) width=(place((ends[1] - ends[0]).abs())) height="22" {
                        title {
                            (budget.name) @if sign < 0.0 { " below 0: " } @else { " above 0: " }
                            (measured(to - from, unit)) " of " (measured(side.limit, unit)) " (" (percent((to - from) / side.limit)) "), " (name)
                        }
                    }
                }
            }
        }
        @if budget.low.is_some() { text.end x=(place(at(-low))) y=(place(top + 34.0)) { (measured(-low, unit)) } }
        line.zero x1=(place(at(0.0))) x2=(place(at(0.0))) y1=(place(top - 3.0)) y2=(place(top + 25.0)) {}
        @if zero_is_apart(low, high) { text.end x=(place(at(0.0))) y=(place(top + 34.0)) text-anchor="middle" { "0" } }
        @if budget.high.is_some() { text.end x=(place(at(high))) y=(place(top + 34.0)) text-anchor="end" { (measured(high, unit)) } }
    }
}

/// Whether a number under 0 stands clear of those under the ends.
fn zero_is_apart(low: f64, high: f64) -> bool {
    let share = low / (low + high);
    (0.12..0.88).contains(&share)
}

/// Each part with its ends, outwards.
fn stacked(side: &Side) -> Vec<(Part, [f64; 2])> {
    let mut end = 0.0;
    let next = |(part, width): (Part, f64)| {
        let from = end;
        end += width;
        (part, [from, end])
    };
    Part::ALL.into_iter().zip(side.parts).map(next).collect()
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

fn parts_table(all: &[&Budget]) -> Markup {
    html! {
        details {
            summary { "In numbers" }
            div.wide {
                table {
                    thead { tr { th scope="col" { "Bound" } th scope="col" { "Limit" } @for part in Part::ALL { th scope="col" { (part.words().1) } } } }
                    tbody {
                        @for budget in all {
                            @for (sign, side) in budget.sides() {
                                tr {
                                    td { (budget.name) @if sign < 0.0 { " below 0" } @else if budget.low.is_some() { " above 0" } }
                                    td.number { (measured(side.limit, budget.unit.as_deref())) }
                                    @for part in side.parts { td.number { (short(part)) } }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Half-widths and ranges of every signal, and what the controller is.
fn numbers(report: &Report, i: usize) -> Markup {
    let design = report.design;
    let (s, sized) = (&design.network.subsystems[i], &design.sizing.subsystems[i]);
    html! {
        details {
            summary { "Sets and controller in numbers" }
            div.wide {
                table {
                    thead { tr { th scope="col" { "State" } th scope="col" { "Σ reaches, alone" } th scope="col" { "ℰ lies within" } } }
                    tbody {
                        @let hull = sized.E.hull();
                        @for (k, signal) in s.states.iter().enumerate() {
                            tr { td { (label(signal)) } td.number { "±" (short(sized.upset[k])) } td.number { "±" (short(hull[k])) } }
                        }
                    }
                }
                @if s.nz() > 0 {
                    table {
                        thead { tr { th scope="col" { "Coupling output" } th scope="col" { "Z" } th scope="col" { "reserve Δᶻ" } } }
                        tbody {
                            @for (k, name) in s.coupling_outputs.iter().enumerate() {
                                tr { td { (name) } td.number { "±" (short(sized.zeta[k])) } td.number { "±" (short(sized.dz[k])) } }
                            }
                        }
                    }
                }
                (gains(report, i, s))
            }
        }
    }
}

fn gains(report: &Report, i: usize, s: &Subsystem) -> Markup {
    let gains = &report.design.gains.subsystems[i];
    let named = [("K", &gains.K, "(17)"), ("Kˣ", &gains.Kx, "(7)"), ("Kᵉ", &gains.Ke, "(7)")];
    html! {
        table {
            thead { tr { th scope="col" { "Gain" } @for input in &s.inputs { th scope="col" { "for " (input.name) } } th scope="col" {} } }
            tbody {
                @for (name, gain, equation) in named {
                    tr {
                        td { (name) }
                        @for row in gain.row_iter() { td.number { "[" (row.iter().map(|entry| short(*entry)).collect::<Vec<_>>().join(", ")) "]" } }
                        td { (eq(equation)) }
                    }
                }
            }
        }
    }
}
