//! Least-distance problems that make solvers stumble, their truth in numbers of 106 bits, and what the runtime's solver makes of
//! them.

use std::fmt;

use dpc_runtime::solver::{Outcome, Row, Rows, Side, Solver, TOLERANCE, WorkingSet, Worst};

use crate::Random;
use crate::double_double::{self, Wide};

/// Largest relative difference of a solution from the truth.
pub const AGREE: f64 = 1e-9;

/// What is difficult about a problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Two-sided rows in random directions around a random point.
    Ordinary,
    /// Many more rows than unknowns through one point.
    Degenerate,
    /// Repeated and opposite rows, and rows at angles of 0.1 down to 1e-5 rad.
    Parallel,
    /// Feasible by 1e-1 down to 1e-9 of the limits.
    NearlyInfeasible,
    /// Limits from 1e-6 to 1e6.
    BadlyScaled,
    /// Infeasible by 1 down to 1e-9 of the limits.
    Infeasible,
}

impl Kind {
    pub const ALL: [Self; 6] =
        [Self::Ordinary, Self::Degenerate, Self::Parallel, Self::NearlyInfeasible, Self::BadlyScaled, Self::Infeasible];
}

/// Rows lower <= normal . w <= upper.
#[derive(Debug, Clone)]
pub struct Problem<const NV: usize> {
    /// Normal of unit length, lower and upper limit.
    pub rows: Vec<([f64; NV], f64, f64)>,
}

impl<const NV: usize> Rows<NV> for Problem<NV> {
    fn iter(&self) -> impl Iterator<Item = Row<'_>> {
        (0..self.rows.len()).filter_map(|index| self.get(index))
    }

    fn get(&self, index: usize) -> Option<Row<'_>> {
        let (normal, lower, upper) = self.rows.get(index)?;
        Some(Row { normal, lower: *lower, upper: *upper, scale: size(*lower).max(size(*upper)) })
    }
}

/// The same problem with the products of its rows at hand, as small emitted problems have them.
pub struct LookedUp<'a, const NV: usize> {
    problem: &'a Problem<NV>,
    gram: Vec<Vec<f64>>,
}

impl<'a, const NV: usize> LookedUp<'a, NV> {
    pub fn new(problem: &'a Problem<NV>) -> Self {
        let rows = &problem.rows;
        let gram = rows.iter().map(|(a, ..)| rows.iter().map(|(b, ..)| dot(a, b)).collect()).collect();
        Self { problem, gram }
    }
}

impl<const NV: usize> Rows<NV> for LookedUp<'_, NV> {
    fn iter(&self) -> impl Iterator<Item = Row<'_>> {
        self.problem.iter()
    }

    fn get(&self, index: usize) -> Option<Row<'_>> {
        self.problem.get(index)
    }

    fn products(&self, index: usize) -> Option<&[f64]> {
        self.gram.get(index).map(Vec::as_slice)
    }

    fn worst(&self, _w: &[f64; NV], size: f64, sum: impl Iterator<Item = (usize, f64)>) -> Worst {
        let mut values = vec![0.0; self.gram.len()];
        for (row, coefficient) in sum {
            values.iter_mut().zip(&self.gram[row]).for_each(|(value, product)| *value += coefficient * product);
        }
        let (mut worst, mut distance) = (Worst::Kept, 0.5 * TOLERANCE * size);
        for (row, (value, (_, lower, upper))) in values.iter().zip(&self.problem.rows).enumerate() {
            for (side, violation) in [(Side::Lower, lower - value), (Side::Upper, value - upper)] {
                if violation > distance {
                    (worst, distance) = (Worst::Row(row, side), violation);
                }
            }
        }
        worst
    }
}

/// What is true of a problem.
pub enum Truth {
    Minimiser(Vec<f64>),
    /// No w shorter than a thousand times the limits satisfies all rows.
    Infeasible,
    /// Rows depend on each other to 106 bits, or there were too many changes.
    Unknown,
}

