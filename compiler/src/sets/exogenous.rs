//! What acts on a subsystem without a neighbour's part in it: disturbances, measurement errors, and what measured loads
//! ([`super::loads`]) leave.
//!
//! # Disturbances
//! The plant is x+ = A_ii x + B_ii u + E_i s + w, w in D_i. The nominal model (15) and the references (7) do without w, so
//! (18) becomes eps+ = F_ii eps + E_i (s - sref) + w, and (20) becomes
//!
//! ```text
//! W_i = E_i S_i + D_i                                                                                    (20')
//! ```
//!
//! The sets on given normals are symmetric: D_i enters by max(h_D(p), h_D(-p)), the support of the smallest symmetric set
//! around it. h_W is linear in zeta plus a constant, so S of Assumption 4 and its radius stay what they were: zeta =
//! (I - S)^-1 (dz + constants). Nothing else changes in (18)-(38).
//!
//! # Measurement errors
//! The controller is given m_t = x_t + v_t, |v_t| <= vbar, in place of x_t, and (17), (38) are
//!
//! ```text
//! u_t = uhat_t + K_i (m_t - xhat_t) = uhat_t + K_i eps_t + K_i v_t,        eps_t = x_t - xhat_t,         (17')
//! eps_{t+1} = F_ii eps_t + B_ii K_i v_t + E_i (s_t - sref_t) + w_t,                                      (18')
//! z_t - zhat_t = (C_zi + D_zi K_i) eps_t + D_zi K_i v_t.
//! ```
//!
//! With V the box of v, E_i the RPI set of (18') under W_i = E_i S_i + D_i + B_ii K_i V, and
//!
//! ```text
//! (C_zi + D_zi K_i) E_i + D_zi K_i V + Delta_i^z in Z_i                                                  (21'), (22')
//! Xhat_i in X_i - E_i,      Uhat_i in U_i - K_i E_i - K_i V                                    ("-": Pontryagin difference)
//! ```
//!
//! x_t - xhat_t in E_i gives x_t in X_i, u_t in U_i, z_t - zref_t in Z_i and x_{t+1} - xhat_{t+1|t} in E_i as before. E_i holds
//! the *true* deviation, which (35a) cannot see. Asking m_t - xhat_t in E_i instead would charge v_{t+1} - A_ii v_t to W_i: on
//! a slow plant that is hundreds of times B_ii K_i V, since the errors of successive steps, which cancel in the sum over
//! F_ii^k, are then counted as if they could not. But x_t is known in two ways: it lies within V of m_t, and within E_i of the forecast
//! xhat_{t|t-1} (whose deviation is in E_i by the line above). With strips |p eps| <= q, hbar = h_V(p), so that
//! p x_t <= min(p m_t + hbar, p xhat_{t|t-1} + q) and likewise from below, (35a) becomes, row by row,
//!
//! ```text
//! min(-(q - hbar), p i_t) <= p (m_t - xhat_t) <= max(q - hbar, p i_t),      i_t = m_t - xhat_{t|t-1}.   (35a')
//! ```
//!
//! (a) (35a') implies x_t - xhat_t in E_i: the upper side says p (m_t - xhat_t) <= q - hbar, hence p (x_t - xhat_t) <= q; or
//!     p xhat_t >= p xhat_{t|t-1}, hence p (x_t - xhat_t) <= p (x_t - xhat_{t|t-1}) <= q. The lower side likewise.
//! (b) The forecast satisfies (35a') with p (m_t - xhat_t) = p i_t, so the candidate (47) stays feasible: the problem is
//!     feasible for ever, and the cost decreases as in the appendix, D.
//! (c) Without errors |p i_t| <= q and (35a') is (35a).
//! (d) Where |p i_t| > q + hbar for a row, the forecast is refuted: some assumption broke. (35a') without i_t then
//!     certifies a new start by the measurement alone, as it does at the first step.
//! (e) The offsets satisfy q >= 2 hbar ([`least_offsets`]): a plant that rests on its reference is then always accepted
//!     with xhat = xref, |p v_t| <= hbar <= q - hbar.
//!
//! # What converges
//! The nominal and the reference layer are free of w and v, so xhat - xref -> 0 and yref converges as in Theorem 1, but
//! x - xref only into the smallest RPI set of the collective (18'), and with it y to a neighbourhood of the set-point.
//! Constraints are kept at all times.
#![expect(non_snake_case, reason = "the paper's symbols")]

