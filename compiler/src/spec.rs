//! The file as written, with the matrices that it says stand in other files; no other module knows TOML.
#![expect(non_snake_case, reason = "the paper's symbols")]

mod files;
mod imported;
mod nearest;
mod read;
pub mod scenario;
mod table;
mod value;

use std::path::PathBuf;

use crate::diagnostic::{Diagnostic, Diagnostics, Place, Source, code};
use crate::gains::GainChoice;
use crate::network::{Norm, Scalar, Signal};
use files::Files;
pub(crate) use nearest::did_you_mean;
use table::Table;
use toml::de::DeTable;

/// The file as written. Keys at the top of the file, above all tables.
///
/// After this point: the text is TOML, every value has the right kind and knows its place, no number is NaN,
/// infinities stand in bounds only, and unknown keys were refused. Nothing is resolved or compared yet.
///
/// The manual's reference of the file is made of the comments on the fields here. A field is the key of the same name with
/// hyphens, or the key in a line `Key:`; it is optional where its type is an `Option`, a list or a table with a default, or a
/// line says `Default:`, unless one says `Required.` Lines `One of:`, `Default:` and `Example:` are columns there. What is `Not a key:` is left out.
#[derive(Debug, Clone)]
pub struct Spec {
    /// Name of the network: of the folder its controllers are written to, and in messages. Letters, digits, spaces; one line.
    ///
    /// Example: `name = "four-tank"`
    pub name: At<String>,
    /// What A and B say: x+ = A x + B u (`"discrete"`), or dx/dt = A x + B u per second (`"continuous"`); then the compiler samples
    /// each subsystem by zero-order hold and holds what couples it over the period.
    ///
    /// One of: `"discrete"`, `"continuous"`
    /// Default: `"discrete"`
    pub time: Time,
    /// What to do about the difference of that from the exact discretisation of the network: say how large it is, or make it a part
    /// of `w`. Goes with `time = "continuous"`.
    ///
    /// One of: `"report"`, `"disturbance"`
    /// Default: `"report"`
    pub hold_error: Option<At<HoldWish>>,
    /// Seconds between two steps, above 0. Matrices of discrete time belong to this step.
    ///
    /// Example: `sample-time = 0.5`
    pub sample_time: At<f64>,
    /// N of (33): how many steps the controllers look ahead, 1 to 500.
    ///
    /// Example: `horizon = 3`
    pub horizon: At<i64>,
    pub reference: Reference,
    pub sizing: Sizing,
    /// Where gains come from that no subsystem states: local Riccati equations (`"lqr"`), a matrix inequality over the whole
    /// network (`"lmi"`), or the first and, where it fails, the second (`"auto"`).
    ///
    /// One of: `"auto"`, `"lqr"`, `"lmi"`
    /// Default: `"auto"`
    pub gains: Option<At<GainChoice>>,
    /// What the controllers compute in. `"f32"` needs bounds on every state and input, and excludes loads, measurement errors,
    /// start-up plans and changing constraints.
    ///
    /// One of: `"f64"`, `"f32"`
    /// Default: `"f64"`
    pub scalar: Option<At<Scalar>>,
    /// Keep room in the on-line problems for start-up plans from any state, at the price of rows. Implied by `x0`.
    ///
    /// Default: `false`
    pub start_anywhere: Option<At<bool>>,
    pub collective: Option<Collective>,
    /// One table per subsystem, in the order of the file.
    ///
    /// Key: `subsystem`
    /// Required.
    pub subsystems: Vec<Subsystem>,
    /// Key: `coupling-constraint`
    pub coupling_constraints: Vec<CouplingConstraint>,
    /// Key: `changing-constraint`
    pub changing_constraints: Vec<ChangingConstraint>,
    /// Not a key: names, as written and each once, of the files that matrices were read from.
    pub files: Vec<String>,
}

