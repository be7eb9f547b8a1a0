//! The least-distance solver: a dual active-set method.
//!
//! Minimise 1/2 |w|^2 subject to lower_r <= v_r . w <= upper_r, rows v_r of unit length, each side possibly infinite.
//! The method is that of Goldfarb and Idnani ("A numerically stable dual method for solving strictly convex quadratic
//! programs", Mathematical Programming 27, 1983) with the identity as Hessian: w is always the optimum over the rows in
//! the working set, so its length grows with every step, and no working set comes back.
//!
//! Of the working set it keeps the multipliers and the factor (its inverse) of the Gram matrix N'N; w = N multipliers is made anew at
//! every change, so that no error accumulates in it. The last w is refined until the rows of the working set hold to
//! rounding.

use super::factor::{Column, Factor};
use super::linear::{add_scaled, close_gap, dot_of, finite, larger, largest};
use super::{Real, precision};
pub use crate::working_set::{Glance, Side, WorkingSet, Worst};

/// A row counts as satisfied when it is violated by no more than this times (its scale + the largest |w_k|): the rounding
/// errors of the violation itself. Rows that contradict each other by no more than what rounding their limits explains
/// are all relaxed, by as little as makes them agree: all relaxations of a solve and the tolerance, where a long solve loosens it,
/// add up to at most `LOOSEST` + 1.5 `MOST_RELAXATIONS` `UNPROVED` of the same, 1.8e-10 in double precision.
pub const TOLERANCE: Real = precision::TOLERANCE;

/// Relative rounding error that each limit is granted before a contradiction counts as proved.
const ROUNDING: Real = precision::ROUNDING;

/// Where a contradiction is above that, but the normals in it cancel too badly for a proof, each limit is granted this.
const UNPROVED: Real = precision::UNPROVED;

/// Rounding error of a sum of unit vectors, relative to the sum of the magnitudes of their coefficients.
const SUMMED: Real = precision::SUMMED;

/// Multipliers below minus this times the largest are negative even before they are refined.
const NEGATIVE: Real = precision::NEGATIVE;

/// A row is taken to depend on the working set when the square of its distance from the span of that set's rows is
/// below this: within 1e-7 rad, its own direction is rounding noise.
const DEPENDENT: Real = precision::DEPENDENT;

/// Above this, the square of that distance loses no more than six digits to cancellation.
const SAFE: Real = precision::SAFE;

/// Coefficients of a row over the working set below this times the largest are rounding noise.
const NOISE: Real = precision::NOISE;

/// At most this many passes of iterative refinement.
const PASSES: usize = 6;

/// A row of the working set holds when it is off by no more than this times (its scale + the largest |w_k|).
const SETTLED: Real = precision::SETTLED;

/// Looks leave room for this much of |w|: a w that refinement has moved by no more need not be looked at again.
const STILL: Real = 0.25 * TOLERANCE;

/// A contradiction is proved when no w shorter than this times the largest limit in it, and times |w| as it is, resolves it.
const BEYOND: Real = 1e3;

/// Row lower <= normal . w <= upper of a least-distance problem.
#[derive(Debug, Clone, Copy)]
pub struct Row<'a> {
    /// Of unit length; entries beyond its end are zero.
    pub normal: &'a [Real],
    pub lower: Real,
    pub upper: Real,
    /// Magnitude of the limits. Tolerances and rounding errors are taken relative to it plus the largest |w_k|. In the
    /// i-DPC problem it is that of the constant limits alone, without the offsets: where an offset outgrows its limit, so
    /// do the |w_k| that satisfy the row, and the sum is of the right size.
    pub scale: Real,
}

/// The rows of a least-distance problem, in a fixed order.
pub trait Rows<const NV: usize> {
    fn iter(&self) -> impl Iterator<Item = Row<'_>>;

