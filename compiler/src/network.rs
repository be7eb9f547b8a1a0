//! The validated model, in the interaction form (1)-(4).
#![expect(non_snake_case, reason = "the paper's symbols")]

mod blocks;
mod changing;
mod collective;
mod constraints;
mod disturbance;
mod form;
mod hold;
mod interaction;
mod limits;
mod loads;
mod mistakes;
mod model;
mod roster;
mod rows;
mod settings;
mod shape;
mod starts;
mod tuning;
mod weights;
mod words;

use std::collections::BTreeMap;
use std::str::FromStr;

use nalgebra::{DMatrix, DVector};

use crate::convex::Bounded;
/// q of (6), (30).
pub use crate::convex::RateNorm as Norm;
use crate::diagnostic::{Diagnostics, Place, Source, code};
use crate::gains::GainChoice;
use crate::spec::{self, Spec};
use crate::tuning::Effort;
use changing::Changing;
use form::Form;
pub use hold::{Fastest, Hold, HoldError};
use limits::{Space, polytope};
use mistakes::Mistakes;
use model::Model;
use roster::{Member, Roster};
pub use starts::{Start, StartPlaces};

/// The network of subsystems the paper's Section II describes.
///
/// After this point: names are resolved, shapes agree, every number is finite, every constraint set contains 0 in
/// its interior, and `j` is a neighbour of `i` exactly where `L[j]` of subsystem `i` is present and non-zero.
#[derive(Debug, Clone)]
pub struct Network {
    pub name: String,
    /// Sampling period in seconds.
    pub sample_time: f64,
    /// N of (33), at least 1.
    pub horizon: usize,
    pub reference: Reference,
    pub wishes: Wishes,
    /// How gains are found that the file does not state.
    pub gains: GainChoice,
    /// What the emitted controllers compute in.
    pub scalar: Scalar,
    /// How long to search for better gains: what the file says, and in a design what its caller said instead.
    pub effort: Effort,
    pub subsystems: Vec<Subsystem>,
    pub coupling_constraints: Vec<CouplingConstraint>,
    pub changing_constraints: Vec<ChangingConstraint>,
    /// How it was sampled, where the file states it in continuous time.
    pub hold: Option<Hold>,
    /// Whether controllers are to start from any state that a start-up plan exists for; see [`crate::start`].
    pub start_anywhere: bool,
    /// The start that the file states.
    pub start: Option<Start>,
    /// The text the network was read from, for diagnostics of later stages.
    pub source: Source,
    /// Names of the files beside it that matrices were read from.
    pub files: Vec<String>,
    pub places: NetworkPlaces,
}

/// A scalar type of emitted controllers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Scalar {
    /// `f64`
    #[default]
    Double,
    /// `f32`: the sets are tightened by what it rounds, see [`crate::rounding`].
    Single,
}

impl FromStr for Scalar {
    type Err = &'static str;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        [Self::Double, Self::Single].into_iter().find(|scalar| scalar.name() == name).ok_or("f64 or f32 is expected")
    }
}

impl Scalar {
    /// In Rust.
    pub fn name(self) -> &'static str {
        match self {
            Self::Double => "f64",
            Self::Single => "f32",
        }
    }

    /// By what share of a limit the runtime takes a start to be inside it all the same, and more; nothing in double precision, where
    /// sets have that in reserve.
    pub fn share_kept(self) -> f64 {
        match self {
            Self::Double => 0.0,
            Self::Single => 1.5 * f64::from(dpc_runtime::single::KEPT),
        }
    }

    pub fn bytes(self) -> usize {
        match self {
            Self::Double => 8,
            Self::Single => 4,
        }
    }

    /// The number of this type nearest to `value`.
    pub fn nearest(self, value: f64) -> f64 {
        match self {
            Self::Double => value,
            Self::Single => f64::from(value as f32),
        }
    }

    /// The largest number of this type that is not above `value`.
    pub fn below(self, value: f64) -> f64 {
        let nearest = self.nearest(value);
        if nearest <= value { nearest } else { f64::from((value as f32).next_down()) }
    }

    /// The smallest number of this type that is not below `value`.
    pub fn above(self, value: f64) -> f64 {
        -self.below(-value)
    }
}

