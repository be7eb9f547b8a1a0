//! Steps 2 and 3 of the off-line design: the shapes of the sets, their invariance multipliers, the support sums of
//! Delta^chi, and the small gain.
#![expect(non_snake_case, reason = "the paper's symbols")]

pub mod exogenous;
pub mod loads;
pub mod outputs;
mod references;

use std::collections::BTreeMap;

use lapack_symbols::singular_values;
use nalgebra::{DMatrix, DVector};

use crate::convex::{Invariant, Polytope, multiplier, multipliers, rpi_at_least};
use crate::diagnostic::{Diagnostic, Diagnostics, code};
use crate::gains::{Gains, Proof, SubsystemGains};
use crate::network::{CouplingConstraint, Network, Subsystem};
use crate::optim::block_lu::BlockLu;
use crate::optim::lyapunov::{Contraction, spectral_radius};
use crate::optim::modes::modal_normals;
use crate::optim::perron::Perron;
use crate::optim::responses::{Accuracy, power_sum, starts};
use crate::optim::rounding::{sum_upper, up_to_digits};
use crate::optim::sparse::Sparse;
use crate::rounding::{Rounding, roundings};
use crate::sharing::{Key, shared, spread};
pub use exogenous::{Exogenous, least_offsets, noise_support, noise_through_gain};
pub use outputs::{OutputShare, OutputShares};
pub use references::ReferenceShare;
use references::References;

/// After this point: on the normals of each E_i a robustly positively invariant set exists, on those of each Sigma_i
/// a positively invariant one, both with their multipliers; the small-gain matrix has a spectral radius below 1 and
/// so has its counterpart on these normals; every truncated sum carries a proved tail.
#[derive(Debug, Clone)]
pub struct Sets {
    pub subsystems: Vec<SubsystemSets>,
    /// S of Assumption 4, over the coupling outputs of all subsystems: with boxes, Z_i that satisfy (21) exist if and
    /// only if its spectral radius is below 1.
    pub small_gain: Sparse,
    /// Of a large network a bound.
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
    /// What else is kept back for what the controllers round.
    pub rounding: Rounding,
    /// The rest of W_i that no neighbour has a part in.
    pub exogenous: Exogenous,
    /// Natural size of each state, coupling output and output: where caps and smallest sizes are taken from.
    pub scales: Scales,
    /// The rows of X_i and of U_i, as seen by the references.
    pub x_rows: Vec<ReferenceShare>,
    pub u_rows: Vec<ReferenceShare>,
    /// Rows over the outputs, as changing constraints need them.
    pub outputs: OutputShares,
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
    /// Set-points are never farther from 0 than this.
    pub y_cap: DVector<f64>,
}

impl Scales {
    /// By the bounds of the states, and what is asked of outputs and coupling outputs.
    fn new(s: &Subsystem) -> Self {
        let x = state_scale(s);
        let u = DVector::from_element(s.m(), 1.0);
        let z = s.Cz.abs() * &x + s.Dz.abs() * u;
        let y = s.C.abs() * &x;
        let asked = |k: usize| s.cover[k].map_or(0.0, |(low, high)| high.max(-low));
        let y = DVector::from_fn(y.len(), |k, _| y[k].max(asked(k)));
        let z = DVector::from_fn(z.len(), |k, _| z[k].max(s.reserve[k]));
        Self { x, z, y_cap: &y * CAP, y }
    }

    /// With what X_i leaves of each output as its cap, where that is less.
    fn within_bounds(self, s: &Subsystem) -> Self {
        let X = Polytope { H: s.X.H.clone(), h: s.X.h.clone() };
        let reach = |row: DVector<f64>| X.support(&row).map_or(f64::INFINITY, |(value, _)| value);
        let farthest = |k: usize| reach(s.C.row(k).transpose()).max(reach(-s.C.row(k).transpose()));
        let y_cap = DVector::from_fn(s.p(), |k, _| self.y_cap[k].min(1.001 * farthest(k)));
        Self { y_cap, ..self }
    }
}