    /// Row `index`.
    fn get(&self, index: usize) -> Option<Row<'_>> {
        self.iter().nth(index)
    }

    /// The normal of row `index`, as [`Row::normal`]; zero where there is no such row.
    fn normal(&self, index: usize) -> &[Real] {
        self.get(index).map_or(&[0.0; NV], |row| row.normal)
    }

    /// Rows that `w` violates much, by a test that may err by more than [`TOLERANCE`]: what it returns is looked at again,
    /// and where it finds nothing, nothing is violated by more than 1e-12 of (the row's scale + the largest |w_k|). `None`
    /// where there is no such test.
    fn glance(&self, _w: &[Real; NV], _size: Real) -> Option<Glance> {
        None
    }

    /// The row that `w` violates by the largest distance, the first of several, by the same products as ever but in another
    /// order: what it returns is looked at again, and [`Worst::Kept`] leaves room for another 1e-14 of `size`, the largest
    /// |w_k|. `sum` are rows and their coefficients in w.
    fn worst(&self, _w: &[Real; NV], _size: Real, _sum: impl Iterator<Item = (usize, Real)>) -> Worst {
        Worst::Unknown
    }

    /// The inner products of the normal of row `index` with those of all rows, where they are at hand.
    fn products(&self, _index: usize) -> Option<&[Real]> {
        None
    }
}

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// `Solver::w` is the minimiser.
    Optimal {
        /// Changes of the working set after the warm start. Rows that refinement shows to have a negative multiplier are
        /// dropped without being counted: between two counted changes, no more than there are in the working set.
        iterations: usize,
    },
    /// The rows contradict each other; `Solver::certificate` proves it.
    Infeasible {
        /// The row that could not be satisfied together with those in the working set.
        row: usize,
    },
    /// The budget of working-set changes ran out, or rows are so nearly parallel that double precision does not tell
    /// whether they contradict each other. `Solver::w` violates some row.
    IterationLimit,
}

/// The working memory of the solver, and its result. It may be kept between solves or be made for each: nothing in it
/// matters to the next solve.
#[derive(Debug, Clone)]
pub struct Solver<const NV: usize> {
    w: [Real; NV],
    /// The largest |w_k|.
    magnitude: Real,
    active: [Halfspace; NV],
    len: usize,
    multipliers: [Real; NV],
    factor: Factor<NV>,
    iterations: usize,
    tolerance: Real,
    /// Sum of the magnitudes of the multipliers that w was made of.
    weight: Real,
    /// Rounding error of w = N multipliers; none once w was refined.
    noise: Real,
    /// Whether w and the multipliers were refined since the working set last changed.
    sharp: bool,
    /// Whether the last look has found every row kept with room for [`STILL`].
    clear: bool,
    /// Whether the factor was made anew since a row last came into the working set.
    fresh: bool,
    /// How far all rows are relaxed, relative to (their scale + `size`).
    relaxed: Real,
    size: Real,
    relaxations: usize,
    /// Rows that were violated when all were looked at last.
    seen: Glance,
    blocked: Option<Halfspace>,
}

/// One side of a row, as sign normal . w >= limit.
#[derive(Debug, Clone, Copy)]
struct Halfspace {
    row: usize,
    /// 1 for the lower side, -1 for the upper one.
    sign: Real,
    limit: Real,
    scale: Real,
}

/// Why a violated row could not be satisfied.
enum Stop<const NV: usize> {
    /// The row's normal is minus a non-negative combination of those in the working set: with these coefficients.
    Contradiction([Real; NV]),
    Budget,
    /// The factor is too far off to say anything.
    Lost,
}

/// What a contradiction amounts to.
enum Verdict {
    Proved,
    /// Relaxing every row by this, relative to (its scale + |w|), resolves it.
    Rounding {
        share: Real,
    },
    /// The normals cancel too badly: rows are so nearly parallel that there may be a solution.
    Unknown,
}

