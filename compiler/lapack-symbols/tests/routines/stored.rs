//! Matrices as Fortran stores them, with columns further apart than they are long.

use nalgebra::DMatrix;

/// Pseudo-random numbers (SplitMix64) in [-1, 1], the same ones for the same seed.
pub struct Numbers(u64);

impl Numbers {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub fn number(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// Columns up to three numbers longer than their rows.
    pub fn matrix(&mut self, rows: usize, columns: usize) -> Stored {
        let ld = rows + (rows + columns) % 4;
        Stored { rows, columns, ld: ld as i32, data: (0..ld * columns).map(|_| self.number()).collect() }
    }
}

#[derive(Clone)]
pub struct Stored {
    pub rows: usize,
    pub columns: usize,
    pub ld: i32,
    pub data: Vec<f64>,
}

impl Stored {
    fn place(&self, i: usize, j: usize) -> usize {
        i + j * self.ld as usize
    }

    pub fn at(&self, i: usize, j: usize) -> f64 {
        self.data[self.place(i, j)]
    }

    pub fn set(&mut self, i: usize, j: usize, value: f64) {
        let place = self.place(i, j);
        self.data[place] = value;
    }

    pub fn places(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let (rows, columns) = (self.rows, self.columns);
        (0..columns).flat_map(move |j| (0..rows).map(move |i| (i, j)))
    }

    /// What one triangle says about entry (i, j).
    pub fn symmetric(&self, uplo: u8, i: usize, j: usize) -> f64 {
        let (low, high) = (i.min(j), i.max(j));
        if uplo == b'U' { self.at(low, high) } else { self.at(high, low) }
    }

    /// Whether what lies between the columns is as in `other`.
    pub fn padding_is(&self, other: &Self) -> bool {
        let between = |k: &usize| k % self.ld as usize >= self.rows;
        (0..self.data.len()).filter(between).all(|k| self.data[k] == other.data[k])
    }

    pub fn dense(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.rows, self.columns, |i, j| self.at(i, j))
    }

    pub fn store(matrix: &DMatrix<f64>, ld: usize) -> Self {
        let (rows, columns) = matrix.shape();
        let mut stored = Self { rows, columns, ld: ld as i32, data: vec![f64::NAN; ld * columns] };
        stored.places().for_each(|(i, j)| stored.set(i, j, matrix[(i, j)]));
        stored
    }
}
