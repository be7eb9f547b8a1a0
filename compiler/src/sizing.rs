//! Steps 3 and 4: one convex program chooses the size of every set.
#![expect(non_snake_case, reason = "the paper's symbols")]

use nalgebra::DVector;

use crate::convex::{Box, Polytope, Strips};

/// After this point: (21), (22), (25a), (25b), (26) hold with the recorded slack, which is never negative, and no
/// set is empty.
#[derive(Debug)]
pub struct Sizing {
    /// Radius of the ball in (6).
    pub epsilon: f64,
    pub subsystems: Vec<SubsystemSizing>,
    /// The tightened limits of (26), per coupling constraint.
    pub l_tilde: Vec<f64>,
    /// Every inclusion that Theorem 1 leans on, with what is left of it.
    pub slacks: Vec<Slack>,
    /// What a larger reserve would cost, for the summary: the chosen point is one of them.
    pub trade: Vec<TradePoint>,
}

#[derive(Debug)]
pub struct SubsystemSizing {
    /// Half-widths of the box Z_i.
    pub zeta: DVector<f64>,
    /// Half-widths of the box Delta_i^z.
    pub dz: DVector<f64>,
    /// The RPI set calE_i of (18).
    pub E: Strips,
    /// Sigma_i, positively invariant for (24).
    pub Sigma: Strips,
    /// Xhat_i: the rows of X_i, tightened.
    pub X_nom: Polytope,
    /// Uhat_i: the rows of U_i, tightened.
    pub U_nom: Polytope,
    /// Y_i.
    pub Y: Box,
}

/// What is left of one inequality after rounding.
#[derive(Debug, Clone)]
pub struct Slack {
    /// Equation number in the paper: `(21)`.
    pub equation: &'static str,
    /// In the user's names: `left: h1 <= 27.6 cm`.
    pub what: String,
    /// Right side minus an upper bound of the left side, in the row's own unit; never negative.
    pub value: f64,
}

/// One point of the trade of reserve against set-points.
#[derive(Debug, Clone)]
pub struct TradePoint {
    /// Factor on the chosen Delta_i^z.
    pub reserve: f64,
    /// Volume of the product of the Y_i, relative to the chosen one; `None` where no design exists.
    pub y_volume: Option<f64>,
    /// Epsilon at that point.
    pub epsilon: f64,
}
