//! Coupling constraints (3), and the coupling outputs that (4) asks for.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, RowDVector};

use super::CouplingConstraint;
use super::model::Model;
use super::roster::{Roster, check_unique};
use super::rows::{Row, as_multiple, hstack};
use super::shape::vector;
use super::words::number;
use crate::diagnostic::{Diagnostic, Diagnostics, code};
use crate::spec::{self, Coefficients, OutputRow, Spec};

/// Rows over the outputs of a subsystem each.
pub(super) type Rows<'a> = Box<dyn Iterator<Item = (usize, DVector<f64>)> + 'a>;

/// A constraint (3) before its outputs are among the coupling outputs.
pub(super) struct Constraint {
    name: String,
    H: BTreeMap<usize, DVector<f64>>,
    l: f64,
    place: crate::diagnostic::Place,
}

impl Constraint {
    /// `H_h^[j]` of every member.
    pub fn rows(&self) -> Rows<'_> {
        Box::new(self.H.iter().map(|(j, row)| (*j, row.clone())))
    }
}

pub(super) fn constraints(spec: &Spec, roster: &Roster, errors: &mut Diagnostics) -> Option<Vec<Constraint>> {
    let mut seen = BTreeMap::new();
    let fixed = spec.coupling_constraints.iter().filter_map(|constraint| constraint.name.as_ref());
    for name in fixed.chain(spec.changing_constraints.iter().filter_map(|constraint| constraint.name.as_ref())) {
        check_unique("a coupling constraint", &name.value, &name.place, &mut seen, errors);
    }
    let given = spec.coupling_constraints.iter().enumerate();
    let all: Vec<_> = given.map(|(h, given)| constraint(h, given, roster, errors)).collect();
    all.into_iter().collect()
}

fn constraint(
    h: usize,
    given: &spec::CouplingConstraint,
    roster: &Roster,
    errors: &mut Diagnostics,
) -> Option<Constraint> {
    let name = given.name.as_ref().map_or_else(|| format!("constraint {}", h + 1), |name| name.value.clone());
    let positive = check_limit(&name, given, errors);
    let rows: Vec<_> = given.H.iter().map(|row| output_row(row, roster, errors)).collect();
    let rows: Vec<_> = rows.into_iter().collect::<Option<_>>()?;
    let H: BTreeMap<_, _> = rows.into_iter().filter(|(_, row): &(_, DVector<f64>)| row.amax() > 0.0).collect();
    if H.is_empty() {
        let error = Diagnostic::error(code::EMPTY_ROW, format!("coupling constraint `{name}` constrains nothing"));
        errors.push(error.at(given.place.clone(), "needs an output with a coefficient other than 0 in `H`"));
    }
    (positive && !H.is_empty()).then(|| Constraint { name, H, l: given.max.value, place: given.place.clone() })
}

fn check_limit(name: &str, given: &spec::CouplingConstraint, errors: &mut Diagnostics) -> bool {
    let positive = given.max.value > 0.0;
    if !positive {
        let title = format!("0 is not in the interior of coupling constraint `{name}`");
        let error = Diagnostic::error(code::ZERO_OUTSIDE, title)
            .at(given.max.place.clone(), format!("{}, must be above 0", number(given.max.value)))
            .note("outputs are deviations from an operating point, which is 0 and must lie strictly inside")
            .help("subtract the operating point's value of the left side from `max`");
        errors.push(error);
    }
    positive
}

fn output_row(given: &OutputRow, roster: &Roster, errors: &mut Diagnostics) -> Option<(usize, DVector<f64>)> {
    let j = roster.find(&given.subsystem, errors)?;
    let member = &roster.members[j];
    let p = member.outputs.len();
    let row = match &given.coefficients {
        Coefficients::List(list) => {
            let what = format!("the row of `H` for `{}`", member.name);
            vector(&what, list, p, &member.per_output(), errors)?
        }
        Coefficients::ByOutput(named) => {
            let found = named.value.iter().map(|(name, c)| Some((member.find_output(name, errors)?, c.value)));
            let found = found.collect::<Vec<_>>().into_iter().collect::<Option<BTreeMap<_, _>>>()?;
            DVector::from_fn(p, |k, _| found.get(&k).copied().unwrap_or(0.0))
        }
    };
    Some((j, row))
}

/// Adds `H_h^[j] y_j` to z_j where no coupling output is a multiple of it.
pub(super) fn export_outputs<'a>(models: &mut [Model], rows: impl Iterator<Item = (usize, DVector<f64>)> + 'a) {
    for (j, row) in rows {
        let wanted = models[j].output_row(&row);
        if as_multiple(&wanted, &models[j].coupling_rows()).is_none() {
            models[j].push_coupling_output(&wanted);
        }
    }
    let sizes: Vec<_> = models.iter().map(|model| model.Cz.nrows()).collect();
    for (j, L) in models.iter_mut().flat_map(|model| &mut model.L) {
        L.resize_mut(L.nrows(), sizes[*j], 0.0);
    }
}

/// (3) with (4), once [`export_outputs`] has seen to it that every `H_h^[j] y_j` is a multiple of a coupling output.
pub(super) fn resolve(constraint: Constraint, models: &[Model]) -> CouplingConstraint {
    let z_row = |(j, row): (&usize, &DVector<f64>)| models[*j].as_coupling_output(row).map(|multiple| (*j, multiple));
    let Hz = constraint.H.iter().filter_map(z_row).collect();
    CouplingConstraint { name: constraint.name, H: constraint.H, Hz, l: constraint.l, place: constraint.place }
}

impl Model {
    /// H C as a row over (x, u).
    fn output_row(&self, H: &DVector<f64>) -> Row {
        let over_states = H.transpose() * &self.C;
        // Adding 0 takes the sign off -0, which would be printed and emitted.
        RowDVector::from_fn(self.A.ncols() + self.B.ncols(), |_, c| over_states.get(c).map_or(0.0, |h| h + 0.0))
    }

    /// The row over the coupling outputs that is `H y`, where one of them is that up to scale.
    pub(super) fn as_coupling_output(&self, H: &DVector<f64>) -> Option<DVector<f64>> {
        let row = self.output_row(H);
        if row.amax() == 0.0 {
            // Assumption 2 refuses an output that reads nothing.
            return Some(DVector::zeros(self.Cz.nrows()));
        }
        as_multiple(&row, &self.coupling_rows()).map(|multiple| multiple.transpose())
    }

    /// The rows of [Cz Dz].
    pub(super) fn coupling_rows(&self) -> Vec<Row> {
        hstack(&self.Cz, &self.Dz).row_iter().map(|row| row.clone_owned()).collect()
    }

    fn push_coupling_output(&mut self, row: &Row) {
        let (n, nz) = (self.A.ncols(), self.Cz.nrows());
        let place = |matrix: &DMatrix<f64>, first: usize| {
            DMatrix::from_fn(nz + 1, matrix.ncols(), |r, c| if r < nz { matrix[(r, c)] } else { row[first + c] })
        };
        (self.Cz, self.Dz) = (place(&self.Cz, 0), place(&self.Dz, n));
    }
}
