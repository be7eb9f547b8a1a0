//! Steps 2 and 3 of the off-line design: the shapes of the sets, their invariance multipliers, the support sums of
//! Delta^chi, and the small gain.
#![expect(non_snake_case, reason = "the paper's symbols")]

pub mod exogenous;
pub mod loads;

use std::collections::BTreeMap;

use lapack_symbols::singular_values;
use nalgebra::{DMatrix, DVector};

use crate::convex::{Invariant, Polytope, PowerSum, multiplier, multipliers, rpi_at_least};
use crate::diagnostic::{Diagnostic, Diagnostics, code};
use crate::gains::{Gains, SubsystemGains};
use crate::network::{Network, Subsystem};
use crate::optim::lyapunov::{Contraction, spectral_radius};
use crate::optim::modes::modal_normals;
use crate::optim::rounding::sum_upper;
pub use exogenous::{Exogenous, least_offsets, noise_support, noise_through_gain};

/// After this point: on the normals of each E_i a robustly positively invariant set exists, on those of each Sigma_i
/// a positively invariant one, both with their multipliers; the small-gain matrix has a spectral radius below 1 and
/// so has its counterpart on these normals; every truncated sum carries a proved tail.
#[derive(Debug, Clone)]
pub struct Sets {
    pub subsystems: Vec<SubsystemSets>,
    /// S of Assumption 4, over the coupling outputs of all subsystems: with boxes, Z_i that satisfy (21) exist if and
    /// only if its spectral radius is below 1.
    pub small_gain: DMatrix<f64>,
    pub rho_small_gain: f64,
    /// The same radius with E_i restricted to its normals.
    pub rho_on_normals: f64,
    /// First coupling output of each subsystem in `small_gain`.
    pub z_offset: Vec<usize>,
    /// Per coupling constraint and member j: support of Delta_j^chi in direction `H_h^[j] [C_j 0]`, per unit of epsilon.
    pub coupling: Vec<BTreeMap<usize, f64>>,
    /// Per coupling constraint: what transients of the loads take of it (at rest they take nothing, C chi_ss = yref).
    pub coupling_loads: Vec<f64>,
}

#[derive(Debug, Clone)]
pub struct SubsystemSets {
    /// E_i.
    pub tube: Shape,
    /// Sigma_i.
    pub terminal: Shape,
    /// |w_k| <= floor_k: the part of W_i that stands for finite arithmetic; see [`FLOOR`].
    pub floor: DVector<f64>,
    /// The rest of W_i that no neighbour has a part in.
    pub exogenous: Exogenous,
    /// Natural size of each state, coupling output and output: where caps and smallest sizes are taken from.
    pub scales: Scales,
    /// The rows of X_i and of U_i, as seen by the references.
    pub x_rows: Vec<ReferenceShare>,
    pub u_rows: Vec<ReferenceShare>,
}

/// How support values of Delta^chi in the rows of X_i and U_i are summed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sums {
    /// With proved tails and rounding: for a design.
    Proved,
    /// To about a percent, in a fraction of the time: to compare gains.
    Estimated,
}

/// Normals of an invariant set, rows of unit length, with its offsets and multipliers at a nominal size.
#[derive(Debug, Clone)]
pub struct Shape {
    pub normals: DMatrix<f64>,
    pub set: Invariant,
}

/// Natural sizes of the signals of one subsystem.
#[derive(Debug, Clone)]
pub struct Scales {
    pub x: DVector<f64>,
    pub z: DVector<f64>,
    pub y: DVector<f64>,
}

impl Scales {
    /// By the bounds of the states, and what is asked of outputs and coupling outputs.
    fn new(s: &Subsystem) -> Self {
        let x = state_scale(s);
        let u = DVector::from_element(s.m(), 1.0);
        let z = s.Cz.abs() * &x + s.Dz.abs() * u;
        let y = s.C.abs() * &x;
        let asked = |k: usize| s.cover[k].map_or(0.0, |(low, high)| high.max(-low));
        Self {
            z: DVector::from_fn(z.len(), |k, _| z[k].max(s.reserve[k])),
            y: DVector::from_fn(y.len(), |k, _| y[k].max(asked(k))),
            x,
        }
    }
}

/// What the references may take of one row of X_i x U_i, (25b).
#[derive(Debug, Clone)]
pub struct ReferenceShare {
    /// Support of Delta_i^chi in the row's direction, per unit of epsilon.
    pub rate: f64,
    /// The row on the steady state of (9): coefficients over the collective y.
    pub steady: DVector<f64>,
    /// Bound of the rounding error of each entry of `steady`.
    pub steady_error: f64,
    /// Bound of the row on the transient of a start that drifts by the floor in every state of the network.
    pub drift: f64,
    /// Upper bound of the loads' share in the row; see [`loads`].
    pub load: f64,
}

