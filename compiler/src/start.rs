//! Starting anywhere: a start-up plan from any state of the network for which one exists.
//!
//! Theorem 1 starts "if at t = 0 a feasible solution exists". This is what that asks, of a state x_0 of the whole network, and
//! what [`StartPlan`] gives.
//!
//! # What must hold
//! A plan over T >= N steps is a reference trajectory xref_0, ..., xref_T, uref_0, ..., uref_{T-1}, eref_T of every subsystem, and
//! deviations dx_0, du_0, ..., du_{N-1} of the first nominal trajectory, dx_{k+1} = A_ii dx_k + B_ii du_k, such that
//!
//! 1. (7a) holds at every step with the sref that all planned zref amount to;
//! 2. the first i-DPC problem is feasible: x_0 - xref_0 - dx_0 in E_i (35a); for k < N, xref_k + dx_k in Xhat_i and uref_k + du_k in
//!    Uhat_i (35c), (35d), C_zi dx_k + D_zi du_k in Delta_i^z (35b); dx_N in Sigma_i (36);
//! 3. for N <= k < T the references keep the margin of (25b): xref_k in Xhat_i - Sigma_i, uref_k in Uhat_i - K_i Sigma_i ("-":
//!    Pontryagin difference). Before N nobody leans on it: it is what makes the candidate (47) of step t feasible at t + N;
//! 4. for k < T, the coupling constraints: sum of `H_h^[j]` C_j xref_j <= l_h - sum of h_Z_j(`H_h^[j]z`), which is (26) without what
//!    yref may do next;
//! 5. at T the network rests: (xref_T, eref_T) is the chi_ss of yref_T = C xref_T, which lies in every Y_i and keeps k_h <= l~_h (27).
//!
//! Then the scheme is feasible for ever. The problem of step 0 is by 2. If that of step t is, the candidate (47) is a solution at
//! t + 1: its last stage needs the margins at t + N, which hold by 3 before T and by (25b) from T on, since chi_T - chi_ss = 0 lies in
//! Delta^chi, which is invariant under (30). Coupling constraints hold at k < T by 4 and |z - zref| in Z, and from T on by
//! (26)-(28). In the other direction, 1 to 4 are necessary for a start whose references keep these margins; 5 asks for rest where
//! Theorem 1 would do with Delta^chi. That costs steps but no starts: from chi_ss + Delta^chi, with yref kept, the references come as
//! close to rest as one likes, where the room that (25b) leaves for Delta^chi lets them be steered to it. (The exception are modes
//! that no input reaches: these must have decayed to [`drift`](crate::sizing::SubsystemSizing::drift) at T.)
//!
//! The set of starts with a plan is convex, holds all steady states of Y, and grows with T: windows of N, 2 N, 4 N, ... steps are
//! tried, up to [`LONGEST`], and those between the last two bisected.
//!
//! # Who knows what, and when
//! At step t a node stores its references up to t + N - 1, and forms those of t + N from what its neighbours sent at t - 1. With a
//! plan the first N points are there at once; the point t + N <= T is the plan's, and the messages carry it as they carry any
//! other: zref at t + N. At t + N = T + 1 the normal layer takes over, with yref_T, eref_T and xref_T from the plan: it needs the
//! neighbours' zref_T, which they sent at T - N. There is no gap, and no step at which a node must know that others still
//! follow their plan.
//!
//! # Loads
//! A plan is made for loads that stay at `d0`. The references during the window are the plan and calK's feedback around it (see
//! `dpc_runtime::StartPlan`), so a load that changes adds the response (8) that it adds to any other reference. In coordinates
//! around the rest under d0, rows are charged H chi_ss(d0) before N, when references cannot have felt a change, and from
//! N on the share of (25b) that covers every sequence of loads.
//!
//! # Measurement errors
//! `x0` is the true state; (35a') at the first step rests on the measurement alone, so that x_0 - xref_0 - dx_0 must lie 2 h_V inside
//! E_i for every measurement to be accepted.
//!
//! # Pruned rows
//! The on-line problem leaves out rows that references inside (25b) never make active. A start-up plan goes beyond these: with
//! `start-anywhere` (which an `x0` implies) no row is left out on the strength of the references; without it, plans are kept
//! to the references that the rows were left out for.
//!
//! # What is verified
//! The solver's answer is a suggestion. (7a) is run forward from inputs of 12 digits, what is left of 5 is removed by a second
//! program for its remainder, and then every row is checked to keep a margin, for the numbers as they are emitted.
#![expect(non_snake_case, reason = "the paper's symbols")]

