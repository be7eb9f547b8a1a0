//! Matrix exponentials with a proved error: scaling, Taylor and squaring on matrices of intervals.
//!
//! Every product carries the standard bound n u |M| |N| of its rounding (Higham, "Accuracy and Stability of Numerical
//! Algorithms", section 3.5), so that what comes out is a middle and a radius that hold the exact exponential.
#![expect(non_snake_case, reason = "the symbols of the literature")]

use nalgebra::DMatrix;

/// Terms of the series at a norm of at most 1/2: what is left out is below 2e-23.
const TERMS: usize = 18;
/// Beyond this norm nothing of use comes out.
const LARGEST: f64 = 1e9;

/// All matrices with |X - middle| <= radius, entry by entry.
#[derive(Debug, Clone, PartialEq)]
pub struct Enclosure {
    pub middle: DMatrix<f64>,
    /// Not negative.
    pub radius: DMatrix<f64>,
}

/// e^{A h} and the integral of e^{A s} over 0 <= s <= h times B, for every A and B in the enclosures: one period of
/// x' = A x + B v with v constant. `None` where numbers overflow.
pub fn sampled(A: &Enclosure, B: &Enclosure, h: f64) -> Option<(Enclosure, Enclosure)> {
    let (n, m) = B.middle.shape();
    let whole = |a: &DMatrix<f64>, b: &DMatrix<f64>| {
        let mut whole = DMatrix::zeros(n + m, n + m);
        whole.view_mut((0, 0), (n, n)).copy_from(&(a * h));
        whole.view_mut((0, n), (n, m)).copy_from(&(b * h));
        whole
    };
    let middle = whole(&A.middle, &B.middle);
    let radius = whole(&A.radius, &B.radius) * (1.0 + 4.0 * f64::EPSILON) + middle.abs() * f64::EPSILON;
    let after = exponential(&Enclosure { middle, radius })?;
    Some((after.part((0, 0), (n, n)), after.part((0, n), (n, m))))
}

/// e^A for every A in the enclosure; `None` where numbers overflow.
pub fn exponential(A: &Enclosure) -> Option<Enclosure> {
    let n = A.middle.nrows();
    if n == 0 {
        return Some(A.clone());
    }
    let norm = (0..n).map(|r| A.size().row(r).sum()).fold(0.0, f64::max);
    if norm.is_nan() || norm > LARGEST {
        return None;
    }
    let halvings = if norm > 0.5 { (2.0 * norm).log2().ceil() as i32 } else { 0 };
    // Exact: a power of two.
    let scale = 0.5f64.powi(halvings);
    let scaled = Enclosure { middle: &A.middle * scale, radius: &A.radius * scale };
    let mut power = series(&scaled);
    for _ in 0..halvings {
        power = power.times(&power);
    }
    power.middle.iter().chain(&power.radius).all(|entry| entry.is_finite()).then_some(power)
}

/// I + A (I + A/2 (I + A/3 ...)), where no row sum of A is beyond 1/2.
fn series(A: &Enclosure) -> Enclosure {
    let n = A.middle.nrows();
    let mut sum = Enclosure::exactly(DMatrix::identity(n, n));
    for k in (1..=TERMS).rev() {
        let Enclosure { middle, radius } = A.times(&sum);
        let quotient = middle / k as f64;
        // Of the quotient and of the sum on the diagonal.
        let rounding = (quotient.abs() * 2.0 + DMatrix::identity(n, n)) * f64::EPSILON;
        let radius = (radius / k as f64) * (1.0 + 4.0 * f64::EPSILON) + rounding;
        sum = Enclosure { middle: quotient + DMatrix::identity(n, n), radius };
    }
    sum.radius.add_scalar_mut(2e-23);
    sum
}

impl Enclosure {
    pub fn exactly(middle: DMatrix<f64>) -> Self {
        let radius = DMatrix::zeros(middle.nrows(), middle.ncols());
        Self { middle, radius }
    }

    /// The exact product of two matrices of numbers.
    pub fn product(left: &DMatrix<f64>, right: &DMatrix<f64>) -> Self {
        let rounding = (left.ncols() + 4) as f64 * f64::EPSILON;
        let radius = (left.abs() * right.abs() * rounding).add_scalar(left.ncols() as f64 * f64::MIN_POSITIVE);
        Self { middle: left * right, radius }
    }

    /// All products of the two.
    pub fn times(&self, other: &Self) -> Self {
        let n = self.middle.ncols();
        let rounding = (n + 4) as f64 * f64::EPSILON;
        let (size, other_size) = (self.middle.abs(), other.middle.abs());
        let mut radius = size * (&other.radius + &other_size * rounding);
        if self.radius.amax() > 0.0 {
            radius += &self.radius * (other_size + &other.radius);
        }
        // The radius is rounded, too.
        let radius = (radius * (1.0 + 4.0 * rounding)).add_scalar(n as f64 * f64::MIN_POSITIVE);
        Self { middle: &self.middle * &other.middle, radius }
    }

    /// Largest magnitudes.
    fn size(&self) -> DMatrix<f64> {
        self.middle.abs() + &self.radius
    }

    fn part(&self, from: (usize, usize), size: (usize, usize)) -> Self {
        let part = |matrix: &DMatrix<f64>| matrix.view(from, size).into_owned();
        Self { middle: part(&self.middle), radius: part(&self.radius) }
    }
}
