//! A polyhedron of parameters that rows are added to and taken from again, and whether anything is left of it.

use nalgebra::{DMatrix, DVector};

use crate::optim::lp;
use dpc_runtime::solver::{Outcome, Row, Rows, Solver, WorkingSet};

/// {p : |p_k| <= 1, a . p <= limit of every row}, in at most `D` dimensions. Rows have unit length.
pub struct Region<const D: usize> {
    dimension: usize,
    rows: Vec<([f64; D], f64)>,
    /// Rows that no p of the box satisfies.
    impossible: usize,
    solver: Box<Solver<D>>,
    limits: Vec<f64>,
    /// How often it took a solver to tell.
    pub questions: usize,
    /// Whether it once could not.
    lost: bool,
    /// No region was left out that a ball of this radius fits into.
    pub thickest: f64,
}

/// Where the region was left off.
#[derive(Debug, Clone, Copy)]
pub struct Mark {
    rows: usize,
    impossible: usize,
}

/// A ball inside, as far as rounding allows.
#[derive(Debug, Clone, Copy)]
pub struct Ball<const D: usize> {
    pub centre: [f64; D],
    pub radius: f64,
}

/// A region counts as empty only with a proof that no ball of this radius fits into it.
pub const THIN: f64 = 1e-7;

/// Coefficients below this, relative to the numbers they were made from, are rounding errors.
const NOISE: f64 = 1e-12;

/// Changes of the working set of one question, per dimension: more make no statement.
const BUDGET: usize = 20;

/// Where there is no proof for that radius, radii ten times larger are tried, so many in all.
const LEVELS: i32 = 3;

impl<const D: usize> Region<D> {
    /// Where there is no row yet.
    pub const NOWHERE: Mark = Mark { rows: 0, impossible: 0 };

    /// The box.
    pub fn new(dimension: usize) -> Self {
        let axis = |k: usize, sign: f64| (std::array::from_fn(|j| if j == k { sign } else { 0.0 }), 1.0);
        let rows = (0..dimension).flat_map(|k| [axis(k, 1.0), axis(k, -1.0)]).collect();
        Self {
            dimension,
            rows,
            impossible: 0,
            solver: Box::new(Solver::NEW),
            limits: Vec::new(),
            questions: 0,
            lost: false,
            thickest: THIN,
        }
    }

    /// Takes rows away that the others imply, but for the box.
    pub fn simplify(&mut self) {
        let centre = Ball { centre: [0.0; D], radius: 0.0 };
        for r in (2 * self.dimension..self.rows.len()).rev() {
            let (normal, limit) = self.rows[r];
            self.rows[r] = (normal.map(|entry| -entry), -limit);
            match self.shrunk(&centre, THIN) {
                Answer::Empty => drop(self.rows.remove(r)),
                _ => self.rows[r] = (normal, limit),
            }
        }
    }

    /// Whether some region could neither be proved empty nor shown not to be.
    pub fn is_lost(&self) -> bool {
        self.lost
    }

    pub fn mark(&self) -> Mark {
        Mark { rows: self.rows.len(), impossible: self.impossible }
    }

    /// Takes the rows since `mark` away.
    pub fn back(&mut self, mark: Mark) {
        self.rows.truncate(mark.rows);
        self.impossible = mark.impossible;
    }

    /// Adds constant + slope . p >= 0, computed from numbers of magnitude `size`.
    pub fn add(&mut self, constant: f64, slope: &[f64], size: f64) {
        let reach: f64 = slope.iter().map(|s| s.abs()).sum();
        let noise = NOISE * size;
        if constant >= reach - noise {
            return;
        }
        if constant + reach < -noise {
            self.impossible += 1;
            return;
        }
        let norm = slope.iter().map(|s| s * s).sum::<f64>().sqrt();
        let normal = std::array::from_fn(|k| slope.get(k).map_or(0.0, |s| -s / norm));
        self.rows.push((normal, constant / norm));
    }

    /// A ball in the region; `None` where it is proved that none of radius [`THIN`] fits in. `known` is in the region but for the
    /// rows since `mark`.
    pub fn probe(&mut self, known: &Ball<D>, mark: Mark) -> Option<Ball<D>> {
        if self.impossible > 0 {
            return None;
        }
        let room = self.room(&known.centre, mark.rows).min(known.radius);
        if room >= THIN {
            return Some(Ball { centre: known.centre, radius: room });
        }
        self.questions += 1;
        for level in 0..LEVELS {
            let radius = THIN * 10_f64.powi(level);
            let answer = match self.shrunk(known, radius) {
                Answer::Unknown => self.by_program(radius),
                answer => answer,
            };
            match answer {
                Answer::Point(ball) => return Some(ball),
                Answer::Empty => {
                    self.thickest = self.thickest.max(radius);
                    return None;
                }
                Answer::Unknown => {}
            }
        }
        self.lost = true;
        Some(Ball { centre: known.centre, radius: 0.0 })
    }

