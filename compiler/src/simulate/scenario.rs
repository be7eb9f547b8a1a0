//! What is asked of a network and what acts on it, drawn out step by step.

mod courses;
mod messages;
mod names;
mod nuisance;
mod rules;
mod starts;
mod truth;
mod visits;

use std::path::Path;

use nalgebra::DVector;

use crate::design::Design;
use crate::diagnostic::{Diagnostic, Diagnostics, Source, code};
use crate::network::{Network, Subsystem};
use crate::spec::At;
use crate::spec::scenario as written;
use courses::Reader;
pub use messages::{Fate, Fates};
pub use rules::Rule;
pub use starts::{Start, is_planned};

/// Everything that a closed loop is given from outside, for every step: nothing is left to chance after this.
///
/// After this point: all lists have an entry per subsystem, signal and step of the network they were drawn for; names were
/// resolved, and every changing constraint has its rule.
#[derive(Debug, Clone)]
pub struct Scenario {
    pub name: String,
    pub seed: u64,
    /// How many sampling periods.
    pub steps: usize,
    pub start: Start,
    /// In the order of the network.
    pub subsystems: Vec<Acting>,
    pub upsets: Vec<Upset>,
    /// What becomes of messages that do not arrive in time.
    pub fates: Fates,
    /// Of the changing constraints, in their order.
    pub rules: Vec<Rule>,
    /// The true plant, where it is not the model.
    pub plant: Option<Network>,
}

/// What acts on one subsystem, and what is asked of it.
#[derive(Debug, Clone)]
pub struct Acting {
    /// By output, then step; in the outputs' units, as all deviations from the operating point.
    pub set_points: Vec<Vec<f64>>,
    /// By load, then step.
    pub loads: Vec<Vec<f64>>,
    /// w_t by step, over the states.
    pub disturbances: Vec<DVector<f64>>,
    /// Measured minus true state, by step.
    pub errors: Vec<DVector<f64>>,
}

/// The state of a subsystem is moved before a step.
#[derive(Debug, Clone, PartialEq)]
pub struct Upset {
    pub step: usize,
    pub subsystem: usize,
    pub to: Jump,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Jump {
    By(DVector<f64>),
    To(DVector<f64>),
}

/// Steps of a scenario that says neither `duration` nor `steps`.
const DEFAULT_STEPS: usize = 500;
/// More are a slip.
const MOST_STEPS: usize = 1_000_000;

impl Scenario {
    /// Draws out the scenario in the text of `source` for the network of `design`. Files it names are looked for in `folder`.
    ///
    /// # Errors
    /// The mistakes in the text: as [`written::Scenario::parse`], and where nothing is wrong there, names that are not in the
    /// network, lengths that do not fit, times outside of the scenario, files that cannot be read, rules that are missing.
    pub fn read(source: &Source, folder: &Path, design: &Design) -> Result<Self, Diagnostics> {
        Self::of(&written::Scenario::parse(source)?, source, folder, design)
    }

    /// [`Self::read`] of a text that was parsed already.
    ///
    /// # Errors
    /// As [`Self::read`], without those of the parser.
    pub fn of(given: &written::Scenario, source: &Source, folder: &Path, design: &Design) -> Result<Self, Diagnostics> {
        let mut errors = Diagnostics::default();
        let (network, period) = (&design.network, design.network.sample_time);
        let (seed, steps) = (seed(given, &mut errors), steps(given, period, &mut errors));
        let Some((seed, steps)) = seed.zip(steps) else { return errors.finish(None) };
        let reader = Reader { design, folder, seed, steps };
        let subsystems = reader.subsystems(given, &mut errors);
        let upsets = given.upsets.iter().map(|upset| self::upset(upset, network, steps, &mut errors));
        let upsets: Vec<_> = upsets.collect();
        let fates = Fates::of(given, &reader, &mut errors);
        let rules = rules::of(given, network, &mut errors);
        let start = Start::of(given, &subsystems, network, &mut errors);
        let plant = given.plant.as_ref().map(|file| truth::of(file, folder, network, &mut errors));
        let name = given.name.as_ref().map_or_else(|| stem(&source.path), |name| name.value.clone());
        errors.finish(Some(()))?;
        let upsets = upsets.into_iter().flatten().collect();
        Ok(Self { name, seed, steps, start, subsystems, upsets, fates, rules, plant: plant.flatten() })
    }

