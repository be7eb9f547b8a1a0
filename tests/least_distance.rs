//! Least-distance problems of any origin: for the runtime's solver, and solved a second time by other means.
#![expect(non_snake_case, reason = "the symbols of the literature")]

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};
use dpc_codegen::problems::{DpcProblem, RowKind};
use dpc_runtime::solver::{Row, Rows, Side, Solver};
use nalgebra::{DMatrix, DVector};

/// e and the references over the horizon: what an i-DPC problem depends on.
#[derive(Debug, Clone)]
pub struct Parameters {
    /// x_t - xref_t.
    pub e: DVector<f64>,
    pub x_ref: Vec<DVector<f64>>,
    pub u_ref: Vec<DVector<f64>>,
}

/// Rows lower <= normal . w <= upper, `NV` or fewer unknowns; what is left of `NV` has no part in any row.
#[derive(Debug, Clone)]
pub struct Instance<const NV: usize> {
    rows: Vec<([f64; NV], f64, f64, f64)>,
}

/// The truth about an instance, proved.
#[derive(Debug, Clone)]
pub enum Truth {
    /// The minimiser: the conditions of Karush, Kuhn and Tucker hold to rounding.
    Minimiser(DVector<f64>),
    /// Farkas: rows with these weights contradict each other.
    Infeasible,
    /// Neither was proved.
    Unknown,
}

impl<const NV: usize> Rows<NV> for Instance<NV> {
    fn iter(&self) -> impl Iterator<Item = Row<'_>> {
        self.rows.iter().map(|(normal, lower, upper, scale)| Row {
            normal: &normal[..],
            lower: *lower,
            upper: *upper,
            scale: *scale,
        })
    }
}

impl<const NV: usize> Instance<NV> {
    /// The rows of another problem.
    pub fn copy(rows: &impl Rows<NV>) -> Self {
        Self { rows: rows.iter().map(|row| (padded(row.normal), row.lower, row.upper, row.scale)).collect() }
    }

    /// The problem of a design, as the runtime's tables mean it.
    ///
    /// # Panics
    /// The problem has more than `NV` unknowns.
    pub fn new(problem: &DpcProblem, at: &Parameters) -> Self {
        assert!(problem.V.ncols() <= NV, "{} unknowns", problem.V.ncols());
        let row = |r: usize| {
            let normal = std::array::from_fn(|k| if k < problem.V.ncols() { problem.V[(r, k)] } else { 0.0 });
            let offset = offset(problem, r, at);
            let (lower, upper) = (problem.lower[r], problem.upper[r]);
            (normal, lower - offset, upper - offset, size(lower).max(size(upper)))
        };
        Self { rows: (0..problem.V.nrows()).map(row).collect() }
    }

    /// The same with other limits of the tube rows, on `offset . (e - dx_0)`.
    pub fn with_tube(mut self, problem: &DpcProblem, at: &Parameters, limits: &[(f64, f64)]) -> Self {
        for (r, (low, high)) in limits.iter().enumerate() {
            let offset = offset(problem, r, at);
            let (_, lower, upper, scale) = &mut self.rows[r];
            (*lower, *upper, *scale) = (low - offset, high - offset, size(*low).max(size(*high)));
        }
        self
    }

    /// Whether 0 satisfies every row: nothing is to be solved.
    pub fn rests(&self) -> bool {
        self.rows.iter().all(|(_, lower, upper, _)| *lower <= 0.0 && 0.0 <= *upper)
    }

    /// (normal, limit) of every finite side, as normal . w <= limit.
    fn halfspaces(&self) -> (DMatrix<f64>, DVector<f64>) {
        let mut sides: Vec<([f64; NV], f64)> = Vec::new();
        for (normal, lower, upper, _) in &self.rows {
            sides.push((*normal, *upper));
            sides.push((normal.map(|v| -v), -lower));
        }
        sides.retain(|(_, limit)| limit.is_finite());
        let A = DMatrix::from_fn(sides.len(), NV, |r, k| sides[r].0[k]);
        (A, DVector::from_fn(sides.len(), |r, _| sides[r].1))
    }

