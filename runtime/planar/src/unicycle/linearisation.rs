//! Feedback linearisation (41)-(42).

use crate::vector::{add_scaled, cross, dot, quarter_turn, scaled};

/// The inputs of (40).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Input {
    /// rad/s.
    pub omega: f64,
    /// Length per second squared.
    pub a: f64,
}

impl Input {
    /// (42): the inputs under which a unicycle at `heading` (a unit vector) and `speed` accelerates by (a_x, a_y). `None` if they
    /// are not finite: with v = 0 only accelerations along the heading exist.
    pub fn linearising(heading: [f64; 2], speed: f64, acceleration: [f64; 2]) -> Option<Self> {
        let across = cross(heading, acceleration);
        let omega = if across == 0.0 { 0.0 } else { across / speed };
        let a = dot(heading, acceleration);
        (omega.is_finite() && a.is_finite()).then_some(Self { omega, a })
    }

    /// (41): the acceleration (a_x, a_y) of a unicycle under these inputs.
    pub fn acceleration(&self, heading: [f64; 2], speed: f64) -> [f64; 2] {
        add_scaled(scaled(heading, self.a), speed * self.omega, quarter_turn(heading))
    }
}

#[cfg(test)]
mod tests {
    use super::Input;

    #[test]
    fn inputs_make_the_acceleration_they_were_computed_from() {
        for (speed, acceleration) in [(3.0, [1.0, -2.0]), (-0.5, [0.3, 0.9]), (1e-3, [-1.0, 2.0])] {
            let heading = [0.6, -0.8];
            let input = Input::linearising(heading, speed, acceleration).unwrap();
            let back = input.acceleration(heading, speed);
            assert!((back[0] - acceleration[0]).abs() < 1e-12 && (back[1] - acceleration[1]).abs() < 1e-12, "{back:?}");
        }
    }

    #[test]
    fn at_rest_only_the_heading_is_open() {
        assert_eq!(Input::linearising([0.0, 1.0], 0.0, [0.0, -2.0]), Some(Input { omega: 0.0, a: -2.0 }));
        assert_eq!(Input::linearising([0.0, 1.0], 0.0, [1.0, -2.0]), None);
        assert_eq!(Input::linearising([0.0, 1.0], 1.0, [f64::NAN, 0.0]), None);
    }
}
