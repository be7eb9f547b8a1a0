//! Measured loads that keep their bounds and rates, and use both.

use crate::random::Random;
use crate::sets::Subsystem;

/// The loads of one subsystem from step to step.
#[derive(Debug, Clone)]
pub struct Inflow {
    ends: Vec<[f64; 2]>,
    rates: Vec<f64>,
    way: Vec<Way>,
    /// Now.
    pub d: Vec<f64>,
}

#[derive(Debug, Clone, Copy)]
enum Way {
    /// At full rate to one end.
    To(usize),
    Rest,
    /// Up or down at full rate, anew in every step.
    Shake,
}

impl Inflow {
    /// At rest somewhere inside the bounds.
    pub fn new(subsystem: &Subsystem, random: &mut Random) -> Self {
        let rates = subsystem.load_rate.clone();
        let set = subsystem.load_set.as_ref();
        let ends: Vec<_> = (0..rates.len()).map(|k| set.map_or([0.0; 2], |set| set.interval(k))).collect();
        let d = ends.iter().map(|[low, high]| random.between(*low, *high)).collect();
        Self { way: vec![Way::Rest; rates.len()], ends, rates, d }
    }

    /// One step on.
    pub fn advance(&mut self, random: &mut Random) {
        for (k, way) in self.way.iter_mut().enumerate() {
            if random.integer(0, 30) == 0 {
                *way = [Way::To(0), Way::To(1), Way::Rest, Way::Shake][random.integer(0, 3)];
            }
            let up = match way {
                Way::To(end) => *end == 1,
                Way::Shake => random.integer(0, 1) == 1,
                Way::Rest => continue,
            };
            let wished = self.d[k] + if up { self.rates[k] } else { -self.rates[k] };
            self.d[k] = wished.clamp(self.ends[k][0], self.ends[k][1]);
        }
    }
}
