//! Every "after this point" sentence of a design, from its matrices and sets alone: no proof of the compiler is used.
#![expect(non_snake_case, reason = "the paper's symbols")]

use dpc_codegen::design::Design;
use dpc_codegen::network::{Network, Norm, Subsystem};
use dpc_codegen::sizing::SubsystemSizing;
use nalgebra::{DMatrix, DVector, RowDVector};

use crate::Random;
use crate::exposed::Taken;
use crate::load_shares::LoadShares;
use crate::random_network::Plant;
use crate::strips::SymmetricSet;
use crate::unknowns::Unknowns;

/// One inequality of the paper, as this module finds it.
#[derive(Debug, Clone)]
pub struct Claim {
    /// Equation or assumption, and where.
    pub what: String,
    /// Right side minus left side over the size of the right side: what is below [`EXACT`] is broken.
    pub slack: f64,
}

/// The supports are exact to about 1e-12, so this is rounding and nothing else.
pub const EXACT: f64 = -1e-9;

/// Support values come from a dual simplex method and from long sums; they are exact to this.
const AGREE: f64 = 1e-9;

/// What the design may at worst charge for Delta^chi above the sum itself: its bound of its own rounding grows with slow
/// and oblique modes. It is safe, and mostly far less: see [`Claim::overcharge`].
const CHARGE: f64 = 1.0;
const CHARGED_ONCE: &str = "Delta^chi charged once";
const LOADS_ONCE: &str = "loads charged once";

impl Claim {
    pub fn holds(&self) -> bool {
        self.slack >= EXACT
    }

    /// By how much a support value of Delta^chi or of the loads is charged above its sum, relative, where this claim is
    /// about that.
    pub fn overcharge(&self) -> Option<f64> {
        [CHARGED_ONCE, LOADS_ONCE].iter().any(|what| self.what.ends_with(what)).then_some(CHARGE - self.slack)
    }
}

/// All claims about `design`.
pub fn claims(design: &Design) -> Vec<Claim> {
    let mut checker = Checker { design, model: Collective::new(design), claims: Vec::new() };
    checker.assumptions();
    let rates = Rates::new(&checker.model, design.network.reference.norm);
    let rates = rates.and_then(|rates| Some((rates, LoadShares::new(&checker.model, &design.network)?)));
    for i in 0..design.network.subsystems.len() {
        checker.gains(i);
        match (Sets::new(design, i), &rates) {
            (Some(sets), Some((rates, loads))) => {
                checker.subsystem(i, &sets, rates, loads);
                let exposed = Taken::new(design, i, &checker.model, rates, loads).claims();
                checker.claims.extend(exposed);
            }
            _ => checker.claim(i, "E_i and Sigma_i are bounded and have an interior, calF is Schur", -1.0),
        }
    }
    if let Some((rates, loads)) = &rates {
        checker.coupling(rates, loads);
    }
    checker.recorded();
    checker.claims
}

/// The claims that do not hold.
pub fn broken(design: &Design) -> Vec<Claim> {
    claims(design).into_iter().filter(|claim| !claim.holds()).collect()
}

/// Largest difference between what the text means and what the network says: collective matrices and unknowns, relative.
pub fn lowering_error(plant: &Plant, network: &Network) -> f64 {
    let model = Lowered::new(network);
    let pairs = [(&plant.A, &model.A), (&plant.B, &model.B), (&plant.C, &model.C)];
    let matrices = pairs.into_iter().map(|(one, other)| (one - other).amax() / one.amax()).fold(0.0, f64::max);
    let random = &mut Random(1);
    let unknowns = plant.parts.iter().zip(&network.subsystems);
    unknowns.map(|(part, s)| part.unknowns.difference(&Unknowns::of(s), random)).fold(matrices, f64::max)
}

/// The collective (A, B, C) of (5).
pub struct Lowered {
    pub A: DMatrix<f64>,
    pub B: DMatrix<f64>,
    pub C: DMatrix<f64>,
    /// First entries of the subsystems, and the total.
    pub x: Vec<usize>,
    pub u: Vec<usize>,
    pub y: Vec<usize>,
}

