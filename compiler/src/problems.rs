//! The on-line problems, condensed to least-distance form, pruned and scaled.
#![expect(non_snake_case, reason = "the paper's symbols")]

mod condense;
mod prune;
mod reference;
mod stages;

use nalgebra::{DMatrix, DVector};

use crate::diagnostic::{Diagnostic, Diagnostics, code};
use crate::gains::{Gains, SubsystemGains};
use crate::iterations::{Iterations, limit_by_size};
use crate::network::{Network, Subsystem};
use crate::rounding::{Reserve, Rounding, asked};
use crate::sets::{Sets, noise_support};
use crate::sharing::spread;
use crate::sizing::{Sizing, SubsystemSizing};
use condense::{Condensed, TwoSided};
pub use reference::ReferenceProblem;
pub(crate) use stages::Stages;
pub use stages::{Bound, NO_ROW, Stage};

/// After this point: every Hessian is positive definite, every entry finite, and no row is kept that no admissible
/// parameter can make active. In single precision every row that the runtime finds within its limits plus its slack is within them
/// plus its reserve, which the sets have.
#[derive(Debug)]
pub struct Problems {
    pub subsystems: Vec<SubsystemProblems>,
}

#[derive(Debug)]
pub struct SubsystemProblems {
    pub dpc: DpcProblem,
    pub reference: ReferenceProblem,
    /// What the limit of `dpc` rests on, where the design was [counted](crate::design::Design::counted).
    pub iterations: Option<Iterations>,
}

/// (33)-(36) in v = (dx_0, du_0, ..., du_{N-1}), dx_k = xhat_k - xref_k, du_k = uhat_k - uref_k:
/// minimise 1/2 v'Hv subject to lower <= G v + offset(p) <= upper.
#[derive(Debug)]
pub struct DpcProblem {
    /// Hessian, NV x NV.
    pub H: DMatrix<f64>,
    /// v = T w, T'HT = I; block lower triangular, stage by stage, with upper triangular blocks on its diagonal.
    pub T: DMatrix<f64>,
    /// dx_0 = root w_x, upper triangular.
    pub root: DMatrix<f64>,
    /// The rest of the simulation that T is, and the bounds of each stage.
    pub stages: Vec<Stage>,
    /// Whether every state and input row is a bound of one state or input, and so stands in `stages`.
    pub boxed: bool,
    /// Whether violated rows are looked for by the simulation, which then takes fewer operations than the rows of V.
    pub staged: bool,
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
    /// Which of the rows of its kind and stage.
    pub ordinal: usize,
    /// In the user's names: `h1 <= 27.6 cm at step 2`.
    pub name: String,
    /// The scaled row of the offset: over e for tube rows, over xref_{t+k} or uref_{t+k} for state and input rows;
    /// empty for the others.
    pub offset: DVector<f64>,
    /// Entries of the row of V before the zeros it ends with.
    pub extent: usize,
    /// The scaled row over dx_N of a terminal row; empty for the others.
    pub end: DVector<f64>,
    /// How far beyond its limits the scaled row may be; nothing in double precision.
    pub reserve: Reserve,
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
    /// E0132 rounding takes a row of single precision as a whole, E0501 a Hessian is not positive definite in double precision, E0502
    /// an entry is not finite, E0503 q = 1 with
    /// more outputs in one subsystem than its ball has facets for.
    pub fn new(network: &Network, gains: &Gains, sets: &Sets, sizing: &Sizing) -> Result<Self, Diagnostics> {
        let one = |i: usize| -> Result<SubsystemProblems, Diagnostic> {
            let (s, g, sized) = (&network.subsystems[i], &gains.subsystems[i], &sizing.subsystems[i]);
            let rounding = &sets.subsystems[i].rounding;
            let dpc = DpcProblem::new(s, g, sized, (rounding, sizing.epsilon), network)?;
            Ok(SubsystemProblems { dpc, reference: ReferenceProblem::new(network, i, sized)?, iterations: None })
        };
        let subsystems = spread(network.subsystems.len(), one).into_iter().collect::<Result<_, _>>()?;
        Ok(Self { subsystems })
    }
}