/// Whether w is final.
enum Settled {
    Final,
    /// It has moved, or a row was dropped: the rows are to be looked at again.
    Moved,
    /// Rows of the working set cannot be made to hold: they are too nearly parallel.
    Lost,
}

/// What refinement did to w.
enum Refined {
    /// Nothing.
    Steady,
    Moved,
    /// Not enough: the factor is too far off.
    Stuck,
}

impl<const NV: usize> Solver<NV> {
    /// Memory for problems with `NV` unknowns.
    pub const NEW: Self = Self {
        w: [0.0; NV],
        magnitude: 0.0,
        active: [Halfspace::NONE; NV],
        len: 0,
        multipliers: [0.0; NV],
        factor: Factor::EMPTY,
        iterations: 0,
        tolerance: TOLERANCE,
        weight: 0.0,
        noise: 0.0,
        sharp: true,
        clear: false,
        fresh: true,
        relaxed: 0.0,
        size: 0.0,
        relaxations: 0,
        seen: Glance::NOTHING,
        blocked: None,
    };

    /// Solves the problem with at most `budget` changes of the working set. The start is the part of `from` that is
    /// independent and has non-negative multipliers.
    pub fn solve(&mut self, rows: &impl Rows<NV>, from: &WorkingSet<NV>, budget: usize) -> Outcome {
        self.start(rows, from);
        loop {
            let Some(violated) = self.most_violated(rows) else {
                // A look that allowed for noise above the tolerance has seen nothing yet.
                let coarse = self.noise > self.tolerance * self.magnitude;
                match if self.sharp { Settled::Final } else { self.settle(rows) } {
                    // What is not a number violates nothing.
                    Settled::Final if !finite(&self.w) => return Outcome::IterationLimit,
                    Settled::Final if !coarse => return Outcome::Optimal { iterations: self.iterations },
                    Settled::Final | Settled::Moved => continue,
                    Settled::Lost => return Outcome::IterationLimit,
                }
            };
            match self.enter(rows, &violated, budget) {
                Ok(()) => self.combine(rows),
                Err(Stop::Budget) => return Outcome::IterationLimit,
                Err(Stop::Lost) if self.fresh => return Outcome::IterationLimit,
                Err(Stop::Lost) => self.refresh(rows),
                Err(Stop::Contradiction(_)) if !self.fresh => self.refresh(rows),
                Err(Stop::Contradiction(proof)) => match self.judge(rows, &violated, &proof) {
                    Verdict::Proved => return self.refute(violated, &proof),
                    Verdict::Rounding { share } if self.relaxations < MOST_RELAXATIONS => self.relax_all(rows, share),
                    Verdict::Rounding { .. } | Verdict::Unknown => return Outcome::IterationLimit,
                },
            }
        }
    }

    /// The minimiser, after [`Outcome::Optimal`].
    pub fn w(&self) -> &[Real; NV] {
        &self.w
    }

    /// Changes of the working set after the warm start, however the solve ended.
    pub fn iterations(&self) -> usize {
        self.iterations
    }

    /// The rows that hold with equality at the minimiser.
    #[inline]
    pub fn rows(&self) -> impl Iterator<Item = (usize, Side)> {
        self.active().map(|entry| (entry.row, entry.side()))
    }

    /// [`Self::rows`], to be kept.
    pub fn working_set(&self) -> WorkingSet<NV> {
        let mut set = WorkingSet::EMPTY;
        for (row, side) in self.rows() {
            set.push(row, side);
        }
        set
    }

    /// The multiplier, >= 0, of each row in the working set: w is their sum, each times its normal, which is minus the
    /// row for [`Side::Upper`].
    pub fn multipliers(&self) -> impl Iterator<Item = (usize, Side, Real)> {
        self.active().zip(&self.multipliers).map(|(entry, &multiplier)| (entry.row, entry.side(), multiplier))
    }