/// `time`: what A and B say.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Time {
    /// x+ = A x + B u.
    #[default]
    Discrete,
    /// x' = A x + B u.
    Continuous,
}

/// `hold-error`: what to do about the difference from the exact discretisation.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum HoldWish {
    #[default]
    Report,
    /// Make it a part of w.
    Disturbance,
}

/// A value and the bytes it was read from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct At<T> {
    pub value: T,
    pub place: Place,
}

pub type Row = At<Vec<At<f64>>>;
/// A list of rows, perhaps of different lengths.
pub type Matrix = At<Vec<Row>>;
/// Names with units, in the order of the matrices' rows or columns.
pub type Signals = At<Vec<At<Signal>>>;

/// How reference outputs move.
#[derive(Debug, Clone, Default)]
pub struct Reference {
    /// The layer that makes references: the paper's is the one there is.
    ///
    /// One of: `"paper"`
    /// Default: `"paper"`
    pub layer: Option<Layer>,
    /// Largest change of a reference output per step (6), in output units, above 0. Left out, it is chosen by the sizing
    /// program, see `epsilon-weight`.
    ///
    /// Default: chosen
    /// Example: `epsilon = 0.02`
    pub epsilon: Option<At<f64>>,
    /// q of (6): the norm in which that change is measured, over the outputs of one subsystem.
    ///
    /// One of: `1`, `2`, `"inf"`
    /// Default: `"inf"`
    pub norm: Option<Norm>,
    /// Weight on changing the reference (29), above 0 and below every eigenvalue of `T` (32).
    ///
    /// Default: `1e-6`
    pub gamma: Option<At<f64>>,
}

/// What `reference.layer` may say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layer {
    /// `"paper"`: (28)-(31).
    Paper,
}

/// What the sets favour: the weights of a sum of logarithms, which is maximised. Weights are relative: with `reserve-weight`
/// 0.2, 10 % more reserve is bought with up to 2 % of the range of set-points.
#[derive(Debug, Clone, Default)]
pub struct Sizing {
    /// Not a key: where the table is.
    pub place: Option<Place>,
    /// Worth of the range of set-points of each output, above 0. A subsystem's own `y-weight` multiplies it.
    ///
    /// Default: `1`
    pub y_weight: Option<At<f64>>,
    /// Worth of Delta^z (22), what a subsystem may be off its reference as its neighbours see it: upsets it can absorb. 0 or more.
    ///
    /// Default: `0.2`
    pub reserve_weight: Option<At<f64>>,
    /// Worth of the terminal set (24): how far off the reference a plan may end. 0 or more.
    ///
    /// Default: `0.1`
    pub terminal_weight: Option<At<f64>>,
    /// Worth of epsilon, once for each output of the network, where `epsilon` is left out: larger is faster. Above 0 then, else
    /// 0 or more.
    ///
    /// Default: `0.25`
    pub epsilon_weight: Option<At<f64>>,
    /// Worth of each end of the range of set-points, relative to that of the range: keeps set-points of both signs. 0 or more.
    ///
    /// Default: `0.1`
    pub end_weight: Option<At<f64>>,
    /// Drop a facet of E_i or Sigma_i that is worth less than this share. 0 or more.
    ///
    /// Default: `0.01`
    pub facet_loss: Option<At<f64>>,
    /// Ask for as much below 0 as above.
    ///
    /// Default: `false`
    pub symmetric: Option<bool>,
    /// How long to search for better gains, 0 (not at all) to 3 (thousands of designs compared). `--effort` wins over it.
    ///
    /// Default: `0`
    pub effort: Option<At<i64>>,
}

/// The network as one model (5), x+ = A x + B u, y = C x, over all n states, m inputs and p outputs. Subsystems then say by name
/// which signals they own and state no matrices of a model.
#[derive(Debug, Clone)]
pub struct Collective {
    /// Not a key: where the table is.
    pub place: Place,
    /// All n states.
    ///
    /// Example: `states = ["h1 [cm]", "h2 [cm]"]`
    pub states: Signals,
    /// All m inputs.
    pub inputs: Signals,
    /// All p outputs.
    pub outputs: Signals,
    /// n x n.
    pub A: Matrix,
    /// n x m.
    pub B: Matrix,
    /// p x n; an output may read states of one subsystem only.
    pub C: Matrix,
}

