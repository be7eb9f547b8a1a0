//! Decentralised feedback by linear matrix inequalities.
//!
//! Subsystems x_i+ = sum over j of A_ij x_j + B_ij u_j get u_i = K_i x_i, each from its own states only. With
//! S = diag(S_1, ..., S_M) and Y = diag(Y_1, ..., Y_M), K_i = Y_i S_i^-1,
//!
//! ```text
//! [ lambda^2 S     A S + B Y ]
//! [ (A S + B Y)'       S     ]  >  0
//! ```
//!
//! says that |x| = (x' S^-1 x)^1/2 shrinks by lambda in every step of F = A + B K (Boyd, El Ghaoui, Feron, Balakrishnan,
//! "Linear Matrix Inequalities in System and Control Theory", SIAM 1994, chapter 7). The rows and columns of
//! one subsystem are the same inequality for A_ii + B_ii K_i, so every subsystem alone shrinks by lambda as well: no
//! inequality of its own is needed. The structure of S costs generality: a stabilising K need not have one.
//!
//! Two programs use the inequality. [`Search::fastest`] bisects for the smallest lambda: for each, it maximises the margin mu
//! in `inequality >= mu I` under S <= I, a program that always has an answer, so that feasibility is the sign of a number
//! and not a verdict of the solver. The gains at that lambda are useless, near dead-beat and growing without bound.
//! [`Search::gains`] therefore takes a slower lambda and minimises, over all gains that keep it,
//!
//! ```text
//! trace(Q S) + trace(R Z)    subject to    [lambda^2 S - W, A S + B Y; ., S] >= 0,    [Z_i, Y_i; Y_i', S_i] >= 0
//! ```
//!
//! where Z bounds K S K': the cost of linear-quadratic regulation, for a covariance S that upsets of covariance W = Q^-1, equally
//! dear in all directions, keep up. It is what the local Riccati equations minimise, now for the whole network, so
//! the same weights serve; it bounds the gains, and W fixes the size of S. The gains do not depend on the size of W.
//!
//! Neither a margin nor an interior-point method is free of units, and S spreads over many orders of magnitude near the
//! smallest lambda. Both programs are therefore solved in coordinates of their own: inputs in which R_i is I, and states in
//! which S = I is a solution or nearly one - at first the covariance that the local regulators alone would have, then twice the S of
//! largest margin. Without that second step the solver gives up on one plant in two.
//!
//! [`Interconnection::shrinks`] checks gains in plain arithmetic by a Cholesky factorisation, before anybody believes them.
#![expect(non_snake_case, reason = "the symbols of the literature")]

use std::collections::BTreeMap;

use nalgebra::{Cholesky, DMatrix, DVector};

use super::conic::{Answer, Form};
use super::lyapunov::{lyapunov, spectral_radius};
use super::riccati::lqr;
use super::semidefinite::{AffineMatrix, SemidefiniteProgram};

/// Subsystems that act on each other through states and inputs.
#[derive(Debug, Clone)]
pub struct Interconnection {
    /// A_ij, n_i x n_j; absent where zero. Every A_ii is present.
    pub A: BTreeMap<(usize, usize), DMatrix<f64>>,
    /// B_ij, n_i x m_j; absent where zero. Every B_ii is present.
    pub B: BTreeMap<(usize, usize), DMatrix<f64>>,
}

/// What one subsystem pays for its states and inputs, Q_i and R_i, both positive definite.
#[derive(Debug, Clone)]
pub struct Price {
    pub Q: DMatrix<f64>,
    pub R: DMatrix<f64>,
}

/// Gains with the proof of their rate.
#[derive(Debug, Clone)]
pub struct Feedback {
    /// K_i, m_i x n_i.
    pub K: Vec<DMatrix<f64>>,
    /// S_i: F S F' <= rate^2 S with S = diag(S_i).
    pub S: Vec<DMatrix<f64>>,
    /// lambda.
    pub rate: f64,
}

