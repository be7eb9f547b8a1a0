//! Sums over the powers of a sparse matrix, several rows at a time.
#![expect(non_snake_case, reason = "the symbols of the literature")]

use nalgebra::{DMatrix, DVector};

use super::RateNorm;
use crate::optim::sparse::Sparse;

/// Rows that travel together.
pub const LANES: usize = 4;
type Lanes = [f64; LANES];

/// What is summed along the powers: sum over the blocks i of the dual norm of x_i B_i.
#[derive(Debug, Clone)]
pub struct Charge {
    B: Vec<DMatrix<f64>>,
    norm: RateNorm,
    /// For every state j a bound of the sum over k of |e_j' F^k B|_1.
    later: DVector<f64>,
    /// |F| later + later: what the rounding of one step weighs.
    rounding: DVector<f64>,
}

/// F in blocks.
#[derive(Debug, Clone)]
pub struct Front {
    F: Sparse,
    abs_F: Sparse,
    /// First state of each block, and the number of all at the end.
    starts: Vec<usize>,
    /// Blocks that the rows of each block reach in one step.
    reached: Vec<Vec<usize>>,
    /// Relative error of an entry of a product.
    unit: f64,
}

/// How much a sum may be charged above its value.
#[derive(Debug, Clone, Copy)]
pub struct Care {
    /// What the tail may be, relative to the sum.
    tail: f64,
    /// What a part of the row may still add that is dropped, relative to the sum.
    dropped: f64,
    steps: usize,
}

impl Care {
    /// About 1e-7 in all, where modes are not slower than 0.999.
    pub const PROVED: Self = Self { tail: 1e-8, dropped: 5e-12, steps: 20_000 };
    /// About a percent.
    pub const ESTIMATED: Self = Self { tail: 1e-2, dropped: 1e-6, steps: 2_000 };
}

/// The rows on their way; what one sum leaves behind is cleared by the next.
pub struct Space {
    now: Vec<Lanes>,
    next: Vec<Lanes>,
    active: Vec<usize>,
    touched: Vec<usize>,
    is_touched: Vec<bool>,
}

impl Charge {
    /// `later` as in [`crate::optim::responses::Responses::to`] for the rows' 1-norms of B, which has one block of rows per block of
    /// the front.
    pub fn new(front: &Front, B: Vec<DMatrix<f64>>, norm: RateNorm, later: DVector<f64>) -> Self {
        let rounding = front.abs_F.times(&later) + &later;
        Self { B, norm, later, rounding }
    }

    pub fn later(&self) -> &DVector<f64> {
        &self.later
    }

    /// Dual norm of x_i B_i for each lane.
    fn of_block(&self, i: usize, x: &[Lanes]) -> Lanes {
        let mut support = [0.0; LANES];
        for column in self.B[i].column_iter() {
            let mut g = [0.0; LANES];
            for (x, b) in x.iter().zip(column.iter()).filter(|(_, b)| **b != 0.0) {
                (0..LANES).for_each(|l| g[l] += x[l] * b);
            }
            match self.norm {
                RateNorm::Inf => (0..LANES).for_each(|l| support[l] += g[l].abs()),
                RateNorm::Two => (0..LANES).for_each(|l| support[l] = support[l].hypot(g[l])),
                RateNorm::One => (0..LANES).for_each(|l| support[l] = support[l].max(g[l].abs())),
            }
        }
        support
    }
}

impl Front {
    pub fn new(F: Sparse, starts: Vec<usize>) -> Self {
        let count = starts.len() - 1;
        let mut owner = vec![0; F.nrows()];
        (0..count).for_each(|b| owner[starts[b]..starts[b + 1]].fill(b));
        let reached = (0..count).map(|b| {
            let columns = (starts[b]..starts[b + 1]).flat_map(|i| F.row(i)).map(|(j, _)| owner[*j]);
            columns.collect::<std::collections::BTreeSet<_>>().into_iter().collect()
        });
        let reached = reached.collect();
        let unit = 2.0 * (F.longest_row().max(F.longest_column()) + 8) as f64 * f64::EPSILON;
        Self { abs_F: F.map(f64::abs), F, starts, reached, unit }
    }

    pub fn matrix(&self) -> &Sparse {
        &self.F
    }

    pub fn abs(&self) -> &Sparse {
        &self.abs_F
    }

    /// Relative error of an entry of a row times F.
    pub fn unit(&self) -> f64 {
        self.unit
    }

    pub fn space(&self) -> Space {
        let size = self.F.nrows();
        Space {
            now: vec![[0.0; LANES]; size],
            next: vec![[0.0; LANES]; size],
            active: Vec::new(),
            touched: Vec::new(),
            is_touched: vec![false; self.starts.len() - 1],
        }
    }

