//! What a terminal shows while a design is under way.

use std::time::Duration;

use dpc_codegen::clock::Clock;
use dpc_codegen::tuning::{Progress, Watch};
use indicatif::{ProgressBar, ProgressStyle};

/// The clock, with a line on the terminal: the stage under way, or how far a search for gains has come. Nothing is drawn
/// where the standard error stream is no terminal.
pub struct Progressing {
    pub clock: Clock,
    quiet: bool,
    line: Option<(Line, ProgressBar)>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Line {
    Stage,
    Search,
}

/// The stages that follow one that has ended, in words.
const NEXT: [(&str, &str); 8] = [
    ("Spec", "checking the network"),
    ("Network", "gains"),
    ("Gains", "invariant sets"),
    ("Sets", "sizes of the sets"),
    ("Tuning", "gains"),
    ("Sizing", "on-line problems"),
    ("Problems", "iterations and controllers"),
    ("Emitted", "measuring and writing"),
];

/// How often the line moves: often enough to show that something is under way.
const TICK: Duration = Duration::from_millis(200);

impl Progressing {
    pub fn new(quiet: bool) -> Self {
        let mut progressing = Self { clock: Clock::new(), quiet, line: None };
        progressing.show("reading");
        progressing
    }

    /// Leaves the terminal as it was.
    pub fn end(&mut self) {
        if let Some((_, bar)) = self.line.take() {
            bar.finish_and_clear();
        }
    }

    fn show(&mut self, words: &'static str) {
        let line = self.line(Line::Stage, || spinner(TICK));
        line.set_message(words);
    }

    /// The bar of this kind, in place of one of the other kind.
    fn line(&mut self, kind: Line, make: impl FnOnce() -> ProgressBar) -> &ProgressBar {
        if self.line.as_ref().is_some_and(|(known, _)| *known != kind) {
            self.end();
        }
        let quiet = self.quiet;
        &self.line.get_or_insert_with(|| (kind, if quiet { ProgressBar::hidden() } else { make() })).1
    }
}

impl Watch for Progressing {
    fn stage(&mut self, name: &'static str) {
        self.clock.ended(name);
        if let Some((_, words)) = NEXT.iter().find(|(ended, _)| *ended == name) {
            self.show(words);
        }
    }

    fn searched(&mut self, progress: Progress) {
        self.line(Line::Search, || bar(progress.budget)).set_position(progress.compared as u64);
    }
}

impl Drop for Progressing {
    fn drop(&mut self) {
        self.end();
    }
}

fn spinner(tick: Duration) -> ProgressBar {
    let style = ProgressStyle::with_template("  {spinner} {msg} ({elapsed})");
    let spinner = ProgressBar::new_spinner().with_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
    spinner.enable_steady_tick(tick);
    spinner
}

fn bar(budget: usize) -> ProgressBar {
    let style = ProgressStyle::with_template("  comparing gains {bar:40} {pos} of {len}, {eta} left");
    ProgressBar::new(budget as u64).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}
