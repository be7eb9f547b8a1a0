//! Separable quadratic programs under linear equations and inequalities, by Clarabel.

use std::collections::BTreeMap;

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};

use super::conic::{Form, Rows};

/// Minimise sum of weight (x_k / unit_k)^2 / 2 plus linear terms, subject to forms that are 0 and forms that are not negative.
#[derive(Debug, Clone, Default)]
pub struct QuadraticProgram {
    /// Natural size of each variable: the solver sees x_k / unit_k, and forms of size 1.
    pub units: Vec<f64>,
    /// Weight of each variable's square.
    pub squares: Vec<f64>,
    /// Linear terms over x.
    pub linear: Vec<(usize, f64)>,
    pub zeros: Vec<Form>,
    pub inequalities: Vec<Form>,
}

/// What the solver says.
#[derive(Debug, Clone, PartialEq)]
pub enum Answer {
    Point(Point),
    /// With a certificate that the solver accepted.
    Infeasible,
    Failed(String),
}

/// Near-optimal: forms hold to the solver's tolerance only, so verify what counts.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    pub x: Vec<f64>,
    /// One per inequality, not negative: what its limit, divided by the largest coefficient, is worth.
    pub multipliers: Vec<f64>,
    /// The dual objective: no point has a smaller one, up to the solver's tolerance.
    pub bound: f64,
}

const TOLERANCE: f64 = 1e-9;

/// Residuals of a point that counts although the solver stopped short of its tolerance.
const CLOSE: f64 = 1e-7;

impl QuadraticProgram {
    /// A new variable of this size, its square weighted.
    pub fn variable(&mut self, unit: f64, square: f64) -> usize {
        self.units.push(unit);
        self.squares.push(square);
        self.units.len() - 1
    }

    pub fn zero(&mut self, terms: impl IntoIterator<Item = (usize, f64)>, constant: f64) {
        self.zeros.push(Form::new(terms, constant));
    }

    pub fn at_least_zero(&mut self, terms: impl IntoIterator<Item = (usize, f64)>, constant: f64) {
        self.inequalities.push(Form::new(terms, constant));
    }

    pub fn solve(&self) -> Answer {
        let n = self.units.len();
        let mut cost = vec![0.0; n];
        self.linear.iter().for_each(|&(k, weight)| cost[k] += weight * self.units[k]);
        let squares = self.squares.iter().enumerate().filter(|(_, weight)| **weight > 0.0);
        let (places, weights): (Vec<usize>, Vec<f64>) = squares.map(|(k, weight)| (k, *weight)).unzip();
        let p = CscMatrix::new_from_triplets(n, n, places.clone(), places, weights);
        let mut rows = Rows::default();
        self.zeros.iter().chain(&self.inequalities).for_each(|form| rows.push(&self.of_size_one(form)));
        let cones =
            [SupportedConeT::ZeroConeT(self.zeros.len()), SupportedConeT::NonnegativeConeT(self.inequalities.len())];
        let a = CscMatrix::new_from_triplets(rows.b.len(), n, rows.rows, rows.columns, rows.values);
        let settings = DefaultSettings {
            verbose: false,
            max_iter: 400,
            tol_gap_abs: TOLERANCE,
            tol_gap_rel: TOLERANCE,
            tol_feas: TOLERANCE,
            ..DefaultSettings::default()
        };
        match DefaultSolver::new(&p, &cost, &a, &rows.b, &cones, settings) {
            Ok(mut solver) => {
                solver.solve();
                self.answer(&solver.solution)
            }
            Err(error) => Answer::Failed(error.to_string()),
        }
    }

    fn answer(&self, solution: &clarabel::solver::DefaultSolution<f64>) -> Answer {
        // It stops short of its own tolerance where the best points crowd into a corner.
        let stalled = matches!(solution.status, SolverStatus::InsufficientProgress | SolverStatus::MaxIterations)
            && solution.r_prim.max(solution.r_dual) < CLOSE;
        match solution.status {
            _ if stalled => self.point(solution),
            SolverStatus::Solved | SolverStatus::AlmostSolved => self.point(solution),
            SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => Answer::Infeasible,
            other => Answer::Failed(format!("{other:?}")),
        }
    }

    fn point(&self, solution: &clarabel::solver::DefaultSolution<f64>) -> Answer {
        Answer::Point(Point {
            x: solution.x.iter().zip(&self.units).map(|(x, unit)| x * unit).collect(),
            multipliers: solution.z[self.zeros.len()..].to_vec(),
            bound: solution.obj_val_dual,
        })
    }

    /// The form over x_k / unit_k, divided by its largest coefficient.
    fn of_size_one(&self, form: &Form) -> Form {
        let mut merged = BTreeMap::new();
        form.terms.iter().for_each(|&(k, a)| *merged.entry(k).or_insert(0.0) += a * self.units[k]);
        let size = merged.values().fold(0.0, |size: f64, a| size.max(a.abs()));
        let size = if size > 0.0 { size } else { 1.0 };
        Form::new(merged.into_iter().map(|(k, a)| (k, a / size)), form.constant / size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The point of the line x + 2 y = 4 nearest to 0, with x <= 0.5 or without.
    fn on_the_line(limit: Option<f64>) -> QuadraticProgram {
        let mut program = QuadraticProgram::default();
        let (x, y) = (program.variable(1.0, 1.0), program.variable(10.0, 100.0));
        program.zero([(x, 1.0), (y, 2.0)], -4.0);
        if let Some(limit) = limit {
            program.at_least_zero([(x, -2.0)], 2.0 * limit);
        }
        program
    }

    fn point(program: &QuadraticProgram) -> Point {
        match program.solve() {
            Answer::Point(point) => point,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn nearest_points_and_their_multipliers() {
        let free = point(&on_the_line(None));
        assert!((free.x[0] - 0.8).abs() < 1e-7 && (free.x[1] - 1.6).abs() < 1e-7, "{free:?}");
        assert!((free.bound - 1.6).abs() < 1e-7);
        let stopped = point(&on_the_line(Some(0.5)));
        assert!((stopped.x[0] - 0.5).abs() < 1e-7 && (stopped.x[1] - 1.75).abs() < 1e-7, "{stopped:?}");
        // d/dlimit of limit^2 / 2 + ((4 - limit) / 2)^2 / 2 at 0.5 is 0.5 - 0.875.
        assert!((stopped.multipliers[0] - 0.375).abs() < 1e-6, "{stopped:?}");
    }

    #[test]
    fn contradictions_are_infeasible() {
        let mut program = on_the_line(Some(0.5));
        program.at_least_zero([(1, -1.0)], 1.0);
        assert_eq!(program.solve(), Answer::Infeasible);
    }
}