    /// After [`Outcome::Infeasible`], non-negative weights of one-sided inequalities whose sum reads 0 >= something
    /// positive (Farkas); otherwise nothing.
    pub fn certificate(&self) -> impl Iterator<Item = (usize, Side, Real)> {
        let blocked = self.blocked.iter().map(|entry| (entry.row, entry.side(), 1.0));
        let others = self.multipliers().take(if self.blocked.is_some() { self.len } else { 0 });
        blocked.chain(others)
    }

    /// Rows and their coefficients in w.
    #[inline(always)]
    fn parts(&self) -> impl Iterator<Item = (usize, Real)> {
        self.active().zip(&self.multipliers).map(|(entry, multiplier)| (entry.row, multiplier * entry.sign))
    }

    #[inline(always)]
    fn active(&self) -> impl Iterator<Item = &Halfspace> {
        self.active.iter().take(self.len)
    }

    #[inline(never)]
    fn start(&mut self, rows: &impl Rows<NV>, from: &WorkingSet<NV>) {
        self.len = 0;
        self.factor.clear();
        self.iterations = 0;
        self.tolerance = TOLERANCE;
        (self.relaxed, self.size, self.relaxations) = (0.0, 0.0, 0);
        self.blocked = None;
        self.seen = Glance::NOTHING;
        for (index, side) in from.iter() {
            if let Some(entry) = rows.get(index).and_then(|row| Halfspace::new(index, side, &row)) {
                self.push_independent(rows, entry);
            }
        }
        self.fresh = true;
        self.balance();
        self.combine(rows);
    }

    /// The row violated by the largest distance, if any is violated by more than the tolerance.
    #[inline(always)]
    fn most_violated(&mut self, rows: &impl Rows<NV>) -> Option<Halfspace> {
        let size = self.magnitude;
        self.clear = false;
        if self.relaxed == 0.0 {
            if NV > FEW
                && let Some(entry) = self.worst_of(rows, self.seen.iter(), size)
            {
                return Some(entry);
            }
            match rows.worst(&self.w, size, self.parts()) {
                // Products of rows know w by the multipliers, which may be much larger than w: then that says nothing.
                Worst::Kept if SUMMED * self.weight > STILL * size => {}
                Worst::Kept => {
                    self.clear = self.noise <= STILL * size;
                    return None;
                }
                Worst::Row(row, side) => {
                    if let Some(entry) = self.worst_of(rows, core::iter::once((row, side)), size) {
                        return Some(entry);
                    }
                }
                Worst::Unknown => {
                    if let Some(glance) = rows.glance(&self.w, size) {
                        self.seen = glance;
                        if glance.is_nothing() {
                            self.clear = self.noise <= STILL * size;
                            return None;
                        }
                        if let Some(entry) = self.worst_of(rows, glance.iter(), size) {
                            return Some(entry);
                        }
                    }
                }
            }
        }
        self.scan(rows)
    }

    /// The same by every row, one by one.
    #[inline]
    fn scan(&self, rows: &impl Rows<NV>) -> Option<Halfspace> {
        let size = self.magnitude;
        let mut worst = None;
        let mut distance = 0.0;
        for (index, row) in rows.iter().enumerate() {
            let value = dot_of(row.normal, &self.w);
            let (violation, side) = match (row.lower - value, value - row.upper) {
                (below, above) if below > above => (below, Side::Lower),
                (_, above) => (above, Side::Upper),
            };
            if violation > distance
                && violation > self.tolerance * (row.scale + size) + self.relaxed * (row.scale + self.size) + self.noise
                && !self.holds(index)
            {
                distance = violation;
                worst = Some((index, side));
            }
        }
        let (index, side) = worst?;
        Some(self.relax(Halfspace::new(index, side, &rows.get(index)?)?))
    }

