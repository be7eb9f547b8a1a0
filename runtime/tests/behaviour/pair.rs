//! Two equal subsystems, small enough to design by hand:
//!
//!     x+ = 0.9 x + 0.1 u + 0.02 z_j,   y = x,   z = x,   |x| <= 4,   |u| <= 4,   horizon 2.
//!
//! K = -1 gives F = 0.8. With |z - zref| <= Z = 1 the tube is |x - xhat| <= E = 0.02 Z / (1 - 0.8) = 0.1, and |zhat - zref|
//! <= Z - E = 0.9 fits. Terminal set |dx_2| <= 0.9, invariant under F. uref = -3 xref + eref gives the reference
//! system the eigenvalues of modulus 0.84. Y is [-2, 2] at a rate of 0.05: uref stays below 3 and xref below 3.

use dpc_runtime::tables::{Bounds, Clamp, CouplingRow, DpcProblem, Model, NO_ROW, Stage, StageRow};
use dpc_runtime::{Controller, Inbox, Link, Message, Sender, Tables};

pub const TUBE: f64 = 0.1;
pub const RESERVE: f64 = 0.9;
pub const BOUND: f64 = 4.0;
/// Some thousand rounding errors of a state, which the slack of 1e-11 in the tests absorbs.
pub const DRIFT: f64 = 1e-12;

pub type PairTables<const NJ: usize, const NC: usize> =
    Tables<Clamp<1, NC>, 1, 1, 1, 1, 1, NJ, NC, 1, 2, 3, 8, 1, 2, 2>;
pub type PairController<'a, const NJ: usize, const NC: usize> =
    Controller<'a, Clamp<1, NC>, 1, 1, 1, 1, 1, NJ, NC, 1, 2, 3, 8, 1, 2, 2>;
pub type PairInbox<const NJ: usize> = Inbox<1, NJ, 1>;
pub type PairMessage = Message<1, 1>;

/// The other subsystem, where its messages come as bytes.
pub const SENDER: Sender = Sender { design: 0x0123_4567_89ab_cdef, place: 1 };

/// The other subsystem, where only its coupling output matters.
pub const OTHER: Link<1, 1> = Link { slot: 0, z: Some(0), y: None, sender: SENDER };
/// The other subsystem, where its output matters too.
pub const PARTNER: Link<1, 1> = Link { slot: 0, z: Some(0), y: Some(0), sender: SENDER };

pub fn tables() -> PairTables<0, 0> {
    with_coupling([], [])
}

/// With the coupling constraint y_1 + y_2 <= 1.
pub fn coupled_tables() -> PairTables<1, 1> {
    with_coupling([CouplingRow { own: [1.0], others: [1.0], l_tilde: 1.0, members: 2.0 }], [(0, 1.0)])
}

fn with_coupling<const NJ: usize, const NC: usize>(
    coupling: [CouplingRow<1, NJ>; NC],
    rows: [(usize, f64); NC],
) -> PairTables<NJ, NC> {
    let model = Model {
        A: [[0.9]],
        B: [[0.1]],
        C: [[1.0]],
        Cz: [[1.0]],
        Dz: [[0.0]],
        EL: [[0.02]],
        K: [[-1.0]],
        Kx: [[-3.0]],
        Ke: [[1.0]],
        u_min: [-BOUND],
        u_max: [BOUND],
        drift: [DRIFT],
    };
    let reference = Clamp { weight: [1.0 / (1.0 + 1e-6)], epsilon: 0.05, y_min: [-2.0], y_max: [2.0], rows };
    Tables { model, coupling, changing: [], reference, problem: problem() }
}

/// Rows over v = (dx_0, du_0, du_1), where dx_1 = 0.9 dx_0 + 0.1 du_0, dx_2 = 0.81 dx_0 + 0.09 du_0 + 0.1 du_1.
const DX: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.9, 0.1, 0.0], [0.81, 0.09, 0.1]];
const DU: [[f64; 3]; 2] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

