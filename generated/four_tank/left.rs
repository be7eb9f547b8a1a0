// Controller of subsystem `left` of network `four-tank`.
//
// Written by dpc-codegen 0.1.0 from system.toml; do not edit. To make it again:
//
//     dpc-codegen system.toml --out four_tank
//
// Fits dpc-runtime 0.1. Numbers are in the units of system.toml, as deviations from its operating point.

use dpc_runtime::StartError;
use dpc_runtime::tables::{Clamp, DpcProblem, Link, Model, StageRow, Tables};

const _: () = assert!(dpc_runtime::fits(0, 1), "made for dpc-runtime 0.1");

/// States.
pub const NX: usize = 2;
/// Inputs.
pub const NU: usize = 1;
/// Outputs.
pub const NY: usize = 1;
/// Coupling outputs.
pub const NZ: usize = 1;
/// Neighbours that this subsystem hears.
pub const NB: usize = 1;
/// Imported coupling outputs.
pub const NI: usize = 1;
/// Imported outputs, for coupling constraints.
pub const NJ: usize = 0;
/// Coupling constraints on this subsystem.
pub const NC: usize = 0;
/// Horizon, in steps.
pub const N: usize = 3;
/// Unknowns of the i-DPC problem.
pub const NV: usize = 5;
/// Rows of the i-DPC problem, of which:
pub const NR: usize = 13;
/// tube rows (35a),
pub const NT: usize = 2;
/// state rows (35c),
pub const NS: usize = 6;
/// input rows (35d).
pub const NQ: usize = 3;
/// Outputs of the whole network.
pub const NETWORK_NY: usize = 2;

/// Seconds per step.
pub const SAMPLE_TIME: f64 = 0.5;
/// As the user wrote it.
pub const NAME: &str = "left";
/// Names of the states, with units.
pub const STATES: [&str; NX] = ["h1 [cm]", "h2 [cm]"];
/// Names of the inputs, with units.
pub const INPUTS: [&str; NU] = ["v1 [V]"];
/// Names of the outputs, with units.
pub const OUTPUTS: [&str; NY] = ["h1 [cm]"];
/// What the neighbours hear.
pub const COUPLING_OUTPUTS: [&str; NZ] = ["0.0165 h2 + 0.00013 v1"];

/// Reference-output layer (28)-(31).
pub type Reference = Clamp<NY, NC>;
/// Type of [`TABLES`].
pub type Parts = Tables<Reference, NX, NU, NY, NZ, NI, NJ, NC, NB, N, NV, NR, NT, NS, NQ>;
/// What this node remembers from step to step.
pub type Controller = dpc_runtime::Controller<'static, Reference, NX, NU, NY, NZ, NI, NJ, NC, NB, N, NV, NR, NT, NS, NQ>;
/// Collects the neighbours' messages between two steps.
pub type Inbox = dpc_runtime::Inbox<NI, NJ, NB>;
/// What the neighbours hear, once per step.
pub type Message = dpc_runtime::Message<NY, NZ>;
/// What a step gives.
pub type Step = dpc_runtime::Step<NX, NU, NY, NZ, NB>;
/// A state and an input to start from.
pub type SteadyState = dpc_runtime::SteadyState<NX, NU>;

/// Where the messages of `right` go: `0.0206 h4 + 0.000247 v2`.
pub const FROM_RIGHT: Link<1, 1> = Link {
    slot: 0,
    z: Some(0),
    y: None,
};

/// The state and input that this subsystem rests at when the outputs of the whole network rest at
/// `outputs`, in the order of the columns of [`STEADY_X`].
pub fn steady_state(outputs: &[f64; NETWORK_NY]) -> SteadyState {
    let at_rest = |row: &[f64; NETWORK_NY]| {
        row.iter().zip(outputs).map(|(a, y)| a * y).sum()
    };
    SteadyState {
        x: STEADY_X.each_ref().map(at_rest),
        u: STEADY_U.each_ref().map(at_rest),
    }
}

/// A controller whose references rest at `steady`, and its first message to those who hear it.
///
/// # Errors
/// No controller can start there; see [`StartError`].
pub fn start(steady: &SteadyState) -> Result<(Controller, Message), StartError> {
    Controller::start(&TABLES, steady)
}

