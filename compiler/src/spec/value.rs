//! Single values: numbers, lists, matrices, weights, bounds, names.

use toml::de::{DeFloat, DeInteger, DeValue};

use super::imported::{self, is_reference};
use super::table::{Table, Value};
use super::{At, Bounds, Matrix, PerSignal, Row, Weight};
use crate::diagnostic::{Diagnostic, Diagnostics, code};
use crate::network::Signal;

/// Magnitudes beyond this are slips, and their products overflow.
pub(super) const LARGEST: f64 = 1e30;

/// A number a matrix may hold.
pub(super) fn finite(value: &Value<'_>, errors: &mut Diagnostics) -> Option<At<f64>> {
    let number = extended(value, errors)?;
    if number.value.is_finite() {
        return Some(number);
    }
    let error = Diagnostic::error(code::NOT_FINITE, format!("{} must be finite", value.what));
    errors.push(error.at(value.place.clone(), "infinity is allowed in bounds only"));
    None
}

/// A number a bound may hold: finite, or an infinity where there is no bound.
pub(super) fn extended(value: &Value<'_>, errors: &mut Diagnostics) -> Option<At<f64>> {
    let number = match value.toml {
        DeValue::Float(float) => float_value(float),
        DeValue::Integer(integer) => integer_value(integer),
        _ => return value.refuse("a number", errors),
    };
    let Some(complaint) = complaint(number, value.toml) else { return Some(At::new(number, value.place.clone())) };
    let error = Diagnostic::error(code::NOT_FINITE, format!("{} is not a usable number", value.what));
    errors.push(error.at(value.place.clone(), complaint));
    None
}

pub(super) fn integer(value: &Value<'_>, errors: &mut Diagnostics) -> Option<At<i64>> {
    let read = match value.toml {
        DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix()).ok(),
        _ => None,
    };
    match read {
        Some(read) => Some(At::new(read, value.place.clone())),
        None => value.refuse("an integer", errors),
    }
}

pub(super) fn boolean(value: &Value<'_>, errors: &mut Diagnostics) -> Option<bool> {
    match value.toml {
        DeValue::Boolean(read) => Some(*read),
        _ => value.refuse("true or false", errors),
    }
}

pub(super) fn text(value: &Value<'_>, errors: &mut Diagnostics) -> Option<At<String>> {
    match value.toml {
        DeValue::String(read) => Some(At::new(read.to_string(), value.place.clone())),
        _ => value.refuse("a string", errors),
    }
}

/// A name that is printed in messages and emitted into comments: not empty, on one line.
pub(super) fn title(value: &Value<'_>, errors: &mut Diagnostics) -> Option<At<String>> {
    let title = text(value, errors)?;
    if is_printable(&title.value) {
        return Some(title);
    }
    let error = Diagnostic::error(code::BAD_NAME, format!("{} cannot be used as a name", value.what));
    errors.push(error.at(title.place, "needs at least one letter, and no control characters or outer spaces"));
    None
}

/// `"h1"` or `"h1 [cm]"`.
pub(super) fn signal(value: &Value<'_>, errors: &mut Diagnostics) -> Option<At<Signal>> {
    let written = text(value, errors)?;
    let signal = parse_signal(&written.value);
    if signal.is_none() {
        let error = Diagnostic::error(code::BAD_NAME, format!("{} is not a signal name", value.what));
        let label = "expected a name, then perhaps a unit in brackets";
        errors.push(error.at(value.place.clone(), label).help("write \"h1\" or \"h1 [cm]\""));
    }
    Some(At::new(signal?, written.place))
}

