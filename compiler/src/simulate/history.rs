//! What happened in a closed loop: named columns, one entry per step. Tables, pictures and pages are made of it.

use dpc_runtime::{Control, Delivery, References};
use serde::{Serialize, Serializer};

use crate::network::Signal;

/// A closed loop, step by step.
///
/// After this point: every column of every [`Track`] has as many entries as `time`, and numbers are in the user's units, as
/// deviations from the operating point, as in the file of the network.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct History {
    pub network: String,
    /// Name of the scenario.
    pub scenario: String,
    pub seed: u64,
    /// Sampling period, s.
    pub sample_time: f64,
    /// t of each step, s: the step's number times the sampling period.
    pub time: Vec<f64>,
    /// In the order of the network.
    pub subsystems: Vec<Track>,
    /// Fixed coupling constraints (3), then changing ones that keep a distance.
    pub couplings: Vec<CouplingTrack>,
    /// Whether all that acted on the network before each step is what the design assumes: w in W_i, loads within bounds and
    /// rates, measurement errors within theirs, the plant the model, no upset.
    pub assumed: Vec<bool>,
    /// In order of time; at one time in the order of the network.
    pub events: Vec<Event>,
}

/// One subsystem over time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Track {
    pub name: String,
    /// x_t of the true plant; limits are those of X_i that read one state alone.
    pub states: Vec<Column>,
    /// u_t; limits are those of U_i that read one input alone.
    pub inputs: Vec<Column>,
    /// y_t of the true plant; `low` and `high` are the ends of Y_i, where set-points can be reached.
    pub outputs: Vec<Column>,
    /// What is asked of each output.
    pub set_points: Vec<Column>,
    /// yref_t, and the same of xref, uref, xhat_{t|t}, uhat_{t|t}.
    pub y_ref: Vec<Column>,
    pub x_ref: Vec<Column>,
    pub u_ref: Vec<Column>,
    pub x_nom: Vec<Column>,
    pub u_nom: Vec<Column>,
    /// Measured disturbances d_t; limits are their bounds. None where there are no loads.
    pub loads: Vec<Column>,
    /// w_t: what is added to x_{t+1} and not known, per state; without what another plant than the model adds.
    pub disturbances: Vec<Column>,
    /// Measured minus true state, per state.
    pub errors: Vec<Column>,
    /// What is left of every row of X_i, then of U_i: limit minus value, negative where it is violated.
    pub margins: Vec<Margin>,
    pub status: Vec<Status>,
    /// Whether the status says that the guarantee holds, as far as this subsystem can see.
    pub guaranteed: Vec<bool>,
    /// `status` in words: the rows of this subsystem's problem, its neighbours and its coupling constraints by name.
    pub words: Vec<String>,
}

/// A signal over time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Column {
    pub name: String,
    pub unit: Option<String>,
    /// The interval that is allowed of it, where that does not depend on other signals; `None`: no limit.
    pub low: Option<f64>,
    pub high: Option<f64>,
    pub values: Vec<f64>,
}

/// What is left of a constraint over time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Margin {
    /// As the user would write it: `h1 <= 27.6 cm`.
    pub row: String,
    /// The right side of the row.
    pub limit: f64,
    /// Unit of the margin, where the row reads signals of one unit.
    pub unit: Option<String>,
    pub values: Vec<f64>,
}

/// A coupling constraint over time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CouplingTrack {
    pub name: String,
    /// Names of its members, in the order of the network.
    pub members: Vec<String>,
    /// What is left of it in the true outputs: limit minus value, or distance minus the distance to keep.
    pub margin: Margin,
}

/// What a step said about itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Status {
    pub control: Control,
    /// A row index counts the fixed coupling constraints on the subsystem, then the changing ones.
    pub references: References,
    /// What became of each neighbour's message, by slot.
    pub deliveries: Vec<Delivery>,
    pub certified: bool,
    pub load_within: bool,
    pub degraded: bool,
}

/// Something that happened at one step.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Event {
    pub step: usize,
    /// s.
    pub time: f64,
    /// Index of the subsystem, where it happened to one.
    pub subsystem: Option<usize>,
    pub kind: EventKind,
    /// A sentence without a full stop.
    pub words: String,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum EventKind {
    /// A set-point changed.
    SetPoint,
    /// The scenario moved a state.
    Upset,
    /// A message did not arrive, or too late.
    Message,
    /// A disturbance, load or measurement error left what the design assumes of it.
    Beyond,
    /// A subsystem began to say that the guarantee does not hold.
    Lost,
    /// It said that it holds again.
    Regained,
    /// A constraint was violated, for the first time since it last held.
    Violated,
    /// References stand still for a coupling constraint.
    HeldUp,
}

impl History {
    /// How many steps there are.
    pub fn steps(&self) -> usize {
        self.time.len()
    }

    /// Whether every subsystem says at `step` that the guarantee holds: then Theorem 1 speaks of the network.
    pub fn is_guaranteed(&self, step: usize) -> bool {
        self.subsystems.iter().all(|track| track.guaranteed.get(step).copied().unwrap_or(false))
    }

    /// The end of the last period, s.
    pub fn end(&self) -> f64 {
        self.sample_time * self.steps() as f64
    }
}

impl Column {
    /// A column without entries or limits.
    pub fn new(signal: &Signal, (low, high): (Option<f64>, Option<f64>)) -> Self {
        Self { name: signal.name.clone(), unit: signal.unit.clone(), low, high, values: Vec::new() }
    }

    /// `h1 [cm]`, as in the file of the network.
    pub fn label(&self) -> String {
        match &self.unit {
            Some(unit) => format!("{} [{unit}]", self.name),
            None => self.name.clone(),
        }
    }
}

impl Margin {
    /// The smallest margin and the step it was reached at first; `None` without steps. NaN counts as smallest.
    pub fn least(&self) -> Option<(usize, f64)> {
        let key = |value: &f64| if value.is_nan() { f64::NEG_INFINITY } else { *value };
        let steps = self.values.iter().copied().enumerate();
        steps.min_by(|(_, a), (_, b)| key(a).total_cmp(&key(b)))
    }
}

impl Status {
    /// As `dpc_runtime::Status::is_guaranteed`.
    pub fn is_guaranteed(&self) -> bool {
        let now = self.control.is_admissible() && self.references.are_admissible();
        now && self.certified && self.load_within && !self.degraded
    }
}

/// As the runtime says it, with numbers for rows and slots.
impl Serialize for Status {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeStruct;
        let mut status = serializer.serialize_struct("Status", 6)?;
        status.serialize_field("control", &self.control.to_string())?;
        status.serialize_field("references", &self.references.to_string())?;
        let deliveries: Vec<String> = self.deliveries.iter().map(Delivery::to_string).collect();
        status.serialize_field("deliveries", &deliveries)?;
        status.serialize_field("certified", &self.certified)?;
        status.serialize_field("load_within", &self.load_within)?;
        status.serialize_field("degraded", &self.degraded)?;
        status.end()
    }
}
