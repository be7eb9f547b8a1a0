//! The right sides of a plan's rows, in coordinates around the rest under the loads of the start.

use nalgebra::{DMatrix, DVector};

use super::MARGIN;
use crate::convex::{Polytope, Strips, multipliers};
use crate::design::Design;
use crate::network::{Start, Subsystem};
use crate::sets::{ReferenceShare, loads, noise_support};

/// Everything a plan must keep.
pub struct Limits {
    pub subsystems: Vec<Own>,
    /// Per coupling constraint: before N, before T, and at T.
    pub coupling: Vec<[f64; 3]>,
}

/// What one subsystem must keep: limits with their margins taken off.
pub struct Own {
    /// Rest under the loads of the start: x, e and u; and M d0.
    pub x: DVector<f64>,
    pub e: DVector<f64>,
    pub u: DVector<f64>,
    pub push: DVector<f64>,
    /// (35a).
    pub tube: DVector<f64>,
    /// Rows of X_i on xref + dx and of U_i on uref + du, before N.
    pub nominal: [DVector<f64>; 2],
    /// The same rows on xref and uref, before N (infinite where nothing rests on them) and from N on.
    pub first: [DVector<f64>; 2],
    pub later: [DVector<f64>; 2],
    /// Natural sizes of states, inputs, eref, x_0 - xhat_0 and dx.
    pub x_unit: DVector<f64>,
    pub u_unit: DVector<f64>,
    pub e_unit: DVector<f64>,
    pub off_unit: DVector<f64>,
    pub dx_unit: DVector<f64>,
    /// Width of each state's range; twice its natural size where it has none.
    pub range: DVector<f64>,
}

impl Limits {
    pub fn new(design: &Design, start: &Start) -> Self {
        let at_rest = rest_under_loads(design, start);
        let own = |i: usize| Own::new(design, i, &at_rest, &start.d0[i]);
        let subsystems = (0..design.network.subsystems.len()).map(own).collect();
        Self { subsystems, coupling: coupling(design) }
    }
}

/// chi at rest under the loads of the start.
fn rest_under_loads(design: &Design, start: &Start) -> DVector<f64> {
    let d0 = start.d0.iter().flat_map(|d| d.iter().copied()).collect::<Vec<_>>();
    let whole = || loads::steady(&design.network, &design.gains).map(|steady| steady * DVector::from_vec(d0.clone()));
    let size = design.network.subsystems.iter().map(|s| s.n() + s.p()).sum();
    if d0.iter().all(|d| *d == 0.0) {
        return DVector::zeros(size);
    }
    whole().unwrap_or_else(|| unreachable!("the sets rest on these steady states: without them there is no design"))
}

impl Own {
    fn new(design: &Design, i: usize, chi: &DVector<f64>, d0: &DVector<f64>) -> Self {
        let (s, g) = (&design.network.subsystems[i], &design.gains.subsystems[i]);
        let (sized, sets) = (&design.sizing.subsystems[i], &design.sets.subsystems[i]);
        let first = design.gains.chi_offset[i];
        let (x, e) = (chi.rows(first, s.n()).into_owned(), chi.rows(first + s.n(), s.p()).into_owned());
        let u = &g.Kx * &x + &g.Ke * &e;
        let (on_x, on_u) = (&s.X.H * &x, &s.U.H * &u);
        let x_rows = Rows { h: &s.X.h, hat: &sized.X_nom.h, rest: &on_x, shares: &sets.x_rows, kept: &sized.x_ref };
        let u_rows = Rows { h: &s.U.h, hat: &sized.U_nom.h, rest: &on_u, shares: &sets.u_rows, kept: &sized.u_ref };
        let (on_sigma_x, on_sigma_u) = (support(&sized.Sigma, &s.X.H), support(&sized.Sigma, &(&s.U.H * &g.K)));
        let free = design.network.start_anywhere;
        let units = Units::new(design, i);
        Self {
            tube: (&sized.E.q - noise_support(&sized.E.P, s) * 2.0) * (1.0 - MARGIN),
            nominal: [x_rows.nominal(), u_rows.nominal()],
            first: [x_rows.first(free), u_rows.first(free)],
            later: [x_rows.later(&on_sigma_x, free), u_rows.later(&on_sigma_u, free)],
            push: &s.loads.M * d0,
            x_unit: units.x,
            u_unit: units.u,
            e_unit: units.e,
            off_unit: units.off,
            dx_unit: units.dx,
            range: range(s, &sets.scales.x),
            x,
            e,
            u,
        }
    }
}