/// One subsystem: x+ = A x + B u + what its neighbours add, y = C x, with n states, m inputs and p outputs, p <= m. Which
/// matrices must be there depends on the way the network is stated. NAME has a letter first, then letters, digits, `-`, `_`.
#[derive(Debug, Clone)]
pub struct Subsystem {
    /// Not a key: the NAME in `[subsystem.NAME]`, with its place.
    pub name: At<String>,
    /// The n states.
    ///
    /// Example: `states = ["h1 [cm]", "h2 [cm]"]`
    pub states: Signals,
    /// The m inputs.
    ///
    /// Example: `inputs = ["v1 [V]"]`
    pub inputs: Signals,
    /// The p outputs, which follow set-points.
    ///
    /// Example: `outputs = ["h1 [cm]"]`
    pub outputs: Signals,
    /// A_ii of (1), n x n.
    ///
    /// Example: `A = [[0.9921, 0.0], [0.0, 0.9835]]`
    pub A: Option<Matrix>,
    /// B_ii of (1), n x m.
    ///
    /// Example: `B = [[0.0417], [0.0156]]`
    pub B: Option<Matrix>,
    /// C_i of (1), p x n.
    ///
    /// Example: `C = [[1.0, 0.0]]`
    pub C: Option<Matrix>,
    /// E_i of (1), n rows, one column per coupling input: how what comes from neighbours enters the state.
    pub E: Option<Matrix>,
    /// C_zi of (1), one row per coupling output, n columns: what neighbours feel of the states.
    pub Cz: Option<Matrix>,
    /// D_zi of (1), one row per coupling output, m columns: what neighbours feel of the inputs.
    pub Dz: Option<Matrix>,
    /// X_i: constraints on the states, with 0 inside.
    ///
    /// Default: none
    /// Example: `x = { min = [-12.4, -1.4], max = [27.6, 38.6] }`
    pub x: Option<Bounds>,
    /// U_i: constraints on the inputs, with 0 inside.
    ///
    /// Default: none
    /// Example: `u = { min = -3.0, max = 3.0 }`
    pub u: Option<Bounds>,
    /// Disturbance: what is added to x+ and not known beyond these bounds, which hold 0. In units of the states, per step.
    ///
    /// Default: none
    /// Example: `w = { min = [-0.004, 0.0], max = [0.004, 0.0] }`
    pub w: Option<Bounds>,
    /// Largest error of each measured state, in its unit.
    ///
    /// Key: `measurement-error.max`
    /// Default: none
    /// Example: `measurement-error = { max = [0.05, 0.1] }`
    pub measurement_error: Option<PerSignal>,
    /// Names of the disturbances that are measured, d: M d is added to x+.
    ///
    /// Default: none
    /// Example: `loads = ["q1 [cm]"]`
    pub loads: Option<Signals>,
    /// How loads enter: n x number of loads. Goes with `loads`.
    ///
    /// Example: `M = [[1.0], [0.0]]`
    pub M: Option<Matrix>,
    /// Bounds of the loads, which hold 0. Goes with `loads`.
    ///
    /// Example: `d = { min = [-0.008], max = [0.012] }`
    pub d: Option<Bounds>,
    /// Largest change of each load per step, in its unit. Goes with `loads`.
    ///
    /// Default: no limit but `d`
    /// Example: `d-rate = [0.001]`
    pub d_rate: Option<PerSignal>,
    /// Weight of the states in (34), positive definite.
    ///
    /// Default: `1`
    pub Q: Option<Weight>,
    /// Weight of the inputs in (34), positive definite.
    ///
    /// Default: `1`
    pub R: Option<Weight>,
    /// Weight of the distance to the set-point in (29), above `gamma` (32).
    ///
    /// Default: `1`
    pub T: Option<Weight>,
    /// K_i of (17), m x n, u = K x: the feedback that holds the state to its plan.
    ///
    /// Default: computed, see `gains`
    /// Example: `K = [[-0.3, -0.1]]`
    pub K: Option<Matrix>,
    /// K_i^x of (7f), m x n: the part of the reference gain on the states. Goes with `Ke`.
    ///
    /// Default: computed, see `gains`
    pub Kx: Option<Matrix>,
    /// K_i^e of (7f), m x p: the part of the reference gain on the integrated errors. Goes with `Kx`.
    ///
    /// Default: computed, see `gains`
    pub Ke: Option<Matrix>,
    pub gain_weights: GainWeights,
    pub reference_weights: ReferenceWeights,
    /// Set-points that must be reachable: for each output named an interval that holds 0. The design fails rather than leave one
    /// out.
    ///
    /// Default: none
    /// Example: `cover = { h1 = [-1.0, 2.5] }`
    pub cover: Vec<Cover>,
    /// Not a key: where `cover` is.
    pub cover_place: Option<Place>,
    /// Least half-width of Delta^z, per coupling output, in its unit; 0 or more.
    ///
    /// Default: `0`
    pub reserve: Option<PerSignal>,
    /// Worth of each output's range of set-points against those of other subsystems, above 0.
    ///
    /// Default: `1`
    pub y_weight: Option<PerSignal>,
    /// The state it starts from, n numbers; 0 where other subsystems have one. With it a start-up plan is emitted.
    ///
    /// Default: none
    /// Example: `x0 = [-12.0, -1.3]`
    pub x0: Option<Row>,
    /// The loads at that time, one number each.
    ///
    /// Default: zero
    pub d0: Option<Row>,
    /// One table per neighbour that acts on the subsystem.
    pub from: Vec<Import>,
}

