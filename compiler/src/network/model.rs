//! Model (1), (2) of every subsystem, from whichever way the file states it.

use std::collections::BTreeMap;

use nalgebra::DMatrix;

use super::blocks::{self, Coupling};
use super::collective;
use super::form::Form;
use super::interaction;
use super::roster::{Member, Roster};
use super::shape::{Shape, Side};
use crate::diagnostic::{Diagnostic, Diagnostics, Place, code};
use crate::spec::{Import, Matrix, Spec, Subsystem};

/// The matrices of (1), (2) for one subsystem; as in [`super::Subsystem`].
#[derive(Debug, Clone)]
pub(super) struct Model {
    pub A: DMatrix<f64>,
    pub B: DMatrix<f64>,
    pub C: DMatrix<f64>,
    pub E: DMatrix<f64>,
    pub L: BTreeMap<usize, DMatrix<f64>>,
    pub Cz: DMatrix<f64>,
    pub Dz: DMatrix<f64>,
}

/// A_ii, B_ii, C_i.
pub(super) struct Local {
    pub A: DMatrix<f64>,
    pub B: DMatrix<f64>,
    pub C: DMatrix<f64>,
}

pub(super) fn models(form: Form, spec: &Spec, roster: &Roster, errors: &mut Diagnostics) -> Option<Vec<Model>> {
    match form {
        Form::Blocks => {
            let locals = locals(spec, roster, errors);
            let coupling = blocks::coupling(spec, roster, errors);
            Some(join(locals?, &coupling?))
        }
        Form::Interaction => interaction::models(spec, roster, errors),
        Form::Collective => {
            let (locals, coupling) = collective::models(spec.collective.as_ref()?, spec, roster, errors)?;
            Some(join(locals, &coupling))
        }
    }
}

/// Blocks [A_ij B_ij] become coupling outputs and inputs.
fn join(locals: Vec<Local>, coupling: &Coupling) -> Vec<Model> {
    let exports: Vec<_> = (0..locals.len()).map(|j| coupling.exports(j, &locals[j])).collect();
    let one = |(i, local): (usize, Local)| {
        let imports = coupling.imports(i, local.A.nrows(), &exports);
        let (Cz, Dz) = exports[i].output_matrices(local.A.nrows());
        Model { A: local.A, B: local.B, C: local.C, E: imports.E, L: imports.L, Cz, Dz }
    };
    locals.into_iter().enumerate().map(one).collect()
}

/// A, B, C of every subsystem, which stand in its own table.
pub(super) fn locals(spec: &Spec, roster: &Roster, errors: &mut Diagnostics) -> Option<Vec<Local>> {
    let pairs = spec.subsystems.iter().zip(&roster.members);
    let all: Vec<_> = pairs.map(|(given, member)| local(given, member, errors)).collect();
    all.into_iter().collect()
}

fn local(given: &Subsystem, member: &Member, errors: &mut Diagnostics) -> Option<Local> {
    let (n, m, p) = (member.states.len(), member.inputs.len(), member.outputs.len());
    let states = || Side::Exactly(n, member.per_state());
    let A = Shape { what: own("A", member), rows: states(), columns: states() };
    let B = Shape { what: own("B", member), rows: states(), columns: Side::Exactly(m, member.per_input()) };
    let C = Shape { what: own("C", member), rows: Side::Exactly(p, member.per_output()), columns: states() };
    let A = needed("A", &given.A, &A, &member.header, errors);
    let B = needed("B", &given.B, &B, &member.header, errors);
    let C = needed("C", &given.C, &C, &member.header, errors);
    Some(Local { A: A?, B: B?, C: C? })
}

/// A matrix that must be there, in its shape.
pub(super) fn needed(
    key: &str,
    given: &Option<Matrix>,
    shape: &Shape,
    header: &Place,
    errors: &mut Diagnostics,
) -> Option<DMatrix<f64>> {
    if let Some(given) = given {
        return shape.read(given, errors);
    }
    let error = Diagnostic::error(code::MISSING_KEY, format!("{} is missing", shape.what));
    errors.push(error.at(header.clone(), format!("`{key}` belongs here")));
    None
}

pub(super) fn own(key: &str, member: &Member) -> String {
    format!("matrix `{key}` of subsystem `{}`", member.name)
}

/// The neighbour that `import` names, unless it is the subsystem itself.
pub(super) fn neighbour(i: usize, import: &Import, roster: &Roster, errors: &mut Diagnostics) -> Option<usize> {
    let j = roster.find(&import.neighbour, errors)?;
    if i == j {
        let title = format!("subsystem `{}` cannot be its own neighbour", roster.members[i].name);
        let error = Diagnostic::error(code::SELF_COUPLING, title);
        let label = "names the subsystem it stands in";
        errors.push(error.at(import.neighbour.place.clone(), label).help("add this matrix to its own `A` and `B`"));
        return None;
    }
    Some(j)
}
