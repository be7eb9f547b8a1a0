//! Whether a start-up plan exists, by another route than the compiler's: a linear program over the collective plant that
//! minimises the sum of all violations, from the conditions as `dpc_codegen::start` states them and no code of it.
#![expect(non_snake_case, reason = "the paper's symbols")]

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};
use dpc_codegen::design::Design;
use nalgebra::{DMatrix, DVector};

use crate::checker::{Collective, Lowered};
use crate::strips::SymmetricSet;

/// The least sum of violations, each relative to its bound, of all conditions of a plan of `steps` steps from `x0`: 0 where there
/// is one. `None` where the solver cannot tell. For designs without loads that may start anywhere.
pub fn violation(design: &Design, x0: &[DVector<f64>], steps: usize) -> Option<f64> {
    let mut program = Elastic::new(design, steps);
    program.plant(design, x0);
    for (i, x0) in x0.iter().enumerate() {
        program.first_problem(design, i, x0);
        program.margins(design, i);
    }
    program.coupling(design);
    program.solve()
}

/// Minimise the sum of s >= 0 with equations, and rows row <= limit + scale s.
struct Elastic {
    steps: usize,
    plant: Lowered,
    /// First variables: x_t, u_t, y at the end, then dx_t and du_t.
    x: Vec<usize>,
    u: Vec<usize>,
    y: usize,
    dx: Vec<usize>,
    du: Vec<usize>,
    variables: usize,
    /// Terms and constant, the sum of which is 0.
    equations: Vec<(Terms, f64)>,
    /// Terms, limit and scale.
    rows: Vec<(Terms, f64, f64)>,
}

/// Variables with their coefficients.
type Terms = Vec<(usize, f64)>;

impl Elastic {
    fn new(design: &Design, steps: usize) -> Self {
        let (plant, N) = (Lowered::new(&design.network), design.network.horizon);
        let (n, m, p) = (plant.A.nrows(), plant.B.ncols(), plant.C.nrows());
        let mut variables = 0;
        let mut take = |count: usize| {
            variables += count;
            variables - count
        };
        let x = (0..=steps).map(|_| take(n)).collect();
        let u = (0..steps).map(|_| take(m)).collect();
        let y = take(p);
        let dx = (0..=N).map(|_| take(n)).collect();
        let du = (0..N).map(|_| take(m)).collect();
        Self { steps, plant, x, u, y, dx, du, variables, equations: Vec::new(), rows: Vec::new() }
    }

    /// (7a), and rest at the end by the steady-state map of the reference system.
    fn plant(&mut self, design: &Design, x0: &[DVector<f64>]) {
        let n = self.plant.A.nrows();
        assert_eq!(n, x0.iter().map(|x| x.len()).sum::<usize>());
        for t in 0..self.steps {
            self.motion(&self.plant.A.clone(), &self.plant.B.clone(), [self.x[t], self.u[t], self.x[t + 1]]);
        }
        for (i, s) in design.network.subsystems.iter().enumerate() {
            let (x, u) = (self.plant.x[i], self.plant.u[i]);
            for t in 0..self.du.len() {
                self.motion(&s.A, &s.B, [self.dx[t] + x, self.du[t] + u, self.dx[t + 1] + x]);
            }
        }
        let steady = Collective::new(design).steady().expect("I - calF is regular");
        for k in 0..n {
            let mut terms = vec![(self.x[self.steps] + k, -1.0)];
            terms.extend((0..steady.ncols()).map(|j| (self.y + j, steady[(k, j)])));
            self.equations.push((terms, 0.0));
        }
    }

    fn motion(&mut self, A: &DMatrix<f64>, B: &DMatrix<f64>, [x, u, next]: [usize; 3]) {
        for k in 0..A.nrows() {
            let mut terms = vec![(next + k, -1.0)];
            terms.extend((0..A.ncols()).map(|j| (x + j, A[(k, j)])));
            terms.extend((0..B.ncols()).map(|j| (u + j, B[(k, j)])));
            self.equations.push((terms, 0.0));
        }
    }

    /// Conditions 2.
    fn first_problem(&mut self, design: &Design, i: usize, x0: &DVector<f64>) {
        let (s, sized) = (&design.network.subsystems[i], &design.sizing.subsystems[i]);
        let (x, u) = (self.plant.x[i], self.plant.u[i]);
        for (P, q) in sized.E.P.row_iter().zip(&sized.E.q) {
            let P = P.transpose();
            let at = P.dot(x0);
            let terms = [over(&P, self.x[0] + x, 1.0), over(&P, self.dx[0] + x, 1.0)].concat();
            self.rows.push((terms.clone(), q + at, *q));
            self.rows.push((terms.into_iter().map(|(k, a)| (k, -a)).collect(), q - at, *q));
        }
        for t in 0..self.du.len() {
            let (states, inputs) = ([self.x[t] + x, self.dx[t] + x], [self.u[t] + u, self.du[t] + u]);
            for r in 0..s.X.h.len() {
                self.row(&s.X.H.row(r).transpose(), &states, sized.X_nom.h[r], s.X.h[r]);
            }
            for r in 0..s.U.h.len() {
                self.row(&s.U.H.row(r).transpose(), &inputs, sized.U_nom.h[r], s.U.h[r]);
            }
            for k in 0..s.nz() {
                let on_x = over(&s.Cz.row(k).transpose(), self.dx[t] + x, 1.0);
                let terms = [on_x, over(&s.Dz.row(k).transpose(), self.du[t] + u, 1.0)].concat();
                self.rows.push((terms.clone(), sized.dz[k], sized.dz[k]));
                self.rows.push((terms.into_iter().map(|(k, a)| (k, -a)).collect(), sized.dz[k], sized.dz[k]));
            }
        }
        for (P, q) in sized.Sigma.P.row_iter().zip(&sized.Sigma.q) {
            for sign in [1.0, -1.0] {
                self.row(&(P.transpose() * sign), &[self.dx[self.du.len()] + x], *q, *q);
            }
        }
    }

