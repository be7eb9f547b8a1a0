//! Y: which set-points can be reached, and how fast.
#![expect(non_snake_case, reason = "the paper's symbols")]

use maud::{Markup, html};
use nalgebra::DVector;

use super::Report;
use super::equations::eq;
use super::words::{label, measured};
use crate::convex::Polytope;
use crate::summary::short;

/// Rows before the table is folded up.
const MOST_OPEN: usize = 24;

/// One output.
struct Row {
    subsystem: String,
    name: String,
    unit: Option<String>,
    Y: [f64; 2],
    /// What X leaves of it; infinite where nothing bounds it.
    bounds: [f64; 2],
    cover: Option<(f64, f64)>,
    seconds: f64,
}

pub fn section(report: &Report) -> Markup {
    let rows: Vec<Row> = (0..report.design.network.subsystems.len()).flat_map(|i| rows(report, i)).collect();
    html! {
        section id="set-points" {
            h2 { "Set-points" }
            p { (reach(report)) " " (eq("(25b), (31)")) "." }
            details open[rows.len() <= MOST_OPEN] {
                summary { "Ranges of all outputs" }
                div.wide {
                    table {
                        thead { tr { th scope="col" { "Subsystem" } th scope="col" { "Output" } th scope="col" { "from" } th scope="col" { "to" } th scope="col" { "of what its bounds leave" } th scope="col" { "crossed in" } th scope="col" { "asked for" } } }
                        tbody { @for row in &rows { (drawn(row)) } }
                    }
                }
                p.note { "Bar: the range X leaves of the output, in it the part that Y covers, and 0. Crossing at ε per step " (eq("(6), (30)")) "." }
            }
        }
    }
}

/// What may be reached.
fn reach(report: &Report) -> &'static str {
    let network = &report.design.network;
    if network.coupling_constraints.is_empty() && network.changing_constraints.is_empty() {
        "Every combination of set-points within these ranges Y can be reached; one outside is followed to the nearest point of Y"
    } else {
        "Set-points within these ranges Y can be reached as far as coupling constraints let them; one outside is followed towards the nearest point of Y"
    }
}

fn rows(report: &Report, i: usize) -> Vec<Row> {
    let design = report.design;
    let (s, sized) = (&design.network.subsystems[i], &design.sizing.subsystems[i]);
    let X = Polytope { H: s.X.H.clone(), h: s.X.h.clone() };
    let reach = |row: DVector<f64>| X.support(&row).map_or(f64::INFINITY, |(value, _)| value);
    let of = |k: usize| {
        let row = s.C.row(k).transpose();
        let steps = ((sized.Y.max[k] - sized.Y.min[k]) / design.sizing.epsilon).ceil();
        Row {
            subsystem: s.name.clone(),
            name: label(&s.outputs[k]),
            unit: s.outputs[k].unit.clone(),
            Y: [sized.Y.min[k], sized.Y.max[k]],
            bounds: [-reach(-&row), reach(row)],
            cover: s.cover[k],
            seconds: steps * design.network.sample_time,
        }
    };
    (0..s.p()).map(of).collect()
}

fn drawn(row: &Row) -> Markup {
    let unit = row.unit.as_deref();
    html! {
        tr {
            td { (row.subsystem) } td { (row.name) }
            td.number { (measured(row.Y[0], unit)) } td.number { (measured(row.Y[1], unit)) }
            td { (bar(row)) }
            td.number { (short(row.seconds)) " s" }
            td.number { @if let Some((low, high)) = row.cover { (short(low)) " to " (short(high)) } }
        }
    }
}

/// Of the output's bounds; where one is missing, the larger end of Y takes its place.
fn bar(row: &Row) -> Markup {
    let [low, high] = [0, 1].map(|end| if row.bounds[end].is_finite() { row.bounds[end] } else { 1.3 * row.Y[end] });
    let at = |value: f64| (100.0 * (value - low) / (high - low)).clamp(0.0, 100.0);
    let ends = row.Y.map(at);
    html! {
        span.range title=(format!("{} to {} of {} to {}", short(row.Y[0]), short(row.Y[1]), short(row.bounds[0]), short(row.bounds[1]))) {
            span.covered style=(format!("left:{:.1}%;width:{:.1}%", ends[0], (ends[1] - ends[0]).max(0.5))) {}
            span.zero style=(format!("left:{:.1}%", at(0.0))) {}
        }
    }
}
