//! Errors that point into `system.toml`: for people by [`Diagnostics::render`], for machines by [`Diagnostics::to_json`]; every code has
//! a page in [`crate::explain`].

pub mod json;
mod source;

use std::fmt;
use std::ops::Range;

use annotate_snippets::{Annotation, AnnotationKind, Group, Level, Renderer, Snippet, normalize_untrusted_str};

pub use source::{Source, Unreadable};

/// A byte range of the source text.
pub type Place = Range<usize>;

/// One mistake: what is wrong, where, with which numbers, and what to try.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// `E0104`; stable, see [`code`].
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

/// Every code: E01xx input, E02xx gains, E03xx sets, E04xx sizes, E05xx on-line problems, E06xx scenarios. A code keeps its meaning for ever; a retired one is not used again.
pub mod code {
    /// The text is not TOML.
    pub const SYNTAX: &str = "E0101";
    /// A key nobody asks for, mostly a misspelling.
    pub const UNKNOWN_KEY: &str = "E0102";
    /// A key or table that has no default is absent.
    pub const MISSING_KEY: &str = "E0103";
    /// A value of the wrong kind: a string where a number belongs, a list where a matrix belongs.
    pub const WRONG_TYPE: &str = "E0104";
    /// NaN, an infinity outside of bounds, or a magnitude beyond 1e30.
    pub const NOT_FINITE: &str = "E0105";
    /// A name that is empty or has characters a name cannot have.
    pub const BAD_NAME: &str = "E0106";
    /// The same name twice where names must differ.
    pub const DUPLICATE_NAME: &str = "E0107";
    /// A choice that is not on offer: `layer`, `norm`.
    pub const UNKNOWN_CHOICE: &str = "E0108";
    /// Horizon, sample time, epsilon, gamma or a sizing weight outside of its range.
    pub const OUT_OF_RANGE: &str = "E0109";
    /// A matrix or list whose size does not fit the names.
    pub const SHAPE: &str = "E0110";
    /// Keys of two of the three ways to state a network in one file.
    pub const MIXED_FORMS: &str = "E0111";
    /// A subsystem that is named but not there.
    pub const UNKNOWN_SUBSYSTEM: &str = "E0112";
    /// A subsystem that is its own neighbour.
    pub const SELF_COUPLING: &str = "E0113";
    /// A partition of the collective model that leaves out or repeats a signal.
    pub const PARTITION: &str = "E0114";
    /// An output of one subsystem that reads a state of another.
    pub const COUPLED_OUTPUT: &str = "E0115";
    /// More outputs than inputs: p_i > m_i.
    pub const MORE_OUTPUTS_THAN_INPUTS: &str = "E0116";
    /// A weight that is not symmetric.
    pub const ASYMMETRIC: &str = "E0117";
    /// A weight that is not positive definite.
    pub const INDEFINITE: &str = "E0118";
    /// T_i > gamma I (32) does not hold.
    pub const GAMMA: &str = "E0119";
    /// A lower bound that is not below its upper bound.
    pub const EMPTY_BOUNDS: &str = "E0120";
    /// 0, the operating point, is not in the interior of a constraint set.
    pub const ZERO_OUTSIDE: &str = "E0121";
    /// A row of zeros in a constraint.
    pub const EMPTY_ROW: &str = "E0122";
    /// A state, input or output that is named but not there.
    pub const UNKNOWN_SIGNAL: &str = "E0123";
    /// Set-points to cover that no design can reach.
    pub const COVER: &str = "E0124";
    /// A negative reserve.
    pub const RESERVE: &str = "E0125";
    /// One of `Kx`, `Ke` without the other.
    pub const HALF_A_GAIN: &str = "E0126";
    /// A disturbance set that is unbounded or does not hold 0, or a measurement error that is no bound.
    pub const DISTURBANCE: &str = "E0127";
    /// Loads whose matrix or bounds are missing, unbounded or leave out 0, or these without loads.
    pub const LOAD: &str = "E0128";
    /// A start outside of X, or with loads outside their bounds.
    pub const START_OUTSIDE: &str = "E0129";
    /// A changing constraint between nobody, or that names a subsystem twice.
    pub const MEMBERS: &str = "E0130";
    /// A start-up plan beside changing constraints.
    pub const PLANNED_START: &str = "E0131";
    /// Single precision with something that its proof does not cover: unbounded signals, measurement errors, loads, start-up plans,
    /// changing constraints.
    pub const SINGLE_PRECISION: &str = "E0132";

    /// A file that the text names and that cannot be used: not there, not of a known format, malformed.
    pub const FILE: &str = "E0140";
    /// A variable, row or column that a file does not have.
    pub const NOT_IN_FILE: &str = "E0141";
    /// A continuous-time model that cannot be sampled with this sample time.
    pub const SAMPLING: &str = "E0142";
    /// A disturbance that is to cover what holding the coupling leaves out, which nothing bounds.
    pub const HOLD_ERROR: &str = "E0143";

