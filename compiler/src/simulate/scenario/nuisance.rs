//! Disturbances and measurement errors within what the design assumes of them, or a multiple of it.

use nalgebra::DVector;

use super::courses::Reader;
use super::out_of_range;
use crate::convex::Bounded;
use crate::diagnostic::{Diagnostic, Diagnostics, code};
use crate::simulate::random::Random;
use crate::spec::scenario::{Kind, Nuisance};

/// A worst case lasts at most so many steps before another one is drawn.
const LONGEST: usize = 40;

/// Attempts to draw a point of a set that is no box; then one on the way from 0 to its edge.
const ATTEMPTS: usize = 200;

/// What the solver's rounding may take a point of the edge beyond it, relative.
const ROUNDING: f64 = 1e-7;

/// w by step.
pub fn disturbance(
    reader: &Reader<'_>,
    i: usize,
    given: &Nuisance,
    stream: u64,
    errors: &mut Diagnostics,
) -> Vec<DVector<f64>> {
    let s = &reader.design.network.subsystems[i];
    let share = share(given, errors);
    let nothing = vec![DVector::zeros(s.n()); reader.steps];
    let set = match (given.kind, &s.w) {
        (Kind::None, _) => return nothing,
        (_, Some(set)) => set,
        (_, None) => {
            let why = format!("subsystem `{}` has no `w`", s.name);
            errors.push(no_set(
                given,
                why,
                "declare `w` in the network's file, or write what is added: disturbance = { add = .. }",
            ));
            return nothing;
        }
    };
    let mut random = Random::new(reader.seed, stream);
    let mut ways = Ways::of(&reader.design.sizing.subsystems[i].E.P);
    let draw = |_| {
        let w = match given.kind {
            Kind::WorstCase => edge(set, &ways.direction(&mut random)),
            Kind::Random | Kind::None => inside(set, &mut random),
        };
        w * share
    };
    (0..reader.steps).map(draw).collect()
}

/// Measured minus true state, by step.
pub fn error(
    reader: &Reader<'_>,
    i: usize,
    given: &Nuisance,
    stream: u64,
    errors: &mut Diagnostics,
) -> Vec<DVector<f64>> {
    let s = &reader.design.network.subsystems[i];
    let share = share(given, errors);
    let nothing = vec![DVector::zeros(s.n()); reader.steps];
    if given.kind == Kind::None {
        return nothing;
    }
    if s.measurement_error.amax() == 0.0 {
        let why = format!("subsystem `{}` has no `measurement-error`", s.name);
        let way = "declare it in the network's file, or write what is added: measurement-error = { add = .. }";
        errors.push(no_set(given, why, way));
        return nothing;
    }
    let mut random = Random::new(reader.seed, stream);
    // How an error moves x - xhat along a facet of E: p B K.
    let through = &reader.design.sizing.subsystems[i].E.P * &s.B * &reader.design.gains.subsystems[i].K;
    let mut ways = Ways::of(&through);
    let draw = |_| {
        let signs = match given.kind {
            Kind::WorstCase => ways.direction(&mut random).map(|sign| if sign < 0.0 { -1.0 } else { 1.0 }),
            Kind::Random | Kind::None => DVector::from_fn(s.n(), |_, _| random.between(-1.0, 1.0)),
        };
        signs.component_mul(&s.measurement_error) * share
    };
    (0..reader.steps).map(draw).collect()
}

fn share(given: &Nuisance, errors: &mut Diagnostics) -> f64 {
    match &given.share {
        Some(share) if share.value < 0.0 => {
            errors.push(out_of_range("`share` must not be negative", share, "expected a number of 0 or more"));
            0.0
        }
        share => share.as_ref().map_or(1.0, |share| share.value),
    }
}

fn no_set(given: &Nuisance, why: String, way: &str) -> Diagnostic {
    let error = Diagnostic::error(code::NO_SET, "there is no set to draw this from");
    error.at(given.place.clone(), why).help(way)
}

/// Directions that push states out of their tubes, each for some steps.
struct Ways<'a> {
    rows: &'a nalgebra::DMatrix<f64>,
    row: usize,
    sign: f64,
    left: usize,
}

impl<'a> Ways<'a> {
    fn of(rows: &'a nalgebra::DMatrix<f64>) -> Self {
        Self { rows, row: 0, sign: 1.0, left: 0 }
    }

    fn direction(&mut self, random: &mut Random) -> DVector<f64> {
        if self.left == 0 {
            self.row = random.below(self.rows.nrows());
            self.sign = if random.unit() < 0.5 { -1.0 } else { 1.0 };
            self.left = 1 + random.below(LONGEST);
        }
        self.left -= 1;
        match self.rows.nrows() {
            0 => DVector::from_fn(self.rows.ncols(), |_, _| random.between(-1.0, 1.0)),
            _ => self.rows.row(self.row).transpose() * self.sign,
        }
    }
}

/// The point of the set that is farthest in a direction.
fn edge(set: &Bounded, direction: &DVector<f64>) -> DVector<f64> {
    if let Some((low, high)) = ends(set) {
        return DVector::from_fn(low.len(), |k, _| if direction[k] < 0.0 { low[k] } else { high[k] });
    }
    let farthest = set.set.support(direction).map(|(_, farthest)| farthest);
    farthest.map_or_else(|| direction * 0.0, |farthest| farthest * (1.0 - ROUNDING))
}

/// Uniform in the set.
fn inside(set: &Bounded, random: &mut Random) -> DVector<f64> {
    if let Some((low, high)) = ends(set) {
        return DVector::from_fn(low.len(), |k, _| random.between(low[k], high[k]));
    }
    for _ in 0..ATTEMPTS {
        let point = set.hull.map(|half| random.between(-half, half));
        if set.set.violation(&point) <= 0.0 {
            return point;
        }
    }
    let direction = set.hull.map(|_| random.between(-1.0, 1.0));
    edge(set, &direction) * random.unit()
}

/// Lowest and highest corner, where the set is a box.
fn ends(set: &Bounded) -> Option<(DVector<f64>, DVector<f64>)> {
    let n = set.hull.len();
    let (mut low, mut high) = (-&set.hull, set.hull.clone());
    for (row, limit) in set.set.H.row_iter().zip(&set.set.h) {
        let mut entries = (0..n).filter(|k| row[*k] != 0.0);
        let (k, None) = (entries.next()?, entries.next()) else { return None };
        let end = limit / row[k];
        if row[k] > 0.0 { high[k] = high[k].min(end) } else { low[k] = low[k].max(end) }
    }
    Some((low, high))
}
