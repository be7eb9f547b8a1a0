//! The four-tank under its emitted controllers, in either precision: the plant computes in double precision, and all claims are
//! checked in it; limits of states and inputs without any tolerance.

use crate::Random;

/// What a run has come to.
#[derive(Debug, Clone, Copy, Default)]
pub struct Tally {
    pub steps: usize,
    /// Steps of a subsystem that solved its problem, and that used the shifted candidate.
    pub solved: usize,
    pub candidates: usize,
    /// Displacements to a state that the controller admits.
    pub upsets: usize,
    /// Steps of a subsystem without the guarantee.
    pub lost: usize,
    /// Times a state or input was beyond its limit, x - xhat outside of E_i, or z - zref outside of Z_i.
    pub violations: usize,
    /// The smallest distance of a state or input to a limit, relative to its range.
    pub nearest: f64,
}

impl Tally {
    pub fn new() -> Self {
        Self { nearest: f64::INFINITY, ..Self::default() }
    }

    pub fn add(&mut self, other: &Self) {
        self.steps += other.steps;
        self.solved += other.solved;
        self.candidates += other.candidates;
        self.upsets += other.upsets;
        self.lost += other.lost;
        self.violations += other.violations;
        self.nearest = self.nearest.min(other.nearest);
    }

    fn within(&mut self, value: f64, low: f64, high: f64) {
        let distance = (value - low).min(high - value) / (high - low);
        self.nearest = self.nearest.min(distance);
        self.violations += usize::from(distance < 0.0 || distance.is_nan());
    }

    /// A deviation from what telemetry says, which is rounded itself.
    fn at_most(&mut self, value: f64, limit: f64, rounded: f64) {
        self.violations += usize::from(value.abs() > limit * (1.0 + 1e-9) + rounded || value.is_nan());
    }
}

impl std::fmt::Display for Tally {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { steps, solved, candidates, upsets, lost, violations, nearest } = self;
        write!(
            f,
            "{steps} steps of a subsystem, {solved} problems solved, {candidates} candidates, {upsets} upsets: {violations} violations, \
             {lost} without guarantee; nearest to a limit {nearest:.1e} of its range"
        )
    }
}

/// The plant, Section VI of the paper, and its limits.
const A: [[f64; 4]; 4] =
    [[0.9921, 0.0, 0.0, 0.0206], [0.0, 0.9835, 0.0, 0.0], [0.0, 0.0165, 0.9945, 0.0], [0.0, 0.0, 0.0, 0.9793]];
const B: [[f64; 2]; 4] = [[0.0417, 2.47e-4], [0.0156, 0.0], [1.30e-4, 0.0311], [0.0, 0.0235]];
const LOW: [f64; 4] = [-12.4, -1.4, -12.7, -1.8];
const HIGH: [f64; 4] = [27.6, 38.6, 27.3, 38.2];
const VOLTS: f64 = 3.0;

fn dot<const N: usize>(row: &[f64; N], x: &[f64; N]) -> f64 {
    row.iter().zip(x).map(|(a, x)| a * x).sum()
}

/// x+ = A x + B u.
fn advance(x: &[f64; 4], u: [f64; 2]) -> [f64; 4] {
    std::array::from_fn(|k| dot(&A[k], x) + dot(&B[k], &u))
}

/// Set-points jump now and then, half of them out of reach; now and then the state of one subsystem jumps in a random direction, up to
/// the last state that its controller admits.
struct Course {
    random: Random,
    set_points: [f64; 2],
}

impl Course {
    fn next(&mut self) -> [f64; 2] {
        if self.random.chance(0.01) {
            self.set_points = std::array::from_fn(|_| self.random.between(-5.0, 7.0));
        }
        self.set_points
    }

    /// Which subsystem is displaced, in which direction, and to which share of the way to the edge.
    fn upset(&mut self) -> Option<(usize, [f64; 2], f64)> {
        let direction = self.random.direction(2);
        let (side, share) = (self.random.below(2), self.random.between(0.5, 1.0));
        self.random.chance(0.03).then(|| (side, [direction[0], direction[1]], if share > 0.9 { 1.0 } else { share }))
    }
}

