//! The orthogonal directions of a growing and shrinking set of columns, by their Gram matrix alone.
#![expect(non_snake_case, reason = "the Gram matrix is N'N everywhere, its factor D")]

use super::linear::{add_scaled, close_gap, dot, dot_of};
use super::{Real, precision};

/// M N'N M' = D for a matrix N of at most `NV` independent columns; M is unit lower triangular, D diagonal and positive.
///
/// M is the inverse of the factor L of N'N = L D L'. Row k of N M' is what column k has beside the span of the columns
/// before it, so that the coefficients of a new column over the others are minus the row of M that appends it. Products
/// with M and M' wait for nothing, where substitutions in L wait for every entry before.
///
/// Columns are appended and removed without factoring anew: O(len^2) each. Entries of M and D^-1 beyond the columns there
/// are, and above M's diagonal, are zero.
#[derive(Debug, Clone)]
pub struct Factor<const NV: usize> {
    M: [[Real; NV]; NV],
    D: [Real; NV],
    /// 1 / D.
    inverse: [Real; NV],
    len: usize,
}

/// What appending a column would append.
#[derive(Debug, Clone, Copy)]
pub struct Column<const NV: usize> {
    /// Its coefficients over the columns there are: of the one nearest to it in their span. Zero beyond them.
    pub combination: [Real; NV],
    /// Its squared distance from that span.
    pub pivot: Real,
}

/// Of so few columns, sums over all places are unrolled.
const UNROLLED: usize = 8;

impl<const NV: usize> Factor<NV> {
    /// The factor of the matrix without columns.
    pub const EMPTY: Self = Self { M: [[0.0; NV]; NV], D: [0.0; NV], inverse: [0.0; NV], len: 0 };

    /// Forgets all columns.
    #[inline]
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// The smallest squared distance of a column from the span of those before it.
    #[inline(always)]
    pub fn least(&self) -> Real {
        self.D.iter().take(self.len).fold(Real::INFINITY, |least, d| if *d < least { *d } else { least })
    }

    /// The solution of N'N x = b; entries of b beyond the columns do not count.
    #[inline(always)]
    pub fn solve(&self, b: &[Real; NV]) -> [Real; NV] {
        let mut x = [0.0; NV];
        self.substitute(b, &mut x);
        x
    }

    /// Adds the solution to x.
    #[inline(never)]
    pub fn solve_into(&self, b: &[Real; NV], x: &mut [Real; NV]) {
        self.substitute(b, x);
    }

    /// x += M' D^-1 M b, and b' x. Out of line and in place: an array that is returned is copied
    /// while parts of it are still on their way to memory.
    #[inline(always)]
    fn substitute(&self, b: &[Real; NV], x: &mut [Real; NV]) -> Real {
        let mut square = 0.0;
        for ((i, row), inverse) in self.M.iter().enumerate().zip(&self.inverse).take(self.len) {
            let along = Self::product(row, b, i + 1);
            square += along * inverse * along;
            add_scaled(Self::part(x, i + 1), inverse * along, row);
        }
        square
    }

    /// `products` are the inner products of the new column with those there are, `square` that with itself.
    #[inline(always)]
    pub fn column(&self, products: &[Real; NV], square: Real) -> Column<NV> {
        let mut column = Column { combination: [0.0; NV], pivot: square };
        column.pivot -= self.substitute(products, &mut column.combination);
        column
    }

    /// Appends a column with `pivot` > 0. Does nothing when all `NV` places are taken.
    #[inline]
    pub fn push(&mut self, column: &Column<NV>) {
        let places = (self.M.get_mut(self.len), self.D.get_mut(self.len), self.inverse.get_mut(self.len));
        if let (Some(row), Some(d), Some(inverse)) = places {
            for (entry, coefficient) in row.iter_mut().zip(&column.combination) {
                *entry = -coefficient;
            }
            if let Some(diagonal) = row.get_mut(self.len) {
                *diagonal = 1.0;
            }
            *d = column.pivot;
            *inverse = 1.0 / column.pivot;
            self.len += 1;
        }
    }

