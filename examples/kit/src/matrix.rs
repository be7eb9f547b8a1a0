//! Small dense matrices in plain operations, so that every machine gets the same bits of them.

/// Rows of equal length.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix {
    pub rows: Vec<Vec<f64>>,
}

impl Matrix {
    pub fn zeros(rows: usize, columns: usize) -> Self {
        Self { rows: vec![vec![0.0; columns]; rows] }
    }

    pub fn identity(size: usize) -> Self {
        let mut identity = Self::zeros(size, size);
        (0..size).for_each(|k| identity.rows[k][k] = 1.0);
        identity
    }

    pub fn map(&self, of: impl Fn(f64) -> f64) -> Self {
        Self { rows: self.rows.iter().map(|row| row.iter().map(|x| of(*x)).collect()).collect() }
    }

    pub fn zip(&self, other: &Self, of: impl Fn(f64, f64) -> f64) -> Self {
        let row = |(a, b): (&Vec<f64>, &Vec<f64>)| a.iter().zip(b).map(|(a, b)| of(*a, *b)).collect();
        Self { rows: self.rows.iter().zip(&other.rows).map(row).collect() }
    }

    pub fn times(&self, other: &Self) -> Self {
        let columns = other.rows.first().map_or(0, Vec::len);
        let entry = |row: &[f64], c: usize| row.iter().zip(&other.rows).map(|(a, b)| a * b[c]).sum();
        Self { rows: self.rows.iter().map(|row| (0..columns).map(|c| entry(row, c)).collect()).collect() }
    }

    pub fn apply(&self, v: &[f64]) -> Vec<f64> {
        self.rows.iter().map(|row| row.iter().zip(v).map(|(a, b)| a * b).sum()).collect()
    }

    /// Rows `rows` and columns `columns`.
    pub fn block(&self, rows: std::ops::Range<usize>, columns: std::ops::Range<usize>) -> Self {
        Self { rows: self.rows[rows].iter().map(|row| row[columns.clone()].to_vec()).collect() }
    }

    pub fn put(&mut self, row: usize, column: usize, block: &Self) {
        for (k, values) in block.rows.iter().enumerate() {
            self.rows[row + k][column..column + values.len()].copy_from_slice(values);
        }
    }

    pub fn largest(&self) -> f64 {
        self.rows.iter().flatten().fold(0.0, |largest, x| x.abs().max(largest))
    }

    /// e^self, to rounding: Taylor series of the matrix over 2^10, squared ten times. For entries below a few hundred.
    pub fn exponential(&self) -> Self {
        const SQUARINGS: u32 = 10;
        const TERMS: u32 = 20;
        let small = self.map(|x| x / f64::from(1 << SQUARINGS));
        let mut sum = Self::identity(self.rows.len());
        let mut term = sum.clone();
        for k in 1..=TERMS {
            term = term.times(&small).map(|x| x / f64::from(k));
            sum = sum.zip(&term, |a, b| a + b);
        }
        (0..SQUARINGS).fold(sum, |power, _| power.times(&power))
    }
}

#[cfg(test)]
mod tests {
    use super::Matrix;

    #[test]
    fn exponential_of_a_rotation_and_of_a_shear() {
        let turned = Matrix { rows: vec![vec![0.0, -3.0], vec![3.0, 0.0]] }.exponential();
        let expected = Matrix { rows: vec![vec![3f64.cos(), -3f64.sin()], vec![3f64.sin(), 3f64.cos()]] };
        assert!(turned.zip(&expected, |a, b| a - b).largest() < 1e-13);
        let sheared = Matrix { rows: vec![vec![-20.0, 20.0], vec![0.0, -20.0]] }.exponential();
        assert!((sheared.rows[0][1] / (20.0 * (-20f64).exp()) - 1.0).abs() < 1e-12);
    }
}