/// What became of the problems of one kind.
#[derive(Debug, Clone, Default)]
pub struct Verdicts {
    pub problems: usize,
    /// Solutions that agree with the truth, cold and warm.
    pub solved: usize,
    /// Solutions of problems that are infeasible by no more than the rounding errors of their limits.
    pub rounded: usize,
    /// Proofs that there is no solution, checked and true.
    pub refuted: usize,
    /// The solver, or the truth, gave up.
    pub undecided: usize,
    pub unknown: usize,
    pub worst: f64,
    pub most_iterations: usize,
    pub wrong: Vec<String>,
}

impl fmt::Display for Verdicts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { problems, solved, rounded, refuted, undecided, unknown, worst, most_iterations, wrong } = self;
        write!(f, "{problems:>7} problems: {solved:>7} solved, within {worst:.0e}; {refuted:>6} refuted; ")?;
        write!(f, "{rounded:>6} solved up to rounding; ")?;
        write!(
            f,
            "{undecided} undecided, {unknown} of unknown truth; {} wrong; at most {most_iterations} iterations",
            wrong.len()
        )
    }
}

impl Verdicts {
    pub fn add(&mut self, other: Self) {
        self.problems += other.problems;
        self.solved += other.solved;
        self.rounded += other.rounded;
        self.refuted += other.refuted;
        self.undecided += other.undecided;
        self.unknown += other.unknown;
        self.worst = self.worst.max(other.worst);
        self.most_iterations = self.most_iterations.max(other.most_iterations);
        self.wrong.extend(other.wrong);
    }
}

/// `count` problems of one kind, of several sizes.
pub fn examine(kind: Kind, seed: u64, count: usize) -> Verdicts {
    let mut all = Verdicts::default();
    for case in 0..count as u64 {
        let mut random = Random(seed.wrapping_mul(0x9e37_79b9).wrapping_add(case));
        let one = match case % 32 {
            0 => one::<24>(kind, &mut random, 60),
            1..=4 => one::<12>(kind, &mut random, 40),
            5..=15 => one::<5>(kind, &mut random, 20),
            16..=24 => one::<3>(kind, &mut random, 12),
            _ => one::<2>(kind, &mut random, 8),
        };
        all.add(one);
    }
    all
}

fn one<const NV: usize>(kind: Kind, random: &mut Random, most_rows: usize) -> Verdicts {
    let problem = Problem::<NV>::new(kind, random, most_rows);
    let truth = problem.truth();
    let mut verdicts = Verdicts { problems: 1, ..Verdicts::default() };
    let mut solver = Solver::NEW;
    problem.judge(&mut solver, &WorkingSet::EMPTY, &truth, &mut verdicts);
    let mut warm = WorkingSet::EMPTY;
    for _ in 0..random.below(NV + 1) {
        warm.push(random.below(problem.rows.len()), if random.chance(0.5) { Side::Lower } else { Side::Upper });
    }
    let mut again = Verdicts::default();
    problem.judge(&mut solver, &warm, &truth, &mut again);
    let looked_up = LookedUp::new(&problem);
    for from in [&WorkingSet::EMPTY, &warm] {
        problem.judge_by(&looked_up, &mut solver, from, &truth, &mut again);
    }
    // What one start could decide and the other could not is undecided.
    verdicts.undecided = verdicts.undecided.max(again.undecided);
    verdicts.worst = verdicts.worst.max(again.worst);
    verdicts.most_iterations = verdicts.most_iterations.max(again.most_iterations);
    verdicts.wrong.extend(again.wrong);
    verdicts
}

const BUDGET: usize = 2000;

