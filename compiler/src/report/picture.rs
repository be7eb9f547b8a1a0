//! The network as nodes and arrows, or where it is large as a matrix.

use maud::{Markup, html};

use super::equations::eq;
use super::frame::place;
use super::graph::{Graph, Link};
use super::layout::Layout;
use super::words::{clipped, counted};
use crate::design::Design;
use crate::summary::short;

/// Subsystems that are drawn as nodes.
const MOST_NODES: usize = 60;
/// Arrows that carry their gain as text.
const MOST_LABELS: usize = 40;
/// Arrows that are listed.
const MOST_LISTED: usize = 400;

pub fn section(design: &Design) -> Markup {
    let graph = Graph::new(design);
    let names: Vec<&str> = design.network.subsystems.iter().map(|s| s.name.as_str()).collect();
    html! {
        section id="network" {
            h2 { "Network" }
            p { (sentence(&graph, &names, design.sets.rho_small_gain)) }
            figure {
                @if graph.count <= MOST_NODES { (nodes(&graph, &names)) } @else { (matrix(&graph, &names)) }
                figcaption {
                    output.readout { "Point at an arrow or a subsystem." }
                    @if graph.count <= MOST_NODES { (nodes_caption(&graph)) } @else { (matrix_caption()) }
                }
            }
            (list(&graph, &names))
        }
    }
}

fn sentence(graph: &Graph, names: &[&str], radius: f64) -> String {
    let couplings = if graph.links.is_empty() {
        "No subsystem acts on another one through its dynamics".to_owned()
    } else {
        format!("{} by which subsystems act on each other", counted(graph.links.len(), "coupling"))
    };
    let critical = graph.critical.as_ref().map_or(String::new(), |critical| {
        let round = critical.members.iter().chain(&critical.members[..1]).map(|&k| names[k]);
        format!(
            ". The critical loop is {}: its gain is {}, {} per arrow; the whole network's is {}, and has to be below 1",
            round.collect::<Vec<_>>().join(" → "),
            short(critical.gain),
            short(critical.mean()),
            short(radius)
        )
    });
    let shared = match graph.shared.len() {
        0 => String::new(),
        count => format!("; {} in a coupling constraint together", counted(count, "pair")),
    };
    format!("{couplings}{shared}{critical}.")
}

fn nodes_caption(graph: &Graph) -> Markup {
    html! {
        p {
            @if !graph.links.is_empty() {
                "An arrow from j to i is a coupling L" sub { "ij" } " " (eq("(1), (2)")) "; its number and width are the largest entry of S"
                sub { "ij" } " = Σ" sub { "k" } "|(C" sub { "zi" } " + D" sub { "zi" } "K" sub { "i" } ") F" sub { "ii" } sup { "k" }
                " E" sub { "i" } " L" sub { "ij" } "|, the small-gain matrix of Assumption 4, which closes " (eq("(21)")) " for boxes Z. "
            }
            @if graph.critical.is_some() { "The critical loop is drawn in vermilion. " }
            @if !graph.shared.is_empty() { "Dashed lines join subsystems in one coupling constraint " (eq("(3)")) "." }
        }
    }
}

fn matrix_caption() -> Markup {
    html! {
        p {
            "Row i, column j: the largest entry of S" sub { "ij" } ", what j does to i, the darker the stronger (Assumption 4, " (eq("(21)"))
            "), in the order of the file. The critical loop is drawn in vermilion."
        }
    }
}

struct Canvas {
    places: Vec<[f64; 2]>,
    /// Half of a node.
    half: [f64; 2],
    font: f64,
    size: [f64; 2],
}

impl Canvas {
    fn new(graph: &Graph, names: &[&str]) -> Self {
        let layout = Layout::new(graph.count, &graph.pairs());
        let [width, height] = layout.size();
        let longest = names.iter().map(|name| clipped(name, LETTERS).chars().count()).max().unwrap_or(1) as f64;
        let font = if graph.count > 24 { 10.0 } else { 13.0 };
        let half = [(0.31 * font * longest + 9.0).max(20.0), font * 0.5 + 9.0];
        let unit = (900.0 / width.max(1.0)).clamp(2.0 * half[0] + 34.0, if graph.count <= 4 { 320.0 } else { 190.0 });
        let unit_y = unit.min(if height > 0.0 { (560.0 / height).max(2.0 * half[1] + 40.0) } else { unit });
        let margin = [half[0] + 24.0, half[1] + 34.0];
        let places = layout.places.iter().map(|p| [p[0] * unit + margin[0], p[1] * unit_y + margin[1]]).collect();
        let size = [width * unit + 2.0 * margin[0], height * unit_y + 2.0 * margin[1]];
        Self { places, half, font, size }
    }