/// The search for gains of one interconnection, in coordinates of its own.
#[derive(Debug)]
pub struct Search<'a> {
    given: &'a Interconnection,
    prices: &'a [Price],
    coordinates: Vec<Coordinates>,
    /// In the coordinates, as all below.
    plant: Interconnection,
    /// A - I, by blocks.
    steps: BTreeMap<(usize, usize), DMatrix<f64>>,
    layout: Layout,
    /// What one step of the slowest local regulator decays by: the unit of decay, see [`Search::inequality`].
    pace: f64,
}

/// The smallest rate that the inequality has a solution for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fastest {
    /// Below 1.
    Decays(f64),
    /// Above 1: no block-diagonal S proves stability, and the number says by how much.
    Grows(f64),
    /// No decay faster than to this rate, the slowest that is looked for.
    Slow(f64),
}

/// x_i = T xi, u_i = V v, T lower triangular.
#[derive(Debug)]
struct Coordinates {
    T: DMatrix<f64>,
    V: DMatrix<f64>,
    /// Q_i in xi.
    Q: DMatrix<f64>,
    /// W_i = Q_i^-1 in xi.
    W: DMatrix<f64>,
}

impl Coordinates {
    /// In which the covariance of the local regulator, with the loop F, is I.
    fn new(F: &DMatrix<f64>, price: &Price) -> Option<Self> {
        let W = Cholesky::new(price.Q.clone())?.inverse();
        let T = Cholesky::new(lyapunov(&F.transpose(), &W)?)?.l();
        Self::with(T, price)
    }

    fn with(T: DMatrix<f64>, price: &Price) -> Option<Self> {
        let V = if price.R.is_empty() {
            price.R.clone()
        } else {
            Cholesky::new(price.R.clone())?.l().transpose().try_inverse()?
        };
        let Q = T.tr_mul(&price.Q) * &T;
        let W = Cholesky::new((&Q + Q.transpose()) * 0.5)?.inverse();
        Some(Self { Q, W, T, V })
    }
}

/// The loop that the local regulator closes; `None` where there is none.
fn regulated(A: &DMatrix<f64>, B: &DMatrix<f64>, price: &Price) -> Option<DMatrix<f64>> {
    if B.ncols() == 0 { Some(A.clone()) } else { Some(A + B * lqr(A, B, &price.Q, &price.R)?) }
}

/// The answer with the largest margin.
struct Centre {
    mu: f64,
    S: Vec<DMatrix<f64>>,
}

impl<'a> Search<'a> {
    /// `None` where a subsystem cannot be stabilised by its own inputs: then no gains exist at all.
    pub fn new(plant: &'a Interconnection, prices: &'a [Price]) -> Option<Self> {
        let (mut coordinates, mut pace) = (Vec::new(), 1.0_f64);
        for (i, price) in prices.iter().enumerate() {
            let F = regulated(&plant.A[&(i, i)], &plant.B[&(i, i)], price)?;
            pace = pace.min(1.0 - spectral_radius(&F));
            coordinates.push(Coordinates::new(&F, price)?);
        }
        Self::within(plant, prices, coordinates, pace.max(SLOWEST_PACE))
    }

    fn within(
        given: &'a Interconnection,
        prices: &'a [Price],
        coordinates: Vec<Coordinates>,
        pace: f64,
    ) -> Option<Self> {
        let into = |i: usize, block: DMatrix<f64>| coordinates[i].T.solve_lower_triangular(&block);
        let A = given.A.iter().map(|(&(i, j), A)| Some(((i, j), into(i, A * &coordinates[j].T)?)));
        let B = given.B.iter().map(|(&(i, j), B)| Some(((i, j), into(i, B * &coordinates[j].V)?)));
        let plant = Interconnection { A: A.collect::<Option<_>>()?, B: B.collect::<Option<_>>()? };
        let step = |(&(i, j), A): (&(usize, usize), &DMatrix<f64>)| {
            // In the coordinates of before, so that nothing cancels.
            let own = if i == j {
                &given.A[&(i, i)] - DMatrix::identity(A.nrows(), A.nrows())
            } else {
                given.A[&(i, j)].clone()
            };
            Some(((i, j), into(i, own * &coordinates[j].T)?))
        };
        let steps = plant.A.iter().map(step).collect::<Option<_>>()?;
        Some(Self { layout: Layout::new(&plant), given, prices, coordinates, plant, steps, pace })
    }

