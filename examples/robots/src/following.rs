//! How far a robot is from the double integrator it follows.

use dpc_planar::unicycle::{Follower, Parabola};

use crate::epuck::Epuck;

/// Ticks of a robot (ms) per command.
const TICKS: usize = 10;

/// Between robot and double integrator over a sampling period, both started in the robot's state.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Deviation {
    /// Of the position at the end of the period, cm.
    pub position: f64,
    /// Of the velocity at the end of the period, cm/s.
    pub velocity: f64,
    /// Of the position, the largest over the period, at every millisecond, cm.
    pub between: f64,
}

impl Deviation {
    /// The larger of each.
    pub fn max(self, other: Self) -> Self {
        Self {
            position: self.position.max(other.position),
            velocity: self.velocity.max(other.velocity),
            between: self.between.max(other.between),
        }
    }

    /// Whether none is larger than the other's.
    pub fn is_within(&self, bound: &Self) -> bool {
        self.position <= bound.position && self.velocity <= bound.velocity && self.between <= bound.between
    }
}

/// Lets the robot follow (a_x, a_y) over a period, which is rounded to commands, and says how far it strayed.
///
/// # Panics
/// If something is not finite.
pub fn follow(follower: &Follower, robot: &mut Epuck, acceleration: [f64; 2], period: f64) -> Deviation {
    follow_with(follower, robot, acceleration, period, |_| {})
}

/// The same; `at` is told the position after every millisecond.
pub fn follow_with(
    follower: &Follower,
    robot: &mut Epuck,
    acceleration: [f64; 2],
    period: f64,
    mut at: impl FnMut([f64; 2]),
) -> Deviation {
    let start = robot.motion();
    let parabola = Parabola { position: start.position, velocity: start.velocity(), acceleration };
    let mut between = 0.0_f64;
    for command in 0..(period / follower.interval).round() as usize {
        let time = command as f64 * follower.interval;
        let wheels = follower.command(&parabola, period, time, &robot.motion()).expect("a finite state");
        for tick in 1..=TICKS {
            robot.tick(wheels);
            at(robot.position);
            let time = time + tick as f64 * follower.interval / TICKS as f64;
            between = between.max(distance(robot.position, parabola.position(time)));
        }
    }
    Deviation {
        position: distance(robot.position, parabola.position(period)),
        velocity: distance(robot.motion().velocity(), parabola.velocity(period)),
        between,
    }
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}