impl<const NV: usize> Problem<NV> {
    fn new(kind: Kind, random: &mut Random, most_rows: usize) -> Self {
        let size = random.magnitude(1e-3, 1e3);
        let inside: [f64; NV] = std::array::from_fn(|_| size * random.between(-1.0, 1.0));
        let count = 2 + random.below(most_rows - 1);
        let mut rows: Vec<([f64; NV], f64, f64)> = Vec::new();
        while rows.len() < count {
            let normal = match (kind, rows.last()) {
                (Kind::Parallel, Some((last, ..))) if random.chance(0.4) => neighbour(last, random),
                _ => unit(random),
            };
            let value = dot(&normal, &inside);
            let mut gap = || match kind {
                Kind::Degenerate if random.chance(0.6) => 0.0,
                Kind::Degenerate | Kind::Parallel if random.chance(0.3) => f64::INFINITY,
                Kind::Parallel => size * random.magnitude(1e-9, 1.0),
                Kind::BadlyScaled => random.magnitude(1e-6, 1e6),
                _ => size * random.between(0.01, 1.0),
            };
            rows.push((normal, value - gap(), value + gap()));
        }
        let margin = random.magnitude(1e-9, 0.5);
        match kind {
            // A slab beside the point, and the same slab from the other side.
            Kind::NearlyInfeasible => rows.extend(squeezed(&inside, size * margin, random)),
            Kind::Infeasible => rows.extend(squeezed(&inside, -size * margin, random)),
            _ => {}
        }
        Self { rows }
    }

    /// Solves from `from` and compares with the truth.
    fn judge(&self, solver: &mut Solver<NV>, from: &WorkingSet<NV>, truth: &Truth, verdicts: &mut Verdicts) {
        self.judge_by(self, solver, from, truth, verdicts);
    }

    /// The same where `rows` are this problem's.
    fn judge_by(
        &self,
        rows: &impl Rows<NV>,
        solver: &mut Solver<NV>,
        from: &WorkingSet<NV>,
        truth: &Truth,
        verdicts: &mut Verdicts,
    ) {
        match solver.solve(rows, from, BUDGET) {
            Outcome::Optimal { iterations } => {
                verdicts.most_iterations = verdicts.most_iterations.max(iterations);
                match truth {
                    Truth::Minimiser(w) => verdicts.compare(self, solver.w(), w),
                    Truth::Infeasible if self.holds(solver.w()) => verdicts.rounded += 1,
                    Truth::Infeasible => verdicts.wrong.push(format!("a solution where there is none: {self:?}")),
                    Truth::Unknown => verdicts.unknown += 1,
                }
            }
            Outcome::Infeasible { row } => {
                let named = solver.certificate().next().is_some_and(|(first, ..)| first == row);
                match truth {
                    Truth::Infeasible if named && self.refuted(solver) => verdicts.refuted += 1,
                    // The truth gave up; the certificate proves it.
                    Truth::Unknown if named && self.refuted(solver) => verdicts.refuted += 1,
                    _ => verdicts.wrong.push(format!("no solution where there is one, or no proof: {self:?}")),
                }
            }
            Outcome::IterationLimit => verdicts.undecided += 1,
        }
    }

    /// Whether w satisfies every row up to the rounding error that the solver grants limits.
    fn holds(&self, w: &[f64; NV]) -> bool {
        let far = w.iter().fold(0.0, |far: f64, x| far.max(x.abs()));
        self.rows.iter().all(|(normal, lower, upper)| {
            let (value, slack) = (dot(normal, w), 1e-13 * (size(*lower).max(size(*upper)) + far));
            *lower - slack <= value && value <= *upper + slack
        })
    }

    /// Whether the certificate proves that no w shorter than a thousand times the limits satisfies its rows.
    fn refuted(&self, solver: &Solver<NV>) -> bool {
        let mut sum = [Wide::ZERO; NV];
        let (mut limits, mut scale) = (Wide::ZERO, 0.0_f64);
        for (row, side, weight) in solver.certificate() {
            if weight < 0.0 {
                return false;
            }
            let (normal, limit) = self.side(row, side);
            let weight = Wide::from(weight);
            sum.iter_mut().zip(normal).for_each(|(sum, x)| *sum = *sum + weight * Wide::from(x));
            limits = limits + weight * Wide::from(limit);
            scale = scale.max(limit.abs());
        }
        let length = sum.iter().map(|x| x.value() * x.value()).sum::<f64>().sqrt();
        limits.value() > 0.0 && length * 1e3 * scale <= limits.value()
    }

