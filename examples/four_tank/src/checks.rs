//! Whether the plant kept what the design promises, counted at every step.

use crate::sets::{Polytope, Promise, Subsystem};
use crate::trajectory::{NodeSample, Outcome, Sample};

/// Beyond a limit by more than this, in the limit's unit, is outside: rounding is not a violation.
pub const ROUNDING: f64 = 1e-9;

/// Counts and smallest margins over the steps looked at.
#[derive(Debug, Clone)]
pub struct Checks {
    pub nodes: Vec<NodeChecks>,
    pub steps: usize,
}

/// The same for one subsystem.
#[derive(Debug, Clone)]
pub struct NodeChecks {
    subsystem: Subsystem,
    /// x in X_i.
    pub states: Watch,
    /// u in U_i.
    pub inputs: Watch,
    /// x - xhat in E_i.
    pub tube: Watch,
    /// z - zref in Z_i, z of the true plant.
    pub coupling: Watch,
    /// Steps whose i-DPC problem (33) had no solution.
    pub infeasible: usize,
    /// Steps at which the controller fell back on the shifted candidate (47) for another reason.
    pub fell_back: usize,
    /// Steps at which a constraint of the i-DPC problem was active.
    pub active: usize,
}

/// How far inside a set a signal stayed.
#[derive(Debug, Clone)]
pub struct Watch {
    set: Polytope,
    /// Per row of the set, the least that was left, in the row's unit.
    pub margins: Vec<f64>,
    /// Steps outside.
    pub violations: usize,
}

impl Checks {
    pub fn new(promise: &Promise) -> Self {
        Self { nodes: promise.subsystems.iter().map(NodeChecks::new).collect(), steps: 0 }
    }

    pub fn look(&mut self, sample: &Sample) {
        self.steps += 1;
        self.nodes.iter_mut().zip(&sample.nodes).for_each(|(checks, node)| checks.look(node));
    }

    /// Adds what another run saw.
    pub fn absorb(&mut self, other: &Self) {
        self.steps += other.steps;
        self.nodes.iter_mut().zip(&other.nodes).for_each(|(mine, theirs)| mine.absorb(theirs));
    }

    /// Steps of any subsystem at which anything went wrong that Theorem 1 excludes.
    pub fn violations(&self) -> usize {
        self.sum(|node| node.watches().iter().map(|watch| watch.violations).sum::<usize>() + node.infeasible)
    }

    pub fn sum(&self, count: impl Fn(&NodeChecks) -> usize) -> usize {
        self.nodes.iter().map(count).sum()
    }
}

impl NodeChecks {
    fn new(subsystem: &Subsystem) -> Self {
        Self {
            states: Watch::new(&subsystem.X),
            inputs: Watch::new(&subsystem.U),
            tube: Watch::new(&subsystem.rpi),
            coupling: Watch::new(&subsystem.z_set),
            infeasible: 0,
            fell_back: 0,
            active: 0,
            subsystem: subsystem.clone(),
        }
    }

    fn look(&mut self, node: &NodeSample) {
        self.states.look(&node.x);
        self.inputs.look(&node.u);
        self.tube.look(&minus(&node.x, &node.x_nom));
        let z = self.subsystem.coupling_output(&node.x, &node.u);
        self.coupling.look(&minus(&z, &node.z_ref));
        match node.outcome {
            Outcome::Optimal { active } => self.active += usize::from(active > 0),
            Outcome::FellBack => self.fell_back += 1,
            Outcome::Infeasible => self.infeasible += 1,
        }
    }

    fn absorb(&mut self, other: &Self) {
        let theirs = other.watches();
        for (mine, theirs) in self.watches_mut().into_iter().zip(theirs) {
            mine.absorb(theirs);
        }
        self.infeasible += other.infeasible;
        self.fell_back += other.fell_back;
        self.active += other.active;
    }

    fn watches(&self) -> [&Watch; 4] {
        [&self.states, &self.inputs, &self.tube, &self.coupling]
    }

    fn watches_mut(&mut self) -> [&mut Watch; 4] {
        [&mut self.states, &mut self.inputs, &mut self.tube, &mut self.coupling]
    }
}

impl Watch {
    fn new(set: &Polytope) -> Self {
        Self { set: set.clone(), margins: vec![f64::INFINITY; set.h.len()], violations: 0 }
    }

