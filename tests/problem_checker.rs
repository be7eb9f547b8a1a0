//! The i-DPC problems of a design against (33)-(36) written out anew: by simulation, rays and linear programs.
#![expect(non_snake_case, reason = "the paper's symbols")]

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};
use dpc_codegen::design::Design;
use dpc_codegen::gains::SubsystemGains;
use dpc_codegen::network::Subsystem;
use dpc_codegen::problems::{DpcProblem, ReferenceProblem, RowKind};
use dpc_codegen::sizing::SubsystemSizing;
use nalgebra::{DMatrix, DVector};

use crate::Random;
use crate::checker::Claim;
use crate::least_distance::Parameters;
use crate::unknowns::Unknowns;

/// Subsystem `i` of a design and its problem.
pub struct Problem<'a> {
    pub s: &'a Subsystem,
    pub g: &'a SubsystemGains,
    pub sized: &'a SubsystemSizing,
    pub dpc: &'a DpcProblem,
    pub N: usize,
}

/// All claims about the problems of `design`: `samples` parameters per subsystem, a few rays each.
pub fn claims(design: &Design, random: &mut Random, samples: usize) -> Vec<Claim> {
    let mut claims = Vec::new();
    for i in 0..design.network.subsystems.len() {
        let problem = Problem::new(design, i);
        problem.form(&mut claims, random);
        problem.dropped_rows(&mut claims, random, samples);
        for _ in 0..samples {
            problem.sample(&mut claims, random);
        }
        reference_problem(design, i, &mut claims);
    }
    claims
}

impl<'a> Problem<'a> {
    pub fn new(design: &'a Design, i: usize) -> Self {
        Self {
            s: &design.network.subsystems[i],
            g: &design.gains.subsystems[i],
            sized: &design.sizing.subsystems[i],
            dpc: &design.problems.subsystems[i].dpc,
            N: design.network.horizon,
        }
    }

    fn claim(&self, claims: &mut Vec<Claim>, what: &str, slack: f64) {
        let slack = if slack.is_nan() { f64::NEG_INFINITY } else { slack };
        claims.push(Claim { what: format!("{}: {what}", self.s.name), slack });
    }

    /// H is the cost (34), positive definite; T a simulation; rows of unit length; everything finite.
    fn form(&self, claims: &mut Vec<Claim>, random: &mut Random) {
        let DpcProblem { H, T, V, .. } = self.dpc;
        let n = H.nrows();
        let v = random.direction(n);
        let (cost, own) = (v.dot(&(H * &v)), self.cost(&v));
        let unit = (T.transpose() * H * T - DMatrix::identity(n, n)).amax();
        let (states, inputs) = (self.s.n(), self.s.m());
        let stage = |k: usize| if k < states { 0 } else { 1 + (k - states) / inputs };
        let place = |r: usize, k: usize| stage(k) < stage(r) || (stage(k) == stage(r) && k >= r);
        let triangular = (0..n).all(|r| (0..n).all(|k| place(r, k) || T[(r, k)] == 0.0) && T[(r, r)] > 0.0);
        let lengths = V.row_iter().map(|row| (row.norm() - 1.0).abs()).fold(0.0, f64::max);
        let finite = H.iter().chain(T).chain(V).all(|value| value.is_finite());
        self.claim(claims, "H is the cost (34)", 1e-9 - ((cost - own) / own).abs());
        self.claim(claims, "H is positive definite", if H.clone().cholesky().is_some() { 0.0 } else { -1.0 });
        self.claim(claims, "T'HT = I", 1e-6 - unit);
        self.claim(claims, "T is a simulation stage by stage", if triangular { 0.0 } else { -1.0 });
        self.claim(claims, "rows of V have unit length", 1e-12 - lengths);
        self.claim(claims, "every entry is finite", if finite { 0.0 } else { -1.0 });
        self.doubt(claims);
    }

    /// What the measurement error is said to move in (35a') is its reach, and half of the row's limit at most.
    fn doubt(&self, claims: &mut Vec<Claim>) {
        let unknowns = Unknowns::of(self.s);
        for (r, noise) in self.dpc.noise.iter().enumerate() {
            let (reach, q) = (unknowns.reach_of_v(&self.dpc.rows[r].offset), self.dpc.upper[r]);
            let exact = (noise - reach).abs() <= 1e-11 * reach && *noise >= reach * (1.0 - 1e-15);
            self.claim(claims, "(35a') noise is the reach of the error", if exact { 0.0 } else { -1.0 });
            self.claim(claims, "(35a') leaves room at rest", (q - 2.0 * noise) / q);
        }
    }

