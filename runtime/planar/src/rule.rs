//! How a pair comes to its row.

use crate::cone::Cone;
use crate::need::Need;
use crate::row::Row;

/// Chooses a normal n with n'(y_first - y_second) >= need(n).
///
/// The row is a function of the arguments alone, computed with operations that IEEE 754 rounds exactly: whoever calls
/// with the same two positions in the same order (that of the network) gets the same bits, on any machine. Exchanging
/// the two gives the opposite normal, bit for bit, if need(-n) = need(n).
pub trait Rule {
    /// The row for reference positions `first` and `second`. It holds for them with 16 machine epsilons, relative to the numbers
    /// in it, to spare. `None` if no normal is admissible, if the positions coincide, or if something is not finite.
    fn row(&self, first: &[f64; 2], second: &[f64; 2], need: &impl Need) -> Option<Row>;
}

/// The tangent-line rule of Section V, as one rule for both: the extreme admissible rotation of the normal, to the
/// same side for all. (The paper lets each robot draw its own tangent, which has no proof.)
///
/// With `share` = 0, the paper's rule, the row is active where it is drawn: (28) then leaves no room towards the other body, and
/// all of it along the line, which far away points nearly at the other body, so that the two slide past one another. For a round
/// need, d, the line touches the circle of radius d around the other body. The price: a body whose goal is across such a
/// line waits there, however far the other one is, until the other one's motion turns the line. A `share` between 0.1 and 0.3 leaves room in
/// proportion to how far apart the two are, and the extreme rotation where they meet: most random scenarios get through with it
/// in which the paper's rule stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tangent {
    pub turn: Turn,
    /// In [0, 1): part of the greatest slack over all normals that the row must leave. 0 is the paper's rule. There is no row for any other number.
    pub share: f64,
}

/// To which side the normal is turned, seen from the line of centres.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Turn {
    /// Bodies that meet pass each other on the right-hand side of the way, as in right-hand traffic.
    CounterClockwise,
    /// Left-hand traffic.
    Clockwise,
}

/// The normal along the line of centres, or the admissible one nearest to it: the buffered Voronoi cell for two bodies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LineOfCentres;

impl Tangent {
    /// The paper's rule.
    pub const fn new(turn: Turn) -> Self {
        Self { turn, share: 0.0 }
    }
}

impl Rule for Tangent {
    fn row(&self, first: &[f64; 2], second: &[f64; 2], need: &impl Need) -> Option<Row> {
        let cone = (0.0..1.0).contains(&self.share).then(|| Cone::new(first, second, need))??;
        let side = match self.turn {
            Turn::CounterClockwise => 1.0,
            Turn::Clockwise => -1.0,
        };
        let cone = if self.share > 0.0 { cone.leaving(self.share) } else { cone };
        Some(cone.row(cone.extreme(side)))
    }
}

impl Rule for LineOfCentres {
    fn row(&self, first: &[f64; 2], second: &[f64; 2], need: &impl Need) -> Option<Row> {
        let cone = Cone::new(first, second, need)?;
        Some(cone.row(cone.nearest()))
    }
}
