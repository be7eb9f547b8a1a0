//! Where the network starts: `x0` and `d0`, in the file itself or in a file of starts.

use nalgebra::DVector;

use super::shape::vector;
use super::words::{names, number};
use super::{Network, Subsystem};
use crate::diagnostic::{Diagnostic, Diagnostics, Place, Source, code};
use crate::optim::rounding::to_digits;
use crate::spec::{At, Row, Spec, StartOf, did_you_mean};

/// A state of the network, and its loads at that time.
///
/// After this point: every state lies in its X_i, and every load within its bounds.
#[derive(Debug, Clone, PartialEq)]
pub struct Start {
    /// Per subsystem; 0 where nothing is stated.
    pub x0: Vec<DVector<f64>>,
    pub d0: Vec<DVector<f64>>,
    /// Per subsystem, where it is stated.
    pub places: StartPlaces,
    /// The file of starts it was read from; `None` where it is the file of the network.
    pub file: Option<String>,
}

/// The places of `x0`, per subsystem: in the text that the start was read from.
pub type StartPlaces = Vec<Option<Place>>;

/// What one subsystem's start is stated as.
type Stated<'a> = (Option<&'a Row>, Option<&'a Row>);

impl Start {
    /// At the state `x0`, without loads; no place in any text.
    pub fn at(x0: Vec<DVector<f64>>, network: &Network) -> Self {
        let d0 = network.subsystems.iter().map(|s| DVector::zeros(s.loads.len())).collect();
        let places = vec![None; x0.len()];
        Self { x0, d0, places, file: None }
    }

    /// What the file of the network says; `None` where no subsystem has an `x0` or `d0`.
    pub(super) fn of_file(spec: &Spec, subsystems: &[Subsystem]) -> Result<Option<Self>, Diagnostics> {
        let stated: Vec<Stated> = spec.subsystems.iter().map(|given| (given.x0.as_ref(), given.d0.as_ref())).collect();
        if stated.iter().all(|(x0, d0)| x0.is_none() && d0.is_none()) {
            return Ok(None);
        }
        Self::resolve(&stated, subsystems, Diagnostics::default()).map(Some)
    }

    /// What a file of starts says; mistakes point into its text.
    ///
    /// # Errors
    /// As [`StartOf::parse`]; E0112 a subsystem that is not there, E0110 a wrong length, E0129 a start outside of X or of the loads' bounds.
    pub fn of_starts(source: &Source, network: &Network) -> Result<Self, Diagnostics> {
        let starts = StartOf::parse(source)?;
        let mut errors = Diagnostics::default();
        let mut stated: Vec<Stated> = vec![(None, None); network.subsystems.len()];
        for start in &starts {
            match network.subsystems.iter().position(|s| s.name == start.subsystem.value) {
                Some(i) => stated[i] = (start.x0.as_ref(), start.d0.as_ref()),
                None => errors.push(unknown(&start.subsystem, network)),
            }
        }
        let start = Self::resolve(&stated, &network.subsystems, errors)?;
        Ok(Self { file: Some(source.path.clone()), ..start })
    }

    fn resolve(stated: &[Stated], subsystems: &[Subsystem], mut errors: Diagnostics) -> Result<Self, Diagnostics> {
        let (mut x0, mut d0, mut places) = (Vec::new(), Vec::new(), Vec::new());
        for ((state, loads), s) in stated.iter().zip(subsystems) {
            x0.push(state.map_or(Some(DVector::zeros(s.n())), |row| of_states(row, s, &mut errors)));
            d0.push(loads.map_or(Some(DVector::zeros(s.loads.len())), |row| of_loads(row, s, &mut errors)));
            places.push(state.or(*loads).map(|row| row.place.clone()));
        }
        let all = x0.into_iter().collect::<Option<_>>().zip(d0.into_iter().collect());
        errors.finish(all.map(|(x0, d0)| Self { x0, d0, places, file: None }))
    }
}

fn of_states(row: &Row, s: &Subsystem, errors: &mut Diagnostics) -> Option<DVector<f64>> {
    let per_state = format!("one per state: {}", names(&s.states));
    let x = vector(&format!("`x0` of subsystem `{}`", s.name), row, s.n(), &per_state, errors)?;
    let values = &s.X.H * &x;
    let outside = values.iter().zip(&s.X.h).position(|(value, limit)| value > limit);
    if let Some(r) = outside {
        let excess = number(to_digits(values[r] - s.X.h[r], 6));
        let error = Diagnostic::error(code::START_OUTSIDE, format!("`x0` of subsystem `{}` lies outside of X", s.name));
        let label = format!("`{}` does not hold, by {excess}", s.X.rows[r]);
        errors.push(error.at(row.place.clone(), label).help("no input can make up for a constraint that is broken at the start: state a start that keeps it, or widen the bound"));
    }
    outside.is_none().then_some(x)
}

fn of_loads(row: &Row, s: &Subsystem, errors: &mut Diagnostics) -> Option<DVector<f64>> {
    let per_load = match &s.loads.signals[..] {
        [] => "this subsystem has no `loads`".to_owned(),
        loads => format!("one per load: {}", names(loads)),
    };
    let d = vector(&format!("`d0` of subsystem `{}`", s.name), row, s.loads.len(), &per_load, errors)?;
    let inside = |k: &usize| (s.loads.min[*k]..=s.loads.max[*k]).contains(&d[*k]);
    let outside = (0..d.len()).find(|k| !inside(k));
    if let Some(k) = outside {
        let title = format!("`d0` of subsystem `{}` lies outside the bounds of its loads", s.name);
        let (low, high) = (number(s.loads.min[k]), number(s.loads.max[k]));
        let label = format!("{} is {}, not within {low} to {high}", s.loads.signals[k].name, number(d[k]));
        let error = Diagnostic::error(code::START_OUTSIDE, title).at(row.value[k].place.clone(), label);
        errors.push(error.help(format!(
            "write a load within its bounds, such as d0 = [{}], or widen `d`",
            vec!["0.0"; d.len()].join(", ")
        )));
    }
    outside.is_none().then_some(d)
}

fn unknown(name: &At<String>, network: &Network) -> Diagnostic {
    let title = format!("there is no subsystem `{}`", name.value);
    let error = Diagnostic::error(code::UNKNOWN_SUBSYSTEM, title);
    let known = || network.subsystems.iter().map(|s| &*s.name);
    match did_you_mean(&name.value, known()) {
        Some(known) => error.at(name.place.clone(), format!("did you mean `{known}`?")),
        None => {
            let all = known().collect::<Vec<_>>().join(", ");
            error.at(name.place.clone(), "not in the network").help(format!("the subsystems are {all}"))
        }
    }
}
