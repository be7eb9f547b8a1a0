#![expect(non_snake_case, reason = "the symbols of the literature")]

use nalgebra::{DMatrix, DVector};

use crate::optim::lp::{self, Outcome};

/// {x : H x <= h}.
#[derive(Debug, Clone, PartialEq)]
pub struct Polytope {
    pub H: DMatrix<f64>,
    pub h: DVector<f64>,
}

impl Polytope {
    /// Largest violation of a row at x; not positive where x is inside.
    pub fn violation(&self, x: &DVector<f64>) -> f64 {
        (&self.H * x - &self.h).iter().copied().fold(f64::NEG_INFINITY, f64::max)
    }

    /// Largest d'x over the polytope as (value, maximiser); `None` where it is unbounded, empty or not found.
    ///
    /// The value is h'y for dual-feasible y up to rounding, hence not below the true support value.
    pub fn support(&self, d: &DVector<f64>) -> Option<(f64, DVector<f64>)> {
        match lp::minimise(&self.h, &self.H.transpose(), d) {
            Outcome::Optimal(solution) => Some((solution.value, solution.x)),
            _ => None,
        }
    }
}