    /// The smallest lambda for which the inequality has a solution with a margin, which keeps S from degenerating: the gains
    /// beyond it are the ones nobody wants. |1 - lambda| is good to half a percent.
    ///
    /// `None` where even large lambda have none that the solver finds.
    pub fn fastest(&self) -> Option<Fastest> {
        let wide = |search: &Self, rate: f64| search.centre(rate).is_some_and(|centre| centre.mu > MARGIN);
        let settled = |rate: f64| wide(self, rate);
        // |1 - lambda| on a logarithmic scale, and relative to what the subsystems do alone.
        let slow = |t: f64| 1.0 - self.pace * 10.0_f64.powf(-t);
        let fast = |t: f64| 1.0 + self.pace * 10.0_f64.powf(t - SLOWEST);
        let slowest = slow(SLOWEST);
        // Whether there is any decay at all shall not depend on where the coordinates come from.
        if settled(slowest) || self.centred(slowest).is_some_and(|search| wide(&search, slowest)) {
            return Some(Fastest::Decays(slow(bisect(self.pace.log10(), SLOWEST, |t| settled(slow(t))))));
        }
        let decades = (SLOWEST + 4.0 - self.pace.log10()).ceil() as i32;
        let decade = (0..=decades).map(f64::from).find(|&t| settled(fast(t)))?;
        Some(match decade {
            0.0 => Fastest::Slow(slowest),
            _ => Fastest::Grows(fast(bisect(decade - 1.0, decade, |t| settled(fast(t))))),
        })
    }

    /// The cheapest gains with rate lambda.
    ///
    /// `None` where there are none, or the solver does not find them.
    pub fn gains(&self, rate: f64) -> Option<Feedback> {
        self.centred(rate)?.centred(rate)?.cheapest(rate)
    }

    /// The search in coordinates in which the S of largest margin is I.
    fn centred(&self, rate: f64) -> Option<Self> {
        let Centre { S, .. } = self.centre(rate)?;
        let turned = S.into_iter().zip(&self.coordinates).zip(self.prices);
        let turned = turned.map(|((S, now), price)| Coordinates::with(&now.T * Cholesky::new(S)?.l(), price));
        Self::within(self.given, self.prices, turned.collect::<Option<_>>()?, self.pace)
    }

    fn cheapest(&self, rate: f64) -> Option<Feedback> {
        let mut program = SemidefiniteProgram::default();
        let n = self.layout.n as f64;
        let unit = self.coordinates.iter().map(|c| c.Q.trace()).sum::<f64>() / n;
        let price = |i: usize, a: usize, b: usize| self.coordinates[i].Q[(a, b)] / unit;
        let variables = Variables::new(&self.layout, &mut program, price);
        let mut inequality = self.inequality(&variables, rate);
        self.add_upsets(&mut inequality, self.centre(rate)?.mu);
        program.constraints.push(inequality);
        for (i, _) in self.layout.inputs.iter().enumerate().filter(|(_, m)| **m > 0) {
            let bound = variables.input_bound(i, 1.0 / unit, &mut program);
            program.constraints.push(bound);
        }
        let Answer::Point(x) = program.solve() else { return None };
        self.feedback(rate, &variables.S(&x), &variables.Y(&x))
    }

