//! The least-distance solver: a dual active-set method.
//!
//! Minimise 1/2 |w|^2 subject to lower_r <= v_r . w <= upper_r, rows v_r of unit length, each side possibly infinite.
//! The method is that of Goldfarb and Idnani ("A numerically stable dual method for solving strictly convex quadratic
//! programs", Mathematical Programming 27, 1983) with the identity as Hessian: w is always the optimum over the rows in
//! the working set, so its length grows with every step, and no working set comes back.

use crate::factor::Factor;
use crate::linear::{add_scaled, close_gap, dot, largest};

/// A row counts as satisfied when it is violated by no more than this times (its scale + the largest |w_k|). The only
/// exception are rows that contradict each other by no more than what rounding their limits explains: then the
/// violation may be as large as that contradiction.
pub const TOLERANCE: f64 = 1e-12;

/// Relative rounding error that each limit is granted before a contradiction counts as proved.
const ROUNDING: f64 = 4e-15;

/// A row is taken to depend on the working set when the square of its distance from the span of that set's rows is
/// below this: within 1e-7 rad, its own direction is rounding noise.
const DEPENDENT: f64 = 1e-14;

/// Coefficients of a row over the working set below this times the largest are rounding noise.
const NOISE: f64 = 1e-9;

/// At most this many passes of iterative refinement.
const PASSES: usize = 4;

/// Row lower <= normal . w <= upper of a least-distance problem.
#[derive(Debug, Clone, Copy)]
pub struct Row<'a, const NV: usize> {
    /// Of unit length.
    pub normal: &'a [f64; NV],
    pub lower: f64,
    pub upper: f64,
    /// Magnitude of the limits. Tolerances and rounding errors are taken relative to it plus the largest |w_k|. In the
    /// i-DPC problem it is that of the constant limits alone, without the offsets: where an offset outgrows its limit, so
    /// do the |w_k| that satisfy the row, and the sum is of the right size.
    pub scale: f64,
}

/// The rows of a least-distance problem, in a fixed order.
pub trait Rows<const NV: usize> {
    fn iter(&self) -> impl Iterator<Item = Row<'_, NV>>;

    /// Row `index`.
    fn get(&self, index: usize) -> Option<Row<'_, NV>> {
        self.iter().nth(index)
    }
}

/// The side of a row that holds with equality.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    Lower,
    Upper,
}

/// Rows, with their sides, that hold with equality at a solution: all a warm start needs to know.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WorkingSet<const NV: usize> {
    entries: [(usize, Side); NV],
    len: usize,
}

impl<const NV: usize> WorkingSet<NV> {
    /// No row: a cold start.
    pub const EMPTY: Self = Self { entries: [(0, Side::Lower); NV], len: 0 };

    /// Appends a row; false if all `NV` places are taken.
    pub fn push(&mut self, row: usize, side: Side) -> bool {
        let place = self.entries.get_mut(self.len);
        let free = place.is_some();
        if let Some(place) = place {
            *place = (row, side);
            self.len += 1;
        }
        free
    }

    pub fn iter(&self) -> impl Iterator<Item = (usize, Side)> {
        self.entries.iter().copied().take(self.len)
    }

    pub fn len(&self) -> usize {
        self.len
    }

    pub fn is_empty(&self) -> bool {
        self.len == 0
    }
}

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// `Solver::w` is the minimiser.
    Optimal {
        /// Changes of the working set after the warm start.
        iterations: usize,
    },
    /// The rows contradict each other; `Solver::certificate` proves it.
    Infeasible {
        /// The row that could not be satisfied together with those in the working set.
        row: usize,
    },
    /// The budget of working-set changes ran out. `Solver::w` violates some row.
    IterationLimit,
}

