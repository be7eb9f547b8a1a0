//! Mathematics of optimisation and linear systems; knows no subsystem.

pub mod block_lu;
pub mod climb;
pub mod conic;
pub mod exponential;
pub mod lmi;
pub mod lp;
pub mod lyapunov;
pub mod modes;
pub mod perron;
pub mod quadratic;
pub mod responses;
pub mod riccati;
pub mod rounding;
pub mod semidefinite;
pub mod sparse;
