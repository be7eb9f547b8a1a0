//! The scenario of those who state none.

use super::courses::{EVERY, Room, random_course};
use super::messages::Fates;
use super::{Acting, Scenario, Start};
use crate::design::Design;
use crate::simulate::random::Random;
use crate::spec::scenario::{Kind, Nuisance};

/// How much longer a leg lasts than its reference moves.
const REST: f64 = 1.3;
/// All legs together last no longer, in steps; then each is shortened, and not all ends are reached.
const LONGEST: usize = 3000;

/// Set-points visit the ends of Y in turn, subsystem by subsystem, output by output, and return to 0.
pub fn scenario(design: &Design) -> Scenario {
    let network = &design.network;
    let legs = legs(design);
    let whole: usize = legs.iter().map(|leg| leg.steps).sum();
    let shrink = f64::min(1.0, LONGEST as f64 / whole.max(1) as f64);
    let last = |leg: &Leg| ((leg.steps as f64 * shrink).ceil() as usize).max(1);
    let steps = legs.iter().map(last).sum::<usize>().max(1);
    let mut subsystems: Vec<Acting> = network.subsystems.iter().map(|s| Acting::at_rest(s, steps)).collect();
    let mut from = 0;
    for leg in &legs {
        let to = from + last(leg);
        subsystems[leg.subsystem].set_points[leg.output][from..to].fill(leg.target);
        from = to;
    }
    for (i, acting) in subsystems.iter_mut().enumerate() {
        disturb(design, i, acting, steps);
    }
    let start = network.start.clone().map_or_else(|| Start::at_zero(&subsystems, network), Start::Planned);
    let (name, fates) = ("visits".to_owned(), Fates::default());
    Scenario { name, seed: 0, steps, start, subsystems, upsets: Vec::new(), fates, rules: Vec::new(), plant: None }
}

/// One set-point of one output, held for some steps.
struct Leg {
    subsystem: usize,
    output: usize,
    target: f64,
    steps: usize,
}

fn legs(design: &Design) -> Vec<Leg> {
    let mut legs = Vec::new();
    for (subsystem, sized) in design.sizing.subsystems.iter().enumerate() {
        for output in 0..sized.Y.min.len() {
            let mut at = 0.0_f64;
            for target in [sized.Y.max[output], sized.Y.min[output], 0.0] {
                let moves = (target - at).abs() / design.sizing.epsilon;
                let steps = (REST * moves).ceil() as usize + 10 * design.network.horizon;
                legs.push(Leg { subsystem, output, target, steps });
                at = target;
            }
        }
    }
    legs
}

/// By what the design knows of.
fn disturb(design: &Design, i: usize, acting: &mut Acting, steps: usize) {
    let reader = super::Reader { design, folder: std::path::Path::new(""), seed: 0, steps };
    let random = Nuisance { place: 0..0, kind: Kind::Random, share: None, add: Vec::new() };
    let mut none = crate::diagnostic::Diagnostics::default();
    let s = &design.network.subsystems[i];
    let stream = (i as u64) << 20;
    if s.w.is_some() {
        acting.disturbances = super::nuisance::disturbance(&reader, i, &random, stream + 1, &mut none);
    }
    if s.measurement_error.amax() > 0.0 {
        acting.errors = super::nuisance::error(&reader, i, &random, stream + 2, &mut none);
    }
    for (k, load) in acting.loads.iter_mut().enumerate() {
        let room = Room { low: s.loads.min[k], high: s.loads.max[k], rate: s.loads.rate[k] };
        *load = random_course(&mut Random::new(0, stream + 3 + k as u64), room, EVERY, steps);
    }
}
