//! Follows the double integrator within a sampling period.

use crate::unicycle::{Drive, Input, Motion, Parabola, Wheels};
use crate::vector::{add_scaled, clip, cross, dot, length, scaled, sqrt, subtract, unit};

/// Cosine between heading and course below which a moving robot keeps its sense of driving.
const NEARLY_ACROSS: f64 = 0.06;

/// Part of the drive's turn acceleration that is counted on when a turn is braked.
const BRAKING: f64 = 0.8;

/// The inner loop that makes a unicycle run through the parabola of a double integrator: velocity V(t), position P(t).
///
/// With p the measured position, the velocity to have is
///
/// ```text
/// W = V + pull (P - p).
/// ```
///
/// The robot drives with the part of W along its heading, which is negative if W points backward, and turns by (42), written
/// for a robot that has velocity W and is to accelerate by (a_x, a_y), plus a feedback of the angle that is left to W or to -W,
/// whichever is nearer: it never turns by more than a quarter. On the parabola this is (42) itself. (W also changes by `pull`
/// times the velocity error; fed forward, that makes a robot swing whose wheels are still catching up.)
///
/// # The singularity of (42)
/// omega = (W x (a_x, a_y)) / |W|^2 has no bound where the parabola passes near v = 0, starts or ends there. So
/// - below the speed `slow`, (42) is evaluated for `slow` and taken in proportion to the speed, which leaves the turn to the feedback, that is to
///   turning on the spot: with W across the heading v = 0, and v grows with the cosine;
/// - the course is that of `preview` later, so that the turn begins before the slowest point;
/// - at the slowest points the course does not react to sideways errors, which no turn removes there: their part is taken in
///   proportion to the speed below `slow`;
/// - heading nearly across the course, the robot keeps its sense of driving, and at rest drives forward, so it does not waver;
/// - below the speed `rest` it does not turn at all: the dead zone. A robot at rest stays where it is though the measured
///   state is not exactly the reference's, until an acceleration is wanted;
/// - where the turn to the velocity at the end of the period takes all the time that is left, it is done: a lag in the middle of a
///   period is made up for, one at its end is a disturbance of the predictive controller. For the same reason `pull` fades out
///   within `fade` before the end, where it would trade velocity for position.
///
/// What the lag amounts to depends on the drive and on the parabolas: the example `robots` measures it.
///
/// Lengths are in one unit (cm, say), times in s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Follower {
    pub drive: Drive,
    /// Time between two commands.
    pub interval: f64,
    /// Of the position error, 1/s.
    pub pull: f64,
    /// Of the heading error, 1/s.
    pub turn: f64,
    /// Time by which the course is ahead of the parabola.
    pub preview: f64,
    /// Time before the end of a period in which `pull` fades out.
    pub fade: f64,
    /// Speed below which (42) is not followed.
    pub slow: f64,
    /// Speed below which the robot does not turn. Below `slow`.
    pub rest: f64,
}

/// Where to head, and whether that is forward.
struct Course {
    /// Unit vector, by no more than about a quarter off the heading.
    heading: [f64; 2],
    forward: bool,
}

impl Follower {
    /// What to command to the wheels `time` after the sample at which the parabola began, for the next interval. A function of
    /// its arguments alone. `None` if something is not finite.
    pub fn command(&self, parabola: &Parabola, period: f64, time: f64, measured: &Motion) -> Option<Wheels> {
        let left = (period - time).max(0.0);
        let pull = self.pull * (left / self.fade).min(1.0);
        let way = subtract(parabola.position(time), measured.position);
        let wish = add_scaled(parabola.velocity(time + self.interval), pull, way);
        let last = self.last_turn(parabola.velocity(period), left, measured);
        let turn_rate = last.unwrap_or_else(|| {
            let coming = parabola.velocity(time + self.preview.min(left));
            let pull = pull * (length(coming) / self.slow).min(1.0);
            self.turn_along(add_scaled(coming, pull, way), parabola.acceleration, measured)
        });
        let wheels = self.drive.wheels(dot(wish, measured.heading), turn_rate);
        [wheels.left, wheels.right, measured.speed].iter().all(|speed| speed.is_finite()).then_some(wheels)
    }

    /// The turn to the velocity at the end of the period, if it takes all the time that is left.
    fn last_turn(&self, end: [f64; 2], left: f64, measured: &Motion) -> Option<f64> {
        let course = Course::of(end, measured).filter(|_| length(end) > self.rest)?;
        let angle = length(subtract(course.heading, measured.heading));
        (self.drive.turn_time(angle) >= left).then(|| self.feedback(&course, measured))
    }

    /// Turn rate of a robot that is to have the velocity `wish`, which changes by `change` per second.
    fn turn_along(&self, wish: [f64; 2], change: [f64; 2], measured: &Motion) -> f64 {
        let Some(course) = Course::of(wish, measured) else { return 0.0 };
        let speed = length(wish);
        let awake = clip((speed - self.rest) / self.rest, 0.0, 1.0);
        let at_least = speed.max(self.slow);
        let signed = if course.forward { at_least } else { -at_least };
        let along = Input::linearising(course.heading, signed, change).map_or(0.0, |input| input.omega);
        awake * (self.feedback(&course, measured) + along * (speed / at_least))
    }

    /// Proportional to the angle, as far as the drive can brake in time.
    fn feedback(&self, course: &Course, measured: &Motion) -> f64 {
        let angle = length(subtract(course.heading, measured.heading));
        let braked = sqrt(2.0 * BRAKING * self.drive.turn_acceleration() * angle);
        let rate = (self.turn * angle).min(braked);
        if cross(measured.heading, course.heading) >= 0.0 { rate } else { -rate }
    }
}

