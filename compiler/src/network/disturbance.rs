//! What the model leaves out, as far as the file bounds it: the disturbance w and the error of the measurement.

use nalgebra::{DMatrix, DVector};

use super::limits::Space;
use super::roster::Member;
use super::shape::vector;
use super::words::{combination, number};
use crate::convex::{Bounded, Polytope};
use crate::diagnostic::{Diagnostic, Diagnostics, code};
use crate::spec::{At, Bounds, PerSignal};

/// The set that `given` describes, which must hold 0 and be bounded; `Some(None)` where the file says nothing.
pub(super) fn disturbance(
    space: &Space<'_>,
    given: &Option<Bounds>,
    errors: &mut Diagnostics,
) -> Option<Option<Bounded>> {
    let Some(given) = given else { return Some(None) };
    let set = polytope(space, given, errors)?;
    let bounded = Bounded::new(set).map_err(|(k, sign)| errors.push(unbounded(space, given, k, sign)));
    bounded.ok().map(Some)
}

fn polytope(space: &Space<'_>, given: &Bounds, errors: &mut Diagnostics) -> Option<Polytope> {
    let n = space.signals.len();
    let min = space.ends("min", &given.min, errors);
    let max = space.ends("max", &given.max, errors);
    let general = given.rows.as_ref().map(|(H, h)| space.general(H, h, errors));
    let mut rows: Vec<(DVector<f64>, At<f64>)> = Vec::new();
    for (sign, ends) in [(1.0, max?), (-1.0, min?)] {
        let axis = |k: usize| DVector::from_fn(n, |j, _| if j == k { sign } else { 0.0 });
        let ends = ends.into_iter().enumerate().filter_map(|(k, end)| Some((axis(k), end?)));
        rows.extend(ends.map(|(normal, end)| (normal, At::new(sign * end.value, end.place))));
    }
    if let Some(general) = general {
        let (H, h) = general?;
        rows.extend(H.row_iter().map(|row| row.transpose()).zip(h.value));
    }
    rows.retain(|(_, limit)| limit.value != f64::INFINITY);
    let holds_zero = rows.iter().filter(|(row, limit)| !check_zero(space, row, limit, errors)).count() == 0;
    holds_zero.then(|| Polytope {
        H: DMatrix::from_fn(rows.len(), n, |r, c| rows[r].0[c]),
        h: DVector::from_fn(rows.len(), |r, _| rows[r].1.value),
    })
}

fn check_zero(space: &Space<'_>, row: &DVector<f64>, limit: &At<f64>, errors: &mut Diagnostics) -> bool {
    if limit.value < 0.0 {
        let label = format!("{} <= {}", combination(row.as_slice(), space.signals), number(limit.value));
        let error = Diagnostic::error(code::DISTURBANCE, format!("{} never is 0", space.what));
        errors.push(
            error
                .at(limit.place.clone(), label)
                .note("a disturbance that is always there belongs to the operating point the model is linearised about")
                .help("write bounds with min <= 0 <= max, or h >= 0"),
        );
    }
    limit.value >= 0.0
}

fn unbounded(space: &Space<'_>, given: &Bounds, k: usize, sign: f64) -> Diagnostic {
    let side = if sign > 0.0 { "above" } else { "below" };
    Diagnostic::error(code::DISTURBANCE, format!("{} has no bound", space.what))
        .at(given.place.clone(), format!("what is added to `{}` is not bounded {side}", space.signals[k].name))
        .help("bound it from both sides in every state, by 0 where there is no disturbance")
}

/// |v_k| <= entry k: how far each measured state may be off; 0 where the file says nothing.
pub(super) fn measurement_error(
    given: &Option<PerSignal>,
    member: &Member,
    errors: &mut Diagnostics,
) -> Option<DVector<f64>> {
    let n = member.states.len();
    let what = format!("`measurement-error` of subsystem `{}`", member.name);
    let ends = match given {
        None => return Some(DVector::zeros(n)),
        Some(PerSignal::Every(every)) => vec![every.clone(); n],
        Some(PerSignal::Each(each)) => {
            vector(&format!("`max` of {what}"), each, n, &member.per_state(), errors)?;
            each.value.clone()
        }
    };
    let before = errors.0.len();
    let wrong = ends.iter().find(|end| !(0.0..f64::INFINITY).contains(&end.value));
    if let Some(end) = wrong {
        let label = format!("{}, expected a number of 0 or more", number(end.value));
        errors.push(Diagnostic::error(code::DISTURBANCE, format!("{what} is no bound")).at(end.place.clone(), label));
    }
    (errors.0.len() == before).then(|| DVector::from_fn(n, |k, _| ends[k].value))
}
