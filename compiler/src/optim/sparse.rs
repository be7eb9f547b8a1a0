//! Sparse matrices by rows.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

/// A matrix whose rows list their entries in the order of the columns; no entry is zero.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sparse {
    columns: usize,
    /// First entry of each row, and the number of all at the end.
    starts: Vec<usize>,
    entries: Vec<(usize, f64)>,
}

impl Sparse {
    /// Of (rows x columns); `blocks` are dense parts by the place of their first entry, which do not overlap.
    pub fn from_blocks<'a>(
        rows: usize,
        columns: usize,
        blocks: impl IntoIterator<Item = ((usize, usize), &'a DMatrix<f64>)>,
    ) -> Self {
        let mut by_row = vec![BTreeMap::new(); rows];
        for ((row, column), block) in blocks {
            for (i, values) in block.row_iter().enumerate() {
                let values = values.iter().enumerate().filter(|(_, value)| **value != 0.0);
                by_row[row + i].extend(values.map(|(j, value)| (column + j, *value)));
            }
        }
        let (mut starts, mut entries) = (vec![0], Vec::new());
        for row in by_row {
            entries.extend(row);
            starts.push(entries.len());
        }
        Self { columns, starts, entries }
    }

    pub fn nrows(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    pub fn ncols(&self) -> usize {
        self.columns
    }

    /// (column, entry) of every entry of row i that is not zero.
    pub fn row(&self, i: usize) -> &[(usize, f64)] {
        &self.entries[self.starts[i]..self.starts[i + 1]]
    }

    /// Number of entries that are not zero.
    pub fn count(&self) -> usize {
        self.entries.len()
    }

    /// Entries of the longest row.
    pub fn longest_row(&self) -> usize {
        self.starts.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or(0)
    }

    pub fn to_dense(&self) -> DMatrix<f64> {
        let mut dense = DMatrix::zeros(self.nrows(), self.columns);
        for i in 0..self.nrows() {
            self.row(i).iter().for_each(|&(j, value)| dense[(i, j)] = value);
        }
        dense
    }

    /// The same places with other entries.
    pub fn map(&self, of: impl Fn(f64) -> f64) -> Self {
        let entries = self.entries.iter().map(|&(j, value)| (j, of(value))).collect();
        Self { entries, ..self.clone() }
    }

    /// With zeros in the rows that are `left_out`.
    pub fn without_rows(&self, left_out: &[bool]) -> Self {
        let (mut starts, mut entries) = (vec![0], Vec::new());
        for (i, left_out) in left_out.iter().enumerate() {
            entries.extend(self.row(i).iter().filter(|_| !left_out));
            starts.push(entries.len());
        }
        Self { columns: self.columns, starts, entries }
    }

    /// The matrix times x.
    pub fn times(&self, x: &DVector<f64>) -> DVector<f64> {
        DVector::from_fn(self.nrows(), |i, _| self.row(i).iter().map(|&(j, value)| value * x[j]).sum())
    }

    /// The row x times the matrix.
    pub fn row_times(&self, x: &DVector<f64>) -> DVector<f64> {
        let mut product = DVector::zeros(self.columns);
        for (i, x) in x.iter().enumerate().filter(|(_, x)| **x != 0.0) {
            self.row(i).iter().for_each(|&(j, value)| product[j] += x * value);
        }
        product
    }

    /// Largest number of entries in a column.
    pub fn longest_column(&self) -> usize {
        let mut counts = vec![0; self.columns];
        self.entries.iter().for_each(|&(j, _)| counts[j] += 1);
        counts.into_iter().max().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_those_of_the_dense_matrix() {
        let block = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, -3.0, 4.0]);
        let other = DMatrix::from_row_slice(1, 2, &[7.0, 0.5]);
        let matrix = Sparse::from_blocks(4, 5, [((1, 3), &block), ((0, 0), &other)]);
        let dense = matrix.to_dense();
        assert_eq!((matrix.count(), matrix.longest_row(), matrix.longest_column()), (5, 2, 2));
        assert_eq!(dense[(2, 4)], 4.0);
        let x = DVector::from_fn(5, |k, _| 1.0 + k as f64);
        assert_eq!(matrix.times(&x), &dense * &x);
        let y = DVector::from_fn(4, |k, _| 1.0 - k as f64);
        assert_eq!(matrix.row_times(&y), dense.tr_mul(&y));
    }
}