/// The reference-output layer's tuning (6), (29).
#[derive(Debug, Clone)]
pub struct Reference {
    /// Radius of the ball in (6), (30), in output units per step; `None`: the sizing program chooses.
    pub epsilon: Option<f64>,
    /// q of (6), (30).
    pub norm: Norm,
    /// gamma of (29), positive and below every eigenvalue of every T_i (32).
    pub gamma: f64,
}

/// What the sizing program should favour; see [`crate::sizing`].
#[derive(Debug, Clone)]
pub struct Wishes {
    /// Weight of the logarithm of each width of Y_i.
    pub y_weight: f64,
    /// Weight of the logarithm of each half-width of Delta_i^z: at the optimum, `reserve_weight` % of the volume of
    /// Y are given for 1 % of reserve.
    pub reserve_weight: f64,
    /// Weight of the logarithm of the size of each terminal set Sigma_i.
    pub terminal_weight: f64,
    /// Weight of the logarithm of epsilon, where epsilon is free, once per output of the network.
    pub epsilon_weight: f64,
    /// Weight of the logarithm of each end of Y_i, relative to that of its width: it keeps 0 inside.
    pub end_weight: f64,
    /// How much support in a needed direction a facet of E_i or Sigma_i must be worth, relative.
    pub facet_loss: f64,
    /// Ask for Y_i = -Y_i.
    pub symmetric: bool,
}

/// Subsystem `i` of (1): `x+ = A x + B u + E s, y = C x, z = Cz x + Dz u, s = sum over j of L[j] z_j`.
#[derive(Debug, Clone)]
pub struct Subsystem {
    pub name: String,
    pub states: Vec<Signal>,
    pub inputs: Vec<Signal>,
    pub outputs: Vec<Signal>,
    /// A_ii, n x n.
    pub A: DMatrix<f64>,
    /// B_ii, n x m.
    pub B: DMatrix<f64>,
    /// C_i, p x n, p <= m.
    pub C: DMatrix<f64>,
    /// E_i, n x (number of coupling inputs); may have no column.
    pub E: DMatrix<f64>,
    /// L_ij by neighbour j (index into `Network::subsystems`), (coupling inputs of i) x (coupling outputs of j).
    pub L: BTreeMap<usize, DMatrix<f64>>,
    /// C_zi, (coupling outputs) x n; may have no row.
    pub Cz: DMatrix<f64>,
    /// D_zi, (coupling outputs) x m.
    pub Dz: DMatrix<f64>,
    /// A name for each coupling output, in the user's names: `0.0165 h2 + 0.00013 v1`.
    pub coupling_outputs: Vec<String>,
    /// X_i, over the states.
    pub X: NamedPolytope,
    /// U_i, over the inputs.
    pub U: NamedPolytope,
    /// Exogenous disturbance w in `x+ = A x + B u + E s + w`: nothing is known of it but that it stays in this set, which
    /// holds 0. `None`: there is none.
    pub w: Option<Bounded>,
    /// |v_k| <= entry k, where the controller is given x + v for the state x.
    pub measurement_error: DVector<f64>,
    /// Disturbances the controller knows, M d in `x+ = A x + B u + E s + w + M d`; see [`crate::sets::loads`].
    pub loads: Loads,
    /// Q_i of (34), symmetric positive definite.
    pub Q: DMatrix<f64>,
    /// R_i of (34), symmetric positive definite.
    pub R: DMatrix<f64>,
    /// T_i of (29), symmetric, T_i > gamma I (32).
    pub T: DMatrix<f64>,
    pub gains: GainWishes,
    /// Set-points Y_i must cover, per output: `Some((low, high))` in output units, low <= 0 <= high.
    pub cover: Vec<Option<(f64, f64)>>,
    /// How much the width of Y_i in each output is worth, besides [`Wishes::y_weight`].
    pub y_weights: Vec<f64>,
    /// Smallest half-width of Delta_i^z the user accepts, per coupling output.
    pub reserve: Vec<f64>,
    /// How it takes part in changing constraints; `None` where it is in none.
    pub exposed: Option<Exposed>,
    pub places: SubsystemPlaces,
}