/// W_i = E_i S_i is usually flat and may be {0}; real arithmetic is neither. Every W_i therefore contains a box of
/// this half-width relative to the tighter bound of each state, which makes E_i full-dimensional ("an arbitrarily small
/// positively invariant set", Section V) and covers the rounding of the on-line step.
pub const FLOOR: f64 = 1e-8;

impl Sets {
    /// # Errors
    /// E0301 the small-gain radius is not below 1 (Assumption 4); E0302 no invariant set was found on any normals
    /// tried; E0303 the normals tried lose too much for Assumption 4.
    pub fn new(network: &Network, gains: &Gains) -> Result<Self, Diagnostics> {
        Self::with_sums(network, gains, Sums::Proved)
    }

    /// [`Sets::new`] with support values of Delta^chi as far as `sums` says.
    ///
    /// # Errors
    /// As [`Sets::new`].
    pub fn with_sums(network: &Network, gains: &Gains, sums: Sums) -> Result<Self, Diagnostics> {
        let z_offset = z_offsets(network);
        let small_gain = small_gain(network, &gains.subsystems, &z_offset);
        let rho_small_gain = spectral_radius(&small_gain);
        if rho_small_gain.is_nan() || rho_small_gain >= 1.0 {
            return Err(small_gain_fails(network, &small_gain, &z_offset, rho_small_gain).into());
        }
        let zeta = nominal_zeta(network, &small_gain, &z_offset);
        let references = References::new(network, gains)?;
        let (shapes, rho_on_normals) = tubes(network, gains, &zeta, &z_offset)?;
        let mut subsystems = Vec::new();
        let shares = references.shares(network, gains, sums);
        for ((i, tube), (x_rows, u_rows)) in shapes.into_iter().enumerate().zip(shares) {
            let (s, g) = (&network.subsystems[i], &gains.subsystems[i]);
            let terminal = terminal(s, g, network.wishes.facet_loss)?;
            let (exogenous, scales) = (Exogenous::new(s, g, network.horizon), Scales::new(s));
            subsystems.push(SubsystemSets { tube, terminal, floor: floor(s), exogenous, scales, x_rows, u_rows });
        }
        let coupling = references.coupling(network);
        let coupling_loads = references.coupling_loads(network);
        Ok(Self { subsystems, small_gain, rho_small_gain, rho_on_normals, z_offset, coupling, coupling_loads })
    }

    /// The sets for other calK_i: all but Delta^chi follows from the K_i, which must be those `self` was made for.
    ///
    /// # Errors
    /// E0304 the steady states cannot be computed to working accuracy.
    pub fn with_references(&self, network: &Network, gains: &Gains, sums: Sums) -> Result<Self, Diagnostics> {
        let references = References::new(network, gains)?;
        let mut sets = self.clone();
        sets.coupling = references.coupling(network);
        sets.coupling_loads = references.coupling_loads(network);
        let shares = references.shares(network, gains, sums);
        for (subsystem, (x_rows, u_rows)) in sets.subsystems.iter_mut().zip(shares) {
            (subsystem.x_rows, subsystem.u_rows) = (x_rows, u_rows);
        }
        Ok(sets)
    }
}

/// S of Assumption 4 with its spectral radius; rows of subsystem i depend on K_i alone.
pub fn small_gain_matrix(network: &Network, gains: &[SubsystemGains]) -> (DMatrix<f64>, f64) {
    let S = small_gain(network, gains, &z_offsets(network));
    let rho = spectral_radius(&S);
    (S, rho)
}

/// The small-gain radius with these K_i; `None` where some F_ii is not stable.
pub fn small_gain_radius(network: &Network, K: &[DMatrix<f64>]) -> Option<f64> {
    let z_offset = z_offsets(network);
    let size = network.subsystems.iter().map(Subsystem::nz).sum();
    let mut S = DMatrix::zeros(size, size);
    for (i, (s, K)) in network.subsystems.iter().zip(K).enumerate() {
        let F = &s.A + &s.B * K;
        for (j, block) in small_gain_rows(s, K, &F, &Contraction::new(&F)?) {
            S.view_mut((z_offset[i], z_offset[j]), block.shape()).copy_from(&block);
        }
    }
    Some(spectral_radius(&S))
}