/// Where one subsystem of a file of starts begins.
#[derive(Debug, Clone)]
pub struct StartOf {
    /// Not a key: the NAME in `[NAME]`, with its place.
    pub subsystem: At<String>,
    /// Its states, n numbers.
    ///
    /// Default: zero
    pub x0: Option<Row>,
    /// Its loads, one number each.
    ///
    /// Default: zero
    pub d0: Option<Row>,
}

/// Weights of the Riccati equation that K_i comes from, where `K` is left out.
#[derive(Debug, Clone, Default)]
pub struct GainWeights {
    /// Not a key: where the table is.
    pub place: Option<Place>,
    /// Of the states, positive definite.
    ///
    /// Default: the subsystem's `Q`
    pub Q: Option<Weight>,
    /// Of the inputs, positive definite.
    ///
    /// Default: the subsystem's `R`
    /// Example: `R = 100.0`
    pub R: Option<Weight>,
}

/// Weights of the Riccati equation that the reference gain \[Kx Ke\] comes from, where it is left out.
#[derive(Debug, Clone, Default)]
pub struct ReferenceWeights {
    /// Not a key: where the table is.
    pub place: Option<Place>,
    /// Of the states, positive definite.
    ///
    /// Default: the subsystem's `Q`
    pub Q: Option<Weight>,
    /// Of the integrated errors, p of them; positive definite.
    ///
    /// Default: `0.1`
    pub Qe: Option<Weight>,
    /// Of the inputs, positive definite.
    ///
    /// Default: the subsystem's `R`
    pub R: Option<Weight>,
}

/// One entry of `cover`: set-points in `[low, high]` of an output.
#[derive(Debug, Clone)]
pub struct Cover {
    pub output: At<String>,
    pub interval: At<(f64, f64)>,
}