    /// The row of a few that is violated most, if one is. They were violated a few changes before; to look at all rows is more
    /// work than to go on with these.
    #[inline(always)]
    fn worst_of(
        &self,
        rows: &impl Rows<NV>,
        seen: impl Iterator<Item = (usize, Side)>,
        size: Real,
    ) -> Option<Halfspace> {
        let mut worst = None;
        let mut distance = 0.0;
        for (index, side) in seen {
            let Some(entry) = rows.get(index).and_then(|row| Halfspace::new(index, side, &row)) else { continue };
            let violation = self.violation(rows, &entry);
            if violation > distance
                && violation > self.tolerance * (entry.scale + size) + self.noise
                && !self.holds(index)
            {
                distance = violation;
                worst = Some(entry);
            }
        }
        worst
    }

    /// Whether the row is in the working set.
    #[inline(always)]
    fn holds(&self, row: usize) -> bool {
        self.active().any(|entry| entry.row == row)
    }

    fn relax(&self, entry: Halfspace) -> Halfspace {
        Halfspace { limit: entry.limit - self.relaxed * (entry.scale + self.size), ..entry }
    }

    #[inline(always)]
    fn violation(&self, rows: &impl Rows<NV>, entry: &Halfspace) -> Real {
        entry.limit - entry.sign * dot_of(normal(rows, entry), &self.w)
    }

    /// Moves to the multipliers of the optimum over the working set and `entry`, dropping the rows whose multipliers reach
    /// zero on the way.
    fn enter(&mut self, rows: &impl Rows<NV>, entry: &Halfspace, budget: usize) -> Result<(), Stop<NV>> {
        let mut multiplier = 0.0;
        let mut violation = self.violation(rows, entry);
        let mut products = self.products_with(rows, entry);
        while self.iterations < budget {
            let mut column = self.factor.column(&products, 1.0);
            if self.is_delicate(&column) {
                column = self.project(rows, entry);
            }
            if !self.is_sound(&column) {
                return Err(Stop::Lost);
            }
            let independent = column.pivot > DEPENDENT && self.len < NV;
            let full = if independent { violation / column.pivot } else { Real::INFINITY };
            match self.blocking(&column.combination) {
                Some((at, partial)) if partial < full => {
                    self.advance(partial, &column.combination);
                    multiplier += partial;
                    if independent {
                        violation -= partial * column.pivot;
                    }
                    self.iterations += 1;
                    close_gap(products.get_mut(..self.len).unwrap_or_default(), at);
                    self.remove(at);
                }
                _ if independent => {
                    self.advance(full, &column.combination);
                    self.iterations += 1;
                    if self.iterations > LONG * (NV + 10) {
                        // Progress below rounding might repeat itself for ever.
                        self.tolerance = (2.0 * self.tolerance).min(LOOSEST);
                    }
                    self.push(*entry, &column, multiplier + full);
                    self.fresh = false;
                    return Ok(());
                }
                _ => return Err(Stop::Contradiction(column.combination)),
            }
        }
        Err(Stop::Budget)
    }

    /// Whether the row, or one of the working set, is so near to the span of others that the factor alone may be far off.
    #[inline(always)]
    fn is_delicate(&self, column: &Column<NV>) -> bool {
        self.len > 0 && (column.pivot < SAFE || self.factor.least() < SAFE)
    }

    /// Whether the distance of the row from the span of the working set is one that a row of unit length can have.
    #[inline(always)]
    fn is_sound(&self, column: &Column<NV>) -> bool {
        column.pivot <= if self.len < NV { 1.0 + SAFE } else { SAFE }
    }

