//! What the arithmetic of an emitted controller rounds, and what the sets keep back for it.
//!
//! In double precision that is nothing: the floor of W_i ([`crate::sets::FLOOR`]) is a thousand times larger. In single precision
//! ([`Scalar::Single`]) every number a controller computes may be off by a share u = 2^-24 of the terms it is the sum of, and every
//! number in its tables by u of itself. With gamma = (k + 8) u for sums of up to k terms, and with states, inputs and references
//! inside the boxes around X_i and U_i (single precision needs them bounded), these bounds hold at every step:
//!
//! ```text
//! rx  of xref_{t+1} = A xref + B uref + sum of EL zref_j            gamma (|A| X + |B| U + sum of |EL| Z_j)
//! ru  of uref = Kx xref + Ke eref                                   gamma (|Kx| X + |Ke| e),    |e| <= |Ke^+| (U + |Kx| X)
//! re  of eref_{t+1} = eref + yref - C xref                          gamma (|e| + 2 |C| X)
//! rz  of zref = Cz xref + Dz uref                                   gamma (|Cz| X + |Dz| U)
//! du  of u = uref + du_0 + K (x - xref - dx_0), x as measured       gamma (2 U + 3 |K| X)
//! s   of the shifted candidate's dx_1 = A dx_0 + B du_0             gamma (|A| dX + |B| dU),    dX, dU the widths of the boxes
//! k   of its last input K dx_N                                      |K| (sum over j < N of |A^j| s) + gamma |K| dX
//! hx, hu  of a row over xhat_k or uhat_k, as the runtime evaluates it from the stored dx_0, du_0, ..., du_{N-1}
//! ```
//!
//! # References
//! xref, uref, zref are the numbers that are stored and sent. They obey (7) up to (rx + |B| ru + sum of |EL| (rz_j + |Dz| ru_j), re) per step,
//! and a start may drift by as much as 2 rx ([`Rounding::chi`] is all of it). What that does to a row of (25b) or (26) is the sum
//! over k of |row calF^k| times it; it is charged beside the loads, and ru besides in rows over uref, so that [`ReferenceShare::load`]
//! is about the numbers that are stored.
//!
//! [`ReferenceShare::load`]: crate::sets::ReferenceShare::load
//!
//! # Tube
//! x_{t+1} - xhat_{t+1|t} is as in (18) with rx + s + |B| du added to W_i, and the drift of a start. A candidate is accepted only if the runtime finds it in
//! E_i, hence 2 hx more: [`Rounding::w`] is all of it. u and z are off by du besides: (21), (22'), and U_i.
//!
//! # The i-DPC rows
//! h is worked out for plans within the widths of the boxes. A plan that is not accepted yet may be larger, say M times; then so are
//! its errors, at most, and M widths <= widths - h + M h would have to hold for it to be accepted: M <= 1.
//!
//! A solution or a shifted candidate is used only where every row, as evaluated, is within its limit plus its slack, which the tables
//! state; so it is exactly within its limit plus its [`Reserve`], slack + h. Shifting by one step moves a row to the stage
//! before and its value by at most sigma = |A^k| s (all k) + |B| k, and evaluates it anew: with reserves
//!
//! ```text
//! (N - k) (sigma + 2 h) + r      at stage k                                       X_i - E_i = limit + N (sigma + 2 h) + r
//! ```
//!
//! what was accepted at one step is accepted at the next, for ever. The last stage comes from (36): |Lambda| q <= q - (sigma + 2 h)
//! for Sigma_i in place of (24), and (25a), (25b) with the limits that the tables hold. r is what the solver's own tolerance may
//! take, so that its solutions are accepted as a rule; where one is not, the candidate is, and the guarantee holds.
//!
//! The tables' limits are rounded to the nearest number of single precision inside.
#![expect(non_snake_case, reason = "the paper's symbols")]

use nalgebra::{DMatrix, DVector};

