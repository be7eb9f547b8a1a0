//! A matrix as a file has it.

use super::{Unusable, entries};

#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    rows: usize,
    columns: usize,
    /// Row by row.
    entries: Vec<f64>,
    /// Whether the file has it as a list, which is neither a row nor a column.
    pub flat: bool,
    /// Where the file names them, as many as there are rows.
    pub row_names: Vec<String>,
    /// Where the file names them, as many as there are columns.
    pub column_names: Vec<String>,
}

impl Array {
    /// # Errors
    /// It is too large, or there are not as many `entries` (row by row).
    pub(super) fn new(rows: usize, columns: usize, entries_by_rows: Vec<f64>) -> Result<Self, Unusable> {
        let (found, count) = (entries_by_rows.len(), entries(rows, columns)?);
        if found != count {
            return Err(Unusable::new(format!("{rows} x {columns}, but has {found} numbers")));
        }
        let (row_names, column_names) = (Vec::new(), Vec::new());
        Ok(Self { rows, columns, entries: entries_by_rows, flat: false, row_names, column_names })
    }

    /// As [`Array::new`] with the entries column by column.
    pub(super) fn by_columns(rows: usize, columns: usize, entries: &[f64]) -> Result<Self, Unusable> {
        let by_rows = (0..rows).flat_map(|r| entries.iter().skip(r).step_by(rows.max(1)).copied()).collect();
        Self::new(rows, columns, by_rows)
    }

    /// The same numbers as a list.
    pub(super) fn into_list(self) -> Self {
        Self { flat: true, ..self }
    }

    /// With names, none or as many as there are rows and columns.
    pub(super) fn named(self, row_names: Vec<String>, column_names: Vec<String>) -> Self {
        Self { row_names, column_names, ..self }
    }

    pub fn rows(&self) -> usize {
        self.rows
    }

    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Row by row.
    pub fn entries(&self) -> &[f64] {
        &self.entries
    }

    /// `4 x 2`, or `a list of 4`.
    pub fn size(&self) -> String {
        if self.flat {
            format!("a list of {}", self.entries.len())
        } else {
            format!("{} x {}", self.rows, self.columns)
        }
    }

    /// Whether it is a row, a column or a list.
    pub fn is_vector(&self) -> bool {
        self.flat || self.rows == 1 || self.columns == 1
    }

    /// The rows and columns of these indices, in their order.
    ///
    /// # Panics
    /// There is no such row or column.
    pub fn select(&self, rows: &[usize], columns: &[usize]) -> Self {
        let entries =
            rows.iter().flat_map(|r| columns.iter().map(move |c| self.entries[r * self.columns + c])).collect();
        let names = |names: &[String], chosen: &[usize]| chosen.iter().filter_map(|k| names.get(*k).cloned()).collect();
        Self {
            rows: rows.len(),
            columns: columns.len(),
            entries,
            flat: self.flat,
            row_names: names(&self.row_names, rows),
            column_names: names(&self.column_names, columns),
        }
    }
}
