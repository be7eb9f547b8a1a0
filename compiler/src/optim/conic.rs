//! Sums of logarithms under linear inequalities, by Clarabel's exponential cones.

use std::collections::BTreeMap;

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};

/// A sparse linear form: sum of coefficient times variable, plus a constant.
#[derive(Debug, Clone, Default)]
pub struct Form {
    pub terms: Vec<(usize, f64)>,
    pub constant: f64,
}

impl Form {
    pub fn new(terms: impl IntoIterator<Item = (usize, f64)>, constant: f64) -> Self {
        Self { terms: terms.into_iter().collect(), constant }
    }

    /// The terms with each variable once.
    fn merged(&self) -> BTreeMap<usize, f64> {
        let mut merged = BTreeMap::new();
        for &(k, a) in &self.terms {
            *merged.entry(k).or_insert(0.0) += a;
        }
        merged
    }

    /// The form times a number.
    pub fn times(&self, factor: f64) -> Self {
        Self::new(self.terms.iter().map(|&(k, a)| (k, factor * a)), factor * self.constant)
    }

    pub fn at(&self, x: &[f64]) -> f64 {
        self.constant + self.terms.iter().map(|&(k, a)| a * x[k]).sum::<f64>()
    }
}

/// Maximise sum of weight log(form) subject to form >= 0.
#[derive(Debug, Clone, Default)]
pub struct LogProgram {
    /// Natural size of each variable: the solver sees x_k / unit_k, and inequalities of size 1.
    pub units: Vec<f64>,
    /// Forms that must not be negative.
    pub inequalities: Vec<Form>,
    pub logs: Vec<(f64, Form)>,
    /// A linear objective to maximise besides.
    pub linear: Vec<(usize, f64)>,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Answer {
    /// Near-optimal point; inequalities hold to the solver's tolerance only: verify.
    Point(Vec<f64>),
    Infeasible,
    Unbounded,
    Failed(String),
}

/// Residuals of a point that counts although the solver stopped short of its tolerance.
const CLOSE: f64 = 1e-6;

impl LogProgram {
    pub fn variable(&mut self, unit: f64) -> usize {
        self.units.push(unit);
        self.units.len() - 1
    }

    pub fn at_least_zero(&mut self, terms: impl IntoIterator<Item = (usize, f64)>, constant: f64) {
        self.inequalities.push(Form::new(terms, constant));
    }

    pub fn maximise_log(&mut self, weight: f64, terms: impl IntoIterator<Item = (usize, f64)>, constant: f64) {
        self.logs.push((weight, Form::new(terms, constant)));
    }

    /// Solves the program; each log brings one variable t <= log(form), (t, 1, form) in the exponential cone.
    pub fn solve(&self) -> Answer {
        let variables = self.units.len();
        let n = variables + self.logs.len();
        let mut cost = vec![0.0; n];
        for (&(weight, _), c) in self.logs.iter().zip(&mut cost[variables..]) {
            *c = -weight;
        }
        for &(k, weight) in &self.linear {
            cost[k] -= weight * self.units[k];
        }
        let Rows { rows, columns, values, b } = self.rows();
        let mut cones = vec![SupportedConeT::NonnegativeConeT(self.inequalities.len())];
        cones.extend(self.logs.iter().map(|_| SupportedConeT::ExponentialConeT()));
        let p = CscMatrix::zeros((n, n));
        let settings = DefaultSettings { verbose: false, max_iter: 400, ..DefaultSettings::default() };
        let a = CscMatrix::new_from_triplets(b.len(), n, rows, columns, values);
        let mut solver = match DefaultSolver::new(&p, &cost, &a, &b, &cones, settings) {
            Ok(solver) => solver,
            Err(error) => return Answer::Failed(error.to_string()),
        };
        solver.solve();
        let solution = &solver.solution;
        // It stops short of its own tolerance where logarithms go far below 1: such a point is as good as any to settle from.
        let stalled =
            solution.status == SolverStatus::InsufficientProgress && solution.r_prim.max(solution.r_dual) < CLOSE;
        if stalled && self.holds(&solution.x) {
            return Answer::Point(self.in_units(&solution.x));
        }
        match solution.status {
            SolverStatus::Solved | SolverStatus::AlmostSolved => Answer::Point(self.in_units(&solution.x)),
            SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => Answer::Infeasible,
            SolverStatus::DualInfeasible | SolverStatus::AlmostDualInfeasible => Answer::Unbounded,
            other => Answer::Failed(format!("{other:?}")),
        }
    }

    /// Whether every inequality holds at x, over x_k / unit_k, up to [`CLOSE`] of its size: residuals are relative to x, which runs
    /// away where there is no point.
    fn holds(&self, x: &[f64]) -> bool {
        let logs = self.logs.iter().map(|(_, form)| form);
        self.inequalities.iter().chain(logs).all(|form| self.of_size_one(form).at(x) >= -CLOSE)
    }

    fn in_units(&self, x: &[f64]) -> Vec<f64> {
        x.iter().zip(&self.units).map(|(x, unit)| x * unit).collect()
    }

    fn rows(&self) -> Rows {
        let mut rows = Rows::default();
        self.inequalities.iter().for_each(|form| rows.push(&self.of_size_one(form)));
        for (k, (_, form)) in self.logs.iter().enumerate() {
            rows.push(&Form::new([(self.units.len() + k, 1.0)], 0.0));
            rows.push(&Form::new([], 1.0));
            // A factor on the argument adds a constant to the logarithm.
            rows.push(&self.of_size_one(form));
        }
        rows
    }

    /// The form over x_k / unit_k, divided by its largest coefficient.
    fn of_size_one(&self, form: &Form) -> Form {
        let terms: Vec<(usize, f64)> = form.merged().into_iter().map(|(k, a)| (k, a * self.units[k])).collect();
        let size = terms.iter().fold(form.constant.abs(), |size, (_, a)| size.max(a.abs()));
        let size = if size > 0.0 { size } else { 1.0 };
        Form::new(terms.into_iter().map(|(k, a)| (k, a / size)), form.constant / size)
    }
}

/// A x + s = b with s in the cones, A as triplets.
#[derive(Default)]
pub(super) struct Rows {
    pub rows: Vec<usize>,
    pub columns: Vec<usize>,
    pub values: Vec<f64>,
    pub b: Vec<f64>,
}

impl Rows {
    /// s = form.
    pub fn push(&mut self, form: &Form) {
        for (k, a) in form.merged() {
            self.rows.push(self.b.len());
            self.columns.push(k);
            self.values.push(-a);
        }
        self.b.push(form.constant);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_budget_is_split_by_the_weights() {
        let mut program = LogProgram::default();
        let _pair = [program.variable(1.0), program.variable(1.0)];
        program.at_least_zero([(0, -1.0), (1, -1.0)], 4.0);
        program.maximise_log(3.0, [(0, 1.0)], 0.0);
        program.maximise_log(1.0, [(1, 1.0)], 0.0);
        let Answer::Point(x) = program.solve() else { panic!() };
        assert!((x[0] - 3.0).abs() < 1e-3 && (x[1] - 1.0).abs() < 1e-3, "{x:?}");
    }

    #[test]
    fn contradictions_are_infeasible() {
        let mut program = LogProgram::default();
        program.variable(1.0);
        program.at_least_zero([(0, 1.0)], -2.0);
        program.at_least_zero([(0, -1.0)], 1.0);
        assert_eq!(program.solve(), Answer::Infeasible);
    }
}
