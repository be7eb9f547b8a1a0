//! Mistakes of several phases in one run, without those that only follow from others.

use crate::diagnostic::{Diagnostic, Diagnostics, Place};
use crate::spec::Spec;

/// Collects. A subsystem with mistakes from one phase is not looked at in later ones: what they would find may be nothing but
/// their echo. What concerns no subsystem has no echo.
pub(super) struct Mistakes {
    /// Where the subsystems' tables start, ascending.
    headers: Vec<usize>,
    found: Diagnostics,
}

impl Mistakes {
    /// `found`: those of the reader.
    pub fn new(spec: &Spec, found: Diagnostics) -> Self {
        let mut headers: Vec<usize> = spec.subsystems.iter().map(|subsystem| subsystem.name.place.start).collect();
        headers.sort_unstable();
        Self { headers, found }
    }

    /// Runs a phase; `None` where it has nothing to go on with.
    pub fn of<T>(&mut self, phase: impl FnOnce(&mut Diagnostics) -> Option<T>) -> Option<T> {
        let mut found = Diagnostics::default();
        let value = phase(&mut found);
        self.add(found);
        value
    }

    /// The same of a phase that ends by itself.
    pub fn of_result<T, E: Into<Diagnostics>>(&mut self, ended: Result<T, E>) -> Option<T> {
        self.of(|found| ended.map_err(|mistakes| *found = mistakes.into()).ok())
    }

    pub fn is_empty(&self) -> bool {
        self.found.is_empty()
    }

    /// Whether a mistake of this code was found.
    pub fn include(&self, code: &str) -> bool {
        self.found.0.iter().any(|mistake| mistake.code == code)
    }

    /// `value` where nothing was wrong, else all mistakes in the order of the file.
    pub fn finish<T>(self, value: Option<T>) -> Result<T, Diagnostics> {
        self.found.finish(value)
    }

    fn add(&mut self, later: Diagnostics) {
        let known: Vec<usize> = self.found.0.iter().filter_map(|mistake| self.owner(mistake)).collect();
        let is_new = |mistake: &Diagnostic| self.owner(mistake).is_none_or(|owner| !known.contains(&owner));
        let new: Vec<_> = later.0.into_iter().filter(is_new).collect();
        self.found.0.extend(new);
    }

    /// The subsystem whose tables hold the mistake.
    fn owner(&self, mistake: &Diagnostic) -> Option<usize> {
        let (Place { start, .. }, _) = mistake.labels.first()?;
        self.headers.partition_point(|header| header <= start).checked_sub(1)
    }
}
