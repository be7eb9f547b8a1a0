//! Spectral radii of sparse non-negative matrices, with their proof.
#![expect(non_snake_case, reason = "the symbols of the literature")]

use nalgebra::DVector;

use super::sparse::Sparse;

/// w > 0 and `radius` with S w <= radius w entrywise, so that the spectral radius of S >= 0 is at most `radius` (Collatz and
/// Wielandt); rounding is included.
#[derive(Debug, Clone)]
pub struct Perron {
    pub w: DVector<f64>,
    pub radius: f64,
}

impl Perron {
    /// The best of a power iteration; infinite where an entry of S is not finite.
    pub fn new(S: &Sparse) -> Self {
        let mut w = DVector::from_element(S.nrows(), 1.0);
        let mut best = Self { radius: bound(S, &w), w: w.clone() };
        let mut settled = 0;
        while settled < PATIENCE && best.radius.is_finite() && best.radius > 0.0 {
            // Half a step of the identity makes the iteration converge on periodic loops too.
            let next = S.times(&w) / best.radius + &w;
            let size = next.amax();
            // Where no loop passes, the vector would vanish.
            w = next.map(|entry| (entry / size).max(LEAST));
            let radius = bound(S, &w);
            settled = if radius < best.radius * (1.0 - 1e-6) { 0 } else { settled + 1 };
            if radius < best.radius {
                best = Self { w: w.clone(), radius };
            }
        }
        best
    }
}

/// Steps without progress after which the iteration ends.
const PATIENCE: usize = 60;
/// Smallest entry of w, relative to the largest.
const LEAST: f64 = 1e-6;

fn bound(S: &Sparse, w: &DVector<f64>) -> f64 {
    let rounding = 1.0 + 4.0 * (S.longest_row() + 4) as f64 * f64::EPSILON;
    let rows = S.times(w);
    if rows.iter().any(|row| !row.is_finite()) {
        return f64::INFINITY;
    }
    rows.iter().zip(w).fold(0.0, |radius, (row, w)| f64::max(radius, row / w * rounding))
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;
    use crate::optim::lyapunov::spectral_radius;

    fn sparse(rows: usize, values: &[f64]) -> Sparse {
        Sparse::from_blocks(rows, rows, [((0, 0), &DMatrix::from_row_slice(rows, rows, values))])
    }

    #[test]
    fn the_bound_is_next_to_the_radius() {
        let periodic = sparse(2, &[0.0, 2.0, 0.5, 0.0]);
        let cyclic = sparse(3, &[0.0, 3.0, 0.0, 0.0, 0.1, 1.0, 0.2, 0.0, 0.0]);
        for S in [periodic, cyclic] {
            let (radius, bound) = (spectral_radius(&S.to_dense()), Perron::new(&S).radius);
            assert!(radius <= bound && bound < radius * (1.0 + 1e-4), "{radius} {bound}");
        }
    }

    #[test]
    fn without_loops_the_bound_comes_close_to_zero() {
        let S = sparse(3, &[0.0, 5.0, 0.0, 0.0, 0.0, 7.0, 0.0, 0.0, 0.0]);
        assert!(Perron::new(&S).radius < 0.1);
        assert_eq!(Perron::new(&Sparse::from_blocks(0, 0, [])).radius, 0.0);
    }
}
