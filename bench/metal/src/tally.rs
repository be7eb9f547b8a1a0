//! What came of a run.

use dpc_runtime::{Control, Status};

use crate::Board;
use crate::fingerprint::Fingerprint;
use crate::text::Line;

/// Time in units of a board.
pub type Ticks = u32;

/// Steps by how their input came about, how long they took, and a hash of everything that went into controllers and came out.
#[derive(Debug, Clone, Copy)]
pub struct Tally {
    pub fingerprint: Fingerprint,
    /// Steps at which nothing was solved, and those at which a problem was.
    pub at_rest: u64,
    pub solved: u64,
    /// Steps that solved with a row that holds with equality, and the most changes of the working set.
    pub constrained: u64,
    pub iterations: u64,
    /// Shifted candidates, and steps without the guarantee.
    pub candidates: u64,
    pub unguaranteed: u64,
    /// Messages that were not accepted, and controllers that did not start.
    pub refused: u64,
    /// Of all steps at rest.
    pub rest_ticks: u64,
    /// The longest step at rest, and of all.
    pub longest_rest: Ticks,
    pub longest: Ticks,
}

impl Tally {
    pub const EMPTY: Self = Self {
        fingerprint: Fingerprint::EMPTY,
        at_rest: 0,
        solved: 0,
        constrained: 0,
        iterations: 0,
        candidates: 0,
        unguaranteed: 0,
        refused: 0,
        rest_ticks: 0,
        longest_rest: 0,
        longest: 0,
    };

    pub fn count<const NB: usize>(&mut self, status: &Status<NB>, ticks: Ticks) {
        self.longest = self.longest.max(ticks);
        self.unguaranteed += u64::from(!status.is_guaranteed());
        match status.control {
            Control::AtReference => {
                self.at_rest += 1;
                self.rest_ticks += u64::from(ticks);
                self.longest_rest = self.longest_rest.max(ticks);
            }
            Control::Optimal { iterations, active } => {
                self.solved += 1;
                self.constrained += u64::from(active > 0);
                self.iterations = self.iterations.max(iterations as u64);
            }
            Control::Candidate => self.candidates += 1,
            // Neither is guaranteed.
            _ => {}
        }
    }

    pub fn accepted<T, E>(&mut self, answer: Result<T, E>) {
        self.refused += u64::from(answer.is_err());
    }

    /// What is the same on every board, then, where there is a clock, how long steps took: a line that begins with `#`.
    pub fn report(&self, name: &str, board: &mut impl Board) {
        let count = |line: Line, what: &str, number: u64| line.text(", ").text(what).text(" ").decimal(number);
        let mut line = Line::new().text(name).text(": ").hexadecimal(self.fingerprint.0);
        line = count(line, "at rest", self.at_rest);
        line = count(line, "solved", self.solved);
        line = count(line, "constrained", self.constrained);
        line = count(line, "iterations", self.iterations);
        line = count(line, "candidates", self.candidates);
        line = count(line, "unguaranteed", self.unguaranteed);
        board.print(&count(line, "refused", self.refused));
        if self.longest > 0 {
            let factor = board.instructions_per_tick();
            let at_rest = (self.rest_ticks * factor).checked_div(self.at_rest).unwrap_or(0);
            let line = Line::new().text("# ").text(name).text(", instructions of a step: at rest ").decimal(at_rest);
            let line = line.text(" on average, ").decimal(u64::from(self.longest_rest) * factor).text(" at most; ");
            board.print(&line.decimal(u64::from(self.longest) * factor).text(" at most in the run"));
        }
    }
}
