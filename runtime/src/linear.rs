//! Small dense linear algebra on arrays. Nothing here indexes, so nothing here can panic.

use super::{Real, precision};

/// Inner product, summed in several independent accumulators: shorter dependency chains, smaller rounding errors.
#[inline(always)]
pub fn dot<const N: usize>(a: &[Real; N], b: &[Real; N]) -> Real {
    // The length is known: only one of these is left.
    match (a.as_slice(), b.as_slice()) {
        ([a0], [b0]) => a0 * b0,
        ([a0, a1], [b0, b1]) => a0 * b0 + a1 * b1,
        ([a0, a1, a2], [b0, b1, b2]) => (a0 * b0 + a1 * b1) + a2 * b2,
        ([a0, a1, a2, a3], [b0, b1, b2, b3]) => (a0 * b0 + a1 * b1) + (a2 * b2 + a3 * b3),
        ([a0, a1, a2, a3, a4], [b0, b1, b2, b3, b4]) => ((a0 * b0 + a1 * b1) + (a2 * b2 + a3 * b3)) + a4 * b4,
        ([a0, a1, a2, a3, a4, a5], [b0, b1, b2, b3, b4, b5]) => {
            ((a0 * b0 + a1 * b1) + (a2 * b2 + a3 * b3)) + (a4 * b4 + a5 * b5)
        }
        (a, b) => dot_of(a, b),
    }
}

/// Inner product of as many entries as both have, summed like [`dot`].
#[inline(always)]
pub fn dot_of(a: &[Real], b: &[Real]) -> Real {
    let len = a.len().min(b.len());
    let (a, b) = (a.get(..len).unwrap_or_default(), b.get(..len).unwrap_or_default());
    let (a_quads, a_rest) = a.as_chunks::<4>();
    let (b_quads, b_rest) = b.as_chunks::<4>();
    // -0.0 + x is x, which 0.0 + x is not for every x: so the first addition is left out.
    let mut sums = [-0.0; 4];
    for (x, y) in a_quads.iter().zip(b_quads) {
        for ((sum, x), y) in sums.iter_mut().zip(x).zip(y) {
            *sum += x * y;
        }
    }
    let rest = a_rest.iter().zip(b_rest).fold(-0.0, |sum, (x, y)| sum + x * y);
    let [s0, s1, s2, s3] = sums;
    ((s0 + s1) + (s2 + s3)) + rest
}

/// Matrix (rows) times vector.
#[inline]
pub fn times<const R: usize, const C: usize>(matrix: &[[Real; C]; R], vector: &[Real; C]) -> [Real; R] {
    matrix.each_ref().map(|row| dot(row, vector))
}

/// a + b.
#[inline]
pub fn add<const N: usize>(a: &[Real; N], b: &[Real; N]) -> [Real; N] {
    let mut sum = *a;
    add_scaled(&mut sum, 1.0, b);
    sum
}

/// a - b.
#[inline]
pub fn subtract<const N: usize>(a: &[Real; N], b: &[Real; N]) -> [Real; N] {
    let mut difference = *a;
    add_scaled(&mut difference, -1.0, b);
    difference
}

/// a += scale b, as far as both reach.
#[inline(always)]
pub fn add_scaled(a: &mut [Real], scale: Real, b: &[Real]) {
    for (a, b) in a.iter_mut().zip(b) {
        *a += scale * b;
    }
}

/// Whether every entry is a finite number.
#[inline]
pub fn finite(values: &[Real]) -> bool {
    values.iter().all(|value| value.is_finite())
}

/// Largest magnitude; 0 of nothing. What is not a number is passed over.
#[inline(always)]
pub fn largest(values: &[Real]) -> Real {
    most(values, 0.0, |value| value.abs())
}

/// The largest of what `of` makes of the values, if it is above `least`, several at a time. What is not a number is passed over.
#[inline(always)]
pub fn most(values: &[Real], least: Real, of: impl Fn(Real) -> Real) -> Real {
    let (quads, rest) = values.as_chunks::<4>();
    let mut lanes = [least; 4];
    for quad in quads {
        for (lane, value) in lanes.iter_mut().zip(quad) {
            *lane = larger(of(*value), *lane);
        }
    }
    for (lane, value) in lanes.iter_mut().zip(rest) {
        *lane = larger(of(*value), *lane);
    }
    let [a, b, c, d] = lanes;
    larger(larger(a, b), larger(c, d))
}