    /// dx_0, ..., dx_N and du_0, ..., du_{N-1}.
    fn predict(&self, v: &DVector<f64>) -> (Vec<DVector<f64>>, Vec<DVector<f64>>) {
        let (n, m) = (self.s.n(), self.s.m());
        let mut dx = vec![v.rows(0, n).into_owned()];
        let du: Vec<_> = (0..self.N).map(|k| v.rows(n + k * m, m).into_owned()).collect();
        du.iter().for_each(|du| dx.push(&self.s.A * &dx[dx.len() - 1] + &self.s.B * du));
        (dx, du)
    }

    /// (34).
    fn cost(&self, v: &DVector<f64>) -> f64 {
        let (dx, du) = self.predict(v);
        let stage = |(dx, du): (&DVector<f64>, &DVector<f64>)| dx.dot(&(&self.s.Q * dx)) + du.dot(&(&self.s.R * du));
        dx.iter().zip(&du).map(stage).sum::<f64>() + dx[self.N].dot(&(&self.g.P * &dx[self.N]))
    }

    /// Every constraint of (35a)-(36) at v, as (left side, limit).
    pub fn constraints(&self, v: &DVector<f64>, at: &Parameters) -> Vec<(f64, f64)> {
        let (dx, du) = self.predict(v);
        let mut all = Vec::new();
        let mut inside = |values: DVector<f64>, limits: &DVector<f64>, symmetric: bool| {
            all.extend(values.iter().copied().zip(limits.iter().copied()));
            if symmetric {
                all.extend(values.iter().map(|value| -value).zip(limits.iter().copied()));
            }
        };
        let sized = self.sized;
        inside(&sized.E.P * (&at.e - &dx[0]), &sized.E.q, true);
        for k in 0..self.N {
            inside(&sized.X_nom.H * (&at.x_ref[k] + &dx[k]), &sized.X_nom.h, false);
            inside(&sized.U_nom.H * (&at.u_ref[k] + &du[k]), &sized.U_nom.h, false);
            inside(&self.s.Cz * &dx[k] + &self.s.Dz * &du[k], &sized.dz, true);
        }
        inside(&sized.Sigma.P * &dx[self.N], &sized.Sigma.q, true);
        all
    }

    /// The emitted rows at w, as (left side, limit).
    fn rows(&self, w: &DVector<f64>, at: &Parameters) -> Vec<(f64, f64)> {
        let value = &self.dpc.V * w;
        let mut all = Vec::new();
        for (r, row) in self.dpc.rows.iter().enumerate() {
            let offset = match row.kind {
                RowKind::Tube => row.offset.dot(&at.e),
                RowKind::State(k) => row.offset.dot(&at.x_ref[k]),
                RowKind::Input(k) => row.offset.dot(&at.u_ref[k]),
                RowKind::CouplingOutput(_) | RowKind::Terminal => 0.0,
            };
            all.push((value[r] + offset, self.dpc.upper[r]));
            all.push((-value[r] - offset, -self.dpc.lower[r]));
        }
        all.retain(|(_, limit)| limit.is_finite());
        all
    }

    /// References inside what (25b) leaves them, mostly in its corners, and a deviation inside E_i.
    pub fn parameters(&self, random: &mut Random) -> Parameters {
        let (X, U, sized) = (&self.s.X.H, &self.s.U.H, self.sized);
        let x_ref = (0..self.N).map(|_| corner(X, &sized.x_ref, random)).collect();
        let u_ref = (0..self.N).map(|_| corner(U, &sized.u_ref, random)).collect();
        let direction = random.direction(self.s.n());
        let reach = (&sized.E.P * &direction).iter().zip(&sized.E.q).map(|(v, q)| q / v.abs()).fold(1e9, f64::min);
        Parameters { e: direction * (reach * random.between(0.0, 0.999)), x_ref, u_ref }
    }

    /// At rest inside E_i nothing is active, and rays from there end where (35a)-(36) end.
    fn sample(&self, claims: &mut Vec<Claim>, random: &mut Random) {
        let at = self.parameters(random);
        let rest = DVector::zeros(self.dpc.H.nrows());
        let slack = |sides: &[(f64, f64)]| {
            sides.iter().map(|(left, limit)| (limit - left) / limit.abs().max(1e-300)).fold(f64::INFINITY, f64::min)
        };
        self.claim(claims, "v = 0 satisfies (35a)-(36)", slack(&self.constraints(&rest, &at)));
        self.claim(claims, "v = 0 satisfies the emitted rows", slack(&self.rows(&rest, &at)));
        for _ in 0..4 {
            let w = random.direction(rest.len());
            let full = reach(&self.constraints(&rest, &at), &self.constraints(&(&self.dpc.T * &w), &at));
            let kept = reach(&self.rows(&rest, &at), &self.rows(&w, &at));
            self.claim(claims, "the emitted rows are (35a)-(36)", 1e-7 - (full - kept).abs() / full.max(kept));
        }
    }