    /// The coefficients r of normal = N r + z, z orthogonal to the working set's normals N, and |z|^2, by iterative
    /// refinement: the Gram matrix squares the condition number.
    #[cold]
    #[inline(never)]
    fn project(&self, rows: &impl Rows<NV>, entry: &Halfspace) -> Column<NV> {
        let mut column = Column { combination: [0.0; NV], pivot: 0.0 };
        let mut remainder = [0.0; NV];
        add_scaled(&mut remainder, entry.sign, normal(rows, entry));
        for _ in 0..PASSES {
            let mut correction = [0.0; NV];
            self.factor.solve_into(&self.products(rows, &remainder), &mut correction);
            add_scaled(&mut column.combination, 1.0, &correction);
            self.add_rows(rows, -1.0, &correction, &mut remainder);
            if largest(&correction) <= SUMMED * largest(&column.combination) {
                break;
            }
        }
        column.pivot = dot_of(&remainder, &remainder);
        column
    }

    /// vector += scale N coefficients.
    #[inline(never)]
    fn add_rows(&self, rows: &impl Rows<NV>, scale: Real, coefficients: &[Real; NV], vector: &mut [Real; NV]) {
        for (entry, coefficient) in self.active().zip(coefficients) {
            add_scaled(vector, scale * coefficient * entry.sign, normal(rows, entry));
        }
    }

    /// The first row whose multiplier reaches zero when the entering one's grows, and by how much it may grow.
    #[inline(always)]
    fn blocking(&self, combination: &[Real; NV]) -> Option<(usize, Real)> {
        let mut blocking = None;
        let mut step = Real::INFINITY;
        let noise = NOISE * larger(largest(first(combination, self.len)), 1.0);
        for (at, (multiplier, rate)) in self.multipliers.iter().zip(combination).enumerate().take(self.len) {
            let room = larger(*multiplier, 0.0);
            if *rate > noise && room < step * rate {
                step = room / rate;
                blocking = Some((at, step));
            }
        }
        blocking
    }

    #[inline(always)]
    fn advance(&mut self, step: Real, combination: &[Real; NV]) {
        add_scaled(self.multipliers.get_mut(..self.len).unwrap_or_default(), -step, combination);
    }

    /// Recomputes the factor, the multipliers and w from the working set, dropping rows while there are negative multipliers.
    #[cold]
    #[inline(never)]
    fn refresh(&mut self, rows: &impl Rows<NV>) {
        let len = self.len;
        self.factor.clear();
        self.len = 0;
        for place in 0..len {
            // No more than `place` entries were put back, so that this one still stands.
            let Some(entry) = self.active.get(place) else { break };
            let fresh = rows.get(entry.row).and_then(|row| Halfspace::new(entry.row, entry.side(), &row));
            if let Some(entry) = fresh {
                self.push_independent(rows, self.relax(entry));
            }
        }
        self.fresh = true;
        self.balance();
        self.combine(rows);
        for _ in 0..=NV {
            self.refine(rows);
            if !self.drop_negative(0.0) {
                return;
            }
            self.combine(rows);
        }
    }

    /// Solves N'N multipliers = limits, dropping rows while there are negative multipliers.
    #[inline(always)]
    fn balance(&mut self) {
        for _ in 0..=NV {
            let mut limits = [0.0; NV];
            for (limit, entry) in limits.iter_mut().zip(self.active()) {
                *limit = entry.limit;
            }
            self.multipliers = [0.0; NV];
            self.factor.solve_into(&limits, &mut self.multipliers);
            let noise = NEGATIVE * largest(first(&self.multipliers, self.len));
            if !self.drop_negative(noise) {
                return;
            }
        }
    }

    /// Whether there was a multiplier below -`noise`: the row of the most negative one is dropped.
    #[inline(always)]
    fn drop_negative(&mut self, noise: Real) -> bool {
        let (mut least, mut dropped) = (-noise, None);
        for (at, multiplier) in self.multipliers.iter().enumerate().take(self.len) {
            if *multiplier < least {
                (least, dropped) = (*multiplier, Some(at));
            }
        }
        dropped.inspect(|at| self.remove(*at)).is_some()
    }