use crate::convex::Polytope;
use crate::diagnostic::{Diagnostic, Diagnostics, Place, code};
use crate::gains::{Gains, SubsystemGains};
use crate::network::{NamedPolytope, Network, Scalar, Signal, Subsystem};
use crate::optim::rounding::to_digits;
use crate::problems::Stages;

/// Half-widths of boxes, in the units of the signals; all 0 in double precision.
#[derive(Debug, Clone)]
pub struct Rounding {
    /// What W_i holds for it.
    pub w: DVector<f64>,
    /// What a step adds to (xref, eref), with the drift of a start.
    pub chi: DVector<f64>,
    /// How far a start may drift per step.
    pub drift: DVector<f64>,
    /// ru, du and rz.
    pub u_ref: DVector<f64>,
    pub u: DVector<f64>,
    pub z: DVector<f64>,
    /// How far yref may be off where it is computed.
    pub y: DVector<f64>,
    /// sigma and h over states and inputs.
    shift: Signals,
    read: Signals,
    /// dx_0, ..., dx_N and du_0, ..., du_{N-1} over w.
    dx: Vec<DMatrix<f64>>,
    du: Vec<DMatrix<f64>>,
    /// The largest |w_k|.
    w_size: f64,
    tolerance: f64,
}

/// A box of states and one of inputs.
#[derive(Debug, Clone)]
struct Signals {
    x: DVector<f64>,
    u: DVector<f64>,
}

/// How far beyond its limit in the tables a row may be.
#[derive(Debug, Clone, Copy, Default)]
pub struct Reserve {
    /// In fact.
    pub exact: f64,
    /// As the runtime sees it.
    pub slack: f64,
}

impl Reserve {
    pub fn least(self, other: Self) -> Self {
        Self { exact: self.exact.min(other.exact), slack: self.slack.min(other.slack) }
    }
}

/// A row of the i-DPC problem over xhat_k or dx_k, and over uhat_k or du_k; empty: zero.
#[derive(Debug, Clone)]
pub struct SignalRow {
    pub x: DVector<f64>,
    pub u: DVector<f64>,
}

/// Largest magnitudes of the signals of one subsystem.
struct Ranges {
    x: DVector<f64>,
    u: DVector<f64>,
    z: DVector<f64>,
    /// rz and ru.
    z_off: DVector<f64>,
    u_ref: DVector<f64>,
    /// |eref|.
    e: DVector<f64>,
    /// Widths of the boxes.
    dx: DVector<f64>,
    du: DVector<f64>,
}

/// Of every subsystem.
///
/// # Errors
/// E0132 single precision was asked for with what its proof does not know, or where a state or an input is not bounded.
pub fn roundings(network: &Network, gains: &Gains) -> Result<Vec<Rounding>, Diagnostics> {
    let parts = &network.subsystems;
    if network.scalar == Scalar::Double {
        return Ok(parts.iter().map(Rounding::none).collect());
    }
    is_covered(network)?;
    let ranges = all_ranges(network, gains)?;
    let of = |(i, s): (usize, &Subsystem)| {
        Rounding::single(network, &gains.subsystems[i], &ranges, i).ok_or_else(|| uneven(network, s).into())
    };
    parts.iter().enumerate().map(of).collect()
}

/// # Errors
/// E0132, of every subsystem that has one.
fn all_ranges(network: &Network, gains: &Gains) -> Result<Vec<Ranges>, Diagnostics> {
    let mut errors = Diagnostics::default();
    let ranges = network.subsystems.iter().zip(&gains.subsystems).map(|(s, g)| Ranges::new(network, s, g));
    let ranges: Vec<_> = ranges.map(|ranges| ranges.map_err(|error| errors.push(error)).ok()).collect();
    errors.finish(ranges.into_iter().collect())
}

/// 2^-24.
const UNIT: f64 = f32::EPSILON as f64 / 2.0;

/// What sums of products of up to so many terms round, relative to the sum of their magnitudes: the standard bound is `terms` u,
/// the numbers of the tables are off by one more, sums of a few such sums by one each, and so is what comes in from outside.
fn gamma(terms: usize) -> f64 {
    (terms + 8) as f64 * UNIT
}