fn problem() -> DpcProblem<1, 1, 2, 3, 8, 1, 2, 2> {
    let tightened = BOUND - TUBE;
    let rows = [
        (DX[0], TUBE, -1.0),
        (DX[0], tightened, 1.0),
        (DX[1], tightened, 1.0),
        (DU[0], tightened, 1.0),
        (DU[1], tightened, 1.0),
        (DX[0], RESERVE, 0.0),
        (DX[1], RESERVE, 0.0),
        (DX[2], RESERVE, 0.0),
    ];
    let (root, [(gain0, spread0), (gain1, spread1)]) = riccati();
    let T = simulated(root, [(gain0, spread0), (gain1, spread1)]);
    let scaled = rows.map(|(row, limit, offset)| {
        let v: [f64; 3] = std::array::from_fn(|j| (0..3).map(|i| row[i] * T[i][j]).sum());
        let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        (v.map(|x| x / length), limit / length, offset / length)
    });
    let stage_row = |row: usize, stage| StageRow { stage, row: [scaled[row].2] };
    let bounds = |rows: [usize; 2]| Bounds {
        low: [[-tightened]; 2],
        high: [[tightened]; 2],
        unit: rows.map(|row| [scaled[row].2]),
        row: rows.map(|row| [row as u16]),
    };
    let stage = |gain: f64, spread: f64| Stage {
        next: [[0.9 + 0.1 * gain]],
        drive: [[0.1 * spread]],
        gain: [[gain]],
        spread: [[spread]],
    };
    DpcProblem {
        V: scaled.map(|(v, ..)| v),
        gram: &[],
        extent: scaled.map(|(v, ..)| v.iter().rposition(|x| *x != 0.0).map_or(0, |last| last as u16 + 1)),
        slack: &[],
        lower: scaled.map(|(_, limit, _)| -limit),
        upper: scaled.map(|(_, limit, _)| limit),
        tube: [[scaled[0].2]],
        state: [stage_row(1, 0), stage_row(2, 1)],
        input: [stage_row(3, 0), stage_row(4, 1)],
        terminal: Box::leak(Box::new([[scaled[7].1 / RESERVE]])),
        shift: [0, NO_ROW, 1, NO_ROW, 3, NO_ROW, 5, 7],
        root: [[root]],
        stages: [stage(gain0, spread0), stage(gain1, spread1)],
        x: bounds([1, 2]),
        u: bounds([3, 4]),
        boxed: true,
        staged: true,
        max_iterations: 50,
    }
}

/// Q = R = 1 and P = 2 / (1 - 0.64) of (37): dx_0 = root w, and gain and spread of the two stages.
fn riccati() -> (f64, [(f64, f64); 2]) {
    let mut cost: f64 = 2.0 / 0.36;
    let mut stages = [(0.0, 0.0); 2];
    for stage in stages.iter_mut().rev() {
        let curvature = 1.0 + 0.01 * cost;
        let gain = -0.09 * cost / curvature;
        *stage = (gain, 1.0 / curvature.sqrt());
        cost = 1.0 + gain * gain + (0.9 + 0.1 * gain).powi(2) * cost;
    }
    (1.0 / cost.sqrt(), stages)
}

/// v = T w: what each entry of w does alone.
#[expect(clippy::needless_range_loop, reason = "a simulation per column reads better with its index")]
fn simulated(root: f64, stages: [(f64, f64); 2]) -> [[f64; 3]; 3] {
    let mut T = [[0.0; 3]; 3];
    for column in 0..3 {
        let alone = |k: usize| if k == column { 1.0 } else { 0.0 };
        let mut dx = root * alone(0);
        T[0][column] = dx;
        for (k, (gain, spread)) in stages.into_iter().enumerate() {
            let du = gain * dx + spread * alone(k + 1);
            T[k + 1][column] = du;
            dx = 0.9 * dx + 0.1 * du;
        }
    }
    T
}
