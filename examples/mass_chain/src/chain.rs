//! The chain: masses of 1 kg between two walls, springs of 10 N/m and dampers of 2 N s/m between them, a force on each; the
//! chain of the fast-SLS benchmarks (antoineleeman/fast-SLS, ChainOfMassSpringDampers.m), sampled at 0.1 s.

#![expect(non_snake_case, reason = "the paper's symbols")]

use std::fmt::Write;

use example_kit::matrix::Matrix;

/// s.
pub const SAMPLE_TIME: f64 = 0.1;
/// N.
pub const HORIZON: usize = 5;
/// Length of the chain that controllers are emitted for.
pub const EMITTED: usize = 10;

const MASS: f64 = 1.0;
const SPRING: f64 = 10.0;
const DAMPER: f64 = 2.0;
/// |q| and |v| stay below, m and m/s.
const ROOM: f64 = 3.0;
/// Of epsilon, per mass.
const SPEED_WEIGHT: f64 = 0.5;
/// |force| stays below, N.
pub const FORCE: f64 = 1.0;

/// How the chain's controllers get their gains.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Gains {
    /// From local Riccati equations alone, weights 1: the coupling is too stiff for them.
    Lqr,
    /// The same, and a matrix inequality where they fail.
    Auto,
    /// From local Riccati equations with weights that suit the stiffness: the same for every mass, whatever the length.
    Weighted,
}

impl Gains {
    fn choice(self) -> &'static str {
        match self {
            Self::Lqr | Self::Weighted => "lqr",
            Self::Auto => "auto",
        }
    }

    fn weights(self) -> &'static str {
        match self {
            Self::Lqr | Self::Auto => "",
            Self::Weighted => {
                "gain-weights = { Q = [100.0, 1.0], R = 0.01 }     # a stiff K holds the mass against its neighbours\n\
                 reference-weights = { Q = [100.0, 1.0], Qe = 10.0, R = 0.01 }\n"
            }
        }
    }
}

/// One mass over a sampling period, its neighbours held: from its own (q, v), from a force on it.
pub fn mass() -> (Matrix, Matrix) {
    // Two springs and two dampers hold every mass: next to a wall, one of each holds it to the wall.
    let (stiffness, damping) = (2.0 * SPRING / MASS, 2.0 * DAMPER / MASS);
    let rates = vec![vec![0.0, 1.0, 0.0], vec![-stiffness, -damping, 1.0 / MASS], vec![0.0; 3]];
    let after = Matrix { rows: rates }.map(|x| x * SAMPLE_TIME).exponential();
    let round = |matrix: Matrix| matrix.map(|x| format!("{x:.11e}").parse().unwrap_or(x));
    (round(after.block(0..2, 0..2)), round(after.block(0..2, 2..3)))
}

/// From a neighbour's (q, v): the force of the spring and of the damper to it.
pub fn from_neighbour() -> Matrix {
    mass().1.times(&Matrix { rows: vec![vec![SPRING, DAMPER]] }).map(|x| format!("{x:.11e}").parse().unwrap_or(x))
}

/// Masses next to mass `i` of `length`.
pub fn neighbours(i: usize, length: usize) -> impl Iterator<Item = usize> {
    [i.checked_sub(1), Some(i + 1).filter(|&j| j < length)].into_iter().flatten()
}

/// The TOML file of a chain.
pub fn text(length: usize, gains: Gains) -> String {
    let mut text = format!(
        "# {length} masses of 1 kg between two walls, springs of 10 N/m and dampers of 2 N s/m, one force on each; after the chain\n\
         # of the fast-SLS benchmarks (antoineleeman/fast-SLS). Written by `mass-chain --design`.\n\
         name = \"mass-chain\"\nsample-time = {SAMPLE_TIME:?}                # s\nhorizon = {HORIZON}\ngains = \"{}\"\n\n\
         [reference]\nnorm = \"inf\"\n\n[sizing]\n\
         epsilon-weight = {SPEED_WEIGHT:?}\n",
        gains.choice()
    );
    let ((A, B), link) = (mass(), from_neighbour());
    for i in 0..length {
        let _ = write!(
            text,
            "\n[subsystem.mass_{}]\nstates = [\"q [m]\", \"v [m/s]\"]\ninputs = [\"force [N]\"]\noutputs = [\"q [m]\"]\n\
             A = {:?}\nB = {:?}\nC = [[1.0, 0.0]]\nx = {{ min = [-{ROOM:?}, -{ROOM:?}], max = [{ROOM:?}, {ROOM:?}] }}\n\
             u = {{ min = [-{FORCE:?}], max = [{FORCE:?}] }}\n{}",
            i + 1,
            A.rows,
            B.rows,
            gains.weights()
        );
        for j in neighbours(i, length) {
            let _ = write!(text, "\n[subsystem.mass_{}.from.mass_{}]\nA = {:?}\n", i + 1, j + 1, link.rows);
        }
    }
    text
}

/// x+ of every mass: the plant.
pub fn advance(x: &[[f64; 2]], u: &[f64]) -> Vec<[f64; 2]> {
    let ((A, B), link) = (mass(), from_neighbour());
    let next = |i: usize| {
        std::array::from_fn(|k| {
            let dot = |row: &[f64], x: &[f64; 2]| row[0] * x[0] + row[1] * x[1];
            let pulled: f64 = neighbours(i, x.len()).map(|j| dot(&link.rows[k], &x[j])).sum();
            dot(&A.rows[k], &x[i]) + B.rows[k][0] * u[i] + pulled
        })
    };
    (0..x.len()).map(next).collect()
}
