//! Linear objectives under linear matrix inequalities, by Clarabel's semidefinite cones.

use std::collections::BTreeMap;

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};

use super::conic::{Answer, Form, Rows};

/// A symmetric matrix that is affine in the variables.
#[derive(Debug, Clone)]
pub struct AffineMatrix {
    size: usize,
    /// The upper triangle, row index first; what is absent is 0 for every value of the variables, and Clarabel makes
    /// use of it (chordal decomposition).
    entries: BTreeMap<(usize, usize), Form>,
}

impl AffineMatrix {
    pub fn new(size: usize) -> Self {
        Self { size, entries: BTreeMap::new() }
    }

    /// Adds `form` to entry (i, j), and to (j, i).
    pub fn add(&mut self, i: usize, j: usize, form: &Form) {
        let entry = self.entries.entry((i.min(j), i.max(j))).or_default();
        entry.terms.extend(&form.terms);
        entry.constant += form.constant;
    }
}

/// Minimise cost'x subject to matrices that must be positive semidefinite.
#[derive(Debug, Clone, Default)]
pub struct SemidefiniteProgram {
    pub cost: Vec<f64>,
    pub constraints: Vec<AffineMatrix>,
}

impl SemidefiniteProgram {
    /// A new variable with its cost.
    pub fn variable(&mut self, cost: f64) -> usize {
        self.cost.push(cost);
        self.cost.len() - 1
    }

    /// An interior-point answer: inequalities hold to about 1e-8 only, verify them.
    pub fn solve(&self) -> Answer {
        let rows = self.rows();
        let n = self.cost.len();
        let cones: Vec<_> = self.constraints.iter().map(|c| SupportedConeT::PSDTriangleConeT(c.size)).collect();
        let settings = DefaultSettings { verbose: false, ..DefaultSettings::default() };
        let a = CscMatrix::new_from_triplets(rows.b.len(), n, rows.rows, rows.columns, rows.values);
        let solver = DefaultSolver::new(&CscMatrix::zeros((n, n)), &self.cost, &a, &rows.b, &cones, settings);
        let mut solver = match solver {
            Ok(solver) => solver,
            Err(error) => return Answer::Failed(error.to_string()),
        };
        solver.solve();
        match solver.solution.status {
            SolverStatus::Solved | SolverStatus::AlmostSolved => Answer::Point(solver.solution.x[..n].to_vec()),
            SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => Answer::Infeasible,
            SolverStatus::DualInfeasible | SolverStatus::AlmostDualInfeasible => Answer::Unbounded,
            other => Answer::Failed(format!("{other:?}")),
        }
    }

    /// The upper triangles column by column, off-diagonal entries times sqrt(2), as Clarabel's cone has them.
    fn rows(&self) -> Rows {
        let (mut rows, zero) = (Rows::default(), Form::default());
        for matrix in &self.constraints {
            for (i, j) in (0..matrix.size).flat_map(|j| (0..=j).map(move |i| (i, j))) {
                let scale = if i == j { 1.0 } else { std::f64::consts::SQRT_2 };
                rows.push(&matrix.entries.get(&(i, j)).unwrap_or(&zero).times(scale));
            }
        }
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn constant(value: f64) -> Form {
        Form::new([], value)
    }

    fn variable(k: usize, factor: f64) -> Form {
        Form::new([(k, factor)], 0.0)
    }

    fn point(program: &SemidefiniteProgram) -> Vec<f64> {
        match program.solve() {
            Answer::Point(x) => x,
            other => panic!("{other:?}"),
        }
    }

    /// min t with t I >= M: the largest eigenvalue of M = [2 1 0 0; 1 2 1 0; 0 1 2 1; 0 0 1 2] is 2 + 2 cos(pi/5).
    #[test]
    fn largest_eigenvalue() {
        let mut program = SemidefiniteProgram::default();
        let t = program.variable(1.0);
        let mut matrix = AffineMatrix::new(4);
        for i in 0..4 {
            matrix.add(i, i, &Form::new([(t, 1.0)], -2.0));
        }
        (0..3).for_each(|i| matrix.add(i, i + 1, &constant(-1.0)));
        program.constraints.push(matrix);
        let expected = 2.0 + 2.0 * (std::f64::consts::PI / 5.0).cos();
        assert!((point(&program)[t] - expected).abs() < 1e-6);
    }

    /// Lovasz's theta of the five-cycle is sqrt(5).
    #[test]
    fn theta_of_the_pentagon() {
        let mut program = SemidefiniteProgram::default();
        let t = program.variable(1.0);
        let mut matrix = AffineMatrix::new(5);
        // min t with t I - J + sum over edges of x_e E_e >= 0.
        for i in 0..5 {
            matrix.add(i, i, &Form::new([(t, 1.0)], -1.0));
            for j in i + 1..5 {
                let edge = j - i == 1 || j - i == 4;
                let form = if edge { Form::new([(program.variable(0.0), 1.0)], -1.0) } else { constant(-1.0) };
                matrix.add(i, j, &form);
            }
        }
        program.constraints.push(matrix);
        assert!((point(&program)[t] - 5.0_f64.sqrt()).abs() < 1e-6);
    }

    /// min x + y with [x 1; 1 y] >= 0 is 2.
    #[test]
    fn geometric_mean() {
        let mut program = SemidefiniteProgram::default();
        let (x, y) = (program.variable(1.0), program.variable(1.0));
        let mut matrix = AffineMatrix::new(2);
        matrix.add(0, 0, &variable(x, 1.0));
        matrix.add(1, 1, &variable(y, 1.0));
        matrix.add(1, 0, &constant(1.0));
        program.constraints.push(matrix);
        let answer = point(&program);
        assert!((answer[x] - 1.0).abs() < 1e-5 && (answer[y] - 1.0).abs() < 1e-5);
    }

    /// A long chain: decomposed, its answer is that of the whole, 2 + 2 cos(pi / (n + 1)).
    #[test]
    fn chains_are_decomposed() {
        let n = 60;
        let mut program = SemidefiniteProgram::default();
        let t = program.variable(1.0);
        let mut matrix = AffineMatrix::new(n);
        (0..n).for_each(|i| matrix.add(i, i, &Form::new([(t, 1.0)], -2.0)));
        (1..n).for_each(|i| matrix.add(i - 1, i, &constant(-1.0)));
        program.constraints.push(matrix);
        let expected = 2.0 + 2.0 * (std::f64::consts::PI / (n as f64 + 1.0)).cos();
        assert!((point(&program)[t] - expected).abs() < 1e-6);
    }

    #[test]
    fn contradictions_are_infeasible() {
        let mut program = SemidefiniteProgram::default();
        let x = program.variable(0.0);
        let mut matrix = AffineMatrix::new(2);
        matrix.add(0, 0, &variable(x, 1.0));
        matrix.add(1, 1, &variable(x, -1.0));
        matrix.add(0, 1, &constant(1.0));
        program.constraints.push(matrix);
        assert_eq!(program.solve(), Answer::Infeasible);
    }
}
