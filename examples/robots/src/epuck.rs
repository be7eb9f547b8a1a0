//! A simulated e-puck.
//!
//! F. Mondada et al., "The e-puck, a robot designed for education in engineering", 2009. Lengths in cm.

use dpc_planar::unicycle::{Drive, Follower, Motion, Wheels};

pub const DIAMETER: f64 = 7.4;

/// Wheels 4.1 cm in diameter on an axle of 5.2 cm, driven by stepping motors of 20 steps with a gear of 50 : 1, which make at most
/// about 1000 steps, one turn of the wheel, per second.
///
/// Stepping motors take a new speed within one step, without a ramp. What limits the acceleration is the friction of the
/// tyres, which holds some 5 m/s^2 shared by two wheels, and a body that may tip onto its rim; a fifth of it is used: full speed
/// takes 0.13 s.
pub const DRIVE: Drive = Drive { axle: 5.2, wheel_speed: 12.9, wheel_acceleration: 100.0 };

/// Commands at 100 Hz. The gains were found by a random search for small deviations at sampling periods of 2 s.
pub const FOLLOWER: Follower =
    Follower { drive: DRIVE, interval: 0.01, pull: 8.0, turn: 8.0, preview: 0.25, fade: 0.22, slow: 0.2, rest: 0.02 };

/// Steps of integration per second.
const RATE: f64 = 1000.0;

/// (40), driven by two wheels that follow their commands with a bounded acceleration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Epuck {
    pub position: [f64; 2],
    /// Unit vector.
    pub heading: [f64; 2],
    pub wheels: Wheels,
}

impl Epuck {
    /// At rest. The heading is a unit vector.
    pub fn at(position: [f64; 2], heading: [f64; 2]) -> Self {
        Self { position, heading, wheels: Wheels { left: 0.0, right: 0.0 } }
    }

    /// What its odometry and a camera measure.
    pub fn motion(&self) -> Motion {
        Motion { position: self.position, heading: self.heading, speed: DRIVE.motion(self.wheels).0 }
    }

    /// The millisecond after a command: Runge and Kutta's fourth-order step. An error of heading is below (omega / 1 kHz)^5 / 120,
    /// 3e-14 at most, so a day's motion is exact to more digits than are printed; without sine and cosine it is the same on every machine.
    pub fn tick(&mut self, command: Wheels) {
        let next = Wheels {
            left: approach(self.wheels.left, command.left),
            right: approach(self.wheels.right, command.right),
        };
        let (before, after) = (DRIVE.motion(self.wheels), DRIVE.motion(next));
        let middle = (0.5 * (before.0 + after.0), 0.5 * (before.1 + after.1));
        let start = self.pose();
        let k1 = rates(start, before);
        let k2 = rates(moved(start, 0.5, k1), middle);
        let k3 = rates(moved(start, 0.5, k2), middle);
        let k4 = rates(moved(start, 1.0, k3), after);
        let mean = std::array::from_fn(|i| (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]) / 6.0);
        let [x, y, cosine, sine] = moved(start, 1.0, mean);
        let length = (cosine * cosine + sine * sine).sqrt();
        *self = Self { position: [x, y], heading: [cosine / length, sine / length], wheels: next };
    }

    fn pose(&self) -> [f64; 4] {
        let ([x, y], [cosine, sine]) = (self.position, self.heading);
        [x, y, cosine, sine]
    }
}

/// A wheel's speed one step later.
fn approach(speed: f64, command: f64) -> f64 {
    let most = DRIVE.wheel_acceleration / RATE;
    let command = command.clamp(-DRIVE.wheel_speed, DRIVE.wheel_speed);
    speed + (command - speed).clamp(-most, most)
}

/// (40a)-(40c) with the cosine and sine of the heading.
fn rates([_, _, cosine, sine]: [f64; 4], (v, omega): (f64, f64)) -> [f64; 4] {
    [v * cosine, v * sine, -omega * sine, omega * cosine]
}

fn moved(pose: [f64; 4], steps: f64, rates: [f64; 4]) -> [f64; 4] {
    std::array::from_fn(|i| pose[i] + steps / RATE * rates[i])
}

#[cfg(test)]
mod tests {
    use super::{DRIVE, Epuck};
    use dpc_planar::unicycle::Wheels;

    /// Wheel speeds 4 and 6 cm/s: a circle of radius 13 cm around (0, 13).
    #[test]
    fn constant_wheel_speeds_make_a_circle() {
        let wheels = Wheels { left: 4.0, right: 6.0 };
        let mut robot = Epuck { wheels, ..Epuck::at([0.0; 2], [1.0, 0.0]) };
        for tick in 1..=20_000 {
            robot.tick(wheels);
            let angle = 2.0 / 5.2 * 1e-3 * f64::from(tick);
            let exact = [13.0 * angle.sin(), 13.0 - 13.0 * angle.cos()];
            assert!((robot.position[0] - exact[0]).hypot(robot.position[1] - exact[1]) < 1e-10);
            assert!((robot.heading[0] - angle.cos()).hypot(robot.heading[1] - angle.sin()) < 1e-11);
        }
    }

    #[test]
    fn wheels_take_their_time_and_have_their_limit() {
        let mut robot = Epuck::at([0.0; 2], [0.0, 1.0]);
        for _ in 0..50 {
            robot.tick(Wheels { left: 50.0, right: 50.0 });
        }
        assert!((robot.motion().speed - 5.0).abs() < 1e-12);
        assert!((robot.position[1] - 0.5 * 100.0 * 0.05 * 0.05).abs() < 1e-12, "{:?}", robot.position);
        for _ in 0..200 {
            robot.tick(Wheels { left: 50.0, right: 50.0 });
        }
        assert!((robot.motion().speed - DRIVE.wheel_speed).abs() < 1e-12);
    }
}
