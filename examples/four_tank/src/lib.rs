//! The four-tank of Section VI of the paper, in closed loop with the controllers that were emitted for it.

pub mod plant;
pub mod plot;
pub mod random;
pub mod scenario;
