//! What a closed loop has shown: counts, margins, settling times, and whether what was promised was kept.

use dpc_runtime::Control;

use super::history::{EventKind, History, Margin, Track};
use super::recorder::is_violated;
use super::settling::{Settling, settlings};
use crate::design::Design;

/// A [`History`] in figures.
#[derive(Debug, Clone, PartialEq)]
pub struct Findings {
    pub steps: usize,
    /// In the order of the network.
    pub subsystems: Vec<NodeFindings>,
    /// Of the coupling constraints.
    pub couplings: Vec<Least>,
    /// Constraints that were violated while every subsystem said that the guarantee holds. There are none but by a mistake in the
    /// design, the controllers or this program.
    pub broken: Vec<Broken>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct NodeFindings {
    pub name: String,
    /// Steps that solved the i-DPC problem, and those of them at which a row was active.
    pub solved: usize,
    pub active: usize,
    /// Steps at which nothing had to be solved.
    pub at_reference: usize,
    /// Steps that used the shifted candidate (47), which was feasible.
    pub fell_back: usize,
    /// Steps whose problem had no solution, or whose measurement was not finite.
    pub infeasible: usize,
    /// Steps at which this subsystem did not say that the guarantee holds.
    pub unguaranteed: usize,
    /// Steps at which a state or input was outside of its limits.
    pub violations: usize,
    /// When the guarantee was lost, with the reason, and when it came back.
    pub spells: Vec<Spell>,
    /// Per row of X_i, then of U_i.
    pub least: Vec<Least>,
    /// Per output and set-point.
    pub settlings: Vec<Settling>,
}

/// Steps without the guarantee.
#[derive(Debug, Clone, PartialEq)]
pub struct Spell {
    pub from: usize,
    /// The first step at which it held again; `None` where it did not come back.
    pub to: Option<usize>,
    /// In words, as at the first of these steps.
    pub why: String,
}

/// The smallest margin of a constraint.
#[derive(Debug, Clone, PartialEq)]
pub struct Least {
    pub row: String,
    pub limit: f64,
    pub unit: Option<String>,
    pub value: f64,
    pub step: usize,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Broken {
    pub step: usize,
    /// `None`: a coupling constraint.
    pub subsystem: Option<String>,
    pub row: String,
    /// By how much, in its unit.
    pub by: f64,
}

impl Findings {
    pub fn new(history: &History, design: &Design) -> Self {
        let subsystems = history.subsystems.iter().enumerate().map(|(i, track)| node(history, i, track));
        Self {
            steps: history.steps(),
            subsystems: subsystems.collect(),
            couplings: history.couplings.iter().filter_map(|coupling| least(&coupling.margin)).collect(),
            broken: broken(history, design),
        }
    }

    /// Whether every subsystem said at every step that the guarantee holds.
    pub fn is_guaranteed(&self) -> bool {
        self.subsystems.iter().all(|node| node.unguaranteed == 0)
    }
}

fn node(history: &History, i: usize, track: &Track) -> NodeFindings {
    let count = |of: fn(&Control) -> bool| track.status.iter().filter(|status| of(&status.control)).count();
    let steps = 0..history.steps();
    NodeFindings {
        name: track.name.clone(),
        solved: count(|control| matches!(control, Control::Optimal { .. })),
        active: count(|control| matches!(control, Control::Optimal { active: 1.., .. })),
        at_reference: count(|control| matches!(control, Control::AtReference)),
        fell_back: count(|control| matches!(control, Control::Candidate)),
        infeasible: count(|control| !control.is_admissible()),
        unguaranteed: track.guaranteed.iter().filter(|guaranteed| !**guaranteed).count(),
        violations: steps.filter(|step| track.margins.iter().any(|margin| is_violated(margin, *step))).count(),
        spells: spells(history, i),
        least: track.margins.iter().filter_map(least).collect(),
        settlings: settlings(track, history.sample_time),
    }
}

fn spells(history: &History, i: usize) -> Vec<Spell> {
    let mut spells: Vec<Spell> = Vec::new();
    for event in history.events.iter().filter(|event| event.subsystem == Some(i)) {
        match event.kind {
            EventKind::Lost => {
                let why = event.words.trim_start_matches("no guarantee: ").to_owned();
                spells.push(Spell { from: event.step, to: None, why });
            }
            EventKind::Regained => {
                spells.last_mut().into_iter().for_each(|spell| spell.to = Some(event.step));
            }
            _ => {}
        }
    }
    spells
}

fn least(margin: &Margin) -> Option<Least> {
    let (step, value) = margin.least()?;
    Some(Least { row: margin.row.clone(), limit: margin.limit, unit: margin.unit.clone(), value, step })
}

/// A violation at a step at which all say that the guarantee holds. Where a measurement errs, that is said only as long as what acts
/// is what the design assumes: a disturbance beyond W shows no more than the error lets through.
fn broken(history: &History, design: &Design) -> Vec<Broken> {
    let exact = design.network.subsystems.iter().all(|s| s.measurement_error.amax() == 0.0);
    let exact = exact
        && history
            .subsystems
            .iter()
            .all(|track| track.errors.iter().all(|column| column.values.iter().all(|v| *v == 0.0)));
    let margins = history
        .subsystems
        .iter()
        .flat_map(|track| track.margins.iter().map(|margin| (Some(track.name.clone()), margin)));
    let margins: Vec<_> = margins.chain(history.couplings.iter().map(|coupling| (None, &coupling.margin))).collect();
    let steps = (0..history.steps()).filter(|step| history.is_guaranteed(*step) && (exact || history.assumed[*step]));
    let at = |step: usize| {
        let violated = margins.iter().filter(move |(_, margin)| is_violated(margin, step));
        violated.map(move |(subsystem, margin)| Broken {
            step,
            subsystem: subsystem.clone(),
            row: margin.row.clone(),
            by: -margin.values[step],
        })
    };
    steps.flat_map(at).collect()
}