/// What NEIGHBOUR adds to the state of NAME: A times its states and B times its inputs, or E times L times its coupling outputs.
#[derive(Debug, Clone)]
pub struct Import {
    /// Not a key: the NEIGHBOUR in `[subsystem.NAME.from.NEIGHBOUR]`, with its place.
    pub neighbour: At<String>,
    /// A_ij of (5): n rows, one column per state of the neighbour.
    ///
    /// Default: zero
    /// Example: `A = [[0.0, 0.0206], [0.0, 0.0]]`
    pub A: Option<Matrix>,
    /// B_ij of (5): n rows, one column per input of the neighbour.
    ///
    /// Default: zero
    /// Example: `B = [[2.47e-4], [0.0]]`
    pub B: Option<Matrix>,
    /// L_ij of (2): one row per coupling input, one column per coupling output of the neighbour. Goes with `E`, `Cz`, `Dz`.
    pub L: Option<Matrix>,
}

/// A positive definite matrix.
#[derive(Debug, Clone)]
pub enum Weight {
    Scalar(At<f64>),
    Diagonal(Row),
    Full(Matrix),
}

/// One number for all signals, or one number each.
#[derive(Debug, Clone)]
pub enum PerSignal {
    Every(At<f64>),
    Each(Row),
}

/// `{ min, max, H, h }`, each pair optional; entries of `min`, `max` and `h` may be infinite.
#[derive(Debug, Clone)]
pub struct Bounds {
    pub place: Place,
    pub min: Option<PerSignal>,
    pub max: Option<PerSignal>,
    /// H and h.
    pub rows: Option<(Matrix, Row)>,
}

/// A constraint over outputs of several subsystems (3): the sum of H times y is at most `max`.
#[derive(Debug, Clone)]
pub struct CouplingConstraint {
    /// Not a key: where the table is.
    pub place: Place,
    /// What messages call it.
    ///
    /// Default: its number
    /// Example: `name = "difference"`
    pub name: Option<At<String>>,
    /// H_h of (3): per subsystem a list with one coefficient per output, or a table by names of outputs.
    ///
    /// Required.
    /// Example: `H = { left = [1.0], right = { h3 = -1.0 } }`
    pub H: Vec<OutputRow>,
    /// l_h of (3), above 0, in the unit of the sum.
    ///
    /// Example: `max = 20.0`
    pub max: At<f64>,
}

/// A constraint (3) whose row and limit are given while running, at every step anew.
#[derive(Debug, Clone)]
pub struct ChangingConstraint {
    /// Not a key: where the table is.
    pub place: Place,
    /// What messages and the emitted code call it.
    ///
    /// Default: its number
    /// Example: `name = "apart"`
    pub name: Option<At<String>>,
    /// The subsystems whose outputs its rows read; one alone is allowed.
    ///
    /// Example: `between = ["left", "right"]`
    pub between: At<Vec<At<String>>>,
    /// The most that a row may be charged per output of each of them (26), in its unit, above 0.
    ///
    /// Default: kept small
    /// Example: `margin = 2.0`
    pub margin: Option<At<f64>>,
}

/// `H_h^[j]` of (3).
#[derive(Debug, Clone)]
pub struct OutputRow {
    pub subsystem: At<String>,
    pub coefficients: Coefficients,
}

#[derive(Debug, Clone)]
pub enum Coefficients {
    List(Row),
    ByOutput(At<Vec<(At<String>, At<f64>)>>),
}

impl Spec {
    /// Reads the text of `source`, and the files it names, whose paths are relative to its folder: with them, and only
    /// here, the file system comes in.
    ///
    /// # Errors
    /// The first syntax error, since one forgotten bracket spoils all that follows; where there is none, all unknown
    /// keys, missing keys, values of the wrong kind, NaNs, malformed names and unusable files.
    pub fn parse(source: &Source) -> Result<Self, Diagnostics> {
        let (spec, errors) = Self::read(source);
        errors.finish(spec)
    }

