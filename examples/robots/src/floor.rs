//! The floor from above: where the robots went, and what they covered, as Fig. 4 of the paper shows it.

use maud::{Markup, html};

use crate::arena::{DIAMETER, Point, SIZE};
use crate::run::Run;

/// Colours that stay apart for colour-blind eyes, one per robot, then again from the first.
const COLOURS: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#333333"];
/// Pixels per cm.
const SCALE: f64 = 7.0;
/// Around the floor, cm.
const EDGE: f64 = 7.0;

pub fn colour(robot: usize) -> &'static str {
    COLOURS[robot % COLOURS.len()]
}

/// Everything there is to see of a run, in one picture.
pub fn picture(run: &Run) -> Markup {
    let robots = run.scenario.robots();
    framed(html! {
        @for robot in 0..robots { (covered(run, robot)) }
        @for robot in 0..robots { (path(run, robot)) }
        @for robot in 0..robots { (ends(run, robot)) }
    })
}

/// The floor in cm, y upward, with what is drawn on it.
pub fn framed(drawn: Markup) -> Markup {
    let (width, height) = (SIZE[0] + 2.0 * EDGE, SIZE[1] + 2.0 * EDGE);
    let view = format!("{} {} {width} {height}", -EDGE, -(SIZE[1] + EDGE));
    let pixels = [width, height].map(|length| format!("{:.0}", SCALE * length));
    html! {
        svg xmlns="http://www.w3.org/2000/svg" width=(pixels[0]) height=(pixels[1]) viewBox=(view) font-family="sans-serif" font-size="2.4" {
            rect x=(-EDGE) y=(-(SIZE[1] + EDGE)) width=(width) height=(height) fill="#ffffff" {}
            (grid())
            g transform="scale(1,-1)" { (drawn) }
        }
    }
}

fn grid() -> Markup {
    let ticks = |end: f64| (0..=(end / 10.0) as usize).map(|k| 10.0 * k as f64);
    html! {
        @for x in ticks(SIZE[0]) {
            line x1=(x) x2=(x) y1=(-SIZE[1]) y2="0" stroke="#e4e4e4" stroke-width="0.15" {}
            @if x % 20.0 == 0.0 { text x=(x) y="3.6" text-anchor="middle" { (x) } }
        }
        @for y in ticks(SIZE[1]) {
            line x1="0" x2=(SIZE[0]) y1=(-y) y2=(-y) stroke="#e4e4e4" stroke-width="0.15" {}
            @if y % 20.0 == 0.0 { text x="-1.2" y=(0.9 - y) text-anchor="end" { (y) } }
        }
        rect x="0" y=(-SIZE[1]) width=(SIZE[0]) height=(SIZE[1]) fill="none" stroke="#333333" stroke-width="0.4" {}
        text x=(SIZE[0]) y="6.4" text-anchor="end" { "x, y [cm]" }
    }
}

/// The circles that the robot filled at every step.
fn covered(run: &Run, robot: usize) -> Markup {
    html! {
        @for moments in until_rest(run) {
            (circle(moments[robot].position, 0.5 * DIAMETER, "none", "#999999", "0.18", Some("0.8 0.6")))
        }
    }
}

/// Where its centre went, with a mark at every step.
fn path(run: &Run, robot: usize) -> Markup {
    let points = run.tracks.iter().flat_map(|tracks| &tracks[robot]);
    let points = points.map(|[x, y]| format!("{x:.2},{y:.2}")).collect::<Vec<_>>().join(" ");
    html! {
        polyline points=(points) fill="none" stroke=(colour(robot)) stroke-width="0.35" {}
        @for moments in until_rest(run) { (mark(robot, moments[robot].position, 0.75, "#ffffff")) }
    }
}

/// Start and goal.
fn ends(run: &Run, robot: usize) -> Markup {
    let [x, y] = run.scenario.starts[robot];
    html! {
        @if let Some(last) = run.steps.last() { (mark(robot, last[robot].goal, 1.2, colour(robot))) }
        text x=(x) y=(-y) dx="1.8" dy="-1.8" transform="scale(1,-1)" fill=(colour(robot)) stroke="#ffffff" stroke-width="0.7" paint-order="stroke" { "robot " (robot + 1) }
    }
}

/// The steps up to the one at which everyone has come to rest.
fn until_rest(run: &Run) -> &[Vec<crate::run::Moment>] {
    let moves = |moments: &Vec<crate::run::Moment>| {
        moments.iter().any(|moment| moment.answer.telemetry.x_ref.iter().skip(1).step_by(2).any(|v| v.abs() > 0.02))
    };
    let last = run.steps.iter().rposition(moves).map_or(0, |step| step + 1);
    &run.steps[..(last + 1).min(run.steps.len())]
}

/// The paper's symbols: square, circle, triangle.
fn mark(robot: usize, [x, y]: Point, size: f64, fill: &str) -> Markup {
    let points = match robot % 3 {
        1 => return circle([x, y], size, fill, colour(robot), "0.25", None),
        0 => vec![[-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9]],
        _ => vec![[-1.1, -0.8], [1.1, -0.8], [0.0, 1.2]],
    };
    let points: Vec<_> = points.iter().map(|p| format!("{:.2},{:.2}", x + size * p[0], y + size * p[1])).collect();
    html! { polygon points=(points.join(" ")) fill=(fill) stroke=(colour(robot)) stroke-width="0.25" {} }
}

fn circle([x, y]: Point, r: f64, fill: &str, stroke: &str, width: &str, dashes: Option<&str>) -> Markup {
    html! {
        circle cx=(format!("{x:.2}")) cy=(format!("{y:.2}")) r=(r) fill=(fill) stroke=(stroke) stroke-width=(width) stroke-dasharray=[dashes] {}
    }
}
