//! Steps 3 and 4 of the off-line design: one convex program chooses the size of every set.
//!
//! With the invariance multipliers fixed, (18), (21), (22), (24), (25a), (25b) and (26) are linear in the half-widths
//! of Z_i and Delta_i^z, the offsets of E_i and Sigma_i, the ends of Y_i and epsilon. [`program`] maximises a
//! weighted sum of logarithms over them, new multipliers are taken at its solution, and so on: each round can only
//! improve. [`settle`] rounds the result to short decimals on the safe side, and [`verify`] checks every inclusion
//! once more with upper bounds that include rounding.
#![expect(non_snake_case, reason = "the paper's symbols")]

mod diagnose;
mod program;
mod settle;
mod verify;

use nalgebra::DVector;

use crate::convex::{Box, Multiplier, Polytope, Strips, multipliers, rpi_on_normals};
use crate::diagnostic::Diagnostics;
use crate::gains::Gains;
use crate::network::Network;
use crate::optim::conic::Answer;
use crate::sets::{Sets, closed_loop_z, floor_support, import_gain};
use program::{Asks, Program};

/// After this point: (21), (22), (25a), (25b), (26) hold with the recorded slack, which is never negative, and no
/// set is empty.
#[derive(Debug)]
pub struct Sizing {
    /// Radius of the ball in (6).
    pub epsilon: f64,
    pub subsystems: Vec<SubsystemSizing>,
    /// The tightened limits of (26), per coupling constraint.
    pub l_tilde: Vec<f64>,
    /// Every inclusion that Theorem 1 leans on, with what is left of it.
    pub slacks: Vec<Slack>,
    /// What another reserve would mean, for the summary; the chosen point has `reserve` 1.
    pub trade: Vec<TradePoint>,
}

#[derive(Debug)]
pub struct SubsystemSizing {
    /// Half-widths of the box Z_i.
    pub zeta: DVector<f64>,
    /// Half-widths of the box Delta_i^z.
    pub dz: DVector<f64>,
    /// The RPI set calE_i of (18).
    pub E: Strips,
    /// Sigma_i, positively invariant for (24).
    pub Sigma: Strips,
    /// Xhat_i: the rows of X_i, tightened.
    pub X_nom: Polytope,
    /// Uhat_i: the rows of U_i, tightened.
    pub U_nom: Polytope,
    /// Y_i.
    pub Y: Box,
    /// How far each state may be off its reference at the terminal step, alone: the half-axes of Sigma_i.
    pub upset: DVector<f64>,
}

/// What is left of one inequality after rounding.
#[derive(Debug, Clone)]
pub struct Slack {
    /// Equation number in the paper: `(21)`.
    pub equation: &'static str,
    /// In the user's names: `left: h1 <= 27.6 cm`.
    pub what: String,
    /// Right side minus an upper bound of the left side, in the row's own unit; never negative.
    pub value: f64,
}

/// One point of the trade of reserve against set-points.
#[derive(Debug, Clone)]
pub struct TradePoint {
    /// Factor on the chosen Delta_i^z.
    pub reserve: f64,
    /// Volume of the product of the Y_i, relative to the chosen one; `None` where no design exists.
    pub y_volume: Option<f64>,
    /// Epsilon at that point.
    pub epsilon: f64,
}

/// The multipliers of one subsystem: what makes the program linear.
#[derive(Debug, Clone)]
struct Proofs {
    /// Rows of P F_ii on E_i, and the needed directions on E_i.
    tube: Vec<Multiplier>,
    tube_x: Vec<Multiplier>,
    tube_u: Vec<Multiplier>,
    tube_z: Vec<Multiplier>,
    /// Likewise on Sigma_i.
    terminal: Vec<Multiplier>,
    terminal_x: Vec<Multiplier>,
    terminal_u: Vec<Multiplier>,
    terminal_z: Vec<Multiplier>,
}

/// Everything the parts of this stage look at.
struct Context<'a> {
    network: &'a Network,
    gains: &'a Gains,
    sets: &'a Sets,
}

impl Sizing {
    /// # Errors
    /// E0401 epsilon leaves no room for any set-point, E0402 the wanted reserve, E0403 the set-points to cover are
    /// out of reach (each with the largest value that is not), E0404 the program could not be solved, E0405 an
    /// inclusion does not survive rounding.
    pub fn new(network: &Network, gains: &Gains, sets: &Sets) -> Result<Self, Diagnostics> {
        let context = Context { network, gains, sets };
        let (program, point) = context.optimise()?;
        let mut sizing = settle::settle(&context, &program, &point)?;
        sizing.slacks = verify::verify(&context, &program.proofs, &sizing)?;
        sizing.trade = trade(&context, &program, &sizing);
        Ok(sizing)
    }
}