    /// Makes w final.
    fn settle(&mut self, rows: &impl Rows<NV>) -> Settled {
        let settled = match self.refine(rows) {
            Refined::Steady => Settled::Final,
            Refined::Moved => Settled::Moved,
            Refined::Stuck if self.fresh => Settled::Lost,
            Refined::Stuck => {
                self.refresh(rows);
                Settled::Moved
            }
        };
        if self.drop_negative(0.0) {
            self.balance();
            self.combine(rows);
            return Settled::Moved;
        }
        settled
    }

    /// Refines w and the multipliers until every row of the working set holds. What is corrected is w itself, because the
    /// multipliers of nearly parallel rows are much larger than w, and so is their rounding error.
    fn refine(&mut self, rows: &impl Rows<NV>) -> Refined {
        let (mut moved, mut before) = (0.0, Real::INFINITY);
        (self.noise, self.sharp) = (0.0, false);
        for _ in 0..PASSES {
            let size = self.magnitude;
            let mut missing = [0.0; NV];
            let mut off = 0.0;
            for (missing, entry) in missing.iter_mut().zip(self.active()) {
                *missing = self.violation(rows, entry);
                off = larger(missing.abs() / (entry.scale + size), off);
            }
            if off <= SETTLED || (off > 0.5 * before && off <= TOLERANCE) {
                self.sharp = true;
                return if moved <= if self.clear { STILL * size } else { 0.0 } {
                    Refined::Steady
                } else {
                    Refined::Moved
                };
            }
            if off > 0.5 * before {
                return Refined::Stuck;
            }
            before = off;
            let corrections = self.factor.solve(&missing);
            for ((entry, multiplier), correction) in
                self.active.iter().zip(&mut self.multipliers).zip(&corrections).take(self.len)
            {
                *multiplier += correction;
                add_scaled(&mut self.w, correction * entry.sign, normal(rows, entry));
                moved += correction.abs();
            }
            self.magnitude = largest(&self.w);
        }
        Refined::Moved
    }

    /// w = N multipliers.
    #[inline(always)]
    fn combine(&mut self, rows: &impl Rows<NV>) {
        self.w = [0.0; NV];
        let mut weight = 0.0;
        for (entry, multiplier) in self.active.iter().zip(&self.multipliers).take(self.len) {
            add_scaled(&mut self.w, multiplier * entry.sign, normal(rows, entry));
            weight += multiplier.abs();
        }
        self.magnitude = largest(&self.w);
        (self.weight, self.noise, self.sharp) = (weight, SUMMED * weight, false);
    }

    /// N' vector.
    #[inline(never)]
    fn products(&self, rows: &impl Rows<NV>, vector: &[Real]) -> [Real; NV] {
        let mut products = [0.0; NV];
        for (product, entry) in products.iter_mut().zip(self.active()) {
            *product = entry.sign * dot_of(normal(rows, entry), vector);
        }
        products
    }

    #[inline(always)]
    fn products_with(&self, rows: &impl Rows<NV>, entry: &Halfspace) -> [Real; NV] {
        let mut products = [0.0; NV];
        let places = products.iter_mut().zip(self.active());
        if let Some(known) = rows.products(entry.row) {
            for (product, other) in places {
                *product = entry.sign * other.sign * known.get(other.row).copied().unwrap_or(0.0);
            }
        } else {
            let vector = normal(rows, entry);
            for (product, other) in places {
                *product = entry.sign * other.sign * dot_of(normal(rows, other), vector);
            }
        }
        products
    }

    #[inline(always)]
    fn push_independent(&mut self, rows: &impl Rows<NV>, entry: Halfspace) {
        let mut column = self.factor.column(&self.products_with(rows, &entry), 1.0);
        if self.is_delicate(&column) {
            column = self.project(rows, &entry);
        }
        if column.pivot > DEPENDENT {
            self.push(entry, &column, 0.0);
        }
    }

