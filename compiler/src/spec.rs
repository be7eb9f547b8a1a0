//! The file as written; no other module knows TOML.
#![expect(non_snake_case, reason = "the paper's symbols")]

mod nearest;
mod read;
mod table;
mod value;

use crate::diagnostic::{Diagnostic, Diagnostics, Place, Source, code};
use crate::gains::GainChoice;
use crate::network::{Norm, Scalar, Signal};
pub(crate) use nearest::did_you_mean;
use table::Table;
use toml::de::DeTable;

/// The file as written.
///
/// After this point: the text is TOML, every value has the right kind and knows its place, no number is NaN,
/// infinities stand in bounds only, and unknown keys were refused. Nothing is resolved or compared yet.
#[derive(Debug, Clone)]
pub struct Spec {
    pub name: At<String>,
    /// Seconds.
    pub sample_time: At<f64>,
    pub horizon: At<i64>,
    pub reference: Reference,
    pub sizing: Sizing,
    pub gains: Option<At<GainChoice>>,
    pub scalar: Option<At<Scalar>>,
    pub start_anywhere: Option<At<bool>>,
    pub collective: Option<Collective>,
    /// In the order of the file.
    pub subsystems: Vec<Subsystem>,
    pub coupling_constraints: Vec<CouplingConstraint>,
    pub changing_constraints: Vec<ChangingConstraint>,
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

/// `[reference]`
#[derive(Debug, Clone, Default)]
pub struct Reference {
    pub epsilon: Option<At<f64>>,
    pub norm: Option<Norm>,
    pub gamma: Option<At<f64>>,
}

/// `[sizing]`
#[derive(Debug, Clone, Default)]
pub struct Sizing {
    pub place: Option<Place>,
    pub y_weight: Option<At<f64>>,
    pub reserve_weight: Option<At<f64>>,
    pub terminal_weight: Option<At<f64>>,
    pub epsilon_weight: Option<At<f64>>,
    pub end_weight: Option<At<f64>>,
    pub facet_loss: Option<At<f64>>,
    pub symmetric: Option<bool>,
    pub effort: Option<At<i64>>,
}

/// `[collective]`: model (5).
#[derive(Debug, Clone)]
pub struct Collective {
    pub place: Place,
    pub states: Signals,
    pub inputs: Signals,
    pub outputs: Signals,
    pub A: Matrix,
    pub B: Matrix,
    pub C: Matrix,
}

/// `[subsystem.NAME]`; which of the matrices must be there depends on the way the network is stated.
#[derive(Debug, Clone)]
pub struct Subsystem {
    /// Its place is the NAME in `[subsystem.NAME]`.
    pub name: At<String>,
    pub states: Signals,
    pub inputs: Signals,
    pub outputs: Signals,
    pub A: Option<Matrix>,
    pub B: Option<Matrix>,
    pub C: Option<Matrix>,
    pub E: Option<Matrix>,
    pub Cz: Option<Matrix>,
    pub Dz: Option<Matrix>,
    pub x: Option<Bounds>,
    pub u: Option<Bounds>,
    /// What is added to x+ and not known, beyond its bounds.
    pub w: Option<Bounds>,
    /// Largest error of each measured state: `max` of `measurement-error`.
    pub measurement_error: Option<PerSignal>,
    /// What is added to x+ and measured: M d.
    pub loads: Option<Signals>,
    pub M: Option<Matrix>,
    pub d: Option<Bounds>,
    /// Largest change of each load per step.
    pub d_rate: Option<PerSignal>,
    pub Q: Option<Weight>,
    pub R: Option<Weight>,
    pub T: Option<Weight>,
    pub K: Option<Matrix>,
    pub Kx: Option<Matrix>,
    pub Ke: Option<Matrix>,
    pub gain_weights: RiccatiWeights,
    pub reference_weights: RiccatiWeights,
    pub cover: Vec<Cover>,
    pub cover_place: Option<Place>,
    pub reserve: Option<PerSignal>,
    pub y_weight: Option<PerSignal>,
    /// Where it starts: states, and loads at that time.
    pub x0: Option<Row>,
    pub d0: Option<Row>,
    pub from: Vec<Import>,
}

/// Where one subsystem of a file of starts begins.
#[derive(Debug, Clone)]
pub struct StartOf {
    /// Its place is the NAME in `[NAME]`.
    pub subsystem: At<String>,
    pub x0: Option<Row>,
    pub d0: Option<Row>,
}

/// `gain-weights` or `reference-weights`.
#[derive(Debug, Clone, Default)]
pub struct RiccatiWeights {
    pub place: Option<Place>,
    pub Q: Option<Weight>,
    /// Only in `reference-weights`.
    pub Qe: Option<Weight>,
    pub R: Option<Weight>,
}

/// One entry of `cover`: set-points in `[low, high]` of an output.
#[derive(Debug, Clone)]
pub struct Cover {
    pub output: At<String>,
    pub interval: At<(f64, f64)>,
}

/// `[subsystem.NAME.from.NEIGHBOUR]`: what the neighbour does to this subsystem.
#[derive(Debug, Clone)]
pub struct Import {
    pub neighbour: At<String>,
    pub A: Option<Matrix>,
    pub B: Option<Matrix>,
    pub L: Option<Matrix>,
}

#[derive(Debug, Clone)]
pub enum Weight {
    Scalar(At<f64>),
    Diagonal(Row),
    Full(Matrix),
}

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

/// `[[coupling-constraint]]`: constraint (3).
#[derive(Debug, Clone)]
pub struct CouplingConstraint {
    pub place: Place,
    pub name: Option<At<String>>,
    pub H: Vec<OutputRow>,
    pub max: At<f64>,
}

/// `[[changing-constraint]]`: constraint (3) whose row is redrawn while running.
#[derive(Debug, Clone)]
pub struct ChangingConstraint {
    pub place: Place,
    pub name: Option<At<String>>,
    /// Names of subsystems.
    pub between: At<Vec<At<String>>>,
    /// Largest half-width, in every output of every member, of what (26) takes.
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
    /// Reads the text of `source`.
    ///
    /// # Errors
    /// The first syntax error, since one forgotten bracket spoils all that follows; where there is none, all unknown
    /// keys, missing keys, values of the wrong kind, NaNs and malformed names.
    pub fn parse(source: &Source) -> Result<Self, Diagnostics> {
        let (spec, errors) = Self::read(source);
        errors.finish(spec)
    }

    /// [`Spec::parse`] for those who look for further mistakes: beside the mistakes what could be read, where that is enough to
    /// go on with. Values that are missing or wrong have their defaults there, or any that is allowed.
    pub fn read(source: &Source) -> (Option<Self>, Diagnostics) {
        let document = match DeTable::parse(&source.text) {
            Ok(document) => document,
            Err(mistake) => return (None, syntax(&mistake, &source.text).into()),
        };
        let mut errors = Diagnostics::default();
        let mut file = Table::new("", first_line(&source.text), document.get_ref());
        let spec = read::spec(&mut file, &mut errors);
        (spec, errors)
    }
}

impl StartOf {
    /// Reads a file of starts: one table `[NAME]` per subsystem, with `x0` and `d0`.
    ///
    /// # Errors
    /// As [`Spec::parse`].
    pub fn parse(source: &Source) -> Result<Vec<Self>, Diagnostics> {
        let document = DeTable::parse(&source.text).map_err(|mistake| syntax(&mistake, &source.text))?;
        let mut errors = Diagnostics::default();
        let file = Table::new("", first_line(&source.text), document.get_ref());
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
