//! Closed loops whose steps are recorded.

/// A generator of numbers that is the same everywhere (PCG's multiplier, upper bits).
#[derive(Debug, Clone)]
pub struct Random(pub u64);

impl Random {
    /// Evenly from [-1, 1).
    pub fn signed(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// What the i-DPC problem of one step depends on.
#[derive(Debug, Clone)]
pub struct Parameters<const NX: usize, const NU: usize, const N: usize> {
    pub e: [f64; NX],
    pub x_ref: [[f64; NX]; N],
    pub u_ref: [[f64; NU]; N],
}

/// Steps of a recorded loop.
pub const STEPS: usize = 1200;
/// Between two upsets, and between two set-points.
pub const UPSET: usize = 30;
pub const JUMP: usize = 50;

/// Parameters of a loop: the plant is the subsystem alone, its imports at zero.
///
/// An upset throws the state in a random direction, by a random share of as far as the problem stays feasible.
macro_rules! record {
    ($($module:tt)*) => {{
        use $($module)* as node;
        use $crate::record::{JUMP, Parameters, Random, STEPS, UPSET};
        let model = &node::TABLES.model;
        let steady = node::SteadyState { x: [0.0; node::NX], u: [0.0; node::NU] };
        let (mut controller, _) = node::Controller::start(&node::TABLES, &steady).expect("rest at zero is admissible");
        let mut inbox = node::Inbox::new();
        let mut random = Random(1);
        let (mut x, mut set_point) = ([0.0; node::NX], [0.0; node::NY]);
        let mut points = Vec::new();
        for t in 0..STEPS + node::N {
            if t % JUMP == 0 {
                set_point = std::array::from_fn(|_| 1e3 * random.signed());
            }
            if t % UPSET == UPSET - 1 {
                let direction: [f64; node::NX] = std::array::from_fn(|_| random.signed());
                let share = 1.0 - 0.5 * (1.0 + random.signed()) * 0.5;
                let moved = |by: f64| -> [f64; node::NX] { std::array::from_fn(|k| x[k] + by * direction[k]) };
                let fits = |by: f64| controller.clone().input(&moved(by)).control.is_admissible();
                let mut far = 1e-6;
                while fits(2.0 * far) && far < 1e6 {
                    far *= 2.0;
                }
                let (mut low, mut high) = (far, 2.0 * far);
                for _ in 0..30 {
                    let middle = 0.5 * (low + high);
                    if fits(middle) { low = middle } else { high = middle }
                }
                x = moved(low * share);
            }
            let step = controller.step(&x, &set_point, &mut inbox);
            points.push((std::array::from_fn::<f64, { node::NX }, _>(|k| x[k] - step.telemetry.x_ref[k]), step.telemetry));
            x = std::array::from_fn(|k| {
                let a: f64 = model.A[k].iter().zip(&x).map(|(a, x)| a * x).sum();
                a + model.B[k].iter().zip(&step.input).map(|(b, u)| b * u).sum::<f64>()
            });
        }
        let at = |t: usize| Parameters::<{ node::NX }, { node::NU }, { node::N }> {
            e: points[t].0,
            x_ref: std::array::from_fn(|k| points[t + k].1.x_ref),
            u_ref: std::array::from_fn(|k| points[t + k].1.u_ref),
        };
        (0..STEPS).map(at).collect::<Vec<_>>()
    }};
}
pub(crate) use record;
