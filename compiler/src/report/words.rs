//! Numbers and names in sentences.

use crate::network::Signal;
use crate::summary::short;

/// `1 step`, `2 steps`.
pub fn counted(number: usize, noun: &str) -> String {
    format!("{number} {noun}{}", if number == 1 { "" } else { "s" })
}

/// At most so many letters.
pub fn clipped(text: &str, letters: usize) -> String {
    if text.chars().count() <= letters {
        return text.to_owned();
    }
    text.chars().take(letters - 1).chain(['…']).collect()
}

/// `2.5 cm`.
pub fn measured(value: f64, unit: Option<&str>) -> String {
    match unit {
        Some(unit) => format!("{} {unit}", short(value)),
        None => short(value),
    }
}

/// `h1 [cm]`.
pub fn label(signal: &Signal) -> String {
    labelled(&signal.name, signal.unit.as_deref())
}

pub fn labelled(name: &str, unit: Option<&str>) -> String {
    match unit {
        Some(unit) => format!("{name} [{unit}]"),
        None => name.to_owned(),
    }
}
