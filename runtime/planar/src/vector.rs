//! Vectors in the plane. Only the operations of IEEE 754 that are exactly rounded, so results are the same on every machine.

/// Enough for every double: the start is within 7 % unless the number is subnormal, and each step doubles the digits.
const NEWTON_STEPS: usize = 8;

/// Square root by Newton's method to within two units in the last place; 0 of what is not positive. `core` has none.
pub(crate) fn sqrt(value: f64) -> f64 {
    if value.is_nan() || value <= 0.0 || value.is_infinite() {
        return value.max(0.0);
    }
    let mut root = f64::from_bits((value.to_bits() >> 1) + 0x1ff8_0000_0000_0000);
    for _ in 0..NEWTON_STEPS {
        root = 0.5 * (root + value / root);
    }
    root
}

/// Puts `value` into `[low, high]`. Unlike `f64::clamp` it has no panic path; a NaN becomes `low`.
pub(crate) fn clip(value: f64, low: f64, high: f64) -> f64 {
    value.max(low).min(high)
}

/// a' b.
pub(crate) fn dot([a0, a1]: [f64; 2], [b0, b1]: [f64; 2]) -> f64 {
    a0 * b0 + a1 * b1
}

/// |a| |b| times the sine of the angle from a to b, counter-clockwise.
pub(crate) fn cross([a0, a1]: [f64; 2], [b0, b1]: [f64; 2]) -> f64 {
    a0 * b1 - a1 * b0
}

/// a + scale b.
pub(crate) fn add_scaled([a0, a1]: [f64; 2], scale: f64, [b0, b1]: [f64; 2]) -> [f64; 2] {
    [a0 + scale * b0, a1 + scale * b1]
}

/// a - b.
pub(crate) fn subtract([a0, a1]: [f64; 2], [b0, b1]: [f64; 2]) -> [f64; 2] {
    [a0 - b0, a1 - b1]
}

/// scale a.
pub(crate) fn scaled([a0, a1]: [f64; 2], scale: f64) -> [f64; 2] {
    [scale * a0, scale * a1]
}

/// Turned by a quarter, counter-clockwise.
pub(crate) fn quarter_turn([a0, a1]: [f64; 2]) -> [f64; 2] {
    [-a1, a0]
}

/// |a_1| + |a_2|.
pub(crate) fn sum_of_magnitudes([a0, a1]: [f64; 2]) -> f64 {
    a0.abs() + a1.abs()
}

/// |a|, without overflow on the way.
pub(crate) fn length(a: [f64; 2]) -> f64 {
    let largest = largest(a);
    if largest > 0.0 && largest.is_finite() {
        let a = a.map(|entry| entry / largest);
        largest * sqrt(dot(a, a))
    } else {
        largest
    }
}

/// a / |a|; `None` if a is zero or not finite.
pub(crate) fn unit(a: [f64; 2]) -> Option<[f64; 2]> {
    let largest = largest(a);
    if !(largest > 0.0 && largest.is_finite()) {
        return None;
    }
    let a = a.map(|entry| entry / largest);
    let length = sqrt(dot(a, a));
    Some(a.map(|entry| entry / length))
}

/// Largest magnitude of an entry; NaN if one is.
fn largest([a0, a1]: [f64; 2]) -> f64 {
    if a0.is_nan() || a1.is_nan() { f64::NAN } else { a0.abs().max(a1.abs()) }
}

#[cfg(test)]
mod tests {
    use super::{cross, dot, length, sqrt, unit};

    #[test]
    fn takes_square_roots_over_the_whole_range() {
        for exponent in -320..=307 {
            for digits in [1.0, 2.0, 3.7, 9.99] {
                let value: f64 = digits * 10_f64.powi(exponent);
                let (root, exact) = (sqrt(value), value.sqrt());
                assert!((root - exact).abs() <= 2.0 * (exact.next_up() - exact), "{value:e}: {root:e}, not {exact:e}");
            }
        }
        assert_eq!([0.0, -1.0, f64::NAN, f64::INFINITY].map(sqrt), [0.0, 0.0, 0.0, f64::INFINITY]);
    }

    #[test]
    fn lengths_and_directions_neither_overflow_nor_underflow() {
        for scale in [1e-308, 1e-200, 1.0, 1e200, 1e307] {
            assert!((length([3.0 * scale, -4.0 * scale]) / scale - 5.0).abs() < 1e-12);
            let [x, y] = unit([3.0 * scale, -4.0 * scale]).unwrap();
            assert!((x - 0.6).abs() < 1e-15 && (y + 0.8).abs() < 1e-15, "{x} {y}");
        }
        let nothing = [[0.0; 2], [f64::NAN, 1.0], [1.0, f64::NAN], [f64::INFINITY, 0.0]];
        assert!(nothing.into_iter().all(|a| unit(a).is_none()));
        assert!(
            length([0.0; 2]) == 0.0 && length([f64::NAN, 1.0]).is_nan() && length([f64::INFINITY; 2]).is_infinite()
        );
    }

    #[test]
    fn products_have_the_signs_of_cosine_and_sine() {
        assert_eq!((dot([1.0, 0.0], [0.0, 1.0]), cross([1.0, 0.0], [0.0, 1.0])), (0.0, 1.0));
    }
}