    /// Paths of the files that the text of `source` names, there or not, as far as it can be read: what a design depends
    /// on besides the text.
    pub fn files(source: &Source) -> Vec<PathBuf> {
        let files = Files::beside(source);
        // Its mistakes are for those who want the design.
        let _ = Self::read_with(source, &files);
        files.paths()
    }

    /// [`Spec::parse`] for those who look for further mistakes: beside the mistakes what could be read, where that is enough to
    /// go on with. Values that are missing or wrong have their defaults there, or any that is allowed.
    pub fn read(source: &Source) -> (Option<Self>, Diagnostics) {
        Self::read_with(source, &Files::beside(source))
    }

    fn read_with(source: &Source, files: &Files) -> (Option<Self>, Diagnostics) {
        let document = match DeTable::parse(&source.text) {
            Ok(document) => document,
            Err(mistake) => return (None, syntax(&mistake, &source.text).into()),
        };
        let mut errors = Diagnostics::default();
        let mut file = Table::new("", first_line(&source.text), document.get_ref(), files);
        let spec = read::spec(&mut file, &mut errors).map(|spec| Self { files: files.names(), ..spec });
        (spec, errors)
    }
}

impl StartOf {
    /// Reads a file of starts: one table `[NAME]` per subsystem, with `x0` and `d0`.
    ///
    /// # Errors
    /// As [`Spec::parse`].
    pub fn parse(source: &Source) -> Result<Vec<Self>, Diagnostics> {
        Self::parse_with(source, &Files::beside(source))
    }

    /// Paths of the files that the text of `source` names, as [`Spec::files`].
    pub fn files(source: &Source) -> Vec<PathBuf> {
        let files = Files::beside(source);
        // Its mistakes are for those who want the design.
        let _ = Self::parse_with(source, &files);
        files.paths()
    }

    fn parse_with(source: &Source, files: &Files) -> Result<Vec<Self>, Diagnostics> {
        let document = DeTable::parse(&source.text).map_err(|mistake| syntax(&mistake, &source.text))?;
        let mut errors = Diagnostics::default();
        let file = Table::new("", first_line(&source.text), document.get_ref(), files);
        let starts = read::starts(&file, &mut errors);
        errors.finish(starts)
    }
}

/// What a file says of the network at its top, whatever mistakes follow.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Heading {
    pub name: Option<String>,
    pub scalar: Option<Scalar>,
}

impl Heading {
    /// Of the part of `text` that is TOML.
    pub fn of(text: &str) -> Self {
        let (document, _) = DeTable::parse_recoverable(text);
        let word =
            |key: &str| document.get_ref().get(key).and_then(|value| value.get_ref().as_str()).map(str::to_owned);
        Self { name: word("name"), scalar: word("scalar").and_then(|scalar| scalar.parse().ok()) }
    }
}

impl<T> At<T> {
    pub fn new(value: T, place: Place) -> Self {
        Self { value, place }
    }
}

impl Weight {
    pub fn place(&self) -> Place {
        match self {
            Self::Scalar(scalar) => scalar.place.clone(),
            Self::Diagonal(diagonal) => diagonal.place.clone(),
            Self::Full(matrix) => matrix.place.clone(),
        }
    }
}

impl PerSignal {
    pub fn place(&self) -> Place {
        match self {
            Self::Every(number) => number.place.clone(),
            Self::Each(numbers) => numbers.place.clone(),
        }
    }
}

fn syntax(mistake: &toml::de::Error, text: &str) -> Diagnostic {
    let place = mistake.span().unwrap_or_else(|| first_line(text));
    let error = Diagnostic::error(code::SYNTAX, "the file is not valid TOML").at(place, mistake.message());
    match mistake.message().contains("array") {
        true => error.help("a bracket opened earlier may not be closed"),
        false => error,
    }
}

/// Where to point when something is missing in the file as a whole.
fn first_line(text: &str) -> Place {
    0..text.lines().next().unwrap_or_default().len()
}