    /// - W, of the size that S = I can bear with margin mu, and a hundredth of I where W says nothing.
    fn add_upsets(&self, inequality: &mut AffineMatrix, mu: f64) {
        let total: f64 = self.coordinates.iter().map(|c| c.W.trace()).sum();
        for (Coordinates { W, .. }, x) in self.coordinates.iter().zip(&self.layout.x) {
            let W =
                W * (0.5 * mu * self.layout.n as f64 / total) + DMatrix::identity(W.nrows(), W.nrows()) * (0.01 * mu);
            for (a, b) in (0..W.nrows()).flat_map(|b| (0..=b).map(move |a| (a, b))) {
                inequality.add(x + a, x + b, &Form::new([], -W[(a, b)]));
            }
        }
    }

    /// K = V (Y S^-1) T^-1 and T S T', in the coordinates of the plant.
    fn feedback(&self, rate: f64, S: &[DMatrix<f64>], Y: &[DMatrix<f64>]) -> Option<Feedback> {
        let (mut gains, mut covariances) = (Vec::new(), Vec::new());
        for ((S, Y), Coordinates { T, V, .. }) in S.iter().zip(Y).zip(&self.coordinates) {
            let turned = Cholesky::new(S.clone())?.solve(&Y.transpose());
            let K = V * T.tr_solve_lower_triangular(&turned)?.transpose();
            gains.push(K.iter().all(|k| k.is_finite()).then_some(K)?);
            covariances.push(T * S * T.transpose());
        }
        Some(Feedback { K: gains, S: covariances, rate })
    }

    /// The largest mu with `inequality >= mu I` and S <= I, where the solver finds it.
    fn centre(&self, rate: f64) -> Option<Centre> {
        let mut program = SemidefiniteProgram::default();
        let variables = Variables::new(&self.layout, &mut program, |_, _, _| 0.0);
        let mu = program.variable(-1.0);
        let mut inequality = self.inequality(&variables, rate);
        (0..2 * self.layout.n).for_each(|k| inequality.add(k, k, &Form::new([(mu, -1.0)], 0.0)));
        program.constraints.push(inequality);
        (0..self.plant.len()).for_each(|i| program.constraints.push(variables.at_most_one(i)));
        match program.solve() {
            Answer::Point(x) => Some(Centre { mu: x[mu], S: variables.S(&x) }),
            _ => None,
        }
    }

    /// [lambda^2 S, F S; (F S)', S], F S = A S + B Y, in the form that slow plants need. With X = F S - S, which is as small as a step is
    /// short, and the congruence [I, -I; 0, I] followed by diag(I / sqrt(pace), I) it is
    ///
    /// ```text
    /// [ -(X + X' + (1 - lambda^2) S) / pace     X / sqrt(pace) ]
    /// [             .                                 S        ]
    /// ```
    fn inequality(&self, variables: &Variables, rate: f64) -> AffineMatrix {
        let Layout { sizes, x, n, .. } = &self.layout;
        let (pace, root) = (self.pace, self.pace.sqrt());
        let mut matrix = AffineMatrix::new(2 * n);
        for (i, x) in x.iter().enumerate() {
            for (a, b, s) in variables.entries(i) {
                matrix.add(x + a, x + b, &Form::new([(s, -(1.0 - rate * rate) / pace)], 0.0));
                matrix.add(n + x + a, n + x + b, &Form::new([(s, 1.0)], 0.0));
            }
        }
        let mut product = |blocks: &BTreeMap<(usize, usize), DMatrix<f64>>,
                           factor: &dyn Fn(usize, usize, usize) -> usize| {
            for (&(i, j), block) in blocks {
                for (a, b) in (0..block.nrows()).flat_map(|a| (0..sizes[j]).map(move |b| (a, b))) {
                    let terms = (0..block.ncols()).map(|c| (factor(j, c, b), block[(a, c)]));
                    let form = Form::new(terms.filter(|(_, value)| *value != 0.0), 0.0);
                    if !form.terms.is_empty() {
                        let (row, column) = (x[i] + a, x[j] + b);
                        // An entry of the symmetric matrix X + X' is met from both sides of its diagonal, one of the diagonal once.
                        let twice = if row == column { 2.0 } else { 1.0 };
                        matrix.add(row, column, &form.times(-twice / pace));
                        matrix.add(row, n + column, &form.times(1.0 / root));
                    }
                }
            }
        };
        product(&self.steps, &|j, c, b| variables.s(j, c, b));
        product(&self.plant.B, &|j, c, b| variables.y(j, c, b));
        matrix
    }
}