    /// For some of the facets: no point of the emitted rows violates them, whatever the references.
    fn dropped_rows(&self, claims: &mut Vec<Claim>, random: &mut Random, samples: usize) {
        let space = Space::new(self);
        let facets = space.facets();
        for _ in 0..samples {
            let (direction, limit) = &facets[random.below(facets.len())];
            let slack = match space.maximise(direction) {
                Some(value) => (limit - value) / limit,
                None => f64::NEG_INFINITY,
            };
            self.claim(claims, "a facet left out is implied", slack + 1e-6);
        }
    }
}

/// How far a ray goes: sides at its start and at its start plus its direction.
fn reach(start: &[(f64, f64)], end: &[(f64, f64)]) -> f64 {
    let along = start.iter().zip(end).map(|((from, limit), (to, _))| (limit - from, to - from));
    along.filter(|(_, slope)| *slope > 0.0).map(|(room, slope)| room.max(0.0) / slope).fold(f64::INFINITY, f64::min)
}

/// A point of {H x <= h}: from 0, along axes and other directions in turn, almost to the end or part of the way. What
/// is left at the end is more than rounding.
pub fn corner(H: &DMatrix<f64>, h: &DVector<f64>, random: &mut Random) -> DVector<f64> {
    let n = H.ncols();
    let mut x = DVector::zeros(n);
    for k in random.order(n) {
        let axis = DVector::from_fn(n, |j, _| f64::from(j == k)) * random.sign();
        let direction = if random.chance(0.7) { axis } else { random.direction(n) };
        let room = h - H * &x;
        let slope = H * &direction;
        let far = room.iter().zip(&slope).filter(|(_, s)| **s > 1e-12).map(|(r, s)| r.max(0.0) / s).fold(1e3, f64::min);
        x += direction * (far * if random.chance(0.7) { 0.999 } else { random.between(0.0, 0.999) });
    }
    x
}

/// (v, xref_0, ..., xref_{N-1}, uref_0, ..., uref_{N-1}).
struct Space<'a> {
    problem: &'a Problem<'a>,
    /// Facets of the emitted rows but for (35a), and of what (25b) leaves the references.
    kept: Vec<(DVector<f64>, f64)>,
}

impl<'a> Space<'a> {
    fn new(problem: &'a Problem<'a>) -> Self {
        let mut space = Self { problem, kept: Vec::new() };
        let inverse = space.inverse_T();
        let dpc = problem.dpc;
        for (r, row) in dpc.rows.iter().enumerate().filter(|(_, row)| row.kind != RowKind::Tube) {
            let mut facet = space.zeros();
            facet.rows_mut(0, dpc.V.ncols()).copy_from(&inverse.tr_mul(&dpc.V.row(r).transpose()));
            match row.kind {
                RowKind::State(k) => facet.rows_mut(space.x(k), row.offset.len()).copy_from(&row.offset),
                RowKind::Input(k) => facet.rows_mut(space.u(k), row.offset.len()).copy_from(&row.offset),
                _ => {}
            }
            space.kept.push((-&facet, -dpc.lower[r]));
            space.kept.push((facet, dpc.upper[r]));
        }
        space.kept.retain(|(_, limit)| limit.is_finite());
        space.references();
        space
    }

    fn inverse_T(&self) -> DMatrix<f64> {
        let T = &self.problem.dpc.T;
        T.clone().try_inverse().unwrap_or_else(|| DMatrix::from_element(T.nrows(), T.nrows(), f64::NAN))
    }

    fn x(&self, k: usize) -> usize {
        self.problem.dpc.H.nrows() + k * self.problem.s.n()
    }

    fn u(&self, k: usize) -> usize {
        self.x(self.problem.N) + k * self.problem.s.m()
    }

    fn zeros(&self) -> DVector<f64> {
        DVector::zeros(self.u(self.problem.N))
    }

    fn references(&mut self) {
        let Problem { s, sized, N, .. } = *self.problem;
        for k in 0..N {
            for (H, h, start) in [(&s.X.H, &sized.x_ref, self.x(k)), (&s.U.H, &sized.u_ref, self.u(k))] {
                for (row, h) in H.row_iter().zip(h) {
                    let mut facet = self.zeros();
                    facet.rows_mut(start, row.len()).copy_from(&row.transpose());
                    self.kept.push((facet, *h));
                }
            }
        }
    }