    /// Magnitude of the limits.
    pub fn scale(&self) -> f64 {
        self.rows
            .iter()
            .fold(0.0, |scale: f64, (_, lower, upper, own)| scale.max(*own).max(size(*lower)).max(size(*upper)))
    }

    /// Solves the problem by Clarabel and proves what it says: an active set is read off, and a few exchanges make its
    /// minimiser satisfy every condition. Where rows are nearly dependent, fewer rows are a better start.
    pub fn truth(&self) -> Truth {
        let (A, b) = self.halfspaces();
        let scale = self.scale().max(f64::MIN_POSITIVE);
        let Some((status, multipliers, slacks)) = interior_point(&A, &(&b / scale)) else { return Truth::Unknown };
        if matches!(status, SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible) {
            return if refutes(&A, &(&b / scale), &multipliers) { Truth::Infeasible } else { Truth::Unknown };
        }
        let guess = |share: f64| (0..b.len()).filter(|&r| multipliers[r] > share * slacks[r]).collect::<Vec<_>>();
        let guesses = [guess(1.0), guess(1e4), Vec::new()];
        let minimiser = guesses.into_iter().find_map(|active| polish(&A, &(&b / scale), active));
        minimiser.map_or(Truth::Unknown, |w| Truth::Minimiser(w * scale))
    }

    /// Whether the solver's certificate proves that there is no w of less than a thousand times the limits.
    pub fn refuted_by(&self, solver: &Solver<NV>) -> bool {
        let (mut sum, mut limits, mut weight) = (DVector::<f64>::zeros(NV), 0.0, 0.0);
        for (row, side, share) in solver.certificate() {
            let (normal, lower, upper, _) = &self.rows[row];
            let (sign, limit) = if side == Side::Lower { (1.0, *lower) } else { (-1.0, -upper) };
            sum += DVector::from_column_slice(normal) * (sign * share);
            limits += share * limit;
            weight += share * limit.abs();
        }
        limits > 1e-15 * weight && limits >= sum.norm() * 1e3 * self.scale()
    }

    /// Whether the solver's multipliers prove its w: not negative, on rows that hold with equality, and w their sum.
    pub fn proved_by(&self, solver: &Solver<NV>) -> bool {
        let w = DVector::from_column_slice(solver.w());
        let size = self.scale() + w.amax();
        let (mut sum, mut weight) = (DVector::<f64>::zeros(NV), 0.0);
        for (row, side, multiplier) in solver.multipliers() {
            let (normal, lower, upper, _) = &self.rows[row];
            let normal = DVector::from_column_slice(normal);
            let (sign, limit) = if side == Side::Lower { (1.0, *lower) } else { (-1.0, -upper) };
            if multiplier < 0.0 || (sign * normal.dot(&w) - limit).abs() > 1e-11 * size {
                return false;
            }
            sum += normal * (sign * multiplier);
            weight += multiplier;
        }
        (sum - &w).amax() <= 1e-14 * (weight + size)
            && self.violation(solver.w()) <= 1e-11 * (1.0 + w.amax() / self.scale())
    }

    /// Largest violation of a row at w, relative to the limits.
    pub fn violation(&self, w: &[f64; NV]) -> f64 {
        let (A, b) = self.halfspaces();
        (A * DVector::from_column_slice(w) - b).max() / self.scale()
    }
}

fn padded<const NV: usize>(normal: &[f64]) -> [f64; NV] {
    std::array::from_fn(|k| normal.get(k).copied().unwrap_or(0.0))
}

fn size(limit: f64) -> f64 {
    if limit.is_finite() { limit.abs() } else { 0.0 }
}

fn offset(problem: &DpcProblem, r: usize, at: &Parameters) -> f64 {
    let row = &problem.rows[r];
    match row.kind {
        RowKind::Tube => row.offset.dot(&at.e),
        RowKind::State(k) => row.offset.dot(&at.x_ref[k]),
        RowKind::Input(k) => row.offset.dot(&at.u_ref[k]),
        RowKind::CouplingOutput(_) | RowKind::Terminal => 0.0,
    }
}

