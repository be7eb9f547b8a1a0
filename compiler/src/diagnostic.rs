//! Errors that point into `system.toml`.

use std::ops::Range;

/// A byte range of the source text.
pub type Place = Range<usize>;

/// The file a network was read from.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Source {
    /// As the user wrote it; printed in messages, never emitted.
    pub path: String,
    pub text: String,
}

/// One mistake: what is wrong, where, with which numbers, and what to try.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// `E0104`; stable.
    pub code: &'static str,
    pub title: String,
    /// The first is the primary place. Byte ranges of the source text with what to say there.
    pub labels: Vec<(Place, String)>,
    /// Further lines of explanation with the numbers.
    pub notes: Vec<String>,
    /// What to try.
    pub helps: Vec<String>,
}

/// The mistakes of one phase, in the order of the file.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Diagnostics(pub Vec<Diagnostic>);

impl Diagnostic {
    pub fn error(code: &'static str, title: impl Into<String>) -> Self {
        Self { code, title: title.into(), labels: Vec::new(), notes: Vec::new(), helps: Vec::new() }
    }
    pub fn at(mut self, place: Place, label: impl Into<String>) -> Self {
        self.labels.push((place, label.into()));
        self
    }
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.notes.push(note.into());
        self
    }
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.helps.push(help.into());
        self
    }
}

impl From<Diagnostic> for Diagnostics {
    fn from(diagnostic: Diagnostic) -> Self {
        Self(vec![diagnostic])
    }
}
