//! Compiler for distributed predictive control.
//!
//! Reads the model of a network of subsystems with its constraints and weights from `system.toml`, does the
//! centralised off-line design of Farina, Betti, Giulioni, Scattolini, "An approach to distributed predictive control
//! for tracking" (Section IV-A), and writes one controller per subsystem as Rust for `dpc-runtime`. Equation numbers
//! everywhere are those of that paper.
//!
//! `text -> Spec -> Network -> Gains -> Sets -> Sizing -> Problems -> Emitted`: every stage is a value that is made from
//! earlier ones, never changes afterwards, and says what holds from then on. [`design::Design`] is the pipeline on one
//! page; read it first. `Spec` has [`import`] read the matrices that the text says stand in other files. Between `Network`
//! and `Gains`, [`tuning`] may search for gains, which the later stages then take as given ones. [`Build`] runs it in a
//! build script, the program `dpc-codegen` on the command line, [`export::design_json`] tells other tools the result, and
//! [`summary::Summary`] people. What is wrong with a file is told by [`diagnostic`], and at length by [`explain`].
//!
//! The manual is the folder `docs` of the repository: a tutorial, the reference of `system.toml`, the theory in two pages with
//! its limits, how to run controllers, and a comparison with other tools.
//!
//! # Symbols
//!
//! Fields for matrices and sets are the paper's upper-case letters; a tilde is `_ref`, a hat `_nom`. For subsystem i:
//!
//! | symbol | meaning | Rust | equation |
//! |---|---|---|---|
//! | A_ii, B_ii, C_i | local model | `network::Subsystem::{A, B, C}` | (1) |
//! | E_i, L_ij | what the coupling outputs of others do to the state | `network::Subsystem::{E, L}` | (1), (2) |
//! | C_zi, D_zi | coupling output z_i, what others hear of the subsystem | `network::Subsystem::{Cz, Dz}` | (1c) |
//! | X_i, U_i | state and input constraints | `network::Subsystem::{X, U}` | |
//! | H_h, l_h | coupling constraint over outputs | `network::{CouplingConstraint, ChangingConstraint}` | (3), (4) |
//! | w, v | disturbance and measurement error, beyond the paper: [`sets::exogenous`] | `network::Subsystem::{w, measurement_error}` | (20'), (35a') |
//! | Q_i, R_i, P_i | stage and terminal weights | `network::Subsystem::{Q, R}`, `gains::SubsystemGains::P` | (34), (37) |
//! | T_i, gamma | weights of the reference output | `network::Subsystem::T`, `network::Reference::gamma` | (29) |
//! | q, epsilon | norm and radius of the ball a reference moves in, per step | `network::Reference::norm`, `sizing::Sizing::epsilon` | (6), (30) |
//! | N | horizon | `network::Network::horizon` | (33) |
//! | K_i, F_ii | auxiliary control law, closed local loop | `gains::SubsystemGains::{K, F}` | (17), (18) |
//! | S_i, lambda | block-diagonal Lyapunov matrix and decay rate | `optim::lmi::Feedback::{S, rate}` | Remark 1 |
//! | calK_i = \[K_i^x K_i^e\] | gain of the reference layer | `gains::SubsystemGains::{Kx, Ke}` | (7f) |
//! | calF, calG | collective reference system | `gains::Gains::{calF, calG}` | (8) |
//! | Delta^chi | invariant set of the reference system | support values in `sets` | (12), (13) |
//! | calE_i | robustly invariant set of x - xhat | `sizing::SubsystemSizing::E` | (18) |
//! | calZ_i | box that z - zref stays in | `sizing::SubsystemSizing::zeta` | (21) |
//! | Delta_i^z | box that zhat - zref is kept in: the reserve | `sizing::SubsystemSizing::dz` | (22) |
//! | Sigma_i | terminal set | `sizing::SubsystemSizing::Sigma` | (24), (36) |
//! | Xhat_i, Uhat_i | tightened constraints | `sizing::SubsystemSizing::{X_nom, U_nom}` | (35c), (35d) |
//! | Y_i | reference outputs | `sizing::SubsystemSizing::Y` | (25b), (31) |
//! | l~_h | tightened limit of a coupling constraint | `sizing::Sizing::l_tilde` | (26) |
//! | \[C_i 0\] Delta_i^chi + Z_i | what a changing coupling constraint is charged: [`sets::outputs`] | `sizing::SubsystemSizing::exposed` | (26), (26') |
//! | V, w | i-DPC problem in least-distance form | `problems::DpcProblem` | (33)-(36) |

// Only `simulate::shared` may, which loads libraries.
#![deny(unsafe_code)]

// What Clarabel's semidefinite cone calls by name.
use lapack_symbols as _;

pub mod build;
#[cfg(feature = "measure")]
pub mod c_library;
pub mod clock;
pub mod convex;
pub mod dependency;
pub mod design;
pub mod diagnostic;
pub mod emit;
pub mod explain;
pub mod export;
#[cfg(feature = "measure")]
pub mod footprint;
pub mod gains;
pub mod import;
pub mod iterations;
pub mod network;
pub mod notices;
pub mod optim;
pub mod problems;
#[cfg(feature = "report")]
pub mod report;
pub mod rounding;
#[cfg(feature = "cli")]
pub mod scaffold;
pub mod sets;
mod sharing;
#[cfg(feature = "simulate")]
pub mod simulate;
pub mod sizing;
pub mod spec;
pub mod start;
pub mod summary;
pub mod tuning;

pub use build::Build;
