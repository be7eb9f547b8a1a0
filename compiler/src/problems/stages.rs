//! T with v = T w and T'HT = I as a simulation, by the Riccati recursion.

use nalgebra::DMatrix;

use crate::gains::SubsystemGains;
use crate::network::Subsystem;

/// (34) is |root^-1 dx_0|^2 + the sum over k of |spread_k^-1 (du_k - gain_k dx_k)|^2. So dx_0 = root w_x and
/// du_k = gain_k dx_k + spread_k w_k make it |w|^2, and w_k acts on nothing before stage k.
pub struct Stages {
    pub T: DMatrix<f64>,
    pub root: DMatrix<f64>,
    pub stages: Vec<Stage>,
}

/// Stage k: the simulation, and what bounds xhat_k and uhat_k.
#[derive(Debug, Clone)]
pub struct Stage {
    /// A + B gain and B spread: from dx_k and w_k to dx_{k+1}.
    pub next: DMatrix<f64>,
    pub drive: DMatrix<f64>,
    pub gain: DMatrix<f64>,
    /// Upper triangular.
    pub spread: DMatrix<f64>,
    pub x: Vec<Bound>,
    pub u: Vec<Bound>,
}

/// low <= entry <= high, which is row `row` of the problem divided by `unit`.
#[derive(Debug, Clone, Copy)]
pub struct Bound {
    pub low: f64,
    pub high: f64,
    pub unit: f64,
    pub row: usize,
}

/// No row of the problem.
pub const NO_ROW: usize = u16::MAX as usize;

impl Stages {
    /// `None` where a stage's Hessian is not positive definite in double precision.
    pub fn new(s: &Subsystem, g: &SubsystemGains, N: usize) -> Option<Self> {
        let mut P = g.P.clone();
        let mut stages = Vec::new();
        for _ in 0..N {
            let (stage, before) = Stage::before(s, &P)?;
            stages.push(stage);
            P = before;
        }
        stages.reverse();
        let root = inverse_root(&P)?;
        Some(Self { T: simulated(s, &root, &stages), root, stages })
    }
}

impl Stage {
    /// The stage whose end has the cost matrix `P`, and the cost matrix at its beginning.
    fn before(s: &Subsystem, P: &DMatrix<f64>) -> Option<(Self, DMatrix<f64>)> {
        let PB = P * &s.B;
        let curvature = &s.R + s.B.tr_mul(&PB);
        let gain = -curvature.clone().cholesky()?.solve(&(PB.transpose() * &s.A));
        let closed = &s.A + &s.B * &gain;
        let before = &s.Q + gain.transpose() * &s.R * &gain + closed.transpose() * P * &closed;
        let free = |count: usize| vec![Bound::NONE; count];
        let spread = inverse_root(&curvature)?;
        let stage = Self { next: closed, drive: &s.B * &spread, gain, spread, x: free(s.n()), u: free(s.m()) };
        Some((stage, (&before + before.transpose()) * 0.5))
    }
}

impl Stage {
    /// Forgets the bounds.
    pub fn unbounded(&mut self) {
        self.x.iter_mut().chain(&mut self.u).for_each(|bound| *bound = Bound::NONE);
    }
}

impl Bound {
    const NONE: Self = Self { low: f64::NEG_INFINITY, high: f64::INFINITY, unit: 0.0, row: NO_ROW };
}

/// L^-T of L L'.
fn inverse_root(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let L = matrix.clone().cholesky()?.l();
    L.solve_lower_triangular(&DMatrix::identity(L.nrows(), L.nrows())).map(|inverse| inverse.transpose())
}

/// The columns of T: what each entry of w does alone.
fn simulated(s: &Subsystem, root: &DMatrix<f64>, stages: &[Stage]) -> DMatrix<f64> {
    let (n, m) = (s.n(), s.m());
    let count = n + stages.len() * m;
    let mut T = DMatrix::zeros(count, count);
    let mut dx = DMatrix::zeros(n, count);
    dx.columns_mut(0, n).copy_from(root);
    T.rows_mut(0, n).copy_from(&dx);
    for (k, stage) in stages.iter().enumerate() {
        let mut du = &stage.gain * &dx;
        let mut own = du.columns_mut(n + k * m, m);
        own += &stage.spread;
        T.rows_mut(n + k * m, m).copy_from(&du);
        let mut end = &stage.next * &dx;
        let mut own = end.columns_mut(n + k * m, m);
        own += &stage.drive;
        dx = end;
    }
    T
}
