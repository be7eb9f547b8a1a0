//! What the file says about one subsystem's tuning: weights, gains, set-points to cover, reserve.

use std::fmt::Display;

use nalgebra::DMatrix;

use super::roster::Member;
use super::rows::hstack;
use super::shape::{Shape, Side, vector};
use super::weights::{Weighing, rounded, smallest_eigenvalue};
use super::words::{names, number};
use super::{GainWishes, NamedPolytope, Signal};
use crate::diagnostic::{Diagnostic, Diagnostics, code};
use crate::spec::{At, Cover, GainWeights, Matrix, PerSignal, ReferenceWeights, Spec, Subsystem};

/// Q_i, R_i of (34), T_i of (29).
pub(super) struct Weights {
    pub Q: DMatrix<f64>,
    pub R: DMatrix<f64>,
    pub T: DMatrix<f64>,
}

pub(super) fn weights(
    given: &Subsystem,
    member: &Member,
    gamma: f64,
    spec: &Spec,
    errors: &mut Diagnostics,
) -> Option<Weights> {
    let owner = format!("of subsystem `{}`", member.name);
    let Q = over_states("Q", &owner, member, 1.0).definite(&given.Q, errors);
    let R = over_inputs("R", &owner, member).definite(&given.R, errors);
    let T = over_outputs("T", &owner, member, 1.0).symmetric(&given.T, errors);
    let T = T.filter(|T| check_gamma(T, gamma, given, spec, errors));
    Some(Weights { Q: Q?, R: R?, T: T? })
}

fn over_states(key: &str, owner: &str, member: &Member, default: f64) -> Weighing {
    let what = format!("weight `{key}` {owner}");
    Weighing { what, size: member.states.len(), per_signal: member.per_state(), default }
}

fn over_inputs(key: &str, owner: &str, member: &Member) -> Weighing {
    let what = format!("weight `{key}` {owner}");
    Weighing { what, size: member.inputs.len(), per_signal: member.per_input(), default: 1.0 }
}

fn over_outputs(key: &str, owner: &str, member: &Member, default: f64) -> Weighing {
    let what = format!("weight `{key}` {owner}");
    Weighing { what, size: member.outputs.len(), per_signal: member.per_output(), default }
}

/// (32)
fn check_gamma(T: &DMatrix<f64>, gamma: f64, given: &Subsystem, spec: &Spec, errors: &mut Diagnostics) -> bool {
    let smallest = smallest_eigenvalue(T);
    if smallest.is_some_and(|smallest| smallest > gamma) {
        return true;
    }
    let found = smallest.map_or("unknown".to_string(), rounded);
    let title = format!("weight `T` of subsystem `{}` is not above gamma", given.name.value);
    let place = given.T.as_ref().map_or_else(|| given.name.place.clone(), |T| T.place());
    let mut error = Diagnostic::error(code::GAMMA, title).at(place, format!("smallest eigenvalue of T: {found}"));
    if let Some(written) = &spec.reference.gamma {
        error = error.at(written.place.clone(), "gamma");
    }
    let note = format!("T > gamma I (32) with gamma = {} makes the reference reach the set-point", number(gamma));
    errors.push(error.note(note).help("raise T or lower gamma; 1e-6 is a good gamma"));
    false
}

pub(super) fn gains(
    given: &Subsystem,
    member: &Member,
    weights: &Weights,
    errors: &mut Diagnostics,
) -> Option<GainWishes> {
    let (states, outputs) = ((member.states.len(), member.per_state()), (member.outputs.len(), member.per_output()));
    let mut gain = |key: &str, matrix: &Option<Matrix>, (size, reason): &(usize, String)| {
        let what = format!("gain `{key}` of subsystem `{}`", member.name);
        let rows = Side::Exactly(member.inputs.len(), member.per_input());
        let shape = Shape { what, rows, columns: Side::Exactly(*size, reason.clone()) };
        matrix.as_ref().map_or(Some(None), |matrix| shape.read(matrix, errors).map(Some))
    };
    let K = gain("K", &given.K, &states);
    let Kx = gain("Kx", &given.Kx, &states);
    let Ke = gain("Ke", &given.Ke, &outputs);
    check_whole(given, errors);
    let state_weights = gain_weights(&given.gain_weights, member, weights, errors);
    let reference_weights = reference_weights(&given.reference_weights, member, weights, errors);
    let calK = Kx?.zip(Ke?).map(|(Kx, Ke)| hstack(&Kx, &Ke));
    Some(GainWishes {
        K: K?,
        calK,
        K_found: None,
        calK_found: None,
        weights: state_weights?,
        reference_weights: reference_weights?,
    })
}

