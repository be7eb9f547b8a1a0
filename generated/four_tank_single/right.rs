// Controller of subsystem `right` of network `four-tank`.
//
// Written by dpc-codegen 0.1.0 from system.toml; do not edit. To make it again:
//
//     dpc-codegen system.toml --out four_tank_single --scalar f32
//
// Fits dpc-runtime 0.1. Numbers are in the units of system.toml, as deviations from its operating point.
//
// Takes, in bytes (`--measure`; opt-level 3, no link-time optimisation):
//
//     target                     rustc   code  constants  controller  inbox  step  start
//     x86_64-unknown-linux-gnu  1.95.0  39499       1548         648     72  1712    616
//     thumbv7em-none-eabihf     1.96.0  35912       1716         528     72  1192    572
//
// Code and constants are what a linker keeps of the functions below; step and start are the most stack of
// these, their own frames and all they call.
// x86_64-unknown-linux-gnu: no panic; calls memcpy, memmove, whose stack comes on top
// thumbv7em-none-eabihf: no panic, nothing else is needed

use dpc_runtime::single::tables::{
    Bounds, Clamp, DpcProblem, Link, Model, Stage, StageRow, Tables,
};
use dpc_runtime::{Refused, Sender, StartError};

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
pub const NR: usize = 11;
/// tube rows (35a),
pub const NT: usize = 3;
/// state rows (35c),
pub const NS: usize = 3;
/// input rows (35d).
pub const NQ: usize = 3;
/// Outputs of the whole network.
pub const NETWORK_NY: usize = 2;

/// Seconds per step.
pub const SAMPLE_TIME: f32 = 0.5;
/// As the user wrote it.
pub const NAME: &str = "right";
/// Names of the states, with units.
pub const STATES: [&str; NX] = ["h3 [cm]", "h4 [cm]"];
/// Names of the inputs, with units.
pub const INPUTS: [&str; NU] = ["v2 [V]"];
/// Names of the outputs, with units.
pub const OUTPUTS: [&str; NY] = ["h3 [cm]"];
/// What the neighbours hear.
pub const COUPLING_OUTPUTS: [&str; NZ] = ["0.0206 h4 + 0.000247 v2"];

/// Fingerprint of the whole network's design. Controllers of any other refuse this one's messages, and this one theirs.
pub const DESIGN: u64 = 0x21a0a199845ed419;
/// Whose messages these are: of the subsystem at this place in the network, counted from 0.
pub const SENDER: Sender = Sender { design: DESIGN, place: 1 };
/// Length of a message of this subsystem as bytes, see [`to_bytes`]; little-endian:
///
/// | bytes | type | |
/// |---|---|---|
/// | 0 | u8 | version of this layout: 1 |
/// | 1 | u8 | bytes per number: 4 |
/// | 2, 3 | u16 | bit 0: the sender's step is certified; all others 0 |
/// | 4 to 7 | u32 | place of the sender in the network: 1 |
/// | 8 to 15 | u64 | fingerprint of the network's design |
/// | 16 to 23 | i64 | step, -1 for the message of the start |
/// | 24 to 27 | u32 | number of the start-up plan; 0: none |
/// | 28, 29 | u16 | number of outputs: 1 |
/// | 30, 31 | u16 | number of coupling outputs: 1 |
/// | 32 to 35 | f32 | yref of `h3 [cm]` |
/// | 36 to 39 | f32 | zref of `0.0206 h4 + 0.000247 v2` |
pub const MESSAGE_BYTES: usize = 40;

/// Reference-output layer (28)-(31).
pub type Reference = Clamp<NY, NC>;
/// Type of [`TABLES`].
pub type Parts = Tables<Reference, NX, NU, NY, NZ, NI, NJ, NC, NB, N, NV, NR, NT, NS, NQ>;
/// What this node remembers from step to step.
pub type Controller = dpc_runtime::single::Controller<'static, Reference, NX, NU, NY, NZ, NI, NJ, NC, NB, N, NV, NR, NT, NS, NQ>;
/// Collects the neighbours' messages between two steps.
pub type Inbox = dpc_runtime::single::Inbox<NI, NJ, NB>;
/// What the neighbours hear, once per step.
pub type Message = dpc_runtime::single::Message<NY, NZ>;
/// What a step gives.
pub type Step = dpc_runtime::single::Step<NX, NU, NY, NZ, NB>;
/// A state and an input to start from.
pub type SteadyState = dpc_runtime::single::SteadyState<NX, NU>;