impl Lowered {
    pub fn new(network: &Network) -> Self {
        let parts = &network.subsystems;
        let [x, u, y] = [starts(parts, Subsystem::n), starts(parts, Subsystem::m), starts(parts, Subsystem::p)];
        let total = |starts: &[usize]| starts[parts.len()];
        let (mut A, mut B) = (DMatrix::zeros(total(&x), total(&x)), DMatrix::zeros(total(&x), total(&u)));
        let mut C = DMatrix::zeros(total(&y), total(&x));
        for (i, s) in parts.iter().enumerate() {
            put(&mut A, x[i], x[i], &s.A);
            put(&mut B, x[i], u[i], &s.B);
            put(&mut C, y[i], x[i], &s.C);
            for (&j, L) in &s.L {
                put(&mut A, x[i], x[j], &(&s.E * L * &parts[j].Cz));
                put(&mut B, x[i], u[j], &(&s.E * L * &parts[j].Dz));
            }
        }
        Self { A, B, C, x, u, y }
    }
}

fn starts(parts: &[Subsystem], size: impl Fn(&Subsystem) -> usize) -> Vec<usize> {
    let mut starts = vec![0];
    parts.iter().for_each(|s| starts.push(starts[starts.len() - 1] + size(s)));
    starts
}

fn put(whole: &mut DMatrix<f64>, r: usize, c: usize, part: &DMatrix<f64>) {
    whole.view_mut((r, c), part.shape()).copy_from(part);
}

/// The reference system (7) of the whole network, its states ordered (x_1, ..., x_M, e_1, ..., e_M).
pub struct Collective {
    A: DMatrix<f64>,
    B: DMatrix<f64>,
    C: DMatrix<f64>,
    K: DMatrix<f64>,
    /// [K^x K^e] over (x, e).
    calK: DMatrix<f64>,
    calF: DMatrix<f64>,
    calG: DMatrix<f64>,
    x: Vec<usize>,
    u: Vec<usize>,
    y: Vec<usize>,
}

impl Collective {
    pub fn new(design: &Design) -> Self {
        let Lowered { A, B, C, x, u, y } = Lowered::new(&design.network);
        let (n, m, p) = (A.nrows(), B.ncols(), C.nrows());
        let (mut K, mut calK) = (DMatrix::zeros(m, n), DMatrix::zeros(m, n + p));
        for (i, g) in design.gains.subsystems.iter().enumerate() {
            put(&mut K, u[i], x[i], &g.K);
            put(&mut calK, u[i], x[i], &g.Kx);
            put(&mut calK, u[i], n + y[i], &g.Ke);
        }
        let mut calF = DMatrix::identity(n + p, n + p);
        put(&mut calF, 0, 0, &A);
        put(&mut calF, n, 0, &-&C);
        let moved = calF.rows(0, n) + &B * &calK;
        put(&mut calF, 0, 0, &moved);
        let mut calG = DMatrix::zeros(n + p, p);
        put(&mut calG, n, 0, &DMatrix::identity(p, p));
        Self { A, B, C, K, calK, calF, calG, x, u, y }
    }

    /// (x, e) at rest under constant y: (9).
    pub fn steady(&self) -> Option<DMatrix<f64>> {
        let n = self.calF.nrows();
        (DMatrix::identity(n, n) - &self.calF).full_piv_lu().solve(&self.calG)
    }

    pub fn calF(&self) -> &DMatrix<f64> {
        &self.calF
    }

    pub fn calG(&self) -> &DMatrix<f64> {
        &self.calG
    }

    /// A matrix over x_i as one over (x, e).
    pub fn on_chi(&self, i: usize, M: &DMatrix<f64>) -> DMatrix<f64> {
        let mut whole = DMatrix::zeros(self.calF.nrows(), M.ncols());
        put(&mut whole, self.x[i], 0, M);
        whole
    }

