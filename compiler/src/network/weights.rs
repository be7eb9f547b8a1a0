//! Q_i, R_i, T_i and the Riccati weights: symmetric and positive definite.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::shape::{Shape, Side, entry_place, vector};
use super::words::number;
use crate::diagnostic::{Diagnostic, Diagnostics, Place, code};
use crate::spec::{Matrix, Weight};

/// Asymmetry that is taken for rounding, relative to the largest entry.
const ROUNDING: f64 = 1e-9;
const MAX_ITERATIONS: usize = 10_000;

/// A weight over some signals.
pub(super) struct Weighing {
    /// ``` weight `Q` of subsystem `left` ```.
    pub what: String,
    pub size: usize,
    /// `one per state: h1, h2`.
    pub per_signal: String,
    /// Where the file leaves the weight out.
    pub default: f64,
}

impl Weighing {
    /// The weight as a symmetric positive definite matrix.
    pub fn definite(&self, given: &Option<Weight>, errors: &mut Diagnostics) -> Option<DMatrix<f64>> {
        let matrix = self.symmetric(given, errors)?;
        let Some(given) = given else { return Some(matrix) };
        let smallest = smallest_eigenvalue(&matrix);
        if smallest.is_some_and(|smallest| smallest > 0.0) {
            return Some(matrix);
        }
        errors.push(self.indefinite(smallest, given.place()));
        None
    }

    /// The weight as a symmetric matrix.
    pub fn symmetric(&self, given: &Option<Weight>, errors: &mut Diagnostics) -> Option<DMatrix<f64>> {
        match given {
            None => Some(DMatrix::identity(self.size, self.size) * self.default),
            Some(Weight::Scalar(scalar)) => Some(DMatrix::identity(self.size, self.size) * scalar.value),
            Some(Weight::Diagonal(diagonal)) => {
                let diagonal: DVector<f64> = vector(&self.what, diagonal, self.size, &self.per_signal, errors)?;
                Some(DMatrix::from_diagonal(&diagonal))
            }
            Some(Weight::Full(matrix)) => self.full(matrix, errors),
        }
    }

    fn full(&self, given: &Matrix, errors: &mut Diagnostics) -> Option<DMatrix<f64>> {
        let side = || Side::Exactly(self.size, self.per_signal.clone());
        let matrix = Shape { what: self.what.clone(), rows: side(), columns: side() }.read(given, errors)?;
        let tolerance = ROUNDING * matrix.amax();
        let pairs = (0..self.size).flat_map(|r| (0..r).map(move |c| (r, c)));
        let asymmetric =
            pairs.filter(|&(r, c)| (matrix[(r, c)] - matrix[(c, r)]).abs() > tolerance).collect::<Vec<_>>();
        for &(r, c) in &asymmetric {
            errors.push(self.asymmetric(&matrix, given, r, c));
        }
        asymmetric.is_empty().then(|| (&matrix + matrix.transpose()) * 0.5)
    }

    fn asymmetric(&self, matrix: &DMatrix<f64>, given: &Matrix, r: usize, c: usize) -> Diagnostic {
        let label = |r, c| format!("row {}, column {}: {}", r + 1, c + 1, number(matrix[(r, c)]));
        let mean = rounded((matrix[(r, c)] + matrix[(c, r)]) / 2.0);
        Diagnostic::error(code::ASYMMETRIC, format!("{} is not symmetric", self.what))
            .at(entry_place(given, r, c), label(r, c))
            .at(entry_place(given, c, r), label(c, r))
            .help(format!("write the same number twice; {mean} in both places weighs the same"))
    }

    fn indefinite(&self, smallest: Option<f64>, place: Place) -> Diagnostic {
        let label = match smallest {
            Some(smallest) => format!("its smallest eigenvalue is {}", rounded(smallest)),
            None => "its eigenvalues cannot be computed".to_string(),
        };
        Diagnostic::error(code::INDEFINITE, format!("{} is not positive definite", self.what))
            .at(place, label)
            .help("weigh every signal, if only a little: eigenvalues above 0")
    }
}

/// `None` where the iteration does not settle. Scaled, since squares of the entries may overflow.
pub(super) fn smallest_eigenvalue(matrix: &DMatrix<f64>) -> Option<f64> {
    let scale = matrix.amax();
    if scale == 0.0 {
        return Some(0.0);
    }
    let eigen = SymmetricEigen::try_new(matrix / scale, f64::EPSILON, MAX_ITERATIONS)?;
    Some(eigen.eigenvalues.min() * scale)
}

/// Few digits, since the last ones of an eigenvalue mean nothing.
pub(super) fn rounded(value: f64) -> String {
    format!("{value:.4e}").parse().map_or_else(|_| number(value), number)
}
