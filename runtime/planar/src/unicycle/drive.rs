//! Two driven wheels.

use crate::vector::sqrt;

/// Speeds at the circumference, length per second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wheels {
    pub left: f64,
    pub right: f64,
}

/// A differential drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive {
    /// Between the wheels.
    pub axle: f64,
    /// Of a wheel, largest magnitude.
    pub wheel_speed: f64,
    /// Of a wheel, largest magnitude.
    pub wheel_acceleration: f64,
}

impl Drive {
    /// Wheel speeds for a speed and a turn rate. Beyond the limit, speed and turn rate are scaled together: the path stays, the
    /// robot is slower on it.
    pub fn wheels(&self, speed: f64, turn_rate: f64) -> Wheels {
        let across = 0.5 * self.axle * turn_rate;
        let largest = speed.abs() + across.abs();
        let part = if largest > self.wheel_speed { self.wheel_speed / largest } else { 1.0 };
        Wheels { left: part * (speed - across), right: part * (speed + across) }
    }

    /// Speed and turn rate for wheel speeds.
    pub fn motion(&self, wheels: Wheels) -> (f64, f64) {
        (0.5 * (wheels.left + wheels.right), (wheels.right - wheels.left) / self.axle)
    }

    /// The fastest turn on the spot, rad/s.
    pub fn turn_rate(&self) -> f64 {
        2.0 * self.wheel_speed / self.axle
    }

    /// How fast a turn on the spot can change, rad/s^2.
    pub fn turn_acceleration(&self) -> f64 {
        2.0 * self.wheel_acceleration / self.axle
    }

    /// Least time of a turn on the spot by `angle` (rad, not negative) from rest to rest: half of it accelerated and half braked, with
    /// the fastest turn in between if that is reached.
    pub fn turn_time(&self, angle: f64) -> f64 {
        let (rate, acceleration) = (self.turn_rate(), self.turn_acceleration());
        if angle * acceleration < rate * rate {
            2.0 * sqrt(angle / acceleration)
        } else {
            angle / rate + rate / acceleration
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Drive, Wheels};

    const DRIVE: Drive = Drive { axle: 5.0, wheel_speed: 10.0, wheel_acceleration: 100.0 };

    #[test]
    fn wheels_and_motion_are_inverse() {
        assert_eq!(DRIVE.wheels(3.0, 2.0), Wheels { left: -2.0, right: 8.0 });
        assert_eq!(DRIVE.motion(Wheels { left: -2.0, right: 8.0 }), (3.0, 2.0));
    }

    #[test]
    fn turns_take_the_time_of_their_speed_profile() {
        // rate 4 rad/s, acceleration 40 rad/s^2: 0.1 s and 0.2 rad to the fastest turn.
        assert!((DRIVE.turn_time(0.1) - 0.1).abs() < 1e-12);
        assert!((DRIVE.turn_time(0.4) - 0.2).abs() < 1e-12);
        assert!((DRIVE.turn_time(1.2) - 0.4).abs() < 1e-12);
        assert_eq!(DRIVE.turn_time(0.0), 0.0);
    }

    #[test]
    fn beyond_the_limit_the_curvature_stays() {
        let (speed, turn_rate) = DRIVE.motion(DRIVE.wheels(15.0, -6.0));
        assert!((turn_rate / speed + 0.4).abs() < 1e-12);
        let wheels = DRIVE.wheels(15.0, -6.0);
        assert!((wheels.left.abs().max(wheels.right.abs()) - 10.0).abs() < 1e-12);
    }
}