/// Widths that nothing limits stop at this multiple of the signal's natural size.
pub const CAP: f64 = 1e4;

/// Set-points may be this much farther from 0 than [`Scales::y_cap`], relative: the solver's tolerance.
pub const CAP_MARGIN: f64 = 1e-6;

/// W_i = E_i S_i is usually flat and may be {0}; real arithmetic is neither. Every W_i therefore contains a box of
/// this half-width relative to the tighter bound of each state, which makes E_i full-dimensional ("an arbitrarily small
/// positively invariant set", Section V) and covers the rounding of the on-line step.
pub const FLOOR: f64 = 1e-8;

/// A start may drift by this share of the floor at most.
pub const MOST_DRIFT: f64 = 0.1;

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
        let z = z_starts(network);
        let (small_gain, rho_small_gain) = small_gain_matrix(network, &gains.subsystems);
        if !is_small(rho_small_gain) {
            return Err(small_gain_fails(network, &small_gain, &z, rho_small_gain).into());
        }
        let zeta = nominal_zeta(network, &small_gain, &z);
        let scales = scales(network, gains);
        let rounding = roundings(network, gains)?;
        let references = references(network, gains, &scales, &rounding)?;
        let (shapes, rho_on_normals) = tubes(network, gains, &rounding, &zeta, &z)?;
        let terminals = terminals(network, gains)?;
        let shares = shares(network, gains, &references, &rounding, sums);
        if sums == Sums::Proved {
            references::check_charges(network, gains, &scales, &shares)?;
        }
        let outputs = references.outputs(network, sums);
        let parts = shapes.into_iter().zip(terminals).zip(scales).zip(shares).zip(outputs).zip(rounding).enumerate();
        let part = |(i, (((((tube, terminal), scales), (x_rows, u_rows)), outputs), rounding))| {
            let (s, g): (&Subsystem, _) = (&network.subsystems[i], &gains.subsystems[i]);
            let exogenous = Exogenous::new(s, g, &rounding, network.horizon);
            let floor = floor(s);
            SubsystemSets { tube, terminal, floor, rounding, exogenous, scales, x_rows, u_rows, outputs }
        };
        let subsystems: Vec<SubsystemSets> = parts.map(part).collect();
        let coupling = references.coupling(network);
        let coupling_loads = coupling_constants(network, &references, &subsystems);
        let z_offset = z[..network.subsystems.len()].to_vec();
        Ok(Self { subsystems, small_gain, rho_small_gain, rho_on_normals, z_offset, coupling, coupling_loads })
    }

    /// The sets for other calK_i: all but Delta^chi follows from the K_i, which must be those `self` was made for.
    ///
    /// # Errors
    /// E0304 the steady states cannot be computed to working accuracy.
    pub fn with_references(&self, network: &Network, gains: &Gains, sums: Sums) -> Result<Self, Diagnostics> {
        let scales: Vec<_> = self.subsystems.iter().map(|sets| sets.scales.clone()).collect();
        let rounding = roundings(network, gains)?;
        let references = references(network, gains, &scales, &rounding)?;
        let mut sets = self.clone();
        sets.coupling = references.coupling(network);
        let shares = shares(network, gains, &references, &rounding, sums);
        let outputs = references.outputs(network, sums);
        let parts = sets.subsystems.iter_mut().zip(shares).zip(outputs).zip(rounding);
        for (((subsystem, (x_rows, u_rows)), outputs), rounding) in parts {
            (subsystem.x_rows, subsystem.u_rows, subsystem.outputs) = (x_rows, u_rows, outputs);
            subsystem.rounding = rounding;
        }
        sets.coupling_loads = coupling_constants(network, &references, &sets.subsystems);
        Ok(sets)
    }
}