impl Interconnection {
    /// Number of subsystems.
    pub fn len(&self) -> usize {
        self.A.keys().map(|&(i, _)| i + 1).max().unwrap_or(0)
    }

    pub fn is_empty(&self) -> bool {
        self.A.is_empty()
    }

    /// Whether F S F' <= rate^2 S holds for F = A + B diag(K_i), by a Cholesky factorisation with a margin that rounding cannot
    /// use up.
    pub fn shrinks(&self, K: &[DMatrix<f64>], S: &[DMatrix<f64>], rate: f64) -> bool {
        let F = self.closed_loop(K);
        let whole = block_diagonal(S);
        let decrease = &whole * (rate * rate) - &F * &whole * F.transpose();
        // The products of n terms each err by n ulps of their size; a diagonal that much smaller pays for it.
        let n = F.nrows() as f64;
        let size = F.abs() * whole.abs() * F.abs().transpose();
        let slack = DVector::from_fn(F.nrows(), |i, _| 4.0 * n * n * f64::EPSILON * (size[(i, i)] + whole[(i, i)]));
        Cholesky::new((&decrease + decrease.transpose()) * 0.5 - DMatrix::from_diagonal(&slack)).is_some()
            && Cholesky::new(whole).is_some()
    }

    /// A + B diag(K_i).
    pub fn closed_loop(&self, K: &[DMatrix<f64>]) -> DMatrix<f64> {
        let layout = Layout::new(self);
        let mut F = DMatrix::zeros(layout.n, layout.n);
        for (&(i, j), A) in &self.A {
            let mut block = F.view_mut((layout.x[i], layout.x[j]), A.shape());
            block += A;
        }
        for (&(i, j), B) in &self.B {
            let BK = B * &K[j];
            let mut block = F.view_mut((layout.x[i], layout.x[j]), BK.shape());
            block += BK;
        }
        F
    }
}

/// Margins below this are the solver's noise: S <= I fixes the scale, and answers are good to about 1e-8.
const MARGIN: f64 = 1e-6;

/// A decay of 10^-SLOWEST of the pace is the slowest that counts as one.
const SLOWEST: f64 = 4.0;

/// Slower local regulators than this are at the edge of stability.
const SLOWEST_PACE: f64 = 1e-9;

/// The place where `holds` begins to, between `no` and `yes`, on the side where it does.
fn bisect(mut no: f64, mut yes: f64, holds: impl Fn(f64) -> bool) -> f64 {
    while yes - no > 2e-3 {
        let middle = 0.5 * (no + yes);
        *(if holds(middle) { &mut yes } else { &mut no }) = middle;
    }
    yes
}

fn block_diagonal(blocks: &[DMatrix<f64>]) -> DMatrix<f64> {
    let n = blocks.iter().map(|block| block.nrows()).sum();
    let (mut whole, mut at) = (DMatrix::zeros(n, n), 0);
    for block in blocks {
        whole.view_mut((at, at), block.shape()).copy_from(block);
        at += block.nrows();
    }
    whole
}

/// Sizes and first rows of the subsystems.
#[derive(Debug)]
struct Layout {
    sizes: Vec<usize>,
    inputs: Vec<usize>,
    x: Vec<usize>,
    n: usize,
}

impl Layout {
    fn new(plant: &Interconnection) -> Self {
        let count = plant.len();
        let sizes: Vec<_> = (0..count).map(|i| plant.A[&(i, i)].nrows()).collect();
        let inputs = (0..count).map(|i| plant.B[&(i, i)].ncols()).collect();
        let x = sizes.iter().scan(0, |next, size| Some(std::mem::replace(next, *next + size))).collect();
        Self { n: sizes.iter().sum(), sizes, inputs, x }
    }
}