/// The working memory of the solver, and its result. It may be kept between solves or be made for each.
#[derive(Debug, Clone)]
pub struct Solver<const NV: usize> {
    w: [f64; NV],
    active: [Halfspace<NV>; NV],
    len: usize,
    multipliers: [f64; NV],
    factor: Factor<NV>,
    iterations: usize,
    tolerance: f64,
    blocked: Option<Halfspace<NV>>,
}

/// One side of a row, as normal . w >= limit.
#[derive(Debug, Clone, Copy)]
struct Halfspace<const NV: usize> {
    row: usize,
    side: Side,
    normal: [f64; NV],
    limit: f64,
    scale: f64,
}

/// Why a violated row could not be satisfied.
enum Stop<const NV: usize> {
    /// The row's normal is minus a non-negative combination of those in the working set: with these coefficients.
    Contradiction([f64; NV]),
    Budget,
}

impl<const NV: usize> Solver<NV> {
    /// Memory for problems with `NV` unknowns.
    pub const NEW: Self = Self {
        w: [0.0; NV],
        active: [Halfspace::NONE; NV],
        len: 0,
        multipliers: [0.0; NV],
        factor: Factor::EMPTY,
        iterations: 0,
        tolerance: TOLERANCE,
        blocked: None,
    };

    /// Solves the problem with at most `budget` changes of the working set. The start is the part of `from` that is
    /// independent and has non-negative multipliers.
    pub fn solve(&mut self, rows: &impl Rows<NV>, from: &WorkingSet<NV>, budget: usize) -> Outcome {
        self.start(rows, from);
        // Whether w and the multipliers were recomputed from the working set since it last changed.
        let mut exact = true;
        loop {
            let entered = match self.most_violated(rows) {
                None if exact => return Outcome::Optimal { iterations: self.iterations },
                None => None,
                Some(violated) => Some((violated, self.enter(&violated, budget))),
            };
            match entered {
                Some((_, Ok(()))) => {
                    exact = false;
                    continue;
                }
                Some((_, Err(Stop::Budget))) => return Outcome::IterationLimit,
                Some((violated, Err(Stop::Contradiction(proof)))) if exact => {
                    if !self.tolerate(&violated, &proof) {
                        return self.refute(violated, proof);
                    }
                }
                Some((_, Err(Stop::Contradiction(_)))) | None => (),
            }
            self.refresh();
            exact = true;
        }
    }

    /// The minimiser, after [`Outcome::Optimal`].
    pub fn w(&self) -> &[f64; NV] {
        &self.w
    }

    /// The rows that hold with equality at the minimiser.
    pub fn working_set(&self) -> WorkingSet<NV> {
        let mut set = WorkingSet::EMPTY;
        for entry in self.active() {
            set.push(entry.row, entry.side);
        }
        set
    }

    /// The multiplier, >= 0, of each row in the working set: w is their sum, each times its normal, which is minus the
    /// row for [`Side::Upper`].
    pub fn multipliers(&self) -> impl Iterator<Item = (usize, Side, f64)> {
        self.active().zip(&self.multipliers).map(|(entry, &multiplier)| (entry.row, entry.side, multiplier))
    }

    /// After [`Outcome::Infeasible`], non-negative weights of one-sided inequalities whose sum reads 0 >= something
    /// positive (Farkas); otherwise nothing.
    pub fn certificate(&self) -> impl Iterator<Item = (usize, Side, f64)> {
        let blocked = self.blocked.iter().map(|entry| (entry.row, entry.side, 1.0));
        let others = self.multipliers().take(if self.blocked.is_some() { self.len } else { 0 });
        blocked.chain(others)
    }

    fn active(&self) -> impl Iterator<Item = &Halfspace<NV>> {
        self.active.iter().take(self.len)
    }

    fn start(&mut self, rows: &impl Rows<NV>, from: &WorkingSet<NV>) {
        *self = Self::NEW;
        for (index, side) in from.iter() {
            if let Some(entry) = rows.get(index).and_then(|row| Halfspace::new(index, side, &row)) {
                self.push_independent(entry);
            }
        }
        self.refresh();
    }

