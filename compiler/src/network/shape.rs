//! Lists of rows become matrices of the size the names ask for.

use nalgebra::{DMatrix, DVector};

use super::words::count;
use crate::diagnostic::{Diagnostic, Diagnostics, Place, code};
use crate::spec::{At, Matrix, Row};

/// How many rows or columns there must be, and why.
pub(super) enum Side {
    /// The number and its reason: `one per state: h1, h2`.
    Exactly(usize, String),
    /// As many as the first row has.
    Free,
}

/// ``` matrix `A` of subsystem `left` ``` with its wanted size.
pub(super) struct Shape {
    pub what: String,
    pub rows: Side,
    pub columns: Side,
}

impl Shape {
    /// `given` as a matrix.
    ///
    /// `None` where its size is not the wanted one; each offending row is reported.
    pub fn read(&self, given: &Matrix, errors: &mut Diagnostics) -> Option<DMatrix<f64>> {
        let columns = match &self.columns {
            Side::Exactly(columns, _) => *columns,
            Side::Free => given.value.first().map_or(0, |row| row.value.len()),
        };
        let fits = self.check_rows(given, columns, errors) && self.check_columns(given, columns, errors);
        let entries = given.value.iter().flat_map(numbers);
        fits.then(|| DMatrix::from_row_iterator(given.value.len(), columns, entries))
    }

    fn check_rows(&self, given: &Matrix, columns: usize, errors: &mut Diagnostics) -> bool {
        let Side::Exactly(expected, reason) = &self.rows else { return true };
        let found = given.value.len();
        if found != *expected {
            let label = format!("{}, expected {expected} ({reason})", count(found, "row"));
            let error = self.error("rows").at(given.place.clone(), label);
            let turned = found == columns && given.value.iter().all(|row| row.value.len() == *expected);
            errors.push(if turned { error.help("it fits when transposed: each inner list is one row") } else { error });
        }
        found == *expected
    }

    fn check_columns(&self, given: &Matrix, expected: usize, errors: &mut Diagnostics) -> bool {
        let reason = match &self.columns {
            Side::Exactly(_, reason) => reason,
            Side::Free => "as many as in row 1",
        };
        // All rows of a file stand at one place, and have one length.
        let from_file = given.value.iter().all(|row| row.place == given.place);
        let shown = if from_file { 1 } else { usize::MAX };
        let wrong = given.value.iter().enumerate().filter(|(_, row)| row.value.len() != expected).take(shown);
        let before = errors.0.len();
        for (k, row) in wrong {
            let found = count(row.value.len(), "number");
            let row_of = if from_file { "each row".to_owned() } else { format!("row {}", k + 1) };
            let label = format!("{row_of} has {found}, expected {expected} ({reason})");
            errors.push(self.error("columns").at(row.place.clone(), label));
        }
        errors.0.len() == before
    }

    fn error(&self, side: &str) -> Diagnostic {
        Diagnostic::error(code::SHAPE, format!("{} has the wrong number of {side}", self.what))
    }
}

/// `given` as a vector of length `expected`.
pub(super) fn vector(
    what: &str,
    given: &Row,
    expected: usize,
    reason: &str,
    errors: &mut Diagnostics,
) -> Option<DVector<f64>> {
    let found = given.value.len();
    if found == expected {
        return Some(DVector::from_iterator(expected, numbers(given)));
    }
    let error = Diagnostic::error(code::SHAPE, format!("{what} has the wrong length"));
    let label = format!("{}, expected {expected} ({reason})", count(found, "number"));
    errors.push(error.at(given.place.clone(), label));
    None
}

/// Where entry (row, column) of `given` stands.
pub(super) fn entry_place(given: &Matrix, row: usize, column: usize) -> Place {
    let entry = given.value.get(row).and_then(|row| row.value.get(column));
    entry.map_or_else(|| given.place.clone(), |entry| entry.place.clone())
}

fn numbers(row: &Row) -> impl Iterator<Item = f64> {
    row.value.iter().map(|number: &At<f64>| number.value)
}