/// Where the messages of `left` go: `0.0165 h2 + 0.00013 v1`.
pub const FROM_LEFT: Link<1, 1> = Link {
    slot: 0,
    z: Some(0),
    y: None,
    sender: Sender { design: DESIGN, place: 0 },
};

/// The message as bytes, for all who hear it.
pub fn to_bytes(message: &Message) -> [u8; MESSAGE_BYTES] {
    message.to_bytes(&SENDER)
}

/// Files a message that came as bytes, whichever neighbour it is from.
///
/// # Errors
/// The bytes are no message of a neighbour in the same design, or it is out of sequence or not finite; see [`Refused`].
pub fn accept_bytes(inbox: &mut Inbox, bytes: &[u8]) -> Result<(), Refused> {
    match Sender::place_in(bytes)? {
        0 => inbox.accept_bytes(&FROM_LEFT, bytes),
        _ => Err(SENDER.stranger(bytes)),
    }
}

/// The state and input that this subsystem rests at when the outputs of the whole network rest at
/// `outputs`, in the order of the columns of [`STEADY_X`].
pub fn steady_state(outputs: &[f32; NETWORK_NY]) -> SteadyState {
    let at_rest = |row: &[f32; NETWORK_NY]| {
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
        // columns: h3 [cm], h4 [cm]
        A: [
            [0.9945, 0.0], // h3 [cm]
            [0.0, 0.9793], // h4 [cm]
        ],
        // B_ii of (1a): from the inputs to the next states
        // columns: v2 [V]
        B: [
            [0.0311], // h3 [cm]
            [0.0235], // h4 [cm]
        ],
        // C_i of (1b): from the states to the outputs
        // columns: h3 [cm], h4 [cm]
        C: [
            [1.0, 0.0], // h3 [cm]
        ],
        // C_zi of (1c): from the states to the coupling outputs
        // columns: h3 [cm], h4 [cm]
        Cz: [
            [0.0, 0.0206], // 0.0206 h4 + 0.000247 v2
        ],
        // D_zi of (1c): from the inputs to the coupling outputs
        // columns: v2 [V]
        Dz: [
            [0.000247], // 0.0206 h4 + 0.000247 v2
        ],
        // [E_i L_ij ...] of (1a), (2): from the neighbours' coupling outputs to the next states
        // columns: left: 0.0165 h2 + 0.00013 v1
        EL: [
            [1.0], // h3 [cm]
            [0.0], // h4 [cm]
        ],
        // K_i of (17): from x - xhat to the inputs
        // columns: h3 [cm], h4 [cm]
        K: [
            [-0.026117748, -0.0054295226], // v2 [V]
        ],
        // K_i^x of (7f): from xref to uref
        // columns: h3 [cm], h4 [cm]
        Kx: [
            [-4.4665604, -0.021685114], // v2 [V]
        ],
        // K_i^e of (7f): from eref to uref
        // columns: sum of errors of h3 [cm]
        Ke: [
            [0.29479146], // v2 [V]
        ],
        // Componentwise hull of U_i: lower ends
        u_min: [
            -3.0, // v2 [V]
        ],
        // Componentwise hull of U_i: upper ends
        u_max: [
            3.0, // v2 [V]
        ],
        // Largest |x+ - x| of a state that references start from
        drift: [
            4.32069e-5, // h3 [cm]
            5.80832e-5, // h4 [cm]
        ],
    },
    // (28): H_h^[i], then H_h^[j] over nothing; l~_h of (26); members
    coupling: [],
    // (3) with rows that are redrawn while running: who is in it
    changing: [],
    // Reference outputs (29)-(31).
    reference: Clamp {
        // t / (t + gamma) of (29)
        weight: [
            0.999999, // h3 [cm]
        ],
        // Epsilon of (30), per step
        epsilon: 0.019978845,
        // Y_i of (31): lower ends
        y_min: [
            -0.99999696, // h3 [cm]
        ],
        // Y_i of (31): upper ends
        y_max: [
            3.8549984, // h3 [cm]
        ],
        // (28): output and coefficient
        rows: [],
    },
    // i-DPC problem (33)-(36), lower <= V w + offset <= upper.
    problem: DpcProblem {
        // Rows of unit length in w: (35a), (35c), (35d), (35b), (36)
        V: [
            [-0.995037, -0.099505305, 0.0, 0.0, 0.0], // (35a) x - xhat in E, normal 1
            [0.0, -1.0, 0.0, 0.0, 0.0], // (35a) x - xhat in E, normal 2
            [0.9122615, 0.40960833, 0.0, 0.0, 0.0], // (35a) x - xhat in E, normal 3
            [0.0, 1.0, 0.0, 0.0, 0.0], // h4 >= -1.8 cm at step 0
            [-0.027875837, 0.9932456, 0.11263241, 0.0, 0.0], // h4 >= -1.8 cm at step 1
            [-0.05639721, 0.9861859, 0.10460926, 0.11538487, 0.0], // h4 >= -1.8 cm at step 2
            [-0.23876451, -0.11085976, 0.9647288, 0.0, 0.0], // v2 >= -3 V at step 0, v2 <= 3 V at step 0
            [-0.23661304, -0.1082157, -0.07254041, 0.96282995, 0.0], // v2 >= -3 V at step 1, v2 <= 3 V at step 1
            [-0.23482072, -0.10578003, -0.071796276, -0.078063816, 0.9604276], // v2 >= -3 V at step 2, v2 <= 3 V at step 2
            [0.9012238, 0.018870514, 0.22891925, 0.24827406, 0.2709162], // (36) terminal set, normal 1
            [-0.085599765, 0.9788265, 0.09637871, 0.10644524, 0.118118286], // (36) terminal set, normal 2
        ],
        // V V': products of so few rows are looked up instead of computed
        gram: &[
            [1.0, 0.099505305, -0.94849217, -0.099505305, -0.07109572, -0.042013418, 0.24861066, 0.24620678, 0.24418099, -0.8986288, -0.012223493], // (35a) x - xhat in E, normal 1
            [0.099505305, 1.0, -0.40960833, -1.0, -0.9932456, -0.9861859, 0.11085976, 0.1082157, 0.10578003, -0.018870514, -0.9788265], // (35a) x - xhat in E, normal 2
            [-0.94849217, -0.40960833, 1.0, 0.40960833, 0.38141164, 0.35250095, -0.26322475, -0.260179, -0.25754628, 0.82988125, 0.3228461], // (35a) x - xhat in E, normal 3
            [-0.099505305, -1.0, 0.40960833, 1.0, 0.9932456, 0.9861859, -0.11085976, -0.1082157, -0.10578003, 0.018870514, 0.9788265], // h4 >= -1.8 cm at step 0
            [-0.07109572, -0.9932456, 0.38141164, 0.9932456, 1.0, 0.99287933, 0.005204517, -0.109059386, -0.10660632, 0.019404417, 0.98545665], // h4 >= -1.8 cm at step 1
            [-0.042013418, -0.9861859, 0.35250095, 0.9861859, 0.99287933, 1.0, 0.0050568865, 0.010131129, -0.10759348, 0.020377472, 0.9924967], // h4 >= -1.8 cm at step 2
            [0.24861066, 0.11085976, -0.26322475, -0.11085976, 0.005204517, 0.0050568865, 1.0, -0.0014902605, -0.0014703298, 0.0035727634, 0.0049050297], // v2 >= -3 V at step 0, v2 <= 3 V at step 0
            [0.24620678, 0.1082157, -0.260179, -0.1082157, -0.109059386, 0.010131129, -0.0014902605, 1.0, -0.00294534, 0.0071564186, 0.009826939], // v2 >= -3 V at step 1, v2 <= 3 V at step 1
            [0.24418099, 0.10578003, -0.25754628, -0.10578003, -0.10660632, -0.10759348, -0.0014703298, -0.00294534, 1.0, 0.010756464, 0.014775213], // v2 >= -3 V at step 2, v2 <= 3 V at step 2
            [-0.8986288, -0.018870514, 0.82988125, 0.018870514, 0.019404417, 0.020377472, 0.0035727634, 0.0071564186, 0.010756464, 1.0, 0.021817103], // (36) terminal set, normal 1
            [-0.012223493, -0.9788265, 0.3228461, 0.9788265, 0.98545665, 0.9924967, 0.0049050297, 0.009826939, 0.014775213, 0.021817103, 1.0], // (36) terminal set, normal 2
        ],
        // Entries of each row before its last zeros
        extent: [2, 2, 2, 2, 3, 4, 3, 4, 5, 5, 5],
        // Lower limits of the rows
        lower: [
            -36.32463, // (35a) x - xhat in E, normal 1
            -0.7372383, // (35a) x - xhat in E, normal 2
            -33.127537, // (35a) x - xhat in E, normal 3
            -7.963802, // h4 >= -1.8 cm at step 0
            -8.182463, // h4 >= -1.8 cm at step 1
            -8.405127, // h4 >= -1.8 cm at step 2
            -2.8789396, // v2 >= -3 V at step 0, v2 <= 3 V at step 0
            -2.8810554, // v2 >= -3 V at step 1, v2 <= 3 V at step 1
            -2.883126, // v2 >= -3 V at step 2, v2 <= 3 V at step 2
            -36.961864, // (36) terminal set, normal 1
            -0.7113855, // (36) terminal set, normal 2
        ],
        // Upper limits of the rows
        upper: [
            36.32463, // (35a) x - xhat in E, normal 1
            0.7372383, // (35a) x - xhat in E, normal 2
            33.127537, // (35a) x - xhat in E, normal 3
            f32::INFINITY, // h4 >= -1.8 cm at step 0
            f32::INFINITY, // h4 >= -1.8 cm at step 1
            f32::INFINITY, // h4 >= -1.8 cm at step 2
            2.8789396, // v2 >= -3 V at step 0, v2 <= 3 V at step 0
            2.8810554, // v2 >= -3 V at step 1, v2 <= 3 V at step 1
            2.883126, // v2 >= -3 V at step 2, v2 <= 3 V at step 2
            36.961864, // (36) terminal set, normal 1
            0.7113855, // (36) terminal set, normal 2
        ],
        // What rounding may take of each row
        slack: &[0.0019031708, 0.0017252308, 0.001887186, 0.005930714, 0.0044119316, 0.0028046083, 0.005686453, 0.0041102837, 0.0025317536, 0.0019063578, 0.0017251018],
        // Offsets of the first rows, over e = x - xref
        tube: [
            [8.083428, 0.0], // (35a) x - xhat in E, normal 1
            [0.0, 4.838992], // (35a) x - xhat in E, normal 2
            [-7.4109807, -1.5406417], // (35a) x - xhat in E, normal 3
        ],
        // Offsets of the next rows, over xref_{t+k}, k the stage
        state: [
            StageRow { stage: 0, row: [0.0, 4.838992] }, // h4 >= -1.8 cm at step 0
            StageRow { stage: 1, row: [0.0, 4.9718556] }, // h4 >= -1.8 cm at step 1
            StageRow { stage: 2, row: [0.0, 5.107151] }, // h4 >= -1.8 cm at step 2
        ],
        // Offsets of the next rows, over uref_{t+k}, k the stage
        input: [
            StageRow { stage: 0, row: [1.000756] }, // v2 >= -3 V at step 0, v2 <= 3 V at step 0
            StageRow { stage: 1, row: [1.0014915] }, // v2 >= -3 V at step 1, v2 <= 3 V at step 1
            StageRow { stage: 2, row: [1.0022113] }, // v2 >= -3 V at step 2, v2 <= 3 V at step 2
        ],
        // The rows (36) over dx_N
        terminal: &[],
        // The row that asks the same one stage earlier
        shift: [0, 1, 2, 65535, 3, 4, 65535, 6, 7, 9, 10],
        // T'HT = I, v = T w by simulation: dx_0 = root w_x
        root: [
            [0.123095915, 0.012309791],
            [0.0, 0.20665461],
        ],
        // du_k = gain dx_k + spread w_k, dx_{k+1} = next dx_k + drive w_k
        stages: [
            Stage { next: [[0.9342221, -0.013080401], [-0.045547627, 0.9694161]], drive: [[0.029980399], [0.022653999]], gain: [[-1.9381969, -0.42059168]], spread: [[0.9639999]] }, // step 0
            Stage { next: [[0.9299248, -0.013977977], [-0.048794758, 0.96873784]], drive: [[0.029899416], [0.022592807]], gain: [[-2.0763726, -0.44945264]], spread: [[0.96139604]] }, // step 1
            Stage { next: [[0.9248573, -0.015055801], [-0.05262388, 0.9679234]], drive: [[0.029803393], [0.02252025]], gain: [[-2.239314, -0.48410934]], spread: [[0.95830846]] }, // step 2
        ],
        // Bounds of xhat_k, what they are multiplied by in their rows, and the rows
        x: Bounds {
            // Lower ends
            low: [[f32::NEG_INFINITY, -1.6457565], [f32::NEG_INFINITY, -1.6457565], [f32::NEG_INFINITY, -1.6457565]],
            // Upper ends
            high: [[f32::INFINITY, f32::INFINITY], [f32::INFINITY, f32::INFINITY], [f32::INFINITY, f32::INFINITY]],
            // Factors
            unit: [[0.0, 4.838992], [0.0, 4.9718556], [0.0, 5.107151]],
            // Rows
            row: [[65535, 3], [65535, 4], [65535, 5]],
        },
        // The same of uhat_k
        u: Bounds {
            // Lower ends
            low: [[-2.8767645], [-2.8767645], [-2.8767645]],
            // Upper ends
            high: [[2.8767645], [2.8767645], [2.8767645]],
            // Factors
            unit: [[1.000756], [1.0014915], [1.0022113]],
            // Rows
            row: [[6], [7], [8]],
        },
        // Whether these bounds are all state and input rows
        boxed: true,
        // Whether violated rows are looked for by the simulation
        staged: false,
        // Working-set changes before the shifted candidate (47) is used
        // 4 (rows + unknowns); `--iterations` looks closer
        max_iterations: 64,
    },
};

