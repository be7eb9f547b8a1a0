//! Mathematics of sets; knows no subsystem.

mod bounded;
mod boxes;
mod invariant;
mod polytope;
mod strips;
mod tube;

pub use bounded::Bounded;
pub use boxes::Box;
pub use invariant::{Invariant, least_fixed_point, rpi_at_least, rpi_on_normals};
pub use polytope::Polytope;
pub use strips::{Multiplier, Strips, multiplier, multipliers};
pub use tube::{PowerSum, RateNorm};