impl Rounding {
    /// Nothing: double precision.
    pub fn none(s: &Subsystem) -> Self {
        let zeros = DVector::zeros;
        let signals = || Signals { x: zeros(s.n()), u: zeros(s.m()) };
        Self {
            w: zeros(s.n()),
            chi: zeros(s.n() + s.p()),
            drift: zeros(s.n()),
            u_ref: zeros(s.m()),
            u: zeros(s.m()),
            z: zeros(s.nz()),
            y: zeros(s.p()),
            shift: signals(),
            read: signals(),
            dx: Vec::new(),
            du: Vec::new(),
            w_size: 0.0,
            tolerance: 0.0,
        }
    }

    /// `None` where a stage of the simulation cannot be inverted.
    fn single(network: &Network, g: &SubsystemGains, ranges: &[Ranges], i: usize) -> Option<Self> {
        let (s, own, N) = (&network.subsystems[i], &ranges[i], network.horizon);
        let gamma = gamma(terms(s));
        let (A, B, K) = (s.A.abs(), s.B.abs(), g.K.abs());
        let heard = |of: &dyn Fn(usize) -> DVector<f64>| {
            let gains = s.L.iter().map(|(&j, L)| (&s.E * L).abs() * of(j));
            gains.fold(DVector::zeros(s.n()), |sum, term| sum + term)
        };
        let x_ref = (&A * &own.x + &B * &own.u + heard(&|j| ranges[j].z.clone())) * gamma;
        let y = s.C.abs() * &own.x;
        let drift = &x_ref * 2.0;
        let chi_x = &x_ref
            + &B * &own.u_ref
            + heard(&|j| &ranges[j].z_off + network.subsystems[j].Dz.abs() * &ranges[j].u_ref)
            + &drift;
        let chi = stacked(&chi_x, &((&own.e + &y * 2.0) * gamma));
        let u = (&own.u * 2.0 + &K * &own.x * 3.0) * gamma;
        let simulated = Simulated::new(s, g, N, own, gamma)?;
        let shifted = (&A * &own.dx + &B * &own.du) * gamma;
        let shift = shift(s, &shifted, &((&K * &own.dx) * gamma), &K, N);
        let read = Signals { x: simulated.read.x + (&own.x + &own.dx) * gamma, u: simulated.read.u + &own.u * gamma };
        let w = &x_ref + shifted + &B * &u + &read.x * 2.0 + &drift;
        let z = own.z_off.clone();
        let (dx, du, w_size) = (simulated.dx, simulated.du, simulated.w_size);
        let tolerance = f64::from(dpc_runtime::single::solver::TOLERANCE);
        let u_ref = own.u_ref.clone();
        Some(Self { w, chi, drift, u_ref, u, z, y: y * gamma, shift, read, dx, du, w_size, tolerance })
    }

    /// Whether anything is kept back.
    pub fn is_some(&self) -> bool {
        self.tolerance > 0.0
    }

    /// sigma + 2 h.
    pub fn step(&self, row: &SignalRow) -> f64 {
        row.on(&self.shift) + 2.0 * row.on(&self.read)
    }

    /// h.
    fn read(&self, row: &SignalRow) -> f64 {
        row.on(&self.read)
    }

    /// r: what the solver's tolerance may take of a row with this limit, at any of these stages.
    fn solved(&self, row: &SignalRow, limit: f64, stages: impl Iterator<Item = usize>) -> f64 {
        if !self.is_some() {
            return 0.0;
        }
        let over_w = |k: usize| -> f64 {
            let du = self.du.get(k).map(|du| du.tr_mul(&row.u));
            (self.dx[k].tr_mul(&row.x) + du.unwrap_or_else(|| DVector::zeros(self.dx[k].ncols()))).norm()
        };
        let size = stages.map(over_w).fold(0.0, f64::max);
        self.tolerance * (limit.abs() + size * self.w_size)
    }