/// Places of S_i (upper triangles) and Y_i among the variables.
struct Variables {
    S: Vec<(usize, usize)>,
    Y: Vec<(usize, usize, usize)>,
}

impl Variables {
    /// `price(i, a, b)` is the cost of entry (a, b) of the symmetric matrix S_i.
    fn new(layout: &Layout, program: &mut SemidefiniteProgram, price: impl Fn(usize, usize, usize) -> f64) -> Self {
        let mut S = Vec::new();
        for (i, &n) in layout.sizes.iter().enumerate() {
            S.push((program.cost.len(), n));
            for (a, b) in (0..n).flat_map(|b| (0..=b).map(move |a| (a, b))) {
                program.variable(if a == b { price(i, a, a) } else { price(i, a, b) + price(i, b, a) });
            }
        }
        let mut Y = Vec::new();
        for (&n, &m) in layout.sizes.iter().zip(&layout.inputs) {
            Y.push((program.cost.len(), m, n));
            program.cost.resize(program.cost.len() + m * n, 0.0);
        }
        Self { S, Y }
    }

    fn s(&self, i: usize, a: usize, b: usize) -> usize {
        let (low, high) = (a.min(b), a.max(b));
        self.S[i].0 + high * (high + 1) / 2 + low
    }

    fn y(&self, i: usize, a: usize, b: usize) -> usize {
        let (first, m, _) = self.Y[i];
        first + b * m + a
    }