    /// Set-points visit the ends of Y in turn, subsystem by subsystem; nothing disturbs them but, where the design knows of
    /// disturbances, measurement errors and loads, random ones.
    ///
    /// # Errors
    /// E0603 a constraint changes while running, and only a scenario can say by what rule; it points into the network's file.
    pub fn visiting(design: &Design) -> Result<Self, Diagnostics> {
        if let Some(changing) = design.network.changing_constraints.first() {
            let title = format!("constraint `{}` changes while running, and no rule says how", changing.name);
            let error = Diagnostic::error(code::RULE, title).at(changing.place.clone(), "drawn anew at every step");
            let help = "simulate with --scenario FILE, and in FILE a [[rule]] with kind = \"apart\" and a distance";
            return Err(error.help(help).into());
        }
        Ok(visits::scenario(design))
    }
}

fn seed(given: &written::Scenario, errors: &mut Diagnostics) -> Option<u64> {
    let Some(seed) = &given.seed else { return Some(0) };
    let read = u64::try_from(seed.value).ok();
    if read.is_none() {
        errors.push(out_of_range("`seed` must not be negative", seed, "expected 0, 1, 2, ..."));
    }
    read
}

fn steps(given: &written::Scenario, period: f64, errors: &mut Diagnostics) -> Option<usize> {
    let (steps, place) = match (&given.duration, &given.steps) {
        (None, None) => return Some(DEFAULT_STEPS),
        (Some(duration), Some(steps)) => {
            let error = Diagnostic::error(code::SCENARIO_VALUE, "`duration` and `steps` say the same");
            errors.push(error.at(steps.place.clone(), "in sampling periods").at(duration.place.clone(), "in s"));
            return None;
        }
        (Some(duration), None) => ((duration.value / period).round(), duration.place.clone()),
        (None, Some(steps)) => (steps.value as f64, steps.place.clone()),
    };
    if !(1.0..=MOST_STEPS as f64).contains(&steps) {
        let error = Diagnostic::error(code::SCENARIO_VALUE, "the scenario has no length to simulate");
        let label = format!("{steps} sampling periods of {period} s, expected 1 to {MOST_STEPS}");
        errors.push(error.at(place, label));
        return None;
    }
    Some(steps as usize)
}

fn upset(given: &written::Upset, network: &Network, steps: usize, errors: &mut Diagnostics) -> Option<Upset> {
    let step = step_of(&given.at, network.sample_time, steps, errors);
    let subsystem = names::subsystem(&given.subsystem, network, errors);
    let jump = match (&given.by, &given.to) {
        (Some(by), None) => Some((by, false)),
        (None, Some(to)) => Some((to, true)),
        _ => {
            let error = Diagnostic::error(code::SCENARIO_VALUE, "an upset moves a state either `by` or `to`");
            errors.push(error.at(given.place.clone(), "has neither or both"));
            None
        }
    };
    let (step, subsystem, (row, to)) = (step?, subsystem?, jump?);
    let s = &network.subsystems[subsystem];
    let vector = names::vector(if to { "`to` of this upset" } else { "`by` of this upset" }, row, &s.states, errors)?;
    Some(Upset { step, subsystem, to: if to { Jump::To(vector) } else { Jump::By(vector) } })
}

/// The first step at or after a time.
fn step_of(time: &At<f64>, period: f64, steps: usize, errors: &mut Diagnostics) -> Option<usize> {
    let step = first_step(time.value, period);
    if (0.0..steps as f64).contains(&step) {
        return Some(step as usize);
    }
    let error = Diagnostic::error(code::SCENARIO_VALUE, "this time is outside of the scenario");
    let end = period * steps as f64;
    errors.push(error.at(time.place.clone(), format!("{} s, and it lasts from 0 to {end} s", time.value)));
    None
}

/// A time that is a multiple of the period up to rounding is that step's.
fn first_step(time: f64, period: f64) -> f64 {
    (time / period - 1e-9).ceil() + 0.0
}

fn out_of_range<T: std::fmt::Display>(title: &str, value: &At<T>, expected: &str) -> Diagnostic {
    let label = format!("{}, {expected}", value.value);
    Diagnostic::error(code::SCENARIO_VALUE, title).at(value.place.clone(), label)
}

/// `out/upsets.toml` is called `upsets`.
fn stem(path: &str) -> String {
    Path::new(path).file_stem().map_or_else(|| "scenario".to_owned(), |stem| stem.to_string_lossy().into_owned())
}

impl Acting {
    /// Nothing acts, nothing is asked but 0.
    fn at_rest(s: &Subsystem, steps: usize) -> Self {
        let nothing = || vec![DVector::zeros(s.n()); steps];
        Self {
            set_points: vec![vec![0.0; steps]; s.p()],
            loads: vec![vec![0.0; steps]; s.loads.len()],
            disturbances: nothing(),
            errors: nothing(),
        }
    }
}
