//! A body that does not move.

use crate::need::Need;
use crate::row::Row;
use crate::rule::Rule;
use crate::vector::dot;

/// A disc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Obstacle {
    pub centre: [f64; 2],
    /// At least 0.
    pub radius: f64,
}

impl Obstacle {
    /// The row n'y >= radius + need(n) + n'centre on the reference position `y` of one body, whose own need is `need`; by the rule, as
    /// if the body were the first of a pair and the disc's centre the second. `None` as there.
    ///
    /// For a controller of dpc-runtime, whose changing constraint has this one member, and which takes the margins off itself:
    ///
    /// ```ignore
    /// let y = meeting.outputs().next()?.try_into().ok()?;
    /// let need = Sum(clearance, |n: &[f64; 2]| meeting.margin(&meeting.beyond(n, 0.0)));
    /// let normal = obstacle.row(&rule, &y, &need)?.normal;
    /// Some(meeting.beyond(&normal, obstacle.bound(&normal, &clearance)))
    /// ```
    pub fn row(&self, rule: &impl Rule, y: &[f64; 2], need: &impl Need) -> Option<Row> {
        let row = rule.row(y, &self.centre, &|normal: &[f64; 2]| self.radius + need.need(normal))?;
        Some(Row { bound: row.bound + dot(row.normal, self.centre), ..row })
    }

    /// What normal'y must at least be for true positions that keep `clearance` from the disc: without margins.
    pub fn bound(&self, normal: &[f64; 2], clearance: &impl Need) -> f64 {
        self.radius + clearance.need(normal) + dot(*normal, self.centre)
    }
}