/// All that the controller of this subsystem is made of; each part says what it is.
#[rustfmt::skip]
pub static TABLES: Parts = Tables {
    // Model (1), (2) and gains.
    model: Model {
        // A_ii of (1a): from the states to the next states
        // columns: h1 [cm], h2 [cm]
        A: [
            [0.9921, 0.0], // h1 [cm]
            [0.0, 0.9835], // h2 [cm]
        ],
        // B_ii of (1a): from the inputs to the next states
        // columns: v1 [V]
        B: [
            [0.0417], // h1 [cm]
            [0.0156], // h2 [cm]
        ],
        // C_i of (1b): from the states to the outputs
        // columns: h1 [cm], h2 [cm]
        C: [
            [1.0, 0.0], // h1 [cm]
        ],
        // C_zi of (1c): from the states to the coupling outputs
        // columns: h1 [cm], h2 [cm]
        Cz: [
            [0.0, 0.0165], // 0.0165 h2 + 0.00013 v1
        ],
        // D_zi of (1c): from the inputs to the coupling outputs
        // columns: v1 [V]
        Dz: [
            [0.00013], // 0.0165 h2 + 0.00013 v1
        ],
        // [E_i L_ij ...] of (1a), (2): from the neighbours' coupling outputs to the next states
        // columns: right: 0.0206 h4 + 0.000247 v2
        EL: [
            [1.0], // h1 [cm]
            [0.0], // h2 [cm]
        ],
        // K_i of (17): from x - xhat to the inputs
        // columns: h1 [cm], h2 [cm]
        K: [
            [-0.0245977709, -0.00448682879], // v1 [V]
        ],
        // K_i^x of (7f): from xref to uref
        // columns: h1 [cm], h2 [cm]
        Kx: [
            [-3.82724036, -0.0108261497], // v1 [V]
        ],
        // K_i^e of (7f): from eref to uref
        // columns: sum of errors of h1 [cm]
        Ke: [
            [0.29175755], // v1 [V]
        ],
        // Componentwise hull of U_i: lower ends
        u_min: [
            -3.0, // v1 [V]
        ],
        // Componentwise hull of U_i: upper ends
        u_max: [
            3.0, // v1 [V]
        ],
    },
    // (28): H_h^[i], then H_h^[j] over nothing; l~_h of (26); members
    coupling: [],
    // Reference outputs (29)-(31).
    reference: Clamp {
        // t / (t + gamma) of (29)
        weight: [
            0.9999990000010001, // h1 [cm]
        ],
        // Epsilon of (30), per step
        epsilon: 0.02,
        // Y_i of (31): lower ends
        y_min: [
            -1.0, // h1 [cm]
        ],
        // Y_i of (31): upper ends
        y_max: [
            3.79589, // h1 [cm]
        ],
        // (28): output and coefficient
        rows: [],
    },
    // i-DPC problem (33)-(36), lower <= V w + offset <= upper.
    problem: DpcProblem {
        // Rows of unit length in w: (35a), (35c), (35d), (35b), (36)
        V: [
            [-0.8832498423506977, -0.01700778615319644, 0.2742322406312866, 0.2706818808767607, 0.2666616747134807], // (35a) x - xhat in E, normal 1
            [0.0, -0.9899065959836141, 0.08359077468949005, 0.08185025172399221, 0.07998781099432457], // (35a) x - xhat in E, normal 2
            [0.8832498423506977, 0.01700778615319644, -0.2742322406312866, -0.2706818808767607, -0.2666616747134807], // h1 >= -12.4 cm at step 0
            [0.0, 0.9899065959836141, -0.08359077468949005, -0.08185025172399221, -0.07998781099432457], // h2 >= -1.4 cm at step 0
            [0.9181595816077871, 0.01768000521453048, 0.005173913317103948, -0.2819465436314786, -0.27775848730988834], // h1 >= -12.4 cm at step 1
            [0.0, 0.9933517766084989, 0.0029598160155326508, -0.08230451712954782, -0.08043291526461828], // h2 >= -1.4 cm at step 1
            [0.9566037305395486, 0.018420282577199305, 0.005390549616617879, 0.010760560358781656, -0.29056005958009873], // h1 >= -12.4 cm at step 2
            [0.0, 0.9966884972187051, 0.0029697581924472308, 0.005928806666708776, -0.08104362590424034], // h2 >= -1.4 cm at step 2
            [0.0, 0.0, 0.9999962545198653, -0.0019506871312978333, -0.0019198348774100051], // v1 >= -3 V at step 0, v1 <= 3 V at step 0
            [0.0, 0.0, 0.0, 0.9999925988515993, -0.0038473681945307312], // v1 >= -3 V at step 1, v1 <= 3 V at step 1
            [0.0, 0.0, 0.0, 0.0, 1.0], // v1 >= -3 V at step 2, v1 <= 3 V at step 2
            [0.9995942423526673, 0.019248104328730028, 0.005632805087273143, 0.011244148267182433, 0.01681373758990258], // (36) terminal set, normal 1
            [0.0, 0.9999383003348039, 0.0029794413878034545, 0.00594813813730765, 0.00889596005271857], // (36) terminal set, normal 2
        ],
        // Lower limits of the rows
        lower: [
            -36.753358242089156, // (35a) x - xhat in E, normal 1
            -0.699313424789744, // (35a) x - xhat in E, normal 2
            -45.69847366696525, // h1 >= -12.4 cm at step 0
            -6.946531156631914, // h2 >= -1.4 cm at step 0
            -47.8829443247032, // h1 >= -12.4 cm at step 1
            -7.0876535130244385, // h2 >= -1.4 cm at step 1
            -50.28509757329767, // h1 >= -12.4 cm at step 2
            -7.230769000657214, // h2 >= -1.4 cm at step 2
            -2.866284674768103, // v1 >= -3 V at step 0, v1 <= 3 V at step 0
            -2.8690348001763466, // v1 >= -3 V at step 1, v1 <= 3 V at step 1
            -2.8717373579639496, // v1 >= -3 V at step 2, v1 <= 3 V at step 2
            -42.86070603650155, // (36) terminal set, normal 1
            -0.7469377123933155, // (36) terminal set, normal 2
        ],
        // Upper limits of the rows
        upper: [
            36.753358242089156, // (35a) x - xhat in E, normal 1
            0.699313424789744, // (35a) x - xhat in E, normal 2
            f64::INFINITY, // h1 >= -12.4 cm at step 0
            f64::INFINITY, // h2 >= -1.4 cm at step 0
            f64::INFINITY, // h1 >= -12.4 cm at step 1
            f64::INFINITY, // h2 >= -1.4 cm at step 1
            f64::INFINITY, // h1 >= -12.4 cm at step 2
            f64::INFINITY, // h2 >= -1.4 cm at step 2
            2.866284674768103, // v1 >= -3 V at step 0, v1 <= 3 V at step 0
            2.8690348001763466, // v1 >= -3 V at step 1, v1 <= 3 V at step 1
            2.8717373579639496, // v1 >= -3 V at step 2, v1 <= 3 V at step 2
            42.86070603650155, // (36) terminal set, normal 1
            0.7469377123933155, // (36) terminal set, normal 2
        ],
        // Offsets of the first rows, over e = x - xref
        tube: [
            [6.649341282988326, 0.0], // (35a) x - xhat in E, normal 1
            [0.0, 5.461317558158342], // (35a) x - xhat in E, normal 2
        ],
        // Offsets of the next rows, over xref_{t+k}, k the stage
        state: [
            StageRow { stage: 0, row: [6.649341282988326, 0.0] }, // h1 >= -12.4 cm at step 0
            StageRow { stage: 0, row: [0.0, 5.461317558158342] }, // h2 >= -1.4 cm at step 0
            StageRow { stage: 1, row: [6.967191962900065, 0.0] }, // h1 >= -12.4 cm at step 1
            StageRow { stage: 1, row: [0.0, 5.572267035737431] }, // h2 >= -1.4 cm at step 1
            StageRow { stage: 2, row: [7.316716476133209, 0.0] }, // h1 >= -12.4 cm at step 2
            StageRow { stage: 2, row: [0.0, 5.68478350011794] }, // h2 >= -1.4 cm at step 2
        ],
        // Offsets of the next rows, over uref_{t+k}, k the stage
        input: [
            StageRow { stage: 0, row: [1.000984871839181] }, // v1 >= -3 V at step 0, v1 <= 3 V at step 0
            StageRow { stage: 1, row: [1.001945290723441] }, // v1 >= -3 V at step 1, v1 <= 3 V at step 1
            StageRow { stage: 2, row: [1.0028890976957476] }, // v1 >= -3 V at step 2, v1 <= 3 V at step 2
        ],
        // L^-T of H = L L': (dx_0, du_0, ..., du_{N-1}) = T w
        T: [
            [0.13283268293212802, 0.002557815192417504, -0.041242016157733145, -0.04070807458315806, -0.040103472413983],
            [0.0, 0.1812578348433247, -0.015305972194313932, -0.014987272000274167, -0.014646247932394165],
            [0.0, 0.0, 0.9990123553840536, -0.0019487678447264608, -0.001917945946458267],
            [0.0, 0.0, 0.0, 0.9980510993065982, -0.0038398984756471],
            [0.0, 0.0, 0.0, 0.0, 0.9971192251442501],
        ],
        // Working-set changes before the shifted candidate (47) is used
        max_iterations: 72,
    },
};