    /// A row over x_i as a row over (x, e).
    pub fn on_x(&self, i: usize, row: &RowDVector<f64>) -> DVector<f64> {
        let mut d = DVector::zeros(self.calF.nrows());
        d.rows_mut(self.x[i], row.len()).copy_from(&row.transpose());
        d
    }

    /// A row over u_i as a row over (x, e), through the gain (7f).
    pub fn on_u(&self, i: usize, row: &RowDVector<f64>) -> DVector<f64> {
        let mut whole = DVector::zeros(self.calK.nrows());
        whole.rows_mut(self.u[i], row.len()).copy_from(&row.transpose());
        self.calK.tr_mul(&whole)
    }
}

/// Whether powers of F vanish, by repeated squaring.
pub fn is_schur(F: &DMatrix<f64>) -> bool {
    let mut power = F.clone();
    for _ in 0..60 {
        let size = power.norm();
        if size < 0.5 || !size.is_finite() || size > 1e100 {
            return size < 0.5;
        }
        power = &power * &power;
    }
    false
}

/// Support sums of Delta^chi, (12), per unit of epsilon, and the steady states (9).
pub struct Rates {
    calF: DMatrix<f64>,
    /// -(I - calF)^-1 calF calG
    W: DMatrix<f64>,
    steady: DMatrix<f64>,
    /// First output of each subsystem.
    y: Vec<usize>,
    norm: Norm,
}

impl Rates {
    /// `None` where calF is not Schur.
    pub fn new(model: &Collective, norm: Norm) -> Option<Self> {
        let steady = model.steady().filter(|_| is_schur(&model.calF))?;
        // (I - F)^-1 F G = (I - F)^-1 G - G.
        let W = &model.calG - &steady;
        Some(Self { calF: model.calF.clone(), W, steady, y: model.y.clone(), norm })
    }

    /// Sum over k of the support of calF^k W prod B_q in direction d, until nothing is added any more.
    pub fn support(&self, d: &DVector<f64>) -> f64 {
        let (mut row, mut sum, mut quiet) = (d.clone(), 0.0, 0);
        for _ in 0..3_000_000 {
            let term = self.ball_support(&self.W.tr_mul(&row));
            sum += term;
            quiet = if term <= 1e-16 * sum { quiet + 1 } else { 0 };
            if quiet > 50 {
                break;
            }
            row = self.calF.tr_mul(&row);
        }
        sum
    }

    fn ball_support(&self, g: &DVector<f64>) -> f64 {
        let block = |pair: &[usize]| {
            let part = g.rows(pair[0], pair[1] - pair[0]);
            match self.norm {
                Norm::One => part.amax(),
                Norm::Two => part.norm(),
                Norm::Inf => part.iter().map(|g| g.abs()).sum(),
            }
        };
        self.y.windows(2).map(block).sum()
    }

    /// The row d on the steady state, over the collective y.
    pub fn steady_direction(&self, d: &DVector<f64>) -> DVector<f64> {
        self.steady.tr_mul(d)
    }

    /// Support in direction d of the steady states over the product of the Y_j.
    fn steady_support(&self, design: &Design, d: &DVector<f64>) -> f64 {
        let ends = design.sizing.subsystems.iter().flat_map(|s| s.Y.max.iter().zip(&s.Y.min));
        self.steady_direction(d).iter().zip(ends).map(|(g, (max, min))| (g * max).max(g * min)).sum()
    }
}

/// E_i and Sigma_i with their supports.
struct Sets {
    E: SymmetricSet,
    Sigma: SymmetricSet,
}

impl Sets {
    fn new(design: &Design, i: usize) -> Option<Self> {
        let sized = &design.sizing.subsystems[i];
        Some(Self {
            E: SymmetricSet::new(&sized.E.P, &sized.E.q)?,
            Sigma: SymmetricSet::new(&sized.Sigma.P, &sized.Sigma.q)?,
        })
    }
}

