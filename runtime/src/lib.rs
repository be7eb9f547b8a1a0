//! Runs what `dpc-codegen` emits: one controller per subsystem of a network, for distributed predictive control with
//! tracking. The method is that of M. Farina, G. Betti, L. Giulioni and R. Scattolini, "An Approach to Distributed
//! Predictive Control for Tracking: Theory and Applications", IEEE Transactions on Control Systems Technology 22(4),
//! 2014; equation numbers in this documentation are that paper's.
//!
//! An emitted file holds a [`Tables`] value, one [`Link`] per neighbour and the types of its messages. From there on:
//!
//! ```text
//! let (mut controller, message) = Controller::start(&TABLES, &SteadyState { x, u })?;
//! let mut inbox = Inbox::new();
//! send(message);                                          // to all neighbours
//! every period {
//!     inbox.accept(&FROM_RIGHT, &received)?;              // whatever has arrived
//!     let step = controller.step(&measured, &set_point, &mut inbox);
//!     apply(step.input);
//!     send(step.message);
//! }
//! ```
//!
//! The crate is `no_std`, has no dependency, does not allocate, contains no `unsafe` and no panic: a release build of a
//! controller calls nothing but `memcpy`, `memmove` and `memset` (a test looks at the object code). Nothing is global: all that
//! changes is in the [`Controller`] and the [`Inbox`], so any number of them live in one process. Working memory is on the
//! stack. The number of operations per step is bounded by the iteration budget in the tables.
//!
//! # The step
//! [`Controller::step`] does, at step t,
//! 1. the input ([`Controller::input`]): e = x_t - xref_t. If e lies in E_i and the references keep their margins,
//!    xhat = xref and uhat = uref solve (33)-(36), which is one test per row; otherwise a least-distance problem is
//!    solved by a dual active-set method ([`solver`]), started from the rows that were active at the step before, each at
//!    its place one stage earlier. Then u_t = uhat_t + K_i (x_t - xhat_t), (38).
//! 2. the references ([`Controller::references`]): yref_{t+N} by the reference-output layer ([`ReferenceLayer`]), (28)-(31), and
//!    from it eref, xref, uref and zref at t + N, (7).
//!
//! # Who needs what, and when
//! A controller stores xref, uref, yref from t to t + N - 1, and eref at t + N - 1.
//!
//! | at step t | needs | gives |
//! |---|---|---|
//! | input | x_t; what is stored | u_t |
//! | references | the set-point; the neighbours' messages of step t - 1: zref_j and yref_j at t + N - 1 | the message of step t: zref_i and yref_i at t + N |
//!
//! So there is one message per neighbour and period, it has a whole period to arrive, and u_t depends on nothing received in
//! period t. The start counts as step -1: its message is what the neighbours need at step 0. A neighbour may be ahead by
//! one step; the [`Inbox`] keeps its message until it is due.
//!
//! # Messages as bytes
//! Between two machines, or two languages, a [`Message`] goes as bytes: [`Message::to_bytes`], and [`Inbox::accept_bytes`] on the
//! other side; an emitted file has a function for either. All numbers are little-endian, nothing is padded, and the length depends
//! on the sender alone ([`Message::BYTES`]):
//!
//! | bytes | type | |
//! |---|---|---|
//! | 0 | u8 | version of this layout, [`LAYOUT`] |
//! | 1 | u8 | bytes per number of the sender's scalar type: 8 or 4 |
//! | 2, 3 | u16 | flags: bit 0 is [`Message::certified`]; the others are 0 |
//! | 4 to 7 | u32 | place of the sender in the network, [`Sender::place`] |
//! | 8 to 15 | u64 | fingerprint of the network's design, [`Sender::design`] |
//! | 16 to 23 | i64 | [`Message::step`] |
//! | 24 to 27 | u32 | [`Message::plan`] |
//! | 28, 29 | u16 | number of outputs, NY |
//! | 30, 31 | u16 | number of coupling outputs, NZ |
//! | from 32 | NY f64 or f32 | [`Message::y_ref`] |
//! | then | NZ f64 or f32 | [`Message::z_ref`] |
//!
//! A receiver takes nothing but what its neighbour in the same design says: whatever differs is refused with its own reason
//! ([`Refused`]), and the status of the step that went without says so too. There is no checksum: lines that may flip bits bring
//! their own, and a message that fails it is one that did not arrive.
//!
//! # What a status means
//! Theorem 1: if the design's assumptions hold, the start is feasible, every message arrives and the plant is the
//! model, then every problem is feasible and every constraint is kept, for ever. So each trouble says which of these broke.
//! There is an input at every step.
//!
//! | status | what broke | input | guarantee |
//! |---|---|---|---|
//! | [`Control::AtReference`] | nothing | (38) with xhat = xref, uhat = uref | holds |
//! | [`Control::Optimal`] | nothing | (38) | holds |
//! | [`Control::Candidate`] | nothing, but the iteration budget or the solver's precision ran out | (38) of the shifted candidate (47), which is feasible | holds |
//! | [`Control::Infeasible`] | the disturbance left W_i, or the start was not feasible; the candidate is not feasible either | as before, put into the box around U_i | not in this step |
//! | [`Control::IterationLimit`] | as before, and the budget ran out | as before | not in this step |
//! | [`Control::NotFinite`] | the measurement | uref + du_0 of the candidate, put into the box around U_i | not in this step |
//! | [`References::SetPointNotFinite`], [`References::Kept`] | nothing: yref stays | - | holds |
//! | [`Status::certified`] false | with measurement errors: a neighbour's last step was not certified | as above | not in this step |
//! | [`Status::load_within`] false | a load left its bounds or rates, or was not given | as above | not in this step |
//! | [`Delivery`] other than [`Delivery::InSequence`] | a message | - (the last values are held) | lost where coupling outputs are imported, else holds |
//! | [`References::Waiting`] | a message, with coupling constraints | - (yref stays) | as before |
//! | [`References::Blocked`], [`References::Deadlock`] | nothing: a coupling constraint holds yref up | - | holds |
//! | [`References::Undrawn`] | no row of a changing constraint was accepted yet: a message is missing, or the starts are too near | - (yref stays) | not until one is |
//! | [`References::NotSteady`] | the starts of the neighbours do not fit together: for N - 1 steps the references do not follow (7a) | - | lost |
//! | [`References::Planned`] | nothing: the start-up plan decides, and the set-point is not looked at yet | - | holds |
//! | [`References::OffPlan`] | a neighbour was not started with its part of the same plan, or the loads are not those the plan was made for | - | lost |
//! | [`References::CouplingExceeded`] | the starts exceed a coupling constraint (or messages were lost) | - | lost |
//!
//! The shifted candidate is the last solution, one step on: (dx_1, du_1, ..., du_{N-1}, K_i dx_N). It is kept in the controller
//! and shifted on for as long as no new solution is found; within a period it stays, however often the input is computed.
//! A guarantee that was lost with the references ([`Status::degraded`]) comes back with a new start only; one that was lost
//! with a step comes back when every subsystem is feasible again (with measurement errors: and certified, see below). Each status is what one subsystem can see; the guarantee
//! is the network's and holds where all of them say so ([`Status::is_guaranteed`]).
//!
//! # Starting anywhere
//! [`Controller::start`] begins at a steady state of the network; [`Controller::start_planned`] anywhere a [`StartPlan`] exists
//! for. A plan states the references of steps 0 to T >= N of every subsystem. It is accepted for a measured state with which the
//! first i-DPC problem has a solution, and refused for any other ([`StartError::StateDoesNotFit`]). While t + N <= T the
//! references at t + N are the plan's ([`References::Planned`]); everything else is as always: the same messages, due at the
//! same steps, with the same consequences where one is missing (xref follows what was heard last, then the feedback around
//! the plan brings it back, and the guarantee is lost). At t + N = T + 1 the reference-output layer takes over, from rest at
//! yref_T = C xref_T.
//!
//! # Coupling constraints that change
//! A coupling constraint (3) that the file declares as changing has no row of its own: its members redraw it at every step, for
//! instance the half-plane between two robots. It needs one call per constraint, between the messages and the step:
//!
//! ```text
//! for row in 0..CHANGING.len() {
//!     let redrawn = controller.redraw(row, &inbox, |meeting| {
//!         let pair = meeting.pair()?;                     // yref_{t+N-1} of both, in the order of the network
//!         let normal = rule(&pair.first, &pair.second)?;  // the same in both members
//!         Some(pair.apart(&normal, distance))             // normal . (y_first - y_second) >= distance
//!     });
//!     if let Err(why) = redrawn { report(why) }           // the row before stays in force
//! }
//! let step = controller.step(&measured, &set_point, &mut inbox);
//! ```
//!
//! The margins of (26) are evaluated for whatever direction the row has ([`Meeting::margin`]), and the row is accepted only if
//! k_{h,t+N-1} <= l~_h holds for it. So what Theorem 1 needs of k_h holds at every step, whichever row was in force before:
//! recursive feasibility is kept by construction. The true outputs satisfy the row that is accepted at step t at *both* times
//! t + N - 1 and t + N: by acceptance at the first, by (28) at the second. From 0 to N - 1 references rest, so the first row holds
//! there too. Messages must carry yref unrounded, and a rule must compute the same on every node.
//!
//! A member that misses a message keeps yref ([`References::Waiting`]), and goes on to do so until a row is accepted at a step at
//! which it has heard all members. Its row is then that of the others again: two members that move at the same step have both
//! heard everyone since they last accepted a row, so that was the same one. Who stays where it is violates no row, and who moves
//! has room for itself by (28): the references keep the row of those who move, whatever messages are missing. Where nothing but
//! coupling constraints joins the subsystems, the outputs then keep it too, and that costs no guarantee; a member that falls
//! silent for good makes the others in its constraints stay where they are. Where coupling outputs are imported, a missing
//! message loses the guarantee as ever.
//!
//! # What is measured with an error
//! Where the file states a measurement error, the emitted `start` calls [`Controller::with_measurement_error`], and x_t above is
//! the true state plus that error. The tube rows (35a) are then replaced by those of [`problem`]'s
//! [`doubt`](tables::DpcProblem::doubt), which keep the *true* deviation x - xhat in E_i; constraints, statuses and the guarantee
//! are about the true state. These rows may rest on the forecast of the step before, which assumes that the neighbours stayed
//! within their Z_j then. Their messages say whether they did ([`Message::certified`]), one period later; where one did not, the
//! step's own certificate is withdrawn ([`Status::certified`]) and the next step rests on the measurement alone, as the first
//! step does and the one after an infeasible one. So the guarantee comes back by itself: with the first step at which every
//! node is certified, most of them by their measurements.
//!
//! A disturbance outside W_i that nobody knows of (the plant is not the model) shows only as far as the measurement can tell it
//! from its own error: where it takes x_t out of E_i around the forecast by less than twice that error, the step may be feasible
//! all the same. Then x_t - xhat_t is outside E_i by no more than that, and by less at every further step, since E_i draws in
//! whatever is outside of it.
//!
//! # Measured disturbances
//! Where the file states loads, an emitted file has their names in `LOADS` and what they do in `LOAD_MODEL`
//! ([`tables::LoadModel`]). Its `start` and `start_planned` take the loads measured then and give a [`Loads`] beside the
//! controller and the message:
//!
//! ```text
//! let (mut controller, mut loads, message) = start(&steady, &measured_loads)?;
//! let load = loads.admit(&measured_loads);
//! let step = controller.step_under(&measured, &set_point, &load, &mut inbox);
//! if !step.status.is_guaranteed() { report() }
//! ```
//!
//! # Symbols
//! Tilde is `_ref` (reference), hat is `_nom` (nominal); indices i are dropped.
//!
//! | paper | meaning | Rust | equation |
//! |---|---|---|---|
//! | x, u, y | measured state, input, output | `x`, `input`, - | (1) |
//! | z | coupling output | `z_ref` in a [`Message`] | (1c) |
//! | x~, u~, y~, z~ | references | [`Telemetry::x_ref`], `u_ref`, `y_ref`; [`Message::z_ref`] | (7) |
//! | e~ | sum of reference errors | eref in this text | (7b) |
//! | x^, u^ | nominal state and input | [`Telemetry::x_nom`], `u_nom` | (15) |
//! | y_set-point | set-point | `set_point` | (29) |
//! | A_ii, B_ii, C_i, C_zi, D_zi | model | [`tables::Model`] `A`, `B`, `C`, `Cz`, `Dz` | (1) |
//! | E_i L_ij | effect of the neighbours' coupling outputs | `EL` | (1a), (2) |
//! | K_i; K_i^x, K_i^e | gains | `K`; `Kx`, `Ke` | (17); (7f) |
//! | calE_i | tube, the RPI set of x - x^ | the rows with an entry in [`tables::DpcProblem::tube`] | (35a) |
//! | X^_i, U^_i | tightened constraint sets | the rows with entries in `state` and `input` | (35c), (35d) |
//! | Delta_i^z, Sigma_i | reserve of the coupling output, terminal set | the rows without offset | (35b), (36) |
//! | Y_i | set of reference outputs | `y_min`, `y_max`; `set`, `set_limit` | (31) |
//! | epsilon | rate of the reference output | `epsilon` | (30) |
//! | T_i, gamma | weights of the reference-output layer | `weight`; `basis`, `weights`, `gamma` | (29) |
//! | H_h, l~_h, n_h | coupling constraint | [`tables::CouplingRow`] `own`, `others`, `l_tilde`, `members`; [`HalfSpace`], [`Meeting`] | (26)-(28) |
//! | N | horizon | `N` | (33) |
//! | v, w | (dx_0, du_0, ..., du_{N-1}), and the same scaled by the Hessian's factor | [`problem::Plan`], [`solver::Solver::w`] | (33) |
#![no_std]
#![forbid(unsafe_code)]

mod delivery;
mod double;
mod header;
mod include;
mod refusal;
pub mod single;
mod status;
mod version;
mod working_set;

pub use delivery::{Delivery, Refused};
pub use double::*;
pub use header::{HEADER_BYTES, LAYOUT, Sender};
pub use refusal::StartError;
pub use status::{Control, References, Status};
pub use version::fits;