use nalgebra::{DMatrix, DVector};

use crate::convex::Bounded;
use crate::gains::SubsystemGains;
use crate::network::Subsystem;
use crate::optim::rounding::sum_upper;
use crate::rounding::Rounding;

/// The part D_i + B_ii K_i V of W_i, M_i times what the loads may have changed since the references knew them, and what single
/// precision rounds.
#[derive(Debug, Clone)]
pub struct Exogenous {
    w: Option<Bounded>,
    /// B_ii K_i, n x n, and |B_ii| |K_i|.
    BK: DMatrix<f64>,
    BK_size: DMatrix<f64>,
    /// Half-widths of V.
    v: DVector<f64>,
    M: DMatrix<f64>,
    /// Half-widths of d - dref.
    lag: DVector<f64>,
    /// Half-widths of what single precision rounds; see [`crate::rounding`].
    rounded: DVector<f64>,
}

impl Exogenous {
    pub fn new(s: &Subsystem, g: &SubsystemGains, rounding: &Rounding, horizon: usize) -> Self {
        Self {
            w: s.w.clone(),
            BK: &s.B * &g.K,
            BK_size: s.B.abs() * g.K.abs(),
            v: s.measurement_error.clone(),
            M: s.loads.M.clone(),
            lag: s.loads.change(horizon - 1),
            rounded: rounding.w.clone(),
        }
    }

    /// Upper bound of the support in the rows of P and in their opposites.
    pub fn support(&self, P: &DMatrix<f64>) -> DVector<f64> {
        let of_v = of_box(&covered(&(P * &self.BK), &(P.abs() * &self.BK_size)), &self.v);
        let of_w = |r: usize| self.w.as_ref().map_or(0.0, |w| w.reach(&P.row(r).transpose()));
        let of_loads = of_box(&covered(&(P * &self.M), &(P.abs() * self.M.abs())), &self.lag);
        let known = DVector::from_fn(P.nrows(), |r, _| sum_upper([of_w(r), of_v[r], of_loads[r]]));
        if self.rounded.amax() > 0.0 { known + of_box(&P.abs(), &self.rounded) * (1.0 + 1e-15) } else { known }
    }
}

/// Upper bound of h_V in the rows of P, which are over the states.
pub fn noise_support(P: &DMatrix<f64>, s: &Subsystem) -> DVector<f64> {
    of_box(&P.abs(), &s.measurement_error)
}

/// Upper bound of the support of K_i V in the rows of D, which are over the inputs.
pub fn noise_through_gain(D: &DMatrix<f64>, s: &Subsystem, g: &SubsystemGains) -> DVector<f64> {
    of_box(&covered(&(D * &g.K), &(D.abs() * g.K.abs())), &s.measurement_error)
}

/// Offsets E_i must have at least on the normals P: see (e) of this module.
pub fn least_offsets(P: &DMatrix<f64>, s: &Subsystem) -> DVector<f64> {
    noise_support(P, s) * 2.0
}

/// |product|, raised by what rounding may have taken: `size` is the product of the factors' absolute values. The products are
/// of at most three factors and a few hundred terms, which 1e-13 relative covers.
fn covered(product: &DMatrix<f64>, size: &DMatrix<f64>) -> DMatrix<f64> {
    product.zip_map(size, |value, size| value.abs() + 1e-13 * size)
}

/// Support of a box of these half-widths, in rows of absolute values.
fn of_box(rows: &DMatrix<f64>, half_widths: &DVector<f64>) -> DVector<f64> {
    DVector::from_fn(rows.nrows(), |r, _| sum_upper(rows.row(r).iter().zip(half_widths).map(|(row, v)| row * v)))
}