    /// A row at this stage, whose limit is at most `limit`.
    pub fn at_stage(&self, row: &SignalRow, limit: f64, stage: usize) -> Reserve {
        let steps = self.du.len().saturating_sub(stage) as f64;
        self.reserve(row, steps * self.step(row) + self.solved(row, limit, 0..self.du.len()))
    }

    /// What X_i - E_i, U_i - K_i E_i and Delta_i^z keep back: the reserve of stage 0.
    pub fn charge(&self, row: &SignalRow, limit: f64) -> f64 {
        self.at_stage(row, limit, 0).exact
    }

    /// A row of E_i or of Sigma_i, over dx_0 or dx_N. It keeps its place when the candidate is shifted, and pays for that in (18) and
    /// (24).
    pub fn of_set(&self, row: &SignalRow, limit: f64, stage: usize) -> Reserve {
        self.reserve(row, self.read(row) + self.solved(row, limit, stage..=stage))
    }

    fn reserve(&self, row: &SignalRow, exact: f64) -> Reserve {
        Reserve { exact, slack: (exact - self.read(row)).max(0.0) }
    }
}

impl SignalRow {
    /// Over states alone.
    pub fn of_states(s: &Subsystem, row: DVector<f64>) -> Self {
        Self { x: row, u: DVector::zeros(s.m()) }
    }

    /// Over inputs alone.
    pub fn of_inputs(s: &Subsystem, row: DVector<f64>) -> Self {
        Self { x: DVector::zeros(s.n()), u: row }
    }

    /// Coupling output `k`.
    pub fn of_output(s: &Subsystem, k: usize) -> Self {
        Self { x: s.Cz.row(k).transpose(), u: s.Dz.row(k).transpose() }
    }

    fn on(&self, signals: &Signals) -> f64 {
        self.x.abs().dot(&signals.x) + self.u.abs().dot(&signals.u)
    }
}

/// What evaluating a row takes: the runtime goes from dx_0, du_0, ... back to w, and from w to the row.
struct Simulated {
    read: Signals,
    dx: Vec<DMatrix<f64>>,
    du: Vec<DMatrix<f64>>,
    w_size: f64,
}

impl Simulated {
    fn new(s: &Subsystem, g: &SubsystemGains, N: usize, ranges: &Ranges, gamma: f64) -> Option<Self> {
        let Stages { T, root, stages } = Stages::new(s, g, N)?;
        let (n, m) = (s.n(), s.m());
        let inverse = |matrix: &DMatrix<f64>| matrix.clone().try_inverse().map(|inverse| inverse.abs());
        // |w| and its rounding errors, stage by stage; those of dx on the way.
        let of_root = inverse(&root)?;
        let mut size = DVector::zeros(T.ncols());
        let mut off = DVector::zeros(T.ncols());
        let w_x = &of_root * &ranges.dx;
        size.rows_mut(0, n).copy_from(&w_x);
        off.rows_mut(0, n).copy_from(&(&of_root * (root.abs() * &w_x) * gamma));
        let mut dx_off = DVector::zeros(n);
        let mut dx = vec![T.rows(0, n).into_owned()];
        let mut du = Vec::new();
        for (k, stage) in stages.iter().enumerate() {
            let of_spread = inverse(&stage.spread)?;
            let fed_back = stage.gain.abs() * &ranges.dx;
            let w = &of_spread * (&ranges.du + &fed_back);
            let terms = stage.spread.abs() * &w + &ranges.du + fed_back * 2.0;
            let w_off = &of_spread * terms * gamma;
            let place = n + k * m;
            size.rows_mut(place, m).copy_from(&w);
            off.rows_mut(place, m).copy_from(&(&of_spread * (stage.gain.abs() * &dx_off) + &w_off));
            let moved = (stage.next.abs() * &ranges.dx + stage.drive.abs() * &w) * gamma;
            dx_off = s.A.abs() * dx_off + stage.drive.abs() * w_off + moved;
            du.push(T.rows(place, m).into_owned());
            dx.push(&s.A * &dx[k] + &s.B * &du[k]);
        }
        let all = off + &size * self::gamma(T.ncols());
        let worst = |maps: &[DMatrix<f64>], count: usize| {
            maps.iter().fold(DVector::zeros(count), |worst: DVector<f64>, map| worst.sup(&(map.abs() * &all)))
        };
        let read = Signals { x: worst(&dx, n), u: worst(&du, m) };
        Some(Self { read, dx, du, w_size: size.amax() })
    }
}