impl Course {
    /// Along `velocity`, forward or backward, whichever is nearer to the heading. `None` if it is zero or not finite.
    fn of(velocity: [f64; 2], measured: &Motion) -> Option<Self> {
        let heading = unit(velocity)?;
        let cosine = dot(heading, measured.heading);
        let forward = if cosine.abs() > NEARLY_ACROSS { cosine >= 0.0 } else { measured.speed >= 0.0 };
        Some(Self { heading: if forward { heading } else { scaled(heading, -1.0) }, forward })
    }
}

#[cfg(test)]
mod tests {
    use super::Follower;
    use crate::unicycle::{Drive, Input, Motion, Parabola};

    const DRIVE: Drive = Drive { axle: 5.0, wheel_speed: 12.0, wheel_acceleration: 100.0 };
    const FOLLOWER: Follower = Follower {
        drive: DRIVE,
        interval: 0.01,
        pull: 10.0,
        turn: 8.0,
        preview: 0.0,
        fade: 0.2,
        slow: 0.2,
        rest: 0.02,
    };
    const PERIOD: f64 = 2.0;

    fn parabola(velocity: [f64; 2], acceleration: [f64; 2]) -> Parabola {
        Parabola { position: [0.0; 2], velocity, acceleration }
    }

    fn at_origin(heading: [f64; 2], speed: f64) -> Motion {
        Motion { position: [0.0; 2], heading, speed }
    }

    /// Speed and turn rate.
    fn command(parabola: &Parabola, measured: &Motion) -> (f64, f64) {
        DRIVE.motion(FOLLOWER.command(parabola, PERIOD, 0.0, measured).expect("finite numbers"))
    }

    #[test]
    fn on_the_parabola_it_is_the_linearisation_forward_and_backward() {
        let (heading, acceleration) = ([0.6, 0.8], [1.0, 0.5]);
        for speed in [4.0, -4.0] {
            let measured = at_origin(heading, speed);
            let expected = Input::linearising(heading, speed, acceleration).unwrap();
            let (commanded, turn_rate) = command(&parabola(measured.velocity(), acceleration), &measured);
            assert!((turn_rate - expected.omega).abs() < 1e-9, "{turn_rate} {expected:?}");
            assert!((commanded - (speed + 0.01 * expected.a)).abs() < 1e-9);
        }
    }

    #[test]
    fn at_rest_it_turns_on_the_spot_to_the_nearer_end() {
        let started = Parabola { velocity: [0.0, 0.5], ..parabola([0.0; 2], [0.0, 2.0]) };
        for (heading, side) in [([0.8, 0.6], 1.0), ([0.8, -0.6], -1.0), ([-0.8, 0.6], -1.0), ([1.0, 0.0], 1.0)] {
            let (speed, turn_rate) = command(&started, &at_origin(heading, 0.0));
            assert!(side * turn_rate > 1.0, "{heading:?}: {turn_rate}");
            assert!(speed * heading[1] >= 0.0 && speed.abs() <= 0.6 * heading[1].abs());
        }
    }

    #[test]
    fn nearly_across_the_course_the_sense_of_driving_stays() {
        let across = parabola([0.0, 1.0], [0.0; 2]);
        let turn_rate = |speed| command(&across, &at_origin([1.0, 0.0], speed)).1;
        assert!(turn_rate(0.5) > 1.0 && turn_rate(-0.5) < -1.0);
    }

    #[test]
    fn in_the_dead_zone_it_does_not_turn() {
        let still = parabola([0.0; 2], [0.0; 2]);
        let aside = Motion { position: [0.0, 0.3], ..at_origin([1.0, 0.0], 0.0) };
        assert_eq!(command(&still, &aside), (0.0, 0.0));
        let ahead = Motion { position: [0.3, 0.0], ..at_origin([1.0, 0.0], 0.0) };
        let (speed, turn_rate) = command(&still, &ahead);
        assert!((speed + 3.0).abs() < 1e-9 && turn_rate == 0.0);
    }

    #[test]
    fn the_end_of_the_period_is_turned_to_in_time() {
        // Backward at the end; the turn from (1, 0) to (0.6, -0.8) takes 0.93 / 4.8 + 4.8 / 40 = 0.31 s.
        let swung = parabola([-0.9, 0.8 * 1.0], [0.0; 2]);
        let end = Parabola { velocity: [0.9, 0.0], acceleration: [-0.75, 0.4], ..swung };
        let turn_rate = |time: f64| {
            let measured = Motion { position: end.position(time), ..at_origin([1.0, 0.0], 0.0) };
            DRIVE.motion(FOLLOWER.command(&end, PERIOD, time, &measured).unwrap()).1
        };
        assert!(turn_rate(1.0) > 0.0 && turn_rate(1.7) < 0.0, "{} {}", turn_rate(1.0), turn_rate(1.7));
    }

    #[test]
    fn what_is_not_finite_gives_no_command() {
        let (rest, moved) = (at_origin([1.0, 0.0], 0.0), parabola([1.0, 0.0], [0.0; 2]));
        assert!(FOLLOWER.command(&moved, PERIOD, 0.0, &rest).is_some());
        let odd = f64::NAN;
        let measured = [
            Motion { position: [odd, 0.0], ..rest },
            Motion { heading: [odd, 0.0], ..rest },
            Motion { speed: odd, ..rest },
        ];
        assert!(measured.iter().all(|measured| FOLLOWER.command(&moved, PERIOD, 1.99, measured).is_none()));
        assert!(FOLLOWER.command(&parabola([odd, 0.0], [0.0; 2]), PERIOD, 0.0, &rest).is_none());
        assert!(FOLLOWER.command(&parabola([0.0; 2], [0.0, odd]), PERIOD, 0.0, &rest).is_none());
        assert!(FOLLOWER.command(&moved, PERIOD, odd, &rest).is_none());
    }
}
