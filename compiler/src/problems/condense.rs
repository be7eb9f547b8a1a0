//! (33)-(36) in v = (dx_0, du_0, ..., du_{N-1}): dx_{k+1} = A_ii dx_k + B_ii du_k needs no parameter.

use nalgebra::{DMatrix, DVector};

use super::RowKind;
use crate::convex::Polytope;
use crate::gains::SubsystemGains;
use crate::network::{NamedPolytope, Subsystem};
use crate::rounding::{Reserve, Rounding, SignalRow};
use crate::sizing::SubsystemSizing;

/// Hessian and rows before scaling.
pub struct Condensed {
    pub H: DMatrix<f64>,
    /// Tube rows first, then state rows, input rows, and rows without offset.
    pub rows: Vec<TwoSided>,
}

/// lower <= g v + offset p <= upper.
#[derive(Debug, Clone)]
pub struct TwoSided {
    pub kind: RowKind,
    /// Which of the rows of its kind and stage: rows that ask the same at different stages have the same one.
    pub ordinal: usize,
    /// The user's name of each side; the same where the sides belong together.
    pub lower_name: String,
    pub upper_name: String,
    pub g: DVector<f64>,
    pub offset: DVector<f64>,
    pub lower: f64,
    pub upper: f64,
    /// What may be beyond these limits; nothing in double precision.
    pub reserve: Reserve,
}

impl TwoSided {
    pub fn facets(&self) -> usize {
        usize::from(self.lower.is_finite()) + usize::from(self.upper.is_finite())
    }

    /// What the sides that are left mean.
    pub fn name(&self) -> String {
        match (self.lower.is_finite(), self.upper.is_finite()) {
            (true, true) if self.lower_name != self.upper_name => format!("{}, {}", self.lower_name, self.upper_name),
            (true, _) => self.lower_name.clone(),
            _ => self.upper_name.clone(),
        }
    }

    fn symmetric(
        kind: RowKind,
        ordinal: usize,
        name: String,
        g: DVector<f64>,
        offset: DVector<f64>,
        limit: f64,
        reserve: Reserve,
    ) -> Self {
        Self {
            kind,
            ordinal,
            lower_name: name.clone(),
            upper_name: name,
            g,
            offset,
            lower: -limit,
            upper: limit,
            reserve,
        }
    }
}

impl Condensed {
    pub fn new(s: &Subsystem, g: &SubsystemGains, sized: &SubsystemSizing, rounding: &Rounding, N: usize) -> Self {
        let dx = predictions(s, N);
        let du: Vec<_> = (0..N).map(|k| selection(s, N, k)).collect();
        let mut rows = tube_rows(s, sized, rounding, N);
        for (k, dx) in dx[..N].iter().enumerate() {
            let reserve = |row: DVector<f64>, h: f64| rounding.at_stage(&SignalRow::of_states(s, row), h, k);
            rows.extend(stage_rows(&s.X, &sized.X_nom, dx, RowKind::State(k), k, reserve));
        }
        for (k, du) in du.iter().enumerate() {
            let reserve = |row: DVector<f64>, h: f64| rounding.at_stage(&SignalRow::of_inputs(s, row), h, k);
            rows.extend(stage_rows(&s.U, &sized.U_nom, du, RowKind::Input(k), k, reserve));
        }
        for k in 0..N {
            rows.extend(coupling_rows(s, sized, rounding, (&dx[k], &du[k]), k));
        }
        rows.extend(terminal_rows(s, sized, rounding, &dx[N], N));
        rows.retain(|row| row.g.amax() > 0.0);
        Self { H: hessian(s, g, &dx, &du), rows }
    }

    /// One-sided inequalities in the problem.
    pub fn facets(&self) -> usize {
        self.rows.iter().map(TwoSided::facets).sum()
    }
}

/// dx_0, ..., dx_N as matrices on v.
fn predictions(s: &Subsystem, N: usize) -> Vec<DMatrix<f64>> {
    let mut dx = vec![DMatrix::identity(s.n(), s.n() + N * s.m())];
    for k in 0..N {
        dx.push(&s.A * &dx[k] + &s.B * selection(s, N, k));
    }
    dx
}

/// du_k as a matrix on v.
fn selection(s: &Subsystem, N: usize, k: usize) -> DMatrix<f64> {
    let (n, m) = (s.n(), s.m());
    DMatrix::from_fn(m, n + N * m, |i, j| f64::from(j == n + k * m + i))
}