/// The rows of S that belong to subsystem i, by neighbour: the sum over k of |(C_zi + D_zi K) F^k E_i L_ij| for
/// F = A_ii + B_ii K with its proof of contraction.
pub fn small_gain_rows(
    s: &Subsystem,
    K: &DMatrix<f64>,
    F: &DMatrix<f64>,
    contraction: &Contraction,
) -> BTreeMap<usize, DMatrix<f64>> {
    let z_rows = &s.Cz + &s.Dz * K;
    s.L.iter().map(|(&j, L)| (j, power_sum(&z_rows, F, contraction, &(&s.E * L)))).collect()
}

/// The largest share of the room in a row of X_i or U_i that references take per unit of epsilon.
///
/// # Errors
/// E0304 the steady states cannot be computed to working accuracy.
pub fn worst_reference_share(network: &Network, gains: &Gains) -> Result<f64, Diagnostics> {
    let references = References::new(network, gains)?;
    let mut worst: f64 = 0.0;
    for (s, (x_rows, u_rows)) in network.subsystems.iter().zip(references.shares(network, gains, Sums::Estimated)) {
        let rows = x_rows.iter().zip(&s.X.h).chain(u_rows.iter().zip(&s.U.h));
        worst = rows.fold(worst, |worst, (row, limit)| worst.max(row.rate / limit));
    }
    Ok(worst)
}

/// What neighbour j's deviation does to the rows of P: |P E_i L_ij|, r x (coupling outputs of j).
pub fn import_gain(P: &DMatrix<f64>, s: &Subsystem, j: usize) -> DMatrix<f64> {
    // Three products of at most a few hundred terms: 1e-13 relative covers their rounding.
    (P.abs() * s.E.abs() * s.L[&j].abs()).zip_map(&(P * &s.E * &s.L[&j]), |size, value| value.abs() + 1e-13 * size)
}

/// Support of the floor box in the rows of P.
pub fn floor_support(P: &DMatrix<f64>, floor: &DVector<f64>) -> DVector<f64> {
    DVector::from_fn(P.nrows(), |r, _| sum_upper(P.row(r).iter().zip(floor).map(|(p, w)| p.abs() * w)))
}

/// Rows in which E_i and Sigma_i are needed: those of X_i, of U_i through K_i, and of z_i.
pub fn needed_directions(s: &Subsystem, g: &SubsystemGains) -> DMatrix<f64> {
    stack(&[&s.X.H, &(&s.U.H * &g.K), &closed_loop_z(s, g)])
}

/// C_zi + D_zi K_i.
pub fn closed_loop_z(s: &Subsystem, g: &SubsystemGains) -> DMatrix<f64> {
    &s.Cz + &s.Dz * &g.K
}

fn stack(parts: &[&DMatrix<f64>]) -> DMatrix<f64> {
    let rows: Vec<_> = parts.iter().flat_map(|part| part.row_iter()).collect();
    if rows.is_empty() { DMatrix::zeros(0, parts[0].ncols()) } else { DMatrix::from_rows(&rows) }
}

fn z_offsets(network: &Network) -> Vec<usize> {
    let sizes = network.subsystems.iter().map(Subsystem::nz);
    sizes.scan(0, |next, size| Some(std::mem::replace(next, *next + size))).collect()
}

/// How far each state may go from 0 in the direction in which it is bounded more tightly; 1 where nothing bounds it.
fn state_scale(s: &Subsystem) -> DVector<f64> {
    let X = Polytope { H: s.X.H.clone(), h: s.X.h.clone() };
    let reach = |k: usize, sign: f64| {
        let axis = DVector::from_fn(s.n(), |j, _| if j == k { sign } else { 0.0 });
        X.support(&axis).map_or(f64::INFINITY, |(value, _)| value)
    };
    DVector::from_fn(s.n(), |k, _| {
        let scale = reach(k, 1.0).min(reach(k, -1.0));
        if scale.is_finite() && scale > 0.0 { scale } else { 1.0 }
    })
}

/// Half-widths of the box in W_i that stands for finite arithmetic.
fn floor(s: &Subsystem) -> DVector<f64> {
    state_scale(s) * FLOOR
}

/// S_ij = sum over k of |(C_zi + D_zi K_i) F_ii^k E_i L_ij|, entrywise, with the tail in the norm of F_ii.
fn small_gain(network: &Network, gains: &[SubsystemGains], z_offset: &[usize]) -> DMatrix<f64> {
    let size = network.subsystems.iter().map(Subsystem::nz).sum();
    let mut S = DMatrix::zeros(size, size);
    for (i, s) in network.subsystems.iter().enumerate() {
        let g = &gains[i];
        for (j, block) in small_gain_rows(s, &g.K, &g.F, &g.contraction) {
            S.view_mut((z_offset[i], z_offset[j]), block.shape()).copy_from(&block);
        }
    }
    S
}