    /// (a, b, variable) of the upper triangle of S_i.
    fn entries(&self, i: usize) -> impl Iterator<Item = (usize, usize, usize)> + '_ {
        let n = self.S[i].1;
        (0..n).flat_map(move |b| (0..=b).map(move |a| (a, b, self.s(i, a, b))))
    }

    /// I - S_i.
    fn at_most_one(&self, i: usize) -> AffineMatrix {
        let mut matrix = AffineMatrix::new(self.S[i].1);
        for (a, b, s) in self.entries(i) {
            matrix.add(a, b, &Form::new([(s, -1.0)], f64::from(a == b)));
        }
        matrix
    }

    /// [Z_i, Y_i; Y_i', S_i] with new variables Z_i of price I.
    fn input_bound(&self, i: usize, price: f64, program: &mut SemidefiniteProgram) -> AffineMatrix {
        let (_, m, n) = self.Y[i];
        let mut matrix = AffineMatrix::new(m + n);
        for (a, b) in (0..m).flat_map(|b| (0..=b).map(move |a| (a, b))) {
            let z = program.variable(if a == b { price } else { 0.0 });
            matrix.add(a, b, &Form::new([(z, 1.0)], 0.0));
        }
        for (a, b) in (0..m).flat_map(|a| (0..n).map(move |b| (a, b))) {
            matrix.add(a, m + b, &Form::new([(self.y(i, a, b), 1.0)], 0.0));
        }
        for (a, b, s) in self.entries(i) {
            matrix.add(m + a, m + b, &Form::new([(s, 1.0)], 0.0));
        }
        matrix
    }

    fn S(&self, x: &[f64]) -> Vec<DMatrix<f64>> {
        let one = |i: usize, n: usize| DMatrix::from_fn(n, n, |a, b| x[self.s(i, a, b)]);
        self.S.iter().enumerate().map(|(i, &(_, n))| one(i, n)).collect()
    }

    fn Y(&self, x: &[f64]) -> Vec<DMatrix<f64>> {
        let one = |i: usize, m: usize, n: usize| DMatrix::from_fn(m, n, |a, b| x[self.y(i, a, b)]);
        self.Y.iter().enumerate().map(|(i, &(_, m, n))| one(i, m, n)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scalar(value: f64) -> DMatrix<f64> {
        DMatrix::from_element(1, 1, value)
    }

    /// Two scalars without inputs: A = [a c; c a].
    fn pair(a: f64, c: f64) -> Interconnection {
        let none = DMatrix::zeros(1, 0);
        let entries = [((0, 0), a), ((0, 1), c), ((1, 0), c), ((1, 1), a)];
        Interconnection {
            A: entries.map(|(place, value)| (place, scalar(value))).into(),
            B: entries.map(|(place, _)| (place, none.clone())).into(),
        }
    }

    fn free() -> [Price; 2] {
        [(); 2].map(|()| Price { Q: scalar(1.0), R: DMatrix::zeros(0, 0) })
    }

    fn fastest(plant: &Interconnection, prices: &[Price]) -> f64 {
        match Search::new(plant, prices).and_then(|search| search.fastest()) {
            Some(Fastest::Decays(rate) | Fastest::Grows(rate)) => rate,
            other => panic!("{other:?}"),
        }
    }

    /// A symmetric matrix contracts in Euclid's norm by its radius, and in no norm by less.
    #[test]
    fn the_fastest_rate_of_a_symmetric_matrix_is_its_radius() {
        for (a, c, radius) in [(0.5, 0.3, 0.8), (0.2, -0.7, 0.9), (0.9, 0.3, 1.2), (0.95, 0.049, 0.999)] {
            let (plant, prices) = (pair(a, c), free());
            let rate = fastest(&plant, &prices);
            assert!(
                rate >= radius - 1e-6 && (rate - radius).abs() <= 0.006 * (1.0_f64 - radius).abs(),
                "{rate} {radius}"
            );
        }
    }

    /// With S = diag(s, 1), s large, a one-way coupling disappears; how large s may be is bounded by the margin.
    #[test]
    fn one_way_couplings_do_no_harm() {
        let mut plant = pair(0.5, 0.0);
        plant.A.insert((0, 1), scalar(20.0));
        let prices = free();
        let rate = fastest(&plant, &prices);
        assert!((0.5..0.6).contains(&rate), "{rate}");
    }

    fn double_integrator() -> (Interconnection, [Price; 1]) {
        let A = DMatrix::from_row_slice(2, 2, &[1.0, 0.1, 0.0, 1.0]);
        let B = DMatrix::from_row_slice(2, 1, &[0.005, 0.1]);
        let Q = DMatrix::from_diagonal(&DVector::from_vec(vec![3.0, 0.5]));
        (Interconnection { A: [((0, 0), A)].into(), B: [((0, 0), B)].into() }, [Price { Q, R: scalar(0.2) }])
    }

    /// Without a rate to keep, one subsystem's cheapest gain is that of its Riccati equation, whatever W.
    #[test]
    fn the_cheapest_gain_of_one_subsystem_is_the_regulator() {
        let (plant, prices) = double_integrator();
        let found = Search::new(&plant, &prices).unwrap().gains(0.9999).unwrap();
        let K = lqr(&plant.A[&(0, 0)], &plant.B[&(0, 0)], &prices[0].Q, &prices[0].R).unwrap();
        assert!((&found.K[0] - &K).norm() < 2e-2 * K.norm(), "{} {K}", found.K[0]);
    }

    #[test]
    fn faster_rates_are_kept_and_cost_gain() {
        let (plant, prices) = double_integrator();
        let search = Search::new(&plant, &prices).unwrap();
        let mut last = 0.0;
        for rate in [0.9, 0.7, 0.5, 0.3] {
            let found = search.gains(rate).unwrap();
            assert!(plant.shrinks(&found.K, &found.S, rate));
            let radius = spectral_radius(&plant.closed_loop(&found.K));
            assert!(radius <= rate && found.K[0].norm() > last, "{radius}");
            last = found.K[0].norm();
            assert!(!plant.shrinks(&found.K, &found.S, 0.9 * radius), "a rate below the radius was believed");
        }
    }

    #[test]
    fn what_no_input_moves_has_no_search() {
        let (plant, prices) = (pair(1.1, 0.0), free());
        assert!(Search::new(&plant, &prices).is_none());
    }
}
