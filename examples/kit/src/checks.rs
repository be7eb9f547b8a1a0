//! Whether the plant kept what the design promises, counted at every step.

use dpc_runtime::Control;

use crate::sets::{Polytope, Promise, Subsystem};
use crate::trajectory::NodeSample;

/// Beyond a limit by more than this, in the limit's unit, is outside: rounding is not a violation. What is a difference of numbers
/// above 1 is given this much of the largest of them.
pub const ROUNDING: f64 = 1e-9;

/// What every design adds to W_i for the rounding of the on-line step, twice 1e-8 of the tighter bound of each state: a state
/// outside of E_i by rounding of this size is inside again at the next step.
const FLOOR: f64 = 2e-8;

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
    /// Steps at which the solver gave no solution and the shifted candidate (47), which is feasible, was used.
    pub fell_back: usize,
    /// Steps whose problem had a solution, and whose status did not say that the guarantee holds all the same.
    pub unguaranteed: usize,
    /// Steps at which a constraint of the i-DPC problem was active.
    pub active: usize,
}

/// What is looked at of one subsystem at one step.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    pub x: &'a [f64],
    pub u: &'a [f64],
    /// xhat_{t|t}.
    pub x_nom: &'a [f64],
    /// zref_t.
    pub z_ref: &'a [f64],
    pub control: Control,
    /// Whether the status says that the guarantee does not hold.
    pub unguaranteed: bool,
}

impl<'a> From<&'a NodeSample> for View<'a> {
    fn from(node: &'a NodeSample) -> Self {
        let NodeSample { x, u, x_nom, z_ref, control, unguaranteed, .. } = node;
        Self { x, u, x_nom, z_ref, control: *control, unguaranteed: *unguaranteed }
    }
}

/// How far inside a set a signal stayed.
#[derive(Debug, Clone)]
pub struct Watch {
    set: Polytope,
    /// Per row of the set, the least that was left, in the row's unit.
    pub margins: Vec<f64>,
    /// Steps outside.
    pub violations: usize,
    /// How far beyond each row is no violation, whatever the sizes.
    allowed: Vec<f64>,
}

impl Checks {
    pub fn new(promise: &Promise) -> Self {
        Self { nodes: promise.subsystems.iter().map(NodeChecks::new).collect(), steps: 0 }
    }

    /// One step of all subsystems, in the order of the promise.
    pub fn look<'a>(&mut self, step: impl IntoIterator<Item = View<'a>>) {
        self.steps += 1;
        self.nodes.iter_mut().zip(step).for_each(|(checks, node)| checks.look(&node));
    }

    /// Adds what another run saw.
    pub fn absorb(&mut self, other: &Self) {
        self.steps += other.steps;
        self.nodes.iter_mut().zip(&other.nodes).for_each(|(mine, theirs)| mine.absorb(theirs));
    }

    /// Steps of any subsystem at which anything went wrong that Theorem 1 excludes.
    pub fn violations(&self) -> usize {
        let sets = |node: &NodeChecks| node.watches().iter().map(|watch| watch.violations).sum::<usize>();
        self.sum(|node| sets(node) + node.infeasible + node.unguaranteed)
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
            tube: Watch::of_tube(subsystem),
            coupling: Watch::new(&subsystem.z_set),
            infeasible: 0,
            fell_back: 0,
            active: 0,
            unguaranteed: 0,
            subsystem: subsystem.clone(),
        }
    }

    fn look(&mut self, node: &View) {
        self.states.look(node.x, 1.0);
        self.inputs.look(node.u, 1.0);
        self.tube.look(&minus(node.x, node.x_nom), size(node.x_nom));
        let z = self.subsystem.coupling_output(node.x, node.u);
        self.coupling.look(&minus(&z, node.z_ref), size(node.z_ref));
        match node.control {
            Control::AtReference => {}
            Control::Optimal { active, .. } => self.active += usize::from(active > 0),
            Control::Candidate => self.fell_back += 1,
            Control::Infeasible { .. } | Control::IterationLimit | Control::NotFinite => self.infeasible += 1,
        }
        self.unguaranteed += usize::from(node.unguaranteed && node.control.is_admissible());
    }

    fn absorb(&mut self, other: &Self) {
        let theirs = other.watches();
        for (mine, theirs) in self.watches_mut().into_iter().zip(theirs) {
            mine.absorb(theirs);
        }
        self.infeasible += other.infeasible;
        self.fell_back += other.fell_back;
        self.active += other.active;
        self.unguaranteed += other.unguaranteed;
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
        let rows = set.h.len();
        Self { set: set.clone(), margins: vec![f64::INFINITY; rows], violations: 0, allowed: vec![0.0; rows] }
    }

    /// Of E_i: what the floor of W_i is in each row is no violation.
    fn of_tube(subsystem: &Subsystem) -> Self {
        let floor = |k: usize| {
            let [low, high] = subsystem.X.interval(k);
            let scale = high.min(-low);
            FLOOR * if scale.is_finite() { scale } else { 1.0 }
        };
        let allowed = |row: &Vec<f64>| row.iter().enumerate().map(|(k, p)| p.abs() * floor(k)).sum();
        let allowed = subsystem.rpi.H.iter().map(allowed).collect();
        Self { allowed, ..Self::new(&subsystem.rpi) }
    }

    fn look(&mut self, v: &[f64], size: f64) {
        let mut outside = false;
        let rows = self.margins.iter_mut().zip(self.set.margins(v)).zip(&self.allowed);
        for ((smallest, margin), allowed) in rows {
            *smallest = smallest.min(margin);
            outside |= margin.is_nan() || margin < -f64::max(ROUNDING * size, *allowed);
        }
        self.violations += usize::from(outside);
    }

    fn absorb(&mut self, other: &Self) {
        self.margins.iter_mut().zip(&other.margins).for_each(|(mine, theirs)| *mine = mine.min(*theirs));
        self.violations += other.violations;
    }

    /// The set it looks at.
    pub fn set(&self) -> &Polytope {
        &self.set
    }

    /// The smallest margin as a share of its limit.
    pub fn share_left(&self) -> f64 {
        let shares = self.margins.iter().zip(&self.set.h).map(|(margin, limit)| margin / limit);
        shares.fold(f64::INFINITY, f64::min)
    }
}

