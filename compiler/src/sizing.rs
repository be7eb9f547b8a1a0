//! Steps 3 and 4 of the off-line design: one convex program chooses the size of every set.
//!
//! With the invariance multipliers fixed, (18), (21), (22), (24), (25a), (25b) and (26) are linear in the half-widths
//! of Z_i and Delta_i^z, the offsets of E_i and Sigma_i, the ends of Y_i and epsilon. The program maximises a
//! weighted sum of logarithms over them, new multipliers are taken at its solution, and so on: each round can only
//! improve. `settle` rounds the result to short decimals on the safe side, and `verify` checks every inclusion
//! once more with upper bounds that include rounding.
//!
//! # Changing constraints
//! The limit of a row that is drawn later is not known here, so nothing in the program would keep what (26) takes of it small.
//! (26') does, for every output a of a member, y_a = c z_k, with the support h_a of [C_i 0] Delta_i^chi per unit of epsilon:
//!
//! ```text
//! epsilon h_a + loads + |c| zeta_k <= margin                                          where the file states one,
//! Delta_k^z <= the reserve that is asked for, or else epsilon h_a / (10 |c|)          where it does not.
//! ```
//!
//! In the second case a tenth of what moving references take is the price of upsets that the plan absorbs by itself.
#![expect(non_snake_case, reason = "the paper's symbols")]

mod appraise;
mod diagnose;
mod program;
mod settle;
mod speed;
mod verify;

use lapack_symbols::singular_values;
use nalgebra::{DMatrix, DVector};

use crate::convex::{Box, Invariant, Multiplier, Polytope, Strips, Zonotope, multipliers, rpi_at_least};
use crate::diagnostic::{Diagnostics, code};
use crate::gains::{Gains, Proof};
use crate::network::{Network, Scalar};
use crate::optim::conic::Answer;
use crate::rounding::SignalRow;
use crate::sets::{Sets, closed_loop_z, floor_support, import_gain, least_offsets, noise_through_gain};
use crate::sharing::spread;
use program::{Asks, Goal, Program};

pub use appraise::{Aim, Merit, Stage};
pub use speed::{Sizes, SpeedPoint};

/// After this point: (21), (22), (25a), (25b), (26), (26') where margins are stated, and (35a') where measurements err, hold
/// with the recorded slack, which is never negative, and in single precision with what [`crate::rounding`] keeps back besides; no set is empty; and what changing constraints are charged is
/// what (26) takes of any row, or more.
#[derive(Debug)]
pub struct Sizing {
    /// Radius of the ball in (6).
    pub epsilon: f64,
    pub subsystems: Vec<SubsystemSizing>,
    /// The tightened limits of (26), per coupling constraint.
    pub l_tilde: Vec<f64>,
    /// What the program maximised, at its solution: the weighted sum of logarithms of [`crate::network::Wishes`].
    pub objective: f64,
    /// In single precision, the volume of the product of the Y_i relative to that in double precision; `None` in a large network.
    pub share_of_double: Option<f64>,
    /// Every inclusion that Theorem 1 leans on, with what is left of it.
    pub slacks: Vec<Slack>,
    /// What another reserve would mean, for the summary; the chosen point has `reserve` 1. Empty for large networks.
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
    /// What the references take of each row of X_i and of U_i: H xref <= x_ref, H uref <= u_ref at all times.
    pub x_ref: DVector<f64>,
    pub u_ref: DVector<f64>,
    /// Largest |x+ - x| of a state that references may start from: what the margins left over absorb.
    pub drift: DVector<f64>,
    /// What (26) takes of any row over the outputs, by tubes and moving references: half-lengths of segments whose sum holds it.
    /// None where the subsystem is in no changing constraint.
    pub exposed: Zonotope,
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
#[derive(Debug, Clone, PartialEq)]
pub struct Proofs {
    /// Normals of E_i and of Sigma_i: those of the stage before, or fewer.
    tube_normals: DMatrix<f64>,
    terminal_normals: DMatrix<f64>,
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

/// Why the program has no optimum.
enum Failure {
    NoProof(Diagnostics),
    /// With the best multipliers known.
    NoPoint(Vec<Proofs>, Answer),
}

impl Failure {
    fn explained(self, context: &Context) -> Diagnostics {
        match self {
            Self::NoProof(mistakes) => mistakes,
            Self::NoPoint(proofs, answer) => diagnose::no_point(context, proofs, answer),
        }
    }
}

impl Sizing {
    /// Of the product of the Y_i.
    fn y_volume(&self) -> f64 {
        self.subsystems.iter().map(|s| s.Y.volume()).product()
    }

