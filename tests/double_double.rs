//! Numbers of 106 bits: the unevaluated sum of two doubles (T. J. Dekker, "A floating-point technique for extending the
//! available precision", Numerische Mathematik 18, 1971).
#![expect(non_snake_case, reason = "the symbols of the literature")]

use std::ops::{Add, Div, Mul, Neg, Sub};

/// high + low, |low| at most half a unit in the last place of high.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wide {
    high: f64,
    low: f64,
}

impl Wide {
    pub const ZERO: Self = Self { high: 0.0, low: 0.0 };

    pub fn value(self) -> f64 {
        self.high + self.low
    }

    pub fn abs(self) -> Self {
        if self.high < 0.0 { -self } else { self }
    }

    fn sum(a: f64, b: f64) -> Self {
        let high = a + b;
        let part = high - a;
        Self { high, low: (a - (high - part)) + (b - part) }
    }
}

impl From<f64> for Wide {
    fn from(high: f64) -> Self {
        Self { high, low: 0.0 }
    }
}

impl Add for Wide {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let (high, low) = (Self::sum(self.high, other.high), Self::sum(self.low, other.low));
        let first = Self::sum(high.high, high.low + low.high);
        Self::sum(first.high, first.low + low.low)
    }
}

impl Neg for Wide {
    type Output = Self;
    fn neg(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }
}

impl Sub for Wide {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Wide {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let high = self.high * other.high;
        let low = self.high.mul_add(other.high, -high) + (self.high * other.low + self.low * other.high);
        Self::sum(high, low)
    }
}

impl Div for Wide {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let first = Self::from(self.high / other.high);
        let rest = self - first * other;
        let second = Self::from(rest.high / other.high);
        let third = (rest - second * other).high / other.high;
        first + second + Self::from(third)
    }
}

/// Inner product of doubles, as if summed exactly.
pub fn dot(a: &[f64], b: &[f64]) -> Wide {
    a.iter().zip(b).fold(Wide::ZERO, |sum, (&a, &b)| sum + Wide::from(a) * Wide::from(b))
}

/// x with A x = b, A symmetric and positive definite; `None` where it is not, to 106 bits.
pub fn solve(A: &[Vec<Wide>], b: &[Wide]) -> Option<Vec<Wide>> {
    let count = b.len();
    let mut L = A.to_vec();
    for k in 0..count {
        for i in k..count {
            let known = (0..k).fold(Wide::ZERO, |sum, j| sum + L[i][j] * L[k][j] * L[j][j]);
            let rest = A[i][k] - known;
            if i == k {
                L[k][k] = rest;
                (rest.value() > 1e-26 * A[k][k].value()).then_some(())?;
            } else {
                L[i][k] = rest / L[k][k];
            }
        }
    }
    let mut x = b.to_vec();
    for i in 0..count {
        x[i] = (0..i).fold(x[i], |rest, j| rest - L[i][j] * x[j]);
    }
    for i in (0..count).rev() {
        x[i] = (i + 1..count).fold(x[i] / L[i][i], |rest, j| rest - L[j][i] * x[j]);
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_that_a_double_loses_are_kept() {
        let (one, tiny) = (Wide::from(1.0), Wide::from(1e-25));
        assert_eq!((one + tiny - one).value(), 1e-25);
        let third = one / Wide::from(3.0);
        assert!((third * Wide::from(3.0) - one).abs().value() < 1e-31);
        assert_eq!(dot(&[1e20, 1.0, -1e20], &[1.0, 0.5, 1.0]).value(), 0.5);
    }

    #[test]
    fn solves_what_is_nearly_singular() {
        let near = 1.0 - 1e-10;
        let A = [[1.0, near], [near, 1.0]].map(|row| row.map(Wide::from).to_vec());
        let x = solve(&A, &[Wide::from(1.0), Wide::ZERO]).unwrap();
        let left = A[1][0] * x[0] + A[1][1] * x[1];
        assert!(left.abs().value() < 1e-20 * x[0].abs().value());
        assert!(solve(&[vec![Wide::from(1.0); 2], vec![Wide::from(1.0); 2]], &[Wide::ZERO; 2]).is_none());
    }
}