    /// A_ii has an unstable mode that B_ii does not reach (Assumption 1).
    pub const UNSTABILISABLE: &str = "E0201";
    /// A_ii + B_ii K_i is not stable (Assumption 1, part 2).
    pub const LOCAL_LOOP: &str = "E0202";
    /// A + BK is not stable (Assumption 1, part 1).
    pub const COLLECTIVE_LOOP: &str = "E0203";
    /// The outputs cannot be held at arbitrary set-points (Assumption 2).
    pub const ASSUMPTION_2: &str = "E0204";
    /// calF is not stable (Assumption 3).
    pub const ASSUMPTION_3: &str = "E0205";
    /// A subsystem cannot integrate the error of its own outputs, so it has no calK_i.
    pub const NO_INTEGRATION: &str = "E0206";
    /// The references of a network that is too large for dense matrices act on each other too strongly for the sparse proof of
    /// Assumption 3.
    pub const LARGE_REFERENCES: &str = "E0207";
    /// The small-gain radius is not below 1 (Assumption 4).
    pub const SMALL_GAIN: &str = "E0301";
    /// No invariant set was found on any normals tried.
    pub const NO_INVARIANT_SET: &str = "E0302";
    /// The sets on the normals tried lose too much for Assumption 4.
    pub const FEW_NORMALS: &str = "E0303";
    /// The steady states (9) cannot be computed to working accuracy.
    pub const STEADY_STATE: &str = "E0304";
    /// Epsilon leaves no set-point: a tightened set is empty.
    pub const EPSILON: &str = "E0401";
    /// The wanted reserve is out of reach.
    pub const RESERVE_TOO_LARGE: &str = "E0402";
    /// The set-points to cover are out of reach.
    pub const COVER_TOO_LARGE: &str = "E0403";
    /// The sizing program has no point, or none that could be computed.
    pub const NOT_SIZED: &str = "E0404";
    /// An inclusion does not survive rounding.
    pub const LOST_SLACK: &str = "E0405";
    /// A Hessian of (34) is not positive definite in double precision.
    pub const NOT_CONVEX: &str = "E0501";
    /// An entry of the condensed problem is not finite.
    pub const OVERFLOW: &str = "E0502";
    /// Disturbances, measurement errors and loads leave no set-point: a tightened set is empty.
    pub const DISTURBANCE_TOO_LARGE: &str = "E0406";
    /// The margin of a changing constraint is out of reach.
    pub const MARGIN_TOO_SMALL: &str = "E0407";
    /// The ball of (30) has too many facets.
    pub const TOO_MANY_OUTPUTS: &str = "E0503";
    /// No start-up plan from the stated start was found.
    pub const NO_START_PLAN: &str = "E0504";

    /// A time, length, share or number in a scenario outside of its range, or two keys that contradict each other.
    pub const SCENARIO_VALUE: &str = "E0601";
    /// Messages of a scenario between subsystems of which one does not hear the other.
    pub const NO_LINK: &str = "E0602";
    /// A changing constraint without a rule, or with one that does not fit it.
    pub const RULE: &str = "E0603";
    /// A file of a scenario that cannot be read as a course.
    pub const PROFILE: &str = "E0604";
    /// The file of the true plant cannot be read, or is of another network.
    pub const TRUE_PLANT: &str = "E0605";
    /// Something random in a scenario, and no set to draw it from.
    pub const NO_SET: &str = "E0606";
    /// A signal in a scenario with another unit than in the network.
    pub const UNIT: &str = "E0607";

    /// Codes that only large networks or numerical trouble can bring up: no small file is known to do so.
    pub const NUMERICAL: [&str; 7] =
        [LARGE_REFERENCES, FEW_NORMALS, STEADY_STATE, NOT_SIZED, LOST_SLACK, NOT_CONVEX, OVERFLOW];

    /// Mistakes in scenarios: no file of a network has them.
    pub const SCENARIO: [&str; 7] = [SCENARIO_VALUE, NO_LINK, RULE, PROFILE, TRUE_PLANT, NO_SET, UNIT];

    /// All others.
    pub const ALL: [&str; 51] = [
        SYNTAX,
        UNKNOWN_KEY,
        MISSING_KEY,
        WRONG_TYPE,
        NOT_FINITE,
        BAD_NAME,
        DUPLICATE_NAME,
        UNKNOWN_CHOICE,
        OUT_OF_RANGE,
        SHAPE,
        MIXED_FORMS,
        UNKNOWN_SUBSYSTEM,
        SELF_COUPLING,
        PARTITION,
        COUPLED_OUTPUT,
        MORE_OUTPUTS_THAN_INPUTS,
        ASYMMETRIC,
        INDEFINITE,
        GAMMA,
        EMPTY_BOUNDS,
        ZERO_OUTSIDE,
        EMPTY_ROW,
        UNKNOWN_SIGNAL,
        COVER,
        RESERVE,
        HALF_A_GAIN,
        DISTURBANCE,
        LOAD,
        START_OUTSIDE,
        MEMBERS,
        PLANNED_START,
        SINGLE_PRECISION,
        FILE,
        NOT_IN_FILE,
        SAMPLING,
        HOLD_ERROR,
        UNSTABILISABLE,
        LOCAL_LOOP,
        COLLECTIVE_LOOP,
        ASSUMPTION_2,
        ASSUMPTION_3,
        NO_INTEGRATION,
        SMALL_GAIN,
        NO_INVARIANT_SET,
        EPSILON,
        RESERVE_TOO_LARGE,
        COVER_TOO_LARGE,
        DISTURBANCE_TOO_LARGE,
        MARGIN_TOO_SMALL,
        TOO_MANY_OUTPUTS,
        NO_START_PLAN,
    ];
}

