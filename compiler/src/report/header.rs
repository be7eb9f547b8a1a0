//! What the page is about, and whether it holds.

use maud::{Markup, html};

use super::Report;
use super::equations::eq;
use super::words::counted;
use crate::gains::{Layer, origin};
use crate::network::{Norm, Subsystem};
use crate::notices::notices;
use crate::summary::short;

pub fn section(report: &Report) -> Markup {
    let design = report.design;
    let network = &design.network;
    let sum = |of: fn(&Subsystem) -> usize| network.subsystems.iter().map(of).sum::<usize>();
    html! {
        header {
            p.kind { "Distributed predictive control for tracking" }
            h1 { (network.name) }
            p.lead {
                (counted(network.subsystems.len(), "subsystem")) " with " (counted(sum(Subsystem::n), "state")) ", "
                (counted(sum(Subsystem::m), "input")) " and " (counted(sum(Subsystem::p), "output"))
                ", each with a predictive controller of its own that hears its neighbours once per step."
            }
            dl.facts {
                (fact("Sample time", &format!("{} s", short(network.sample_time))))
                (fact("Horizon N", &counted(network.horizon, "step")))
                (fact("References move", &moves(report)))
                (fact("Arithmetic", network.scalar.name()))
                (fact("Gains", &format!("K {}; 𝒦 {}", origins(report, Layer::Local), origins(report, Layer::Reference))))
                @if let Some(plan) = &design.start { (fact("Start-up plan", &counted(plan.steps, "step"))) }
                @if let Some(tuning) = &design.tuning { (fact("Search for gains", &format!("effort {}, {} compared", tuning.effort.level(), counted(tuning.compared, "design")))) }
            }
        }
        (verdict(report))
    }
}

fn fact(name: &str, value: &str) -> Markup {
    html! { div { dt { (name) } dd { (value) } } }
}

fn moves(report: &Report) -> String {
    let reference = &report.design.network.reference;
    let norm = match reference.norm {
        Norm::One => "1",
        Norm::Two => "2",
        Norm::Inf => "∞",
    };
    let origin = if reference.epsilon.is_some() { "given" } else { "chosen" };
    format!("ε = {} per step at most, in the {norm}-norm ({origin})", short(report.design.sizing.epsilon))
}

/// Where the gains came from; all subsystems mostly have the same origin.
fn origins(report: &Report, layer: Layer) -> String {
    let all = report.design.network.subsystems.iter().map(|s| origin(s, layer));
    let distinct: std::collections::BTreeSet<&str> = all.collect();
    distinct.into_iter().collect::<Vec<_>>().join(" or ")
}

fn verdict(report: &Report) -> Markup {
    let (gains, sets) = (&report.design.gains, &report.design.sets);
    let couples = !report.design.network.coupling_constraints.is_empty()
        || !report.design.network.changing_constraints.is_empty();
    let notices = notices(report.design);
    html! {
        section id="verdict" {
            h2 { "Verdict" }
            p.verdict {
                strong { "The design holds. " }
                "Assumptions 1 to 4 hold and every inclusion that Theorem 1 rests on has been verified with rounding counted in ("
                a href="#margins" { "all margins" } "). From an admissible start, no limit of a state or input"
                @if couples { ", and no coupling constraint," }
                " is violated by the plant of the file under what the file lets act on it"
                @if couples { "." } @else { ", and outputs reach their set-points or the nearest ones in Y." }
            }
            div.wide {
                table.assumptions {
                    thead { tr { th scope="col" { "Assumption" } th scope="col" { "Measure" } th scope="col" { "Value" } th scope="col" { "Has to be" } th scope="col" { "Margin" } th scope="col" {} } }
                    tbody {
                        (below_one("1", "spectral radius of A + BK, all together", gains.rho_F))
                        (below_one("1", "largest spectral radius of a local loop F = A + BK", report.design.gains.subsystems.iter().fold(0.0, |rho, g| g.rho_F.max(rho))))
                        @match gains.rank_margin {
                            Some(margin) => tr { td { "2" } td { "smallest singular value of [I − A, −B; C, 0] over its largest" } td.number { (short(margin)) } td { "above 0" } td.number { (short(margin)) } td {} },
                            None => tr { td { "2" } td { "full rank, since ℱ is stable (large network: not measured)" } td {} td { "full" } td {} td {} },
                        }
                        (below_one("3", "spectral radius of ℱ, the reference system (8)", gains.rho_calF))
                        (below_one("4", "small gain: spectral radius of S", sets.rho_small_gain))
                        (below_one("4", "the same on the facets that the tubes have", sets.rho_on_normals))
                    }
                }
            }
            @if !notices.is_empty() {
                h3 { "Worth a second look" }
                ul { @for notice in notices.iter().take(MOST_NOTICES) { li { (notice) } } }
                @if notices.len() > MOST_NOTICES { p.note { "and " (notices.len() - MOST_NOTICES) " more of this kind" } }
            }
            p.note { "Theorem 1 asks for a start that is admissible: a steady state inside Y, or a start-up plan; see " (eq("(33), (34)")) "." }
        }
    }
}

const MOST_NOTICES: usize = 12;

fn below_one(assumption: &str, what: &str, value: f64) -> Markup {
    let used = 100.0 * value.clamp(0.0, 1.0);
    if value >= 1.0 {
        // Of a large network the bound is no more than that; what proves it is another assumption.
        return html! { tr { td { (assumption) } td { (what) } td { "not measured" } td { "below 1" } td { "as Assumption 4 implies" } td {} } };
    }
    html! {
        tr {
            td { (assumption) } td { (what) } td.number { (short(value)) } td { "below 1" } td.number { (short(1.0 - value)) }
            td { span.gauge { span style=(format!("width:{used:.1}%")) {} } }
        }
    }
}
