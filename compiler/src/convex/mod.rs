//! Mathematics of sets; knows no subsystem.

mod boxes;
mod invariant;
mod polytope;
mod strips;
mod tube;

pub use boxes::Box;
pub use invariant::{Invariant, rpi_on_normals};
pub use polytope::Polytope;
pub use strips::{Multiplier, Strips, multiplier, multipliers};
pub use tube::{PowerSum, RateNorm};
