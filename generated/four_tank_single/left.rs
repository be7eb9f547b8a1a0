// Controller of subsystem `left` of network `four-tank`.
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
pub const NAME: &str = "left";
/// Names of the states, with units.
pub const STATES: [&str; NX] = ["h1 [cm]", "h2 [cm]"];
/// Names of the inputs, with units.
pub const INPUTS: [&str; NU] = ["v1 [V]"];
/// Names of the outputs, with units.
pub const OUTPUTS: [&str; NY] = ["h1 [cm]"];
/// What the neighbours hear.
pub const COUPLING_OUTPUTS: [&str; NZ] = ["0.0165 h2 + 0.00013 v1"];

/// Fingerprint of the whole network's design. Controllers of any other refuse this one's messages, and this one theirs.
pub const DESIGN: u64 = 0x21a0a199845ed419;
/// Whose messages these are: of the subsystem at this place in the network, counted from 0.
pub const SENDER: Sender = Sender { design: DESIGN, place: 0 };
/// Length of a message of this subsystem as bytes, see [`to_bytes`]; little-endian:
///
/// | bytes | type | |
/// |---|---|---|
/// | 0 | u8 | version of this layout: 1 |
/// | 1 | u8 | bytes per number: 4 |
/// | 2, 3 | u16 | bit 0: the sender's step is certified; all others 0 |
/// | 4 to 7 | u32 | place of the sender in the network: 0 |
/// | 8 to 15 | u64 | fingerprint of the network's design |
/// | 16 to 23 | i64 | step, -1 for the message of the start |
/// | 24 to 27 | u32 | number of the start-up plan; 0: none |
/// | 28, 29 | u16 | number of outputs: 1 |
/// | 30, 31 | u16 | number of coupling outputs: 1 |
/// | 32 to 35 | f32 | yref of `h1 [cm]` |
/// | 36 to 39 | f32 | zref of `0.0165 h2 + 0.00013 v1` |
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

