//! Floating point that errs on the safe side, and short decimals.

/// Upper bound of sum a_k b_k over the real numbers, from its value in double precision and the standard bound
/// gamma_n sum |a_k b_k| (Higham, "Accuracy and Stability of Numerical Algorithms", section 3.1) taken twice.
pub fn dot_upper<'a>(terms: impl IntoIterator<Item = (&'a f64, &'a f64)>) -> f64 {
    let (mut value, mut size, mut count) = (0.0, 0.0, 2.0);
    for (a, b) in terms {
        value += a * b;
        size += (a * b).abs();
        count += 1.0;
    }
    value + 2.0 * count * f64::EPSILON * size
}

/// Upper bound of a sum.
pub fn sum_upper(terms: impl IntoIterator<Item = f64>) -> f64 {
    let (mut value, mut size, mut count) = (0.0, 0.0, 2.0);
    for term in terms {
        value += term;
        size += term.abs();
        count += 1.0;
    }
    value + 2.0 * count * f64::EPSILON * size
}

/// The nearest decimal with `digits` significant digits: the same on every machine, and short when printed.
pub fn to_digits(value: f64, digits: usize) -> f64 {
    parse(value, digits).unwrap_or(value)
}

/// The largest decimal with about `digits` significant digits that is not above `value`.
pub fn down_to_digits(value: f64, digits: usize) -> f64 {
    let nearest = to_digits(value, digits);
    if nearest <= value { nearest } else { to_digits(value - unit(value, digits), digits) }
}

/// The smallest decimal with about `digits` significant digits that is not below `value`.
pub fn up_to_digits(value: f64, digits: usize) -> f64 {
    -down_to_digits(-value, digits)
}

fn parse(value: f64, digits: usize) -> Option<f64> {
    if value == 0.0 || !value.is_finite() {
        return None;
    }
    format!("{value:.*e}", digits - 1).parse().ok()
}

/// One unit of the last of `digits` significant digits.
fn unit(value: f64, digits: usize) -> f64 {
    10.0_f64.powf(value.abs().log10().floor() + 1.0 - digits as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_down_never_goes_up() {
        for value in [1.0, 6.2912345, 0.0999999, 9.99999, 1e-9, 123456.7, -2.54712, -9.99999, -0.1] {
            for digits in [3, 5, 9] {
                let down = down_to_digits(value, digits);
                let up = up_to_digits(value, digits);
                assert!(down <= value && value <= up, "{down} {value} {up}");
                assert!(up - down <= 2.001 * unit(value, digits).max(unit(down, digits)));
            }
        }
    }

    #[test]
    fn dot_upper_is_above_the_exact_sum() {
        let a = [1e16, 1.0, -1e16];
        let b = [1.0, 1.0, 1.0];
        assert!(dot_upper(a.iter().zip(&b)) >= 1.0);
    }
}