    /// Where a straight line from the middle of a node towards a point leaves it.
    fn edge(&self, node: usize, towards: [f64; 2]) -> [f64; 2] {
        let from = self.places[node];
        let along = [towards[0] - from[0], towards[1] - from[1]];
        let length = along[0].hypot(along[1]).max(1e-9);
        let unit = along.map(|x| x / length);
        let reach =
            (0..2).map(|axis| (self.half[axis] + 2.0) / unit[axis].abs().max(1e-9)).fold(f64::INFINITY, f64::min);
        [from[0] + unit[0] * reach, from[1] + unit[1] * reach]
    }

    /// Bent to the right of its direction, so that the two directions between a pair are apart; start, middle, end.
    fn arc(&self, from: usize, to: usize) -> [[f64; 2]; 3] {
        let (a, b) = (self.places[from], self.places[to]);
        let along = [b[0] - a[0], b[1] - a[1]];
        let length = along[0].hypot(along[1]).max(1e-9);
        let bend = (0.16 * length).clamp(14.0, 60.0) / length;
        let middle = [0.5 * (a[0] + b[0]) - along[1] * bend, 0.5 * (a[1] + b[1]) + along[0] * bend];
        [self.edge(from, middle), middle, self.edge(to, middle)]
    }
}

/// Letters of a name in a node.
const LETTERS: usize = 14;

fn nodes(graph: &Graph, names: &[&str]) -> Markup {
    let canvas = Canvas::new(graph, names);
    let largest = graph.largest_gain();
    let in_loop = |link: &Link| graph.critical.as_ref().is_some_and(|critical| critical.has(link));
    let [width, height] = canvas.size.map(place);
    html! {
        svg.graph viewBox=(format!("0 0 {width} {height}")) style=(format!("max-width:{width}px")) role="group" aria-label="The network as a graph" {
            defs { (arrow("arrow", "arrow-plain")) (arrow("arrow-critical", "arrow-loop")) }
            @for (a, b, name) in &graph.shared {
                @let (a, b) = (canvas.places[*a], canvas.places[*b]);
                line.shared x1=(place(a[0])) y1=(place(a[1])) x2=(place(b[0])) y2=(place(b[1])) { title { "constraint " (name) } }
            }
            @for link in graph.links.iter().filter(|link| !in_loop(link)) { (drawn(&canvas, link, names, largest, "link")) }
            @for link in graph.links.iter().filter(|link| in_loop(link)) { (drawn(&canvas, link, names, largest, "link critical")) }
            @if graph.links.len() <= MOST_LABELS {
                @for link in &graph.links { (gain_label(&canvas, link, in_loop(link))) }
            }
            @for (k, name) in names.iter().enumerate() { (node(&canvas, k, name, graph)) }
        }
    }
}

fn arrow(class: &str, id: &str) -> Markup {
    html! {
        marker class=(class) id=(id) viewBox="0 0 10 10" refX="9" refY="5" markerWidth="9" markerHeight="9" markerUnits="userSpaceOnUse" orient="auto" {
            path d="M0 0.8 L10 5 L0 9.2 z" {}
        }
    }
}

fn drawn(canvas: &Canvas, link: &Link, names: &[&str], largest: f64, class: &str) -> Markup {
    let [start, middle, end] = canvas.arc(link.from, link.to).map(|p| format!("{} {}", place(p[0]), place(p[1])));
    let width = 1.0 + 3.0 * (link.gain / largest.max(1e-300)).sqrt();
    let marker = if class.ends_with("critical") { "url(#arrow-loop)" } else { "url(#arrow-plain)" };
    html! {
        path class=(class) d=(format!("M{start} Q{middle} {end}")) stroke-width=(place(width)) marker-end=(marker) tabindex="0" {
            title { (said(link, names)) }
        }
    }
}

/// `right acts on left with gain 0.12, by 0.0206 h4 + 0.000247 v2 (0.12)`.
fn said(link: &Link, names: &[&str]) -> String {
    let signals = link.signals.iter().map(|(signal, gain)| format!("{} ({})", clipped(signal, 60), short(*gain)));
    let signals: Vec<String> = signals.take(6).collect();
    format!(
        "{} acts on {} with gain {}, by z = {}",
        names[link.from],
        names[link.to],
        short(link.gain),
        signals.join("; ")
    )
}