mod correction;
mod limits;
mod program;
mod realise;
mod refusal;
mod verify;

use nalgebra::DVector;

use crate::design::Design;
use crate::network::{Network, Start};
use limits::Limits;
use program::{Found, Goal, Latitude, Program};
pub use refusal::{Nearest, NoPlan};

/// Windows have at most this many steps, and fewer where the network is so large that a program would have more than
/// a million unknowns.
pub const LONGEST: usize = 512;

/// After so many windows in vain the longest is looked at.
const DOUBTFUL: usize = 3;

/// Bisections of a window: a plan is at most a sixteenth longer than the shortest.
const BISECTIONS: usize = 4;

/// What every row keeps back, relative to the bound it comes from.
const MARGIN: f64 = 1e-7;

/// A start-up plan of the whole network.
///
/// After this point: the conditions of this module hold for these numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct StartPlan {
    /// The start it was made for.
    pub start: Start,
    /// T.
    pub steps: usize,
    /// One per subsystem; every node starts with its own.
    pub subsystems: Vec<SubsystemPlan>,
    /// The smallest margin of any row, relative to the bound it comes from.
    pub margin: f64,
}

/// One subsystem's part of a plan: what `dpc_runtime::StartPlan` is filled with.
#[derive(Debug, Clone, PartialEq)]
pub struct SubsystemPlan {
    /// `dpc_runtime::Tables::fingerprint` of the tables it belongs to.
    pub design: u64,
    /// What all parts of this plan share: [`crate::emit::plan_number`].
    pub plan: u32,
    /// xref_0, ..., xref_T.
    pub x: Vec<DVector<f64>>,
    /// uref_0, ..., uref_T; the last is that of (7f).
    pub u: Vec<DVector<f64>>,
    /// eref_T.
    pub e: DVector<f64>,
    /// xhat_0 - xref_0, and uhat_k - uref_k for k < N.
    pub dx: DVector<f64>,
    pub du: Vec<DVector<f64>>,
}

impl Design {
    /// A start-up plan from the state `x0` of every subsystem, without loads.
    ///
    /// # Errors
    /// `x0` is no state of this network, lies outside of X, or no plan was found: then with the nearest start that has one.
    pub fn plan(&self, x0: &[DVector<f64>]) -> Result<StartPlan, NoPlan> {
        self.plan_from(&Start::at(x0.to_vec(), &self.network))
    }

    /// A start-up plan from a state of every subsystem, under loads.
    ///
    /// # Errors
    /// As [`Design::plan`].
    pub fn plan_from(&self, start: &Start) -> Result<StartPlan, NoPlan> {
        refusal::check(&self.network, start)?;
        let limits = Limits::new(self, start);
        self.best_plan(&limits, start)
            .map_err(|failed| NoPlan::NoneFound { nearest: self.nearest(&limits, start).map(Box::new), failed })
    }