/// Upper bound of sum over k of |C F^k B|, entrywise.
fn power_sum(C: &DMatrix<f64>, F: &DMatrix<f64>, contraction: &Contraction, B: &DMatrix<f64>) -> DMatrix<f64> {
    let columns: Vec<f64> = B.column_iter().map(|b| contraction.norm(&b.into_owned())).collect();
    let geometric = 1.0 / (1.0 - contraction.lambda);
    let mut sum = DMatrix::zeros(C.nrows(), B.ncols());
    let mut row = C.clone();
    loop {
        let dual: Vec<f64> = row.row_iter().map(|c| contraction.dual_norm(&c.transpose())).collect();
        let tail = DMatrix::from_fn(C.nrows(), B.ncols(), |i, j| dual[i] * columns[j] * geometric);
        if tail.iter().zip(&sum).all(|(tail, sum)| *tail <= 1e-10 * sum || *tail < f64::MIN_POSITIVE) {
            // The relative rounding of the powers stays far below 1e-9 for every contraction that could be proved.
            return (sum + tail) * (1.0 + 1e-9);
        }
        sum += (&row * B).abs();
        row *= F;
    }
}

/// Half-widths of Z_i for Delta_i^z of natural size: (I - S)^-1 times the range of z.
fn nominal_zeta(network: &Network, S: &DMatrix<f64>, z_offset: &[usize]) -> DVector<f64> {
    let n = S.nrows();
    let mut dz = DVector::zeros(n);
    if n == 0 {
        return dz;
    }
    for (i, s) in network.subsystems.iter().enumerate() {
        let range = s.Cz.abs() * state_scale(s) + s.Dz.abs() * DVector::from_element(s.m(), 1.0);
        dz.rows_mut(z_offset[i], s.nz()).copy_from(&range.map(|r| 0.01 * r.max(1e-6)));
    }
    (DMatrix::identity(n, n) - S).lu().solve(&dz).unwrap_or(dz)
}

/// Normals and nominal tube of every subsystem, with the radius of the small gain on these normals. More powers of
/// F_ii are added as normals until that radius is below 1.
fn tubes(
    network: &Network,
    gains: &Gains,
    zeta: &DVector<f64>,
    z_offset: &[usize],
) -> Result<(Vec<Shape>, f64), Diagnostics> {
    let mut last = f64::INFINITY;
    for fewest in 0..MORE_POWERS {
        let mut shapes = Vec::new();
        for (i, s) in network.subsystems.iter().enumerate() {
            let g = &gains.subsystems[i];
            let exogenous = Exogenous::new(s, g, network.horizon);
            let r = |P: &DMatrix<f64>| (disturbance(P, s, zeta, z_offset) + exogenous.support(P), least_offsets(P, s));
            let made = shape(s, g, fewest, network.wishes.facet_loss, r);
            shapes.push(made.ok_or_else(|| no_invariant_set(s, g, "E_i"))?);
        }
        last = spectral_radius(&loop_matrix(network, gains, &shapes, z_offset));
        if last < 1.0 - 1e-6 {
            return Ok((shapes, last));
        }
    }
    Err(normals_lose_too_much(network, last).into())
}

const MORE_POWERS: usize = 6;

/// Support of W_i, Z_j boxes of half-widths zeta, in the rows of P.
fn disturbance(P: &DMatrix<f64>, s: &Subsystem, zeta: &DVector<f64>, z_offset: &[usize]) -> DVector<f64> {
    let mut support = floor_support(P, &floor(s));
    for (&j, L) in &s.L {
        support += import_gain(P, s, j) * zeta.rows(z_offset[j], L.ncols());
    }
    support
}

/// The map zeta -> half-widths of (C_zi + D_zi K_i) E_i on the chosen normals, homogeneous part.
fn loop_matrix(network: &Network, gains: &Gains, shapes: &[Shape], z_offset: &[usize]) -> DMatrix<f64> {
    let size = network.subsystems.iter().map(Subsystem::nz).sum();
    let mut matrix = DMatrix::zeros(size, size);
    for (i, s) in network.subsystems.iter().enumerate() {
        let Shape { normals: P, set: tube } = &shapes[i];
        let z_rows = closed_loop_z(s, &gains.subsystems[i]);
        let Some(mu) = multipliers(P, &tube.q, &z_rows) else { continue };
        let mu = DMatrix::from_fn(mu.len(), P.nrows(), |a, b| mu[a].mu[b].abs());
        let size = P.nrows();
        for (&j, L) in &s.L {
            let offsets = (DMatrix::identity(size, size) - tube.abs_Lambda()).lu().solve(&import_gain(P, s, j));
            let block =
                offsets.map_or(DMatrix::from_element(s.nz(), L.ncols(), f64::INFINITY), |offsets| &mu * offsets);
            matrix.view_mut((z_offset[i], z_offset[j]), block.shape()).copy_from(&block);
        }
    }
    matrix
}