    /// For each of at most [`LANES`] rows x an upper bound of the sum over k >= `first` of the charge of x F^k, `first` 0 or 1.
    /// What of a row hardly counts any more is dropped, and charged by all that could become of it.
    pub fn sums(&self, space: &mut Space, rows: &[&DVector<f64>], charge: &Charge, first: usize, care: Care) -> Lanes {
        self.load(space, rows);
        let (mut sum, mut lost, mut drift) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        let mut least = [0.0; LANES];
        for step in 0.. {
            let weights = Weights { least: least.map(|least: f64| least * care.dropped), charge };
            let Left { total, dropped, rounding } = self.drop_little(space, &weights);
            (0..LANES).for_each(|l| lost[l] += dropped[l]);
            if step == 0 {
                least = total.map(|total| 1e-3 * total);
            }
            let nothing = |l: usize| 1e-9 * least[l];
            let ends = |l: usize| total[l] <= (care.tail * sum[l]).max(nothing(l));
            if (0..LANES).all(ends) || step >= care.steps {
                (0..LANES).for_each(|l| lost[l] += total[l]);
                break;
            }
            if step >= first {
                // One number per step, so that as many roundings count as there are steps and blocks, not their product.
                let mut of_step = [0.0; LANES];
                for &i in &space.active {
                    let support = charge.of_block(i, &space.now[self.starts[i]..self.starts[i + 1]]);
                    (0..LANES).for_each(|l| of_step[l] += support[l]);
                }
                (0..LANES).for_each(|l| sum[l] += of_step[l]);
                (0..LANES).for_each(|l| least[l] = least[l].max(sum[l]));
            }
            (0..LANES).for_each(|l| drift[l] += rounding[l]);
            self.step(space);
        }
        let added = 1.0 + (care.steps + self.starts.len()) as f64 * f64::EPSILON;
        std::array::from_fn(|l| (sum[l] * added + lost[l] + self.unit * drift[l]) * INFLATE)
    }

    fn load(&self, space: &mut Space, rows: &[&DVector<f64>]) {
        let size = self.F.nrows();
        space.next.fill([0.0; LANES]);
        for j in 0..size {
            space.now[j] = std::array::from_fn(|l| rows.get(l).map_or(0.0, |row| row[j]));
        }
        space.active = (0..self.starts.len() - 1).collect();
    }

    /// Drops the blocks that weigh less than the least in every lane.
    fn drop_little(&self, space: &mut Space, weights: &Weights) -> Left {
        let mut left = Left::default();
        let Space { now, active, .. } = space;
        active.retain(|&i| {
            let states = self.starts[i]..self.starts[i + 1];
            let (weight, rounding) = weights.of(&now[states.clone()], states.clone());
            let is_little = (0..LANES).all(|l| weight[l] <= weights.least[l]);
            if is_little {
                now[states].fill([0.0; LANES]);
                (0..LANES).for_each(|l| left.dropped[l] += weight[l]);
            } else {
                (0..LANES).for_each(|l| {
                    left.total[l] += weight[l];
                    left.rounding[l] += rounding[l];
                });
            }
            !is_little
        });
        left
    }

    /// now = now F.
    fn step(&self, space: &mut Space) {
        let Space { now, next, active, touched, is_touched } = space;
        for &i in active.iter() {
            for (j, x) in (self.starts[i]..).zip(&mut now[self.starts[i]..self.starts[i + 1]]) {
                let x = std::mem::take(x);
                for &(column, value) in self.F.row(j) {
                    (0..LANES).for_each(|l| next[column][l] += x[l] * value);
                }
            }
            for &other in &self.reached[i] {
                if !std::mem::replace(&mut is_touched[other], true) {
                    touched.push(other);
                }
            }
        }
        touched.iter().for_each(|&i| is_touched[i] = false);
        active.clear();
        std::mem::swap(active, touched);
        std::mem::swap(now, next);
    }
}

/// Covers the rounding of the bounds themselves.
const INFLATE: f64 = 1.0 + 1e-9;

struct Weights<'a> {
    least: Lanes,
    charge: &'a Charge,
}

impl Weights<'_> {
    /// What can become of the states of one block, and of their rounding.
    fn of(&self, x: &[Lanes], states: std::ops::Range<usize>) -> (Lanes, Lanes) {
        let (mut weight, mut rounding) = ([0.0; LANES], [0.0; LANES]);
        for (x, j) in x.iter().zip(states) {
            let (later, rounded) = (self.charge.later[j], self.charge.rounding[j]);
            for l in 0..LANES {
                weight[l] += x[l].abs() * later;
                rounding[l] += x[l].abs() * rounded;
            }
        }
        (weight, rounding)
    }
}

#[derive(Default)]
struct Left {
    total: Lanes,
    dropped: Lanes,
    rounding: Lanes,
}