    fn look(&mut self, v: &[f64]) {
        let mut outside = false;
        for (smallest, margin) in self.margins.iter_mut().zip(self.set.margins(v)) {
            *smallest = smallest.min(margin);
            outside |= margin.is_nan() || margin < -ROUNDING;
        }
        self.violations += usize::from(outside);
    }

    fn absorb(&mut self, other: &Self) {
        self.margins.iter_mut().zip(&other.margins).for_each(|(mine, theirs)| *mine = mine.min(*theirs));
        self.violations += other.violations;
    }

    /// The smallest margin as a share of its limit.
    pub fn share_left(&self) -> f64 {
        let shares = self.margins.iter().zip(&self.set.h).map(|(margin, limit)| margin / limit);
        shares.fold(f64::INFINITY, f64::min)
    }
}

fn minus(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

#[cfg(test)]
mod tests {
    use super::Checks;
    use crate::sets::Promise;
    use crate::trajectory::{NodeSample, Outcome, Sample};

    const PROMISE: &str = r#"{"subsystems": [{"name": "left", "A": [], "B": [], "Cz": [[0.0, 2.0]], "Dz": [[1.0]],
        "X": {"H": [[1, 0], [0, -1]], "h": [5, 1]}, "U": {"H": [[1], [-1]], "h": [3, 3]},
        "rpi": {"H": [[1, 0], [-1, 0]], "h": [0.5, 0.5]}, "z_set": {"H": [[1], [-1]], "h": [0.25, 0.25]},
        "y_set": {"H": [[1], [-1]], "h": [2, 2]}}]}"#;

    /// Every margin is positive.
    const INSIDE: NodeSample = NodeSample {
        x: [1.0, 0.5],
        u: [2.0],
        set_point: 0.0,
        y_ref: 0.0,
        x_nom: [1.25, 0.0],
        z_ref: [2.875],
        outcome: Outcome::Optimal { active: 0 },
    };

    fn seen(node: NodeSample) -> Checks {
        let mut checks = Checks::new(&Promise::new(PROMISE).unwrap());
        checks.look(&Sample { nodes: [node.clone(), node] });
        checks
    }

    #[test]
    fn margins_are_what_is_left() {
        let checks = seen(INSIDE);
        let node = &checks.nodes[0];
        assert_eq!((node.states.margins.clone(), node.inputs.margins.clone()), (vec![4.0, 1.5], vec![1.0, 5.0]));
        assert_eq!((node.tube.margins.clone(), node.tube.share_left()), (vec![0.75, 0.25], 0.5));
        assert_eq!(node.coupling.margins, vec![0.125, 0.375]);
        assert_eq!((checks.violations(), checks.steps), (0, 1));
    }

    #[test]
    fn each_kind_of_violation_is_counted() {
        let wrong = [
            NodeSample { x: [1.0, -1.1], z_ref: [-0.2], x_nom: [1.0, -1.1], ..INSIDE },
            NodeSample { u: [3.1], z_ref: [4.1], ..INSIDE },
            NodeSample { x_nom: [1.51, 0.0], ..INSIDE },
            NodeSample { z_ref: [3.26], ..INSIDE },
            NodeSample { outcome: Outcome::Infeasible, ..INSIDE },
            NodeSample { z_ref: [f64::NAN], ..INSIDE },
        ];
        for node in wrong {
            assert_eq!(seen(node.clone()).violations(), 1, "{node:?}");
        }
        assert_eq!(seen(NodeSample { u: [3.0 + 1e-12], z_ref: [4.0], ..INSIDE }).violations(), 0);
    }

    #[test]
    fn runs_add_up() {
        let mut checks = seen(INSIDE);
        checks.absorb(&seen(NodeSample { u: [3.1], z_ref: [4.1], outcome: Outcome::Optimal { active: 2 }, ..INSIDE }));
        checks.absorb(&seen(NodeSample { outcome: Outcome::FellBack, ..INSIDE }));
        let node = &checks.nodes[0];
        assert_eq!((checks.steps, node.inputs.violations, node.active, node.fell_back), (3, 1, 1, 1));
        assert!((node.inputs.margins[0] + 0.1).abs() < 1e-12);
    }
}