/// What each row of the i-DPC problem asks: the rows that a status speaks of.
#[rustfmt::skip]
pub static ROWS: [&str; NR] = [
    "(35a) x - xhat in E, normal 1",
    "(35a) x - xhat in E, normal 2",
    "h1 >= -12.4 cm at step 0",
    "h2 >= -1.4 cm at step 0",
    "h1 >= -12.4 cm at step 1",
    "h2 >= -1.4 cm at step 1",
    "h1 >= -12.4 cm at step 2",
    "h2 >= -1.4 cm at step 2",
    "v1 >= -3 V at step 0, v1 <= 3 V at step 0",
    "v1 >= -3 V at step 1, v1 <= 3 V at step 1",
    "v1 >= -3 V at step 2, v1 <= 3 V at step 2",
    "(36) terminal set, normal 1",
    "(36) terminal set, normal 2",
];

/// State at rest, (9), as a linear map of the outputs of the whole network at rest. One row per entry; columns
/// `left: h1 [cm]`, `right: h3 [cm]`.
#[rustfmt::skip]
pub static STEADY_X: [[f64; NETWORK_NY]; NX] = [
    [1.0, 0.0], // h1 [cm]
    [0.2510916059415943, -0.13284186326783798], // h2 [cm]
];

/// Input at rest, (9), as a linear map of the outputs of the whole network at rest. One row per entry; columns
/// `left: h1 [cm]`, `right: h3 [cm]`.
#[rustfmt::skip]
pub static STEADY_U: [[f64; NETWORK_NY]; NU] = [
    [0.2655776601305311, -0.14050581691790517], // v1 [V]
];