/// Measured disturbances of one subsystem; there may be none.
#[derive(Debug, Clone)]
pub struct Loads {
    pub signals: Vec<Signal>,
    /// n x (number of loads).
    pub M: DMatrix<f64>,
    /// min <= d <= max, min <= 0 <= max.
    pub min: DVector<f64>,
    pub max: DVector<f64>,
    /// Largest change per step, at most max - min.
    pub rate: DVector<f64>,
}

/// A state, input, output or load as the user names it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Signal {
    pub name: String,
    /// From `"h1 [cm]"`.
    pub unit: Option<String>,
}

/// {x : H x <= h}; `rows[k]` says what row k means to the user (`h1 <= 27.6 cm`). No row is infinite.
#[derive(Debug, Clone)]
pub struct NamedPolytope {
    pub H: DMatrix<f64>,
    pub h: DVector<f64>,
    pub rows: Vec<String>,
}

/// Where K_i and calK_i come from: given matrices win over Riccati weights.
#[derive(Debug, Clone)]
pub struct GainWishes {
    /// K_i, m x n, as the user states it: u = K x.
    pub K: Option<DMatrix<f64>>,
    /// [K_i^x K_i^e], m x (n + p).
    pub calK: Option<DMatrix<f64>>,
    /// K_i, where something better than the Riccati equation was found; see [`crate::gains::Settled`], [`crate::tuning`].
    pub K_found: Option<FoundGain>,
    /// Likewise calK_i.
    pub calK_found: Option<FoundGain>,
    /// State and input weight of the Riccati equation for K_i; default Q_i and R_i.
    pub weights: (DMatrix<f64>, DMatrix<f64>),
    /// Weight of (x, e), (n + p) square, and of u in the Riccati equation for calK_i; default diag(Q_i, 0.1 I), R_i.
    pub reference_weights: (DMatrix<f64>, DMatrix<f64>),
}

/// A gain that takes the place of the Riccati equation's.
#[derive(Debug, Clone)]
pub struct FoundGain {
    pub gain: DMatrix<f64>,
    pub by: FoundBy,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FoundBy {
    Inequality,
    Search,
}

/// Constraint (3): `sum over j of H[j] y_j <= l`, with `H[j] y_j = Hz[j] z_j` (4).
#[derive(Debug, Clone)]
pub struct CouplingConstraint {
    pub name: String,
    /// `H_h^[j]`, a row of length p_j, by subsystem; only non-zero rows are present.
    pub H: BTreeMap<usize, DVector<f64>>,
    /// `H_h^[j]z`, a row over the coupling outputs of j.
    pub Hz: BTreeMap<usize, DVector<f64>>,
    /// l_h > 0.
    pub l: f64,
    pub place: Place,
}

/// Constraint (3) whose row is redrawn while running: a row over all outputs of its members.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChangingConstraint {
    pub name: String,
    /// Indices of its subsystems, at least one, ascending: the order in which all of them sum.
    pub members: Vec<usize>,
    pub place: Place,
}

/// What changing constraints ask of a member. Every output is one of its coupling outputs up to scale, so that Z_i bounds
/// every row over the outputs.
#[derive(Debug, Clone, PartialEq)]
pub struct Exposed {
    /// Per output: y = factor z.
    pub outputs: Vec<ExposedOutput>,
    /// The smallest margin that a changing constraint states: what (26) may take at most of a row that reads one output with
    /// coefficient 1.
    pub margin: Option<Margin>,
}

/// An output among the coupling outputs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExposedOutput {
    /// Index of the coupling output.
    pub z: usize,
    pub factor: f64,
}

/// In the unit of the outputs, positive.
#[derive(Debug, Clone, PartialEq)]
pub struct Margin {
    pub value: f64,
    pub place: Place,
}

/// Where the network-wide values stand in the file.
#[derive(Debug, Clone, Default)]
pub struct NetworkPlaces {
    pub epsilon: Option<Place>,
    pub horizon: Option<Place>,
    pub sizing: Option<Place>,
    pub gains: Option<Place>,
    pub scalar: Option<Place>,
}

