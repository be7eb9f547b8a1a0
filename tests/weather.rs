//! Disturbances, measurement errors and loads step by step, at what their bounds allow and chosen against the controllers.
#![expect(non_snake_case, reason = "the paper's symbols")]

use nalgebra::{DMatrix, DVector};

use crate::Random;
use crate::unknowns::Unknowns;

/// What acts on one subsystem in one step.
#[derive(Debug, Clone)]
pub struct Nuisance {
    /// Added to the next state.
    pub w: DVector<f64>,
    /// Added to what the controller is told of the state.
    pub v: DVector<f64>,
}

impl Nuisance {
    pub fn none(n: usize) -> Self {
        Self { w: DVector::zeros(n), v: DVector::zeros(n) }
    }
}

/// Chooses w and v of one subsystem; changes its way every 1 to 60 steps.
#[derive(Debug, Clone)]
pub struct Adversary {
    way: Way,
    steps: usize,
}

#[derive(Debug, Clone)]
enum Way {
    /// Random corners in every step.
    Corners,
    /// The same corners.
    Held(Nuisance),
    /// Along a normal of E_i, v through K_i likewise.
    Push(DVector<f64>),
    /// The same w, and v as far as it can hide where x - xhat is.
    Hide(DVector<f64>),
    /// Along a normal and back, with this period.
    Swing(DVector<f64>, usize),
}

impl Adversary {
    pub const NEW: Self = Self { way: Way::Corners, steps: 0 };

    /// What acts now: `normals` are those of E_i, `BK` is B_ii K_i, `off` is x - xhat as it was forecast.
    pub fn choose(
        &mut self,
        unknowns: &Unknowns,
        normals: &DMatrix<f64>,
        BK: &DMatrix<f64>,
        off: &DVector<f64>,
        random: &mut Random,
    ) -> Nuisance {
        if self.steps == 0 {
            self.way = new_way(unknowns, normals, random);
            self.steps = 1 + random.below(60);
        }
        self.steps -= 1;
        let push = |p: &DVector<f64>| unknowns.worst_w(p).clone();
        let through_gain = |p: &DVector<f64>| unknowns.error_along(&BK.tr_mul(p));
        match &self.way {
            Way::Corners => corner(unknowns, random),
            Way::Held(nuisance) => nuisance.clone(),
            Way::Push(p) => Nuisance { w: push(p), v: through_gain(p) },
            Way::Hide(p) => Nuisance { w: push(p), v: unknowns.error_along(&-off) },
            Way::Swing(p, period) => {
                let p = if (self.steps / period).is_multiple_of(2) { p.clone() } else { -p };
                Nuisance { w: push(&p), v: through_gain(&p) }
            }
        }
    }
}

fn new_way(unknowns: &Unknowns, normals: &DMatrix<f64>, random: &mut Random) -> Way {
    let p = normals.row(random.below(normals.nrows())).transpose() * random.sign();
    match random.below(6) {
        0 => Way::Corners,
        1 => Way::Held(corner(unknowns, random)),
        2 | 3 => Way::Push(p),
        4 => Way::Hide(p),
        _ => Way::Swing(p, 1 + random.below(20)),
    }
}

fn corner(unknowns: &Unknowns, random: &mut Random) -> Nuisance {
    let w = unknowns.corners[random.below(unknowns.corners.len())].clone();
    Nuisance { w, v: unknowns.error.map(|v| v * random.sign()) }
}

/// How loads go on.
#[derive(Debug, Clone, PartialEq)]
pub enum Course {
    /// Bounds and rates kept: to an end, at rest, or to and fro, each load for itself.
    Free,
    /// At full rate in these directions.
    Towards(DVector<f64>),
    /// Now and then a jump, perhaps out of the bounds; at rest otherwise.
    Breaking,
    Rest,
}

/// The loads of one subsystem from step to step.
#[derive(Debug, Clone)]
pub struct Inflow {
    moves: Vec<Move>,
    /// Now.
    pub d: DVector<f64>,
}

#[derive(Debug, Clone, Copy)]
enum Move {
    To(f64),
    Rest,
    Shake,
}

impl Inflow {
    /// At rest somewhere inside the bounds, often at an end.
    pub fn new(unknowns: &Unknowns, random: &mut Random) -> Self {
        let place = |load: &crate::unknowns::Load| match random.below(3) {
            0 => load.min,
            1 => load.max,
            _ => random.between(load.min, load.max),
        };
        let d = DVector::from_vec(unknowns.loads.iter().map(place).collect::<Vec<_>>());
        Self { moves: vec![Move::Rest; d.len()], d }
    }

    /// One step on.
    pub fn advance(&mut self, unknowns: &Unknowns, course: &Course, random: &mut Random) {
        for (k, load) in unknowns.loads.iter().enumerate() {
            let side = match course {
                Course::Rest => continue,
                Course::Towards(direction) => direction[k].signum(),
                Course::Breaking => {
                    if random.chance(0.03) {
                        let width = load.max - load.min;
                        self.d[k] = random.between(load.min - 0.5 * width, load.max + 0.5 * width);
                    }
                    continue;
                }
                Course::Free => {
                    if random.chance(0.04) {
                        self.moves[k] = [Move::To(1.0), Move::To(-1.0), Move::Rest, Move::Shake][random.below(4)];
                    }
                    match self.moves[k] {
                        Move::To(side) => side,
                        Move::Shake => random.sign(),
                        Move::Rest => continue,
                    }
                }
            };
            self.d[k] = (self.d[k] + side * load.rate).clamp(load.min, load.max);
        }
    }
}