    /// The row violated by the largest distance, if any is violated by more than the tolerance.
    fn most_violated(&self, rows: &impl Rows<NV>) -> Option<Halfspace<NV>> {
        let size = largest(&self.w);
        let mut worst = None;
        let mut distance = 0.0;
        for (index, row) in rows.iter().enumerate() {
            let value = dot(row.normal, &self.w);
            let (violation, side) = match (row.lower - value, value - row.upper) {
                (below, above) if below > above => (below, Side::Lower),
                (_, above) => (above, Side::Upper),
            };
            if violation > distance && violation > self.tolerance * (row.scale + size) {
                distance = violation;
                worst = Halfspace::new(index, side, &row);
            }
        }
        worst
    }

    /// Moves to the optimum over the working set and `entry`, dropping the rows whose multipliers reach zero on the
    /// way.
    fn enter(&mut self, entry: &Halfspace<NV>, budget: usize) -> Result<(), Stop<NV>> {
        let mut multiplier = 0.0;
        while self.iterations < budget {
            let (combination, distance) = self.project(&entry.normal);
            let pivot = dot(&distance, &distance);
            let independent = pivot > DEPENDENT && self.len < NV;
            let full = if independent { (entry.limit - dot(&entry.normal, &self.w)) / pivot } else { f64::INFINITY };
            match self.blocking(&combination) {
                Some((at, partial)) if partial < full => {
                    self.advance(partial, &combination, &distance, independent);
                    multiplier += partial;
                    self.iterations += 1;
                    self.remove(at);
                }
                _ if independent => {
                    self.advance(full, &combination, &distance, true);
                    self.iterations += 1;
                    self.push(*entry, pivot, multiplier + full);
                    return Ok(());
                }
                _ => return Err(Stop::Contradiction(combination)),
            }
        }
        Err(Stop::Budget)
    }

    /// The coefficients r and the remainder z of normal = N r + z, z orthogonal to the working set's normals N.
    fn project(&self, normal: &[f64; NV]) -> ([f64; NV], [f64; NV]) {
        let mut combination = [0.0; NV];
        let mut remainder = *normal;
        // The Gram matrix squares the condition number; the later passes remove what that cost.
        for _ in 0..PASSES {
            let correction = self.factor.solve(&self.products(&remainder));
            add_scaled(&mut combination, 1.0, &correction);
            for (entry, coefficient) in self.active().zip(&correction) {
                add_scaled(&mut remainder, -coefficient, &entry.normal);
            }
            if largest(&correction) <= 1e-15 * largest(&combination) {
                break;
            }
        }
        (combination, remainder)
    }

    /// The first row whose multiplier reaches zero when the entering one's grows, and by how much it may grow.
    fn blocking(&self, combination: &[f64; NV]) -> Option<(usize, f64)> {
        let mut first = None;
        let mut step = f64::INFINITY;
        let noise = NOISE * largest(combination).max(1.0);
        for (at, (multiplier, rate)) in self.multipliers.iter().zip(combination).enumerate().take(self.len) {
            if *rate > noise && multiplier / rate < step {
                step = multiplier / rate;
                first = Some((at, step));
            }
        }
        first
    }

    fn advance(&mut self, step: f64, combination: &[f64; NV], distance: &[f64; NV], independent: bool) {
        add_scaled(&mut self.multipliers, -step, combination);
        if independent {
            add_scaled(&mut self.w, step, distance);
        }
    }

    /// Recomputes the factor, the multipliers and w from the working set, dropping rows while there are negative
    /// multipliers.
    fn refresh(&mut self) {
        let (active, len) = (self.active, self.len);
        self.factor = Factor::EMPTY;
        self.len = 0;
        for entry in active.into_iter().take(len) {
            self.push_independent(entry);
        }
        for _ in 0..=NV {
            self.recompute();
            let smallest =
                self.multipliers.iter().copied().enumerate().take(self.len).min_by(|a, b| a.1.total_cmp(&b.1));
            match smallest {
                Some((at, multiplier)) if multiplier < 0.0 => self.remove(at),
                _ => return,
            }
        }
    }

