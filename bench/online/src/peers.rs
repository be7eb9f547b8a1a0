//! Other solvers, on min 1/2 |w|^2 subject to lower <= V w <= upper.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};

/// A solver that everything but the limits was given to beforehand.
pub trait Peer {
    fn name(&self) -> &'static str;
    /// What the row-wise limits are written into before each call of `solve`: lower, upper.
    fn limits(&mut self) -> (&mut [f64], &mut [f64]);
    /// False where it claims no solution.
    fn solve(&mut self) -> bool;
    fn w(&self) -> &[f64];
    /// Changes of the working set, or iterations, in the last solve.
    fn iterations(&self) -> usize;
    /// Forgets the last solution.
    fn forget(&mut self);
}

/// Every peer that was built in, for rows `v`.
#[expect(clippy::vec_init_then_push, reason = "which of them there are is known at compile time only")]
pub fn all(v: &[Vec<f64>]) -> Vec<Box<dyn Peer>> {
    let mut peers: Vec<Box<dyn Peer>> = Vec::new();
    #[cfg(daqp)]
    peers.push(Box::new(daqp::Daqp::new(v)));
    #[cfg(quadprog)]
    peers.push(Box::new(quadprog::Quadprog::new(v)));
    peers.push(Box::new(Clarabel::new(v)));
    peers
}

struct Clarabel {
    v: Vec<Vec<f64>>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    w: Vec<f64>,
    iterations: usize,
    solver: DefaultSolver<f64>,
}

impl Clarabel {
    fn new(v: &[Vec<f64>]) -> Self {
        let rows = v.len();
        let stacked: Vec<Vec<f64>> =
            v.iter().cloned().chain(v.iter().map(|row| row.iter().map(|x| -x).collect())).collect();
        let n = v[0].len();
        let settings = DefaultSettings { verbose: false, presolve_enable: false, ..DefaultSettings::default() };
        let (p, a) = (CscMatrix::identity(n), CscMatrix::from(&stacked));
        let cones = [SupportedConeT::NonnegativeConeT(2 * rows)];
        let solver =
            DefaultSolver::new(&p, &vec![0.0; n], &a, &vec![1.0; 2 * rows], &cones, settings).expect("well formed");
        Self { v: v.to_vec(), lower: vec![0.0; rows], upper: vec![0.0; rows], w: vec![0.0; n], iterations: 0, solver }
    }
}

/// Stands for no limit.
const FAR: f64 = 1e6;

impl Peer for Clarabel {
    fn name(&self) -> &'static str {
        "Clarabel"
    }
    fn limits(&mut self) -> (&mut [f64], &mut [f64]) {
        (&mut self.lower, &mut self.upper)
    }
    fn solve(&mut self) -> bool {
        let limits: Vec<f64> =
            self.upper.iter().map(|x| x.min(FAR)).chain(self.lower.iter().map(|x| (-x).min(FAR))).collect();
        self.solver.update_b(&limits).expect("the length is right");
        self.solver.solve();
        self.w.copy_from_slice(&self.solver.solution.x);
        self.iterations = self.solver.solution.iterations as usize;
        matches!(self.solver.solution.status, SolverStatus::Solved | SolverStatus::AlmostSolved)
    }
    fn w(&self) -> &[f64] {
        &self.w
    }
    fn iterations(&self) -> usize {
        self.iterations
    }
    fn forget(&mut self) {
        debug_assert_eq!(self.v.len(), self.lower.len());
    }
}

#[cfg(daqp)]
mod daqp {
    use std::ffi::{c_int, c_void};

    unsafe extern "C" {
        fn peer_daqp_new(n: c_int, m: c_int, v: *const f64) -> *mut c_void;
        fn peer_daqp_upper(workspace: *mut c_void) -> *mut f64;
        fn peer_daqp_lower(workspace: *mut c_void) -> *mut f64;
        fn peer_daqp_solve(workspace: *mut c_void, w: *mut f64, changes: *mut c_int) -> c_int;
        fn daqp_deactivate_constraints(workspace: *mut c_void);
    }

    pub struct Daqp {
        workspace: *mut c_void,
        rows: usize,
        w: Vec<f64>,
        changes: c_int,
    }

    impl Daqp {
        pub fn new(v: &[Vec<f64>]) -> Self {
            let flat: Vec<f64> = v.concat();
            let (rows, n) = (v.len(), v[0].len());
            // SAFETY: `flat` holds rows * n numbers, which are copied; the workspace lives as long as the process.
            let workspace = unsafe { peer_daqp_new(n as c_int, rows as c_int, flat.as_ptr()) };
            Self { workspace, rows, w: vec![0.0; n], changes: 0 }
        }
    }

