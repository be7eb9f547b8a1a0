//! Tables of everything that has a margin, and of what the controllers are.

use maud::{Markup, html};

use super::Report;
use super::equations::eq;
use crate::sizing::Slack;
use crate::summary::short;

/// Inclusions that are listed one by one.
const MOST_SLACKS: usize = 3000;

pub fn section(report: &Report) -> Markup {
    html! {
        section id="margins" {
            h2 { "Margins and sizes" }
            (slacks(report))
            (coupling(report))
            (problems(report))
        }
    }
}

fn slacks(report: &Report) -> Markup {
    let all = &report.design.sizing.slacks;
    let smallest = smallest(all);
    html! {
        h3 { "Inclusions of the design" }
        p { "What is left of every inequality behind the inclusions, in the unit of its row, after rounding; never negative." }
        div.wide {
            table {
                thead { tr { th scope="col" { "Equation" } th scope="col" { "Inequalities" } th scope="col" { "Smallest slack" } th scope="col" { "of" } } }
                tbody {
                    @for (slack, count) in &smallest {
                        tr { td { (eq(slack.equation)) } td.number { (count) } td.number { (short(slack.value)) } td { (slack.what) } }
                    }
                }
            }
        }
        details {
            summary { "All " (all.len()) " inequalities" }
            div.wide {
                table {
                    thead { tr { th scope="col" { "Equation" } th scope="col" { "What" } th scope="col" { "Slack" } } }
                    tbody { @for slack in all.iter().take(MOST_SLACKS) { tr { td { (slack.equation) } td { (slack.what) } td.number { (short(slack.value)) } } } }
                }
            }
            @if all.len() > MOST_SLACKS { p.note { "and " (all.len() - MOST_SLACKS) " more" } }
        }
    }
}

/// Of each equation, with how many there are, in the order of the design.
fn smallest(all: &[Slack]) -> Vec<(&Slack, usize)> {
    let mut found: Vec<(&Slack, usize)> = Vec::new();
    for slack in all {
        match found.iter_mut().find(|(known, _)| known.equation == slack.equation) {
            Some((known, count)) => {
                *count += 1;
                if slack.value < known.value {
                    *known = slack;
                }
            }
            None => found.push((slack, 1)),
        }
    }
    found
}

fn coupling(report: &Report) -> Markup {
    let (network, sizing) = (&report.design.network, &report.design.sizing);
    let parts = &network.subsystems;
    html! {
        @if !network.coupling_constraints.is_empty() {
            h3 { "Coupling constraints" }
            p { "Limit, and what tubes and moving references leave of it for set-points " (eq("(3), (26), (28)")) "." }
            div.wide {
                table {
                    thead { tr { th scope="col" { "Constraint" } th scope="col" { "Between" } th scope="col" { "Limit l" } th scope="col" { "Tightened l̃" } } }
                    tbody {
                        @for (row, l_tilde) in network.coupling_constraints.iter().zip(&sizing.l_tilde) {
                            tr {
                                td { (row.name) }
                                td { (row.H.keys().map(|&j| parts[j].name.as_str()).collect::<Vec<_>>().join(", ")) }
                                td.number { (short(row.l)) } td.number { (short(*l_tilde)) }
                            }
                        }
                    }
                }
            }
        }
        @if !network.changing_constraints.is_empty() {
            h3 { "Constraints that are drawn while running" }
            p { "A row over the outputs of its members is charged at most the following per output " (eq("(26')")) "." }
            details open[network.changing_constraints.len() <= 12] {
                summary { "Constraints and charges" }
                div.wide {
                    table {
                        thead { tr { th scope="col" { "Constraint" } th scope="col" { "Between" } } }
                        tbody {
                            @for row in &network.changing_constraints {
                                tr { td { (row.name) } td { (row.members.iter().map(|&j| parts[j].name.as_str()).collect::<Vec<_>>().join(", ")) } }
                            }
                        }
                    }
                    table {
                        thead { tr { th scope="col" { "Subsystem" } th scope="col" { "Output" } th scope="col" { "Charged" } th scope="col" { "of it moving references" } } }
                        tbody {
                            @for (i, s) in parts.iter().enumerate().filter(|(_, s)| s.exposed.is_some()) {
                                @let taken = sizing.subsystems[i].exposed.half_widths(s.p());
                                @for (k, output) in s.outputs.iter().enumerate() {
                                    tr {
                                        td { (s.name) } td { (super::words::label(output)) } td.number { (short(taken[k])) }
                                        td.number { (short(report.design.sets.subsystems[i].outputs.axes[k].taken(sizing.epsilon))) }
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn problems(report: &Report) -> Markup {
    let design = report.design;
    let many = design.network.subsystems.len() > 24;
    html! {
        h3 { "Controllers" }
        p { "The i-DPC problem of each step " (eq("(33), (34), (35a), (35b), (35c), (35d), (36)")) ", after rows that can never become active were dropped, and the tables that hold it." }
        details open[!many] {
            summary { "All controllers" }
            div.wide {
                table {
                    thead {
                        tr {
                            th scope="col" { "Subsystem" } th scope="col" { "Local loop" } th scope="col" { "Facets of ℰ" } th scope="col" { "of Σ" } th scope="col" { "Unknowns" }
                            th scope="col" { "Rows" } th scope="col" { "Inequalities, kept" } th scope="col" { "Changes, at most" } th scope="col" { "Tables" }
                        }
                    }
                    tbody {
                        @for (i, s) in design.network.subsystems.iter().enumerate() {
                            @let (dpc, sized) = (&design.problems.subsystems[i].dpc, &design.sizing.subsystems[i]);
                            tr {
                                td { (s.name) }
                                td.number { (short(design.gains.subsystems[i].rho_F)) }
                                td.number { (sized.E.facets()) } td.number { (sized.Sigma.facets()) }
                                td.number { (dpc.H.nrows()) } td.number { (dpc.rows.len()) }
                                td.number { (dpc.facets_after) " of " (dpc.facets_before) }
                                td.number { (dpc.max_iterations) }
                                td.number { (report.emitted.table_bytes[i]) " bytes" }
                            }
                        }
                    }
                }
            }
        }
    }
}
