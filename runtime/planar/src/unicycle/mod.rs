//! Robots with two driven wheels as double integrators: (40)-(42).
//!
//! A predictive controller for the double integrators (41) chooses (a_x, a_y) for a sampling period; from the measured state
//! ([`Motion::state`]) on, that is a [`Parabola`]. The [`Follower`] commands the wheels of the [`Drive`] many times per period, by (42)
//! ([`Input`]) where it can.

pub mod drive;
pub mod follower;
pub mod linearisation;
pub mod parabola;

pub use drive::{Drive, Wheels};
pub use follower::Follower;
pub use linearisation::Input;
pub use parabola::Parabola;

/// Where a unicycle is and how it moves: the state of (40).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    pub position: [f64; 2],
    /// (cos phi, sin phi): where the front points to.
    pub heading: [f64; 2],
    /// v, negative when driving backward; length per second.
    pub speed: f64,
}

impl Motion {
    /// v (cos phi, sin phi).
    pub fn velocity(&self) -> [f64; 2] {
        self.heading.map(|h| self.speed * h)
    }

    /// (x, v_x, y, v_y): the state of the double integrators (41).
    pub fn state(&self) -> [f64; 4] {
        let ([x, y], [vx, vy]) = (self.position, self.velocity());
        [x, vx, y, vy]
    }
}
