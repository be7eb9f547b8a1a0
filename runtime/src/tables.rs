//! What the compiler bakes in. Every type here is plain data that an emitted file fills with numbers.
//!
//! Sizes, as constant parameters of one subsystem:
//! `NX` states, `NU` inputs, `NY` outputs, `NZ` coupling outputs; `NI` imported coupling outputs (those of all
//! neighbours, one after the other), `NJ` imported outputs (of all constraint neighbours, one after the other);
//! `NC` coupling constraints; `NB` neighbours; `N` horizon; `NV = NX + N NU` unknowns of the i-DPC problem, `NR` its rows, of which
//! `NT` are tube rows, `NS` state rows and `NQ` input rows; `NH` coupling constraints whose rows are redrawn while running.
#![expect(non_snake_case, reason = "the paper's symbols")]

use super::Real;
use crate::header::Sender;

/// Everything one subsystem's controller is made of. `R` is its reference-output layer, [`Clamp`] or [`Nearest`].
#[derive(Debug, Clone)]
pub struct Tables<
    R,
    const NX: usize,
    const NU: usize,
    const NY: usize,
    const NZ: usize,
    const NI: usize,
    const NJ: usize,
    const NC: usize,
    const NB: usize,
    const N: usize,
    const NV: usize,
    const NR: usize,
    const NT: usize,
    const NS: usize,
    const NQ: usize,
    const NH: usize = 0,
> {
    pub model: Model<NX, NU, NY, NZ, NI>,
    pub coupling: [CouplingRow<NY, NJ>; NC],
    pub changing: [ChangingRow; NH],
    pub reference: R,
    pub problem: DpcProblem<NX, NU, N, NV, NR, NT, NS, NQ>,
}

/// Model (1), (2) and gains of one subsystem.
#[derive(Debug, Clone)]
pub struct Model<const NX: usize, const NU: usize, const NY: usize, const NZ: usize, const NI: usize> {
    /// A_ii.
    pub A: [[Real; NX]; NX],
    /// B_ii.
    pub B: [[Real; NU]; NX],
    /// C_i.
    pub C: [[Real; NX]; NY],
    /// C_zi.
    pub Cz: [[Real; NX]; NZ],
    /// D_zi.
    pub Dz: [[Real; NU]; NZ],
    /// E_i [L_ij ...]: what the imported coupling outputs do to the state.
    pub EL: [[Real; NI]; NX],
    /// K_i of (17).
    pub K: [[Real; NX]; NU],
    /// K_i^x of (7f).
    pub Kx: [[Real; NX]; NU],
    /// K_i^e of (7f).
    pub Ke: [[Real; NY]; NU],
    /// Componentwise hull of U_i; infinite where there is no bound. A fall-back input is clipped to it.
    pub u_min: [Real; NU],
    pub u_max: [Real; NU],
    /// Largest |x+ - x| of a start, per state, in its unit: what the design's margins absorb; see
    /// [`NotSteady`](crate::References::NotSteady).
    pub drift: [Real; NX],
}

/// Row of the tightened coupling constraint (28) as this subsystem sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CouplingRow<const NY: usize, const NJ: usize> {
    /// `H_h^[i]`.
    pub own: [Real; NY],
    /// `H_h^[j]` of the others, over the imported outputs.
    pub others: [Real; NJ],
    /// The tightened limit of (26).
    pub l_tilde: Real,
    /// n_h, the number of subsystems in the constraint.
    pub members: Real,
}

/// Coupling constraint (3) whose row is redrawn while running: who is in it.
#[derive(Debug, Clone, Copy)]
pub struct ChangingRow {
    /// n_h members, this subsystem among them, in the order of the network: the same in the tables of all of them, so that all
    /// of them compute the same numbers.
    pub members: &'static [Member],
}

/// Member j of a [`ChangingRow`].
#[derive(Debug, Clone, Copy)]
pub struct Member {
    /// Where its outputs and its messages are; `None`: it is this subsystem.
    pub import: Option<Import>,
    /// What (26) takes of a row `h y_j`: at most the sum over all `g` of `|g . h|`, in whatever direction h points. One `g` has one
    /// entry per output of j. They are larger by 1e-8 than they need be, for the rounding errors of accepting a row: enough for
    /// outputs up to a million times the margin.
    pub generators: &'static [&'static [Real]],
}