/// The rows of X_i or U_i.
struct Rows<'a> {
    h: &'a DVector<f64>,
    /// Xhat_i or Uhat_i.
    hat: &'a DVector<f64>,
    /// The rows at rest under the loads of the start.
    rest: &'a DVector<f64>,
    shares: &'a [ReferenceShare],
    /// What references take of each row by (25b).
    kept: &'a DVector<f64>,
}

impl Rows<'_> {
    fn each(&self, limit: impl Fn(usize) -> f64) -> DVector<f64> {
        DVector::from_fn(self.h.len(), |r, _| limit(r) - MARGIN * self.h[r])
    }

    fn nominal(&self) -> DVector<f64> {
        self.each(|r| self.hat[r] - self.rest[r])
    }

    fn first(&self, free: bool) -> DVector<f64> {
        self.each(|r| if free { f64::INFINITY } else { self.kept[r] - self.rest[r] })
    }

    fn later(&self, terminal: &[f64], free: bool) -> DVector<f64> {
        let room = |r: usize| self.hat[r] - terminal[r];
        self.each(|r| (if free { room(r) } else { room(r).min(self.kept[r]) }) - self.shares[r].load)
    }
}

/// Upper bounds of a set's support in the rows of `directions`.
fn support(set: &Strips, directions: &DMatrix<f64>) -> Vec<f64> {
    let hull = set.hull();
    let proofs = multipliers(&set.P, &set.q, directions);
    let bounds = proofs.map(|proofs| proofs.iter().map(|proof| proof.bound(&set.q, &hull)).collect());
    bounds.unwrap_or_else(|| vec![f64::INFINITY; directions.nrows()])
}

struct Units {
    x: DVector<f64>,
    u: DVector<f64>,
    e: DVector<f64>,
    off: DVector<f64>,
    dx: DVector<f64>,
}

impl Units {
    fn new(design: &Design, i: usize) -> Self {
        let (s, g) = (&design.network.subsystems[i], &design.gains.subsystems[i]);
        let (sized, x) = (&design.sizing.subsystems[i], &design.sets.subsystems[i].scales.x);
        let U = Polytope { H: s.U.H.clone(), h: s.U.h.clone() };
        let u = widths(&U).map(|width| if width.is_finite() { 0.5 * width } else { 1.0 });
        let e = DVector::from_fn(s.p(), |k, _| match g.Ke.column(k).amax() {
            0.0 => 1.0,
            gain => u.amax() / gain,
        });
        let within = |set: &DVector<f64>| set.zip_map(x, |own, x| if own > 0.0 && own < x { own } else { x });
        Self { off: within(&sized.E.hull()), dx: within(&sized.upset), x: x.clone(), u, e }
    }
}

fn range(s: &Subsystem, scale: &DVector<f64>) -> DVector<f64> {
    let widths = widths(&Polytope { H: s.X.H.clone(), h: s.X.h.clone() });
    widths.zip_map(scale, |width, scale| if width.is_finite() { width } else { 2.0 * scale })
}

/// Width of a set along each axis; infinite where it is unbounded.
fn widths(set: &Polytope) -> DVector<f64> {
    let n = set.H.ncols();
    let reach = |k: usize, sign: f64| {
        let axis = DVector::from_fn(n, |j, _| if j == k { sign } else { 0.0 });
        set.support(&axis).map_or(f64::INFINITY, |(value, _)| value)
    };
    DVector::from_fn(n, |k, _| reach(k, 1.0) + reach(k, -1.0))
}

/// (26) without Delta^chi, with what loads may change from N on, and as it stands.
fn coupling(design: &Design) -> Vec<[f64; 3]> {
    let constraints = design.network.coupling_constraints.iter().enumerate();
    let limits = constraints.map(|(h, c)| {
        let taken: f64 = c.Hz.iter().map(|(&j, row)| row.abs().dot(&design.sizing.subsystems[j].zeta)).sum();
        let (first, margin) = (c.l - taken * (1.0 + MARGIN), MARGIN * c.l);
        let l_tilde = design.sizing.l_tilde[h];
        [first - margin, first - margin - design.sets.coupling_loads[h], l_tilde - MARGIN * l_tilde]
    });
    limits.collect()
}
