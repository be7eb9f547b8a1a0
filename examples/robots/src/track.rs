//! Where a robot goes in a period.

use crate::arena::{Point, on_floor};
use crate::epuck::{Epuck, FOLLOWER};
use crate::following::{Deviation, follow_with};

/// Milliseconds of a period.
fn ticks(period: f64) -> usize {
    (1000.0 * period).round() as usize
}

#[derive(Debug, Clone)]
pub struct Track {
    /// After every millisecond, on the floor.
    pub positions: Vec<Point>,
    pub deviation: Deviation,
}

impl Track {
    /// Of a robot that is to accelerate by (a_x, a_y).
    pub fn of(robot: &mut Epuck, acceleration: [f64; 2], period: f64) -> Self {
        let mut positions = Vec::with_capacity(ticks(period));
        let deviation = follow_with(&FOLLOWER, robot, acceleration, period, |at| positions.push(on_floor(at)));
        Self { positions, deviation }
    }

    /// Every 50 ms.
    pub fn thinned(&self) -> Vec<Point> {
        self.positions.iter().skip(49).step_by(50).copied().collect()
    }

    /// Of a robot whose wheels stand still at once.
    pub fn of_a_stop(robot: &mut Epuck, period: f64) -> Self {
        *robot = Epuck::at(robot.position, robot.heading);
        Self { positions: vec![on_floor(robot.position); ticks(period)], deviation: Deviation::default() }
    }
}
