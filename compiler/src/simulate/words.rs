//! Statuses in words, with the names of rows, neighbours and constraints.

use dpc_runtime::{Control, Delivery, References};

use super::history::Status;
use crate::design::Design;
use crate::emit::hears;

/// The names that the numbers in a subsystem's statuses stand for.
#[derive(Debug, Clone)]
pub struct Words {
    /// Rows of the i-DPC problem.
    rows: Vec<String>,
    /// By slot.
    neighbours: Vec<String>,
    /// Coupling constraints on the subsystem, fixed ones first.
    constraints: Vec<String>,
}

impl Words {
    pub fn new(design: &Design, i: usize) -> Self {
        let network = &design.network;
        let fixed = network.coupling_constraints.iter().filter(|c| c.H.contains_key(&i)).map(|c| c.name.clone());
        let changing = network.changing_constraints.iter().filter(|c| c.members.contains(&i)).map(|c| c.name.clone());
        Self {
            rows: design.problems.subsystems[i].dpc.rows.iter().map(|row| row.name.clone()).collect(),
            neighbours: hears(design, i).into_iter().map(|j| network.subsystems[j].name.clone()).collect(),
            constraints: fixed.chain(changing).collect(),
        }
    }

    /// All that a status says.
    pub fn status(&self, status: &Status) -> String {
        let mut parts = vec![self.control(&status.control)];
        parts.extend(self.references(&status.references));
        parts.extend(self.messages(status));
        if status.control.is_admissible() && !status.certified {
            parts.push("measurement errors may hide that the state left its tube".to_owned());
        }
        if !status.load_within {
            parts.push("a load left its bounds or rates".to_owned());
        }
        if status.degraded {
            parts.push("guarantee lost until a new start".to_owned());
        }
        parts.join("; ")
    }

    /// Why a status does not say that the guarantee holds; nothing where it does.
    pub fn why_not(&self, status: &Status) -> Option<String> {
        if status.is_guaranteed() {
            return None;
        }
        let mut reasons = Vec::new();
        if !status.control.is_admissible() {
            reasons.push(self.control(&status.control));
        }
        if !status.references.are_admissible() {
            reasons.extend(self.references(&status.references));
        }
        reasons.extend(self.messages(status));
        if status.control.is_admissible() && !status.certified {
            reasons.push("measurement errors may hide that the state left its tube".to_owned());
        }
        if !status.load_within {
            reasons.push("a load left its bounds or rates".to_owned());
        }
        if reasons.is_empty() {
            reasons.push("the guarantee was lost earlier".to_owned());
        }
        Some(reasons.join("; "))
    }

    fn control(&self, control: &Control) -> String {
        match control {
            Control::AtReference => "at the reference".to_owned(),
            Control::Optimal { active: 0, .. } => "solved".to_owned(),
            Control::Optimal { active: 1, .. } => "solved, 1 row active".to_owned(),
            Control::Optimal { active, .. } => format!("solved, {active} rows active"),
            Control::Candidate => "no solution found in time, the shifted plan is feasible".to_owned(),
            Control::Infeasible { row } => format!("infeasible: {}", self.row(*row)),
            Control::IterationLimit => "no solution found in time, and the shifted plan is not feasible".to_owned(),
            Control::NotFinite => "the measured state is not finite".to_owned(),
        }
    }

    /// The row by name; those of sets without rows of the user's have words of their own.
    fn row(&self, row: usize) -> String {
        let name = self.rows.get(row).map_or_else(|| format!("row {row}"), |name| format!("`{name}`"));
        let hint = match &*name {
            tube if tube.starts_with("`(35a)") => ", the state left its tube",
            terminal if terminal.starts_with("`(36)") => ", the plan cannot end near enough to the reference",
            reserve if reserve.starts_with("`(35b)") => ", what neighbours see would leave its reserve",
            _ => "",
        };
        format!("{name}{hint}")
    }

    /// Nothing where references go as asked.
    fn references(&self, references: &References) -> Option<String> {
        let constraint = |row: &usize| self.constraints.get(*row).map_or("?", String::as_str);
        match references {
            References::Nearest => None,
            References::Planned => Some("follows the start-up plan".to_owned()),
            References::OffPlan => Some("the start-up plan does not fit the neighbours".to_owned()),
            References::SetPointNotFinite => Some("the set-point is not finite".to_owned()),
            References::Kept => Some("no reference found, kept".to_owned()),
            References::Waiting => Some("waits for messages of its coupling constraints".to_owned()),
            References::Undrawn { row } => Some(format!("no row of `{}` was accepted yet", constraint(row))),
            References::Blocked { row } => Some(format!("held up by `{}`", constraint(row))),
            References::Deadlock { row } => Some(format!("held up by `{}`, and nobody moves", constraint(row))),
            References::CouplingExceeded { row } => Some(format!("`{}` is exceeded", constraint(row))),
            References::NotSteady => Some("the start is not steady with the neighbours".to_owned()),
        }
    }

    /// One sentence per message that did not arrive in sequence.
    fn messages(&self, status: &Status) -> Vec<String> {
        let troubled = status.deliveries.iter().zip(&self.neighbours);
        let troubled = troubled.filter(|(delivery, _)| **delivery != Delivery::InSequence);
        troubled.map(|(delivery, neighbour)| format!("message of `{neighbour}` {delivery}")).collect()
    }
}
