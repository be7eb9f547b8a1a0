//! What the file says about the network as a whole: times, reference layer, wishes for the sizing.

use super::hold::Sampling;
use super::words::number;
use super::{Norm, Reference, Wishes};
use crate::diagnostic::{Diagnostic, Diagnostics, code};
use crate::spec::{At, HoldWish, Spec, Time};
use crate::tuning::Effort;

pub(super) const DEFAULT_GAMMA: f64 = 1e-6;
/// The condensed problems grow with the square of the horizon.
const LONGEST_HORIZON: usize = 500;

pub(super) struct Settings {
    pub sample_time: f64,
    pub horizon: usize,
    pub reference: Reference,
    pub wishes: Wishes,
    pub effort: Effort,
    /// Of models in continuous time.
    pub sampling: Option<Sampling>,
}

pub(super) fn settings(spec: &Spec, errors: &mut Diagnostics) -> Option<Settings> {
    let sample_time = positive("`sample-time`", &spec.sample_time, "seconds", errors);
    let horizon = horizon(&spec.horizon, errors);
    let reference = reference(spec, errors);
    let wishes = wishes(spec, errors);
    let effort = effort(&spec.sizing.effort, errors);
    let sampling = sampling(spec, errors);
    Some(Settings {
        sample_time: sample_time?,
        horizon: horizon?,
        reference: reference?,
        wishes: wishes?,
        effort: effort?,
        sampling: sampling?,
    })
}

/// How to sample, where the model is in continuous time.
fn sampling(spec: &Spec, errors: &mut Diagnostics) -> Option<Option<Sampling>> {
    let wish = spec.hold_error.as_ref();
    if spec.time == Time::Continuous {
        let charged = wish.filter(|wish| wish.value == HoldWish::Disturbance).map(|wish| wish.place.clone());
        return Some(Some(Sampling { period: spec.sample_time.value, charged }));
    }
    let Some(wish) = wish else { return Some(None) };
    let error = Diagnostic::error(code::HOLD_ERROR, "`hold-error` belongs to a model in continuous time");
    let error = error.at(wish.place.clone(), "nothing is held here: the model is in discrete time");
    errors.push(
        error.help("write time = \"continuous\" if A and B are those of x' = A x + B u, or leave `hold-error` out"),
    );
    None
}

fn horizon(given: &At<i64>, errors: &mut Diagnostics) -> Option<usize> {
    let horizon = usize::try_from(given.value).ok().filter(|n| (1..=LONGEST_HORIZON).contains(n));
    if horizon.is_none() {
        let error = Diagnostic::error(code::OUT_OF_RANGE, "`horizon` is out of range");
        let label = format!("{} steps, expected 1 to {LONGEST_HORIZON}", given.value);
        errors.push(error.at(given.place.clone(), label).note("it is N of (33): the steps the controllers look ahead"));
    }
    horizon
}

fn effort(given: &Option<At<i64>>, errors: &mut Diagnostics) -> Option<Effort> {
    let Some(given) = given else { return Some(Effort::default()) };
    let effort = u8::try_from(given.value).ok().and_then(Effort::new);
    if effort.is_none() {
        let error = Diagnostic::error(code::OUT_OF_RANGE, "`effort` is out of range");
        let label = format!("{}, expected 0 to {}", given.value, Effort::MOST);
        errors.push(
            error.at(given.place.clone(), label).note("it says how long to search for better gains; 0: not at all"),
        );
    }
    effort
}

fn reference(spec: &Spec, errors: &mut Diagnostics) -> Option<Reference> {
    let given = &spec.reference;
    let epsilon = match &given.epsilon {
        Some(epsilon) => positive("`epsilon`", epsilon, "output units per step", errors).map(Some),
        None => Some(None),
    };
    let gamma = match &given.gamma {
        Some(gamma) => positive("`gamma`", gamma, "see (29)", errors),
        None => Some(DEFAULT_GAMMA),
    };
    Some(Reference { epsilon: epsilon?, norm: given.norm.unwrap_or(Norm::Inf), gamma: gamma? })
}

fn wishes(spec: &Spec, errors: &mut Diagnostics) -> Option<Wishes> {
    let given = &spec.sizing;
    let y_weight = given.y_weight.as_ref().map_or(Some(1.0), |w| positive("`y-weight`", w, "a weight", errors));
    let reserve_weight = weight("`reserve-weight`", &given.reserve_weight, 0.2, errors);
    let terminal_weight = weight("`terminal-weight`", &given.terminal_weight, 0.1, errors);
    // With no weight at all, a free epsilon would end at 0 and nothing would ever move.
    let epsilon_weight = match &given.epsilon_weight {
        Some(weight) if spec.reference.epsilon.is_none() => {
            positive("`epsilon-weight`", weight, "`epsilon` is left out, so its weight decides", errors)
        }
        given => weight("`epsilon-weight`", given, 0.25, errors),
    };
    let end_weight = weight("`end-weight`", &given.end_weight, 0.1, errors);
    let facet_loss = weight("`facet-loss`", &given.facet_loss, 0.01, errors);
    Some(Wishes {
        y_weight: y_weight?,
        reserve_weight: reserve_weight?,
        terminal_weight: terminal_weight?,
        epsilon_weight: epsilon_weight?,
        end_weight: end_weight?,
        facet_loss: facet_loss?,
        symmetric: given.symmetric.unwrap_or(false),
    })
}

fn weight(key: &str, given: &Option<At<f64>>, default: f64, errors: &mut Diagnostics) -> Option<f64> {
    given.as_ref().map_or(Some(default), |given| not_negative(key, given, errors))
}

fn positive(key: &str, given: &At<f64>, unit: &str, errors: &mut Diagnostics) -> Option<f64> {
    in_range(key, given, given.value > 0.0, &format!("a number above 0 ({unit})"), errors)
}

fn not_negative(key: &str, given: &At<f64>, errors: &mut Diagnostics) -> Option<f64> {
    in_range(key, given, given.value >= 0.0, "0 or more", errors)
}

fn in_range(key: &str, given: &At<f64>, fits: bool, expected: &str, errors: &mut Diagnostics) -> Option<f64> {
    if !fits {
        let error = Diagnostic::error(code::OUT_OF_RANGE, format!("{key} is out of range"));
        errors.push(error.at(given.place.clone(), format!("{}, expected {expected}", number(given.value))));
    }
    fits.then_some(given.value)
}
