//! What changing constraints need of Delta^chi: supports of [C_i 0] Delta_i^chi in rows over the outputs.
//!
//! A fixed row of (3) needs one support value. A row that is drawn later may point anywhere, so the set itself is needed, or one
//! around it that is easily evaluated: a sum of segments (see [`crate::convex::Zonotope`]). Supports in a few directions make one.

use std::f64::consts::PI;

use nalgebra::DVector;

use crate::convex::{ANGLES, Zonotope};
use crate::network::Subsystem;
use crate::optim::rounding::sum_upper;

/// Supports in rows over the outputs of one subsystem.
#[derive(Debug, Clone, Default)]
pub struct OutputShares {
    /// One per output, the row that reads it alone. None where the subsystem is in no changing constraint.
    pub axes: Vec<OutputShare>,
    /// Of two outputs those in between: angle k pi / [`ANGLES`] (axes left out) where the two supports per unit of epsilon count
    /// as one unit. Only in designs, not where gains are compared.
    pub oblique: Vec<OutputShare>,
}

/// What (26) takes of a row over the outputs before Z_i, in either direction.
#[derive(Debug, Clone)]
pub struct OutputShare {
    /// Over the outputs.
    pub row: DVector<f64>,
    /// Support of Delta_i^chi, per unit of epsilon.
    pub rate: f64,
    /// Transients of the loads.
    pub load: f64,
    /// Transient of a start that drifts as far as a design may allow.
    pub drift: f64,
}

impl OutputShares {
    /// Holds [C_i 0] Delta_i^chi at an epsilon, with what loads and the start add to it.
    pub fn set(&self, epsilon: f64) -> Zonotope {
        let half: Vec<f64> = self.axes.iter().map(|share| share.taken(epsilon)).collect();
        match (&self.axes[..], self.oblique.len() + 2 == ANGLES) {
            ([one, other], true) => {
                let units = [one.rate, other.rate];
                let oblique = |k: usize| self.oblique[k].taken(epsilon);
                let support = |k: usize| match k {
                    0 => half[0] / units[0],
                    k if 2 * k < ANGLES => oblique(k - 1),
                    k if 2 * k == ANGLES => half[1] / units[1],
                    k => oblique(k - 2),
                };
                Zonotope::around(&std::array::from_fn(support), units)
            }
            _ => Zonotope::boxed(&half),
        }
    }
}

impl OutputShare {
    /// Upper bound at an epsilon.
    pub fn taken(&self, epsilon: f64) -> f64 {
        sum_upper([epsilon * self.rate, self.constant()])
    }

    /// The part that does not depend on epsilon.
    pub fn constant(&self) -> f64 {
        sum_upper([self.load, self.drift])
    }
}

/// One row per output.
pub fn axes(s: &Subsystem) -> Vec<DVector<f64>> {
    (0..s.p()).map(|k| DVector::from_fn(s.p(), |r, _| f64::from(r == k))).collect()
}

/// The rows between the axes of two outputs with these supports.
pub fn oblique(supports: [f64; 2]) -> Vec<DVector<f64>> {
    let row = |k: usize| {
        let angle = k as f64 * PI / ANGLES as f64;
        DVector::from_vec(vec![angle.cos() / supports[0], angle.sin() / supports[1]])
    };
    (1..ANGLES).filter(|k| 2 * k != ANGLES).map(row).collect()
}