/// Where the parts of one subsystem stand in the file. `header` is the name in `[subsystem.name]`; the others fall
/// back to it where the file leaves the key out (use [`SubsystemPlaces::or_header`]).
#[derive(Debug, Clone, Default)]
pub struct SubsystemPlaces {
    pub header: Place,
    pub A: Option<Place>,
    pub B: Option<Place>,
    pub C: Option<Place>,
    pub X: Option<Place>,
    pub U: Option<Place>,
    pub w: Option<Place>,
    pub measurement_error: Option<Place>,
    pub loads: Option<Place>,
    pub K: Option<Place>,
    pub calK: Option<Place>,
    pub weights: Option<Place>,
    pub reference_weights: Option<Place>,
    pub cover: Option<Place>,
    pub reserve: Option<Place>,
    /// The `from.<neighbour>` tables.
    pub from: BTreeMap<usize, Place>,
}

impl Network {
    /// Resolves, checks and lowers what the file says; `source` is the text `spec` was read from.
    ///
    /// # Errors
    /// All mistakes in names, matrices, constraints, sets and tuning, but for those that may only follow from others.
    pub fn new(spec: &Spec, source: Source) -> Result<Self, Diagnostics> {
        Self::after(Some(spec), Diagnostics::default(), source)
    }

    /// [`Network::new`] after [`Spec::read`], whose mistakes stand beside those found here.
    ///
    /// # Errors
    /// As [`Network::new`], and `found`, where there is any.
    pub fn after(spec: Option<&Spec>, found: Diagnostics, source: Source) -> Result<Self, Diagnostics> {
        let Some(spec) = spec else { return found.finish(None) };
        let mut mistakes = Mistakes::new(spec, found);
        let parts = Parts::new(spec, &mut mistakes);
        let start = parts.as_ref().and_then(|parts| mistakes.of_result(Start::of_file(spec, &parts.subsystems)));
        let network = mistakes.finish(parts.zip(start))?;
        Ok(Self::of_parts(network, spec, source))
    }

    fn of_parts((parts, start): (Parts, Option<Start>), spec: &Spec, source: Source) -> Self {
        let Parts { settings, subsystems, hold, constraints, changing } = parts;
        Self {
            name: spec.name.value.clone(),
            sample_time: settings.sample_time,
            horizon: settings.horizon,
            reference: settings.reference,
            wishes: settings.wishes,
            gains: spec.gains.as_ref().map_or(GainChoice::default(), |gains| gains.value),
            scalar: spec.scalar.as_ref().map_or(Scalar::default(), |scalar| scalar.value),
            effort: settings.effort,
            subsystems,
            coupling_constraints: constraints,
            changing_constraints: changing.constraints,
            hold,
            start_anywhere: spec.start_anywhere.as_ref().map_or(start.is_some(), |anywhere| anywhere.value),
            start,
            source,
            files: spec.files.clone(),
            places: NetworkPlaces::of(spec),
        }
    }
}

/// What the phases of the lowering make.
struct Parts {
    settings: settings::Settings,
    subsystems: Vec<Subsystem>,
    hold: Option<Hold>,
    constraints: Vec<CouplingConstraint>,
    changing: Changing,
}

impl Parts {
    /// Every phase goes as far as the ones before it allow.
    fn new(spec: &Spec, mistakes: &mut Mistakes) -> Option<Self> {
        let settings = mistakes.of(|errors| settings::settings(spec, errors));
        let form = mistakes.of_result(Form::of(spec));
        let roster = mistakes.of(|errors| Some(Roster::new(spec, errors)).filter(Roster::is_named))?;
        let matrices = form.and_then(|form| mistakes.of(|errors| matrices(form, spec, &roster, errors)));
        let gamma = settings.as_ref().map_or(settings::DEFAULT_GAMMA, |settings| settings.reference.gamma);
        let lowered = matrices.as_ref().map(|(models, _, changing)| (&models[..], changing));
        // Of a partition that is wrong it is not known who owns what.
        if mistakes.include(code::PARTITION) {
            return None;
        }
        let subsystems = mistakes.of(|errors| subsystems(spec, &roster, lowered, gamma, errors));
        let (_, constraints, changing) = matrices?;
        mistakes.of_result(changing.check_start(spec))?;
        let (settings, subsystems) = (settings?, subsystems?);
        // Bounds that are wrong would be missed again.
        if !mistakes.is_empty() {
            return None;
        }
        let (subsystems, hold) = match &settings.sampling {
            Some(sampling) => {
                mistakes.of_result(hold::sample(subsystems, sampling)).map(|(sampled, hold)| (sampled, Some(hold)))?
            }
            None => (subsystems, None),
        };
        Some(Self { settings, subsystems, hold, constraints, changing })
    }
}