    /// The shortest plan that leaves half of E_i at the start; where there is none, the shortest with xhat on the reference; else the
    /// shortest. Why
    /// nothing was found where the solver could not tell.
    fn best_plan(&self, limits: &Limits, start: &Start) -> Result<StartPlan, Option<String>> {
        let mut failed = None;
        for latitude in [Latitude::HalfTube, Latitude::InTube, Latitude::Free] {
            let mut too_short = 0;
            for (tried, steps) in windows(&self.network).enumerate() {
                if tried == DOUBTFUL && self.is_hopeless(limits, start, latitude) {
                    break;
                }
                match self.plan_over(limits, start, steps, latitude) {
                    Attempt::Plan(plan) => return Ok(self.shorter(limits, start, latitude, too_short, plan)),
                    Attempt::Failed(why) if latitude == Latitude::Free => failed = Some(why),
                    Attempt::None | Attempt::Failed(_) => {}
                }
                too_short = steps;
            }
        }
        Err(failed)
    }

    /// Whether the longest window, and with it every other, holds no plan.
    fn is_hopeless(&self, limits: &Limits, start: &Start, latitude: Latitude) -> bool {
        let solved = |steps| Program::new(self, limits, start, steps, Goal::Margin(latitude)).solve();
        windows(&self.network).last().is_some_and(|steps| matches!(solved(steps), Found::Nothing))
    }

    /// Plans over windows between one that is too short and that of `plan`, as short as a few bisections find.
    fn shorter(
        &self,
        limits: &Limits,
        start: &Start,
        latitude: Latitude,
        too_short: usize,
        plan: StartPlan,
    ) -> StartPlan {
        let (mut low, mut shortest) = (too_short.max(self.network.horizon), plan);
        for _ in 0..BISECTIONS {
            let middle = low.midpoint(shortest.steps);
            match self.plan_over(limits, start, middle, latitude) {
                Attempt::Plan(plan) => shortest = plan,
                Attempt::None | Attempt::Failed(_) => low = middle,
            }
        }
        shortest
    }

    fn plan_over(&self, limits: &Limits, start: &Start, steps: usize, latitude: Latitude) -> Attempt {
        let solved = |goal: Goal| Program::new(self, limits, start, steps, goal).solve();
        let realised = |draft| realise::realise(self, limits, start, draft);
        let safest = match solved(Goal::Margin(latitude)) {
            Found::Draft(draft) => draft,
            Found::Nothing => return Attempt::None,
            Found::Failed(why) => return Attempt::Failed(why),
        };
        let quietest = match solved(Goal::Plan(latitude)) {
            Found::Draft(draft) => realised(draft),
            Found::Nothing | Found::Failed(_) => None,
        };
        let plan = quietest.or_else(|| realised(safest));
        plan.map_or_else(|| Attempt::Failed(format!("a plan of {steps} steps did not survive rounding")), Attempt::Plan)
    }

    /// The start nearest to `start` that has a plan, over the longest window.
    fn nearest(&self, limits: &Limits, start: &Start) -> Option<Nearest> {
        let steps = windows(&self.network).last()?;
        let program = Program::new(self, limits, start, steps, Goal::Nearest);
        let found = program.nearest()?;
        // Starts with a plan are convex around 0: a step inwards makes good what the solver's tolerance lacks.
        let inwards = [0.0, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3].into_iter();
        let x0 = inwards.map(|share| found.x0.iter().map(|x| x * (1.0 - share)).collect::<Vec<_>>()).find(|x0| {
            let start = Start { x0: x0.clone(), ..start.clone() };
            matches!(self.plan_over(limits, &start, steps, Latitude::Free), Attempt::Plan(_))
        })?;
        let ranges = limits.subsystems.iter().map(|own| own.range.clone()).collect();
        Some(Nearest { x0, ranges, bound: found.bound, rows: found.rows })
    }
}

enum Attempt {
    Plan(StartPlan),
    None,
    Failed(String),
}

/// The windows that are tried, in this order.
fn windows(network: &Network) -> impl Iterator<Item = usize> + use<> {
    let signals: usize = network.subsystems.iter().map(|s| s.n() + s.m()).sum();
    let (N, longest) = (network.horizon, (1_000_000 / signals).min(LONGEST).max(network.horizon));
    let doubled = std::iter::successors(Some(N), |steps| Some(2 * steps)).take_while(move |steps| *steps < longest);
    doubled.chain([longest])
}