    /// # Errors
    /// E0406 disturbances and measurement errors, E0401 epsilon leave no room for any set-point, E0407 a wanted margin, E0402 the wanted reserve,
    /// E0403 the set-points to cover are out of reach (each with the largest value that is not), E0404 the program could not be solved, E0405 an
    /// inclusion does not survive rounding.
    pub fn new(network: &Network, gains: &Gains, sets: &Sets) -> Result<Self, Diagnostics> {
        let context = Context { network, gains, sets };
        let rounds = if context.is_large() { FEW_ROUNDS } else { ROUNDS };
        // Better multipliers can be too close to the edge to survive rounding; the nominal ones keep away from it.
        let (program, mut sizing) = match context.sized(rounds) {
            Err(mistakes) if mistakes.0.iter().any(|mistake| mistake.code == code::LOST_SLACK) => {
                context.sized(0).map_err(|_| mistakes)
            }
            sized => sized,
        }?;
        settle::admit_drift(&context, &program, &mut sizing);
        if !context.is_large() {
            sizing.trade = trade(&context, &program, &sizing);
            sizing.share_of_double = share_of_double(&context, &sizing);
        }
        Ok(sizing)
    }
}

/// What the rows of Z_i, X_i and U_i lose to measurement errors, D_zi K_i V and K_i V: (21'), (22') of [`crate::sets::exogenous`],
/// and to rounding: [`crate::rounding`].
struct Noise {
    z: DVector<f64>,
    x: DVector<f64>,
    u: DVector<f64>,
}

const ROUNDS: usize = 6;
/// Of a large network, whose programs take long; there is no trade of its reserve for the same reason.
const FEW_ROUNDS: usize = 2;

impl Context<'_> {
    fn is_large(&self) -> bool {
        matches!(self.gains.proof, Proof::Responses(_))
    }

    /// Sizes that are verified, with as many rounds of better multipliers.
    fn sized(&self, rounds: usize) -> Result<(Program, Sizing), Diagnostics> {
        let (program, point) = self.optimise(&Asks::default(), rounds).map_err(|failure| failure.explained(self))?;
        let (program, point) = self.without_idle_strips(&program).unwrap_or((program, point));
        let mut sizing = settle::settle(self, &program, &point)?;
        sizing.slacks = verify::verify(self, &program.proofs, &sizing)?;
        Ok((program, sizing))
    }

    /// Alternates between the program and its multipliers until a round gains less than 1e-4 of the objective.
    fn optimise(&self, asks: &Asks, rounds: usize) -> Result<(Program, Vec<f64>), Failure> {
        let (program, point) = self.first_point(asks, rounds)?;
        Ok(self.improved(program, point, asks, rounds))
    }