/// sigma: what shifting a candidate adds to its states and to its last input, from what it adds to dx_1 and what K dx_N rounds.
fn shift(s: &Subsystem, shifted: &DVector<f64>, fed_back: &DVector<f64>, K: &DMatrix<f64>, N: usize) -> Signals {
    let mut power = DMatrix::identity(s.n(), s.n());
    let (mut worst, mut sum) = (DVector::zeros(s.n()), DVector::zeros(s.n()));
    for _ in 0..N {
        let now = power.abs() * shifted;
        worst = now.sup(&worst);
        sum += now;
        power *= &s.A;
    }
    let u = K * sum + fed_back;
    Signals { x: (power.abs() * shifted).sup(&worst) + s.B.abs() * &u, u }
}

impl Ranges {
    fn new(network: &Network, s: &Subsystem, g: &SubsystemGains) -> Result<Self, Diagnostic> {
        let (x, dx) = hull(&s.X, &s.states).map_err(|signal| unbounded(network, s, signal, "state"))?;
        let (u, du) = hull(&s.U, &s.inputs).map_err(|signal| unbounded(network, s, signal, "input"))?;
        Self::of(s, g, (x, dx), (u, du)).ok_or_else(|| uneven(network, s))
    }

    /// Of signals with these largest magnitudes and widths; `None` where they are too large or uneven to compute with.
    fn of(
        s: &Subsystem,
        g: &SubsystemGains,
        (x, dx): (DVector<f64>, DVector<f64>),
        (u, du): (DVector<f64>, DVector<f64>),
    ) -> Option<Self> {
        let z = s.Cz.abs() * &x + s.Dz.abs() * &u;
        let z_off = &z * gamma(s.n() + s.m());
        let Kx = g.Kx.abs() * &x;
        let e = left_inverse(&g.Ke)? * (&u + &Kx);
        let u_ref = (Kx + g.Ke.abs() * &e) * gamma(terms(s));
        let all = [&x, &u, &z, &e];
        if !all.iter().all(|range| range.iter().all(|size| *size <= LARGEST)) {
            return None;
        }
        Some(Self { x, u, z, z_off, u_ref, e, dx, du })
    }

    /// The same without one signal, a state or after all states an input.
    fn without(&self, s: &Subsystem, g: &SubsystemGains, signal: usize) -> Option<Self> {
        let (mut x, mut dx, mut u, mut du) = (self.x.clone(), self.dx.clone(), self.u.clone(), self.du.clone());
        let (size, width) = match signal.checked_sub(s.n()) {
            None => (&mut x[signal], &mut dx[signal]),
            Some(input) => (&mut u[input], &mut du[input]),
        };
        (*size, *width) = (0.0, 0.0);
        Self::of(s, g, (x, dx), (u, du))
    }
}

/// Numbers beyond this are none that the runtime computes with: their squares and products have to be finite too.
const LARGEST: f64 = 1e11;

/// Terms of the longest sum over the signals of a subsystem and what it imports.
fn terms(s: &Subsystem) -> usize {
    s.n() + s.m() + s.p() + s.L.values().map(|L| L.ncols()).sum::<usize>()
}

/// |M^+| of a matrix with independent columns, raised by what double precision may have lost of it.
fn left_inverse(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let size = matrix.amax();
    let scaled = matrix / size;
    let inverse = scaled.tr_mul(&scaled).try_inverse()? * scaled.transpose();
    let off = (&inverse * &scaled - DMatrix::identity(matrix.ncols(), matrix.ncols())).amax();
    (off < 1e-3 / matrix.ncols() as f64).then(|| inverse.abs() * (1.01 / size))
}

