//! The on-line problems, condensed to least-distance form, pruned and scaled.
#![expect(non_snake_case, reason = "the paper's symbols")]

mod condense;
mod prune;
mod reference;

use nalgebra::{DMatrix, DVector};

use crate::diagnostic::{Diagnostic, Diagnostics, code};
use crate::gains::{Gains, SubsystemGains};
use crate::network::{Network, Subsystem};
use crate::sets::noise_support;
use crate::sharing::spread;
use crate::sizing::{Sizing, SubsystemSizing};
use condense::Condensed;
pub use reference::ReferenceProblem;

/// After this point: every Hessian is positive definite, every entry finite, and no row is kept that no admissible
/// parameter can make active.
#[derive(Debug)]
pub struct Problems {
    pub subsystems: Vec<SubsystemProblems>,
}

#[derive(Debug)]
pub struct SubsystemProblems {
    pub dpc: DpcProblem,
    pub reference: ReferenceProblem,
}

/// (33)-(36) in v = (dx_0, du_0, ..., du_{N-1}), dx_k = xhat_k - xref_k, du_k = uhat_k - uref_k:
/// minimise 1/2 v'Hv subject to lower <= G v + offset(p) <= upper.
#[derive(Debug)]
pub struct DpcProblem {
    /// Hessian, NV x NV.
    pub H: DMatrix<f64>,
    /// L^-T of H = L L', upper triangular: v = T w.
    pub T: DMatrix<f64>,
    /// V = G T: the rows in w, each of unit length; NR x NV.
    pub V: DMatrix<f64>,
    /// Limits of the scaled rows; an absent side is infinite.
    pub lower: DVector<f64>,
    pub upper: DVector<f64>,
    /// How far the measurement error moves each tube row: h_V of (35a'), scaled as the row; zero where states are measured
    /// exactly.
    pub noise: DVector<f64>,
    /// What each row is; tube rows first, then state rows, input rows, and rows without offset.
    pub rows: Vec<Row>,
    /// Facets (one-sided inequalities) before and after pruning.
    pub facets_before: usize,
    pub facets_after: usize,
    /// Whether rows that can never become active were looked for.
    pub pruned: bool,
    /// The working-set budget of the on-line solver.
    pub max_iterations: usize,
}

#[derive(Debug, Clone)]
pub struct Row {
    pub kind: RowKind,
    /// In the user's names: `h1 <= 27.6 cm at step 2`.
    pub name: String,
    /// The scaled row of the offset: over e for tube rows, over xref_{t+k} or uref_{t+k} for state and input rows;
    /// empty for the others.
    pub offset: DVector<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowKind {
    /// (35a)
    Tube,
    /// (35c) at stage k
    State(usize),
    /// (35d) at stage k
    Input(usize),
    /// (35b) at stage k
    CouplingOutput(usize),
    /// (36)
    Terminal,
}

impl Problems {
    /// # Errors
    /// E0501 a Hessian is not positive definite in double precision, E0502 an entry is not finite, E0503 q = 1 with
    /// more outputs in one subsystem than its ball has facets for.
    pub fn new(network: &Network, gains: &Gains, sizing: &Sizing) -> Result<Self, Diagnostics> {
        let one = |i: usize| -> Result<SubsystemProblems, Diagnostic> {
            let (s, g, sized) = (&network.subsystems[i], &gains.subsystems[i], &sizing.subsystems[i]);
            let dpc = DpcProblem::new(s, g, sized, network)?;
            Ok(SubsystemProblems { dpc, reference: ReferenceProblem::new(network, i, sized)? })
        };
        let subsystems = spread(network.subsystems.len(), one).into_iter().collect::<Result<_, _>>()?;
        Ok(Self { subsystems })
    }
}

impl DpcProblem {
    fn new(s: &Subsystem, g: &SubsystemGains, sized: &SubsystemSizing, network: &Network) -> Result<Self, Diagnostic> {
        let N = network.horizon;
        let condensed = Condensed::new(s, g, sized, N);
        let (facets_before, pruned) = (condensed.facets(), prune::is_tried(&condensed, s, N));
        let condensed = prune::prune(condensed, s, sized, N, network.start_anywhere);
        let facets_after = condensed.facets();
        let T = inverse_factor(&condensed.H).ok_or_else(|| indefinite(s))?;
        let mut problem = Self {
            V: DMatrix::zeros(condensed.rows.len(), T.ncols()),
            lower: DVector::zeros(condensed.rows.len()),
            upper: DVector::zeros(condensed.rows.len()),
            noise: DVector::zeros(sized.E.q.len()),
            rows: Vec::new(),
            facets_before,
            facets_after,
            pruned,
            max_iterations: ITERATIONS_PER_ROW * (condensed.rows.len() + T.ncols()),
            H: condensed.H,
            T,
        };
        for (r, row) in condensed.rows.into_iter().enumerate() {
            problem.scale(r, row);
        }
        problem.noise.copy_from(&problem.tube_noise(s));
        if problem.is_finite() { Ok(problem) } else { Err(not_finite(s)) }
    }

    /// Row r in w, of unit length, with its limits and offset.
    fn scale(&mut self, r: usize, row: condense::TwoSided) {
        let in_w = self.T.tr_mul(&row.g);
        let size = in_w.norm();
        self.V.set_row(r, &(in_w / size).transpose());
        self.lower[r] = row.lower / size;
        self.upper[r] = row.upper / size;
        self.rows.push(Row { kind: row.kind, name: row.name(), offset: row.offset / size });
    }

    /// Rounded up by more than the scaling of the rows rounds.
    fn tube_noise(&self, s: &Subsystem) -> DVector<f64> {
        let rows = self.rows.iter().filter(|row| row.kind == RowKind::Tube);
        let rows: Vec<_> = rows.map(|row| row.offset.transpose()).collect();
        noise_support(&DMatrix::from_rows(&rows), s) * (1.0 + 1e-12)
    }

    fn is_finite(&self) -> bool {
        let limits = self.lower.iter().chain(&self.upper).all(|limit| !limit.is_nan());
        let offsets = self.rows.iter().flat_map(|row| row.offset.iter());
        limits && self.V.iter().chain(&self.T).chain(offsets).all(|value| value.is_finite())
    }
}

/// A dual active-set method changes its working set a few times the number of active rows; this is generous, and the
/// shifted candidate (47) stands behind it.
const ITERATIONS_PER_ROW: usize = 4;

/// L^-T of H = L L'.
fn inverse_factor(H: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let L = H.clone().cholesky()?.l();
    L.solve_lower_triangular(&DMatrix::identity(H.nrows(), H.nrows())).map(|inverse| inverse.transpose())
}

fn indefinite(s: &Subsystem) -> Diagnostic {
    Diagnostic::error(code::NOT_CONVEX, format!("the i-DPC problem of subsystem `{}` is not strictly convex in double precision", s.name))
        .at(s.places.or_header(&s.places.weights), "weights of this subsystem")
        .note("the Hessian of (34) lost its positive definiteness to rounding: Q, R and P differ by too many orders of magnitude")
        .help("choose Q and R closer to each other, or scale the units of states and inputs")
}

fn not_finite(s: &Subsystem) -> Diagnostic {
    Diagnostic::error(code::OVERFLOW, format!("the i-DPC problem of subsystem `{}` overflows", s.name))
        .at(s.places.header.clone(), "an entry of its tables is not finite")
        .note("powers of A_ii over the horizon leave the range of double precision")
        .help("a shorter horizon, or scaled units")
}