/// E_i of (18): row and width. `|row . (x - xhat)| <= width` at every step.
#[rustfmt::skip]
pub static TUBE: [([f64; NX], f64); 2] = [
    ([1.0, 0.0], 5.5273683028),
    ([0.0, 1.0], 0.12804848232),
];

/// Z_i of (21): half-widths. `|z - zref|` stays below them, and neighbours rely on it. One per coupling output.
#[rustfmt::skip]
pub static Z_WIDTHS: [f64; NZ] = [
    0.031502229563, // 0.0165 h2 + 0.00013 v1
];

/// X_i: row and limit, `row . x <= limit`, in the deviations the model is in.
#[rustfmt::skip]
pub static STATE_LIMITS: [([f64; NX], f64); 4] = [
    ([1.0, 0.0], 27.6), // h1 <= 27.6 cm
    ([-1.0, 0.0], 12.4), // h1 >= -12.4 cm
    ([0.0, 1.0], 38.6), // h2 <= 38.6 cm
    ([0.0, -1.0], 1.4), // h2 >= -1.4 cm
];

/// U_i: row and limit, `row . u <= limit`, in the deviations the model is in.
#[rustfmt::skip]
pub static INPUT_LIMITS: [([f64; NU], f64); 2] = [
    ([1.0], 3.0), // v1 <= 3 V
    ([-1.0], 3.0), // v1 >= -3 V
];