/// Sigma_i's normals: positively invariant at the size that a disturbance as large as the state's range would need.
fn terminal(s: &Subsystem, g: &SubsystemGains, loss: f64) -> Result<Shape, Diagnostics> {
    let scale = state_scale(s);
    shape(s, g, 0, loss, |P| (floor_support(P, &scale), DVector::zeros(P.nrows())))
        .ok_or_else(|| no_invariant_set(s, g, "Sigma_i").into())
}

/// Normals on which an invariant set exists: the needed directions, then times powers of F_ii, then with the modes of
/// F_ii, which always admit one where F_ii can be diagonalised; then without those that are not worth their facets.
///
/// They are looked for in states divided by their natural size, so that units do not decide.
fn shape(
    s: &Subsystem,
    g: &SubsystemGains,
    fewest: usize,
    loss: f64,
    r: impl Fn(&DMatrix<f64>) -> Demand,
) -> Option<Shape> {
    let scale = state_scale(s);
    let to_scaled = DMatrix::from_diagonal(&scale);
    let from_scaled = DMatrix::from_diagonal(&scale.map(|x| 1.0 / x));
    let needed = needed_directions(s, g) * &to_scaled;
    let F = &from_scaled * &g.F * &to_scaled;
    let r_scaled = |P: &DMatrix<f64>| r(&(P * &from_scaled));
    let found = scaled_shape(&needed, &F, fewest, loss, &r_scaled)?;
    let normals = unit_rows(found.normals * from_scaled);
    let set = invariant(&normals, &g.F, &r)?;
    Some(Shape { normals, set })
}

fn scaled_shape(
    needed: &DMatrix<f64>,
    F: &DMatrix<f64>,
    fewest: usize,
    loss: f64,
    r: &impl Fn(&DMatrix<f64>) -> Demand,
) -> Option<Shape> {
    let by_powers = (fewest..=fewest + MOST_POWERS).map(|powers| normals(needed, F, powers));
    let by_modes = std::iter::once_with(|| normals(&stack(&[needed, &modal_normals(F)]), F, 0));
    by_powers.chain(by_modes).find_map(|P| {
        let set = invariant(&P, F, r)?;
        Some(fewer_facets(Shape { normals: P, set }, needed, F, loss, r))
    })
}

fn unit_rows(mut rows: DMatrix<f64>) -> DMatrix<f64> {
    rows.row_iter_mut().for_each(|mut row| row /= row.norm());
    rows
}

/// What a set on given normals must take: the support of its disturbance, and its least offsets.
type Demand = (DVector<f64>, DVector<f64>);

fn invariant(P: &DMatrix<f64>, F: &DMatrix<f64>, r: &impl Fn(&DMatrix<f64>) -> Demand) -> Option<Invariant> {
    let (support, least) = r(P);
    rpi_at_least(P, F, &support, &least)
}

const MOST_POWERS: usize = 8;

/// Normals closer than about 1e-4 rad count as one: two of them would only cost accuracy.
const PARALLEL: f64 = 1e-8;

/// Unit rows without repetition: `needed`, what is missing to full rank, and all of these times F, ..., F^powers.
fn normals(needed: &DMatrix<f64>, F: &DMatrix<f64>, powers: usize) -> DMatrix<f64> {
    let n = F.nrows();
    let mut rows: Vec<DVector<f64>> = Vec::new();
    let mut add = |row: DVector<f64>| {
        let norm = row.norm();
        let unit = if norm > 1e-12 { row / norm } else { return };
        if rows.iter().all(|other| other.dot(&unit).abs() < 1.0 - PARALLEL) {
            rows.push(unit);
        }
    };
    let base = stack(&[&complete(needed), &DMatrix::zeros(0, n)]);
    let mut block = base;
    for _ in 0..=powers {
        block.row_iter().for_each(|row| add(row.transpose()));
        block *= F;
    }
    DMatrix::from_rows(&rows.iter().map(|row| row.transpose()).collect::<Vec<_>>())
}

/// `needed` and unit rows for the states it says nothing about, so that the set is bounded.
fn complete(needed: &DMatrix<f64>) -> DMatrix<f64> {
    let n = needed.ncols();
    let mut rows = needed.clone();
    for k in 0..n {
        if rank(&rows) == n {
            break;
        }
        let axis = DMatrix::from_fn(1, n, |_, j| f64::from(j == k));
        let longer = stack(&[&rows, &axis]);
        if rank(&longer) > rank(&rows) {
            rows = longer;
        }
    }
    rows
}