/// Where the outputs of another subsystem are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Import {
    /// Its slot among the neighbours.
    pub slot: usize,
    /// Its first output among the imported ones.
    pub first: usize,
    /// How many outputs it has.
    pub outputs: usize,
}

/// Reference-output layer (29)-(31) with (28) where it is an interval per output: one output, or T_i diagonal, Y_i a
/// box, q = inf, and every coupling row on one output only.
#[derive(Debug, Clone)]
pub struct Clamp<const NY: usize, const NC: usize> {
    /// t / (t + gamma) per output: the unconstrained optimum of (29) is y + weight (set-point - y).
    pub weight: [Real; NY],
    /// Epsilon of (30).
    pub epsilon: Real,
    /// Y_i.
    pub y_min: [Real; NY],
    pub y_max: [Real; NY],
    /// Per coupling row: the output it acts on and its coefficient.
    pub rows: [(usize, Real); NC],
}

/// Reference-output layer (29)-(31) with (28) in general: a least-distance problem in the eigenbasis of T_i.
///
/// With T_i + gamma I = U diag(d) U' and y = U r, (29) is: minimise sum d_k (r_k - c_k)^2. `NA` rows of Y_i, `NB`
/// rows of the rate ball (none for q = 2, which is `ball`), `NC` coupling rows.
#[derive(Debug, Clone)]
pub struct Nearest<const NY: usize, const NA: usize, const NB: usize, const NC: usize> {
    /// U, orthogonal; columns are the eigenvectors of T_i.
    pub basis: [[Real; NY]; NY],
    /// Eigenvalues of T_i, in the order of the columns of U.
    pub weights: [Real; NY],
    pub gamma: Real,
    /// Y_i = {y : set y <= set_limit}.
    pub set: [[Real; NY]; NA],
    pub set_limit: [Real; NA],
    /// Rate ball (30) for q = 1 and inf: rate (y - y_previous) <= epsilon.
    pub rate: [[Real; NY]; NB],
    pub epsilon: Real,
    /// Whether (30) is the Euclidean ball (q = 2); `NB` is 0 then.
    pub euclidean: bool,
    /// `H_h^[i]` of (28).
    pub coupling: [[Real; NY]; NC],
}

/// Row that acts on one stage of the prediction: its offset is `row . p_k` with p_k = xref_{t+k} or uref_{t+k}.
#[derive(Debug, Clone)]
pub struct StageRow<const NP: usize> {
    /// k, 0 <= k < N.
    pub stage: usize,
    pub row: [Real; NP],
}

/// The i-DPC problem (33)-(36) as a least-distance problem.
///
/// In dx_k = xhat_k - xref_k, du_k = uhat_k - uref_k, v = (dx_0, du_0, ..., du_{N-1}), v = T w with T'HT = I:
///
/// ```text
/// minimise 1/2 |w|^2   subject to   lower <= V w + offset <= upper
/// ```
///
/// w is taken apart by stages like v, w = (w_x, w_0, ..., w_{N-1}), and T is a simulation: dx_0 = root w_x,
/// du_k = gain_k dx_k + spread_k w_k, dx_{k+1} = next_k dx_k + drive_k w_k. So a row about stage k knows nothing of later w.
///
/// Rows of `V` have unit length and stand in the order tube rows (35a), state rows (35c), input rows (35d), then rows
/// with no offset (35b), (36). `offset` is zero but for: tube row r, `tube[r] . e` with e = x_t - xref_t; state row
/// r, `state[r].row . xref_{t+k}`; input row r, `input[r].row . uref_{t+k}`. An absent side is infinite.
#[derive(Debug, Clone)]
pub struct DpcProblem<
    const NX: usize,
    const NU: usize,
    const N: usize,
    const NV: usize,
    const NR: usize,
    const NT: usize,
    const NS: usize,
    const NQ: usize,