/// What each row of the i-DPC problem asks: the rows that a status speaks of.
#[rustfmt::skip]
pub static ROWS: [&str; NR] = [
    "(35a) x - xhat in E, normal 1",
    "(35a) x - xhat in E, normal 2",
    "(35a) x - xhat in E, normal 3",
    "h4 >= -1.8 cm at step 0",
    "h4 >= -1.8 cm at step 1",
    "h4 >= -1.8 cm at step 2",
    "v2 >= -3 V at step 0, v2 <= 3 V at step 0",
    "v2 >= -3 V at step 1, v2 <= 3 V at step 1",
    "v2 >= -3 V at step 2, v2 <= 3 V at step 2",
    "(36) terminal set, normal 1",
    "(36) terminal set, normal 2",
];

/// State at rest, (9), as a linear map of the outputs of the whole network at rest. One row per entry; columns
/// `left: h1 [cm]`, `right: h3 [cm]`.
#[rustfmt::skip]
pub static STEADY_X: [[f32; NETWORK_NY]; NX] = [
    [0.0, 1.0], // h3 [cm]
    [-0.15249562, 0.2814494], // h4 [cm]
];

/// Input at rest, (9), as a linear map of the outputs of the whole network at rest. One row per entry; columns
/// `left: h1 [cm]`, `right: h3 [cm]`.
#[rustfmt::skip]
pub static STEADY_U: [[f32; NETWORK_NY]; NU] = [
    [-0.13432594, 0.247915], // v2 [V]
];

