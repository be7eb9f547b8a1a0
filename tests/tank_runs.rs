//! The run of the examples in C and Python, in Rust: the emitted controllers of the four-tank with messages as bytes.

/// A step: the inputs bit by bit, and how they came about as the C interface numbers it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Line {
    pub bits: [u64; 2],
    pub controls: [i32; 2],
}

const STEPS: usize = 600;
const A: [[f64; 4]; 4] =
    [[0.9921, 0.0, 0.0, 0.0206], [0.0, 0.9835, 0.0, 0.0], [0.0, 0.0165, 0.9945, 0.0], [0.0, 0.0, 0.0, 0.9793]];
const B: [[f64; 2]; 4] = [[0.0417, 2.47e-4], [0.0156, 0.0], [1.30e-4, 0.0311], [0.0, 0.0235]];
const PROFILE: [[f64; 2]; 4] = [[2.0, 1.0], [-0.5, 2.5], [9.0, -0.5], [0.0, 0.0]];

fn advance(x: &[f64; 4], u: &[f64; 2]) -> [f64; 4] {
    std::array::from_fn(|k| {
        let state = A[k].iter().zip(x).fold(0.0, |sum, (a, x)| sum + a * x);
        B[k].iter().zip(u).fold(state, |sum, (b, u)| sum + b * u)
    })
}

fn number(control: &dpc_runtime::Control) -> i32 {
    match control {
        dpc_runtime::Control::AtReference => 1,
        dpc_runtime::Control::Optimal { .. } => 2,
        dpc_runtime::Control::Candidate => 3,
        dpc_runtime::Control::Infeasible { .. } => 4,
        dpc_runtime::Control::IterationLimit => 5,
        dpc_runtime::Control::NotFinite => 6,
    }
}

macro_rules! run {
    ($name:ident, $network:path, $real:ty) => {
        /// The run in this scalar type.
        ///
        /// # Panics
        /// A start or a message is refused.
        pub fn $name() -> Vec<Line> {
            use $network::{left, right};
            let (mut a, message) = left::start(&left::steady_state(&[0.0; 2])).expect("rest at 0 is admissible");
            let mut from_a = left::to_bytes(&message);
            let (mut b, message) = right::start(&right::steady_state(&[0.0; 2])).expect("rest at 0 is admissible");
            let mut from_b = right::to_bytes(&message);
            let (mut to_a, mut to_b) = (left::Inbox::new(), right::Inbox::new());
            let mut x = [6.0, 0.0, 0.0, 0.05];
            let mut lines = Vec::new();
            for t in 0..STEPS {
                let y = PROFILE[t / (STEPS / 4)].map(|y| y as $real);
                let measured = x.map(|x: f64| x as $real);
                left::accept_bytes(&mut to_a, &from_b).expect("the message of the step before");
                right::accept_bytes(&mut to_b, &from_a).expect("the message of the step before");
                let one = a.step(&[measured[0], measured[1]], &[y[0]], &mut to_a);
                let two = b.step(&[measured[2], measured[3]], &[y[1]], &mut to_b);
                (from_a, from_b) = (left::to_bytes(&one.message), right::to_bytes(&two.message));
                let u = [one.input[0], two.input[0]];
                let controls = [number(&one.status.control), number(&two.status.control)];
                lines.push(Line { bits: u.map(|u| u64::from(u.to_bits())), controls });
                x = advance(&x, &u.map(f64::from));
                if t == STEPS / 2 {
                    x[2] -= 4.0;
                }
            }
            lines
        }
    };
}

run!(double, dpc_generated::four_tank, f64);
run!(single, dpc_generated::four_tank_single, f32);
