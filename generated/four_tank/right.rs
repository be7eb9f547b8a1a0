// Controller of subsystem `right` of network `four-tank`.
//
// Written by dpc-codegen 0.1.0 from system.toml; do not edit. To make it again:
//
//     dpc-codegen system.toml --out four_tank
//
// Fits dpc-runtime 0.1. Numbers are in the units of system.toml, as deviations from its operating point.
//
// Takes, in bytes (`--measure`; opt-level 3, no link-time optimisation):
//
//     target                     rustc   code  constants  controller  inbox  step  start
//     x86_64-unknown-linux-gnu  1.95.0  42218       2328         992     72  1984    888
//     thumbv7em-none-eabihf     1.96.0  77678       2976         944     72  3056    964
//
// Code and constants are what a linker keeps of the functions below; step and start are the most stack of
// these, their own frames and all they call.
// x86_64-unknown-linux-gnu: no panic; calls memcpy, memmove, whose stack comes on top
// thumbv7em-none-eabihf: no panic, nothing else is needed

use dpc_runtime::tables::{
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
pub const NR: usize = 10;
/// tube rows (35a),
pub const NT: usize = 2;
/// state rows (35c),
pub const NS: usize = 3;
/// input rows (35d).
pub const NQ: usize = 3;
/// Outputs of the whole network.
pub const NETWORK_NY: usize = 2;

/// Seconds per step.
pub const SAMPLE_TIME: f64 = 0.5;
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
pub const DESIGN: u64 = 0x1faa8b9ba0128a6e;
/// Whose messages these are: of the subsystem at this place in the network, counted from 0.
pub const SENDER: Sender = Sender { design: DESIGN, place: 1 };
/// Length of a message of this subsystem as bytes, see [`to_bytes`]; little-endian:
///
/// | bytes | type | |
/// |---|---|---|
/// | 0 | u8 | version of this layout: 1 |
/// | 1 | u8 | bytes per number: 8 |
/// | 2, 3 | u16 | bit 0: the sender's step is certified; all others 0 |
/// | 4 to 7 | u32 | place of the sender in the network: 1 |
/// | 8 to 15 | u64 | fingerprint of the network's design |
/// | 16 to 23 | i64 | step, -1 for the message of the start |
/// | 24 to 27 | u32 | number of the start-up plan; 0: none |
/// | 28, 29 | u16 | number of outputs: 1 |
/// | 30, 31 | u16 | number of coupling outputs: 1 |
/// | 32 to 39 | f64 | yref of `h3 [cm]` |
/// | 40 to 47 | f64 | zref of `0.0206 h4 + 0.000247 v2` |
pub const MESSAGE_BYTES: usize = 48;

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
            [-0.0261177471, -0.00542952282], // v2 [V]
        ],
        // K_i^x of (7f): from xref to uref
        // columns: h3 [cm], h4 [cm]
        Kx: [
            [-4.46656051, -0.0216851133], // v2 [V]
        ],
        // K_i^e of (7f): from eref to uref
        // columns: sum of errors of h3 [cm]
        Ke: [
            [0.294791466], // v2 [V]
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
            3.00684e-9, // h3 [cm]
            4.26167e-10, // h4 [cm]
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
            0.9999990000010001, // h3 [cm]
        ],
        // Epsilon of (30), per step
        epsilon: 0.02,
        // Y_i of (31): lower ends
        y_min: [
            -1.0, // h3 [cm]
        ],
        // Y_i of (31): upper ends
        y_max: [
            4.14766, // h3 [cm]
        ],
        // (28): output and coefficient
        rows: [],
    },
    // i-DPC problem (33)-(36), lower <= V w + offset <= upper.
    problem: DpcProblem {
        // Rows of unit length in w: (35a), (35c), (35d), (35b), (36)
        V: [
            [0.0, -1.0, 0.0, 0.0, 0.0], // (35a) x - xhat in E, normal 1
            [0.912261484057051, 0.40960833085525367, 0.0, 0.0, 0.0], // (35a) x - xhat in E, normal 2
            [0.0, 1.0, 0.0, 0.0, 0.0], // h4 >= -1.8 cm at step 0
            [-0.027875836214336605, 0.9932456281784775, 0.11263241034308569, 0.0, 0.0], // h4 >= -1.8 cm at step 1
            [-0.056397209284049184, 0.9861858797362166, 0.10460926009234311, 0.11538486944486333, 0.0], // h4 >= -1.8 cm at step 2
            [-0.23876450371058464, -0.11085975937569174, 0.9647287833992525, 0.0, 0.0], // v2 >= -3 V at step 0, v2 <= 3 V at step 0
            [-0.2366130419513809, -0.10821570035532238, -0.07254041103354784, 0.9628299534924146, 0.0], // v2 >= -3 V at step 1, v2 <= 3 V at step 1
            [-0.23482072590546146, -0.105780031129053, -0.0717962745981505, -0.0780638133450909, 0.9604275858696576], // v2 >= -3 V at step 2, v2 <= 3 V at step 2
            [0.9012237749768365, 0.018870514448344495, 0.22891925192195758, 0.2482740581519547, 0.2709161849155682], // (36) terminal set, normal 1
            [-0.08559976814727456, 0.9788264941139339, 0.09637870715855056, 0.10644523740630192, 0.11811828966641894], // (36) terminal set, normal 2
        ],
        // V V': products of so few rows are looked up instead of computed
        gram: &[
            [1.0, -0.40960833085525367, -1.0, -0.9932456281784775, -0.9861858797362166, 0.11085975937569174, 0.10821570035532238, 0.105780031129053, -0.018870514448344495, -0.9788264941139339], // (35a) x - xhat in E, normal 1
            [-0.40960833085525367, 1.0, 0.40960833085525367, 0.38141163217324203, 0.3525009502736288, -0.2632247414920554, -0.26017901719269587, -0.2575462858904584, 0.829881258353433, 0.32284611492593607], // (35a) x - xhat in E, normal 2
            [-1.0, 0.40960833085525367, 1.0, 0.9932456281784775, 0.9861858797362166, -0.11085975937569174, -0.10821570035532238, -0.105780031129053, 0.018870514448344495, 0.9788264941139339], // h4 >= -1.8 cm at step 0
            [-0.9932456281784775, 0.38141163217324203, 0.9932456281784775, 1.0000000000000002, 0.9928793260966982, 0.005204517060020258, -0.10905938621657008, -0.10660631683408663, 0.019404416751482655, 0.9854566672338076], // h4 >= -1.8 cm at step 1
            [-0.9861858797362166, 0.3525009502736288, 0.9861858797362166, 0.9928793260966982, 0.9999999999999999, 0.005056886579288267, 0.010131129346395346, -0.10759347750869756, 0.02037747239404448, 0.9924967303114006], // h4 >= -1.8 cm at step 2
            [0.11085975937569174, -0.2632247414920554, -0.11085975937569174, 0.005204517060020258, 0.005056886579288267, 0.9999999999999999, -0.0014902604486401183, -0.0014703297661756431, 0.003572763347774177, 0.004905029454063764], // v2 >= -3 V at step 0, v2 <= 3 V at step 0
            [0.10821570035532238, -0.26017901719269587, -0.10821570035532238, -0.10905938621657008, 0.010131129346395346, -0.0014902604486401183, 1.0000000000000002, -0.002945340080506148, 0.0071564184226396155, 0.009826938894010886], // v2 >= -3 V at step 1, v2 <= 3 V at step 1
            [0.105780031129053, -0.2575462858904584, -0.105780031129053, -0.10660631683408663, -0.10759347750869756, -0.0014703297661756431, -0.002945340080506148, 1.0, 0.010756463596594323, 0.014775213198810658], // v2 >= -3 V at step 2, v2 <= 3 V at step 2
            [-0.018870514448344495, 0.829881258353433, 0.018870514448344495, 0.019404416751482655, 0.02037747239404448, 0.003572763347774177, 0.0071564184226396155, 0.010756463596594323, 1.0, 0.02181710232370047], // (36) terminal set, normal 1
            [-0.9788264941139339, 0.32284611492593607, 0.9788264941139339, 0.9854566672338076, 0.9924967303114006, 0.004905029454063764, 0.009826938894010886, 0.014775213198810658, 0.02181710232370047, 0.9999999999999997], // (36) terminal set, normal 2
        ],
        // Entries of each row before its last zeros
        extent: [2, 2, 2, 3, 4, 3, 4, 5, 5, 5],
        // Lower limits of the rows
        lower: [
            -0.6556752656878678, // (35a) x - xhat in E, normal 1
            -33.86649386350841, // (35a) x - xhat in E, normal 2
            -8.054510143420568, // h4 >= -1.8 cm at step 0
            -8.275662025022337, // h4 >= -1.8 cm at step 1
            -8.500861158640474, // h4 >= -1.8 cm at step 2
            -2.8828257860334814, // v2 >= -3 V at step 0, v2 <= 3 V at step 0
            -2.8849443941269954, // v2 >= -3 V at step 1, v2 <= 3 V at step 1
            -2.8870178279129424, // v2 >= -3 V at step 2, v2 <= 3 V at step 2
            -41.39626581186901, // (36) terminal set, normal 1
            -0.7039166234860047, // (36) terminal set, normal 2
        ],
        // Upper limits of the rows
        upper: [
            0.6556752656878678, // (35a) x - xhat in E, normal 1
            33.86649386350841, // (35a) x - xhat in E, normal 2
            f64::INFINITY, // h4 >= -1.8 cm at step 0
            f64::INFINITY, // h4 >= -1.8 cm at step 1
            f64::INFINITY, // h4 >= -1.8 cm at step 2
            2.8828257860334814, // v2 >= -3 V at step 0, v2 <= 3 V at step 0
            2.8849443941269954, // v2 >= -3 V at step 1, v2 <= 3 V at step 1
            2.8870178279129424, // v2 >= -3 V at step 2, v2 <= 3 V at step 2
            41.39626581186901, // (36) terminal set, normal 1
            0.7039166234860047, // (36) terminal set, normal 2
        ],
        // What rounding may take of each row besides 1e-9 of its magnitude: nothing
        slack: &[],
        // Offsets of the first rows, over e = x - xref
        tube: [
            [0.0, 4.838991893949143], // (35a) x - xhat in E, normal 1
            [-7.41098086117606, -1.5406416774875147], // (35a) x - xhat in E, normal 2
        ],
        // Offsets of the next rows, over xref_{t+k}, k the stage
        state: [
            StageRow { stage: 0, row: [0.0, 4.838991893949143] }, // h4 >= -1.8 cm at step 0
            StageRow { stage: 1, row: [0.0, 4.971855611710642] }, // h4 >= -1.8 cm at step 1
            StageRow { stage: 2, row: [0.0, 5.107150839191695] }, // h4 >= -1.8 cm at step 2
        ],
        // Offsets of the next rows, over uref_{t+k}, k the stage
        input: [
            StageRow { stage: 0, row: [1.0007560587705637] }, // v2 >= -3 V at step 0, v2 <= 3 V at step 0
            StageRow { stage: 1, row: [1.001491521140859] }, // v2 >= -3 V at step 1, v2 <= 3 V at step 1
            StageRow { stage: 2, row: [1.0022113015153091] }, // v2 >= -3 V at step 2, v2 <= 3 V at step 2
        ],
        // The rows (36) over dx_N
        terminal: &[],
        // The row that asks the same one stage earlier
        shift: [0, 1, 65535, 2, 3, 65535, 5, 6, 8, 9],
        // T'HT = I, v = T w by simulation: dx_0 = root w_x
        root: [
            [0.12309591687601293, 0.012309790299724878],
            [0.0, 0.20665461358809828],
        ],
        // du_k = gain dx_k + spread w_k, dx_{k+1} = next dx_k + drive w_k
        stages: [
            Stage { next: [[0.9342220775210662, -0.013080400967641447], [-0.04554762631044837, 0.9694160957318464]], drive: [[0.029980398220697], [0.022653998655510595]], gain: [[-1.9381968642743987, -0.4205916709852555]], spread: [[0.963999942787685]] }, // step 0
            Stage { next: [[0.9299248123604668, -0.01397797699452781], [-0.04879475593340939, 0.9687378630427201]], drive: [[0.02989941594263631], [0.02259280625890525]], gain: [[-2.0763725929110377, -0.4494526364799939]], spread: [[0.9613960110172448]] }, // step 1
            Stage { next: [[0.9248573324599811, -0.015055800884860927], [-0.05262388061705608, 0.9679234301995423]], drive: [[0.029803393631048655], [0.022520249206740946]], gain: [[-2.239314068810897, -0.48410935321096227]], spread: [[0.9583084768825935]] }, // step 2
        ],
        // Bounds of xhat_k, what they are multiplied by in their rows, and the rows
        x: Bounds {
            // Lower ends
            low: [[f64::NEG_INFINITY, -1.6645016813299955], [f64::NEG_INFINITY, -1.6645016813299955], [f64::NEG_INFINITY, -1.6645016813299955]],
            // Upper ends
            high: [[f64::INFINITY, f64::INFINITY], [f64::INFINITY, f64::INFINITY], [f64::INFINITY, f64::INFINITY]],
            // Factors
            unit: [[0.0, 4.838991893949143], [0.0, 4.971855611710642], [0.0, 5.107150839191695]],
            // Rows
            row: [[65535, 2], [65535, 3], [65535, 4]],
        },
        // The same of uhat_k
        u: Bounds {
            // Lower ends
            low: [[-2.8806478469638788], [-2.8806478469638788], [-2.880647846963879]],
            // Upper ends
            high: [[2.8806478469638788], [2.8806478469638788], [2.880647846963879]],
            // Factors
            unit: [[1.0007560587705637], [1.001491521140859], [1.0022113015153091]],
            // Rows
            row: [[5], [6], [7]],
        },
        // Whether these bounds are all state and input rows
        boxed: true,
        // Whether violated rows are looked for by the simulation
        staged: false,
        // Working-set changes before the shifted candidate (47) is used
        // 4 (rows + unknowns); `--iterations` looks closer
        max_iterations: 60,
    },
};