fn rank(rows: &DMatrix<f64>) -> usize {
    if rows.nrows() == 0 {
        return 0;
    }
    let values = singular_values(rows);
    values.map_or(0, |values| values.iter().filter(|value| **value > 1e-9 * values[0]).count())
}

/// Leaves out every normal whose absence costs less than `loss` (relative) in each needed direction.
fn fewer_facets(
    mut shape: Shape,
    needed: &DMatrix<f64>,
    F: &DMatrix<f64>,
    loss: f64,
    r: &impl Fn(&DMatrix<f64>) -> Demand,
) -> Shape {
    let Some(limit) = supports(&shape.normals, &shape.set.q, needed).map(|s| s * (1.0 + loss)) else { return shape };
    for k in (0..shape.normals.nrows()).rev() {
        let normals = shape.normals.clone().remove_row(k);
        if normals.nrows() < normals.ncols() || rank(&normals) < normals.ncols() {
            continue;
        }
        let Some(set) = invariant(&normals, F, r) else { continue };
        let good =
            supports(&normals, &set.q, needed).is_some_and(|support| support.iter().zip(&limit).all(|(s, l)| s <= l));
        if good {
            shape = Shape { normals, set };
        }
    }
    shape
}

fn supports(P: &DMatrix<f64>, q: &DVector<f64>, needed: &DMatrix<f64>) -> Option<DVector<f64>> {
    let values: Option<Vec<f64>> =
        needed.row_iter().map(|row| multiplier(P, q, &row.transpose()).map(|m| m.on(q))).collect();
    values.map(DVector::from_vec)
}

/// The floor of every state of the network, in the places of the collective chi.
fn collective_floor(network: &Network, gains: &Gains) -> DVector<f64> {
    let mut whole = DVector::zeros(gains.calF.nrows());
    for (s, &start) in network.subsystems.iter().zip(&gains.chi_offset) {
        whole.rows_mut(start, s.n()).copy_from(&floor(s));
    }
    whole
}

/// The reference system's steady states and Delta^chi, (9)-(13).
struct References {
    steady: DMatrix<f64>,
    /// Per column of `steady`, its error in the norm of `contraction`.
    steady_error: Vec<f64>,
    sum: PowerSum,
    loads: Option<loads::Response>,
    /// Bound of |(I - calF)^-1 w|_P over the floor boxes w of all states.
    drift: f64,
    contraction: Contraction,
    chi_offset: Vec<usize>,
    size: usize,
}

impl References {
    fn new(network: &Network, gains: &Gains) -> Result<Self, Diagnostics> {
        let steady = gains.steady().ok_or_else(|| no_steady_state(network))?;
        let size = gains.calF.nrows();
        let geometric = 1.0 / (1.0 - gains.contraction.lambda);
        let blur = blur(gains, &steady, &gains.calG);
        let steady_error = steady_error(gains, &steady, &gains.calG);
        let W = -(&gains.calF * &steady);
        // W = -F (I - F)^-1 G: what F does to the error of `steady` is smaller still in a norm that F contracts.
        let rounded = |j: usize| gains.contraction.norm_of_box(&blur.column(j).into_owned());
        let error: Vec<f64> = (0..steady.ncols()).map(|j| steady_error[j] + rounded(j)).collect();
        let blocks = network.subsystems.iter().map(Subsystem::p).collect();
        let sum =
            PowerSum::new(gains.calF.clone(), W, blocks, network.reference.norm, gains.contraction.clone(), &error);
        let contraction = gains.contraction.clone();
        let drift = contraction.norm_of_box(&collective_floor(network, gains)) * geometric;
        let loads = loads::Response::new(network, gains).ok_or_else(|| no_steady_state(network))?;
        Ok(Self { steady, steady_error, sum, loads, drift, contraction, chi_offset: gains.chi_offset.clone(), size })
    }

    /// Per subsystem, the rows of X_i on xref and of U_i on uref = calK chi.
    fn shares(&self, network: &Network, gains: &Gains, sums: Sums) -> Vec<(Vec<ReferenceShare>, Vec<ReferenceShare>)> {
        let directions: Vec<_> = network
            .subsystems
            .iter()
            .zip(&gains.subsystems)
            .enumerate()
            .map(|(i, (s, g))| self.rows(i, s, g))
            .collect();
        let mut rates = self.rates(&directions, sums).into_iter();
        let mut shares = Vec::new();
        for (s, directions) in network.subsystems.iter().zip(directions) {
            let mut x_rows: Vec<_> =
                directions.into_iter().zip(&mut rates).map(|(d, rate)| self.share(&d, rate)).collect();
            let u_rows = x_rows.split_off(s.X.h.len());
            shares.push((x_rows, u_rows));
        }
        shares
    }

