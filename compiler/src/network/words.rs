//! Numbers, signals and linear combinations in the user's words.

use std::iter::zip;

use super::Signal;
use crate::optim::rounding::to_digits;

impl Signal {
    /// ` cm`, or nothing: what follows a number in the unit of this signal.
    pub(crate) fn unit_suffix(&self) -> String {
        self.unit.as_ref().map_or_else(String::new, |unit| format!(" {unit}"))
    }
}

/// The shortest digits that give the number back, with an exponent where that is shorter to read.
pub(super) fn number(value: f64) -> String {
    if value == 0.0 || (1e-5..1e7).contains(&value.abs()) { format!("{value}") } else { format!("{value:e}") }
}

/// As [`number`], but of numbers that nobody wrote, which have all digits of a double, six are enough to know them by.
fn coefficient(value: f64) -> String {
    let exact = number(value);
    let mantissa = exact.split('e').next().unwrap_or_default();
    let digits = mantissa.chars().filter(char::is_ascii_digit).skip_while(|digit| *digit == '0').count();
    if digits > 12 { number(to_digits(value, 6)) } else { exact }
}

/// `1 row`, `2 rows`.
pub(super) fn count(n: usize, thing: &str) -> String {
    if n == 1 { format!("1 {thing}") } else { format!("{n} {thing}s") }
}

/// `h1, h2`.
pub(super) fn names(signals: &[Signal]) -> String {
    let names: Vec<_> = signals.iter().map(|signal| &*signal.name).collect();
    names.join(", ")
}

/// `0.0165 h2 + 0.00013 v1`; `0` where every coefficient is zero.
pub(super) fn combination(coefficients: &[f64], signals: &[Signal]) -> String {
    let mut text = String::new();
    for (&c, signal) in zip(coefficients, signals).filter(|(c, _)| **c != 0.0) {
        text += match (text.is_empty(), c < 0.0) {
            (true, false) => "",
            (true, true) => "-",
            (false, false) => " + ",
            (false, true) => " - ",
        };
        if c.abs() != 1.0 {
            text += &format!("{} ", coefficient(c.abs()));
        }
        text += &signal.name;
    }
    if text.is_empty() { "0".to_string() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signals(names: &[&str]) -> Vec<Signal> {
        names.iter().map(|name| Signal { name: name.to_string(), unit: None }).collect()
    }

    #[test]
    fn combinations_read_like_formulas() {
        let signals = signals(&["h1", "h2", "v1"]);
        assert_eq!(combination(&[0.0, 0.0165, 1.3e-4], &signals), "0.0165 h2 + 0.00013 v1");
        assert_eq!(combination(&[-1.0, 1.0, -2.0], &signals), "-h1 + h2 - 2 v1");
        assert_eq!(combination(&[0.0, 0.0, 1e-9], &signals), "1e-9 v1");
        assert_eq!(combination(&[0.0; 3], &signals), "0");
        assert_eq!(
            combination(&[1.0 / 30.0, 0.123456789012, 2e-9 / 3.0], &signals),
            "0.0333333 h1 + 0.123456789012 h2 + 6.66667e-10 v1"
        );
    }
}