/// Places that one message shows.
const MOST_PLACES: usize = 16;
/// Mistakes that people are shown; machines get more, [`json::MOST_TOLD`].
const MOST_SHOWN: usize = 50;

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

    fn group<'a>(&'a self, source: &'a Source) -> Group<'a> {
        Level::ERROR
            .primary_title(&*self.title)
            .id(self.code)
            .elements(self.snippet(source))
            .elements(self.not_shown().map(|places| Level::NOTE.message(places)))
            .elements(self.notes.iter().map(|note| Level::NOTE.message(normalize_untrusted_str(note))))
            .elements(self.helps.iter().map(|help| Level::HELP.message(normalize_untrusted_str(help))))
    }

    /// Large networks can have a place per subsystem.
    fn not_shown(&self) -> Option<String> {
        let count = self.labels.len().checked_sub(MOST_PLACES).filter(|count| *count > 0)?;
        Some(format!("there are {count} more places like these"))
    }

    fn snippet<'a>(&'a self, source: &'a Source) -> Option<Snippet<'a, Annotation<'a>>> {
        let kinds = std::iter::once(AnnotationKind::Primary).chain(std::iter::repeat(AnnotationKind::Context));
        let annotations = self
            .labels
            .iter()
            .take(MOST_PLACES)
            .zip(kinds)
            .map(|((place, label), kind)| kind.span(source.within(place)).label(normalize_untrusted_str(label)));
        let snippet = Snippet::source(&*source.text).path(&*source.path);
        (!self.labels.is_empty()).then(|| snippet.annotations(annotations))
    }
}

impl Diagnostics {
    pub fn push(&mut self, diagnostic: Diagnostic) {
        self.0.push(diagnostic);
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Ends a phase: `value` where nothing was wrong, else the mistakes in the order of the file.
    ///
    /// Whoever leaves `value` out has said why by [`Diagnostics::push`].
    ///
    /// # Errors
    /// The mistakes collected so far.
    pub fn finish<T>(mut self, value: Option<T>) -> Result<T, Self> {
        match value {
            Some(value) if self.is_empty() => Ok(value),
            _ => {
                debug_assert!(!self.is_empty(), "a phase failed without saying why");
                self.0.sort_by_key(|diagnostic| diagnostic.labels.first().map(|(place, _)| place.start));
                Err(self)
            }
        }
    }

    /// What a person sees, in the manner of rustc: code, place, notes, helps. Ends without a newline.
    pub fn render(&self, source: &Source, styled: bool) -> String {
        let renderer = if styled { Renderer::styled() } else { Renderer::plain() };
        let shown = self.0.iter().take(MOST_SHOWN).map(|diagnostic| renderer.render(&[diagnostic.group(source)]));
        let more = self.0.len().checked_sub(MOST_SHOWN).filter(|more| *more > 0);
        let more = more.map(|more| format!("... and {more} more mistakes; the first ones may explain them"));
        shown.chain(more).collect::<Vec<_>>().join("\n\n")
    }

    /// Where to read more about these mistakes, once per run.
    pub fn hint(&self) -> Option<String> {
        let mut codes: Vec<&str> = Vec::new();
        for code in self.0.iter().map(|diagnostic| diagnostic.code) {
            if !codes.contains(&code) {
                codes.push(code);
            }
        }
        let (first, others) = codes.split_first()?;
        let others = if others.is_empty() { String::new() } else { format!(" (also {})", others.join(", ")) };
        Some(format!("For more about this: dpc-codegen explain {first}{others}"))
    }
}

impl From<Diagnostic> for Diagnostics {
    fn from(diagnostic: Diagnostic) -> Self {
        Self(vec![diagnostic])
    }
}

/// Without the source text: for logs and `?` in a build script. People see [`Diagnostics::render`].
impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "error[{}]: {}", self.code, self.title)?;
        self.notes.iter().try_for_each(|note| write!(f, "\n  note: {note}"))?;
        self.helps.iter().try_for_each(|help| write!(f, "\n  help: {help}"))
    }
}

impl fmt::Display for Diagnostics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let lines: Vec<_> = self.0.iter().map(Diagnostic::to_string).collect();
        f.write_str(&lines.join("\n"))
    }
}

impl std::error::Error for Diagnostic {}
impl std::error::Error for Diagnostics {}
