//! One page about one design: a self-contained HTML document that needs no network, and no script to be read.
//!
//! Sets are drawn as what they are: outlines of projections come from support functions ([`outline`]), and the parts of a range
//! sum to it ([`budget`]). The same design and history give the same bytes.

pub mod budget;
mod curve;
mod equations;
mod frame;
pub mod graph;
mod header;
pub mod layout;
mod margins;
pub mod outline;
mod picture;
pub mod planes;
mod set_points;
mod simulation;
mod speed;
mod steady;
mod subsystem;
mod words;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::design::Design;
use crate::emit::Emitted;
use crate::simulate::History;
use crate::sizing::SpeedPoint;

pub use steady::SteadyStates;

/// Everything the page shows.
pub struct Report<'a> {
    design: &'a Design,
    emitted: &'a Emitted,
    history: Option<&'a History>,
    speed: Vec<SpeedPoint>,
}

/// Designs that the trade of epsilon against set-points is drawn from.
const SPEEDS: usize = 12;

impl<'a> Report<'a> {
    /// `emitted` must have been made from `design`. Computes what other epsilons would mean, which takes as long as sizing the
    /// design some ten times; of a large network it does not.
    pub fn new(design: &'a Design, emitted: &'a Emitted) -> Self {
        let speed = design.sizing.against_epsilon(&design.network, &design.gains, &design.sets, SPEEDS);
        Self { design, emitted, history: None, speed }
    }

    /// With a closed loop of this design over time.
    pub fn with_history(self, history: &'a History) -> Self {
        Self { history: Some(history), ..self }
    }

    /// The page.
    pub fn html(&self) -> String {
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    meta name="color-scheme" content="light dark";
                    meta name="generator" content=(concat!("dpc-codegen ", env!("CARGO_PKG_VERSION")));
                    title { (self.design.network.name) ": distributed predictive control" }
                    link rel="icon" href="data:,";
                    style { (PreEscaped(include_str!("style.css"))) }
                }
                body {
                    (self.contents())
                    main { (self.sections()) }
                    footer { "Made by dpc-codegen " (env!("CARGO_PKG_VERSION")) " from " (self.design.network.source.path) "." }
                    script { (PreEscaped(include_str!("script.js"))) }
                }
            }
        };
        page.into_string()
    }

    fn contents(&self) -> Markup {
        let parts = [
            ("verdict", "Verdict"),
            ("network", "Network"),
            ("set-points", "Set-points"),
            ("subsystems", "Subsystems"),
            ("speed", "Speed"),
        ];
        let simulation = self.history.map(|_| ("simulation", "Simulation"));
        let parts = parts.into_iter().chain(simulation).chain([("margins", "Margins"), ("equations", "Equations")]);
        html! {
            nav aria-label="Contents" {
                @for (id, name) in parts { a href=(format!("#{id}")) { (name) } }
                button type="button" id="theme" hidden { "Light or dark" }
            }
        }
    }

    fn sections(&self) -> Markup {
        html! {
            (header::section(self))
            (picture::section(self.design))
            (set_points::section(self))
            (subsystem::section(self))
            (speed::section(self))
            @if let Some(history) = self.history { (simulation::section(history)) }
            (margins::section(self))
            (equations::section())
        }
    }
}
