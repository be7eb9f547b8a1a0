//! Rules with the needs of a robot, as a controller would call them.

use dpc_planar::unicycle::{Follower, Input, Motion, Parabola, Wheels};
use dpc_planar::{Arena, Clearance, LineOfCentres, Obstacle, Row, Rule, Sum, Tangent, Wall, Zonotope};

type Needs<'a> = Sum<Clearance, Zonotope<'a>>;

pub fn tangent(rule: &Tangent, first: &[f64; 2], second: &[f64; 2], need: &Needs<'_>) -> Option<Row> {
    rule.row(first, second, need)
}

pub fn line_of_centres(first: &[f64; 2], second: &[f64; 2], margin: &dyn Fn(&[f64; 2]) -> f64) -> Option<Row> {
    LineOfCentres.row(first, second, &margin)
}

pub fn obstacle(disc: &Obstacle, rule: &Tangent, y: &[f64; 2], need: &Needs<'_>) -> Option<Row> {
    disc.row(rule, y, need)
}

pub fn wall(wall: &Wall, need: &Needs<'_>) -> Option<Row> {
    wall.row(need)
}

pub fn arena(arena: &Arena, need: &Needs<'_>) -> (Option<Arena>, [Wall; 4]) {
    (arena.within(need), arena.walls())
}

pub fn sag(acceleration: [f64; 2], period: f64) -> [f64; 2] {
    dpc_planar::sag::sag(acceleration, period)
}

pub fn command(
    follower: &Follower,
    parabola: &Parabola,
    period: f64,
    time: f64,
    measured: &Motion,
) -> (Option<Wheels>, [f64; 4]) {
    (follower.command(parabola, period, time, measured), measured.state())
}

pub fn linearised(heading: [f64; 2], speed: f64, acceleration: [f64; 2]) -> Option<[f64; 2]> {
    Input::linearising(heading, speed, acceleration).map(|input| input.acceleration(heading, speed))
}
