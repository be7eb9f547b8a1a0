//! Vectors with increments.

use crate::stored::Numbers;

#[derive(Clone)]
pub struct Strided {
    pub data: Vec<f64>,
    length: usize,
    increment: i32,
}

impl Strided {
    pub fn random(numbers: &mut Numbers, length: usize, increment: i32) -> Self {
        let data = (0..(length - 1) * increment.unsigned_abs() as usize + 1).map(|_| numbers.number()).collect();
        Self { data, length, increment }
    }

    /// Entry k; a negative increment stores the vector backwards.
    pub fn at(&self, k: usize) -> f64 {
        let k = if self.increment < 0 { self.length - 1 - k } else { k };
        self.data[k * self.increment.unsigned_abs() as usize]
    }
}
