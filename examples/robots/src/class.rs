//! The motions over which deviations are measured.

use dpc_planar::unicycle::{Follower, Wheels};
use example_kit::random::Random;

use crate::epuck::{DRIVE, Epuck};
use crate::following::{Deviation, follow};

/// Moves of the search, each to a worse neighbour or to half the distance.
const MOVES: usize = 30;

/// Trajectories of double integrators whose velocities and accelerations stay, per axis, within limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Class {
    /// Sampling period, s.
    pub period: f64,
    /// cm/s.
    pub velocity: f64,
    /// cm/s^2.
    pub acceleration: f64,
}

/// One sampling period, up to symmetry: it begins forward along the first axis, or at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Case {
    /// cm/s.
    speed: f64,
    /// Turn rate, as part of the largest that a parabola of the class may have at this speed, or the wheels.
    turning: f64,
    /// Velocity, cm/s.
    end: [f64; 2],
}

impl Class {
    /// Deviations in `periods` periods of one robot's random trajectory with starts, stops, reversals, turns of all angles and
    /// slow motion.
    pub fn random(&self, follower: &Follower, seed: u64, periods: usize) -> Vec<Deviation> {
        let mut random = Random::new(seed);
        let mut robot = Epuck::at([0.0; 2], random.direction());
        let follow_one = |_| {
            let [now, end] = [robot.motion().velocity(), self.target(&mut random, robot.motion().velocity())];
            let change =
                |axis: usize| ((end[axis] - now[axis]) / self.period).clamp(-self.acceleration, self.acceleration);
            follow(follower, &mut robot, [change(0), change(1)], self.period)
        };
        (0..periods).map(follow_one).collect()
    }

    /// A velocity for the end of a period.
    fn target(&self, random: &mut Random, now: [f64; 2]) -> [f64; 2] {
        match random.integer(0, 9) {
            0 | 1 => [0.0; 2],
            2 => now.map(|v| -v),
            3 => {
                let part = random.between(-1.0, 1.0);
                now.map(|v| part * v)
            }
            4 => near(random, now.map(|v| -v), 0.02 * self.velocity),
            5 => near(random, [0.0; 2], 0.1 * self.velocity),
            _ => near(random, [0.0; 2], self.velocity),
        }
        .map(|v| v.clamp(-self.velocity, self.velocity))
    }

    /// The largest deviations over a grid of cases, and over what a search finds that starts at the worst of them.
    ///
    /// The grid contains the class in every orientation: speeds at start and end up to the diagonal of the box of
    /// velocities, accelerations up to that of accelerations.
    pub fn worst(&self, follower: &Follower, grid: &Grid) -> Deviation {
        let cases: Vec<(Case, Deviation)> =
            self.cases(grid).filter_map(|case| Some((case, self.deviation(follower, &case)?))).collect();
        let measures: [fn(&Deviation) -> f64; 3] = [|d| d.position, |d| d.velocity, |d| d.between];
        let climbed = measures.into_iter().flat_map(|measure| {
            let mut order: Vec<&(Case, Deviation)> = cases.iter().collect();
            order.sort_by(|a, b| measure(&b.1).total_cmp(&measure(&a.1)));
            order.into_iter().take(grid.climbs).map(move |start| self.climb(follower, start, measure))
        });
        climbed.fold(Deviation::default(), Deviation::max)
    }

    fn cases(&self, grid: &Grid) -> impl Iterator<Item = Case> {
        let fastest = self.velocity * 2.0_f64.sqrt();
        // Denser where it is slow, where the linearisation is singular.
        let speeds = move |count: usize| (0..=count).map(move |k| fastest * (k as f64 / count as f64).powi(2));
        let Grid { speeds: at_start, ends, angles, .. } = *grid;
        speeds(at_start).flat_map(move |speed| {
            [-1.0, 0.0, 1.0].into_iter().flat_map(move |turning| {
                speeds(ends).flat_map(move |length| {
                    (0..angles).map(move |k| {
                        // Mirrored cases have the same deviations: half a turn will do.
                        let angle = std::f64::consts::PI * (k as f64 + 0.5) / angles as f64;
                        Case { speed, turning, end: [length * angle.cos(), length * angle.sin()] }
                    })
                })
            })
        })
    }

    /// `None` outside of the class.
    fn deviation(&self, follower: &Follower, case: &Case) -> Option<Deviation> {
        let diagonal = 2.0_f64.sqrt();
        let acceleration = [(case.end[0] - case.speed) / self.period, case.end[1] / self.period];
        let inside = acceleration[0].hypot(acceleration[1]) <= self.acceleration * diagonal
            && case.end[0].hypot(case.end[1]) <= self.velocity * diagonal
            && (0.0..=self.velocity * diagonal).contains(&case.speed)
            && case.turning.abs() <= 1.0;
        inside.then(|| follow(follower, &mut self.robot(case), acceleration, self.period))
    }

    /// Turning by (42) for an acceleration of the class, as far as the wheels allow.
    fn robot(&self, case: &Case) -> Epuck {
        let most = self.acceleration * 2.0_f64.sqrt() / case.speed;
        let across = (0.5 * DRIVE.axle * most).min(DRIVE.wheel_speed - case.speed) * case.turning;
        let wheels = Wheels { left: case.speed - across, right: case.speed + across };
        Epuck { wheels, ..Epuck::at([0.0; 2], [1.0, 0.0]) }
    }

    /// Coordinate search upward.
    fn climb(
        &self,
        follower: &Follower,
        (case, found): &(Case, Deviation),
        measure: fn(&Deviation) -> f64,
    ) -> Deviation {
        let (mut best, mut worst, mut step) = (*case, *found, 0.05 * self.velocity);
        for _ in 0..MOVES {
            let around = best.around(step, step / self.velocity);
            let reached = around.into_iter().filter_map(|case| Some((case, self.deviation(follower, &case)?)));
            match reached.max_by(|a, b| measure(&a.1).total_cmp(&measure(&b.1))) {
                Some((case, deviation)) if measure(&deviation) > measure(&worst) => (best, worst) = (case, deviation),
                _ => step *= 0.5,
            }
        }
        worst
    }
}

/// How finely a class is searched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Speeds at the start.
    pub speeds: usize,
    /// Speeds at the end.
    pub ends: usize,
    /// Of the velocity at the end, over half a turn.
    pub angles: usize,
    /// Searches for each kind of deviation.
    pub climbs: usize,
}

impl Case {
    fn around(&self, velocity: f64, turning: f64) -> [Self; 8] {
        let Self { speed, turning: now, end: [x, y] } = *self;
        [
            Self { speed: speed + velocity, ..*self },
            Self { speed: speed - velocity, ..*self },
            Self { turning: now + turning, ..*self },
            Self { turning: now - turning, ..*self },
            Self { end: [x + velocity, y], ..*self },
            Self { end: [x - velocity, y], ..*self },
            Self { end: [x, y + velocity], ..*self },
            Self { end: [x, y - velocity], ..*self },
        ]
    }
}

fn near(random: &mut Random, centre: [f64; 2], width: f64) -> [f64; 2] {
    centre.map(|centre| centre + random.between(-width, width))
}