const ROUNDS: usize = 6;

impl Context<'_> {
    /// Alternates between the program and its multipliers until a round gains less than 1e-4 of the objective.
    fn optimise(&self) -> Result<(Program, Vec<f64>), Diagnostics> {
        let mut program = Program::new(self, self.nominal_proofs()?, &Asks::default());
        let mut point = match program.solve() {
            Answer::Point(point) => point,
            other => return Err(diagnose::no_point(self, &program, other)),
        };
        for _ in 0..ROUNDS {
            let Some(proofs) = self.better_proofs(&program, &point) else { break };
            let next = Program::new(self, proofs, &Asks::default());
            let Answer::Point(better) = next.solve() else { break };
            let gain = next.objective(&better) - program.objective(&point);
            if gain <= 0.0 {
                break;
            }
            (program, point) = (next, better);
            if gain < 1e-4 {
                break;
            }
        }
        Ok((program, point))
    }

    fn nominal_proofs(&self) -> Result<Vec<Proofs>, Diagnostics> {
        let of = |i: usize| {
            let sets = &self.sets.subsystems[i];
            self.proofs(i, sets.tube.Lambda.clone(), &sets.tube.q, sets.terminal.Lambda.clone(), &sets.terminal.q)
                .ok_or_else(|| diagnose::no_proof(self, i).into())
        };
        (0..self.network.subsystems.len()).map(of).collect()
    }

    /// The best multipliers at a point of the program; `None` where rounding stands in the way.
    fn better_proofs(&self, program: &Program, point: &[f64]) -> Option<Vec<Proofs>> {
        (0..self.network.subsystems.len())
            .map(|i| {
                let sets = &self.sets.subsystems[i];
                let tube = rpi_on_normals(&sets.tube_normals, &self.gains.subsystems[i].F, &self.W(program, point, i))?;
                let sigma = program.sigma(point, i);
                let PF = &sets.terminal_normals * &self.gains.subsystems[i].F;
                let terminal = multipliers(&sets.terminal_normals, &sigma, &PF)?;
                self.proofs(i, tube.Lambda, &tube.q, terminal, &sigma)
            })
            .collect()
    }

    /// Support of W_i in the normals of E_i at a point of the program.
    fn W(&self, program: &Program, point: &[f64], i: usize) -> DVector<f64> {
        let (s, sets) = (&self.network.subsystems[i], &self.sets.subsystems[i]);
        let mut support = floor_support(&sets.tube_normals, &sets.floor);
        for &j in s.L.keys() {
            support += import_gain(&sets.tube_normals, s, j) * program.zeta(point, j);
        }
        support
    }

    fn proofs(
        &self,
        i: usize,
        tube: Vec<Multiplier>,
        q: &DVector<f64>,
        terminal: Vec<Multiplier>,
        sigma: &DVector<f64>,
    ) -> Option<Proofs> {
        let (s, g, sets) = (&self.network.subsystems[i], &self.gains.subsystems[i], &self.sets.subsystems[i]);
        let (u_rows, z_rows) = (&s.U.H * &g.K, closed_loop_z(s, g));
        let (P, P_T) = (&sets.tube_normals, &sets.terminal_normals);
        Some(Proofs {
            tube,
            tube_x: multipliers(P, q, &s.X.H)?,
            tube_u: multipliers(P, q, &u_rows)?,
            tube_z: multipliers(P, q, &z_rows)?,
            terminal,
            terminal_x: multipliers(P_T, sigma, &s.X.H)?,
            terminal_u: multipliers(P_T, sigma, &u_rows)?,
            terminal_z: multipliers(P_T, sigma, &z_rows)?,
        })
    }
}

/// Factors on the chosen reserve that the summary shows.
const TRADE: [f64; 7] = [0.1, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0];

fn trade(context: &Context, program: &Program, sizing: &Sizing) -> Vec<TradePoint> {
    let chosen: f64 = sizing.subsystems.iter().map(|s| s.Y.volume()).product();
    let point = |reserve: f64| {
        let dz = sizing.subsystems.iter().map(|s| &s.dz * reserve).collect();
        let asks = Asks { epsilon: Some(sizing.epsilon), dz: Some(dz), ..Asks::default() };
        let at = Program::new(context, program.proofs.clone(), &asks);
        let y_volume = match at.solve() {
            _ if reserve == 1.0 => Some(1.0),
            Answer::Point(point) => Some(at.y_volume(&point) / chosen),
            _ => None,
        };
        TradePoint { reserve, y_volume, epsilon: sizing.epsilon }
    };
    TRADE.into_iter().map(point).collect()
}