/// Largest magnitude and width of every entry over a set: support values from the dual side, which are upper bounds up to rounding.
///
/// # Errors
/// The first signal that has no bound.
fn hull<'a>(set: &NamedPolytope, signals: &'a [Signal]) -> Result<(DVector<f64>, DVector<f64>), &'a Signal> {
    let polytope = Polytope { H: set.H.clone(), h: set.h.clone() };
    let (mut most, mut width) = (DVector::zeros(signals.len()), DVector::zeros(signals.len()));
    for (k, signal) in signals.iter().enumerate() {
        let axis = |sign: f64| DVector::from_fn(signals.len(), |j, _| if j == k { sign } else { 0.0 });
        let end = |sign: f64| polytope.support(&axis(sign)).map(|(value, _)| value * (1.0 + 1e-6)).ok_or(signal);
        let (high, low) = (end(1.0)?, end(-1.0)?);
        (most[k], width[k]) = (high.max(low), high + low);
    }
    Ok((most, width))
}

fn stacked(a: &DVector<f64>, b: &DVector<f64>) -> DVector<f64> {
    DVector::from_iterator(a.len() + b.len(), a.iter().chain(b).copied())
}

/// Where single precision was asked for, what to say there, and how to do without.
pub(crate) fn asked(network: &Network) -> (Place, &'static str, &'static str) {
    match (network.places.scalar.clone(), network.stated_scalar()) {
        (Some(place), Scalar::Single) => {
            (place, "single precision is asked for here", "write scalar = \"f64\", or leave the key out")
        }
        (place, _) => {
            let name = network.places.horizon.clone().unwrap_or_default();
            (place.unwrap_or(name), "single precision is asked for by `--scalar f32`", "leave out --scalar f32")
        }
    }
}

/// # Errors
/// All that a controller in single precision cannot have yet.
fn is_covered(network: &Network) -> Result<(), Diagnostics> {
    let mut errors = Diagnostics::default();
    let (here, asked, way_out) = asked(network);
    let mut refuse = |place: Option<&Place>, what: &str| {
        let error = Diagnostic::error(code::SINGLE_PRECISION, format!("{what} need double precision"));
        let error = error.at(place.unwrap_or(&here).clone(), "what rounding does to these is not bounded");
        let error = if place.is_some() { error.at(here.clone(), asked) } else { error };
        errors.push(error.help(way_out));
    };
    for s in &network.subsystems {
        if s.measurement_error.amax() > 0.0 {
            refuse(s.places.measurement_error.as_ref(), "measurement errors");
        }
        if !s.loads.is_empty() {
            refuse(s.places.loads.as_ref(), "measured loads");
        }
    }
    for constraint in &network.changing_constraints {
        refuse(Some(&constraint.place), "changing constraints");
    }
    if network.start_anywhere || network.start.is_some() {
        refuse(None, "start-up plans");
    }
    errors.finish(Some(()))
}

fn unbounded(network: &Network, s: &Subsystem, signal: &Signal, kind: &str) -> Diagnostic {
    let (place, label, _) = asked(network);
    let bounds = if kind == "state" { &s.places.X } else { &s.places.U };
    Diagnostic::error(code::SINGLE_PRECISION, format!("single precision needs bounds of `{}`", signal.name))
        .at(place, label)
        .at(s.places.or_header(bounds), format!("{kind} `{}` of `{}` has no bound on one side", signal.name, s.name))
        .note("what rounding takes of the constraints is worked out from the largest values the signals can have")
        .help(format!(
            "bound it by what `{}` cannot exceed, and not much more generously: rounding is relative to it; or compute in f64",
            signal.name
        ))
}

fn uneven(network: &Network, s: &Subsystem) -> Diagnostic {
    let (place, label, _) = asked(network);
    Diagnostic::error(code::SINGLE_PRECISION, format!("subsystem `{}` needs double precision", s.name))
        .at(place, label)
        .note("its weights or gains are too close to singular, or its signals too large, for what rounding takes to be bounded")
        .help("write scalar = \"f64\", or scale the units so that weights are of similar size")
}

