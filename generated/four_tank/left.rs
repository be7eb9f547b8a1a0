// Controller of subsystem `left` of network `four-tank`.
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
//     x86_64-unknown-linux-gnu  1.95.0  42714       2496         992     72  2016    888
//     thumbv7em-none-eabihf     1.96.0  78170       3232         944     72  3128    964
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
pub const NR: usize = 11;
/// tube rows (35a),
pub const NT: usize = 2;
/// state rows (35c),
pub const NS: usize = 4;
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

/// Fingerprint of the whole network's design. Controllers of any other refuse this one's messages, and this one theirs.
pub const DESIGN: u64 = 0x1faa8b9ba0128a6e;
/// Whose messages these are: of the subsystem at this place in the network, counted from 0.
pub const SENDER: Sender = Sender { design: DESIGN, place: 0 };
/// Length of a message of this subsystem as bytes, see [`to_bytes`]; little-endian:
///
/// | bytes | type | |
/// |---|---|---|
/// | 0 | u8 | version of this layout: 1 |
/// | 1 | u8 | bytes per number: 8 |
/// | 2, 3 | u16 | bit 0: the sender's step is certified; all others 0 |
/// | 4 to 7 | u32 | place of the sender in the network: 0 |
/// | 8 to 15 | u64 | fingerprint of the network's design |
/// | 16 to 23 | i64 | step, -1 for the message of the start |
/// | 24 to 27 | u32 | number of the start-up plan; 0: none |
/// | 28, 29 | u16 | number of outputs: 1 |
/// | 30, 31 | u16 | number of coupling outputs: 1 |
/// | 32 to 39 | f64 | yref of `h1 [cm]` |
/// | 40 to 47 | f64 | zref of `0.0165 h2 + 0.00013 v1` |
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
        // Largest |x+ - x| of a state that references start from
        drift: [
            2.93581e-9, // h1 [cm]
            3.31463e-10, // h2 [cm]
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
            3.95188, // h1 [cm]
        ],
        // (28): output and coefficient
        rows: [],
    },
    // i-DPC problem (33)-(36), lower <= V w + offset <= upper.
    problem: DpcProblem {
        // Rows of unit length in w: (35a), (35c), (35d), (35b), (36)
        V: [
            [-0.9965291508870844, -0.08324452794188075, 0.0, 0.0, 0.0], // (35a) x - xhat in E, normal 1
            [0.0, -1.0, 0.0, 0.0, 0.0], // (35a) x - xhat in E, normal 2
            [0.9965291508870844, 0.08324452794188075, 0.0, 0.0, 0.0], // h1 >= -12.4 cm at step 0
            [0.0, 1.0, 0.0, 0.0, 0.0], // h2 >= -1.4 cm at step 0
            [-0.023202963184688754, 0.9962483574341257, 0.08337165471103776, 0.0, 0.0], // h2 >= -1.4 cm at step 1
            [-0.04662834594623166, 0.9923774943090963, 0.07634871821599334, 0.08475599902008754, 0.0], // h2 >= -1.4 cm at step 2
            [-0.26718634114127693, -0.08327727335464563, 0.9600397673274544, 0.0, 0.0], // v1 >= -3 V at step 0, v1 <= 3 V at step 0
            [-0.2637816644199792, -0.08154194461823432, -0.08250984775871968, 0.9575814690179292, 0.0], // v1 >= -3 V at step 1, v1 <= 3 V at step 1
            [-0.26090880912727116, -0.07998785419935034, -0.08155107541837237, -0.08972757214434035, 0.9543725275779693], // v1 >= -3 V at step 2, v1 <= 3 V at step 2
            [0.8758283686399616, 0.016317745549369118, 0.25097589785082225, 0.27595082854467634, 0.30581144319519793], // (36) terminal set, normal 1
            [-0.07031536881109073, 0.988398029991297, 0.06924143794777243, 0.07693857985772068, 0.0860881026546951], // (36) terminal set, normal 2
        ],
        // V V': products of so few rows are looked up instead of computed
        gram: &[
            [0.9999999999999999, 0.08324452794188075, -0.9999999999999999, -0.08324452794188075, -0.05980979502697572, -0.036143490060839716, 0.273191354974838, 0.2696540387512316, 0.2666617851824688, -0.8741468635489342, -0.01220741264968199], // (35a) x - xhat in E, normal 1
            [0.08324452794188075, 1.0, -0.08324452794188075, -1.0, -0.9962483574341257, -0.9923774943090963, 0.08327727335464563, 0.08154194461823432, 0.07998785419935034, -0.016317745549369118, -0.988398029991297], // (35a) x - xhat in E, normal 2
            [-0.9999999999999999, -0.08324452794188075, 0.9999999999999999, 0.08324452794188075, 0.05980979502697572, 0.036143490060839716, -0.273191354974838, -0.2696540387512316, -0.2666617851824688, 0.8741468635489342, 0.01220741264968199], // h1 >= -12.4 cm at step 0
            [-0.08324452794188075, -1.0, 0.08324452794188075, 1.0, 0.9962483574341257, 0.9923774943090963, -0.08327727335464563, -0.08154194461823432, -0.07998785419935034, 0.016317745549369118, 0.988398029991297], // h2 >= -1.4 cm at step 0
            [-0.05980979502697572, -0.9962483574341257, 0.05980979502697572, 0.9962483574341257, 0.9999999999999998, 0.9961016834271179, 0.0032747720362839156, -0.08199449467716796, -0.0804329589691364, 0.016858989703339395, 0.9920942120400743], // h2 >= -1.4 cm at step 1
            [-0.036143490060839716, -0.9923774943090963, 0.036143490060839716, 0.9923774943090963, 0.9961016834271179, 1.0, 0.0031137709540980663, 0.006240564954675704, -0.08104367020717597, 0.017905111536331782, 0.9959501509588433], // h2 >= -1.4 cm at step 2
            [0.273191354974838, 0.08327727335464563, -0.273191354974838, -0.08327727335464563, 0.0032747720362839156, 0.0031137709540980663, 1.0, -0.0019432864561324675, -0.001919834988503677, 0.005578567936211171, 0.002950747168654136], // v1 >= -3 V at step 0, v1 <= 3 V at step 0
            [0.2696540387512316, 0.08154194461823432, -0.2696540387512316, -0.08154194461823432, -0.08199449467716796, 0.006240564954675704, -0.0019432864561324675, 1.0, -0.003847368417378816, 0.011179371121781245, 0.005913865417615849], // v1 >= -3 V at step 1, v1 <= 3 V at step 1
            [0.2666617851824688, 0.07998785419935034, -0.2666617851824688, -0.07998785419935034, -0.0804329589691364, -0.08104367020717597, -0.001919834988503677, -0.003847368417378816, 1.0, 0.016813729640510533, 0.008895956047908563], // v1 >= -3 V at step 2, v1 <= 3 V at step 2
            [-0.8741468635489342, -0.016317745549369118, 0.8741468635489342, 0.016317745549369118, 0.016858989703339395, 0.017905111536331782, 0.005578567936211171, 0.011179371121781245, 0.016813729640510533, 1.0, 0.019480156629742465], // (36) terminal set, normal 1
            [-0.01220741264968199, -0.988398029991297, 0.01220741264968199, 0.988398029991297, 0.9920942120400743, 0.9959501509588433, 0.002950747168654136, 0.005913865417615849, 0.008895956047908563, 0.019480156629742465, 1.0], // (36) terminal set, normal 2
        ],
        // Entries of each row before its last zeros
        extent: [2, 2, 2, 2, 3, 4, 3, 4, 5, 5, 5],
        // Lower limits of the rows
        lower: [
            -34.599736027171204, // (35a) x - xhat in E, normal 1
            -0.6581066975494319, // (35a) x - xhat in E, normal 2
            -47.85212573413087, // h1 >= -12.4 cm at step 0
            -6.987741258647734, // h2 >= -1.4 cm at step 0
            -7.12970084304599, // h2 >= -1.4 cm at step 1
            -7.273665384959819, // h2 >= -1.4 cm at step 2
            -2.874293305318049, // v1 >= -3 V at step 0, v1 <= 3 V at step 0
            -2.877051114957887, // v1 >= -3 V at step 1, v1 <= 3 V at step 1
            -2.8797612241782145, // v1 >= -3 V at step 2, v1 <= 3 V at step 2
            -40.48587532607268, // (36) terminal set, normal 1
            -0.705551291214264, // (36) terminal set, normal 2
        ],
        // Upper limits of the rows
        upper: [
            34.599736027171204, // (35a) x - xhat in E, normal 1
            0.6581066975494319, // (35a) x - xhat in E, normal 2
            f64::INFINITY, // h1 >= -12.4 cm at step 0
            f64::INFINITY, // h2 >= -1.4 cm at step 0
            f64::INFINITY, // h2 >= -1.4 cm at step 1
            f64::INFINITY, // h2 >= -1.4 cm at step 2
            2.874293305318049, // v1 >= -3 V at step 0, v1 <= 3 V at step 0
            2.877051114957887, // v1 >= -3 V at step 1, v1 <= 3 V at step 1
            2.8797612241782145, // v1 >= -3 V at step 2, v1 <= 3 V at step 2
            40.48587532607268, // (36) terminal set, normal 1
            0.705551291214264, // (36) terminal set, normal 2
        ],
        // What rounding may take of each row besides 1e-9 of its magnitude: nothing
        slack: &[],
        // Offsets of the first rows, over e = x - xref
        tube: [
            [6.64934369042765, 0.0], // (35a) x - xhat in E, normal 1
            [0.0, 5.461319968712276], // (35a) x - xhat in E, normal 2
        ],
        // Offsets of the next rows, over xref_{t+k}, k the stage
        state: [
            StageRow { stage: 0, row: [6.64934369042765, 0.0] }, // h1 >= -12.4 cm at step 0
            StageRow { stage: 0, row: [0.0, 5.461319968712276] }, // h2 >= -1.4 cm at step 0
            StageRow { stage: 1, row: [0.0, 5.572269513683597] }, // h2 >= -1.4 cm at step 1
            StageRow { stage: 2, row: [0.0, 5.6847860477735646] }, // h2 >= -1.4 cm at step 2
        ],
        // Offsets of the next rows, over uref_{t+k}, k the stage
        input: [
            StageRow { stage: 0, row: [1.000984871857569] }, // v1 >= -3 V at step 0, v1 <= 3 V at step 0
            StageRow { stage: 1, row: [1.0019452907973596] }, // v1 >= -3 V at step 1, v1 <= 3 V at step 1
            StageRow { stage: 2, row: [1.0028890978631209] }, // v1 >= -3 V at step 2, v1 <= 3 V at step 2
        ],
        // The rows (36) over dx_N
        terminal: &[],
        // The row that asks the same one stage earlier
        shift: [0, 1, 65535, 65535, 3, 4, 65535, 6, 7, 9, 10],
        // T'HT = I, v = T w by simulation: dx_0 = root w_x
        root: [
            [0.14986879867883518, 0.012519209687073178],
            [0.0, 0.18310591683493502],
        ],
        // du_k = gain dx_k + spread w_k, dx_{k+1} = next dx_k + drive w_k
        stages: [
            Stage { next: [[0.917830317434003, -0.013868737018727255], [-0.027784341679365752, 0.9783116955037855]], drive: [[0.039994269067486245], [0.014961884831002047]], gain: [[-1.7810475435490867, -0.3325836215522123]], spread: [[0.9590951814744902]] }, // step 0
            Stage { next: [[0.9118359829037765, -0.014963346336411375], [-0.030026826539594396, 0.9779022013705512]], drive: [[0.03985362037708663], [0.014909268054737445]], gain: [[-1.9247965730509229, -0.358833245477491]], spread: [[0.9557223112011183]] }, // step 1
            Stage { next: [[0.9045843178688502, -0.016301548974240885], [-0.03273967964618555, 0.9774015788010034]], drive: [[0.03968268723311324], [0.014845321842603513]], gain: [[-2.0986974132170224, -0.3909244358331147]], spread: [[0.9516231950386868]] }, // step 2
        ],
        // Bounds of xhat_k, what they are multiplied by in their rows, and the rows
        x: Bounds {
            // Lower ends
            low: [[-7.1965186282998825, -1.2794967697699962], [f64::NEG_INFINITY, -1.2794967697699962], [f64::NEG_INFINITY, -1.2794967697699962]],
            // Upper ends
            high: [[f64::INFINITY, f64::INFINITY], [f64::INFINITY, f64::INFINITY], [f64::INFINITY, f64::INFINITY]],
            // Factors
            unit: [[6.64934369042765, 5.461319968712276], [0.0, 5.572269513683597], [0.0, 5.6847860477735646]],
            // Rows
            row: [[2, 3], [65535, 4], [65535, 5]],
        },
        // The same of uhat_k
        u: Bounds {
            // Lower ends
            low: [[-2.8714652799738163], [-2.8714652799738163], [-2.8714652799738163]],
            // Upper ends
            high: [[2.8714652799738163], [2.8714652799738163], [2.8714652799738163]],
            // Factors
            unit: [[1.000984871857569], [1.0019452907973596], [1.0028890978631209]],
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
    "h1 >= -12.4 cm at step 0",
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
    ([1.0, 0.0], 5.2034813717),
    ([0.0, 1.0], 0.12050323023),
];

/// Z_i of (21): half-widths. `|z - zref|` stays below them, and neighbours rely on it. One per coupling output.
#[rustfmt::skip]
pub static Z_WIDTHS: [f64; NZ] = [
    0.029000199232, // 0.0165 h2 + 0.00013 v1
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