impl DpcProblem {
    fn new(
        s: &Subsystem,
        g: &SubsystemGains,
        sized: &SubsystemSizing,
        (rounding, epsilon): (&Rounding, f64),
        network: &Network,
    ) -> Result<Self, Diagnostic> {
        let N = network.horizon;
        let condensed = Condensed::new(s, g, sized, rounding, N);
        let empty = condensed.rows.iter().find(|row| row.lower > row.upper).map(TwoSided::name);
        let lost =
            sized.Y.max.iter().zip(&sized.Y.min).zip(&rounding.y).any(|((max, min), off)| max - min <= 4.0 * off);
        let still = (epsilon <= 2.0 * rounding.y.sum() && rounding.is_some()).then(|| "epsilon".to_owned());
        let lost = (lost && rounding.is_some()).then(|| "the range of an output".to_owned());
        if let Some(what) = empty.or(still).or(lost) {
            return Err(needs_double(network, s, &what));
        }
        let (facets_before, pruned) = (condensed.facets(), prune::is_tried(&condensed, s, N));
        let condensed = prune::prune(condensed, s, sized, N, network.start_anywhere);
        let facets_after = condensed.facets();
        let Stages { T, root, stages } =
            condensed.H.clone().cholesky().and_then(|_| Stages::new(s, g, N)).ok_or_else(|| indefinite(s))?;
        let mut problem = Self {
            V: DMatrix::zeros(condensed.rows.len(), T.ncols()),
            lower: DVector::zeros(condensed.rows.len()),
            upper: DVector::zeros(condensed.rows.len()),
            noise: DVector::zeros(sized.E.q.len()),
            rows: Vec::new(),
            facets_before,
            facets_after,
            pruned,
            max_iterations: limit_by_size(condensed.rows.len(), T.ncols()),
            H: condensed.H,
            T,
            root,
            stages,
            boxed: false,
            staged: false,
        };
        for (r, row) in condensed.rows.into_iter().enumerate() {
            problem.scale(r, row, sized);
        }
        problem.boxed = problem.bound();
        if !problem.boxed {
            problem.stages.iter_mut().for_each(Stage::unbounded);
        }
        problem.staged = problem.boxed && WORTH * problem.work_by_stages(s) < problem.work_by_rows();
        problem.noise.copy_from(&problem.tube_noise(s));
        if problem.is_finite() { Ok(problem) } else { Err(not_finite(s)) }
    }

    /// Row r in w, of unit length, with its limits and offset.
    fn scale(&mut self, r: usize, row: condense::TwoSided, sized: &SubsystemSizing) {
        let in_w = self.T.tr_mul(&row.g);
        let size = in_w.norm();
        self.V.set_row(r, &(&in_w / size).transpose());
        self.lower[r] = row.lower / size;
        self.upper[r] = row.upper / size;
        let extent = in_w.iter().rposition(|entry| *entry != 0.0).map_or(0, |last| last + 1);
        let end = match row.kind {
            RowKind::Terminal => sized.Sigma.P.row(row.ordinal).transpose() / size,
            _ => DVector::zeros(0),
        };
        let (kind, ordinal, name) = (row.kind, row.ordinal, row.name());
        let reserve = Reserve { exact: row.reserve.exact / size, slack: row.reserve.slack / size };
        self.rows.push(Row { kind, ordinal, name, offset: row.offset / size, extent, end, reserve });
    }

    /// Puts the bounds of single states and inputs beside their stages; false where another row is among the state and input
    /// rows.
    fn bound(&mut self) -> bool {
        let mut all = true;
        for (r, row) in self.rows.iter().enumerate() {
            let (RowKind::State(k) | RowKind::Input(k)) = row.kind else { continue };
            let mut entries = row.offset.iter().enumerate().filter(|(_, entry)| **entry != 0.0);
            let (Some((at, &unit)), None) = (entries.next(), entries.next()) else {
                all = false;
                continue;
            };
            let stage = &mut self.stages[k];
            let bounds = if matches!(row.kind, RowKind::State(_)) { &mut stage.x } else { &mut stage.u };
            // A second row about the same entry is none that this form has room for.
            all &= bounds[at].row == NO_ROW;
            let ends = [self.lower[r] / unit, self.upper[r] / unit];
            bounds[at] = Bound { low: ends[0].min(ends[1]), high: ends[0].max(ends[1]), unit, row: r };
        }
        all
    }