    fn rows(&self, i: usize, s: &Subsystem, g: &SubsystemGains) -> Vec<DVector<f64>> {
        let on_u = &s.U.H * g.calK();
        let rows = |rows: &DMatrix<f64>| -> Vec<_> {
            rows.row_iter().map(|row| self.direction(i, row.iter().copied())).collect()
        };
        [rows(&s.X.H), rows(&on_u)].concat()
    }

    /// Support of Delta^chi in the given directions, one list per subsystem. The set is symmetric: the two bounds of one
    /// signal need one sum.
    fn rates(&self, directions: &[Vec<DVector<f64>>], sums: Sums) -> Vec<f64> {
        let (mut different, mut of): (Vec<DVector<f64>>, Vec<usize>) = (Vec::new(), Vec::new());
        for list in directions {
            let first = different.len();
            for d in list {
                let opposite = -d;
                let known = different[first..].iter().position(|known| known == d || *known == opposite);
                of.push(known.map_or(different.len(), |k| first + k));
                if known.is_none() {
                    different.push(d.clone());
                }
            }
        }
        let rates = match sums {
            Sums::Proved => different.iter().map(|d| self.sum.support(d)).collect(),
            Sums::Estimated => self.sum.estimates(&different),
        };
        of.into_iter().map(|k| rates[k]).collect()
    }

    fn share(&self, d: &DVector<f64>, rate: f64) -> ReferenceShare {
        let worst = self.steady_error.iter().copied().fold(0.0, f64::max);
        let rounding = 2.0 * (d.len() + 4) as f64 * f64::EPSILON * self.steady.amax() * d.abs().sum();
        ReferenceShare {
            rate,
            steady: self.steady.tr_mul(d),
            steady_error: self.contraction.dual_norm(d) * worst + rounding,
            drift: self.contraction.dual_norm(d) * self.drift,
            load: self.load(d),
        }
    }

    fn load(&self, d: &DVector<f64>) -> f64 {
        self.loads.as_ref().map_or(0.0, |loads| loads.share(d, self.contraction.dual_norm(d)))
    }

    /// A row over chi_i as a row over the collective chi; entries past the given ones are zero.
    fn direction(&self, i: usize, row: impl Iterator<Item = f64>) -> DVector<f64> {
        let mut d = DVector::zeros(self.size);
        for (k, value) in row.enumerate() {
            d[self.chi_offset[i] + k] = value;
        }
        d
    }

    fn coupling_loads(&self, network: &Network) -> Vec<f64> {
        let Some(loads) = &self.loads else { return vec![0.0; network.coupling_constraints.len()] };
        let taken = |j: usize, H: &DVector<f64>| {
            let d = self.direction(j, network.subsystems[j].C.tr_mul(H).iter().copied());
            loads.share(&d, self.contraction.dual_norm(&d))
        };
        let constraints = network.coupling_constraints.iter();
        constraints.map(|c| sum_upper(c.H.iter().map(|(&j, H)| taken(j, H)))).collect()
    }

    fn coupling(&self, network: &Network) -> Vec<BTreeMap<usize, f64>> {
        let rate = |j: usize, H: &DVector<f64>| {
            let row = network.subsystems[j].C.tr_mul(H);
            self.sum.support(&self.direction(j, row.iter().copied()))
        };
        let constraints = network.coupling_constraints.iter();
        constraints.map(|c| c.H.iter().map(|(&j, H)| (j, rate(j, H))).collect()).collect()
    }
}

/// What double precision may have done to an entry of (I - calF) `steady` - G.
fn blur(gains: &Gains, steady: &DMatrix<f64>, G: &DMatrix<f64>) -> DMatrix<f64> {
    let (abs_F, abs_steady) = (gains.calF.abs(), steady.abs());
    (&abs_F * &abs_steady + &abs_steady + G.abs()) * (4.0 * (steady.nrows() + 4) as f64 * f64::EPSILON)
}

/// Per column of `steady`, a bound of its distance from (I - calF)^-1 G in the norm of the contraction.
fn steady_error(gains: &Gains, steady: &DMatrix<f64>, G: &DMatrix<f64>) -> Vec<f64> {
    let blur = blur(gains, steady, G);
    let geometric = 1.0 / (1.0 - gains.contraction.lambda);
    let blurred = |matrix: &DMatrix<f64>, j: usize| {
        let column = matrix.column(j).into_owned();
        gains.contraction.norm(&column) + gains.contraction.norm_of_box(&blur.column(j).into_owned())
    };
    let defect = steady - &gains.calF * steady - G;
    (0..steady.ncols()).map(|j| blurred(&defect, j) * geometric).collect()
}

