//! The factor L D L' of a growing and shrinking Gram matrix.
#![expect(non_snake_case, reason = "L D L' is the factor's name everywhere")]

use crate::linear::{close_gap, dot};

/// L D L' = N'N for a matrix N of at most `NV` independent columns; L is unit lower triangular, D positive.
///
/// Columns are appended and removed without factoring anew: O(NV^2) each. Entries on and above L's diagonal are
/// stored as zeros.
#[derive(Debug, Clone)]
pub struct Factor<const NV: usize> {
    L: [[f64; NV]; NV],
    D: [f64; NV],
    len: usize,
}

impl<const NV: usize> Factor<NV> {
    /// The factor of the matrix without columns.
    pub const EMPTY: Self = Self { L: [[0.0; NV]; NV], D: [0.0; NV], len: 0 };

    /// Solves L D L' x = b; entries of `b` beyond the columns are ignored, those of `x` are zero.
    pub fn solve(&self, b: &[f64; NV]) -> [f64; NV] {
        let mut x = self.forward(b);
        for (i, row) in self.L.iter().enumerate().take(self.len).rev() {
            let solved = x.get(i).copied().unwrap_or(0.0);
            for (x, l) in x.iter_mut().zip(row) {
                *x -= l * solved;
            }
        }
        x
    }

    /// Appends a column: `products` are its inner products with the columns there are, `pivot` > 0 its squared
    /// distance from their span. Does nothing when all `NV` places are taken.
    pub fn push(&mut self, products: &[f64; NV], pivot: f64) {
        let row = self.forward(products);
        if let (Some(l), Some(d)) = (self.L.get_mut(self.len), self.D.get_mut(self.len)) {
            *l = row;
            *d = pivot;
            self.len += 1;
        }
    }

    /// Appends a column by its Gram entries alone. Refuses one that lies within 1e-7 of the others' span, relative to
    /// its length.
    pub fn push_gram(&mut self, products: &[f64; NV], square: f64) -> bool {
        let row = self.forward(products);
        let pivot = row.iter().zip(&self.D).fold(square, |pivot, (l, d)| pivot - d * l * l);
        let independent = pivot > 1e-14 * square;
        if independent {
            self.push(products, pivot);
        }
        independent
    }

    /// Removes column `at`.
    pub fn remove(&mut self, at: usize) {
        let Some(&removed) = self.D.get(at) else { return };
        let mut column = self.L.each_ref().map(|row| row.get(at).copied().unwrap_or(0.0));
        close_gap(&mut column, at);
        close_gap(&mut self.D, at);
        close_gap(&mut self.L, at);
        for row in self.L.iter_mut().skip(at) {
            close_gap(row, at);
        }
        self.len = self.len.saturating_sub(1);
        self.add_outer(at, removed, column);
    }

    /// D^-1 L^-1 b.
    fn forward(&self, b: &[f64; NV]) -> [f64; NV] {
        let mut scaled = [0.0; NV];
        let mut solved = [0.0; NV];
        for (i, ((row, b), d)) in self.L.iter().zip(b).zip(&self.D).enumerate().take(self.len) {
            let value = b - dot(row, &solved);
            if let (Some(solved), Some(scaled)) = (solved.get_mut(i), scaled.get_mut(i)) {
                *solved = value;
                *scaled = value / d;
            }
        }
        scaled
    }

    /// L D L' += weight a a', where only entries of `a` from `from` on count (Gill, Golub, Murray and Saunders,
    /// "Methods for modifying matrix factorizations", 1974, method C1).
    fn add_outer(&mut self, from: usize, weight: f64, mut a: [f64; NV]) {
        let mut weight = weight;
        for c in from..self.len {
            let (Some(&p), Some(d)) = (a.get(c), self.D.get_mut(c)) else { return };
            let sum = *d + weight * p * p;
            let beta = weight * p / sum;
            weight *= *d / sum;
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
    use super::Factor;
    use crate::linear::dot;

    /// Columns are appended and removed at every place; after each change the factor still solves with the Gram matrix.
    #[test]
    fn stays_exact_while_columns_come_and_go() {
        let mut seed = 1_u64;
        let mut uniform = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
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
                let column: [f64; 6] = core::array::from_fn(|_| uniform());
                let mut products = [0.0; 6];
                products.iter_mut().zip(&columns).take(len).for_each(|(product, other)| *product = dot(other, &column));
                assert!(factor.push_gram(&products, dot(&column, &column)));
                columns[len] = column;
                len += 1;
            }
            let b: [f64; 6] = core::array::from_fn(|_| uniform());
            let x = factor.solve(&b);
            for i in 0..len {
                let left = (0..len).fold(0.0, |sum, j| sum + dot(&columns[i], &columns[j]) * x[j]);
                let size = (0..len).fold(1.0, |size: f64, j| size.max(x[j].abs()));
                assert!((left - b[i]).abs() <= 1e-9 * size, "after change {change}: {left} is not {}", b[i]);
            }
        }
    }
}
