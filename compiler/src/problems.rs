//! The on-line problems, condensed to least-distance form, pruned and scaled.
#![expect(non_snake_case, reason = "the paper's symbols")]

use nalgebra::{DMatrix, DVector};

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
    /// What each row is; tube rows first, then state rows, input rows, and rows without offset.
    pub rows: Vec<Row>,
    /// Facets (one-sided inequalities) before and after pruning.
    pub facets_before: usize,
    pub facets_after: usize,
    /// The working-set budget of the on-line solver.
    pub max_iterations: usize,
}

#[derive(Debug, Clone)]
pub struct Row {
    pub kind: RowKind,
    /// In the user's names: `h1 <= 27.6 cm at step 2`.
    pub name: String,
    /// The scaled row of the offset: over e for tube rows, over xref_{t+k} or uref_{t+k} for state and input rows.
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

/// (29)-(31) with (28).
#[derive(Debug)]
pub enum ReferenceProblem {
    /// An interval per output.
    Clamp {
        /// t / (t + gamma) per output.
        weight: DVector<f64>,
        /// Per coupling row of this subsystem: output it acts on, coefficient.
        rows: Vec<(usize, f64)>,
    },
    /// A least-distance problem in the eigenbasis of T_i; rows as in `dpc_runtime::tables::Nearest`.
    Nearest {
        basis: DMatrix<f64>,
        weights: DVector<f64>,
        set: DMatrix<f64>,
        set_limit: DVector<f64>,
        rate: DMatrix<f64>,
        euclidean: bool,
        coupling: DMatrix<f64>,
    },
}