    /// Conditions 3 and the Y of 5.
    fn margins(&mut self, design: &Design, i: usize) {
        let (s, g, sized) = (&design.network.subsystems[i], &design.gains.subsystems[i], &design.sizing.subsystems[i]);
        let Sigma = SymmetricSet::new(&sized.Sigma.P, &sized.Sigma.q).expect("Sigma is bounded and has an interior");
        let (x, u) = (self.plant.x[i], self.plant.u[i]);
        for t in design.network.horizon..self.steps {
            for r in 0..s.X.h.len() {
                let row = s.X.H.row(r).transpose();
                self.row(&row, &[self.x[t] + x], sized.X_nom.h[r] - Sigma.support(&row).proved, s.X.h[r]);
            }
            for r in 0..s.U.h.len() {
                let row = s.U.H.row(r).transpose();
                let taken = Sigma.support(&g.K.tr_mul(&row)).proved;
                self.row(&row, &[self.u[t] + u], sized.U_nom.h[r] - taken, s.U.h[r]);
            }
        }
        for k in 0..s.p() {
            let (y, width) = (self.y + self.plant.y[i] + k, sized.Y.max[k] - sized.Y.min[k]);
            self.rows.push((vec![(y, 1.0)], sized.Y.max[k], width));
            self.rows.push((vec![(y, -1.0)], -sized.Y.min[k], width));
        }
    }

    /// Conditions 4, and (27) at the end.
    fn coupling(&mut self, design: &Design) {
        for (h, c) in design.network.coupling_constraints.iter().enumerate() {
            let taken: f64 = c.Hz.iter().map(|(j, row)| row.abs().dot(&design.sizing.subsystems[*j].zeta)).sum();
            for t in 0..=self.steps {
                let terms = |j: usize, H: &DVector<f64>| {
                    let row = design.network.subsystems[j].C.tr_mul(H);
                    over(&row, self.x[t] + self.plant.x[j], 1.0)
                };
                let terms = c.H.iter().flat_map(|(j, H)| terms(*j, H)).collect();
                let limit = if t == self.steps { design.sizing.l_tilde[h] } else { c.l - taken };
                self.rows.push((terms, limit, c.l));
            }
        }
    }

    /// The row on the sum of some vectors.
    fn row(&mut self, row: &DVector<f64>, places: &[usize], limit: f64, scale: f64) {
        let terms = places.iter().flat_map(|place| over(row, *place, 1.0)).collect();
        self.rows.push((terms, limit, scale));
    }

    fn solve(&self) -> Option<f64> {
        let (n, count) = (self.variables + self.rows.len(), self.equations.len() + 2 * self.rows.len());
        let (mut at, mut of, mut values, mut b) = (Vec::new(), Vec::new(), Vec::new(), vec![0.0; count]);
        let mut put = |r: usize, k: usize, a: f64| {
            at.push(r);
            of.push(k);
            values.push(a);
        };
        for (r, (terms, constant)) in self.equations.iter().enumerate() {
            terms.iter().filter(|(_, a)| *a != 0.0).for_each(|(k, a)| put(r, *k, *a));
            b[r] = -constant;
        }
        for (k, (terms, limit, scale)) in self.rows.iter().enumerate() {
            let (r, slack) = (self.equations.len() + 2 * k, self.variables + k);
            terms.iter().filter(|(_, a)| *a != 0.0).for_each(|(k, a)| put(r, *k, a / scale));
            put(r, slack, -1.0);
            put(r + 1, slack, -1.0);
            b[r] = limit / scale;
        }
        let a = CscMatrix::new_from_triplets(count, n, at, of, values);
        let cost: Vec<f64> = (0..n).map(|k| f64::from(k >= self.variables)).collect();
        let cones =
            [SupportedConeT::ZeroConeT(self.equations.len()), SupportedConeT::NonnegativeConeT(2 * self.rows.len())];
        let settings = DefaultSettings { verbose: false, max_iter: 400, ..DefaultSettings::default() };
        let mut solver = DefaultSolver::new(&CscMatrix::zeros((n, n)), &cost, &a, &b, &cones, settings).ok()?;
        solver.solve();
        let solution = &solver.solution;
        let close =
            solution.r_prim.max(solution.r_dual) < 1e-6 && (solution.obj_val - solution.obj_val_dual).abs() < 1e-6;
        let ended = [SolverStatus::Solved, SolverStatus::AlmostSolved, SolverStatus::InsufficientProgress];
        (ended.contains(&solution.status) && close).then_some(solution.obj_val_dual)
    }
}

fn over(row: &DVector<f64>, first: usize, factor: f64) -> Vec<(usize, f64)> {
    row.iter().enumerate().map(|(k, a)| (first + k, a * factor)).collect()
}