fn check_whole(given: &Subsystem, errors: &mut Diagnostics) {
    let (present, absent, place) = match (&given.Kx, &given.Ke) {
        (Some(Kx), None) => ("Kx", "Ke", Kx.place.clone()),
        (None, Some(Ke)) => ("Ke", "Kx", Ke.place.clone()),
        _ => return,
    };
    let title = format!("subsystem `{}` has `{present}` without `{absent}`", given.name.value);
    let error = Diagnostic::error(code::HALF_A_GAIN, title).at(place, format!("needs `{absent}` beside it"));
    errors.push(
        error
            .note("the reference layer's gain is [Kx Ke], see (7f)")
            .help(format!("add `{absent}`, or leave out `{present}` to have both computed")),
    );
}

type Pair = (DMatrix<f64>, DMatrix<f64>);

fn gain_weights(given: &GainWeights, member: &Member, own: &Weights, errors: &mut Diagnostics) -> Option<Pair> {
    let owner = format!("in `gain-weights` of subsystem `{}`", member.name);
    let Q = given
        .Q
        .as_ref()
        .map_or(Some(own.Q.clone()), |_| over_states("Q", &owner, member, 1.0).definite(&given.Q, errors));
    let R =
        given.R.as_ref().map_or(Some(own.R.clone()), |_| over_inputs("R", &owner, member).definite(&given.R, errors));
    Some((Q?, R?))
}

fn reference_weights(
    given: &ReferenceWeights,
    member: &Member,
    own: &Weights,
    errors: &mut Diagnostics,
) -> Option<Pair> {
    let owner = format!("in `reference-weights` of subsystem `{}`", member.name);
    let Q = given
        .Q
        .as_ref()
        .map_or(Some(own.Q.clone()), |_| over_states("Q", &owner, member, 1.0).definite(&given.Q, errors));
    let Qe = over_outputs("Qe", &owner, member, 0.1).definite(&given.Qe, errors);
    let R =
        given.R.as_ref().map_or(Some(own.R.clone()), |_| over_inputs("R", &owner, member).definite(&given.R, errors));
    Some((block_diagonal(&Q?, &Qe?), R?))
}

fn block_diagonal(one: &DMatrix<f64>, other: &DMatrix<f64>) -> DMatrix<f64> {
    let n = one.nrows();
    let mut whole = one.clone().resize(n + other.nrows(), n + other.nrows(), 0.0);
    whole.view_mut((n, n), other.shape()).copy_from(other);
    whole
}

/// `cover` per output, in output units.
pub(super) fn cover(
    given: &[Cover],
    member: &Member,
    C: &DMatrix<f64>,
    X: &NamedPolytope,
    errors: &mut Diagnostics,
) -> Option<Vec<Option<(f64, f64)>>> {
    let before = errors.0.len();
    let mut cover = vec![None; member.outputs.len()];
    for wish in given {
        let Some(k) = member.find_output(&wish.output, errors) else { continue };
        let reach = reach(C, k, X);
        if check_cover(wish, &member.outputs[k], reach, errors) {
            cover[k] = Some(wish.interval.value);
        }
    }
    (errors.0.len() == before).then_some(cover)
}

fn check_cover(wish: &Cover, output: &Signal, reach: (f64, f64), errors: &mut Diagnostics) -> bool {
    let (low, high) = wish.interval.value;
    let unit = output.unit_suffix();
    let name = &output.name;
    let complaint = match () {
        () if low > high => format!("{} lies above {}", number(low), number(high)),
        () if low > 0.0 || high < 0.0 => format!("0{unit}, the operating point, is not among them"),
        () if low < reach.0 => format!("`{name}` cannot go below {}{unit}", number(reach.0)),
        () if high > reach.1 => format!("`{name}` cannot go above {}{unit}", number(reach.1)),
        () => return true,
    };
    let error =
        Diagnostic::error(code::COVER, format!("the set-points to cover of output `{name}` cannot all be reached"));
    let error = error.at(wish.interval.place.clone(), complaint).note(reachable(name, &unit, reach));
    errors.push(error.help("write [low, high] with low <= 0 <= high, inside the bounds of the states"));
    false
}

