//! Starting from a steady state.

use super::factor::Factor;
use super::linear::{add_scaled, dot, finite, subtract, times};
use super::tables::Model;
use super::{Real, precision};
use crate::refusal::StartError;

/// A state and an input that the subsystem can stay at, together with its neighbours at theirs, to within
/// [`Model::drift`] per step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteadyState<const NX: usize, const NU: usize> {
    pub x: [Real; NX],
    /// The references start with what (7f) makes of it: this up to rounding.
    pub u: [Real; NU],
}

/// Largest residual of an input in u = Kx x + Ke eref, relative to the sum of the magnitudes of its terms.
const REACHED: Real = precision::KEPT;

impl<const NX: usize, const NU: usize> SteadyState<NX, NU> {
    /// eref of (7f): least squares in u = Kx x + Ke eref, solved exactly or not at all.
    pub(crate) fn error_sum<const NY: usize, const NZ: usize, const NI: usize>(
        &self,
        model: &Model<NX, NU, NY, NZ, NI>,
    ) -> Result<[Real; NY], StartError> {
        let feedback = times(&model.Kx, &self.x);
        let wanted = subtract(&self.u, &feedback);
        let normal = NormalEquations::new(&model.Ke).ok_or(StartError::InputOutOfReach)?;
        let mut e = [0.0; NY];
        let mut missing = wanted;
        for _ in 0..3 {
            add_scaled(&mut e, 1.0, &normal.solve(&missing));
            missing = subtract(&wanted, &times(&model.Ke, &e));
        }
        let sums = times(&model.Ke.map(|row| row.map(Real::abs)), &e.map(Real::abs));
        let sizes = self.u.iter().zip(&feedback).zip(&sums).map(|((u, feedback), sum)| u.abs() + feedback.abs() + sum);
        let reached = missing.iter().zip(sizes).all(|(missing, size)| missing.abs() <= REACHED * size);
        if reached { Ok(e) } else { Err(StartError::InputOutOfReach) }
    }

    pub(crate) fn is_finite(&self) -> bool {
        finite(&self.x) && finite(&self.u)
    }

    /// The first input outside its limits, by more than rounding.
    pub(crate) fn input_outside(&self, low: &[Real; NU], high: &[Real; NU]) -> Option<usize> {
        self.u
            .iter()
            .zip(low.iter().zip(high))
            .position(|(u, (low, high))| *u < low - REACHED * low.abs() || *u > high + REACHED * high.abs())
    }
}

/// M'M x = M'b with M's columns and the factor of M'M.
struct NormalEquations<const ROWS: usize, const COLUMNS: usize> {
    columns: [[Real; ROWS]; COLUMNS],
    factor: Factor<COLUMNS>,
}

impl<const ROWS: usize, const COLUMNS: usize> NormalEquations<ROWS, COLUMNS> {
    /// `None` where the columns depend on each other.
    fn new(matrix: &[[Real; COLUMNS]; ROWS]) -> Option<Self> {
        let mut columns = [[0.0; ROWS]; COLUMNS];
        for (k, column) in columns.iter_mut().enumerate() {
            *column = matrix.each_ref().map(|row| row.get(k).copied().unwrap_or(0.0));
        }
        let mut factor = Factor::EMPTY;
        for (k, column) in columns.iter().enumerate() {
            let mut products = [0.0; COLUMNS];
            for (product, other) in products.iter_mut().zip(&columns).take(k) {
                *product = dot(other, column);
            }
            if !factor.push_gram(&products, dot(column, column)) {
                return None;
            }
        }
        Some(Self { columns, factor })
    }

    fn solve(&self, b: &[Real; ROWS]) -> [Real; COLUMNS] {
        self.factor.solve(&self.columns.each_ref().map(|column| dot(column, b)))
    }
}

#[cfg(test)]
mod tests {
    #![expect(non_snake_case, reason = "the paper's symbols")]

    use super::super::Real;
    use super::super::tables::Model;
    use super::SteadyState;
    use crate::refusal::StartError;

    /// One state, two inputs, one output; only the gains matter here.
    fn model(Ke: [[Real; 1]; 2]) -> Model<1, 2, 1, 0, 0> {
        Model {
            A: [[0.5]],
            B: [[1.0, 1.0]],
            C: [[1.0]],
            Cz: [],
            Dz: [],
            EL: [[]],
            K: [[0.0], [0.0]],
            Kx: [[0.5], [-1.0]],
            Ke,
            u_min: [-9.0; 2],
            u_max: [9.0; 2],
            drift: [0.0],
        }
    }

    #[test]
    fn finds_the_error_sum_behind_an_input() {
        let start = SteadyState { x: [2.0], u: [1.0 + 3.0, -2.0 + 6.0] };
        let [e] = start.error_sum(&model([[1.0], [2.0]])).unwrap();
        assert!((e - 3.0).abs() < 4.0 * Real::EPSILON);
    }

    /// An input that is zero is reached as well as the rounding of its terms allows.
    #[test]
    fn reaches_every_input_with_as_many_outputs() {
        let Ke = [[0.3, 0.1], [0.1, 0.7]];
        let model: Model<1, 2, 2, 0, 0> = Model {
            A: [[0.5]],
            B: [[1.0, 1.0]],
            C: [[1.0], [1.0]],
            Cz: [],
            Dz: [],
            EL: [[]],
            K: [[0.0], [0.0]],
            Kx: [[0.5], [-1.0]],
            Ke,
            u_min: [-9.0; 2],
            u_max: [9.0; 2],
            drift: [0.0],
        };
        for k in 0..1000_u16 {
            let start = SteadyState { x: [0.0], u: [0.001 * Real::from(k), 0.0] };
            let [a, b] = start.error_sum(&model).unwrap();
            let missing = [0.3 * a + 0.1 * b - start.u[0], 0.1 * a + 0.7 * b];
            assert!(missing.iter().all(|missing| missing.abs() <= 4.0 * Real::EPSILON));
        }
    }

    #[test]
    fn refuses_an_input_that_no_error_sum_gives() {
        let off = SteadyState { x: [2.0], u: [4.0, 4.1] };
        assert_eq!(off.error_sum(&model([[1.0], [2.0]])), Err(StartError::InputOutOfReach));
        // The second input is small, in its unit: it is not the first one's size that its residual is compared with.
        let beside = SteadyState { x: [0.0], u: [1.0, 1.001e-9] };
        assert_eq!(beside.error_sum(&model([[1.0], [1e-9]])), Err(StartError::InputOutOfReach));
        let any = SteadyState { x: [2.0], u: [1.0, -2.0] };
        assert_eq!(any.error_sum(&model([[0.0], [0.0]])), Err(StartError::InputOutOfReach));
    }
}
