//! How fast references move, and what that takes.

use dpc_planar::Arena;
use dpc_planar::need::Clearance;
use dpc_planar::sag::sag;

use crate::arena::{DIAMETER, Point, SIZE};
use crate::declared::{Declared, FAST, SLOW};

/// Robots that are faster must stay further apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pace {
    /// Of (30), cm per step.
    pub epsilon: f64,
    /// What the margins of (26) may take of a robot's position, per axis, cm.
    pub margin: f64,
    /// The class of motions the design keeps to, and what the wheels make of it.
    pub declared: Declared,
}

impl Pace {
    /// That of Section V.
    pub const FAST: Self = Self { epsilon: 5.0, margin: 8.5, declared: FAST };
    pub const SLOW: Self = Self { epsilon: 2.0, margin: 3.85, declared: SLOW };

    /// s.
    pub fn period(self) -> f64 {
        self.declared.class.period
    }

    /// Where a robot's centre may be at the samples, so that it is on the floor in between too, counted from the floor's centre: a
    /// robot leaves the chord between two samples by what [`Self::clearance`] counts, too.
    pub fn floor(self) -> Arena {
        let half = SIZE.map(|length| 0.5 * length);
        let floor = Arena { low: half.map(|half| -half), high: half };
        let within = floor.within(&Clearance { distance: self.stray(), axes: self.sag() });
        within.expect("robots stray by less than the floor is wide")
    }

    fn stray(self) -> f64 {
        self.declared.bound.between + self.declared.bound.position
    }

    fn sag(self) -> Point {
        sag([self.declared.class.acceleration; 2], self.period())
    }

    /// What the true positions at the samples must keep, so that nobody touches in between either: the diameter, and what both
    /// robots leave the chord between their positions at two samples by. A robot follows a double integrator, which leaves its own
    /// chord by the sag, and ends where the robot's chord ends but for the declared disturbance.
    pub fn clearance(self) -> Clearance {
        Clearance { distance: DIAMETER + 2.0 * self.stray(), axes: self.sag().map(|s| 2.0 * s) }
    }
}
