//! Disturbances and measurement errors at their bounds, chosen against the controllers.

use crate::random::Random;
use crate::sets::Subsystem;
use crate::trajectory::NodeSample;

/// What acts on one subsystem in one step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Nuisance {
    /// Added to the next state, cm.
    pub w: [f64; 2],
    /// Added to what the controller is told of the state, cm.
    pub v: [f64; 2],
}

/// Chooses for one subsystem; changes its way every 1 to 80 steps.
#[derive(Debug, Clone)]
pub struct Adversary<'a> {
    subsystem: &'a Subsystem,
    /// [min, max] of w per state, and |v|.
    w: [[f64; 2]; 2],
    v: [f64; 2],
    /// Times this far beyond the bounds.
    excess: f64,
    way: Way,
    steps: usize,
}

#[derive(Debug, Clone, Copy)]
enum Way {
    /// A random corner in every step.
    Corners,
    /// The same corner.
    Held(Nuisance),
    /// Along one facet of E_i, the measurement error through K_i likewise.
    Push(usize),
    /// The same, with a measurement that hides where it leads.
    Hide(usize),
    /// From one side to the other after so many steps.
    Swing { row: usize, period: usize },
}

impl<'a> Adversary<'a> {
    /// `excess` of 1 stays inside what the design knows; more is for tests of the tests.
    pub fn new(subsystem: &'a Subsystem, excess: f64) -> Self {
        let w = [0, 1].map(|k| subsystem.disturbance.as_ref().map_or([0.0; 2], |set| set.interval(k)));
        let v = [0, 1].map(|k| subsystem.measurement_error[k]);
        Self { subsystem, w, v, excess, way: Way::Corners, steps: 0 }
    }

    /// What acts now; `last` is the step before.
    pub fn choose(&mut self, last: Option<&NodeSample>, random: &mut Random) -> Nuisance {
        if self.steps == 0 {
            self.way = self.new_way(random);
            self.steps = random.integer(1, 80);
        }
        self.steps -= 1;
        let chosen = match self.way {
            Way::Corners => self.corner(random),
            Way::Held(nuisance) => nuisance,
            Way::Push(row) => Nuisance { v: self.error(self.through_gain(row)), w: self.push(row) },
            Way::Hide(row) => {
                let deviation = last.map_or([0.0; 2], |node| [0, 1].map(|k| node.x_nom[k] - node.x[k]));
                Nuisance { v: self.error(deviation), w: self.push(row) }
            }
            Way::Swing { row, period } if (self.steps / period).is_multiple_of(2) => {
                Nuisance { v: self.error(self.through_gain(row)), w: self.push(row) }
            }
            Way::Swing { row, .. } => {
                Nuisance { v: self.error(self.through_gain(row).map(|p| -p)), w: self.push_back(row) }
            }
        };
        Nuisance { w: chosen.w.map(|w| self.excess * w), v: chosen.v.map(|v| self.excess * v) }
    }

    fn new_way(&self, random: &mut Random) -> Way {
        let row = random.integer(0, self.subsystem.rpi.h.len() - 1);
        match random.integer(0, 4) {
            0 => Way::Corners,
            1 => Way::Held(self.corner(random)),
            2 => Way::Push(row),
            3 => Way::Hide(row),
            _ => Way::Swing { row, period: random.integer(1, 20) },
        }
    }

    fn corner(&self, random: &mut Random) -> Nuisance {
        let mut side = || random.integer(0, 1);
        Nuisance { w: self.w.map(|ends| ends[side()]), v: self.v.map(|v| if side() == 0 { -v } else { v }) }
    }

    /// w that moves x - xhat farthest along a facet of E_i.
    fn push(&self, row: usize) -> [f64; 2] {
        let p = &self.subsystem.rpi.H[row];
        [0, 1].map(|k| self.w[k][usize::from(p[k] > 0.0)])
    }

    fn push_back(&self, row: usize) -> [f64; 2] {
        let p = &self.subsystem.rpi.H[row];
        [0, 1].map(|k| self.w[k][usize::from(p[k] <= 0.0)])
    }

    /// p B_ii K_i: how the measurement error moves x - xhat along a facet.
    fn through_gain(&self, row: usize) -> [f64; 2] {
        let Subsystem { rpi, B, K, .. } = self.subsystem;
        [0, 1].map(|k| (0..2).map(|state| rpi.H[row][state] * B[state][0] * K[0][k]).sum())
    }

    /// v with these signs.
    fn error(&self, signs: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|k| if signs[k] < 0.0 { -self.v[k] } else { self.v[k] })
    }
}
