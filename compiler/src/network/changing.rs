//! Coupling constraints whose rows are redrawn while running.

use std::collections::BTreeMap;

use nalgebra::DVector;

use super::constraints::Rows;
use super::model::Model;
use super::roster::Roster;
use super::words::number;
use super::{ChangingConstraint, Exposed, ExposedOutput, Margin, Network};
use crate::diagnostic::{Diagnostic, Diagnostics, Place, code};
use crate::spec::{self, Spec};

/// The changing constraints of a file, and the smallest margin that they ask of each member.
pub(super) struct Changing {
    pub constraints: Vec<ChangingConstraint>,
    /// By subsystem; only members are there.
    margins: BTreeMap<usize, Option<Margin>>,
}

impl Changing {
    pub fn new(spec: &Spec, roster: &Roster, errors: &mut Diagnostics) -> Option<Self> {
        let given = spec.changing_constraints.iter().enumerate();
        let all: Vec<_> = given.map(|(h, given)| constraint(h, given, roster, errors)).collect();
        let all: Vec<_> = all.into_iter().collect::<Option<_>>()?;
        let mut margins: BTreeMap<usize, Option<Margin>> = BTreeMap::new();
        for (constraint, margin) in &all {
            for &j in &constraint.members {
                let asked = margins.entry(j).or_default();
                let both = asked.take().into_iter().chain(margin.clone());
                *asked = both.min_by(|one, other| one.value.total_cmp(&other.value));
            }
        }
        Some(Self { constraints: all.into_iter().map(|(constraint, _)| constraint).collect(), margins })
    }

    /// A row per output of every member.
    pub fn rows<'a>(&'a self, roster: &'a Roster) -> Rows<'a> {
        let axes = |j: usize| {
            let p = roster.members[j].outputs.len();
            (0..p).map(move |k| (j, DVector::from_fn(p, |r, _| f64::from(r == k))))
        };
        Box::new(self.margins.keys().flat_map(move |&j| axes(j)))
    }

    /// What is asked of subsystem `i`, whose outputs are among the coupling outputs.
    pub fn exposed(&self, i: usize, model: &Model) -> Option<Exposed> {
        let margin = self.margins.get(&i)?.clone();
        let output = |k: usize| {
            let row = model.as_coupling_output(&DVector::from_fn(model.C.nrows(), |r, _| f64::from(r == k)))?;
            let z = row.iter().position(|factor| *factor != 0.0).unwrap_or(0);
            Some(ExposedOutput { z, factor: row[z] })
        };
        let outputs = (0..model.C.nrows()).map(output).collect::<Option<_>>()?;
        Some(Exposed { outputs, margin })
    }

    /// Plans know nothing of rows that are drawn later.
    pub fn check_start(&self, spec: &Spec) -> Result<(), Diagnostic> {
        let anywhere = spec.start_anywhere.as_ref().filter(|anywhere| anywhere.value).map(|anywhere| &anywhere.place);
        let stated = spec.subsystems.iter().flat_map(|s| [&s.x0, &s.d0]).flatten().map(|row| &row.place);
        match (anywhere.into_iter().chain(stated).next(), self.constraints.first()) {
            (Some(place), Some(constraint)) => {
                let error = refused().at(place.clone(), "asks for a start-up plan");
                Err(explained(error.at(constraint.place.clone(), "changes while running")))
            }
            _ => Ok(()),
        }
    }
}

impl Network {
    /// That controllers may be started with plans.
    ///
    /// # Errors
    /// E0131 there are changing constraints.
    pub(crate) fn check_plannable(&self) -> Result<(), Diagnostic> {
        match self.changing_constraints.first() {
            Some(constraint) => Err(explained(refused().at(constraint.place.clone(), "changes while running"))),
            None => Ok(()),
        }
    }
}

fn refused() -> Diagnostic {
    Diagnostic::error(code::PLANNED_START, "start-up plans and changing constraints do not go together")
}

fn explained(error: Diagnostic) -> Diagnostic {
    error
        .note("a plan is made here, and leads references past rows that are drawn there: it cannot know them")
        .help("start at rest (the emitted `steady_state` and `start`), without x0, d0, start-anywhere and --start; the first rows are drawn before the first step")
}

fn constraint(
    h: usize,
    given: &spec::ChangingConstraint,
    roster: &Roster,
    errors: &mut Diagnostics,
) -> Option<(ChangingConstraint, Option<Margin>)> {
    let unnamed = || match &given.between.value[..] {
        [] => format!("changing constraint {}", h + 1),
        members => members.iter().map(|member| member.value.as_str()).collect::<Vec<_>>().join(" - "),
    };
    let name = given.name.as_ref().map_or_else(unnamed, |name| name.value.clone());
    let members = members(&name, given, roster, errors);
    let margin = given.margin.as_ref().map(|margin| checked_margin(margin, errors));
    let margin = margin.map_or(Some(None), |margin| margin.map(Some));
    Some((ChangingConstraint { name, members: members?, place: given.place.clone() }, margin?))
}

fn members(
    name: &str,
    given: &spec::ChangingConstraint,
    roster: &Roster,
    errors: &mut Diagnostics,
) -> Option<Vec<usize>> {
    let between = &given.between;
    if between.value.is_empty() {
        let error = Diagnostic::error(code::MEMBERS, format!("changing constraint `{name}` is between nobody"));
        errors.push(
            error
                .at(between.place.clone(), "needs at least one subsystem")
                .help("name those whose outputs its rows read; with one, it is a moving half-plane for that one alone"),
        );
        return None;
    }
    let mut seen: BTreeMap<usize, &Place> = BTreeMap::new();
    let mut fine = true;
    for member in &between.value {
        let Some(j) = roster.find(member, errors) else {
            fine = false;
            continue;
        };
        if let Some(first) = seen.insert(j, &member.place) {
            let title = format!("changing constraint `{name}` names `{}` twice", member.value);
            let error = Diagnostic::error(code::MEMBERS, title).at(member.place.clone(), "named again here");
            errors.push(
                error
                    .at(first.clone(), "first named here")
                    .help("name each subsystem once: a row has one part for each"),
            );
            fine = false;
        }
    }
    fine.then(|| seen.into_keys().collect())
}

fn checked_margin(given: &spec::At<f64>, errors: &mut Diagnostics) -> Option<Margin> {
    if given.value > 0.0 {
        return Some(Margin { value: given.value, place: given.place.clone() });
    }
    let label = format!("{}, expected a number above 0 (in the unit of the outputs)", number(given.value));
    let error = Diagnostic::error(code::OUT_OF_RANGE, "`margin` is out of range").at(given.place.clone(), label);
    errors.push(error.help("it is what (26) may take of each output of each member at most; leave it out to have the compiler keep it small"));
    None
}