impl Network {
    /// Whether anything acts on a subsystem, or on what is measured of it, besides inputs and neighbours.
    pub fn is_disturbed(&self) -> bool {
        self.subsystems.iter().any(Subsystem::is_disturbed)
    }

    /// The scalar type that the file states.
    pub fn stated_scalar(&self) -> Scalar {
        let stated = self.places.scalar.clone().and_then(|place| self.source.text.get(place));
        stated.and_then(|text| text.trim_matches(['"', '\'']).parse().ok()).unwrap_or_default()
    }

    /// Whether a changing constraint states a margin.
    pub fn has_margins(&self) -> bool {
        self.subsystems.iter().any(|s| s.margin().is_some())
    }
}

/// Every model in interaction form, the outputs of coupling constraints among the coupling outputs.
fn matrices(
    form: Form,
    spec: &Spec,
    roster: &Roster,
    errors: &mut Diagnostics,
) -> Option<(Vec<Model>, Vec<CouplingConstraint>, Changing)> {
    let models = model::models(form, spec, roster, errors);
    let constraints = constraints::constraints(spec, roster, errors);
    let changing = Changing::new(spec, roster, errors);
    let (mut models, constraints, changing) = (models?, constraints?, changing?);
    if !errors.is_empty() {
        return None;
    }
    let fixed = constraints.iter().flat_map(constraints::Constraint::rows);
    constraints::export_outputs(&mut models, fixed.chain(changing.rows(roster)));
    let constraints = constraints.into_iter().map(|constraint| constraints::resolve(constraint, &models)).collect();
    Some((models, constraints, changing))
}

/// Without models, only what needs none is checked.
fn subsystems(
    spec: &Spec,
    roster: &Roster,
    lowered: Option<(&[Model], &Changing)>,
    gamma: f64,
    errors: &mut Diagnostics,
) -> Option<Vec<Subsystem>> {
    let lowered = |i: usize| {
        let (models, changing) = lowered?;
        Some((&models[i], changing.exposed(i, &models[i])))
    };
    let indices = 0..spec.subsystems.len();
    let all: Vec<_> = indices.map(|i| subsystem(i, spec, roster, lowered(i), gamma, errors)).collect();
    all.into_iter().collect()
}

fn subsystem(
    i: usize,
    spec: &Spec,
    roster: &Roster,
    lowered: Option<(&Model, Option<Exposed>)>,
    gamma: f64,
    errors: &mut Diagnostics,
) -> Option<Subsystem> {
    let (given, member) = (&spec.subsystems[i], &roster.members[i]);
    let X = polytope(&space("x", "state", &member.states, member), &given.x, errors);
    let U = polytope(&space("u", "input", &member.inputs, member), &given.u, errors);
    let w = disturbance::disturbance(&space("w", "state", &member.states, member), &given.w, errors);
    let measurement_error = disturbance::measurement_error(&given.measurement_error, member, errors);
    let loads = loads::loads(given, member, errors);
    let weights = tuning::weights(given, member, gamma, spec, errors);
    let gains = weights.as_ref().and_then(|weights| tuning::gains(given, member, weights, errors));
    let y_weights = tuning::y_weights(&given.y_weight, member, errors);
    let (model, exposed) = lowered?;
    let coupling_outputs = coupling_outputs(model, member);
    let cover = X.as_ref().and_then(|X| tuning::cover(&given.cover, member, &model.C, X, errors));
    let reserve = tuning::reserve(&given.reserve, member, &coupling_outputs, errors);
    let (Model { A, B, C, E, L, Cz, Dz }, weights) = (model.clone(), weights?);
    Some(Subsystem {
        name: member.name.clone(),
        states: member.states.clone(),
        inputs: member.inputs.clone(),
        outputs: member.outputs.clone(),
        A,
        B,
        C,
        E,
        L,
        Cz,
        Dz,
        coupling_outputs,
        X: X?,
        U: U?,
        w: w?,
        measurement_error: measurement_error?,
        loads: loads?,
        Q: weights.Q,
        R: weights.R,
        T: weights.T,
        gains: gains?,
        cover: cover?,
        reserve: reserve?,
        y_weights: y_weights?,
        exposed,
        places: SubsystemPlaces::of(given, spec, roster),
    })
}