/// Where the messages of `right` go: `0.0206 h4 + 0.000247 v2`.
pub const FROM_RIGHT: Link<1, 1> = Link {
    slot: 0,
    z: Some(0),
    y: None,
    sender: Sender { design: DESIGN, place: 1 },
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
        1 => inbox.accept_bytes(&FROM_RIGHT, bytes),
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
            [-0.024597771, -0.0044868286], // v1 [V]
        ],
        // K_i^x of (7f): from xref to uref
        // columns: h1 [cm], h2 [cm]
        Kx: [
            [-3.8272405, -0.01082615], // v1 [V]
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
        // Largest |x+ - x| of a state that references start from
        drift: [
            4.3848897e-5, // h1 [cm]
            5.8904698e-5, // h2 [cm]
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
            0.999999, // h1 [cm]
        ],
        // Epsilon of (30), per step
        epsilon: 0.019978613,
        // Y_i of (31): lower ends
        y_min: [
            -0.99999696, // h1 [cm]
        ],
        // Y_i of (31): upper ends
        y_max: [
            3.7095988, // h1 [cm]
        ],
        // (28): output and coefficient
        rows: [],
    },
    // i-DPC problem (33)-(36), lower <= V w + offset <= upper.
    problem: DpcProblem {
        // Rows of unit length in w: (35a), (35c), (35d), (35b), (36)
        V: [
            [-0.99652916, -0.083244525, 0.0, 0.0, 0.0], // (35a) x - xhat in E, normal 1
            [0.0, -1.0, 0.0, 0.0, 0.0], // (35a) x - xhat in E, normal 2
            [0.95612675, 0.2929533, 0.0, 0.0, 0.0], // (35a) x - xhat in E, normal 3
            [0.0, 1.0, 0.0, 0.0, 0.0], // h2 >= -1.4 cm at step 0
            [-0.023202963, 0.99624836, 0.083371654, 0.0, 0.0], // h2 >= -1.4 cm at step 1
            [-0.046628345, 0.9923775, 0.076348715, 0.084756, 0.0], // h2 >= -1.4 cm at step 2
            [-0.26718634, -0.08327727, 0.9600398, 0.0, 0.0], // v1 >= -3 V at step 0, v1 <= 3 V at step 0
            [-0.26378167, -0.08154195, -0.082509845, 0.95758146, 0.0], // v1 >= -3 V at step 1, v1 <= 3 V at step 1
            [-0.2609088, -0.079987854, -0.081551075, -0.08972757, 0.9543725], // v1 >= -3 V at step 2, v1 <= 3 V at step 2
            [0.8758284, 0.016317746, 0.2509759, 0.27595082, 0.30581143], // (36) terminal set, normal 1
            [-0.07031537, 0.988398, 0.069241434, 0.07693858, 0.086088106], // (36) terminal set, normal 2
        ],
        // V V': products of so few rows are looked up instead of computed
        gram: &[
            [1.0, 0.083244525, -0.97719496, -0.083244525, -0.059809797, -0.03614349, 0.27319136, 0.26965404, 0.2666618, -0.8741469, -0.012207413], // (35a) x - xhat in E, normal 1
            [0.083244525, 1.0, -0.2929533, -1.0, -0.99624836, -0.9923775, 0.08327727, 0.08154195, 0.079987854, -0.016317746, -0.988398], // (35a) x - xhat in E, normal 2
            [-0.97719496, -0.2929533, 1.0, 0.2929533, 0.26966926, 0.24613765, -0.27986035, -0.2760967, -0.2728946, 0.8421833, 0.22232406], // (35a) x - xhat in E, normal 3
            [-0.083244525, -1.0, 0.2929533, 1.0, 0.99624836, 0.9923775, -0.08327727, -0.08154195, -0.079987854, 0.016317746, 0.988398], // h2 >= -1.4 cm at step 0
            [-0.059809797, -0.99624836, 0.26966926, 0.99624836, 1.0, 0.9961017, 0.003274772, -0.0819945, -0.08043296, 0.01685899, 0.9920942], // h2 >= -1.4 cm at step 1
            [-0.03614349, -0.9923775, 0.24613765, 0.9923775, 0.9961017, 1.0, 0.0031137709, 0.006240565, -0.08104367, 0.017905112, 0.99595016], // h2 >= -1.4 cm at step 2
            [0.27319136, 0.08327727, -0.27986035, -0.08327727, 0.003274772, 0.0031137709, 1.0, -0.0019432865, -0.001919835, 0.0055785677, 0.0029507473], // v1 >= -3 V at step 0, v1 <= 3 V at step 0
            [0.26965404, 0.08154195, -0.2760967, -0.08154195, -0.0819945, 0.006240565, -0.0019432865, 1.0, -0.0038473685, 0.011179371, 0.0059138653], // v1 >= -3 V at step 1, v1 <= 3 V at step 1
            [0.2666618, 0.079987854, -0.2728946, -0.079987854, -0.08043296, -0.08104367, -0.001919835, -0.0038473685, 1.0, 0.016813729, 0.008895956], // v1 >= -3 V at step 2, v1 <= 3 V at step 2
            [-0.8741469, -0.016317746, 0.8421833, 0.016317746, 0.01685899, 0.017905112, 0.0055785677, 0.011179371, 0.016813729, 1.0, 0.019480156], // (36) terminal set, normal 1
            [-0.012207413, -0.988398, 0.22232406, 0.988398, 0.9920942, 0.99595016, 0.0029507473, 0.0059138653, 0.008895956, 0.019480156, 1.0], // (36) terminal set, normal 2
        ],
        // Entries of each row before its last zeros
        extent: [2, 2, 2, 2, 3, 4, 3, 4, 5, 5, 5],
        // Lower limits of the rows
        lower: [
            -33.285023, // (35a) x - xhat in E, normal 1
            -0.763282, // (35a) x - xhat in E, normal 2
            -31.825325, // (35a) x - xhat in E, normal 3
            -6.8737707, // h2 >= -1.4 cm at step 0
            -7.0134153, // h2 >= -1.4 cm at step 1
            -7.1550317, // h2 >= -1.4 cm at step 2
            -2.8742633, // v1 >= -3 V at step 0, v1 <= 3 V at step 0
            -2.877021, // v1 >= -3 V at step 1, v1 <= 3 V at step 1
            -2.8797312, // v1 >= -3 V at step 2, v1 <= 3 V at step 2
            -35.225155, // (36) terminal set, normal 1
            -0.721474, // (36) terminal set, normal 2
        ],
        // Upper limits of the rows
        upper: [
            33.285023, // (35a) x - xhat in E, normal 1
            0.763282, // (35a) x - xhat in E, normal 2
            31.825325, // (35a) x - xhat in E, normal 3
            f32::INFINITY, // h2 >= -1.4 cm at step 0
            f32::INFINITY, // h2 >= -1.4 cm at step 1
            f32::INFINITY, // h2 >= -1.4 cm at step 2
            2.8742633, // v1 >= -3 V at step 0, v1 <= 3 V at step 0
            2.877021, // v1 >= -3 V at step 1, v1 <= 3 V at step 1
            2.8797312, // v1 >= -3 V at step 2, v1 <= 3 V at step 2
            35.225155, // (36) terminal set, normal 1
            0.721474, // (36) terminal set, normal 2
        ],
        // What rounding may take of each row
        slack: &[0.0015921817, 0.0014295711, 0.0015848838, 0.0058224276, 0.004196028, 0.0025008419, 0.0051149516, 0.0036494874, 0.0021811684, 0.0016018832, 0.0014293622],
        // Offsets of the first rows, over e = x - xref
        tube: [
            [6.6493435, 0.0], // (35a) x - xhat in E, normal 1
            [0.0, 5.46132], // (35a) x - xhat in E, normal 2
            [-6.3797584, -1.1637186], // (35a) x - xhat in E, normal 3
        ],
        // Offsets of the next rows, over xref_{t+k}, k the stage
        state: [
            StageRow { stage: 0, row: [0.0, 5.46132] }, // h2 >= -1.4 cm at step 0
            StageRow { stage: 1, row: [0.0, 5.5722694] }, // h2 >= -1.4 cm at step 1
            StageRow { stage: 2, row: [0.0, 5.684786] }, // h2 >= -1.4 cm at step 2
        ],
        // Offsets of the next rows, over uref_{t+k}, k the stage
        input: [
            StageRow { stage: 0, row: [1.0009849] }, // v1 >= -3 V at step 0, v1 <= 3 V at step 0
            StageRow { stage: 1, row: [1.0019453] }, // v1 >= -3 V at step 1, v1 <= 3 V at step 1
            StageRow { stage: 2, row: [1.0028892] }, // v1 >= -3 V at step 2, v1 <= 3 V at step 2
        ],
        // The rows (36) over dx_N
        terminal: &[],
        // The row that asks the same one stage earlier
        shift: [0, 1, 2, 65535, 3, 4, 65535, 6, 7, 9, 10],
        // T'HT = I, v = T w by simulation: dx_0 = root w_x
        root: [
            [0.1498688, 0.01251921],
            [0.0, 0.18310592],
        ],
        // du_k = gain dx_k + spread w_k, dx_{k+1} = next dx_k + drive w_k
        stages: [
            Stage { next: [[0.9178303, -0.013868737], [-0.027784342, 0.9783117]], drive: [[0.03999427], [0.014961885]], gain: [[-1.7810476, -0.33258364]], spread: [[0.9590952]] }, // step 0
            Stage { next: [[0.91183597, -0.0149633465], [-0.030026827, 0.9779022]], drive: [[0.03985362], [0.014909268]], gain: [[-1.9247966, -0.35883325]], spread: [[0.95572233]] }, // step 1
            Stage { next: [[0.9045843, -0.016301548], [-0.03273968, 0.97740155]], drive: [[0.039682686], [0.014845322]], gain: [[-2.0986974, -0.39092442]], spread: [[0.9516232]] }, // step 2
        ],
        // Bounds of xhat_k, what they are multiplied by in their rows, and the rows
        x: Bounds {
            // Lower ends
            low: [[f32::NEG_INFINITY, -1.2586281], [f32::NEG_INFINITY, -1.2586281], [f32::NEG_INFINITY, -1.2586281]],
            // Upper ends
            high: [[f32::INFINITY, f32::INFINITY], [f32::INFINITY, f32::INFINITY], [f32::INFINITY, f32::INFINITY]],
            // Factors
            unit: [[0.0, 5.46132], [0.0, 5.5722694], [0.0, 5.684786]],
            // Rows
            row: [[65535, 3], [65535, 4], [65535, 5]],
        },
        // The same of uhat_k
        u: Bounds {
            // Lower ends
            low: [[-2.8714352], [-2.8714352], [-2.8714352]],
            // Upper ends
            high: [[2.8714352], [2.8714352], [2.8714352]],
            // Factors
            unit: [[1.0009849], [1.0019453], [1.0028892]],
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
    "h2 >= -1.4 cm at step 0",
    "h2 >= -1.4 cm at step 1",
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
pub static STEADY_X: [[f32; NETWORK_NY]; NX] = [
    [1.0, 0.0], // h1 [cm]
    [0.2510916, -0.13284187], // h2 [cm]
];

/// Input at rest, (9), as a linear map of the outputs of the whole network at rest. One row per entry; columns
/// `left: h1 [cm]`, `right: h3 [cm]`.
#[rustfmt::skip]
pub static STEADY_U: [[f32; NETWORK_NY]; NU] = [
    [0.26557767, -0.14050582], // v1 [V]
];

/// E_i of (18): row and width. `|row . (x - xhat)| <= width` at every step.
#[rustfmt::skip]
pub static TUBE: [([f32; NX], f32); 3] = [
    ([1.0, 0.0], 5.006153),
    ([0.0, 1.0], 0.14016448),
    ([-0.9837676, -0.17944703], 4.907929),
];

/// Z_i of (21): half-widths. `|z - zref|` stays below them, and neighbours rely on it. One per coupling output.
#[rustfmt::skip]
pub static Z_WIDTHS: [f32; NZ] = [
    0.027953286, // 0.0165 h2 + 0.00013 v1
];

/// X_i: row and limit, `row . x <= limit`, in the deviations the model is in.
#[rustfmt::skip]
pub static STATE_LIMITS: [([f32; NX], f32); 4] = [
    ([1.0, 0.0], 27.6), // h1 <= 27.6 cm
    ([-1.0, 0.0], 12.4), // h1 >= -12.4 cm
    ([0.0, 1.0], 38.6), // h2 <= 38.6 cm
    ([0.0, -1.0], 1.4), // h2 >= -1.4 cm
];

/// U_i: row and limit, `row . u <= limit`, in the deviations the model is in.
#[rustfmt::skip]
pub static INPUT_LIMITS: [([f32; NU], f32); 2] = [
    ([1.0], 3.0), // v1 <= 3 V
    ([-1.0], 3.0), // v1 >= -3 V
];