    #[inline(always)]
    fn push(&mut self, entry: Halfspace, column: &Column<NV>, multiplier: Real) {
        if let (Some(place), Some(value)) = (self.active.get_mut(self.len), self.multipliers.get_mut(self.len)) {
            *place = entry;
            *value = multiplier;
            self.len += 1;
            self.factor.push(column);
        }
    }

    fn remove(&mut self, at: usize) {
        close_gap(self.active.get_mut(..self.len).unwrap_or_default(), at);
        close_gap(self.multipliers.get_mut(..self.len).unwrap_or_default(), at);
        self.factor.remove(at);
        self.len = self.len.saturating_sub(1);
    }

    /// What a contradiction of the working set and the violated row amounts to.
    #[cold]
    #[inline(never)]
    fn judge(&self, rows: &impl Rows<NV>, violated: &Halfspace, combination: &[Real; NV]) -> Verdict {
        let size = self.magnitude.max(self.size);
        let mut sum = [0.0; NV];
        add_scaled(&mut sum, violated.sign, normal(rows, violated));
        let (mut contradiction, mut involved, mut scale) = (violated.limit, violated.scale + size, violated.scale);
        for (entry, coefficient) in self.active().zip(combination) {
            let share = (-coefficient).max(0.0);
            add_scaled(&mut sum, share * entry.sign, normal(rows, entry));
            contradiction += share * entry.limit;
            involved += share * (entry.scale + size);
            scale = scale.max(entry.scale);
        }
        let far = BEYOND * scale.max(size);
        let cancels = dot_of(&sum, &sum) * far * far <= contradiction * contradiction;
        let share = self.violation(rows, violated).max(0.0) / involved;
        if contradiction > ROUNDING * involved && cancels {
            Verdict::Proved
        } else if share <= UNPROVED {
            Verdict::Rounding { share }
        } else {
            Verdict::Unknown
        }
    }

    /// Relaxes all rows by a little more than `share` of (their scale + |w|).
    #[inline(always)]
    fn relax_all(&mut self, rows: &impl Rows<NV>, share: Real) {
        self.size = self.magnitude.max(self.size);
        self.relaxed += 1.5 * share;
        self.relaxations += 1;
        self.refresh(rows);
    }

    /// Keeps the certificate.
    #[cold]
    #[inline(never)]
    fn refute(&mut self, violated: Halfspace, combination: &[Real; NV]) -> Outcome {
        for (multiplier, coefficient) in self.multipliers.iter_mut().zip(combination).take(self.len) {
            *multiplier = (-coefficient).max(0.0);
        }
        self.blocked = Some(violated);
        Outcome::Infeasible { row: violated.row }
    }
}

/// Of so few unknowns a look at all rows costs no more than one at a few.
const FEW: usize = 8;

/// Relaxations of one solve.
const MOST_RELAXATIONS: usize = 50;

/// After this many changes per unknown the tolerance doubles with each further one, up to this.
const LONG: usize = 3;
const LOOSEST: Real = precision::LOOSEST;

impl Halfspace {
    const NONE: Self = Self { row: 0, sign: 0.0, limit: 0.0, scale: 0.0 };

    /// One side of a row; `None` where that side is infinite.
    #[inline]
    fn new(index: usize, side: Side, row: &Row<'_>) -> Option<Self> {
        let (sign, limit) = match side {
            Side::Lower => (1.0, row.lower),
            Side::Upper => (-1.0, -row.upper),
        };
        limit.is_finite().then_some(Self { row: index, sign, limit, scale: row.scale })
    }

    #[inline]
    fn side(&self) -> Side {
        if self.sign > 0.0 { Side::Lower } else { Side::Upper }
    }
}

/// The normal of the row that an entry is a side of.
#[inline]
fn normal<'a, const NV: usize>(rows: &'a impl Rows<NV>, entry: &Halfspace) -> &'a [Real] {
    rows.normal(entry.row)
}

fn first(values: &[Real], count: usize) -> &[Real] {
    values.get(..count).unwrap_or_default()
}