/// The largest multiple of `direction` from `centre` that is admitted.
fn edge(centre: [f64; 2], direction: [f64; 2], mut admits: impl FnMut([f64; 2]) -> bool) -> [f64; 2] {
    let at = |distance: f64| [0, 1].map(|k| centre[k] + distance * direction[k]);
    let (mut inside, mut outside) = (0.0, 100.0);
    for _ in 0..40 {
        let middle = 0.5 * (inside + outside);
        if admits(at(middle)) { inside = middle } else { outside = middle }
    }
    at(inside)
}

/// Defines a function that runs the loop for a seed and a number of steps, with the controllers of a module in a scalar type.
macro_rules! closed_loop {
    ($name:ident, $network:path, $real:ty) => {
        /// One run.
        pub fn $name(seed: u64, steps: usize) -> Tally {
            use $network::{left, right};
            let narrow = |x: &[f64]| [x[0] as $real, x[1] as $real];
            let mut tally = Tally::new();
            let mut course = Course { random: Random(seed), set_points: [0.0; 2] };
            let mut x = [0.0; 4];
            let (mut a, mut from_a) = left::start(&left::steady_state(&[0.0; 2])).expect("rest at 0 is admissible");
            let (mut b, mut from_b) = right::start(&right::steady_state(&[0.0; 2])).expect("rest at 0 is admissible");
            let (mut to_a, mut to_b) = (left::Inbox::new(), right::Inbox::new());
            for _ in 0..steps {
                to_a.accept(&left::FROM_RIGHT, &from_b).expect("the message of the step before");
                to_b.accept(&right::FROM_LEFT, &from_a).expect("the message of the step before");
                if let Some((side, direction, share)) = course.upset() {
                    let probe = |at: [f64; 2]| match side {
                        0 => a.clone().input(&narrow(&at)).control.is_admissible(),
                        _ => b.clone().input(&narrow(&at)).control.is_admissible(),
                    };
                    let reference = match side {
                        0 => a.clone().input(&narrow(&x[..2])).telemetry.x_ref,
                        _ => b.clone().input(&narrow(&x[2..])).telemetry.x_ref,
                    };
                    let centre = reference.map(|x| x as f64);
                    let edge = edge(centre, direction, probe);
                    for k in 0..2 {
                        x[2 * side + k] = centre[k] + share * (edge[k] - centre[k]);
                    }
                    tally.upsets += 1;
                }
                let set_points = course.next().map(|y| y as $real);
                let one = a.step(&narrow(&x[..2]), &[set_points[0]], &mut to_a);
                let two = b.step(&narrow(&x[2..]), &[set_points[1]], &mut to_b);
                (from_a, from_b) = (one.message, two.message);
                let u = [one.input[0] as f64, two.input[0] as f64];
                let statuses = [&one.status.control, &two.status.control];
                tally.lost +=
                    [one.status.is_guaranteed(), two.status.is_guaranteed()].iter().filter(|held| !**held).count();
                for control in statuses {
                    tally.solved += usize::from(matches!(control, dpc_runtime::Control::Optimal { .. }));
                    tally.candidates += usize::from(matches!(control, dpc_runtime::Control::Candidate));
                }
                (0..4).for_each(|k| tally.within(x[k], LOW[k], HIGH[k]));
                u.iter().for_each(|u| tally.within(*u, -VOLTS, VOLTS));
                let telemetry = [&one.telemetry, &two.telemetry];
                for (side, tube) in [&left::TUBE[..], &right::TUBE[..]].iter().enumerate() {
                    let off = [0, 1].map(|k| x[2 * side + k] - telemetry[side].x_nom[k] as f64);
                    tube.iter().for_each(|(row, q)| {
                        tally.at_most(dot(&row.map(|p| p as f64), &off), *q as f64, 60.0 * <$real>::EPSILON as f64)
                    });
                }
                // z of a subsystem is its row of the other's model.
                let zetas = [left::Z_WIDTHS[0] as f64, right::Z_WIDTHS[0] as f64];
                for side in 0..2 {
                    let (cz, dz) = ([A[2][1], A[0][3]][side], [B[2][0], B[0][1]][side]);
                    let state = x[2 * side + 1] - telemetry[side].x_ref[1] as f64;
                    tally.at_most(
                        cz * state + dz * (u[side] - telemetry[side].u_ref[0] as f64),
                        zetas[side],
                        <$real>::EPSILON as f64,
                    );
                }
                tally.steps += 2;
                x = advance(&x, u);
            }
            tally
        }
    };
}

closed_loop!(double, dpc_generated::four_tank, f64);
closed_loop!(single, dpc_generated::four_tank_single, f32);