    /// A side as normal . w >= limit.
    fn side(&self, row: usize, side: Side) -> ([f64; NV], f64) {
        let (normal, lower, upper) = self.rows[row];
        match side {
            Side::Lower => (normal, lower),
            Side::Upper => (normal.map(|x| -x), -upper),
        }
    }

    /// Goldfarb and Idnani's method once more, written for numbers of 106 bits and for nothing else than being right: from a
    /// cold start, every system of equations solved anew.
    pub fn truth(&self) -> Truth {
        let mut search = Search { active: Vec::new(), multipliers: Vec::new(), w: [Wide::ZERO; NV] };
        for _ in 0..BUDGET {
            let Some(entering) = search.most_violated(self) else {
                return Truth::Minimiser(search.w.map(Wide::value).to_vec());
            };
            match search.enter(entering) {
                Some(true) => {}
                Some(false) => return Truth::Infeasible,
                None => return Truth::Unknown,
            }
        }
        Truth::Unknown
    }
}

/// normal . w >= limit.
type Half<const NV: usize> = ([f64; NV], f64);

/// The state of the search for the truth.
struct Search<const NV: usize> {
    active: Vec<Half<NV>>,
    multipliers: Vec<Wide>,
    w: [Wide; NV],
}

/// A row is satisfied when it is violated by no more than this, relative to its limit and |w|.
const EXACT: f64 = 1e-24;

impl<const NV: usize> Search<NV> {
    fn most_violated(&self, problem: &Problem<NV>) -> Option<Half<NV>> {
        let far = self.w.iter().fold(0.0, |far: f64, x| far.max(x.value().abs()));
        let sides =
            (0..problem.rows.len()).flat_map(|row| [Side::Lower, Side::Upper].map(|side| problem.side(row, side)));
        let violated = sides.filter(|(_, limit)| limit.is_finite()).filter_map(|half| {
            let violation = self.missing(&half).value();
            (violation > EXACT * (half.1.abs() + far)).then_some((half, violation))
        });
        violated.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(half, _)| half)
    }

    fn missing(&self, (normal, limit): &Half<NV>) -> Wide {
        normal.iter().zip(&self.w).fold(Wide::from(*limit), |rest, (&x, &w)| rest - Wide::from(x) * w)
    }

    /// False where the row contradicts the active ones, `None` where that cannot be told.
    fn enter(&mut self, half: Half<NV>) -> Option<bool> {
        let mut multiplier = Wide::ZERO;
        loop {
            let r = double_double::solve(&self.gram(), &self.products(&half.0))?;
            let z = self.remainder(&half.0, &r);
            let square = z.iter().fold(Wide::ZERO, |sum, &x| sum + x * x);
            let missing = self.missing(&half);
            let full = (square.value() > DEPENDENT && self.active.len() < NV).then(|| missing / square);
            let blocking = (0..r.len()).filter(|&k| r[k].value() > 1e-20).map(|k| (k, self.multipliers[k] / r[k]));
            let partial = blocking.min_by(|a, b| a.1.value().total_cmp(&b.1.value()));
            let (step, leaving) = match (partial, full) {
                (Some((k, partial)), Some(full)) if partial.value() < full.value() => (partial, Some(k)),
                (_, Some(full)) => (full, None),
                (Some((k, partial)), None) => (partial, Some(k)),
                (None, None) => return self.contradicts(&half, &r, &z),
            };
            self.multipliers.iter_mut().zip(&r).for_each(|(multiplier, &r)| *multiplier = *multiplier - step * r);
            multiplier = multiplier + step;
            if full.is_some() {
                self.w.iter_mut().zip(&z).for_each(|(w, &z)| *w = *w + step * z);
            }
            match leaving {
                Some(k) => {
                    self.active.remove(k);
                    self.multipliers.remove(k);
                }
                None => {
                    self.active.push(half);
                    self.multipliers.push(multiplier);
                    return Some(true);
                }
            }
        }
    }

    /// Whether there is a solution all the same is not known where the normals do not cancel well enough.
    fn contradicts(&self, half: &Half<NV>, r: &[Wide], z: &[Wide; NV]) -> Option<bool> {
        let limits = self.active.iter().zip(r);
        let contradiction = limits.fold(Wide::from(half.1), |sum, ((_, limit), &r)| sum - Wide::from(*limit) * r);
        let scale = self.active.iter().fold(half.1.abs(), |scale, (_, limit)| scale.max(limit.abs()));
        let length = z.iter().map(|x| x.value() * x.value()).sum::<f64>().sqrt();
        (contradiction.value() > 0.0 && length * 1e3 * scale <= contradiction.value()).then_some(false)
    }

    fn gram(&self) -> Vec<Vec<Wide>> {
        self.active.iter().map(|(normal, _)| self.products(normal)).collect()
    }

    fn products(&self, normal: &[f64; NV]) -> Vec<Wide> {
        self.active.iter().map(|(other, _)| double_double::dot(other, normal)).collect()
    }

    fn remainder(&self, normal: &[f64; NV], r: &[Wide]) -> [Wide; NV] {
        let mut z = normal.map(Wide::from);
        for ((other, _), &r) in self.active.iter().zip(r) {
            z.iter_mut().zip(other).for_each(|(z, &x)| *z = *z - r * Wide::from(x));
        }
        z
    }
}