/// The shares of the references in the rows of X_i and U_i, as they are stored.
fn shares(
    network: &Network,
    gains: &Gains,
    references: &References,
    rounding: &[Rounding],
    sums: Sums,
) -> Vec<references::Shares> {
    let mut shares = references.shares(network, gains, sums);
    for ((_, u_rows), (s, rounding)) in shares.iter_mut().zip(network.subsystems.iter().zip(rounding)) {
        let rounded = s.U.H.abs() * &rounding.u_ref;
        u_rows.iter_mut().zip(&rounded).for_each(|(share, rounded)| share.load += rounded);
    }
    shares
}

/// What loads, and the rounding of references, take of each coupling constraint. Shares (28) that are off by delta each let k_h exceed
/// l~_h by up to 2 n_h delta.
fn coupling_constants(network: &Network, references: &References, subsystems: &[SubsystemSets]) -> Vec<f64> {
    let rounded = |c: &CouplingConstraint| {
        let share = c.H.iter().map(|(&j, H)| H.abs().dot(&subsystems[j].rounding.y)).sum::<f64>();
        let limit = network.scalar.share_kept() * c.l;
        2.0 * c.H.len() as f64 * (share + limit)
    };
    let loads = references.coupling_loads(network).into_iter();
    loads.zip(&network.coupling_constraints).map(|(load, c)| load + rounded(c)).collect()
}

/// S of Assumption 4 with its spectral radius; rows of subsystem i depend on K_i alone.
pub fn small_gain_matrix(network: &Network, gains: &[SubsystemGains]) -> (Sparse, f64) {
    let S = small_gain(network, gains, &z_starts(network));
    let rho = radius(&S);
    (S, rho)
}

/// Why Assumption 4 fails, where it does.
pub fn small_gain_mistake(network: &Network, gains: &[SubsystemGains]) -> Option<Diagnostic> {
    let (S, rho) = small_gain_matrix(network, gains);
    (!is_small(rho)).then(|| small_gain_fails(network, &S, &z_starts(network), rho))
}

/// No NaN, and below 1.
fn is_small(rho: f64) -> bool {
    rho < 1.0
}

/// The rows of S that belong to each subsystem, by neighbour, with these K_i; `None` where some F_ii is not stable.
pub fn small_gain_with<'a>(
    network: &Network,
    K: impl IntoIterator<Item = &'a DMatrix<f64>>,
) -> Option<Vec<BTreeMap<usize, DMatrix<f64>>>> {
    network.subsystems.iter().zip(K).map(|(s, K)| small_gain_rows_with(s, K)).collect()
}

/// The same of one subsystem.
pub fn small_gain_rows_with(s: &Subsystem, K: &DMatrix<f64>) -> Option<BTreeMap<usize, DMatrix<f64>>> {
    let F = &s.A + &s.B * K;
    Some(small_gain_rows(s, K, &F, &Contraction::new(&F)?))
}

/// S of its rows.
pub fn assembled(network: &Network, rows: &[BTreeMap<usize, DMatrix<f64>>]) -> DMatrix<f64> {
    let z = z_starts(network);
    let mut S = DMatrix::zeros(z[rows.len()], z[rows.len()]);
    for (i, row) in rows.iter().enumerate() {
        for (&j, block) in row {
            S.view_mut((z[i], z[j]), block.shape()).copy_from(block);
        }
    }
    S
}

/// Spectral radius of a non-negative matrix, or where it is large a bound.
fn radius(S: &Sparse) -> f64 {
    if S.nrows() <= DENSE { spectral_radius(&S.to_dense()) } else { Perron::new(S).radius }
}

/// Largest size of matrices over the coupling outputs that are dense.
const DENSE: usize = 100;

fn references(
    network: &Network,
    gains: &Gains,
    scales: &[Scales],
    rounding: &[Rounding],
) -> Result<References, Diagnostics> {
    let caps = || DVector::from_vec(scales.iter().flat_map(|scales| scales.y_cap.iter().copied()).collect());
    References::new(network, gains, rounding, caps)
}

