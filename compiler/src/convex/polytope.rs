#![expect(non_snake_case, reason = "the symbols of the literature")]

use nalgebra::{DMatrix, DVector};

use crate::optim::lp::{self, Outcome, Solution};
use crate::optim::rounding::{dot_upper, sum_upper};

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
    /// The value is h'y for y >= 0 with H'y = d up to rounding: an upper bound but for what [`Polytope::bound`] adds.
    pub fn support(&self, d: &DVector<f64>) -> Option<(f64, DVector<f64>)> {
        self.solve(d).map(|solution| (solution.value, solution.x))
    }

    /// Upper bound of d'x over the polytope, which lies in |x| <= hull (entries may be infinite).
    ///
    /// d'x = y'Hx + (d - H'y)'x <= h'y + |d - H'y|' hull for any y >= 0.
    pub fn bound(&self, d: &DVector<f64>, hull: &DVector<f64>) -> Option<f64> {
        let y = self.solve(d)?.y;
        let on_hull = (0..d.len()).map(|k| {
            let terms: Vec<f64> = self.H.column(k).component_mul(&y).iter().copied().chain([-d[k]]).collect();
            let size: f64 = terms.iter().map(|term| term.abs()).sum();
            let residual = terms.iter().sum::<f64>().abs() + 2.0 * (terms.len() + 2) as f64 * f64::EPSILON * size;
            if size == 0.0 { 0.0 } else { residual * hull[k] }
        });
        let main = dot_upper(self.h.iter().zip(y.iter()));
        let bound = sum_upper(std::iter::once(main).chain(on_hull));
        (!bound.is_nan()).then_some(bound)
    }

    /// Half-widths of a box around the polytope; infinite where none was found.
    pub fn hull(&self) -> DVector<f64> {
        let n = self.H.ncols();
        let reach = |k: usize, sign: f64| {
            let axis = DVector::from_fn(n, |j, _| if j == k { sign } else { 0.0 });
            self.solve(&axis).map_or(f64::INFINITY, |solution| solution.value)
        };
        // The residuals of these values are at rounding level: twice the value covers them.
        DVector::from_fn(n, |k, _| 2.0 * reach(k, 1.0).max(reach(k, -1.0)))
    }

    fn solve(&self, d: &DVector<f64>) -> Option<Solution> {
        match lp::minimise(&self.h, &self.H.transpose(), d) {
            Outcome::Optimal(solution) => Some(solution),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// {x_1 <= 1} does not bound x_1 + 2e-10 x_2, however small the second coefficient is.
    #[test]
    fn a_residual_on_an_unbounded_coordinate_is_no_bound() {
        let halfplane = Polytope { H: DMatrix::from_row_slice(1, 2, &[1.0, 0.0]), h: DVector::from_element(1, 1.0) };
        let hull = halfplane.hull();
        assert!(halfplane.bound(&DVector::from_vec(vec![1.0, 2e-10]), &hull).is_none_or(f64::is_infinite));
        assert!(
            halfplane.bound(&DVector::from_vec(vec![1.0, 0.0]), &DVector::from_vec(vec![9.0, f64::INFINITY])).unwrap()
                < 1.1
        );
    }

    #[test]
    fn the_bound_is_next_to_the_support_value() {
        let H = DMatrix::from_row_slice(4, 2, &[1.0, 0.3, -1.0, 0.1, 0.2, 1.0, -0.3, -1.0]);
        let polytope = Polytope { H, h: DVector::from_vec(vec![1.0, 2.0, 1.5, 0.5]) };
        let d = DVector::from_vec(vec![0.7, -0.4]);
        let (value, maximiser) = polytope.support(&d).unwrap();
        let bound = polytope.bound(&d, &polytope.hull()).unwrap();
        assert!(polytope.violation(&maximiser) < 1e-12 && (d.dot(&maximiser) - value).abs() < 1e-12);
        assert!(value <= bound && bound < value + 1e-12);
    }
}