fn space<'a>(key: &str, kind: &'static str, signals: &'a [Signal], member: &Member) -> Space<'a> {
    Space { what: format!("`{key}` of subsystem `{}`", member.name), kind, signals }
}

fn coupling_outputs(model: &Model, member: &Member) -> Vec<String> {
    let signals: Vec<_> = member.states.iter().chain(&member.inputs).cloned().collect();
    model.coupling_rows().iter().map(|row| words::combination(row.as_slice(), &signals)).collect()
}

impl NetworkPlaces {
    fn of(spec: &Spec) -> Self {
        Self {
            epsilon: spec.reference.epsilon.as_ref().map(|epsilon| epsilon.place.clone()),
            horizon: Some(spec.horizon.place.clone()),
            sizing: spec.sizing.place.clone(),
            gains: spec.gains.as_ref().map(|gains| gains.place.clone()),
            scalar: spec.scalar.as_ref().map(|scalar| scalar.place.clone()),
        }
    }
}

impl SubsystemPlaces {
    fn of(given: &spec::Subsystem, spec: &Spec, roster: &Roster) -> Self {
        let place = |matrix: &Option<spec::Matrix>| matrix.as_ref().map(|matrix| matrix.place.clone());
        let whole = |matrix: fn(&spec::Collective) -> &spec::Matrix| {
            spec.collective.as_ref().map(|collective| matrix(collective).place.clone())
        };
        let index =
            |import: &spec::Import| Some((roster.index(&import.neighbour.value)?, import.neighbour.place.clone()));
        Self {
            header: given.name.place.clone(),
            A: place(&given.A).or_else(|| whole(|collective| &collective.A)),
            B: place(&given.B).or_else(|| whole(|collective| &collective.B)),
            C: place(&given.C).or_else(|| whole(|collective| &collective.C)),
            X: given.x.as_ref().map(|bounds| bounds.place.clone()),
            U: given.u.as_ref().map(|bounds| bounds.place.clone()),
            w: given.w.as_ref().map(|bounds| bounds.place.clone()),
            measurement_error: given.measurement_error.as_ref().map(spec::PerSignal::place),
            loads: given.d.as_ref().map(|bounds| bounds.place.clone()),
            K: place(&given.K),
            calK: place(&given.Kx),
            weights: given.gain_weights.place.clone(),
            reference_weights: given.reference_weights.place.clone(),
            cover: given.cover_place.clone(),
            reserve: given.reserve.as_ref().map(spec::PerSignal::place),
            from: given.from.iter().filter_map(index).collect(),
        }
    }

    /// `place` where the file states it, else the subsystem's header.
    pub fn or_header(&self, place: &Option<Place>) -> Place {
        place.clone().unwrap_or_else(|| self.header.clone())
    }
}

impl Subsystem {
    /// n_i.
    pub fn n(&self) -> usize {
        self.A.nrows()
    }
    /// m_i.
    pub fn m(&self) -> usize {
        self.B.ncols()
    }
    /// p_i.
    pub fn p(&self) -> usize {
        self.C.nrows()
    }
    /// Whether anything acts on it, or on what is measured of it, besides inputs and neighbours.
    pub fn is_disturbed(&self) -> bool {
        self.w.is_some() || self.measurement_error.amax() > 0.0 || !self.loads.is_empty()
    }
    /// What changing constraints ask.
    pub fn margin(&self) -> Option<&Margin> {
        self.exposed.as_ref()?.margin.as_ref()
    }
    /// Number of coupling outputs.
    pub fn nz(&self) -> usize {
        self.Cz.nrows()
    }
}