    /// All facets of (35b)-(36), by differences of the constraints at unit vectors.
    fn facets(&self) -> Vec<(DVector<f64>, f64)> {
        let size = self.zeros().len();
        let start = self.sides(&self.zeros());
        let mut facets: Vec<(DVector<f64>, f64)> = start.iter().map(|(_, limit)| (self.zeros(), *limit)).collect();
        for k in 0..size {
            let unit = DVector::from_fn(size, |j, _| f64::from(j == k));
            for ((facet, _), (value, _)) in facets.iter_mut().zip(self.sides(&unit)) {
                facet[k] = value;
            }
        }
        facets.retain(|(facet, _)| facet.amax() > 0.0);
        facets
    }

    fn sides(&self, point: &DVector<f64>) -> Vec<(f64, f64)> {
        let Problem { s, dpc, N, sized, .. } = self.problem;
        let v = point.rows(0, dpc.H.nrows()).into_owned();
        let x_ref = (0..*N).map(|k| point.rows(self.x(k), s.n()).into_owned()).collect();
        let u_ref = (0..*N).map(|k| point.rows(self.u(k), s.m()).into_owned()).collect();
        let all = self.problem.constraints(&v, &Parameters { e: DVector::zeros(s.n()), x_ref, u_ref });
        all[2 * sized.E.q.len()..].to_vec()
    }

    /// Largest value of a direction over the kept facets, by an interior-point method, up to its tolerance. Every limit
    /// is positive: rows that are at most 1 make that tolerance a relative one.
    fn maximise(&self, direction: &DVector<f64>) -> Option<f64> {
        let n = direction.len();
        let size = direction.norm();
        let row = |(facet, limit): &(DVector<f64>, f64)| facet.iter().map(|a| a / limit.max(1e-9)).collect();
        let rows: Vec<Vec<f64>> = self.kept.iter().map(row).collect();
        let b = vec![1.0; self.kept.len()];
        let cost: Vec<f64> = direction.iter().map(|d| -d / size).collect();
        let settings =
            DefaultSettings { verbose: false, max_iter: 200, tol_gap_rel: 1e-11, ..DefaultSettings::default() };
        let cones = [SupportedConeT::NonnegativeConeT(b.len())];
        let (P, A) = (CscMatrix::zeros((n, n)), CscMatrix::from(&rows));
        let mut solver = DefaultSolver::new(&P, &cost, &A, &b, &cones, settings).ok()?;
        solver.solve();
        match solver.solution.status {
            SolverStatus::Solved | SolverStatus::AlmostSolved => Some(-solver.solution.obj_val * size),
            _ => None,
        }
    }
}

/// (29)-(31), (28): the tables say what the network and the sizes say.
fn reference_problem(design: &Design, i: usize, claims: &mut Vec<Claim>) {
    let (s, sized) = (&design.network.subsystems[i], &design.sizing.subsystems[i]);
    let gamma = design.network.reference.gamma;
    let coupling: Vec<_> = design.network.coupling_constraints.iter().filter_map(|c| c.H.get(&i)).collect();
    let holds = match &design.problems.subsystems[i].reference {
        ReferenceProblem::Clamp { .. } if s.exposed.is_some() => false,
        ReferenceProblem::Clamp { weight, rows } => {
            let weighted = (0..s.p()).all(|k| (weight[k] * (s.T[(k, k)] + gamma) - s.T[(k, k)]).abs() <= 1e-14);
            let split = rows.iter().zip(&coupling).all(|(&(k, c), H)| H[k] == c && (H.abs().sum() == c.abs()));
            weighted && split && rows.len() == coupling.len()
        }
        ReferenceProblem::Nearest { basis, weights, set, set_limit, coupling: rows, .. } => {
            let again = basis * DMatrix::from_diagonal(weights) * basis.transpose();
            let ends = |y: &DVector<f64>| (set_limit - set * y).min();
            let same = rows.row_iter().zip(&coupling).all(|(row, H)| row.transpose() == **H);
            let tight = ends(&sized.Y.max).abs() + ends(&sized.Y.min).abs();
            (again - &s.T).amax() <= 1e-12 * s.T.amax()
                && same
                && tight <= 1e-12 * sized.Y.max.amax().max(sized.Y.min.amax())
        }
    };
    claims.push(Claim { what: format!("{}: (28)-(31) as stated", s.name), slack: if holds { 0.0 } else { -1.0 } });
}
