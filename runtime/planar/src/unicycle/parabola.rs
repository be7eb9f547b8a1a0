//! What a double integrator does under a constant acceleration.

use crate::vector::add_scaled;

/// The motion of a double integrator from a sample on, under a constant acceleration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parabola {
    /// At the sample.
    pub position: [f64; 2],
    /// At the sample.
    pub velocity: [f64; 2],
    pub acceleration: [f64; 2],
}

impl Parabola {
    /// Position `time` after the sample.
    pub fn position(&self, time: f64) -> [f64; 2] {
        add_scaled(add_scaled(self.position, time, self.velocity), 0.5 * (time * time), self.acceleration)
    }

    /// Velocity `time` after the sample.
    pub fn velocity(&self, time: f64) -> [f64; 2] {
        add_scaled(self.velocity, time, self.acceleration)
    }
}
