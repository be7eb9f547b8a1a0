//! Where a network starts.

use nalgebra::DVector;

use super::{Acting, names};
use crate::diagnostic::{Diagnostic, Diagnostics, code};
use crate::network::{self, Network, Signal, Subsystem};
use crate::spec::scenario::{self as written};

/// The state before step 0, and what references start from.
#[derive(Debug, Clone, PartialEq)]
pub enum Start {
    /// References rest where the outputs are these, under these loads; states are off that by `deviation`. All per subsystem.
    Rest { outputs: Vec<DVector<f64>>, loads: Vec<DVector<f64>>, deviation: Vec<DVector<f64>> },
    /// A start-up plan leads from this state: that of the design's [`start`](crate::design::Design::start), which was made for it.
    Planned(network::Start),
}

impl Start {
    /// At rest at 0, under the loads of step 0.
    pub fn at_zero(acting: &[Acting], network: &Network) -> Self {
        let outputs = network.subsystems.iter().map(|s| DVector::zeros(s.p())).collect();
        let deviation = network.subsystems.iter().map(|s| DVector::zeros(s.n())).collect();
        Self::Rest { outputs, loads: first_loads(acting, network), deviation }
    }

    /// What the text says; where it says nothing, what the network's file says, and else rest at 0.
    pub fn of(given: &written::Scenario, acting: &[Acting], network: &Network, errors: &mut Diagnostics) -> Self {
        let starts = given.subsystems.iter().filter_map(|one| Some((&one.name, one.start.as_ref()?)));
        let starts: Vec<_> = starts.collect();
        let planned = is_planned(given);
        let mut start = match (&network.start, planned || starts.is_empty()) {
            (Some(start), true) => Self::Planned(start.clone()),
            (None, true) if planned => Self::Planned(network::Start::at(zeros(network, Subsystem::n), network)),
            _ => Self::at_zero(acting, network),
        };
        for (name, given) in starts {
            let Some(i) = network.subsystems.iter().position(|s| s.name == name.value) else { continue };
            start.set(i, given, &network.subsystems[i], errors);
        }
        start
    }

    fn set(&mut self, i: usize, given: &written::Start, s: &Subsystem, errors: &mut Diagnostics) {
        let at_rest = given.outputs.is_some() || given.deviation.is_some();
        let read = |key: &str, row: &Option<crate::spec::Row>, signals: &[Signal], errors: &mut Diagnostics| {
            row.as_ref()
                .and_then(|row| names::vector(&format!("`{key}` of subsystem `{}`", s.name), row, signals, errors))
        };
        match self {
            Self::Planned(start) if !at_rest => {
                start.x0[i] = read("x0", &given.x0, &s.states, errors).unwrap_or_else(|| DVector::zeros(s.n()));
                let loads = read("d0", &given.d0, &s.loads.signals, errors);
                start.d0[i] = loads.unwrap_or_else(|| DVector::zeros(s.loads.len()));
                start.places[i] = Some(given.place.clone());
            }
            Self::Planned(_) => {
                let error = Diagnostic::error(code::PLANNED_START, "a start is either planned or at rest");
                let label =
                    "`x0` asks for a start-up plan of the whole network, `outputs` and `deviation` for a start at rest";
                errors.push(error.at(given.place.clone(), label).help("state x0 of all subsystems, or of none"));
            }
            Self::Rest { outputs, loads, deviation } => {
                outputs[i] = read("outputs", &given.outputs, &s.outputs, errors).unwrap_or_else(|| outputs[i].clone());
                loads[i] = read("d0", &given.d0, &s.loads.signals, errors).unwrap_or_else(|| loads[i].clone());
                let off = read("deviation", &given.deviation, &s.states, errors);
                deviation[i] = off.unwrap_or_else(|| deviation[i].clone());
            }
        }
    }
}

/// Whether the text asks for a start-up plan.
pub fn is_planned(given: &written::Scenario) -> bool {
    given.subsystems.iter().filter_map(|one| one.start.as_ref()).any(|start| start.x0.is_some())
}

fn zeros(network: &Network, count: fn(&Subsystem) -> usize) -> Vec<DVector<f64>> {
    network.subsystems.iter().map(|s| DVector::zeros(count(s))).collect()
}

/// Those of step 0, put within their bounds, in which controllers can start.
fn first_loads(acting: &[Acting], network: &Network) -> Vec<DVector<f64>> {
    let of = |(acting, s): (&Acting, &Subsystem)| {
        let first =
            |k: usize, _: usize| acting.loads[k].first().map_or(0.0, |d| d.clamp(s.loads.min[k], s.loads.max[k]));
        DVector::from_fn(s.loads.len(), first)
    };
    acting.iter().zip(&network.subsystems).map(of).collect()
}