/// Of every subsystem. Caps that the rows of X_i leave cost linear programs and are of use in large networks only, where small
/// entries of the steady states are charged at them.
fn scales(network: &Network, gains: &Gains) -> Vec<Scales> {
    let is_large = matches!(gains.proof, Proof::Responses(_));
    let parts = &network.subsystems;
    spread(parts.len(), |i| {
        let scales = Scales::new(&parts[i]);
        if is_large { scales.within_bounds(&parts[i]) } else { scales }
    })
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
    s.L.iter().map(|(&j, L)| (j, power_sum(&z_rows, F, contraction, &(&s.E * L), Accuracy::FULL))).collect()
}

/// The largest share of the room in a row of X_i or U_i that references take per unit of epsilon.
///
/// # Errors
/// E0304 the steady states cannot be computed to working accuracy.
pub fn worst_reference_share(network: &Network, gains: &Gains) -> Result<f64, Diagnostics> {
    let rounding = roundings(network, gains)?;
    let references = references(network, gains, &scales(network, gains), &rounding)?;
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

/// First coupling output of each subsystem, and the number of all at the end.
/// First coupling output of each subsystem, and the number of all.
pub fn z_starts(network: &Network) -> Vec<usize> {
    starts(network.subsystems.iter().map(Subsystem::nz))
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
fn small_gain(network: &Network, gains: &[SubsystemGains], z: &[usize]) -> Sparse {
    let parts = &network.subsystems;
    let key = |i: usize| {
        let (s, g) = (&parts[i], &gains[i]);
        let own = [&g.F, &g.K, &s.Cz, &s.Dz, &s.E];
        own.into_iter().chain(s.L.values()).fold(Key::default(), Key::matrix)
    };
    // Equal subsystems have their neighbours in other places.
    let rows = |i: usize| -> Vec<DMatrix<f64>> {
        small_gain_rows(&parts[i], &gains[i].K, &gains[i].F, &gains[i].contraction).into_values().collect()
    };
    let rows = shared(parts.len(), key, rows);
    let blocks = parts.iter().zip(&rows).enumerate();
    let blocks = blocks.flat_map(|(i, (s, rows))| s.L.keys().zip(rows).map(move |(&j, block)| ((z[i], z[j]), block)));
    Sparse::from_blocks(z[parts.len()], z[parts.len()], blocks)
}

/// Half-widths of Z_i for Delta_i^z of natural size: (I - S)^-1 times the range of z. In a large network to two digits, so that
/// equal subsystems far from its borders share their sets.
fn nominal_zeta(network: &Network, S: &Sparse, z: &[usize]) -> DVector<f64> {
    let n = S.nrows();
    let mut dz = DVector::zeros(n);
    if n == 0 {
        return dz;
    }
    for (i, s) in network.subsystems.iter().enumerate() {
        let range = s.Cz.abs() * state_scale(s) + s.Dz.abs() * DVector::from_element(s.m(), 1.0);
        dz.rows_mut(z[i], s.nz()).copy_from(&range.map(|r| 0.01 * r.max(1e-6)));
    }
    if n <= DENSE {
        return (DMatrix::identity(n, n) - S.to_dense()).lu().solve(&dz).unwrap_or(dz);
    }
    BlockLu::of_identity_minus(S, z).map_or(dz.clone(), |lu| lu.solve(&dz)).map(|zeta| up_to_digits(zeta, 2))
}

/// Normals and nominal tube of every subsystem, with the radius of the small gain on these normals. More powers of
/// F_ii are added as normals until that radius is below 1.
fn tubes(
    network: &Network,
    gains: &Gains,
    rounding: &[Rounding],
    zeta: &DVector<f64>,
    z: &[usize],
) -> Result<(Vec<Shape>, f64), Diagnostics> {
    let mut last = f64::INFINITY;
    for fewest in 0..MORE_POWERS {
        let key = |i: usize| {
            let s = &network.subsystems[i];
            let imported = s.L.keys().map(|&j| zeta.rows(z[j], z[j + 1] - z[j]).into_owned());
            imported.fold(shape_key(network, gains, i).vector(&rounding[i].w), |key, zeta| key.vector(&zeta))
        };
        let tube = |i: usize| tube(network, gains, &rounding[i], i, fewest, zeta, z);
        let made = shared(network.subsystems.len(), key, tube);
        let shapes: Vec<Shape> = all_or(made, |i| no_invariant_set(network, gains, i, "E_i"))?;
        last = radius(&loop_matrix(network, gains, &shapes, z));
        if last < 1.0 - 1e-6 {
            return Ok((shapes, last));
        }
    }
    Err(normals_lose_too_much(network, last).into())
}

/// All that the shapes of subsystem i follow from, but for what its neighbours let in.
fn shape_key(network: &Network, gains: &Gains, i: usize) -> Key {
    let (s, g) = (&network.subsystems[i], &gains.subsystems[i]);
    let own = [&g.F, &g.K, &s.B, &s.Cz, &s.Dz, &s.X.H, &s.U.H, &s.E, &s.loads.M];
    let key = own.into_iter().chain(s.L.values()).fold(Key::default(), Key::matrix);
    let limits = [&s.X.h, &s.measurement_error, &s.loads.min, &s.loads.max, &s.loads.rate];
    let key = limits.into_iter().fold(key, Key::vector);
    match &s.w {
        Some(w) => key.matrix(&w.set.H).vector(&w.set.h).vector(&w.hull),
        None => key.number(0.0),
    }
}

fn tube(
    network: &Network,
    gains: &Gains,
    rounding: &Rounding,
    i: usize,
    fewest: usize,
    zeta: &DVector<f64>,
    z: &[usize],
) -> Option<Shape> {
    let (s, g) = (&network.subsystems[i], &gains.subsystems[i]);
    let exogenous = Exogenous::new(s, g, rounding, network.horizon);
    let r = |P: &DMatrix<f64>| (disturbance(P, s, zeta, z) + exogenous.support(P), least_offsets(P, s));
    shape(s, g, fewest, network.wishes.facet_loss, r)
}

/// All, or the mistake of the first that is not there.
fn all_or<T>(made: Vec<Option<T>>, mistake: impl Fn(usize) -> Diagnostic) -> Result<Vec<T>, Diagnostics> {
    made.into_iter().enumerate().map(|(i, made)| made.ok_or_else(|| mistake(i).into())).collect()
}

const MORE_POWERS: usize = 6;

/// Support of W_i, Z_j boxes of half-widths zeta, in the rows of P.
fn disturbance(P: &DMatrix<f64>, s: &Subsystem, zeta: &DVector<f64>, z: &[usize]) -> DVector<f64> {
    let mut support = floor_support(P, &floor(s));
    for (&j, L) in &s.L {
        support += import_gain(P, s, j) * zeta.rows(z[j], L.ncols());
    }
    support
}

/// The map zeta -> half-widths of (C_zi + D_zi K_i) E_i on the chosen normals, homogeneous part.
fn loop_matrix(network: &Network, gains: &Gains, shapes: &[Shape], z: &[usize]) -> Sparse {
    let parts = &network.subsystems;
    let blocks = spread(parts.len(), |i| loop_blocks(&parts[i], &gains.subsystems[i], &shapes[i]));
    let blocks =
        blocks.iter().enumerate().flat_map(|(i, row)| row.iter().map(move |(j, block)| ((z[i], z[*j]), block)));
    Sparse::from_blocks(z[parts.len()], z[parts.len()], blocks)
}

/// One row of blocks, by neighbour.
fn loop_blocks(
    s: &Subsystem,
    g: &SubsystemGains,
    Shape { normals: P, set: tube }: &Shape,
) -> Vec<(usize, DMatrix<f64>)> {
    let Some(mu) = multipliers(P, &tube.q, &closed_loop_z(s, g)) else { return Vec::new() };
    let mu = DMatrix::from_fn(mu.len(), P.nrows(), |a, b| mu[a].mu[b].abs());
    let size = P.nrows();
    let lu = (DMatrix::identity(size, size) - tube.abs_Lambda()).lu();
    let block = |j: usize, L: &DMatrix<f64>| {
        let offsets = lu.solve(&import_gain(P, s, j));
        offsets.map_or(DMatrix::from_element(s.nz(), L.ncols(), f64::INFINITY), |offsets| &mu * offsets)
    };
    s.L.iter().map(|(&j, L)| (j, block(j, L))).collect()
}

/// The normals of every Sigma_i: positively invariant at the size that a disturbance as large as the state's range would need.
fn terminals(network: &Network, gains: &Gains) -> Result<Vec<Shape>, Diagnostics> {
    let made = shared(network.subsystems.len(), |i| shape_key(network, gains, i), |i| terminal(network, gains, i));
    all_or(made, |i| no_invariant_set(network, gains, i, "Sigma_i"))
}

fn terminal(network: &Network, gains: &Gains, i: usize) -> Option<Shape> {
    let (s, g) = (&network.subsystems[i], &gains.subsystems[i]);
    let scale = state_scale(s);
    let r = |P: &DMatrix<f64>| (floor_support(P, &scale), DVector::zeros(P.nrows()));
    shape(s, g, 0, network.wishes.facet_loss, r)
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

fn no_invariant_set(network: &Network, gains: &Gains, i: usize, set: &str) -> Diagnostic {
    let (s, g) = (&network.subsystems[i], &gains.subsystems[i]);
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
fn small_gain_fails(network: &Network, S: &Sparse, z: &[usize], rho: f64) -> Diagnostic {
    let path = strongest_loop(S, &owners(network));
    let names: Vec<&str> = path.iter().map(|&i| network.subsystems[i].name.as_str()).collect();
    let mut error = Diagnostic::error(code::SMALL_GAIN, "the subsystems disturb each other too much (Assumption 4)");
    for (&i, &j) in path.iter().zip(path.iter().cycle().skip(1)) {
        if let Some(place) = network.subsystems[i].places.from.get(&j) {
            let (to, from) = (&network.subsystems[i].name, &network.subsystems[j].name);
            let gain = block_gain(S, z, i, j);
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

/// The loop of subsystems that carries the small-gain radius; each is acted on most by the next one. Without a loop the
/// subsystem that is acted on most.
pub fn critical_loop(network: &Network, sets: &Sets) -> Vec<usize> {
    strongest_loop(&sets.small_gain, &owners(network))
}

/// Largest entry of S_ij: what subsystem j may do to i, relative to its own coupling outputs.
pub fn link_gain(network: &Network, sets: &Sets, i: usize, j: usize) -> f64 {
    block_gain(&sets.small_gain, &z_starts(network), i, j)
}

fn owners(network: &Network) -> Vec<usize> {
    network.subsystems.iter().enumerate().flat_map(|(i, s)| std::iter::repeat_n(i, s.nz())).collect()
}

fn strongest_loop(S: &Sparse, owners: &[usize]) -> Vec<usize> {
    let mut v = DVector::from_element(S.nrows(), 1.0);
    for _ in 0..1000 {
        // Half a step of the identity makes the iteration converge on periodic loops too.
        let next: DVector<f64> = S.times(&v) + &v;
        v = &next / next.amax();
    }
    let mut row = strongest(v.iter().copied().enumerate()).unwrap_or(0);
    let mut path: Vec<usize> = Vec::new();
    loop {
        if let Some(start) = path.iter().position(|&i| i == owners[row]) {
            return path.split_off(start);
        }
        path.push(owners[row]);
        row = strongest(S.row(row).iter().map(|(column, x)| (*column, x * v[*column]))).unwrap_or(row);
    }
}

/// The first of those that are as large as the largest but for rounding.
fn strongest(values: impl Iterator<Item = (usize, f64)> + Clone) -> Option<usize> {
    let largest = values.clone().map(|(_, value)| value).fold(0.0, f64::max);
    values.into_iter().find(|(_, value)| *value >= largest * (1.0 - 1e-6)).map(|(index, _)| index)
}

fn block_gain(S: &Sparse, z: &[usize], i: usize, j: usize) -> f64 {
    let entries = (z[i]..z[i + 1]).flat_map(|row| S.row(row));
    entries.filter(|(column, _)| (z[j]..z[j + 1]).contains(column)).fold(0.0, |gain, (_, value)| value.max(gain))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostic::Source;
    use crate::spec::Spec;

    /// A ring of six subsystems of two kinds.
    fn ring() -> (Network, Gains) {
        let mut text = "name = \"ring\"\nsample-time = 1.0\nhorizon = 3\n".to_owned();
        for i in 0..6 {
            text += &format!(
                "[subsystem.s{i}]\nstates = [\"a\", \"b\"]\ninputs = [\"u\"]\noutputs = [\"a\"]\nA = [[0.8, 0.1], [0.05, {}]]\n\
                 B = [[0.1], [0.02]]\nC = [[1.0, 0.0]]\nx = {{ min = [-3, -4], max = [5, 4] }}\nu = {{ min = [-2], max = [2] }}\n\
                 from.s{}.A = [[0.02, 0.0], [0.0, 0.0]]\n",
                if i % 2 == 0 { "0.9" } else { "0.95" },
                (i + 1) % 6
            );
        }
        let source = Source { path: "ring.toml".to_owned(), text };
        let network = Network::new(&Spec::parse(&source).unwrap(), source).unwrap();
        let gains = Gains::new(&network).unwrap();
        (network, gains)
    }

    #[test]
    fn equal_subsystems_share_the_shapes_that_each_would_get_alone() {
        let (network, gains) = ring();
        let z = z_starts(&network);
        let (S, _) = small_gain_matrix(&network, &gains.subsystems);
        // As in a large network: to two digits.
        let zeta = nominal_zeta(&network, &S, &z).map(|zeta| up_to_digits(zeta, 2));
        let rounding = roundings(&network, &gains).unwrap();
        let (shared, _) = tubes(&network, &gains, &rounding, &zeta, &z).unwrap();
        let alone = |i: usize| tube(&network, &gains, &rounding[i], i, 0, &zeta, &z);
        let shapes = |i: usize| (format!("{:?}", shared[i]), format!("{:?}", alone(i)));
        (0..6).map(shapes).for_each(|(shared, alone)| assert_eq!(format!("Some({shared})"), alone));
        assert_eq!(shapes(0).0, shapes(2).0);
        assert_ne!(shapes(0).0, shapes(1).0);
        let terminals = terminals(&network, &gains).unwrap();
        let alone = (0..6).map(|i| format!("{:?}", terminal(&network, &gains, i)));
        alone.zip(&terminals).for_each(|(alone, shared)| assert_eq!(alone, format!("Some({shared:?})")));
    }

    #[test]
    fn equal_subsystems_share_rows_of_the_small_gain() {
        let (network, gains) = ring();
        let (S, _) = small_gain_matrix(&network, &gains.subsystems);
        for (i, (s, g)) in network.subsystems.iter().zip(&gains.subsystems).enumerate() {
            let alone = small_gain_rows(s, &g.K, &g.F, &g.contraction);
            assert_eq!(S.row(i), [((i + 1) % 6, alone[&((i + 1) % 6)][(0, 0)])]);
        }
    }
}
