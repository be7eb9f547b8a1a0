//! The factor L D L' of a growing and shrinking Gram matrix.
#![expect(non_snake_case, reason = "L D L' is the factor's name everywhere")]

use super::linear::{add_scaled, close_gap, dot_of};
use super::{Real, precision};

/// L D L' = N'N for a matrix N of at most `NV` independent columns; L is unit lower triangular, D positive.
///
/// Columns are appended and removed without factoring anew: O(len^2) each. What lies on and above L's diagonal, and
/// beyond the columns there are, is left over from before and never read.
#[derive(Debug, Clone)]
pub struct Factor<const NV: usize> {
    L: [[Real; NV]; NV],
    D: [Real; NV],
    /// 1 / D.
    inverse: [Real; NV],
    len: usize,
}

/// What appending a column would append: its row of L, and its squared distance from the span of the others.
#[derive(Debug, Clone, Copy)]
pub struct Column<const NV: usize> {
    pub row: [Real; NV],
    pub pivot: Real,
}

impl<const NV: usize> Factor<NV> {
    /// The factor of the matrix without columns.
    pub const EMPTY: Self = Self { L: [[0.0; NV]; NV], D: [0.0; NV], inverse: [0.0; NV], len: 0 };

    /// Forgets all columns.
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// Solves L D L' x = b in place; entries beyond the columns are left alone.
    pub fn solve(&self, b: &mut [Real; NV]) {
        self.forward(b);
        for (value, inverse) in b.iter_mut().zip(&self.inverse).take(self.len) {
            *value *= inverse;
        }
        self.backward(b);
    }

    /// `products` are the inner products of the new column with those there are, `square` that with itself.
    pub fn column(&self, products: &[Real; NV], square: Real) -> Column<NV> {
        let mut row = *products;
        self.forward(&mut row);
        let mut pivot = square;
        for (value, inverse) in row.iter_mut().zip(&self.inverse).take(self.len) {
            let scaled = *value * inverse;
            pivot -= *value * scaled;
            *value = scaled;
        }
        Column { row, pivot }
    }

    /// The coefficients over the columns there are of the one nearest to `column` in their span.
    pub fn combination(&self, column: &Column<NV>) -> [Real; NV] {
        let mut coefficients = column.row;
        self.backward(&mut coefficients);
        coefficients
    }

    /// Appends a column with `pivot` > 0. Does nothing when all `NV` places are taken.
    pub fn push(&mut self, column: &Column<NV>) {
        let places = (self.L.get_mut(self.len), self.D.get_mut(self.len), self.inverse.get_mut(self.len));
        if let (Some(l), Some(d), Some(inverse)) = places {
            *l = column.row;
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

    /// Removes column `at`.
    pub fn remove(&mut self, at: usize) {
        let Some(&removed) = self.D.get(at) else { return };
        let len = self.len;
        let mut column = [0.0; NV];
        for (value, row) in column.iter_mut().zip(&self.L).take(len).skip(at + 1) {
            *value = row.get(at).copied().unwrap_or(0.0);
        }
        close_gap(&mut column, at);
        close_gap(self.D.get_mut(..len).unwrap_or_default(), at);
        close_gap(self.inverse.get_mut(..len).unwrap_or_default(), at);
        close_gap(self.L.get_mut(..len).unwrap_or_default(), at);
        for row in self.L.iter_mut().take(len).skip(at) {
            close_gap(row.get_mut(..len).unwrap_or_default(), at);
        }
        self.len = len.saturating_sub(1);
        self.add_outer(at, removed, column);
    }

    /// b := L^-1 b.
    #[inline]
    fn forward(&self, b: &mut [Real; NV]) {
        for (i, row) in self.L.iter().enumerate().take(self.len) {
            if let Some((done, rest)) = b.split_at_mut_checked(i)
                && let Some(value) = rest.first_mut()
            {
                *value -= dot_of(row, done);
            }
        }
    }

    /// b := L^-T b.
    #[inline]
    fn backward(&self, b: &mut [Real; NV]) {
        for (i, row) in self.L.iter().enumerate().take(self.len).rev() {
            if let Some((earlier, rest)) = b.split_at_mut_checked(i) {
                add_scaled(earlier, -rest.first().copied().unwrap_or(0.0), row);
            }
        }
    }

    /// L D L' += weight a a', where only entries of `a` from `from` on count (Gill, Golub, Murray and Saunders,
    /// "Methods for modifying matrix factorizations", 1974, method C1).
    fn add_outer(&mut self, from: usize, weight: Real, mut a: [Real; NV]) {
        let mut weight = weight;
        for c in from..self.len {
            let (Some(&p), Some(d), Some(inverse)) = (a.get(c), self.D.get_mut(c), self.inverse.get_mut(c)) else {
                return;
            };
            let sum = *d + weight * p * p;
            *inverse = 1.0 / sum;
            let beta = weight * p * *inverse;
            weight *= *d * *inverse;
            *d = sum;
            for (row, a) in self.L.iter_mut().zip(&mut a).take(self.len).skip(c + 1) {
                if let Some(l) = row.get_mut(c) {
                    *a -= p * *l;
                    *l += beta * *a;
                }
            }
        }
    }
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
            let mut x = b;
            factor.solve(&mut x);
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
