//! X_i and U_i: bounds and rows become one list of inequalities with 0 strictly inside.

use nalgebra::{DMatrix, DVector, RowDVector};

use super::shape::{Shape, Side, vector};
use super::words::{combination, names, number};
use super::{NamedPolytope, Signal};
use crate::diagnostic::{Diagnostic, Diagnostics, Place, code};
use crate::spec::{At, Bounds, Matrix, PerSignal, Row};

/// The signals a set is over.
pub(super) struct Space<'a> {
    /// ``` `x` of subsystem `left` ```.
    pub what: String,
    /// `state` or `input`.
    pub kind: &'static str,
    pub signals: &'a [Signal],
}

/// Rows of a set under construction.
#[derive(Default)]
struct Rows {
    normals: Vec<RowDVector<f64>>,
    limits: Vec<f64>,
    names: Vec<String>,
}

/// The set that `given` describes; all of the space where it is absent.
pub(super) fn polytope(space: &Space<'_>, given: &Option<Bounds>, errors: &mut Diagnostics) -> Option<NamedPolytope> {
    let mut rows = Rows::default();
    if let Some(given) = given {
        let min = space.ends("min", &given.min, errors);
        let max = space.ends("max", &given.max, errors);
        let general = given.rows.as_ref().map(|(H, h)| space.general(H, h, errors));
        space.push_ends(&mut rows, &min?, &max?, errors);
        if let Some(general) = general {
            space.push_general(&mut rows, general?, errors);
        }
    }
    let n = space.signals.len();
    let H = DMatrix::from_fn(rows.normals.len(), n, |r, c| rows.normals[r][c]);
    Some(NamedPolytope { H, h: DVector::from_vec(rows.limits), rows: rows.names })
}

/// One end of a box per signal; absent ends are `None`.
pub(super) type Ends = Vec<Option<At<f64>>>;

impl Space<'_> {
    pub(super) fn ends(&self, key: &str, given: &Option<PerSignal>, errors: &mut Diagnostics) -> Option<Ends> {
        let n = self.signals.len();
        match given {
            None => Some(vec![None; n]),
            Some(PerSignal::Every(end)) => Some(vec![Some(end.clone()); n]),
            Some(PerSignal::Each(ends)) => {
                vector(&format!("`{key}` of {}", self.what), ends, n, &self.per_signal(), errors)?;
                Some(ends.value.iter().cloned().map(Some).collect())
            }
        }
    }

    fn per_signal(&self) -> String {
        format!("one per {}: {}", self.kind, names(self.signals))
    }

    fn push_ends(&self, rows: &mut Rows, min: &Ends, max: &Ends, errors: &mut Diagnostics) {
        for k in 0..self.signals.len() {
            let consistent = self.check_order(k, &min[k], &max[k], errors);
            for (sign, end) in [(1.0, &max[k]), (-1.0, &min[k])] {
                let Some(end) = end else { continue };
                if consistent && self.check_end(k, sign, end, errors) && end.value.is_finite() {
                    rows.push(self.unit_row(k, sign), sign * end.value, self.end_name(k, sign, end.value));
                }
            }
        }
    }

    fn unit_row(&self, k: usize, sign: f64) -> RowDVector<f64> {
        RowDVector::from_fn(self.signals.len(), |_, c| if c == k { sign } else { 0.0 })
    }

    /// `h1 <= 27.6 cm`.
    pub(super) fn end_name(&self, k: usize, sign: f64, end: f64) -> String {
        let relation = if sign > 0.0 { "<=" } else { ">=" };
        let signal = &self.signals[k];
        format!("{} {relation} {}{}", signal.name, number(end), signal.unit_suffix())
    }

    fn check_order(&self, k: usize, min: &Option<At<f64>>, max: &Option<At<f64>>, errors: &mut Diagnostics) -> bool {
        let (Some(min), Some(max)) = (min, max) else { return true };
        if min.value < max.value {
            return true;
        }
        let signal = &self.signals[k];
        let label = |what: &str, end: &At<f64>| format!("{what} = {}{}", number(end.value), signal.unit_suffix());
        let title = format!("the bounds of `{}` in {} leave no room", signal.name, self.what);
        let error = Diagnostic::error(code::EMPTY_BOUNDS, title)
            .at(min.place.clone(), label("min", min))
            .at(max.place.clone(), label("max", max));
        errors.push(error.help("min must be below max"));
        false
    }

    fn check_end(&self, k: usize, sign: f64, end: &At<f64>, errors: &mut Diagnostics) -> bool {
        let inside = sign * end.value > 0.0;
        if !inside {
            let name = self.end_name(k, sign, end.value);
            let expected = if sign > 0.0 { "above" } else { "below" };
            errors.push(self.zero_outside(&name, &end.place, &format!("must be {expected} 0")));
        }
        inside
    }

    fn zero_outside(&self, row: &str, place: &Place, label: &str) -> Diagnostic {
        Diagnostic::error(code::ZERO_OUTSIDE, format!("0 is not in the interior of {}", self.what))
            .at(place.clone(), format!("{row}: {label}"))
            .note("the model is in deviations from an operating point, which is 0 and must lie strictly inside")
            .help("subtract the operating point from the bound, or linearise about a point strictly inside the bounds")
    }

    /// H, h and the places of h.
    pub(super) fn general(&self, H: &Matrix, h: &Row, errors: &mut Diagnostics) -> Option<(DMatrix<f64>, Row)> {
        let columns = Side::Exactly(self.signals.len(), self.per_signal());
        let shape = Shape { what: format!("matrix `H` of {}", self.what), rows: Side::Free, columns };
        let rows = shape.read(H, errors);
        let limits = vector(&format!("`h` of {}", self.what), h, H.value.len(), "one per row of `H`", errors);
        let (rows, _) = (rows?, limits?);
        check_not_empty(&self.what, &rows, H, errors).then(|| (rows, h.clone()))
    }

    fn push_general(&self, rows: &mut Rows, (H, h): (DMatrix<f64>, Row), errors: &mut Diagnostics) {
        for (normal, limit) in H.row_iter().zip(&h.value) {
            let normal = normal.clone_owned();
            let name = format!("{} <= {}", combination(normal.as_slice(), self.signals), number(limit.value));
            if limit.value <= 0.0 {
                errors.push(self.zero_outside(&name, &limit.place, "the right side must be above 0"));
            } else if limit.value.is_finite() {
                rows.push(normal, limit.value, name);
            }
        }
    }
}

impl Rows {
    fn push(&mut self, normal: RowDVector<f64>, limit: f64, name: String) {
        self.normals.push(normal);
        self.limits.push(limit);
        self.names.push(name);
    }
}

fn check_not_empty(what: &str, rows: &DMatrix<f64>, given: &Matrix, errors: &mut Diagnostics) -> bool {
    let before = errors.0.len();
    for (row, written) in rows.row_iter().zip(&given.value) {
        if row.iter().all(|c| *c == 0.0) {
            let error = Diagnostic::error(code::EMPTY_ROW, format!("a row of `H` of {what} is zero"));
            errors.push(error.at(written.place.clone(), "constrains nothing"));
        }
    }
    errors.0.len() == before
}
