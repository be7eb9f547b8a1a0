//! What both types of number are asked for.

use core::ops::{Add, Mul};

/// `f64` or `f32`.
pub trait Scalar: Copy + Default + PartialOrd + Add<Output = Self> + Mul<Output = Self> {
    /// The number nearest to `numerator / 2^shift`.
    fn ratio(numerator: i16, shift: u8) -> Self;

    /// Its bits, in the lower ones of the word.
    fn bits(self) -> u64;
}

macro_rules! scalar {
    ($ty:ty) => {
        impl Scalar for $ty {
            fn ratio(numerator: i16, shift: u8) -> Self {
                (0..shift).fold(Self::from(numerator), |value, _| 0.5 * value)
            }

            fn bits(self) -> u64 {
                self.to_bits().into()
            }
        }
    };
}

scalar!(f64);
scalar!(f32);

/// Matrix times vector, plus another vector.
pub fn affine<S: Scalar, const R: usize, const C: usize>(matrix: &[[S; C]; R], x: &[S; C], plus: [S; R]) -> [S; R] {
    let mut sum = plus;
    for (sum, row) in sum.iter_mut().zip(matrix) {
        *sum = row.iter().zip(x).fold(*sum, |sum, (a, x)| sum + *a * *x);
    }
    sum
}