/// The row of X_i x U_i that rounding takes the largest share of, and the signal whose range has the largest part in that: in
/// words, with numbers; `None` where nothing can be said. `gains` are of a design in double precision.
pub(crate) fn largest_share(network: &Network, gains: &Gains) -> Option<String> {
    let ranges = all_ranges(network, gains).ok()?;
    let worst = |i: usize| Some((i, shares(network, gains, &ranges, i)?));
    let of_each = (0..ranges.len()).filter_map(worst).filter_map(|(i, shares)| {
        let (row, share) = shares.iter().copied().enumerate().max_by(|(_, a), (_, b)| a.total_cmp(b))?;
        Some((i, row, share))
    });
    let (i, row, share) = of_each.max_by(|(.., a), (.., b)| a.total_cmp(b))?;
    let s = &network.subsystems[i];
    let name = s.X.rows.iter().chain(&s.U.rows).nth(row)?;
    let taken = format!("rounding alone takes {} % of `{name}` of `{}` or more", to_digits(100.0 * share, 3), s.name);
    let part = contributor(network, gains, ranges, i, (row, share));
    Some(taken + &part.map_or(String::new(), |part| format!(", and most of that comes from {part}")))
}

/// `` the range of `h`, up to 1000 cm (98 % of it) ``: everything is linear in the ranges.
fn contributor(
    network: &Network,
    gains: &Gains,
    mut ranges: Vec<Ranges>,
    i: usize,
    (row, share): (usize, f64),
) -> Option<String> {
    let (s, g) = (&network.subsystems[i], &gains.subsystems[i]);
    let mut parts = Vec::new();
    for (signal, named) in s.states.iter().chain(&s.inputs).enumerate() {
        let size = ranges[i].x.iter().chain(&ranges[i].u).nth(signal).copied()?;
        let Some(without) = ranges[i].without(s, g, signal) else { continue };
        let whole = std::mem::replace(&mut ranges[i], without);
        let rest = shares(network, gains, &ranges, i).map(|shares| shares[row]);
        ranges[i] = whole;
        parts.extend(rest.map(|rest| (1.0 - rest / share, size, named)));
    }
    let (part, size, named) = parts.into_iter().max_by(|(a, ..), (b, ..)| a.total_cmp(b))?;
    let (size, unit) = (to_digits(size, 4), named.unit_suffix());
    Some(format!("the range of `{}`, up to {size}{unit} ({:.0} % of it)", named.name, 100.0 * part))
}

/// Steps of the tube that are summed: fewer than all, so that the shares are no larger than they are.
const STEPS: usize = 1000;

/// Of each row of X_i and U_i, what the rounding of this subsystem takes by itself, directly and through the tube.
fn shares(network: &Network, gains: &Gains, ranges: &[Ranges], i: usize) -> Option<Vec<f64>> {
    let (s, g) = (&network.subsystems[i], &gains.subsystems[i]);
    let rounding = Rounding::single(network, g, ranges, i)?;
    let (mut x, mut u) = (s.X.H.clone(), &s.U.H * &g.K);
    let (mut of_x, mut of_u) = (DVector::zeros(x.nrows()), s.U.H.abs() * &rounding.u);
    for _ in 0..STEPS {
        of_x += x.abs() * &rounding.w;
        of_u += u.abs() * &rounding.w;
        (x, u) = (x * &g.F, u * &g.F);
    }
    let over_x = (0..s.X.h.len()).map(|r| {
        let row = SignalRow::of_states(s, s.X.H.row(r).transpose());
        (of_x[r] + rounding.charge(&row, s.X.h[r])) / s.X.h[r]
    });
    let over_u = (0..s.U.h.len()).map(|r| {
        let row = SignalRow::of_inputs(s, s.U.H.row(r).transpose());
        (of_u[r] + rounding.charge(&row, s.U.h[r])) / s.U.h[r]
    });
    Some(over_x.chain(over_u).collect())
}
