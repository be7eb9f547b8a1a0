//! Where robots start and where they go.

use std::f64::consts::TAU;
use std::fmt;

use example_kit::random::Random;

use crate::arena::{Point, SIZE, distance, from_centre, on_floor};
use crate::rule::Rule;
use dpc_planar::need::{Clearance, Need, Sum};

/// Starts and goals; all positions on the floor, cm.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    pub name: String,
    pub starts: Vec<Point>,
    pub mission: Mission,
    /// Steps of a run.
    pub steps: usize,
}

/// Where the robots are to be.
#[derive(Debug, Clone, PartialEq)]
pub enum Mission {
    /// Each at its own goal.
    Goals(Vec<Point>),
    /// The first robot visits these one after the other, and goes on to the next when its reference is there; every other robot
    /// keeps its own offset from the first one's reference, as it was last heard of.
    Follow { way: Vec<Point>, offsets: Vec<Point> },
    /// The centre of a formation goes from stop to stop, `leg` steps each, and the robots' offsets from it turn by `turn` (rad)
    /// on every leg: both evenly over the first `moving` steps of a leg.
    Formation { way: Vec<Point>, offsets: Vec<Point>, leg: usize, moving: usize, turn: f64 },
}

/// What a design allows of positions.
#[derive(Debug, Clone, PartialEq)]
pub struct Space {
    /// Y_i: where references may be, counted from the centre.
    pub low: Point,
    pub high: Point,
    /// What the true positions must keep.
    pub clearance: Clearance,
    /// What (26) takes of a row, for two robots together: the generators of the zonotope.
    pub margin: Vec<Point>,
}

