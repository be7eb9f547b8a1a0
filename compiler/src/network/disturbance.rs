//! What the model leaves out, as far as the file bounds it: the disturbance w and the error of the measurement.

use nalgebra::{DMatrix, DVector};

use super::limits::{Ends, Space};
use super::roster::Member;
use super::shape::vector;
use super::words::{combination, number};
use crate::convex::{Bounded, Polytope};
use crate::diagnostic::{Diagnostic, Diagnostics, Place, code};
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

/// normal . w <= limit, as the user reads it.
struct Row {
    normal: DVector<f64>,
    limit: f64,
    name: String,
    place: Place,
}

fn polytope(space: &Space<'_>, given: &Bounds, errors: &mut Diagnostics) -> Option<Polytope> {
    let min = space.ends("min", &given.min, errors);
    let max = space.ends("max", &given.max, errors);
    let general = given.rows.as_ref().map(|(H, h)| space.general(H, h, errors));
    let mut rows = side(space, 1.0, max?);
    rows.extend(side(space, -1.0, min?));
    if let Some(general) = general {
        let (H, h) = general?;
        rows.extend(H.row_iter().zip(h.value).map(|(row, limit)| Row {
            name: format!("{} <= {}", combination(row.clone_owned().as_slice(), space.signals), number(limit.value)),
            normal: row.transpose(),
            limit: limit.value,
            place: limit.place,
        }));
    }
    rows.retain(|row| row.limit != f64::INFINITY);
    let without_zero = rows.iter().filter(|row| row.limit < 0.0);
    let before = errors.0.len();
    without_zero.for_each(|row| errors.push(never_zero(space, row)));
    (errors.0.len() == before).then(|| Polytope {
        H: DMatrix::from_fn(rows.len(), space.signals.len(), |r, c| rows[r].normal[c]),
        h: DVector::from_fn(rows.len(), |r, _| rows[r].limit),
    })
}

/// sign w_k <= sign end_k.
fn side(space: &Space<'_>, sign: f64, ends: Ends) -> Vec<Row> {
    let row = |(k, end): (usize, Option<At<f64>>)| {
        let end = end?;
        Some(Row {
            normal: DVector::from_fn(space.signals.len(), |j, _| if j == k { sign } else { 0.0 }),
            limit: sign * end.value,
            name: space.end_name(k, sign, end.value),
            place: end.place,
        })
    };
    ends.into_iter().enumerate().filter_map(row).collect()
}

fn never_zero(space: &Space<'_>, row: &Row) -> Diagnostic {
    Diagnostic::error(code::DISTURBANCE, format!("{} never is 0", space.what))
        .at(row.place.clone(), format!("{}: leaves out 0", row.name))
        .note("a disturbance that is always there belongs to the operating point the model is linearised about")
        .help("write bounds with min <= 0 <= max, or h >= 0")
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
        let label = format!("{}, expected a finite number of 0 or more", number(end.value));
        let error = Diagnostic::error(code::DISTURBANCE, format!("{what} is no bound")).at(end.place.clone(), label);
        errors.push(error.help("write the largest error of each measured state, such as measurement-error = { max = 0.1 }, and 0 where it is exact"));
    }
    (errors.0.len() == before).then(|| DVector::from_fn(n, |k, _| ends[k].value))
}