    /// The same by a linear program for the widest ball: slower, but where one of them fails the other often does not.
    fn by_program(&self, radius: f64) -> Answer<D> {
        let (d, rows) = (self.dimension, self.rows.len());
        let A = DMatrix::from_fn(d + 1, rows, |k, r| if k < d { self.rows[r].0[k] } else { 1.0 });
        let c = DVector::from_fn(rows, |r, _| self.rows[r].1);
        // Of the balls that are as wide, one that lies to one side: without a preference all pivots are degenerate.
        let b =
            DVector::from_fn(
                d + 1,
                |k, _| if k == d { 1.0 } else { radius * 0.01 * (1.0 + k as f64 / d as f64) / d as f64 },
            );
        let lp::Outcome::Optimal(solution) = lp::minimise(&c, &A, &b) else { return Answer::Unknown };
        if self.bound(&solution.y) < radius {
            return Answer::Empty;
        }
        let centre = std::array::from_fn(|k| if k < d { solution.x[k] } else { 0.0 });
        let ball = Ball { centre, radius: self.room(&centre, 0) };
        if ball.radius >= 0.5 * THIN { Answer::Point(ball) } else { Answer::Unknown }
    }

    /// An upper bound of the radius of a ball inside, whatever y >= 0 is: with a . p + radius <= limit for all rows, radius times
    /// the sum of y is at most y . limits less the sum of y a . p, and |p_k| <= 1.
    fn bound(&self, y: &DVector<f64>) -> f64 {
        let (mut sum, mut limits) = ([0.0; D], 0.0);
        for ((normal, limit), y) in self.rows.iter().zip(y) {
            sum.iter_mut().zip(normal).for_each(|(sum, entry)| *sum += y * entry);
            limits += y * limit;
        }
        (limits + sum.iter().map(|entry| entry.abs()).sum::<f64>()) / y.sum()
    }

    /// The widest ball that bisection finds; `None` where there is none of radius `than`.
    pub fn widest(&mut self, known: &Ball<D>, than: f64) -> Option<Ball<D>> {
        let (mut low, mut high) = (than, 1.0);
        let mut best = self.shrunk(known, low).ball()?;
        for _ in 0..14 {
            let middle = (low * high).sqrt();
            match self.shrunk(known, middle).ball() {
                Some(ball) => (best, low) = (ball, middle),
                None => high = middle,
            }
        }
        Some(best)
    }

    fn shrunk(&mut self, known: &Ball<D>, radius: f64) -> Answer<D> {
        self.limits.clear();
        self.limits.extend(self.rows.iter().map(|(normal, limit)| limit - dot(normal, &known.centre) - radius));
        let around = Around { rows: &self.rows, limits: &self.limits };
        let outcome = self.solver.solve(&around, &WorkingSet::EMPTY, BUDGET * (self.dimension + 1));
        match outcome {
            Outcome::Optimal { .. } => {
                let centre = std::array::from_fn(|k| known.centre[k] + self.solver.w()[k]);
                let ball = Ball { centre, radius: self.room(&centre, 0) };
                if ball.radius >= 0.5 * radius { Answer::Point(ball) } else { Answer::Unknown }
            }
            Outcome::Infeasible { .. } if self.is_refuted() => Answer::Empty,
            _ => Answer::Unknown,
        }
    }

    /// Farkas: a sum of rows, each times a non-negative weight, reads 0 <= something negative, by more than what is left of its
    /// normal amounts to on the box.
    fn is_refuted(&self) -> bool {
        let (mut sum, mut limit, mut size) = ([0.0; D], 0.0, 0.0);
        for (row, _, weight) in self.solver.certificate() {
            let (Some((normal, _)), Some(own)) = (self.rows.get(row), self.limits.get(row)) else { return false };
            sum.iter_mut().zip(normal).for_each(|(sum, entry)| *sum += weight * entry);
            limit += weight * own;
            size += weight * (own.abs() + 1.0);
        }
        let left: f64 = sum.iter().map(|entry| entry.abs()).sum();
        // From a point inside the box no coordinate is farther than 2.
        limit + 2.0 * left < -1e-14 * size
    }

    /// The smallest distance from a row, of those from `first` on.
    fn room(&self, centre: &[f64; D], first: usize) -> f64 {
        let rows = self.rows.get(first..).unwrap_or_default().iter();
        rows.map(|(normal, limit)| limit - dot(normal, centre)).fold(f64::INFINITY, f64::min)
    }
}

enum Answer<const D: usize> {
    Point(Ball<D>),
    Empty,
    Unknown,
}

impl<const D: usize> Answer<D> {
    fn ball(self) -> Option<Ball<D>> {
        match self {
            Self::Point(ball) => Some(ball),
            Self::Empty | Self::Unknown => None,
        }
    }
}

/// The rows as seen from a point.
struct Around<'a, const D: usize> {
    rows: &'a [([f64; D], f64)],
    limits: &'a [f64],
}

impl<const D: usize> Rows<D> for Around<'_, D> {
    fn iter(&self) -> impl Iterator<Item = Row<'_>> {
        let rows = self.rows.iter().zip(self.limits);
        rows.map(|((normal, _), upper)| Row { normal, lower: f64::NEG_INFINITY, upper: *upper, scale: 1.0 })
    }

    fn get(&self, index: usize) -> Option<Row<'_>> {
        let ((normal, _), upper) = (self.rows.get(index)?, *self.limits.get(index)?);
        Some(Row { normal, lower: f64::NEG_INFINITY, upper, scale: 1.0 })
    }

    fn normal(&self, index: usize) -> &[f64] {
        self.rows.get(index).map_or(&[0.0; D], |(normal, _)| normal)
    }
}

fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