    impl super::Peer for Daqp {
        fn name(&self) -> &'static str {
            "DAQP"
        }
        fn limits(&mut self) -> (&mut [f64], &mut [f64]) {
            // SAFETY: both arrays were allocated with `rows` numbers.
            unsafe {
                (
                    std::slice::from_raw_parts_mut(peer_daqp_lower(self.workspace), self.rows),
                    std::slice::from_raw_parts_mut(peer_daqp_upper(self.workspace), self.rows),
                )
            }
        }
        fn solve(&mut self) -> bool {
            // SAFETY: `w` has the n places that are written.
            unsafe { peer_daqp_solve(self.workspace, self.w.as_mut_ptr(), &mut self.changes) > 0 }
        }
        fn w(&self) -> &[f64] {
            &self.w
        }
        fn iterations(&self) -> usize {
            self.changes.max(0) as usize
        }
        fn forget(&mut self) {
            // SAFETY: the workspace is one of DAQP's.
            unsafe { daqp_deactivate_constraints(self.workspace) }
        }
    }
}

#[cfg(quadprog)]
mod quadprog {
    use std::ffi::c_int;

    unsafe extern "C" {
        fn peer_quadprog(
            r: *mut f64,
            a: *mut f64,
            n: c_int,
            x: *mut f64,
            multipliers: *mut f64,
            c: *mut f64,
            b: *mut f64,
            q: c_int,
            active: *mut c_int,
            changes: *mut c_int,
            work: *mut f64,
        ) -> c_int;
    }

    /// Goldfarb and Idnani's method with its factor precomputed, from a cold start, the only one it has.
    pub struct Quadprog {
        lower: Vec<f64>,
        upper: Vec<f64>,
        /// R^-1, which every call destroys, and both sides of every row, column by column.
        r: Vec<f64>,
        c: Vec<f64>,
        b: Vec<f64>,
        a: Vec<f64>,
        w: Vec<f64>,
        multipliers: Vec<f64>,
        active: Vec<c_int>,
        work: Vec<f64>,
        changes: c_int,
    }

    impl Quadprog {
        pub fn new(v: &[Vec<f64>]) -> Self {
            let (rows, n) = (v.len(), v[0].len());
            let c = v.iter().flat_map(|row| row.iter().copied().chain(row.iter().map(|x| -x))).collect();
            let least = n.min(2 * rows);
            Self {
                lower: vec![0.0; rows],
                upper: vec![0.0; rows],
                r: vec![0.0; n * n],
                c,
                b: vec![0.0; 2 * rows],
                a: vec![0.0; n],
                w: vec![0.0; n],
                multipliers: vec![0.0; 2 * rows],
                active: vec![0; n.max(2 * rows)],
                work: vec![0.0; 2 * n + 4 * rows + least * (least + 5) / 2 + 1],
                changes: 0,
            }
        }
    }

    impl super::Peer for Quadprog {
        fn name(&self) -> &'static str {
            "quadprog"
        }
        fn limits(&mut self) -> (&mut [f64], &mut [f64]) {
            (&mut self.lower, &mut self.upper)
        }
        fn solve(&mut self) -> bool {
            let n = self.w.len();
            self.r.fill(0.0);
            self.r.iter_mut().step_by(n + 1).for_each(|entry| *entry = 1.0);
            self.a.fill(0.0);
            for (pair, (lower, upper)) in self.b.chunks_exact_mut(2).zip(self.lower.iter().zip(&self.upper)) {
                pair[0] = lower.max(-super::FAR);
                pair[1] = (-upper).max(-super::FAR);
            }
            // SAFETY: every array has the length that the C code asks for; see its head.
            let flag = unsafe {
                peer_quadprog(
                    self.r.as_mut_ptr(),
                    self.a.as_mut_ptr(),
                    n as c_int,
                    self.w.as_mut_ptr(),
                    self.multipliers.as_mut_ptr(),
                    self.c.as_mut_ptr(),
                    self.b.as_mut_ptr(),
                    self.b.len() as c_int,
                    self.active.as_mut_ptr(),
                    &mut self.changes,
                    self.work.as_mut_ptr(),
                )
            };
            flag == 0
        }
        fn w(&self) -> &[f64] {
            &self.w
        }
        fn iterations(&self) -> usize {
            self.changes.max(0) as usize
        }
        fn forget(&mut self) {}
    }
}