/// E_i of (18): row and width. `|row . (x - xhat)| <= width` at every step.
#[rustfmt::skip]
pub static TUBE: [([f32; NX], f32); 3] = [
    ([1.0, 0.0], 4.494098),
    ([0.0, 1.0], 0.15286407),
    ([-0.9790677, -0.2035348], 4.3769164),
];

/// Z_i of (21): half-widths. `|z - zref|` stays below them, and neighbours rely on it. One per coupling output.
#[rustfmt::skip]
pub static Z_WIDTHS: [f32; NZ] = [
    0.04425575, // 0.0206 h4 + 0.000247 v2
];

/// X_i: row and limit, `row . x <= limit`, in the deviations the model is in.
#[rustfmt::skip]
pub static STATE_LIMITS: [([f32; NX], f32); 4] = [
    ([1.0, 0.0], 27.3), // h3 <= 27.3 cm
    ([-1.0, 0.0], 12.7), // h3 >= -12.7 cm
    ([0.0, 1.0], 38.2), // h4 <= 38.2 cm
    ([0.0, -1.0], 1.8), // h4 >= -1.8 cm
];

/// U_i: row and limit, `row . u <= limit`, in the deviations the model is in.
#[rustfmt::skip]
pub static INPUT_LIMITS: [([f32; NU], f32); 2] = [
    ([1.0], 3.0), // v2 <= 3 V
    ([-1.0], 3.0), // v2 >= -3 V
];