    /// The alternation from a point of the program on.
    fn improved(&self, mut program: Program, mut point: Vec<f64>, asks: &Asks, rounds: usize) -> (Program, Vec<f64>) {
        for _ in 0..rounds {
            let better = self.better_proofs(&program, &point).filter(|proofs| *proofs != program.proofs);
            let Some(proofs) = better else { break };
            let next = Program::new(self, proofs, asks);
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
        (program, point)
    }

    /// Any point that grants what is asked. Where the nominal multipliers give none, better ones are looked for on the
    /// way to the largest share of it.
    fn first_point(&self, asks: &Asks, rounds: usize) -> Result<(Program, Vec<f64>), Failure> {
        let mut proofs = self.nominal_proofs().map_err(Failure::NoProof)?;
        for _ in 0..rounds.max(1) {
            let program = Program::new(self, proofs.clone(), asks);
            match program.solve() {
                Answer::Point(point) => return Ok((program, point)),
                answer => {
                    let all = Asks { goal: Goal::All, ..asks.clone() };
                    match self.towards(&all, &proofs).or_else(|| self.less_disturbed(asks, &proofs)) {
                        Some(better) => proofs = better,
                        None => return Err(Failure::NoPoint(proofs, answer)),
                    }
                }
            }
        }
        Err(Failure::NoPoint(proofs, Answer::Infeasible))
    }

    /// Multipliers at the largest share of the disturbances that leaves any set-point.
    fn less_disturbed(&self, asks: &Asks, proofs: &[Proofs]) -> Option<Vec<Proofs>> {
        let asks = Asks { goal: Goal::Disturbance, ..asks.clone() };
        self.network.is_disturbed().then(|| self.towards(&asks, proofs)).flatten()
    }

    /// Multipliers at the optimum of what is asked; `None` where there is none.
    fn towards(&self, asks: &Asks, proofs: &[Proofs]) -> Option<Vec<Proofs>> {
        let program = Program::new(self, proofs.to_vec(), asks);
        match program.solve() {
            Answer::Point(point) => self.better_proofs(&program, &point),
            _ => None,
        }
    }

    /// The same program without the strips of Sigma_i that no proof rests on.
    fn without_idle_strips(&self, program: &Program) -> Option<(Program, Vec<f64>)> {
        let proofs: Vec<Proofs> = program.proofs.iter().map(Proofs::without_idle_strips).collect();
        if proofs == program.proofs {
            return None;
        }
        let program = Program::new(self, proofs, &Asks::default());
        match program.solve() {
            Answer::Point(point) => Some((program, point)),
            _ => None,
        }
    }

    fn nominal_proofs(&self) -> Result<Vec<Proofs>, Diagnostics> {
        let of = |i: usize| {
            let sets = &self.sets.subsystems[i];
            self.proofs(i, &sets.tube.set, &sets.terminal.set).ok_or_else(|| diagnose::no_proof(self, i).into())
        };
        spread(self.network.subsystems.len(), of).into_iter().collect()
    }

    /// The best multipliers at a point of the program; `None` where rounding stands in the way.
    fn better_proofs(&self, program: &Program, point: &[f64]) -> Option<Vec<Proofs>> {
        let better = spread(self.network.subsystems.len(), |i| {
            let (sets, F) = (&self.sets.subsystems[i], &self.gains.subsystems[i].F);
            let least = least_offsets(&sets.tube.normals, &self.network.subsystems[i]);
            let tube = rpi_at_least(&sets.tube.normals, F, &self.W(program, point, i), &least)?;
            let sigma = program.sigma(point, i);
            let P = &sets.terminal.normals;
            let Lambda = multipliers(P, &sigma, &(P * F))?;
            self.proofs(i, &tube, &Invariant { q: sigma, Lambda })
        });
        better.into_iter().collect()
    }

    /// Support of W_i in the normals of E_i at a point of the program.
    fn W(&self, program: &Program, point: &[f64], i: usize) -> DVector<f64> {
        let (s, sets) = (&self.network.subsystems[i], &self.sets.subsystems[i]);
        let mut support = floor_support(&sets.tube.normals, &sets.floor) + sets.exogenous.support(&sets.tube.normals);
        for &j in s.L.keys() {
            support += import_gain(&sets.tube.normals, s, j) * program.zeta(point, j);
        }
        support
    }

    /// What the measurement error adds to the coupling outputs and to the rows of U_i, besides its part in W_i.
    fn noise(&self, i: usize) -> Noise {
        let (s, g) = (&self.network.subsystems[i], &self.gains.subsystems[i]);
        let rounding = &self.sets.subsystems[i].rounding;
        let of_x = |r: usize| rounding.charge(&SignalRow::of_states(s, s.X.H.row(r).transpose()), s.X.h[r]);
        let of_u = |r: usize| rounding.charge(&SignalRow::of_inputs(s, s.U.H.row(r).transpose()), s.U.h[r]);
        Noise {
            z: noise_through_gain(&s.Dz, s, g) + s.Dz.abs() * &rounding.u + &rounding.z,
            x: DVector::from_fn(s.X.h.len(), |r, _| of_x(r)),
            u: noise_through_gain(&s.U.H, s, g)
                + s.U.H.abs() * &rounding.u
                + DVector::from_fn(s.U.h.len(), |r, _| of_u(r)),
        }
    }

    /// What (24) loses to rounding in the rows P.
    fn rounded(&self, i: usize, P: &DMatrix<f64>) -> DVector<f64> {
        let (s, rounding) = (&self.network.subsystems[i], &self.sets.subsystems[i].rounding);
        DVector::from_fn(P.nrows(), |r, _| rounding.step(&SignalRow::of_states(s, P.row(r).transpose())))
    }

    /// What Delta_i^z of this half-width keeps back in coupling output k.
    fn kept_back(&self, i: usize, k: usize, dz: f64) -> f64 {
        let (s, rounding) = (&self.network.subsystems[i], &self.sets.subsystems[i].rounding);
        rounding.charge(&SignalRow::of_output(s, k), dz)
    }

    fn proofs(&self, i: usize, tube: &Invariant, terminal: &Invariant) -> Option<Proofs> {
        let (s, g, sets) = (&self.network.subsystems[i], &self.gains.subsystems[i], &self.sets.subsystems[i]);
        let (u_rows, z_rows) = (&s.U.H * &g.K, closed_loop_z(s, g));
        let on_tube = |rows: &DMatrix<f64>| multipliers(&sets.tube.normals, &tube.q, rows);
        let on_terminal = |rows: &DMatrix<f64>| multipliers(&sets.terminal.normals, &terminal.q, rows);
        Some(Proofs {
            tube_normals: sets.tube.normals.clone(),
            terminal_normals: sets.terminal.normals.clone(),
            tube: tube.Lambda.clone(),
            tube_x: on_tube(&s.X.H)?,
            tube_u: on_tube(&u_rows)?,
            tube_z: on_tube(&z_rows)?,
            terminal: terminal.Lambda.clone(),
            terminal_x: on_terminal(&s.X.H)?,
            terminal_u: on_terminal(&u_rows)?,
            terminal_z: on_terminal(&z_rows)?,
        })
    }
}

impl Proofs {
    /// Whether the strips `kept` of Sigma_i but for `r` still bound it.
    fn bounded_without(&self, kept: &[usize], r: usize) -> bool {
        let others: Vec<usize> = kept.iter().copied().filter(|other| *other != r).collect();
        if others.len() < self.terminal_normals.ncols() {
            return false;
        }
        let values = singular_values(&self.terminal_normals.select_rows(&others));
        values.is_some_and(|values| values.min() > 1e-6 * values.max())
    }

