//! How two robots come to the half-plane between them.

use dpc_planar::need::{Clearance, Need, Sum};
use dpc_planar::{LineOfCentres, Row, Rule as _, Tangent, Turn};
use dpc_runtime::{HalfSpace, Meeting};

use crate::arena::Point;

/// A row that holds with equality is drawn again though rounding would refuse it: less than what a controller accepts.
const ROUNDING: f64 = 5e-10;

/// The rule of a pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rule {
    Tangent(Tangent),
    LineOfCentres,
}

impl Rule {
    /// The paper's rule, keeping a fifth of the room there is.
    pub const TANGENT: Self = Self::Tangent(Tangent { turn: Turn::CounterClockwise, share: 0.2 });
    /// The paper's rule to the letter.
    pub const PLAIN: Self = Self::Tangent(Tangent::new(Turn::CounterClockwise));

    pub fn name(self) -> String {
        match self {
            Self::Tangent(Tangent { share: 0.0, .. }) => "tangent, all of the room taken".to_owned(),
            Self::Tangent(Tangent { share, .. }) => format!("tangent, {:.0} % of the room kept", 100.0 * share),
            Self::LineOfCentres => "line of centres".to_owned(),
        }
    }

    /// The row that both of a pair draw, whose true positions at the samples are to keep `clearance`.
    pub fn draw<const NJ: usize>(
        self,
        meeting: &Meeting<'_, 2, NJ>,
        clearance: &Clearance,
    ) -> Option<HalfSpace<2, NJ>> {
        let pair = meeting.pair()?;
        let margin = |normal: &Point| (1.0 - ROUNDING) * pair.margin(normal);
        let row = self.row(&pair.first, &pair.second, &Sum(*clearance, margin))?;
        Some(pair.apart(&row.normal, clearance.need(&row.normal)))
    }

    /// The row of two reference positions that need to be `need` apart.
    pub fn row(self, first: &Point, second: &Point, need: &impl Need) -> Option<Row> {
        match self {
            Self::Tangent(tangent) => tangent.row(first, second, need),
            Self::LineOfCentres => LineOfCentres.row(first, second, need),
        }
    }
}