/// What each row of the i-DPC problem asks: the rows that a status speaks of.
#[rustfmt::skip]
pub static ROWS: [&str; NR] = [
    "(35a) x - xhat in E, normal 1",
    "(35a) x - xhat in E, normal 2",
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
pub static STEADY_X: [[f64; NETWORK_NY]; NX] = [
    [0.0, 1.0], // h3 [cm]
    [-0.1524956272512729, 0.28144939613959724], // h4 [cm]
];

/// Input at rest, (9), as a linear map of the outputs of the whole network at rest. One row per entry; columns
/// `left: h1 [cm]`, `right: h3 [cm]`.
#[rustfmt::skip]
pub static STEADY_U: [[f64; NETWORK_NY]; NU] = [
    [-0.1343259354936746, 0.2479150000038155], // v2 [V]
];

/// E_i of (18): row and width. `|row . (x - xhat)| <= width` at every step.
#[rustfmt::skip]
pub static TUBE: [([f64; NX], f64); 2] = [
    ([0.0, 1.0], 0.13549831867),
    ([-0.9790677118505791, -0.2035348019668168], 4.474116352),
];

/// Z_i of (21): half-widths. `|z - zref|` stays below them, and neighbours rely on it. One per coupling output.
#[rustfmt::skip]
pub static Z_WIDTHS: [f64; NZ] = [
    0.046421988948, // 0.0206 h4 + 0.000247 v2
];

/// X_i: row and limit, `row . x <= limit`, in the deviations the model is in.
#[rustfmt::skip]
pub static STATE_LIMITS: [([f64; NX], f64); 4] = [
    ([1.0, 0.0], 27.3), // h3 <= 27.3 cm
    ([-1.0, 0.0], 12.7), // h3 >= -12.7 cm
    ([0.0, 1.0], 38.2), // h4 <= 38.2 cm
    ([0.0, -1.0], 1.8), // h4 >= -1.8 cm
];

/// U_i: row and limit, `row . u <= limit`, in the deviations the model is in.
#[rustfmt::skip]
pub static INPUT_LIMITS: [([f64; NU], f64); 2] = [
    ([1.0], 3.0), // v2 <= 3 V
    ([-1.0], 3.0), // v2 >= -3 V
];
