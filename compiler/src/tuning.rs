//! Search for gains that make the whole design better, before the design itself.
//!
//! What is better is decided in this order: stable loops; a small-gain radius with a margin; sets; the wishes of the file,
//! one after the other; and then what the user asked for: where epsilon is free and set-points are to be covered, the
//! largest epsilon with that cover at the reserve of the plain design; else the objective of [`crate::sizing`]. Where outputs are
//! in changing constraints without a margin, what is charged for them counts against either.
//!
//! Three moves: the K_i by themselves for the small gain, whose rows are local functions of them; the Riccati weights
//! of all subsystems, three common factors; the entries of K_i and calK_i, block after block. Everything is a simplex
//! search in a fixed order, so that the same input gives the same gains. Gains that the file states are left alone.
#![expect(non_snake_case, reason = "the paper's symbols")]

mod blocks;
mod candidate;
mod coupling;
mod figures;
mod frozen;
mod judge;
mod search;

use crate::diagnostic::{Diagnostic, Diagnostics, code};
use crate::gains::{Layer, MOST_DENSE, Settled, is_too_large_for_dense, is_wrongly_paired, reference_states};
use crate::network::Network;
use candidate::Candidate;
pub use figures::{DesignFigures, Figures};
pub use frozen::frozen;
use judge::{Budget, Judge};
use search::{Found, Search};

/// How long to search: 0 not at all, 1 tens of comparisons, 2 hundreds, 3 thousands.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Effort(u8);

impl Effort {
    /// The largest level.
    pub const MOST: u8 = 3;

    /// `None` above [`Effort::MOST`].
    pub fn new(level: u8) -> Option<Self> {
        (level <= Self::MOST).then_some(Self(level))
    }

    pub fn level(self) -> u8 {
        self.0
    }

    /// A search compares dense designs: a network that is too large for these has the plain gains only.
    ///
    /// # Errors
    /// E0109 where a search is asked for all the same.
    pub fn fits(self, network: &Network) -> Result<(), Diagnostic> {
        if self.budget() == 0 || !is_too_large_for_dense(network) {
            return Ok(());
        }
        let place = network.places.sizing.clone().unwrap_or_default();
        let error = Diagnostic::error(code::OUT_OF_RANGE, "this network is too large for a search for gains");
        Err(error
            .at(place, format!("effort {}", self.level()))
            .note(format!("it has {} reference states, the sum of states and outputs; designs are compared up to {MOST_DENSE}", reference_states(network)))
            .help("leave `effort` out; search in a smaller network of the same subsystems, and state the gains that `--gains-out` writes"))
    }

    /// Designs that are compared at most.
    pub fn budget(self) -> usize {
        [0, 60, 600, 6000][usize::from(self.0)]
    }
}

/// What a search found. The network it comes with has the gains as given ones.
#[derive(Debug, Clone)]
pub struct Tuning {
    pub effort: Effort,
    /// Gains that were compared.
    pub compared: usize,
    /// The plain design, effort 0.
    pub plain: Figures,
    /// The design with the gains found.
    pub tuned: Figures,
}

/// Where a search stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    pub compared: usize,
    /// The most that will be compared.
    pub budget: usize,
}

/// Who wants to know how a design proceeds: clocks and progress bars.
pub trait Watch {
    /// A stage of the pipeline has ended.
    fn stage(&mut self, _name: &'static str) {}
    /// One more design was compared.
    fn searched(&mut self, _progress: Progress) {}
}

impl Watch for () {}

impl Tuning {
    /// Searches as long as `effort` says; returns the network with the gains found. `None` where effort is
    /// 0, the file leaves no gain open, or there are no gains to start from: then the plain design says why.
    ///
    /// `settled` is the plain design's choice of gains, where it has one: the search starts there, from the Riccati gains, and from
    /// those of the matrix inequality.
    pub fn new(
        network: &Network,
        settled: Option<&Settled>,
        effort: Effort,
        watch: &mut dyn Watch,
    ) -> Option<(Network, Self)> {
        if effort.budget() == 0 {
            return None;
        }
        let starts = starts(network, settled)?;
        let finds = searched(network, starts, effort.budget(), watch);
        let (plain, compared) = (finds.first()?.start.clone(), finds.last()?.compared);
        let best = finds.into_iter().reduce(|best, next| if next.merit > best.merit { next } else { best })?;
        let tuning = Self { effort, compared, plain, tuned: best.figures };
        Some((best.gains.network(network), tuning))
    }

    /// Mistakes of a design whose gains were searched for say so.
    pub fn explain(self, mut mistakes: Diagnostics) -> Diagnostics {
        let level = self.effort.level();
        let note =
            format!("gains were searched for with effort {level}: of {} compared, these came closest", self.compared);
        if let Some(first) = mistakes.0.first_mut() {
            first.notes.push(note);
        }
        mistakes
    }
}

/// One search from each start, with equal shares of the budget and the aim of the first that has one.
fn searched(network: &Network, starts: Vec<Candidate>, budget: usize, watch: &mut dyn Watch) -> Vec<Found> {
    let share = budget / starts.len();
    // Where there are two starts, one of them is that of the inequality.
    let shortcut = if starts.len() == 1 { by_inequality(network) } else { None };
    let mut finds: Vec<Found> = Vec::new();
    for start in starts {
        let before = finds.last().map_or(0, |find| find.compared);
        let aim = finds.iter().find_map(|find| find.aim.clone());
        let judge = Judge::new(network, Budget { before, share, whole: budget }, &mut *watch);
        finds.push(Search::new(judge, start, shortcut.as_ref(), aim).run());
    }
    finds
}

/// The plain gains first, and those of the Riccati equations where they are others.
fn starts(network: &Network, settled: Option<&Settled>) -> Option<Vec<Candidate>> {
    if !Layer::Local.is_open(network) && !Layer::Reference.is_open(network) {
        return None;
    }
    let plain = settled.map(|settled| Candidate::of(&settled.gains));
    let local = Candidate::local(&network.subsystems).filter(|local| plain.as_ref() != Some(local));
    let starts: Vec<_> = plain.into_iter().chain(local).collect();
    (!starts.is_empty()).then_some(starts)
}

/// Gains of the matrix inequality: a better start where they are better.
fn by_inequality(network: &Network) -> Option<Candidate> {
    Settled::by_inequality(network.clone(), &mut ()).ok().map(|settled| Candidate::of(&settled.gains))
}

/// Mistakes that a search may repair say so.
pub fn offered(network: &Network, mut mistakes: Diagnostics) -> Diagnostics {
    if let Some(first) = mistakes.0.first_mut().filter(|first| is_repairable(network, first.code)) {
        first.helps.push("--effort 2 (or `effort` in [sizing]) searches for gains that may do".to_owned());
    }
    mistakes
}

/// Whether the mistake depends on gains that the file leaves open, in a network that can be searched.
fn is_repairable(network: &Network, code: &str) -> bool {
    let open = |layer: Layer| layer.is_open(network) && !is_too_large_for_dense(network);
    match code {
        code::COLLECTIVE_LOOP => open(Layer::Local) && !is_wrongly_paired(network),
        code::ASSUMPTION_3 => open(Layer::Reference) && !is_wrongly_paired(network),
        code::SMALL_GAIN => open(Layer::Local),
        code::EPSILON
        | code::RESERVE_TOO_LARGE
        | code::COVER_TOO_LARGE
        | code::DISTURBANCE_TOO_LARGE
        | code::MARGIN_TOO_SMALL => open(Layer::Local) || open(Layer::Reference),
        _ => false,
    }
}