fn no_steady_state(network: &Network) -> Diagnostic {
    let mut error = Diagnostic::error(
        code::STEADY_STATE,
        "the steady states of the references cannot be computed to working accuracy",
    );
    for s in &network.subsystems {
        error = error.at(s.places.header.clone(), "one of the subsystems");
    }
    error
        .note(
            "I - calF is singular in double precision although calF is stable: some closed-loop mode is extremely slow",
        )
        .help("choose faster gains (a larger Qe in `reference-weights`) or a longer sample time")
}

fn no_invariant_set(s: &Subsystem, g: &SubsystemGains, set: &str) -> Diagnostic {
    Diagnostic::error(code::NO_INVARIANT_SET, format!("no invariant set {set} was found for subsystem `{}`", s.name))
        .at(s.places.header.clone(), format!("F_ii has spectral radius {:.6}", g.rho_F))
        .note(format!(
            "tried as normals: the rows of x, of u through K, of the coupling outputs, these times up to {MOST_POWERS} powers of F_ii, and its modes"
        ))
        .help("a faster or better damped local gain helps: a larger Q or a smaller R in `gain-weights`")
}

fn normals_lose_too_much(network: &Network, radius: f64) -> Diagnostic {
    let mut error = Diagnostic::error(code::FEW_NORMALS, "the tubes with few facets do not close the small-gain loop");
    for s in &network.subsystems {
        error = error.at(s.places.header.clone(), "one of the subsystems");
    }
    error
        .note(format!("Assumption 4 holds for the exact sets, but with up to {MORE_POWERS} powers of F_ii as normals the loop gain is {radius:.4}, must be below 1"))
        .help("a smaller `facet-loss` in [sizing] keeps more facets; gains with a smaller small-gain radius leave more room")
}

/// Names the loop that carries the small-gain radius: follow, from the largest entry of the Perron vector, the
/// neighbour that contributes most, until a subsystem repeats.
fn small_gain_fails(network: &Network, S: &DMatrix<f64>, z_offset: &[usize], rho: f64) -> Diagnostic {
    let path = strongest_loop(S, &owners(network, z_offset));
    let names: Vec<&str> = path.iter().map(|&i| network.subsystems[i].name.as_str()).collect();
    let mut error = Diagnostic::error(code::SMALL_GAIN, "the subsystems disturb each other too much (Assumption 4)");
    for (&i, &j) in path.iter().zip(path.iter().cycle().skip(1)) {
        if let Some(place) = network.subsystems[i].places.from.get(&j) {
            let (to, from) = (&network.subsystems[i].name, &network.subsystems[j].name);
            let gain = block_gain(network, S, z_offset, i, j);
            error = error.at(place.clone(), format!("`{from}` acts on `{to}` with gain {gain:.4}"));
        }
    }
    if error.labels.is_empty() {
        for &i in &path {
            error = error.at(network.subsystems[i].places.header.clone(), "in the loop");
        }
    }
    error
        .note(format!("the small-gain matrix has spectral radius {rho:.4}, must be below 1; the loop to blame is {} -> {}", names.join(" -> "), names[0]))
        .help("weaken the loop: gains that reject what these neighbours send (a larger Q on the states they act on, in `gain-weights`), or merge the subsystems of the loop into one")
}

fn owners(network: &Network, z_offset: &[usize]) -> Vec<usize> {
    let mut owners = Vec::new();
    for (i, s) in network.subsystems.iter().enumerate() {
        debug_assert_eq!(owners.len(), z_offset[i]);
        owners.extend(std::iter::repeat_n(i, s.nz()));
    }
    owners
}

fn strongest_loop(S: &DMatrix<f64>, owners: &[usize]) -> Vec<usize> {
    let mut v = DVector::from_element(S.nrows(), 1.0);
    for _ in 0..1000 {
        // Half a step of the identity makes the iteration converge on periodic loops too.
        let next: DVector<f64> = S * &v + &v;
        v = &next / next.amax();
    }
    let mut row = v.imax();
    let mut path: Vec<usize> = Vec::new();
    loop {
        if let Some(start) = path.iter().position(|&i| i == owners[row]) {
            return path.split_off(start);
        }
        path.push(owners[row]);
        row = S.row(row).transpose().component_mul(&v).imax();
    }
}

fn block_gain(network: &Network, S: &DMatrix<f64>, z_offset: &[usize], i: usize, j: usize) -> f64 {
    S.view((z_offset[i], z_offset[j]), (network.subsystems[i].nz(), network.subsystems[j].nz())).amax()
}