    /// Without the strips of Sigma_i that only their own invariance uses.
    fn without_idle_strips(&self) -> Self {
        let needed = [&self.terminal_x, &self.terminal_u, &self.terminal_z];
        let mut kept: Vec<usize> = (0..self.terminal.len()).collect();
        while let Some(idle) = kept.iter().position(|&r| {
            let invariance = kept.iter().filter(|&&other| other != r).map(|&other| &self.terminal[other]);
            self.bounded_without(&kept, r)
                && invariance.chain(needed.into_iter().flatten()).all(|proof| proof.mu[r] == 0.0)
        }) {
            kept.remove(idle);
        }
        let select = |proofs: &[Multiplier]| proofs.iter().map(|proof| proof.select(&kept)).collect::<Vec<_>>();
        Self {
            terminal_normals: self.terminal_normals.select_rows(&kept),
            terminal: kept.iter().map(|&r| self.terminal[r].select(&kept)).collect(),
            terminal_x: select(&self.terminal_x),
            terminal_u: select(&self.terminal_u),
            terminal_z: select(&self.terminal_z),
            ..self.clone()
        }
    }
}

/// Factors on the chosen reserve that the summary shows.
const TRADE: [f64; 7] = [0.1, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0];

/// What is left of the set-points that double precision would have.
fn share_of_double(context: &Context, sizing: &Sizing) -> Option<f64> {
    if context.network.scalar == Scalar::Double {
        return None;
    }
    let network = Network { scalar: Scalar::Double, ..context.network.clone() };
    let sets = Sets::new(&network, context.gains).ok()?;
    let double = Sizing::new(&network, context.gains, &sets).ok()?;
    Some(sizing.y_volume() / double.y_volume())
}

fn trade(context: &Context, program: &Program, sizing: &Sizing) -> Vec<TradePoint> {
    let chosen = sizing.y_volume();
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
