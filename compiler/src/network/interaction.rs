//! E_i, L_ij, Cz_i, Dz_i of (1), (2) as the file states them.

use std::collections::BTreeMap;

use nalgebra::DMatrix;

use super::model::{Local, Model, locals, neighbour, own};
use super::roster::{Member, Roster};
use super::shape::{Shape, Side};
use super::words::count;
use crate::diagnostic::{Diagnostic, Diagnostics, code};
use crate::spec::{Import, Matrix, Spec, Subsystem};

pub(super) fn models(spec: &Spec, roster: &Roster, errors: &mut Diagnostics) -> Option<Vec<Model>> {
    let locals = locals(spec, roster, errors);
    let pairs = || spec.subsystems.iter().zip(&roster.members);
    let outputs: Vec<_> = pairs().map(|(given, member)| coupling_outputs(given, member, errors)).collect();
    let inputs: Vec<_> = pairs().map(|(given, member)| coupling_inputs(given, member, errors)).collect();
    let outputs: Vec<_> = outputs.into_iter().collect::<Option<_>>()?;
    let inputs: Vec<_> = inputs.into_iter().collect::<Option<Vec<_>>>()?;
    let sizes: Vec<_> = outputs.iter().map(|(Cz, _): &(DMatrix<f64>, _)| Cz.nrows()).collect();
    let links: Vec<_> =
        (0..sizes.len()).map(|i| links(i, &spec.subsystems[i].from, &inputs[i], &sizes, roster, errors)).collect();
    let links: Vec<_> = links.into_iter().collect::<Option<_>>()?;
    let parts = locals?.into_iter().zip(inputs).zip(links).zip(outputs);
    let model =
        |(((local, E), L), (Cz, Dz)): (((Local, _), _), _)| Model { A: local.A, B: local.B, C: local.C, E, L, Cz, Dz };
    Some(parts.map(model).collect())
}

/// Cz_i and Dz_i; one that is absent is zero, both absent: nothing is exported.
fn coupling_outputs(
    given: &Subsystem,
    member: &Member,
    errors: &mut Diagnostics,
) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
    let rows = given.Cz.as_ref().or(given.Dz.as_ref()).map_or(0, |matrix| matrix.value.len());
    let side = || Side::Exactly(rows, "one per coupling output: `Cz` and `Dz` have the same rows".to_string());
    let Cz = Shape {
        what: own("Cz", member),
        rows: side(),
        columns: Side::Exactly(member.states.len(), member.per_state()),
    };
    let Dz = Shape {
        what: own("Dz", member),
        rows: side(),
        columns: Side::Exactly(member.inputs.len(), member.per_input()),
    };
    let mut read = |shape: Shape, matrix: &Option<Matrix>, columns: usize| match matrix {
        Some(matrix) => shape.read(matrix, errors),
        None => Some(DMatrix::zeros(rows, columns)),
    };
    let Cz = read(Cz, &given.Cz, member.states.len());
    let Dz = read(Dz, &given.Dz, member.inputs.len());
    Some((Cz?, Dz?))
}

/// E_i; no column where it is absent.
fn coupling_inputs(given: &Subsystem, member: &Member, errors: &mut Diagnostics) -> Option<DMatrix<f64>> {
    let n = member.states.len();
    let shape = Shape { what: own("E", member), rows: Side::Exactly(n, member.per_state()), columns: Side::Free };
    match (&given.E, given.from.first()) {
        (Some(E), _) => shape.read(E, errors),
        (None, None) => Some(DMatrix::zeros(n, 0)),
        (None, Some(import)) => {
            let error = Diagnostic::error(code::MISSING_KEY, format!("{} is missing", shape.what));
            let error = error.at(member.header.clone(), "`E` belongs here");
            let label = format!("`L` acts through `E`: x+ = A x + B u + E L z of `{}`", import.neighbour.value);
            errors.push(error.at(import.neighbour.place.clone(), label));
            None
        }
    }
}

/// L_ij by neighbour; one that is zero makes no neighbour.
fn links(
    i: usize,
    imports: &[Import],
    E: &DMatrix<f64>,
    sizes: &[usize],
    roster: &Roster,
    errors: &mut Diagnostics,
) -> Option<BTreeMap<usize, DMatrix<f64>>> {
    let all: Vec<_> = imports.iter().map(|import| link(i, import, E.ncols(), sizes, roster, errors)).collect();
    let all: Vec<(usize, DMatrix<f64>)> = all.into_iter().collect::<Option<_>>()?;
    Some(all.into_iter().filter(|(_, L)| L.iter().any(|c| *c != 0.0)).collect())
}

fn link(
    i: usize,
    import: &Import,
    coupling_inputs: usize,
    sizes: &[usize],
    roster: &Roster,
    errors: &mut Diagnostics,
) -> Option<(usize, DMatrix<f64>)> {
    let j = neighbour(i, import, roster, errors)?;
    let (to, from) = (&roster.members[i].name, &roster.members[j].name);
    let Some(given) = &import.L else {
        let error = Diagnostic::error(code::MISSING_KEY, format!("nothing says what `{from}` does to `{to}`"));
        errors.push(error.at(import.neighbour.place.clone(), "`L` belongs here"));
        return None;
    };
    let rows = format!("one per coupling input of `{to}`: `E` has {}", count(coupling_inputs, "column"));
    let columns = format!("one per coupling output of `{from}`: `Cz`, `Dz` have {}", count(sizes[j], "row"));
    let shape = Shape {
        what: format!("matrix `L` from `{from}` to `{to}`"),
        rows: Side::Exactly(coupling_inputs, rows),
        columns: Side::Exactly(sizes[j], columns),
    };
    Some((j, shape.read(given, errors)?))
}