/// (34).
fn hessian(s: &Subsystem, g: &SubsystemGains, dx: &[DMatrix<f64>], du: &[DMatrix<f64>]) -> DMatrix<f64> {
    let N = du.len();
    let mut H = dx[N].transpose() * &g.P * &dx[N];
    for (dx, du) in dx.iter().zip(du) {
        H += dx.transpose() * &s.Q * dx + du.transpose() * &s.R * du;
    }
    (&H + H.transpose()) * 0.5
}

/// (35a): |P (e - dx_0)| <= q.
fn tube_rows(s: &Subsystem, sized: &SubsystemSizing, rounding: &Rounding, N: usize) -> Vec<TwoSided> {
    let E = &sized.E;
    let row = |r: usize| {
        let P = E.P.row(r).transpose();
        let mut g = DVector::zeros(s.n() + N * s.m());
        g.rows_mut(0, s.n()).copy_from(&-&P);
        let name = format!("(35a) x - xhat in E, normal {}", r + 1);
        let reserve = rounding.of_set(&SignalRow::of_states(s, P.clone()), E.q[r], 0);
        TwoSided::symmetric(RowKind::Tube, r, name, g, P, E.q[r] - reserve.exact, reserve)
    };
    (0..E.q.len()).map(row).collect()
}

/// (35c) or (35d) at stage k. Opposite rows become one row with two sides.
fn stage_rows(
    named: &NamedPolytope,
    tightened: &Polytope,
    on_v: &DMatrix<f64>,
    kind: RowKind,
    k: usize,
    reserve: impl Fn(DVector<f64>, f64) -> Reserve,
) -> Vec<TwoSided> {
    let mut rows: Vec<TwoSided> = Vec::new();
    for r in 0..tightened.h.len() {
        let offset = tightened.H.row(r).transpose();
        match rows.iter_mut().find(|row| row.offset == -&offset && row.lower.is_infinite()) {
            Some(opposite) => {
                opposite.lower = -tightened.h[r];
                // What is beyond the smaller limit is less.
                opposite.reserve = opposite.reserve.least(reserve(offset, named.h[r]));
                opposite.lower_name = format!("{} at step {k}", named.rows[r]);
            }
            None => rows.push(TwoSided {
                kind,
                ordinal: r,
                lower_name: String::new(),
                upper_name: format!("{} at step {k}", named.rows[r]),
                g: on_v.tr_mul(&offset),
                reserve: reserve(offset.clone(), named.h[r]),
                offset,
                lower: f64::NEG_INFINITY,
                upper: tightened.h[r],
            }),
        }
    }
    rows
}

/// (35b) at stage k.
fn coupling_rows(
    s: &Subsystem,
    sized: &SubsystemSizing,
    rounding: &Rounding,
    (dx, du): (&DMatrix<f64>, &DMatrix<f64>),
    k: usize,
) -> Vec<TwoSided> {
    let z = &s.Cz * dx + &s.Dz * du;
    let row = |r: usize| {
        let name = format!("(35b) {} near its reference at step {k}", s.coupling_outputs[r]);
        let output = SignalRow::of_output(s, r);
        let (limit, reserve) =
            (sized.dz[r] - rounding.charge(&output, sized.dz[r]), rounding.at_stage(&output, sized.dz[r], k));
        let g = z.row(r).transpose();
        TwoSided::symmetric(RowKind::CouplingOutput(k), r, name, g, DVector::zeros(0), limit, reserve)
    };
    (0..s.nz()).map(row).collect()
}

/// (36).
fn terminal_rows(
    s: &Subsystem,
    sized: &SubsystemSizing,
    rounding: &Rounding,
    dx_N: &DMatrix<f64>,
    N: usize,
) -> Vec<TwoSided> {
    let Sigma = &sized.Sigma;
    let row = |r: usize| {
        let name = format!("(36) terminal set, normal {}", r + 1);
        let P = Sigma.P.row(r).transpose();
        let g = dx_N.tr_mul(&P);
        let reserve = rounding.of_set(&SignalRow::of_states(s, P), Sigma.q[r], N);
        TwoSided::symmetric(RowKind::Terminal, r, name, g, DVector::zeros(0), Sigma.q[r] - reserve.exact, reserve)
    };
    (0..Sigma.q.len()).map(row).collect()
}
