//! The rows that changing constraints have, by the rules of a scenario.

use std::iter::zip;

use dpc_planar::need::{Clearance, Sum};
use dpc_planar::{Rule as _, Tangent, Turn};

use super::controllers::HalfSpace;
use super::scenario::Rule;
use crate::design::Design;

/// A row that holds with equality is drawn again though rounding would refuse it: less than what a controller accepts.
const ROUNDING: f64 = 5e-10;

/// What all members of a constraint draw from the references `newest` of all subsystems; `None` where the rule finds no row.
pub fn separation(design: &Design, rule: &Rule, members: &[usize], newest: &[Vec<f64>]) -> Option<HalfSpace> {
    match (rule, members) {
        (Rule::Apart { distance }, [first, second]) => {
            let line: Vec<f64> = zip(&newest[*first], &newest[*second]).map(|(a, b)| a - b).collect();
            let length = line.iter().map(|entry| entry * entry).sum::<f64>().sqrt();
            let normal: Vec<f64> = line.iter().map(|entry| entry / length).collect();
            (length > 0.0).then(|| apart(&normal, *distance))
        }
        (Rule::Tangent { distance, share }, [first, second]) => {
            let [one, other] = [first, second].map(|j| point(&newest[*j]));
            let margin = |normal: &[f64; 2]| (1.0 - ROUNDING) * margin(design, members, normal);
            let clearance = Clearance { distance: *distance, axes: [0.0; 2] };
            let tangent = Tangent { turn: Turn::CounterClockwise, share: *share };
            let row = tangent.row(&one?, &other?, &Sum(clearance, margin))?;
            Some(apart(&row.normal, *distance))
        }
        (Rule::Beyond { normal, bound }, _) => {
            Some(HalfSpace { normal: normal.iter().map(|entry| -entry).collect(), limit: -bound })
        }
        (Rule::Apart { .. } | Rule::Tangent { .. }, _) => None,
    }
}

/// normal . (y_first - y_second) >= bound.
fn apart(normal: &[f64], bound: f64) -> HalfSpace {
    let normal = normal.iter().map(|entry| -entry).chain(normal.iter().copied()).collect();
    HalfSpace { normal, limit: -bound }
}

fn point(y: &[f64]) -> Option<[f64; 2]> {
    y.try_into().ok()
}

/// What (26) takes of a row with this normal.
fn margin(design: &Design, members: &[usize], normal: &[f64; 2]) -> f64 {
    let generators = members.iter().flat_map(|j| &design.sizing.subsystems[*j].exposed.generators);
    generators.map(|g| (g[0] * normal[0] + g[1] * normal[1]).abs()).sum()
}
