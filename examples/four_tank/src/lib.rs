//! The four-tank of Section VI of the paper, in closed loop with the controllers that were emitted for it.

pub mod bus;
pub mod checks;
pub mod closed_loop;
pub mod figure;
pub mod node;
pub mod plant;
pub mod plot;
pub mod random;
pub mod scenario;
pub mod sets;
pub mod table;
pub mod trajectory;
pub mod upset;
