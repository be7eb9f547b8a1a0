//! The admissible normals of a pair.

use crate::need::Need;
use crate::row::Row;
use crate::vector::{add_scaled, cross, dot, length, quarter_turn, scaled, subtract, sum_of_magnitudes, unit};

/// A row counts as satisfied with this much to spare, relative to the numbers in it, so that it is also found satisfied by who
/// adds them up in another order.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Halvings of a bracket of directions a right angle wide: below the spacing of the unit vectors.
const BISECTIONS: usize = 64;

/// Steps of golden section over a right angle: 0.618^80 < 2e-17.
const SECTIONS: usize = 80;

/// (sqrt(5) - 1) / 2.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// The normals n with slack n'(y_first - y_second) - need(n) >= `reserve`, rounding included. Slack is concave and positively
/// homogeneous in n, so they are an arc; with a positive need, one within the open half-turn around the line of centres.
pub(crate) struct Cone<'a, F> {
    need: &'a F,
    apart: [f64; 2],
    /// Unit vector from second to first.
    centre: [f64; 2],
    /// Of the numbers that rounding is relative to.
    magnitude: f64,
    reserve: f64,
    /// One of the admissible normals.
    inside: [f64; 2],
}

/// Directions between two, less than half a turn apart, by convex combination: along them a concave and positively
/// homogeneous function stays concave.
struct Segment {
    from: [f64; 2],
    to: [f64; 2],
}

impl<'a, F: Need> Cone<'a, F> {
    /// `None` if no normal is admissible, the positions coincide, or something is not finite.
    pub fn new(first: &[f64; 2], second: &[f64; 2], need: &'a F) -> Option<Self> {
        let apart = subtract(*first, *second);
        let centre = unit(apart)?;
        let magnitude = sum_of_magnitudes(*first) + sum_of_magnitudes(*second);
        let cone = Self { need, apart, centre, magnitude, reserve: 0.0, inside: centre };
        let inside = if cone.admits(centre) { centre } else { cone.beside_centre()? };
        Some(Self { inside, ..cone })
    }

    /// The normals that leave `share` of the greatest slack.
    pub fn leaving(&self, share: f64) -> Self {
        let arc = Segment { from: self.extreme(-1.0), to: self.extreme(1.0) };
        let highest = highest(&arc, |way| unit(way).map_or(f64::NEG_INFINITY, |normal| self.slack(normal)));
        let inside = if self.slack(highest) >= self.slack(self.inside) { highest } else { self.inside };
        Self { reserve: share * self.slack(inside), inside, ..*self }
    }

    /// The admissible normal nearest to the line of centres.
    pub fn nearest(&self) -> [f64; 2] {
        self.last_towards(&Segment { from: self.inside, to: self.centre })
    }

    /// The admissible normal turned furthest counter-clockwise (`side` = 1) or clockwise (-1).
    pub fn extreme(&self, side: f64) -> [f64; 2] {
        let across = scaled(quarter_turn(self.centre), side);
        if side * cross(self.centre, self.inside) >= 0.0 {
            self.last_towards(&Segment { from: self.inside, to: across })
        } else if self.admits(self.centre) {
            self.last_towards(&Segment { from: self.centre, to: across })
        } else {
            self.nearest()
        }
    }

    /// n'(y_first - y_second) >= need(n).
    pub fn row(&self, normal: [f64; 2]) -> Row {
        Row { normal, bound: self.need.need(&normal) }
    }

    /// An admissible normal on one side of the line of centres, which is none.
    fn beside_centre(&self) -> Option<[f64; 2]> {
        let per_length = |way| unit(way).map_or(f64::NEG_INFINITY, |normal| length(way) * self.slack(normal));
        let on_side = |side| {
            let across = scaled(quarter_turn(self.centre), side);
            let highest = highest(&Segment { from: self.centre, to: across }, per_length);
            self.admits(highest).then_some(highest)
        };
        on_side(1.0).or_else(|| on_side(-1.0))
    }

    fn admits(&self, normal: [f64; 2]) -> bool {
        self.slack(normal) >= self.reserve
    }

    fn slack(&self, normal: [f64; 2]) -> f64 {
        let need = self.need.need(&normal);
        dot(normal, self.apart) - need - ROUNDING * (self.magnitude + need.abs())
    }

    /// The last admissible normal on the way from one to a direction that may not be.
    fn last_towards(&self, segment: &Segment) -> [f64; 2] {
        if self.admits(segment.to) {
            return segment.to;
        }
        let (mut admitted, mut refused) = (0.0, 1.0);
        let mut last = segment.from;
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (admitted + refused);
            match unit(segment.at(middle)) {
                Some(normal) if self.admits(normal) => (admitted, last) = (middle, normal),
                _ => refused = middle,
            }
        }
        last
    }
}

impl Segment {
    fn at(&self, s: f64) -> [f64; 2] {
        add_scaled(self.from, s, subtract(self.to, self.from))
    }
}

/// The unit vector on the segment where `value`, which rises and then falls, is highest.
fn highest(segment: &Segment, value: impl Fn([f64; 2]) -> f64) -> [f64; 2] {
    let at = |s: f64| value(segment.at(s));
    let (mut low, mut high) = (0.0, 1.0);
    let (mut left, mut right) = (1.0 - GOLDEN, GOLDEN);
    let (mut at_left, mut at_right) = (at(left), at(right));
    for _ in 0..SECTIONS {
        if at_left >= at_right {
            (high, right, at_right) = (right, left, at_left);
            left = high - GOLDEN * (high - low);
            at_left = at(left);
        } else {
            (low, left, at_left) = (left, right, at_right);
            right = low + GOLDEN * (high - low);
            at_right = at(right);
        }
    }
    unit(segment.at(if at_left >= at_right { left } else { right })).unwrap_or(segment.from)
}