/// Proved upper bound of d'x, infinite where primal and dual do not meet.
fn support(set: &SymmetricSet, d: &DVector<f64>) -> f64 {
    let support = set.support(d);
    if support.proved - support.attained <= AGREE * support.proved { support.proved } else { f64::INFINITY }
}

fn supports(set: &SymmetricSet, D: &DMatrix<f64>) -> Vec<f64> {
    D.row_iter().map(|d| support(set, &d.transpose())).collect()
}

/// The largest value of every row of D, by what one row can be worth.
fn reaches(D: &DMatrix<f64>, reach: impl Fn(&DVector<f64>) -> f64) -> Vec<f64> {
    D.row_iter().map(|d| reach(&d.transpose())).collect()
}

struct Checker<'a> {
    design: &'a Design,
    model: Collective,
    claims: Vec<Claim>,
}

/// A row of X_i or U_i, and what the design says of it.
struct Charged {
    /// Over (x, e).
    d: DVector<f64>,
    rate: f64,
    load: f64,
    references: f64,
    terminal: f64,
    room: f64,
    h: f64,
}

impl Checker<'_> {
    fn claim(&mut self, i: usize, what: &str, slack: f64) {
        let what = format!("{}: {what}", self.design.network.subsystems[i].name);
        self.claims.push(Claim { what, slack: if slack.is_nan() { f64::NEG_INFINITY } else { slack } });
    }

    /// left <= right, relative to `scale`.
    fn at_most(&mut self, i: usize, what: &str, left: f64, right: f64, scale: f64) {
        self.claim(i, what, (right - left) / scale.abs().max(f64::MIN_POSITIVE));
    }

    fn yes(&mut self, i: usize, what: &str, holds: bool) {
        self.claim(i, what, if holds { 0.0 } else { -1.0 });
    }

    /// Assumptions 1 to 3 and epsilon, for the network as a whole.
    fn assumptions(&mut self) {
        let model = &self.model;
        let (n, m, p) = (model.A.nrows(), model.B.ncols(), model.C.nrows());
        let F = &model.A + &model.B * &model.K;
        let mut rosenbrock = DMatrix::zeros(n + p, n + m);
        put(&mut rosenbrock, 0, 0, &(DMatrix::identity(n, n) - &model.A));
        put(&mut rosenbrock, 0, n, &-&model.B);
        put(&mut rosenbrock, n, 0, &model.C);
        let singular = rosenbrock.singular_values();
        let full = singular.min() > 1e-13 * singular.max();
        let (schur, cal_schur) = (is_schur(&F), is_schur(&model.calF));
        let Design { network, sizing, .. } = self.design;
        let given = network.reference.epsilon.is_none_or(|epsilon| epsilon == sizing.epsilon);
        self.yes(0, "Assumption 1: A + BK is Schur", schur);
        self.yes(0, "Assumption 2: full rank", full);
        self.yes(0, "Assumption 3: calF is Schur", cal_schur);
        self.yes(0, "epsilon as given", given && sizing.epsilon > 0.0 && sizing.epsilon.is_finite());
    }

    /// F_ii Schur, (37), and the decrease of the cost that (37) is for.
    fn gains(&mut self, i: usize) {
        let (s, g) = (&self.design.network.subsystems[i], &self.design.gains.subsystems[i]);
        let F = &s.A + &s.B * &g.K;
        let stage = &s.Q + g.K.transpose() * &s.R * &g.K;
        let decrease = &g.P - F.transpose() * &g.P * &F;
        let terms = (F.transpose().abs() * g.P.abs() * F.abs()).amax() + g.P.amax();
        let residual = (&decrease - &stage).amax();
        let enough = (&decrease - &stage).symmetric_eigenvalues().min();
        let drift = (&F - &g.F).amax();
        self.yes(i, "Assumption 1: F_ii is Schur", is_schur(&F));
        self.at_most(i, "F_ii = A_ii + B_ii K_i", drift, 1e-12 * F.amax(), F.amax());
        // A little more than the equation says keeps the inequality that Theorem 1 needs through rounding.
        self.at_most(i, "(37) P_i solves the Lyapunov equation", residual, 2e-6 * stage.amax() + 1e-8 * terms, terms);
        self.at_most(i, "(37) P_i decreases by the stage cost", -1e-13 * terms, enough, stage.amax());
        self.yes(i, "P_i is positive definite", g.P.clone().cholesky().is_some());
    }

    fn subsystem(&mut self, i: usize, sets: &Sets, rates: &Rates, loads: &LoadShares) {
        self.tube(i, sets);
        self.measured(i);
        self.terminal(i, sets);
        self.tightened(i, sets);
        self.references(i, sets, rates, loads);
        self.wishes(i);
    }

    fn sized(&self, i: usize) -> (&Subsystem, &SubsystemSizing, DMatrix<f64>) {
        let (s, g) = (&self.design.network.subsystems[i], &self.design.gains.subsystems[i]);
        (s, &self.design.sizing.subsystems[i], g.K.clone())
    }

    /// (18') with W_i = E_i sum of L_ij Z_j + D_i + B_ii K_i V + M_i (d - dref) and what finite arithmetic adds, (21') with
    /// (22').
    fn tube(&mut self, i: usize, sets: &Sets) {
        let (s, sized, K) = self.sized(i);
        let F = &s.A + &s.B * &K;
        let mut disturbance = sized.E.P.abs() * &self.design.sets.subsystems[i].floor;
        for (&j, L) in &s.L {
            disturbance += (&sized.E.P * &s.E * L).abs() * &self.design.sizing.subsystems[j].zeta;
        }
        let (unknowns, steps) = (Unknowns::of(s), self.design.network.horizon - 1);
        let alone = |d: &DVector<f64>| {
            let through_gain = (&s.B * &K).tr_mul(d);
            unknowns.reach_of_w(d) + unknowns.reach_of_v(&through_gain) + unknowns.reach_of_lag(d, steps)
        };
        disturbance += DVector::from_vec(reaches(&sized.E.P, alone));
        let through_gain = reaches(&(&s.Dz * &K), |d| unknowns.reach_of_v(d));
        let moved = supports(&sets.E, &(&sized.E.P * &F));
        let z = supports(&sets.E, &(&s.Cz + &s.Dz * &K));
        let (q, zeta, dz) = (sized.E.q.clone(), sized.zeta.clone(), sized.dz.clone());
        for r in 0..q.len() {
            self.at_most(i, "(18) E_i is robustly invariant", moved[r] + disturbance[r], q[r], q[r]);
        }
        for k in 0..zeta.len() {
            self.at_most(i, "(21), (22)", z[k] + through_gain[k] + dz[k], zeta[k], zeta[k]);
            self.yes(i, "(21) Delta_i^z has an interior", dz[k] > 0.0);
        }
    }

    /// (35a') can hold at rest, whatever the measurement says.
    fn measured(&mut self, i: usize) {
        let (s, sized, _) = self.sized(i);
        let noise = reaches(&sized.E.P, |p| Unknowns::of(s).reach_of_v(p));
        for (noise, q) in noise.into_iter().zip(sized.E.q.clone().iter()) {
            self.at_most(i, "(35a') q is at least twice the error", 2.0 * noise, *q, *q);
        }
    }

    /// (24), (25a), and the half-axes of Sigma_i.
    fn terminal(&mut self, i: usize, sets: &Sets) {
        let (s, sized, K) = self.sized(i);
        let moved = supports(&sets.Sigma, &(&sized.Sigma.P * (&s.A + &s.B * &K)));
        let z = supports(&sets.Sigma, &(&s.Cz + &s.Dz * &K));
        let (q, dz, upset, P) = (sized.Sigma.q.clone(), sized.dz.clone(), sized.upset.clone(), sized.Sigma.P.clone());
        for r in 0..q.len() {
            self.at_most(i, "(24) Sigma_i is invariant", moved[r], q[r], q[r]);
        }
        for k in 0..dz.len() {
            self.at_most(i, "(25a)", z[k], dz[k], dz[k]);
        }
        for k in 0..upset.len() {
            let farthest = (0..q.len()).map(|r| P[(r, k)].abs() * upset[k] / q[r]).fold(0.0, f64::max);
            // The half-axes are a report, straight from the interior-point method.
            self.at_most(i, "half-axes of Sigma_i", farthest, 1.0 + 1e-6, 1.0);
            self.yes(i, "half-axes of Sigma_i", upset[k] > 0.0);
        }
    }

    /// Xhat_i in X_i - E_i, Uhat_i in U_i - K_i E_i - K_i V.
    fn tightened(&mut self, i: usize, sets: &Sets) {
        let (s, sized, K) = self.sized(i);
        let of_x = supports(&sets.E, &s.X.H);
        let of_u = supports(&sets.E, &(&s.U.H * &K));
        let noise = reaches(&(&s.U.H * K), |d| Unknowns::of(s).reach_of_v(d));
        let same = sized.X_nom.H == s.X.H && sized.U_nom.H == s.U.H;
        let x: Vec<_> = (0..of_x.len()).map(|r| (of_x[r] + sized.X_nom.h[r], s.X.h[r])).collect();
        let u: Vec<_> = (0..of_u.len()).map(|r| (of_u[r] + noise[r] + sized.U_nom.h[r], s.U.h[r])).collect();
        self.yes(i, "Xhat_i, Uhat_i have the rows of X_i, U_i", same);
        x.into_iter().for_each(|(left, right)| self.at_most(i, "Xhat_i in X_i - E_i", left, right, right));
        u.into_iter().for_each(|(left, right)| self.at_most(i, "Uhat_i in U_i - K_i E_i", left, right, right));
    }

    /// Delta^chi and loads as charged, and (25b).
    fn references(&mut self, i: usize, sets: &Sets, rates: &Rates, loads: &LoadShares) {
        let epsilon = self.design.sizing.epsilon;
        for Charged { d, rate, load, references, terminal, room, h } in self.charged(i, sets) {
            let (sum, share) = (rates.support(&d), loads.of(&d));
            let taken = rates.steady_support(self.design, &d) + epsilon * sum + share.bound();
            self.charge(i, sum, rate);
            self.loads(i, share.bound(), share.attained, load, h);
            self.at_most(i, "(25b) what references may take", taken, references, h);
            self.at_most(i, "(25b)", taken + terminal, room, h);
            self.at_most(i, "(25b) as charged", references + terminal, room, h);
        }
    }

    fn charged(&self, i: usize, sets: &Sets) -> Vec<Charged> {
        let (s, sized, K) = self.sized(i);
        let shapes = &self.design.sets.subsystems[i];
        let of_x = supports(&sets.Sigma, &s.X.H);
        let of_u = supports(&sets.Sigma, &(&s.U.H * K));
        let mut rows = Vec::new();
        for (r, row) in s.X.H.row_iter().enumerate() {
            let d = self.model.on_x(i, &row.into_owned());
            let (share, references) = (&shapes.x_rows[r], sized.x_ref[r]);
            let (terminal, room, h) = (of_x[r], sized.X_nom.h[r], s.X.h[r]);
            rows.push(Charged { d, rate: share.rate, load: share.load, references, terminal, room, h });
        }
        for (r, row) in s.U.H.row_iter().enumerate() {
            let d = self.model.on_u(i, &row.into_owned());
            let (share, references) = (&shapes.u_rows[r], sized.u_ref[r]);
            let (terminal, room, h) = (of_u[r], sized.U_nom.h[r], s.U.h[r]);
            rows.push(Charged { d, rate: share.rate, load: share.load, references, terminal, room, h });
        }
        rows
    }

    /// What is charged for loads is the smaller bound, hardly more, and more than what some loads really take. What is charged
    /// for rounding is safe, and counts beside the limit `h`.
    fn loads(&mut self, i: usize, bound: f64, attained: f64, charged: f64, h: f64) {
        let scale = bound.max(1e-9 * h);
        self.at_most(i, "loads charged in full", bound, charged * (1.0 + 1e-11), scale);
        self.at_most(i, "loads take no more than charged", attained, charged, scale);
        let scale = bound.max(1e-3 * h);
        self.at_most(i, LOADS_ONCE, charged, bound + scale * CHARGE, scale);
    }

    /// The design charges no less than the sum, and hardly more.
    fn charge(&mut self, i: usize, sum: f64, charged: f64) {
        self.at_most(i, "Delta^chi charged in full", sum, charged * (1.0 + 1e-11), sum);
        self.at_most(i, CHARGED_ONCE, charged, sum * (1.0 + CHARGE), sum);
    }

    /// 0 and the wanted set-points in Y_i, the wanted reserve in Delta_i^z.
    fn wishes(&mut self, i: usize) {
        let (s, sized, _) = self.sized(i);
        let covered = (0..s.p()).all(|k| {
            let (low, high) = s.cover[k].unwrap_or((0.0, 0.0));
            sized.Y.min[k] <= low && high <= sized.Y.max[k] && sized.Y.min[k] < sized.Y.max[k]
        });
        let symmetric = !self.design.network.wishes.symmetric || sized.Y.min == -&sized.Y.max;
        let reserved = sized.dz.iter().zip(&s.reserve).all(|(dz, reserve)| dz >= reserve);
        let finite = sized.Y.min.iter().chain(&sized.Y.max).chain(&sized.zeta).all(|v| v.is_finite());
        self.yes(i, "Y_i holds 0 and what was to be covered", covered);
        self.yes(i, "Y_i is symmetric where asked", symmetric);
        self.yes(i, "Delta_i^z holds the reserve", reserved);
        self.yes(i, "every size is finite", finite);
    }

    /// (26), and (4).
    fn coupling(&mut self, rates: &Rates, loads: &LoadShares) {
        let Design { network, sizing, sets, .. } = self.design;
        for (h, c) in network.coupling_constraints.iter().enumerate() {
            let (mut taken, mut by_loads) = (0.0, 0.0);
            let mut on_y = DVector::zeros(self.model.calF.nrows());
            for (&j, row) in &c.H {
                let s = &network.subsystems[j];
                let d = self.model.on_x(j, &(row.transpose() * &s.C));
                let sum = rates.support(&d);
                // Each member's share has a smaller bound of its own.
                by_loads += loads.of(&d).bound();
                on_y += d;
                taken += sizing.epsilon * sum + c.Hz[&j].abs().dot(&sizing.subsystems[j].zeta);
                let mismatch = (row.transpose() * &s.C - c.Hz[&j].transpose() * &s.Cz).amax();
                let direct = (c.Hz[&j].transpose() * &s.Dz).amax();
                self.charge(j, sum, sets.coupling[h][&j]);
                self.at_most(j, "(4)", mismatch.max(direct), 1e-12 * row.amax(), row.amax());
            }
            let share = loads.of(&on_y);
            self.loads(0, by_loads, share.attained, sets.coupling_loads[h], c.l);
            self.at_most(0, "loads leave no error", share.at_rest, 1e-9 * share.transient, c.l);
            self.at_most(0, "(26)", taken + by_loads + sizing.l_tilde[h], c.l, c.l);
            self.yes(0, "(26) leaves room", sizing.l_tilde[h] > 0.0);
        }
    }

    /// What the compiler recorded about itself.
    fn recorded(&mut self) {
        let slacks = &self.design.sizing.slacks;
        let fine = slacks.iter().all(|slack| slack.value >= 0.0 && slack.value.is_finite());
        let named = ["(18)", "(24)", "(31)"].iter().all(|name| slacks.iter().any(|slack| slack.equation == *name));
        self.yes(0, "every recorded slack is finite and not negative", fine && named);
    }
}