    /// Multiplications of one look at all rows by the simulation: T w, the bounds, the rows of the tube and the terminal set,
    /// and those of the coupling outputs by V.
    fn work_by_stages(&self, s: &Subsystem) -> usize {
        let (n, m) = (s.n(), s.m());
        let simulated = n * n + self.stages.len() * (n * n + 2 * n * m + m * m + COMPARED * (n + m) / 2);
        let one = |row: &Row| match row.kind {
            RowKind::Tube | RowKind::Terminal => n + COMPARED,
            RowKind::CouplingOutput(_) => row.extent + COMPARED,
            RowKind::State(_) | RowKind::Input(_) => 0,
        };
        simulated + self.rows.iter().map(one).sum::<usize>()
    }

    /// The same by the rows of V.
    fn work_by_rows(&self) -> usize {
        self.rows.iter().map(|row| row.extent + row.offset.len() + COMPARED).sum()
    }

    /// V V', where the on-line solver is to look products of rows up: for problems so small that a look at all rows by its columns,
    /// one per row in the working set, takes fewer operations than one by the rows of V, and only where it is at most a few times as
    /// large as V. Larger problems have too many rows for it (its size grows with their square), and their rows end with zeros.
    pub fn gram(&self) -> Option<DMatrix<f64>> {
        let (rows, unknowns) = self.V.shape();
        (unknowns <= FEW_UNKNOWNS && rows <= GRAM_MEMORY * unknowns).then(|| &self.V * self.V.transpose())
    }

    /// Where each row stands one step later: the row that asks the same one stage earlier. Rows of the tube and the terminal set
    /// stay; those of stage 0 go.
    pub fn shift(&self) -> Vec<usize> {
        let earlier = |row: &Row| match row.kind {
            RowKind::State(k) => k.checked_sub(1).map(RowKind::State),
            RowKind::Input(k) => k.checked_sub(1).map(RowKind::Input),
            RowKind::CouplingOutput(k) => k.checked_sub(1).map(RowKind::CouplingOutput),
            RowKind::Tube | RowKind::Terminal => Some(row.kind),
        };
        let same = |row: &Row| {
            let kind = earlier(row)?;
            self.rows.iter().position(|other| other.kind == kind && other.ordinal == row.ordinal)
        };
        self.rows.iter().map(|row| same(row).unwrap_or(NO_ROW)).collect()
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

/// Of so many unknowns the runtime unrolls sums; it does not ask for a Gram matrix of more.
const FEW_UNKNOWNS: usize = 8;

/// How many times as many numbers as V the Gram matrix may have.
const GRAM_MEMORY: usize = 4;

/// One multiplication waits for another in a simulation, and for none in a product of a matrix: it has to save half of them.
const WORTH: usize = 2;

/// What comparing a row with its limits costs, in multiplications; bounds are compared two at a time.
const COMPARED: usize = 6;

fn indefinite(s: &Subsystem) -> Diagnostic {
    Diagnostic::error(code::NOT_CONVEX, format!("the i-DPC problem of subsystem `{}` is not strictly convex in double precision", s.name))
        .at(s.places.or_header(&s.places.weights), "weights of this subsystem")
        .note("the Hessian of (34) lost its positive definiteness to rounding: Q, R and P differ by too many orders of magnitude")
        .help("choose Q and R closer to each other, or scale the units of states and inputs")
}

fn needs_double(network: &Network, s: &Subsystem, row: &str) -> Diagnostic {
    let (place, label, _) = asked(network);
    Diagnostic::error(code::SINGLE_PRECISION, format!("subsystem `{}` needs double precision", s.name))
        .at(place, label)
        .note(format!("rounding may take all of {row}"))
        .help("write scalar = \"f64\", bound signals no more generously than they need, or leave more room (a larger reserve)")
}

fn not_finite(s: &Subsystem) -> Diagnostic {
    Diagnostic::error(code::OVERFLOW, format!("the i-DPC problem of subsystem `{}` overflows", s.name))
        .at(s.places.header.clone(), "an entry of its tables is not finite")
        .note("powers of A_ii over the horizon leave the range of double precision")
        .help("a shorter horizon, or scaled units")
}