/// Rows within 1e-11 rad of the span of others depend on them.
const DEPENDENT: f64 = 1e-22;

impl Verdicts {
    fn compare<const NV: usize>(&mut self, problem: &Problem<NV>, w: &[f64; NV], truth: &[f64]) {
        let far = truth.iter().fold(0.0, |far: f64, x| far.max(x.abs()));
        let apart = w.iter().zip(truth).fold(0.0, |apart: f64, (a, b)| apart.max((a - b).abs()));
        let difference = if far > 0.0 { apart / far } else { apart };
        self.worst = self.worst.max(difference);
        if difference <= AGREE {
            self.solved += 1;
        } else {
            self.wrong.push(format!("off by {difference:e}: {problem:?}"));
        }
    }
}

/// A row at a small angle, the same one, or the opposite one.
fn neighbour<const NV: usize>(normal: &[f64; NV], random: &mut Random) -> [f64; NV] {
    match random.below(4) {
        0 => *normal,
        1 => normal.map(|x| -x),
        _ => {
            let (angle, other) = (random.magnitude(1e-5, 0.1), unit::<NV>(random));
            normalised(std::array::from_fn(|k| normal[k] + angle * other[k]))
        }
    }
}

/// Three rows, the last in the span of the others, that leave `room` on one side of `inside`, or contradict each other by it.
fn squeezed<const NV: usize>(inside: &[f64; NV], room: f64, random: &mut Random) -> [([f64; NV], f64, f64); 3] {
    let (a, b) = (unit::<NV>(random), unit::<NV>(random));
    let (share, rest) = (random.between(0.2, 0.8), random.between(0.2, 0.8));
    let sum: [f64; NV] = std::array::from_fn(|k| -(share * a[k] + rest * b[k]));
    let length = dot(&sum, &sum).sqrt();
    let c = sum.map(|x| x / length);
    let lower = |normal: &[f64; NV], room: f64| dot(normal, inside) - room;
    [(a, lower(&a, room), f64::INFINITY), (b, lower(&b, room), f64::INFINITY), (c, lower(&c, room), f64::INFINITY)]
}

fn unit<const NV: usize>(random: &mut Random) -> [f64; NV] {
    let direction = random.direction(NV.min(8));
    // The rejection that `direction` does takes for ever in many dimensions.
    let mut entries: [f64; NV] = std::array::from_fn(|k| if k < 8 { direction[k] } else { 0.0 });
    entries.iter_mut().skip(8).for_each(|entry| *entry = 0.4 * random.between(-1.0, 1.0));
    normalised(entries)
}

fn normalised<const NV: usize>(v: [f64; NV]) -> [f64; NV] {
    let length = dot(&v, &v).sqrt();
    v.map(|x| x / length)
}

fn dot<const NV: usize>(a: &[f64; NV], b: &[f64; NV]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn size(limit: f64) -> f64 {
    if limit.is_finite() { limit.abs() } else { 0.0 }
}