/// The interval that X leaves the output, as far as it says.
fn reachable(name: &str, unit: &dyn Display, (low, high): (f64, f64)) -> String {
    match (low.is_finite(), high.is_finite()) {
        (true, true) => format!("`x` lets `{name}` be {} to {}{unit}", number(low), number(high)),
        (true, false) => format!("`x` lets `{name}` be {}{unit} or more", number(low)),
        (false, true) => format!("`x` lets `{name}` be {}{unit} or less", number(high)),
        (false, false) => format!("`x` does not bound `{name}`"),
    }
}

/// An interval that holds output `k` wherever the state is in X.
fn reach(C: &DMatrix<f64>, k: usize, X: &NamedPolytope) -> (f64, f64) {
    let row = C.row(k).clone_owned();
    let box_reach = |sign: f64| {
        let terms =
            row.iter().enumerate().filter(|(_, c)| **c != 0.0).map(|(s, c)| c.abs() * side(X, s, sign * c.signum()));
        terms.sum::<f64>()
    };
    (-box_reach(-1.0), box_reach(1.0))
}

/// How far state `s` goes in the direction of `sign`, by the rows of X on this state alone.
fn side(X: &NamedPolytope, s: usize, sign: f64) -> f64 {
    let alone = |row: &usize| X.H.row(*row).iter().enumerate().all(|(c, v)| (c == s) == (*v != 0.0));
    let rows = (0..X.H.nrows()).filter(alone).filter(|&row| X.H[(row, s)] * sign > 0.0);
    rows.map(|row| X.h[row] / X.H[(row, s)].abs()).fold(f64::INFINITY, f64::min)
}

/// `reserve` per coupling output.
pub(super) fn reserve(
    given: &Option<PerSignal>,
    member: &Member,
    coupling_outputs: &[String],
    errors: &mut Diagnostics,
) -> Option<Vec<f64>> {
    let signals =
        if coupling_outputs.is_empty() { "nobody reads this subsystem".into() } else { coupling_outputs.join("; ") };
    let reason = format!("one per coupling output: {signals}");
    let Some(reserve) = per_signal("reserve", given, member, coupling_outputs.len(), &reason, errors)? else {
        return Some(vec![0.0; coupling_outputs.len()]);
    };
    let fits: Vec<_> = reserve.iter().map(|one| check_reserve(one, member, errors)).collect();
    fits.into_iter().collect()
}

/// `y-weight` per output; 1 where the file leaves it out.
pub(super) fn y_weights(given: &Option<PerSignal>, member: &Member, errors: &mut Diagnostics) -> Option<Vec<f64>> {
    let reason = format!("one per output: {}", names(&member.outputs));
    let Some(weights) = per_signal("y-weight", given, member, member.outputs.len(), &reason, errors)? else {
        return Some(vec![1.0; member.outputs.len()]);
    };
    let fits: Vec<_> = weights.iter().map(|one| check_y_weight(one, member, errors)).collect();
    fits.into_iter().collect()
}

/// One value per signal, from one for all or a list; `Some(None)` where the file says nothing.
fn per_signal(
    key: &str,
    given: &Option<PerSignal>,
    member: &Member,
    count: usize,
    reason: &str,
    errors: &mut Diagnostics,
) -> Option<Option<Vec<At<f64>>>> {
    match given {
        None => Some(None),
        Some(PerSignal::Every(every)) => Some(Some(vec![every.clone(); count])),
        Some(PerSignal::Each(each)) => {
            vector(&format!("`{key}` of subsystem `{}`", member.name), each, count, reason, errors)?;
            Some(Some(each.value.clone()))
        }
    }
}

fn check_reserve(reserve: &At<f64>, member: &Member, errors: &mut Diagnostics) -> Option<f64> {
    let fits = reserve.value >= 0.0 && reserve.value.is_finite();
    if !fits {
        let error =
            Diagnostic::error(code::RESERVE, format!("`reserve` of subsystem `{}` cannot be granted", member.name));
        let label = format!("{}, expected a finite number of 0 or more", number(reserve.value));
        errors.push(error.at(reserve.place.clone(), label));
    }
    fits.then_some(reserve.value)
}

fn check_y_weight(weight: &At<f64>, member: &Member, errors: &mut Diagnostics) -> Option<f64> {
    let fits = weight.value > 0.0 && weight.value.is_finite();
    if !fits {
        let error =
            Diagnostic::error(code::OUT_OF_RANGE, format!("`y-weight` of subsystem `{}` is out of range", member.name));
        errors.push(error.at(weight.place.clone(), format!("{}, expected a number above 0", number(weight.value))));
    }
    fits.then_some(weight.value)
}
