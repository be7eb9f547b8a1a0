//! A run as one page that needs nothing else: the picture, the robots step by step, distances over time.

use example_kit::plot::{Colour, DrawError, Figure, Limit, Line, Panel, Stroke};
use maud::{DOCTYPE, PreEscaped, html};
use serde_json::json;

use crate::arena::{DIAMETER, SIZE, distance};
use crate::floor::{colour, framed, picture};
use crate::robot::Verdict;
use crate::run::{Moment, Run};
use crate::scenario::Mission;

const STYLE: &str = "body{font:15px/1.45 sans-serif;max-width:1020px;margin:2em auto;padding:0 1em;color:#222}\
table{border-collapse:collapse}td,th{padding:.15em .7em;text-align:right;border-bottom:1px solid #ddd}\
td:first-child,th:first-child{text-align:left}input[type=range]{width:60%;vertical-align:middle}svg{max-width:100%;height:auto}";

const SCRIPT: &str = include_str!("page.js");

/// # Errors
/// What plotters reports.
pub fn page(run: &Run) -> Result<String, DrawError> {
    let distances = distances(run).to_svg()?;
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                title { "Robots: " (run.name()) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { "Robots: " (run.name()) }
                p { (verdict(run)) }
                (picture(run))
                h2 { "Step by step" }
                p {
                    button id="play" { "play" } " "
                    input id="time" type="range" min="0" max=(run.steps.len()) step="0.05" value="0";
                    " step " span id="step" { "0" }
                }
                (framed(html! { g id="stage" {} }))
                p { "Filled: robots; rings: references now; crosses: the newest references, " (run.horizon) " steps ahead; dots: goals. "
                    "Half-planes hold the newest references apart, with room for what two robots may be off theirs: that is why robots stay "
                    "further apart than their diameter." }
                table { thead { tr { th { "robot" } th { "status at this step" } } } tbody id="statuses" {} }
                h2 { "Distances" }
                (PreEscaped(distances))
                script { (PreEscaped(format!("const RUN={};\n{SCRIPT}", data(run)))) }
            }
        }
    };
    Ok(markup.into_string())
}

/// What came of it, in one sentence.
pub fn verdict(run: &Run) -> String {
    let told = |arrival: Option<usize>| arrival.map_or("not all".to_owned(), |step| format!("after {step} steps"));
    let arrival = match run.scenario.mission {
        Mission::Goals(_) => {
            let (references, robots) = (told(run.references_arrive()), told(run.robots_arrive()));
            format!("References at their goals: {references}; robots: {robots}.")
        }
        Mission::Follow { .. } => {
            format!(
                "The leader reached {} stops; at the end references were {:.2} cm off their places.",
                run.stops,
                run.off_goal()
            )
        }
        Mission::Formation { .. } => {
            format!("At the end of each stop references were at most {:.2} cm off their places.", run.off_goal())
        }
    };
    let stuck = run.deadlocked();
    let ending = if stuck.is_empty() {
        String::new()
    } else {
        let names: Vec<_> = stuck.iter().map(|robot| (robot + 1).to_string()).collect();
        format!(" Deadlock, told by robot {}.", names.join(", "))
    };
    format!(
        "{arrival} Smallest distance of two centres: {:.2} cm, diameter {DIAMETER} cm.{ending}",
        run.smallest_distance(),
    )
}

/// Distances of all pairs over time, with the diameter.
pub fn distances(run: &Run) -> Figure {
    let robots = run.scenario.robots();
    let pairs = (0..robots).flat_map(|j| (0..j).map(move |i| (i, j)));
    let lines = pairs.enumerate().map(|(k, (i, j))| Line {
        label: if robots > 4 { String::new() } else { format!("robots {} and {}", i + 1, j + 1) },
        points: between(run, i, j),
        stroke: [Stroke::Solid, Stroke::Dashed, Stroke::DashDotted][k % 3],
        colour: rgb(colour(k)),
    });
    let limit = Limit {
        label: format!("diameter {DIAMETER} cm"),
        value: DIAMETER,
        show: true,
        colour: example_kit::plot::colour::BLACK,
    };
    let panel = Panel {
        axis: "distance of centres [cm]".to_owned(),
        height: 240,
        lines: lines.collect(),
        bands: Vec::new(),
        limits: vec![limit],
    };
    let end = run.steps.len() as f64 * run.pace.period();
    Figure { title: format!("{}: distances", run.scenario.name), end, panels: vec![panel], marks: Vec::new() }
}

fn between(run: &Run, i: usize, j: usize) -> Vec<(f64, f64)> {
    let samples = run.tracks.iter().enumerate().flat_map(|(step, tracks)| {
        let (a, b) = (&tracks[i], &tracks[j]);
        let count = a.len() as f64;
        let at = move |k: usize| (step as f64 + (k + 1) as f64 / count) * run.pace.period();
        a.iter().zip(b).enumerate().map(move |(k, (a, b))| (at(k), distance(*a, *b)))
    });
    samples.collect()
}

fn rgb(hex: &str) -> Colour {
    let channel = |k: usize| u8::from_str_radix(&hex[k..k + 2], 16).unwrap_or(0);
    Colour(channel(1), channel(3), channel(5))
}

/// What the script needs.
fn data(run: &Run) -> serde_json::Value {
    let rounded = |p: &[f64; 2]| json!([(100.0 * p[0]).round() / 100.0, (100.0 * p[1]).round() / 100.0]);
    let of_robot = |(step, moment, robot): (usize, &Moment, usize)| {
        json!({
            "path": run.tracks[step][robot].iter().map(rounded).collect::<Vec<_>>(),
            "heading": rounded(&moment.heading), "goal": rounded(&moment.goal), "ref": rounded(&moment.y_ref),
            "newest": rounded(&moment.newest), "status": status(&moment.answer.verdict),
        })
    };
    let steps = run.steps.iter().enumerate().map(|(step, moments)| {
        moments.iter().enumerate().map(|(robot, moment)| of_robot((step, moment, robot))).collect::<Vec<_>>()
    });
    let robots = run.scenario.robots();
    json!({
        "steps": steps.collect::<Vec<_>>(), "starts": run.scenario.starts, "radius": 0.5 * DIAMETER, "height": SIZE[1],
        "colours": (0..robots).map(colour).collect::<Vec<_>>(),
    })
}

fn status(verdict: &Verdict) -> String {
    let unsure = if verdict.guaranteed { "" } else { "; NO GUARANTEE" };
    format!("{}; {}{unsure}", verdict.references, verdict.control)
}