/// A list whose entries `read` accepts; every bad entry is reported.
pub(super) fn list<T>(
    value: &Value<'_>,
    errors: &mut Diagnostics,
    expected: &str,
    read: fn(&Value<'_>, &mut Diagnostics) -> Option<T>,
) -> Option<At<Vec<T>>> {
    let Some(elements) = value.toml.as_array() else { return value.refuse(expected, errors) };
    let entries = all(elements.iter().enumerate().map(|(k, e)| read(&value.element(k, e), errors)));
    Some(At::new(entries?, value.place.clone()))
}

pub(super) fn signals(value: &Value<'_>, errors: &mut Diagnostics) -> Option<At<Vec<At<Signal>>>> {
    list(value, errors, "a list of names such as [\"h1 [cm]\", \"h2 [cm]\"]", signal)
}

/// A list of finite numbers, written out or in a file.
pub(super) fn row(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Row> {
    match is_reference(value) {
        true => imported::row(value, false, errors),
        false => list(value, errors, "a list of numbers", finite),
    }
}

/// Likewise of numbers that a bound may hold.
fn ends(value: &Value<'_>, expected: &str, errors: &mut Diagnostics) -> Option<Row> {
    match is_reference(value) {
        true => imported::row(value, true, errors),
        false => list(value, errors, expected, extended),
    }
}

/// A matrix of finite numbers, written out or in a file.
pub(super) fn matrix(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Matrix> {
    if is_reference(value) {
        return imported::matrix(value, errors);
    }
    const EXPECTED: &str = "a matrix, written as a list of rows";
    let Some(elements) = value.toml.as_array() else {
        let error = value.wrong_type(EXPECTED).help("a 1 x 1 matrix is written [[0.5]]");
        errors.push(error.help(format!("one in a file is {{ file = \"plant.npz\", name = \"{}\" }}", value.key)));
        return None;
    };
    if elements.iter().any(|element| is_number(element.get_ref())) {
        let flat = value.wrong_type(EXPECTED).help("a single row is written [[1.0, 0.0]], a column [[1.0], [0.0]]");
        errors.push(flat);
        return None;
    }
    let rows = all(elements.iter().enumerate().map(|(k, element)| {
        let what = format!("row {} of {}", k + 1, value.what);
        row(&Value { what, ..value.element(k, element) }, errors)
    }));
    Some(At::new(rows?, value.place.clone()))
}

/// Scalar, diagonal or full.
pub(super) fn weight(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Weight> {
    match value.toml {
        DeValue::Array(elements) if elements.iter().any(|element| element.get_ref().is_array()) => {
            matrix(value, errors).map(Weight::Full)
        }
        DeValue::Array(_) => row(value, errors).map(Weight::Diagonal),
        DeValue::Float(_) | DeValue::Integer(_) => finite(value, errors).map(Weight::Scalar),
        _ if is_reference(value) => imported::weight(value, errors),
        _ => value.refuse("a number, a list with the diagonal, or a matrix", errors),
    }
}

/// One number for all, or a list with one number each.
pub(super) fn per_signal(value: &Value<'_>, errors: &mut Diagnostics) -> Option<PerSignal> {
    const EXPECTED: &str = "a number for all, or a list with one number each";
    match value.toml {
        DeValue::Float(_) | DeValue::Integer(_) => extended(value, errors).map(PerSignal::Every),
        DeValue::Array(_) => ends(value, EXPECTED, errors).map(PerSignal::Each),
        _ if is_reference(value) => ends(value, EXPECTED, errors).map(PerSignal::Each),
        _ => value.refuse(EXPECTED, errors),
    }
}

/// `{ min = .., max = .. }`, `{ H = .., h = .. }`, or both together.
pub(super) fn bounds(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Bounds> {
    let Some(table) = value.toml.as_table() else {
        let error = value.wrong_type("a table of bounds");
        errors.push(error.help("write { min = [-1.0], max = [2.0] }, or { H = [[1.0]], h = [2.0] }"));
        return None;
    };
    let mut table = Table::new(value.what.clone(), value.place.clone(), table, value.files);
    let [min, max] = ["min", "max"].map(|key| table.optional(key, errors, per_signal));
    let halves = table.key_place("H").is_some() || table.key_place("h").is_some();
    let H = halves.then(|| table.required("H", errors, matrix)).flatten();
    let h = halves.then(|| table.required("h", errors, |v, e| ends(v, "a list of numbers", e))).flatten();
    if !halves {
        table.also(&["H", "h"]);
    }
    table.refuse_unknown(errors);
    Some(Bounds { place: value.place.clone(), min, max, rows: H.zip(h) })
}

/// `{ max = .. }`; nothing where `max` is missing, which `errors` says.
pub(super) fn magnitudes(value: &Value<'_>, errors: &mut Diagnostics) -> Option<Option<PerSignal>> {
    let Some(table) = value.toml.as_table() else {
        let error = value.wrong_type("a table with the largest error of each state");
        errors.push(error.help("write { max = [0.1, 0.0] }, one number per state"));
        return None;
    };
    let mut table = Table::new(value.what.clone(), value.place.clone(), table, value.files);
    let max = table.required("max", errors, per_signal);
    table.refuse_unknown(errors);
    Some(max)
}

/// `[low, high]`.
pub(super) fn interval(value: &Value<'_>, errors: &mut Diagnostics) -> Option<At<(f64, f64)>> {
    let ends = list(value, errors, "an interval [low, high]", finite)?;
    match &ends.value[..] {
        [low, high] => Some(At::new((low.value, high.value), ends.place)),
        _ => value.refuse("an interval [low, high]", errors),
    }
}

/// Every item, where none is absent; all are read, so that every mistake is reported.
pub(super) fn all<T>(items: impl Iterator<Item = Option<T>>) -> Option<Vec<T>> {
    items.collect::<Vec<_>>().into_iter().collect()
}

fn complaint(number: f64, toml: &DeValue<'_>) -> Option<&'static str> {
    let says_inf = toml.as_float().is_some_and(|float| float.as_str().contains("inf"));
    match () {
        () if number.is_nan() => Some("NaN means nothing to a design"),
        () if number.abs() > LARGEST && !says_inf => Some("beyond 1e30 no design can be computed"),
        () => None,
    }
}

/// NaN for what is no number, which the TOML reader already refused.
fn float_value(float: &DeFloat<'_>) -> f64 {
    float.as_str().parse().unwrap_or(f64::NAN)
}

/// Infinite where it does not fit.
fn integer_value(integer: &DeInteger<'_>) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "an integer beyond 2^53 means the nearest number")]
    let exact = |n: i64| n as f64;
    i64::from_str_radix(integer.as_str(), integer.radix()).map_or(f64::INFINITY, exact)
}

fn is_number(value: &DeValue<'_>) -> bool {
    value.is_float() || value.is_integer()
}

fn is_printable(name: &str) -> bool {
    !name.is_empty() && name.trim() == name && !name.chars().any(char::is_control)
}

fn parse_signal(written: &str) -> Option<Signal> {
    let (name, unit) = match written.split_once('[') {
        Some((name, rest)) => (name.trim_end(), Some(rest.strip_suffix(']')?.trim())),
        None => (written, None),
    };
    let fits = |part: &str| is_printable(part) && !part.contains(['[', ']']);
    let all_fit = fits(name) && !name.contains(char::is_whitespace) && unit.is_none_or(fits);
    all_fit.then(|| Signal { name: name.to_string(), unit: unit.map(str::to_string) })
}