    /// Solves N'N multipliers = limits, w = N multipliers. The refinement corrects w itself, because the multipliers of
    /// nearly parallel rows are much larger than w, and so is their rounding error.
    fn recompute(&mut self) {
        self.multipliers = [0.0; NV];
        self.w = [0.0; NV];
        for _ in 0..PASSES {
            let mut missing = self.products(&self.w);
            for (missing, entry) in missing.iter_mut().zip(self.active.iter().take(self.len)) {
                *missing = entry.limit - *missing;
            }
            let correction = self.factor.solve(&missing);
            add_scaled(&mut self.multipliers, 1.0, &correction);
            for (entry, coefficient) in self.active.iter().take(self.len).zip(&correction) {
                add_scaled(&mut self.w, *coefficient, &entry.normal);
            }
        }
    }

    /// N' vector, with zeros beyond the working set.
    fn products(&self, vector: &[f64; NV]) -> [f64; NV] {
        let mut products = [0.0; NV];
        for (product, entry) in products.iter_mut().zip(self.active()) {
            *product = dot(&entry.normal, vector);
        }
        products
    }

    fn push_independent(&mut self, entry: Halfspace<NV>) {
        let (_, distance) = self.project(&entry.normal);
        let pivot = dot(&distance, &distance);
        if pivot > DEPENDENT {
            self.push(entry, pivot, 0.0);
        }
    }

    fn push(&mut self, entry: Halfspace<NV>, pivot: f64, multiplier: f64) {
        let products = self.products(&entry.normal);
        if let (Some(place), Some(value)) = (self.active.get_mut(self.len), self.multipliers.get_mut(self.len)) {
            *place = entry;
            *value = multiplier;
            self.len += 1;
            self.factor.push(&products, pivot);
        }
    }

    fn remove(&mut self, at: usize) {
        close_gap(&mut self.active, at);
        close_gap(&mut self.multipliers, at);
        self.factor.remove(at);
        self.len = self.len.saturating_sub(1);
    }

    /// Loosens the tolerance where the contradiction is not larger than the rounding errors of the limits in it.
    fn tolerate(&mut self, violated: &Halfspace<NV>, combination: &[f64; NV]) -> bool {
        let size = largest(&self.w);
        let violation = violated.limit - dot(&violated.normal, &self.w);
        let involved = self.active().zip(combination).map(|(entry, r)| r.abs() * (entry.scale + size));
        let rounding = ROUNDING * involved.fold(violated.scale + size, |sum, term| sum + term);
        let tolerable = violation <= rounding;
        if tolerable {
            self.tolerance = self.tolerance.max(2.0 * violation / (violated.scale + size));
        }
        tolerable
    }

    fn refute(&mut self, violated: Halfspace<NV>, combination: [f64; NV]) -> Outcome {
        self.multipliers = combination.map(|coefficient| (-coefficient).max(0.0));
        self.blocked = Some(violated);
        Outcome::Infeasible { row: violated.row }
    }
}

impl<const NV: usize> Halfspace<NV> {
    const NONE: Self = Self { row: 0, side: Side::Lower, normal: [0.0; NV], limit: 0.0, scale: 0.0 };

    /// One side of a row; `None` where that side is infinite.
    fn new(index: usize, side: Side, row: &Row<'_, NV>) -> Option<Self> {
        let (normal, limit) = match side {
            Side::Lower => (*row.normal, row.lower),
            Side::Upper => (row.normal.map(|value| -value), -row.upper),
        };
        limit.is_finite().then_some(Self { row: index, side, normal, limit, scale: row.scale })
    }
}