/// The larger of two numbers, the second where one is none; one instruction, where `f64::max` is several.
#[inline(always)]
pub fn larger(a: Real, b: Real) -> Real {
    if a > b { a } else { b }
}

/// Puts `value` into `[low, high]`. Unlike `f64::clamp` it has no panic path; a NaN becomes `low`.
#[inline]
pub fn clip(value: Real, low: Real, high: Real) -> Real {
    value.max(low).min(high)
}

/// Removes entry `at` of a list that ends with the array: later entries move up by one, the last one stays too.
#[inline]
pub fn close_gap<T: Copy>(items: &mut [T], at: usize) {
    let mut items = items.iter_mut().skip(at);
    if let Some(mut hole) = items.next() {
        for item in items {
            *hole = *item;
            hole = item;
        }
    }
}

/// Drops the first entry of a window over time and appends `newest`.
#[inline]
pub fn shift_in<T: Copy, const N: usize>(window: &mut [T; N], newest: T) {
    close_gap(window, 0);
    if let Some(last) = window.last_mut() {
        *last = newest;
    }
}

/// Square root by Newton's method to within two units in the last place; 0 of what is not positive. `core` has none.
pub fn sqrt(value: Real) -> Real {
    if value.is_nan() || value <= 0.0 || value.is_infinite() {
        return value.max(0.0);
    }
    // Halving the biased exponent leaves an error below 7 %, which four doublings of the correct digits make exact;
    // subnormal numbers start further off and need the other steps.
    let mut root = precision::half_exponent(value);
    for _ in 0..8 {
        root = 0.5 * (root + value / root);
    }
    root
}

#[cfg(test)]
mod tests {
    use super::super::Real;
    use super::{clip, close_gap, dot, dot_of, shift_in, sqrt};

    #[test]
    fn takes_square_roots_over_the_whole_range() {
        for exponent in Real::MIN_10_EXP - 12..Real::MAX_10_EXP {
            for digits in [1.0, 2.0, 3.7, 9.99] {
                let value: Real = digits * (10.0 as Real).powi(exponent);
                let (root, exact) = (sqrt(value), value.sqrt());
                assert!((root - exact).abs() <= 2.0 * (exact.next_up() - exact), "{value:e}: {root:e}, not {exact:e}");
            }
        }
        assert_eq!([0.0, -1.0, Real::NAN, Real::INFINITY].map(sqrt), [0.0, 0.0, 0.0, Real::INFINITY]);
    }

    #[test]
    fn sums_products_of_every_length() {
        let a: [Real; 7] = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
        assert_eq!(dot(&a, &a), 140.0);
        assert_eq!(dot(&[2.0; 4], &[3.0; 4]), 24.0);
        assert_eq!(dot(&[1.0], &[7.0]), 7.0);
        assert_eq!(dot(&[1.0, 2.0], &[7.0, 5.0]), 17.0);
        assert_eq!(dot(&[1.0, 2.0, 3.0], &[7.0, 5.0, 1.0]), 20.0);
        assert_eq!(dot(&[1.0, 2.0, 3.0, 4.0, 5.0], &[7.0, 5.0, 1.0, 2.0, 3.0]), 43.0);
        assert_eq!(dot(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], &[7.0, 5.0, 1.0, 2.0, 3.0, 4.0]), 67.0);
        for len in 0..=7 {
            let squares: Real = a[..len].iter().map(|x| x * x).sum();
            assert_eq!(dot_of(&a[..len], &a[..len]), squares);
        }
        assert_eq!(dot(&[2.0; 11], &[3.0; 11]), 66.0);
        assert_eq!(dot(&[], &[]), 0.0);
        assert_eq!(dot_of(&a, &a[..6]), 91.0);
    }

    #[test]
    fn moves_entries_up() {
        let mut list = [1, 2, 3, 4];
        close_gap(&mut list, 1);
        assert_eq!(list, [1, 3, 4, 4]);
        shift_in(&mut list, 5);
        assert_eq!(list, [3, 4, 4, 5]);
    }

    #[test]
    fn clips_without_a_panic() {
        assert_eq!(clip(2.0, -1.0, 1.0), 1.0);
        assert_eq!(clip(Real::NAN, -1.0, 1.0), -1.0);
        assert_eq!(clip(0.0, Real::NEG_INFINITY, Real::INFINITY), 0.0);
    }
}
