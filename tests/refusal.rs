//! What the compiler makes of a file that may be anything: a design, or mistakes that point into it.

use std::any::Any;
use std::collections::BTreeMap;
use std::fmt;
use std::panic::catch_unwind;
use std::time::Duration;

use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::json::MOST_TOLD;
use dpc_codegen::diagnostic::{Diagnostics, Source, Unreadable};
use dpc_codegen::emit::Emitted;
use dpc_codegen::export::design_json;
use dpc_codegen::summary::Summary;

use crate::mutations::Mutant;

/// How a file fared.
#[derive(Debug)]
pub enum Outcome {
    Designed,
    /// The codes of its mistakes.
    Refused(Vec<&'static str>),
    /// What must not be.
    Failed(String),
}

/// The whole way of the command, but for the disk: text, design, everything that is written and printed.
pub fn outcome(mutant: &Mutant) -> Outcome {
    let bytes = mutant.bytes.clone();
    catch_unwind(move || compiled(bytes)).unwrap_or_else(|panic| Outcome::Failed(format!("panics: {}", words(&*panic))))
}

fn compiled(bytes: Vec<u8>) -> Outcome {
    let source = match Source::of_bytes("system.toml".to_owned(), bytes) {
        Ok(source) => source,
        Err(Unreadable::NotText(source, mistakes)) => return told(&mistakes, &source),
        Err(Unreadable::System(why)) => return Outcome::Failed(why),
    };
    match Design::new(source.clone()) {
        Err(mistakes) => told(&mistakes, &source),
        Ok(design) => {
            let emitted = Emitted::new(&design);
            let summary = Summary::new(&design, &emitted);
            drop((summary.to_string(), summary.to_json(), design_json(&design)));
            Outcome::Designed
        }
    }
}

/// Every mistake has a place, which lies in the text and on borders of characters, and can be drawn and told to machines.
fn told(mistakes: &Diagnostics, source: &Source) -> Outcome {
    if mistakes.is_empty() {
        return Outcome::Failed("is refused without a word".to_owned());
    }
    for mistake in &mistakes.0 {
        if mistake.labels.is_empty() {
            return Outcome::Failed(format!("has {} without a place: {}", mistake.code, mistake.title));
        }
        if let Some((place, _)) = mistake.labels.iter().find(|(place, _)| source.text.get(place.clone()).is_none()) {
            return Outcome::Failed(format!("has {} at {place:?}, which is not in the text", mistake.code));
        }
    }
    let (drawn, objects) = (mistakes.render(source, true), mistakes.to_json(source));
    if drawn.is_empty() || objects.as_array().is_none_or(|objects| objects.len() != mistakes.0.len().min(MOST_TOLD)) {
        return Outcome::Failed("has mistakes that are not drawn".to_owned());
    }
    Outcome::Refused(mistakes.0.iter().map(|mistake| mistake.code).collect())
}

fn words(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("without words")
}

/// Outcomes counted.
#[derive(Debug, Default)]
pub struct Tally {
    pub files: usize,
    pub designed: usize,
    /// Files by code; a file with several mistakes counts for each code once.
    pub codes: BTreeMap<&'static str, usize>,
    pub refused: usize,
    /// Which file, and what must not be.
    pub failed: Vec<String>,
    /// The slowest, where time is measured.
    pub slowest: Option<(Duration, String)>,
}

impl Tally {
    pub fn add(&mut self, what: String, outcome: Outcome) {
        self.files += 1;
        match outcome {
            Outcome::Designed => self.designed += 1,
            Outcome::Refused(mut codes) => {
                self.refused += 1;
                codes.sort_unstable();
                codes.dedup();
                codes.into_iter().for_each(|code| *self.codes.entry(code).or_default() += 1);
            }
            Outcome::Failed(why) => self.failed.push(format!("{what} {why}")),
        }
    }

    pub fn took(&mut self, what: &str, time: Duration) {
        if self.slowest.as_ref().is_none_or(|(slowest, _)| time > *slowest) {
            self.slowest = Some((time, what.to_owned()));
        }
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (files, designed, refused, failed) = (self.files, self.designed, self.refused, self.failed.len());
        write!(f, "{files} files: {designed} designed, {refused} refused with {} codes (", self.codes.len())?;
        let codes: Vec<String> = self.codes.iter().map(|(code, count)| format!("{code} {count}")).collect();
        write!(f, "{}), {failed} failed", codes.join(", "))?;
        let slowest = self.slowest.as_ref();
        slowest.map_or(Ok(()), |(time, what)| write!(f, "; slowest {:.2} s ({what})", time.as_secs_f64()))
    }
}