> {
    pub V: [[Real; NV]; NR],
    /// V V', or no rows where it is not worth its memory.
    pub gram: &'static [[Real; NR]],
    /// Entries of each row of `V` before the zeros it ends with.
    pub extent: [u16; NR],
    pub lower: [Real; NR],
    pub upper: [Real; NR],
    /// How far beyond its limits each row may be for the shifted candidate to be used, or in single precision for any solution:
    /// the rounding errors that the design has in reserve for it. Empty in double precision, where 1e-9 of its magnitude is enough.
    pub slack: &'static [Real],
    pub tube: [[Real; NX]; NT],
    pub state: [StageRow<NX>; NS],
    pub input: [StageRow<NU>; NQ],
    /// The last rows, (36), over dx_N; all of them where `staged`.
    pub terminal: &'static [[Real; NX]],
    /// The row that asks the same one stage earlier; [`NO_ROW`] where there is none.
    pub shift: [u16; NR],
    /// Upper triangular.
    pub root: [[Real; NX]; NX],
    pub stages: [Stage<NX, NU>; N],
    /// Of xhat_k and uhat_k, where the problem is `boxed`.
    pub x: Bounds<NX, N>,
    pub u: Bounds<NU, N>,
    /// Whether every state and input row is a bound of one state or input, and stands in `x` or `u` too.
    pub boxed: bool,
    /// Whether violated rows are looked for by the simulation; otherwise by the rows of `V`. Needs `boxed`.
    pub staged: bool,
    /// Working-set changes after which the shifted candidate (47) is used instead.
    pub max_iterations: usize,
}

/// No row.
pub const NO_ROW: u16 = u16::MAX;

/// One stage k of the simulation that T is.
#[derive(Debug, Clone)]
pub struct Stage<const NX: usize, const NU: usize> {
    /// A + B gain.
    pub next: [[Real; NX]; NX],
    /// B spread.
    pub drive: [[Real; NU]; NX],
    pub gain: [[Real; NX]; NU],
    /// Upper triangular.
    pub spread: [[Real; NU]; NU],
}

/// Bounds of the entries of a state or an input over the horizon, in their units; infinite where there is none.
#[derive(Debug, Clone)]
pub struct Bounds<const COUNT: usize, const N: usize> {
    pub low: [[Real; COUNT]; N],
    pub high: [[Real; COUNT]; N],
    /// What the entry is multiplied by in its row.
    pub unit: [[Real; COUNT]; N],
    /// The row of the problem; [`NO_ROW`] where there is none.
    pub row: [[u16; COUNT]; N],
}

impl<const COUNT: usize, const N: usize> Bounds<COUNT, N> {
    /// No bounds.
    pub const NONE: Self = Self {
        low: [[Real::NEG_INFINITY; COUNT]; N],
        high: [[Real::INFINITY; COUNT]; N],
        unit: [[0.0; COUNT]; N],
        row: [[NO_ROW; COUNT]; N],
    };
}

/// Measured disturbances d of one subsystem, M d in (1a): `ND` loads.
#[derive(Debug, Clone)]
pub struct LoadModel<const ND: usize, const NX: usize> {
    /// From the loads to the next states.
    pub M: [[Real; ND]; NX],
    /// Bounds, and the largest change per step, that the design was made for.
    pub min: [Real; ND],
    pub max: [Real; ND],
    pub rate: [Real; ND],
    /// How far a load may be from what the references were given of it N - 1 steps before.
    pub lag: [Real; ND],
}

/// Where a neighbour's message goes in the inbox.
#[derive(Debug, Clone, Copy)]
pub struct Link<const NYJ: usize, const NZJ: usize> {
    /// Which neighbour, counted from 0.
    pub slot: usize,
    /// First imported coupling output; `None` where only its outputs are needed.
    pub z: Option<usize>,
    /// First imported output; `None` where only its coupling outputs are needed.
    pub y: Option<usize>,
    /// Whose messages they are, where they come as bytes.
    pub sender: Sender,
}
