//! Mathematics of sets; knows no subsystem.

mod bounded;
mod boxes;
mod front;
mod invariant;
mod polytope;
mod strips;
mod tube;
mod zonotope;

pub use bounded::Bounded;
pub use boxes::Box;
pub use front::{Care, Charge, Front, LANES, Space};
pub use invariant::{Invariant, least_fixed_point, least_fixed_point_of_blocks, rpi_at_least, rpi_on_normals};
pub use polytope::Polytope;
pub use strips::{Multiplier, Strips, multiplier, multipliers};
pub use tube::{MOST_STEPS, PowerSum, RateNorm};
pub use zonotope::{ANGLES, Zonotope};