/// The largest of the numbers, at least 1.
fn size(v: &[f64]) -> f64 {
    v.iter().fold(1.0, |size, x| x.abs().max(size))
}

fn minus(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

#[cfg(test)]
mod tests {
    use dpc_runtime::Control;

    use super::{Checks, View};
    use crate::sets::Promise;
    use crate::trajectory::NodeSample;

    const PROMISE: &str = r#"{"subsystems": [{"name": "left", "A": [], "B": [], "Cz": [[0.0, 2.0]], "Dz": [[1.0]],
        "X": {"H": [[1, 0], [0, -1]], "h": [5, 1]}, "U": {"H": [[1], [-1]], "h": [3, 3]},
        "rpi": {"H": [[1, 0], [-1, 0]], "h": [0.5, 0.5]}, "z_set": {"H": [[1], [-1]], "h": [0.25, 0.25]},
        "y_set": {"H": [[1], [-1]], "h": [2, 2]}}]}"#;

    const ACTIVE: Control = Control::Optimal { iterations: 3, active: 2 };

    /// Every margin is positive.
    fn inside() -> NodeSample {
        NodeSample {
            x: vec![1.0, 0.5],
            u: vec![2.0],
            set_point: vec![0.0],
            y_ref: vec![0.0],
            x_nom: vec![1.25, 0.0],
            z_ref: vec![2.875],
            control: Control::AtReference,
            unguaranteed: false,
        }
    }

    fn seen(node: NodeSample) -> Checks {
        let mut checks = Checks::new(&Promise::new(PROMISE).unwrap());
        checks.look([View::from(&node), View::from(&node)]);
        checks
    }

    #[test]
    fn margins_are_what_is_left() {
        let checks = seen(inside());
        let node = &checks.nodes[0];
        assert_eq!((node.states.margins.clone(), node.inputs.margins.clone()), (vec![4.0, 1.5], vec![1.0, 5.0]));
        assert_eq!((node.tube.margins.clone(), node.tube.share_left()), (vec![0.75, 0.25], 0.5));
        assert_eq!(node.coupling.margins, vec![0.125, 0.375]);
        assert_eq!((checks.violations(), checks.steps), (0, 1));
    }

    #[test]
    fn each_kind_of_violation_is_counted() {
        let wrong = [
            NodeSample { x: vec![1.0, -1.1], z_ref: vec![-0.2], x_nom: vec![1.0, -1.1], ..inside() },
            NodeSample { u: vec![3.1], z_ref: vec![4.1], ..inside() },
            NodeSample { x_nom: vec![1.51, 0.0], ..inside() },
            NodeSample { z_ref: vec![3.26], ..inside() },
            NodeSample { z_ref: vec![f64::NAN], ..inside() },
            NodeSample { control: Control::Infeasible { row: 0 }, ..inside() },
            NodeSample { control: Control::IterationLimit, ..inside() },
            NodeSample { control: Control::NotFinite, ..inside() },
            NodeSample { unguaranteed: true, ..inside() },
        ];
        for node in wrong {
            assert_eq!(seen(node.clone()).violations(), 1, "{node:?}");
        }
        assert_eq!(seen(NodeSample { u: vec![3.0 + 1e-12], z_ref: vec![4.0], ..inside() }).violations(), 0);
    }

    #[test]
    fn runs_add_up() {
        let mut checks = seen(inside());
        checks.absorb(&seen(NodeSample { u: vec![3.1], z_ref: vec![4.1], control: ACTIVE, ..inside() }));
        checks.absorb(&seen(NodeSample { control: Control::Candidate, ..inside() }));
        let node = &checks.nodes[0];
        assert_eq!((checks.steps, node.inputs.violations, node.active, node.fell_back), (3, 1, 1, 1));
        assert!((node.inputs.margins[0] + 0.1).abs() < 1e-12);
    }
}