fn gain_label(canvas: &Canvas, link: &Link, critical: bool) -> Markup {
    let [start, middle, end] = canvas.arc(link.from, link.to);
    let on = [0, 1].map(|axis| 0.25 * start[axis] + 0.5 * middle[axis] + 0.25 * end[axis]);
    // Beside the arrow, on the side it is bent to.
    let aside = [middle[0] - on[0], middle[1] - on[1]];
    let length = aside[0].hypot(aside[1]).max(1e-9);
    let at = [on[0] + 15.0 * aside[0] / length, on[1] + 10.0 * aside[1] / length];
    let gain = format!("{:.2}", link.gain);
    let gain = if link.gain < 0.01 { format!("{:.0e}", link.gain) } else { gain };
    html! {
        text.gain.critical[critical] x=(place(at[0])) y=(place(at[1] + 4.0)) text-anchor="middle" { (gain) }
    }
}

fn node(canvas: &Canvas, k: usize, name: &str, graph: &Graph) -> Markup {
    let [x, y] = canvas.places[k];
    let [w, h] = canvas.half;
    let critical = graph.critical.as_ref().is_some_and(|critical| critical.members.contains(&k));
    let heard = graph.links.iter().filter(|link| link.to == k).count();
    let told = graph.links.iter().filter(|link| link.from == k).count();
    html! {
        a href=(format!("#s-{k}")) {
            g.node.critical[critical] {
                title { (name) ": " (counted(heard, "neighbour")) " act on it, it acts on " (told) }
                rect x=(place(x - w)) y=(place(y - h)) width=(place(2.0 * w)) height=(place(2.0 * h)) rx="7" {}
                text x=(place(x)) y=(place(y + 0.35 * canvas.font)) text-anchor="middle" font-size=(place(canvas.font)) { (clipped(name, LETTERS)) }
            }
        }
    }
}

/// Side of the matrix, in pixels.
const SIDE: f64 = 640.0;

fn matrix(graph: &Graph, names: &[&str]) -> Markup {
    let cell = SIDE / graph.count as f64;
    let largest = graph.largest_gain().max(1e-300);
    let in_loop = |link: &Link| graph.critical.as_ref().is_some_and(|critical| critical.has(link));
    let shown = strongest(graph);
    html! {
        svg.matrix viewBox="-30 -24 680 674" style="max-width:680px" role="group" aria-label="The small-gain matrix" {
            rect.frame x="0" y="0" width=(place(SIDE)) height=(place(SIDE)) {}
            @for (k, _) in names.iter().enumerate().filter(|(k, _)| k % names.len().div_ceil(10) == 0) {
                @let at = place((k as f64 + 0.5) * cell);
                text.tick x="-5" y=(at) text-anchor="end" dominant-baseline="middle" { (k + 1) }
                text.tick x=(at) y="-8" text-anchor="middle" { (k + 1) }
            }
            @for link in shown {
                rect.cell.critical[in_loop(link)] x=(place(link.from as f64 * cell)) y=(place(link.to as f64 * cell)) width=(place(cell)) height=(place(cell))
                    fill-opacity=(place(0.15 + 0.85 * link.gain / largest)) {
                    title { (names[link.from]) " acts on " (names[link.to]) " with gain " (short(link.gain)) }
                }
            }
        }
    }
}

/// Cells that are drawn; the others are too many for a page.
const MOST_CELLS: usize = 6000;

fn strongest(graph: &Graph) -> Vec<&Link> {
    let mut links: Vec<&Link> = graph.links.iter().collect();
    links.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    links.truncate(MOST_CELLS);
    links
}

/// All couplings as a table, the strongest ones first.
fn list(graph: &Graph, names: &[&str]) -> Markup {
    if graph.links.is_empty() {
        return html! {};
    }
    let mut links: Vec<&Link> = graph.links.iter().collect();
    links.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let more = links.len().saturating_sub(MOST_LISTED);
    html! {
        details {
            summary { "Couplings in numbers" }
            div.wide {
                table {
                    thead { tr { th scope="col" { "From" } th scope="col" { "To" } th scope="col" { "Gain" } th scope="col" { "By coupling output z (gain of each)" } } }
                    tbody {
                        @for link in links.iter().take(MOST_LISTED) {
                            tr {
                                td { (names[link.from]) } td { (names[link.to]) } td.number { (short(link.gain)) }
                                td { @for (k, (signal, gain)) in link.signals.iter().take(12).enumerate() { @if k > 0 { "; " } (signal) " (" (short(*gain)) ")" } }
                            }
                        }
                    }
                }
            }
            @if more > 0 { p.note { "and " (more) " weaker ones" } }
        }
    }
}