    /// Appends a column by its Gram entries alone. Refuses one that lies within 1e-7 of the others' span, relative to
    /// its length.
    pub fn push_gram(&mut self, products: &[Real; NV], square: Real) -> bool {
        let column = self.column(products, square);
        let independent = column.pivot > precision::DEPENDENT * square;
        if independent {
            self.push(&column);
        }
        independent
    }

    /// Removes column `at`: what its direction has in common with each later one is rotated into that, and the rest, which
    /// alone contains column `at`, is dropped.
    pub fn remove(&mut self, at: usize) {
        let len = self.len;
        let mut rows = self.M.iter_mut().zip(self.D.iter_mut().zip(&mut self.inverse)).take(len).skip(at);
        let Some((mut hole, (mut d_hole, mut inverse_hole))) = rows.next() else { return };
        let (mut carried, mut square) = (*hole, *d_hole);
        for (row, (d, inverse)) in rows {
            let (along, share) = (entry(row, at), entry(&carried, at));
            let out = along / share;
            let back = out * square * *inverse;
            for (entry, kept) in Self::part(row, len).iter_mut().zip(&mut carried) {
                let before = *entry;
                *entry -= out * *kept;
                *kept += back * before;
            }
            *d_hole = *d + out * out * square;
            *inverse_hole = 1.0 / *d_hole;
            square += back * back * *d;
            *hole = *row;
            let places = Self::part(hole, len);
            close_gap(places, at);
            if let Some(last) = places.last_mut() {
                *last = 0.0;
            }
            (hole, d_hole, inverse_hole) = (row, d, inverse);
        }
        self.len = len.saturating_sub(1);
    }

    /// The first `len` entries, or all of so few that the length is worth knowing beforehand.
    #[inline(always)]
    fn part(values: &mut [Real; NV], len: usize) -> &mut [Real] {
        if NV <= UNROLLED { values } else { values.get_mut(..len).unwrap_or_default() }
    }

    /// Inner product over the first `len` entries; beyond them, those of `row` are zero.
    #[inline(always)]
    fn product(row: &[Real; NV], values: &[Real; NV], len: usize) -> Real {
        if NV <= UNROLLED { dot(row, values) } else { dot_of(row.get(..len).unwrap_or_default(), values) }
    }
}

#[inline(always)]
fn entry<const NV: usize>(row: &[Real; NV], at: usize) -> Real {
    row.get(at).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::super::Real;
    use super::super::linear::dot;
    use super::Factor;

    /// Columns are appended and removed at every place; after each change the factor still solves with the Gram matrix.
    #[test]
    fn stays_exact_while_columns_come_and_go() {
        let mut seed = 1_u64;
        let mut uniform = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 40) as Real / (1_u64 << 23) as Real - 1.0
        };
        let mut factor = Factor::<6>::EMPTY;
        let mut columns = [[0.0; 6]; 6];
        let mut len = 0;
        for change in 0..2000 {
            if len == 6 || (len > 0 && uniform() > 0.2) {
                let at = change % len;
                factor.remove(at);
                columns[at..].rotate_left(1);
                len -= 1;
            } else {
                let column: [Real; 6] = core::array::from_fn(|_| uniform());
                let mut products = [0.0; 6];
                products.iter_mut().zip(&columns).take(len).for_each(|(product, other)| *product = dot(other, &column));
                assert!(factor.push_gram(&products, dot(&column, &column)));
                columns[len] = column;
                len += 1;
            }
            let b: [Real; 6] = core::array::from_fn(|_| uniform());
            let x = factor.solve(&b);
            for i in 0..len {
                let left = (0..len).fold(0.0, |sum, j| sum + dot(&columns[i], &columns[j]) * x[j]);
                let size = (0..len).fold(1.0, |size: Real, j| size.max(x[j].abs()));
                assert!(
                    (left - b[i]).abs() <= 1e7 * Real::EPSILON * size,
                    "after change {change}: {left} is not {}",
                    b[i]
                );
            }
        }
    }
}