/// Status, multipliers and slacks of A w <= b.
fn interior_point(A: &DMatrix<f64>, b: &DVector<f64>) -> Option<(SolverStatus, Vec<f64>, Vec<f64>)> {
    let rows: Vec<Vec<f64>> = A.row_iter().map(|row| row.iter().copied().collect()).collect();
    let n = A.ncols();
    let settings = DefaultSettings {
        verbose: false,
        tol_gap_abs: 1e-13,
        tol_gap_rel: 1e-13,
        tol_feas: 1e-12,
        max_iter: 200,
        ..DefaultSettings::default()
    };
    let cones = [SupportedConeT::NonnegativeConeT(b.len())];
    let (P, A) = (CscMatrix::identity(n), CscMatrix::from(&rows));
    let mut solver = DefaultSolver::new(&P, &vec![0.0; n], &A, b.as_slice(), &cones, settings).ok()?;
    solver.solve();
    Some((solver.solution.status, solver.solution.z.clone(), solver.solution.s.clone()))
}

/// Farkas: z >= 0, A'z = 0, b'z < 0, so that no w below a thousand satisfies A w <= b.
fn refutes(A: &DMatrix<f64>, b: &DVector<f64>, z: &[f64]) -> bool {
    let z = DVector::from_fn(z.len(), |r, _| z[r].max(0.0));
    let contradiction = -b.dot(&z);
    contradiction > 0.0 && A.tr_mul(&z).norm() * 1e3 <= contradiction
}

const EXCHANGES: usize = 60;
const EXACT: f64 = 1e-12;

/// The shortest w with A w <= b from a guess of its active rows.
fn polish(A: &DMatrix<f64>, b: &DVector<f64>, mut active: Vec<usize>) -> Option<DVector<f64>> {
    for _ in 0..EXCHANGES {
        let (w, multipliers) = on_rows(&A.select_rows(&active), &b.select_rows(&active))?;
        let negative = (0..active.len()).min_by(|&k, &l| multipliers[k].total_cmp(&multipliers[l]));
        if let Some(k) = negative.filter(|&k| multipliers[k] < -EXACT * multipliers.amax()) {
            active.remove(k);
            continue;
        }
        let excess = A * &w - b;
        let worst = excess.imax();
        if excess[worst] <= EXACT * (1.0 + w.amax()) {
            return Some(w);
        }
        if active.contains(&worst) {
            return None;
        }
        active.push(worst);
    }
    None
}

/// The shortest w with N w = b, and y with w = -N'y; `None` where the rows contradict each other or w is no
/// combination of theirs.
fn on_rows(N: &DMatrix<f64>, b: &DVector<f64>) -> Option<(DVector<f64>, DVector<f64>)> {
    if b.is_empty() {
        return Some((DVector::zeros(N.ncols()), DVector::zeros(0)));
    }
    let svd = N.clone().svd(true, true);
    let tolerance = 1e-10 * svd.singular_values.max();
    let mut w = svd.solve(b, tolerance).ok()?;
    let missing = b - N * &w;
    w += svd.solve(&missing, tolerance).ok()?;
    let y = N.transpose().svd(true, true).solve(&-&w, tolerance).ok()?;
    let consistent = (N * &w - b).amax() <= EXACT * (1.0 + b.amax());
    let combined = (N.tr_mul(&y) + &w).amax() <= EXACT * (1.0 + w.amax());
    (consistent && combined).then_some((w, y))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn instance(rows: &[([f64; 2], f64, f64)]) -> Instance<2> {
        Instance { rows: rows.iter().map(|(normal, lower, upper)| (*normal, *lower, *upper, 1.0)).collect() }
    }

    #[test]
    fn the_truth_about_a_corner() {
        let corner = instance(&[([1.0, 0.0], 1.0, 3.0), ([0.0, 1.0], 2.0, f64::INFINITY), ([0.6, 0.8], -9.0, 9.0)]);
        let Truth::Minimiser(w) = corner.truth() else { panic!("the corner is feasible") };
        assert!((w - DVector::from_vec(vec![1.0, 2.0])).amax() < 1e-13);
    }

    #[test]
    fn the_truth_about_a_contradiction() {
        let empty = instance(&[([1.0, 0.0], 1.0, 3.0), ([1.0, 0.0], -1.0, 0.5)]);
        assert!(matches!(empty.truth(), Truth::Infeasible));
    }
}
