use nalgebra::DVector;

use super::Polytope;
use crate::optim::lp::{self, Outcome};
use crate::optim::rounding::sum_upper;

/// A polytope {H w <= h}, h >= 0, with a box around it. It may be flat, and need not be symmetric.
#[derive(Debug, Clone)]
pub struct Bounded {
    pub set: Polytope,
    /// |w_k| <= hull_k.
    pub hull: DVector<f64>,
}

impl Bounded {
    /// # Errors
    /// The axis and sign in which no row bounds the set.
    pub fn new(set: Polytope) -> Result<Self, (usize, f64)> {
        let n = set.H.ncols();
        let axes = (0..n).flat_map(|k| [(k, 1.0), (k, -1.0)]);
        let axes = axes.map(|(k, sign)| {
            let axis = DVector::from_fn(n, |j, _| if j == k { sign } else { 0.0 });
            certificate(&set, &axis).ok_or((k, sign)).map(|y| (k, axis, y))
        });
        let proofs = axes.collect::<Result<Vec<_>, _>>()?;
        let mut first = DVector::zeros(n);
        proofs.iter().for_each(|(k, _, y)| first[*k] = f64::max(first[*k], y.dot(&set.h)));
        // What is left of H'y = d acts on the hull itself, and is far too small to double it: twice the first bound is a
        // hull, and with it the residuals are accounted for. (An axis that the set is flat in gets the others' share.)
        let twice: DVector<f64> = first * 2.0;
        let mut hull = DVector::zeros(n);
        proofs.iter().for_each(|(k, axis, y)| hull[*k] = f64::max(hull[*k], proved(&set, axis, y, &twice)));
        Ok(Self { set, hull })
    }

    /// Upper bound of |d'w| over the set, rounding included: the support of its symmetric hull.
    pub fn reach(&self, d: &DVector<f64>) -> f64 {
        let by_hull = sum_upper(d.iter().zip(&self.hull).map(|(d, w)| d.abs() * w));
        let one_way = |d: &DVector<f64>| {
            let Some(y) = certificate(&self.set, d) else { return by_hull };
            proved(&self.set, d, &y, &self.hull)
        };
        one_way(d).max(one_way(&-d)).min(by_hull)
    }
}

/// Upper bound of d'w over the set by y >= 0: h'y, and what is left of H'y = d on a hull.
fn proved(set: &Polytope, d: &DVector<f64>, y: &DVector<f64>, hull: &DVector<f64>) -> f64 {
    let left = d - set.H.tr_mul(y);
    let size = d.abs() + set.H.abs().tr_mul(y);
    let rounding = left.abs() + size * (4.0 * (y.len() + 4) as f64 * f64::EPSILON);
    let main = y.iter().zip(&set.h).map(|(y, h)| y * h);
    sum_upper(main.chain(rounding.iter().zip(hull).map(|(r, w)| r * w)))
}

/// y >= 0 with H'y = d and h'y smallest: the proof that d'w <= h'y. `None` where the set has no bound in direction d.
fn certificate(set: &Polytope, d: &DVector<f64>) -> Option<DVector<f64>> {
    // The solver's tolerances are absolute: it sees a unit direction and unit limits.
    let (size, limit) = (d.amax(), set.h.amax());
    if size == 0.0 {
        return Some(DVector::zeros(set.h.len()));
    }
    let cost = if limit > 0.0 { &set.h / limit } else { set.h.clone() };
    match lp::minimise(&cost, &set.H.transpose(), &(d / size)) {
        Outcome::Optimal(solution) => Some(solution.y * size),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;

    fn polytope(rows: &[[f64; 2]], h: &[f64]) -> Polytope {
        Polytope { H: DMatrix::from_fn(rows.len(), 2, |r, c| rows[r][c]), h: DVector::from_column_slice(h) }
    }

    #[test]
    fn reach_is_the_larger_of_both_ways() {
        let set = Bounded::new(polytope(&[[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]], &[0.3, 0.1, 0.0, 0.0]));
        let set = set.unwrap();
        for (d, reach) in [([1.0, 5.0], 0.3), ([-2.0, 0.0], 0.6), ([0.0, 1.0], 0.0)] {
            let found = set.reach(&DVector::from_column_slice(&d));
            assert!(found >= reach && found <= reach * (1.0 + 1e-8), "{found} {reach}");
        }
    }

    #[test]
    fn a_slanted_set_is_smaller_than_its_hull() {
        let rows = [[1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0]];
        let set = Bounded::new(polytope(&rows, &[1e-3; 4])).unwrap();
        let reach = set.reach(&DVector::from_column_slice(&[1.0, 1.0]));
        assert!((set.hull.amax() - 1e-3).abs() < 1e-11 && (1e-3..1.001e-3).contains(&reach), "{reach}");
    }

    #[test]
    fn the_open_direction_is_named() {
        let set = polytope(&[[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0]], &[1.0; 3]);
        assert_eq!(Bounded::new(set).err(), Some((1, -1.0)));
    }
}
