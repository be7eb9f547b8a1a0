//! Rows of numbers: equal up to scale, spanned by others.

use nalgebra::{DMatrix, RowDVector};

pub(super) type Row = RowDVector<f64>;

/// Agreement asked of rows that stand for one another, relative to the largest entry.
const AGREEMENT: f64 = 1e-12;

/// [left right].
pub(super) fn hstack(left: &DMatrix<f64>, right: &DMatrix<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(left.nrows(), left.ncols() + right.ncols(), |r, c| match c.checked_sub(left.ncols()) {
        None => left[(r, c)],
        Some(c) => right[(r, c)],
    })
}

/// Factors: `rows[k] = combinations[k] . outputs` to 1e-12 of the largest entry, every output one of the rows.
///
/// One output per distinct row up to scale, in the order of their first occurrence; fewer where their rank is
/// smaller. No row may be zero.
pub(super) fn factorise(rows: &[Row]) -> (Vec<Row>, Vec<Row>) {
    let distinct = distinct(rows);
    let basis = basis(&distinct);
    let spanned = (basis.len() < distinct.len()).then(|| combinations(rows, &basis)).flatten();
    match spanned {
        Some(combinations) => (basis, combinations),
        None => {
            let scaled =
                rows.iter().map(|row| as_multiple(row, &distinct).unwrap_or_else(|| Row::zeros(distinct.len())));
            let scaled = scaled.collect();
            (distinct, scaled)
        }
    }
}

/// c with `row = c . representatives`, where one of these is the row up to scale.
pub(super) fn as_multiple(row: &Row, representatives: &[Row]) -> Option<Row> {
    let found = representatives.iter().enumerate().find_map(|(k, one)| Some((k, scale(row, one)?)));
    found.map(|(k, c)| Row::from_fn(representatives.len(), |_, column| if column == k { c } else { 0.0 }))
}

/// c with `row = c representative`.
fn scale(row: &Row, representative: &Row) -> Option<f64> {
    let pivot = representative.transpose().iamax();
    let c = row[pivot] / representative[pivot];
    agree(&(representative * c), row).then_some(c)
}

fn agree(one: &Row, other: &Row) -> bool {
    let difference = one - other;
    difference.amax() <= AGREEMENT * other.amax()
}

fn distinct(rows: &[Row]) -> Vec<Row> {
    let mut distinct: Vec<Row> = Vec::new();
    for row in rows {
        if as_multiple(row, &distinct).is_none() {
            distinct.push(row.clone());
        }
    }
    distinct
}

/// Rows that span all, in their order: Gram-Schmidt, each time taking the row that is farthest from the span so far
/// (pivoting keeps the combinations small), the first among equals.
fn basis(rows: &[Row]) -> Vec<Row> {
    let mut residuals: Vec<Row> = rows.iter().map(|row| row / row.amax()).map(|row| &row / row.norm()).collect();
    let mut chosen = Vec::new();
    while let Some(pivot) = farthest(&residuals) {
        chosen.push(pivot);
        let direction = &residuals[pivot] / residuals[pivot].norm();
        for residual in &mut residuals {
            *residual -= &direction * residual.dot(&direction);
        }
        residuals[pivot].fill(0.0);
    }
    chosen.sort_unstable();
    chosen.into_iter().map(|k| rows[k].clone()).collect()
}

fn farthest(residuals: &[Row]) -> Option<usize> {
    let most = residuals.iter().map(|row| row.norm()).fold(0.0, f64::max);
    let tie = most * (1.0 - 1e-9);
    (most > AGREEMENT).then(|| residuals.iter().position(|row| row.norm() >= tie)).flatten()
}

/// Every row as a combination of `basis`; `None` where one is not, to 1e-12.
fn combinations(rows: &[Row], basis: &[Row]) -> Option<Vec<Row>> {
    let spanning = DMatrix::from_rows(basis);
    let qr = spanning.transpose().qr();
    let combination = |row: &Row| match as_multiple(row, basis) {
        Some(exact) => Some(exact),
        None => {
            let c = qr.r().solve_upper_triangular(&(qr.q().transpose() * row.transpose()))?.transpose();
            agree(&(&c * &spanning), row).then_some(c)
        }
    };
    rows.iter().map(combination).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(entries: &[f64]) -> Row {
        Row::from_row_slice(entries)
    }

    fn check(rows: &[Row], outputs: usize) {
        let (found, combinations) = factorise(rows);
        assert_eq!(found.len(), outputs);
        assert!(found.iter().all(|output| rows.contains(output)));
        for (row, combination) in rows.iter().zip(&combinations) {
            let again = combination * DMatrix::from_rows(&found);
            assert!((again - row).amax() <= 1e-12 * row.amax());
        }
    }

    #[test]
    fn multiples_share_an_output() {
        check(&[row(&[1.0, 2.0, 0.0]), row(&[-0.3, -0.6, 0.0]), row(&[0.1, 0.2, 0.0])], 1);
        check(&[row(&[1e-100, 2e-100]), row(&[3e20, 6e20])], 1);
    }

    #[test]
    fn dependent_rows_share_outputs() {
        let (a, b) = (row(&[1.0, 2.0, 3.0, 4.0]), row(&[0.0, 1.0, 0.5, -1.0]));
        check(&[a.clone(), b.clone(), &a * 0.3 - &b * 0.7, &a + &b * 2.0], 2);
    }

    #[test]
    fn independent_rows_stay_in_their_order() {
        let rows = [row(&[1.0, 0.0]), row(&[1e-3, 1e-3])];
        let (outputs, _) = factorise(&rows);
        assert_eq!(outputs, rows);
    }

    #[test]
    fn nearly_dependent_rows_are_not_merged_at_a_loss() {
        check(&[row(&[1.0, 0.0]), row(&[1.0, 1e-9]), row(&[0.0, 1.0])], 2);
        check(&[row(&[1.0, 0.0]), row(&[1.0, 1e-11])], 2);
    }
}