/// Why a scenario cannot be run.
#[derive(Debug, Clone, PartialEq)]
pub enum Impossible {
    /// The robot's start or goal is outside Y.
    Outside { what: &'static str, robot: usize, at: Point, low: Point, high: Point },
    /// Two starts or goals that no row separates.
    TooClose { what: &'static str, robots: [usize; 2], apart: f64, needed: f64 },
    /// As many robots as this do not find room.
    NoRoom { robots: usize },
}

/// The three robots of Section V, on the floor.
const PAPER: ([Point; 3], [Point; 3]) =
    ([[28.0, 52.0], [39.0, 16.0], [90.0, 39.0]], [[86.0, 13.0], [77.0, 55.0], [20.0, 39.0]]);

/// Tries per robot, and tries to place all robots anew.
const TRIES: (usize, usize) = (400, 400);

impl Scenario {
    /// Section V.
    pub fn paper() -> Self {
        let (starts, goals) = PAPER;
        Self { name: "paper".into(), starts: starts.into(), mission: Mission::Goals(goals.into()), steps: 150 }
    }

    /// `n` robots on an ellipse, each of which goes to the opposite side.
    pub fn antipodal(n: usize, space: &Space) -> Self {
        let half = [0, 1].map(|k| space.high[k].min(-space.low[k]));
        let on_ellipse = |i: usize, turned: f64| {
            let angle = TAU * i as f64 / n as f64 + turned;
            on_floor([half[0] * angle.cos(), half[1] * angle.sin()])
        };
        let at = |turned: f64| (0..n).map(|i| on_ellipse(i, turned)).collect();
        Self { name: format!("antipodal {n}"), starts: at(0.0), mission: Mission::Goals(at(0.5 * TAU)), steps: 150 }
    }

    /// `n` robots that start and end anywhere.
    ///
    /// # Errors
    /// There is no room for so many, or none was found.
    pub fn random(n: usize, seed: u64, space: &Space) -> Result<Self, Impossible> {
        let mut random = Random::new(seed.wrapping_mul(64).wrapping_add(n as u64));
        let (starts, goals) = (space.scattered(n, &mut random)?, space.scattered(n, &mut random)?);
        let name = format!("random {n}, seed {seed}");
        Ok(Self { name, starts, mission: Mission::Goals(goals), steps: 200 })
    }

    /// A leader on a round, two followers at its sides.
    pub fn leader() -> Self {
        let way = vec![[75.0, 30.0], [75.0, 50.0], [55.0, 50.0], [55.0, 30.0]];
        let offsets = vec![[0.0, 0.0], [-32.0, 10.0], [32.0, -10.0]];
        let starts = vec![[55.0, 30.0], [22.0, 40.0], [100.0, 25.0]];
        Self { name: "leader".into(), starts, mission: Mission::Follow { way, offsets }, steps: 60 }
    }

    /// A triangle that crosses the floor and comes back, and turns by a third on every leg.
    pub fn formation() -> Self {
        let offsets = vec![[19.0, 0.0], [-9.5, 16.454], [-9.5, -16.454]];
        let way = vec![[40.0, 40.0], [65.0, 40.0], [90.0, 40.0], [65.0, 40.0]];
        let starts = shifted(way[0], &offsets, 0.0);
        let mission = Mission::Formation { way, offsets, leg: 45, moving: 35, turn: TAU / 3.0 };
        Self { name: "formation".into(), starts, mission, steps: 135 }
    }

    pub fn robots(&self) -> usize {
        self.starts.len()
    }

    /// # Errors
    /// A start or a goal is outside, or two are too close for any row.
    pub fn check(&self, space: &Space) -> Result<(), Impossible> {
        space.check("start", &self.starts)?;
        match &self.mission {
            Mission::Goals(goals) => space.check("goal", goals),
            Mission::Follow { way, offsets } => {
                way.iter().try_for_each(|stop| space.check("goal", &shifted(*stop, offsets, 0.0)))
            }
            Mission::Formation { way, offsets, turn, .. } => {
                let stops = way.iter().enumerate();
                stops
                    .into_iter()
                    .try_for_each(|(k, stop)| space.check("goal", &shifted(*stop, offsets, k as f64 * turn)))
            }
        }
    }
}

impl Mission {
    /// Goals at a step, on the floor: a formation and a leader's followers have changing ones. `references` are those that were last heard of, `stop` counts how far the leader is.
    pub fn goals(&self, step: usize, references: &[Point], stop: &mut usize) -> Vec<Point> {
        match self {
            Self::Goals(goals) => goals.clone(),
            Self::Follow { way, offsets } => {
                let leader = references[0];
                if distance(leader, way[*stop % way.len()]) < 0.5 {
                    *stop += 1;
                }
                let mut goals = shifted(leader, offsets, 0.0);
                goals[0] = way[*stop % way.len()];
                goals
            }
            Self::Formation { way, offsets, leg, moving, turn } => {
                let k = (step / leg).min(way.len() - 2);
                let part = ((step - k * leg) as f64 / *moving as f64).min(1.0);
                let centre = [0, 1].map(|c| way[k][c] + part * (way[k + 1][c] - way[k][c]));
                shifted(centre, offsets, (k as f64 + part) * turn)
            }
        }
    }
}

/// Offsets around a centre, turned by an angle.
fn shifted(centre: Point, offsets: &[Point], angle: f64) -> Vec<Point> {
    let (sin, cos) = angle.sin_cos();
    offsets.iter().map(|[x, y]| [centre[0] + cos * x - sin * y, centre[1] + sin * x + cos * y]).collect()
}

impl Space {
    /// What reference positions need, in direction n.
    pub fn need(&self) -> impl Need {
        let margin = self.margin.clone();
        let along = move |n: &Point| margin.iter().map(|g| (g[0] * n[0] + g[1] * n[1]).abs()).sum::<f64>();
        Sum(self.clearance, along)
    }

    fn check(&self, what: &'static str, places: &[Point]) -> Result<(), Impossible> {
        for (robot, place) in places.iter().enumerate() {
            self.check_inside(what, robot, *place)?;
            for (other, first) in places.iter().enumerate().take(robot) {
                self.check_apart(what, [other, robot], *first, *place)?;
            }
        }
        Ok(())
    }

    fn check_inside(&self, what: &'static str, robot: usize, at: Point) -> Result<(), Impossible> {
        let p = from_centre(at);
        let inside = (0..2).all(|k| (self.low[k]..=self.high[k]).contains(&p[k]));
        let (low, high) = (on_floor(self.low), on_floor(self.high));
        if inside { Ok(()) } else { Err(Impossible::Outside { what, robot, at, low, high }) }
    }

    fn check_apart(&self, what: &'static str, robots: [usize; 2], a: Point, b: Point) -> Result<(), Impossible> {
        let need = self.need();
        if Rule::LineOfCentres.row(&a, &b, &need).is_some() {
            return Ok(());
        }
        let apart = distance(a, b);
        let along = if apart > 0.0 { [(a[0] - b[0]) / apart, (a[1] - b[1]) / apart] } else { [1.0, 0.0] };
        Err(Impossible::TooClose { what, robots, apart, needed: need.need(&along) })
    }

    /// `n` places, as uniform as their distances allow.
    fn scattered(&self, n: usize, random: &mut Random) -> Result<Vec<Point>, Impossible> {
        (0..TRIES.1).find_map(|_| self.try_scatter(n, random)).ok_or(Impossible::NoRoom { robots: n })
    }

    fn try_scatter(&self, n: usize, random: &mut Random) -> Option<Vec<Point>> {
        let mut places: Vec<Point> = Vec::new();
        while places.len() < n {
            let next = (0..TRIES.0).find_map(|_| {
                let place = on_floor([0, 1].map(|k| random.between(self.low[k], self.high[k])));
                places.iter().all(|other| self.check_apart("start", [0, 1], *other, place).is_ok()).then_some(place)
            });
            places.push(next?);
        }
        Some(places)
    }
}

impl fmt::Display for Impossible {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Outside { what, robot, at: [x, y], low, high } => write!(
                f,
                "the {what} of robot {} at ({x:.1}, {y:.1}) cm is outside of what references may reach: x from {:.1} to {:.1}, y from {:.1} \
                 to {:.1} cm, the floor of {} x {} cm less the margins of the design",
                robot + 1,
                low[0],
                high[0],
                low[1],
                high[1],
                SIZE[0],
                SIZE[1]
            ),
            Self::TooClose { what, robots: [a, b], apart, needed } => write!(
                f,
                "the {what}s of robots {} and {} are {apart:.1} cm apart: no row of their constraint holds, along the line between them \
                 it takes {needed:.1} cm (diameter, motion between samples, and the margins of (26) of both); fewer or slower robots \
                 (`--pace slow`) need less",
                a + 1,
                b + 1
            ),
            Self::NoRoom { robots } => {
                write!(
                    f,
                    "no room was found for {robots} robots on {} x {} cm; `--pace slow` lets them be nearer",
                    SIZE[0], SIZE[1]
                )
            }
        }
    }
}

impl std::error::Error for Impossible {}
