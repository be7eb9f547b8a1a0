//! From the program's approximate optimum to short decimals that hold for certain.

use nalgebra::{DMatrix, DVector};

use super::program::{MARGIN, Program, ROUNDING_MARGIN, TUBE_MARGIN};
use super::verify::{Bounds, Tightening, ends, size_of_z, taken, terminal_rows};
use super::{Context, Sizing, SubsystemSizing};
use crate::convex::{Box, Multiplier, Polytope, Strips, Zonotope, least_fixed_point, least_fixed_point_of_blocks};
use crate::diagnostic::{Diagnostic, Diagnostics, code};
use crate::optim::rounding::{down_to_digits, to_digits, up_to_digits};
use crate::optim::sparse::Sparse;
use crate::sets::{MOST_DRIFT, ReferenceShare, floor_support, import_gain, least_offsets};

/// Digits of what the solver chose (epsilon, Y_i, Delta_i^z): its own accuracy, and pleasant to read.
const CHOSEN: usize = 6;
/// Digits of what follows from that.
const DERIVED: usize = 11;

/// Epsilon, Y_i and Delta_i^z are rounded inwards, Sigma_i's offsets to the nearest decimal; E_i and Z_i are the least
/// fixed point for these, a linear system, rounded outwards; Xhat_i, Uhat_i and the limits of (26) follow.
pub fn settle(context: &Context, program: &Program, point: &[f64]) -> Result<Sizing, Diagnostics> {
    let network = context.network;
    let epsilon = network.reference.epsilon.unwrap_or_else(|| down_to_digits(program.epsilon(point), CHOSEN));
    let dz: Vec<_> = (0..network.subsystems.len()).map(|i| settled_dz(context, program, point, i)).collect();
    let tubes = tubes(context, program, &dz).ok_or_else(|| loop_does_not_close(context))?;
    let mut subsystems = Vec::new();
    for (i, ((q, zeta), dz)) in tubes.into_iter().zip(dz).enumerate() {
        subsystems.push(subsystem(context, program, point, i, q, zeta, dz));
    }
    let objective = program.objective(point);
    let (slacks, trade, share_of_double) = Default::default();
    let mut sizing = Sizing { epsilon, subsystems, l_tilde: Vec::new(), objective, share_of_double, slacks, trade };
    fit_outputs(context, program, &mut sizing);
    for sized in &mut sizing.subsystems {
        sized.upset = half_axes(&sized.Sigma);
    }
    let ends = ends(&sizing);
    for (i, sets) in context.sets.subsystems.iter().enumerate() {
        let taken = |shares: &[ReferenceShare]| shares.iter().map(|share| taken(&sizing, &ends, share)).collect();
        let (x_ref, u_ref): (Vec<f64>, Vec<f64>) = (taken(&sets.x_rows), taken(&sets.u_rows));
        sizing.subsystems[i].x_ref = DVector::from_vec(x_ref);
        sizing.subsystems[i].u_ref = DVector::from_vec(u_ref);
        sizing.subsystems[i].exposed = exposed(context, &sizing, i);
    }
    sizing.l_tilde = l_tilde(context, &sizing);
    Ok(sizing)
}

/// What the runtime may let a row exceed its tightened limit by, for rounding, is 1e-9 of the margin; this is larger.
const ACCEPTANCE: f64 = 1.0 + 1.1e-8;

/// [C_i 0] Delta_i^chi with Z_i, and what accepting a row takes.
fn exposed(context: &Context, sizing: &Sizing, i: usize) -> Zonotope {
    let Some(exposed) = &context.network.subsystems[i].exposed else { return Zonotope::default() };
    let zeta = &sizing.subsystems[i].zeta;
    let tube: Vec<f64> = exposed.outputs.iter().map(|output| output.factor.abs() * zeta[output.z]).collect();
    context.sets.subsystems[i].outputs.set(sizing.epsilon).with_box(&tube).enlarged(ACCEPTANCE)
}

fn settled_dz(context: &Context, program: &Program, point: &[f64], i: usize) -> DVector<f64> {
    let reserve = &context.network.subsystems[i].reserve;
    let dz = program.dz(point, i);
    DVector::from_fn(dz.len(), |k, _| down_to_digits(dz[k], CHOSEN).max(reserve[k]))
}

/// (q_i, zeta_i) of every subsystem: zeta = |mu| q + dz, q = |Lambda| q + |P E L| zeta + floor and what is exogenous, but
/// not below the least offsets.
pub fn tubes(context: &Context, program: &Program, dz: &[DVector<f64>]) -> Option<Vec<(DVector<f64>, DVector<f64>)>> {
    let starts = starts(context);
    let size = *starts.last()?;
    let (mut blocks, mut r, mut least) = (Vec::new(), DVector::zeros(size), DVector::zeros(size));
    for (i, s) in context.network.subsystems.iter().enumerate() {
        let (sets, proofs) = (&context.sets.subsystems[i], &program.proofs[i]);
        let strips = sets.tube.normals.nrows();
        let (q, zeta) = (starts[i], starts[i] + strips);
        let exogenous = sets.exogenous.support(&sets.tube.normals) * (1.0 + TUBE_MARGIN);
        r.rows_mut(q, strips).copy_from(&(floor_support(&sets.tube.normals, &sets.floor) * 2.2 + exogenous));
        r.rows_mut(zeta, s.nz()).copy_from(&((&dz[i] + context.noise(i).z) * (1.0 + TUBE_MARGIN)));
        least.rows_mut(q, strips).copy_from(&(least_offsets(&sets.tube.normals, s) * (1.0 + TUBE_MARGIN)));
        let sizes = |proofs: &[Multiplier]| DMatrix::from_fn(proofs.len(), strips, |a, b| proofs[a].mu[b].abs());
        // Changing constraints keep Delta^z small beside the tube: its share of the margin may be less than rounding.
        let spare = if s.exposed.is_some() { 1.0 + TUBE_MARGIN * 1e-3 } else { 1.0 };
        blocks.extend([((q, q), sizes(&proofs.tube)), ((zeta, q), sizes(&proofs.tube_z) * spare)]);
        for &j in s.L.keys() {
            let from = starts[j] + context.sets.subsystems[j].tube.normals.nrows();
            blocks.push(((q, from), import_gain(&sets.tube.normals, s, j) * (1.0 + TUBE_MARGIN)));
        }
    }
    let M = Sparse::from_blocks(size, size, blocks.iter().map(|(place, block)| (*place, block)));
    let solution = if size <= DENSE {
        least_fixed_point(&M.to_dense(), &r, &least)?
    } else {
        least_fixed_point_of_blocks(&M, &starts, &r, &least)?
    };
    if !solution.iter().all(|v| v.is_finite() && *v >= 0.0) {
        return None;
    }
    let rounded = solution.map(|v| up_to_digits(v, DERIVED));
    let part = |i: usize| {
        let strips = context.sets.subsystems[i].tube.normals.nrows();
        let nz = context.network.subsystems[i].nz();
        (rounded.rows(starts[i], strips).into_owned(), rounded.rows(starts[i] + strips, nz).into_owned())
    };
    Some((0..dz.len()).map(part).collect())
}

/// Unknowns of the largest linear system that is solved as a dense one.
const DENSE: usize = 300;

/// First unknown of every subsystem in the linear system, and their number at the end.
fn starts(context: &Context) -> Vec<usize> {
    let sizes = context.network.subsystems.iter().zip(&context.sets.subsystems);
    let mut starts = vec![0];
    for (s, sets) in sizes {
        starts.push(starts[starts.len() - 1] + sets.tube.normals.nrows() + s.nz());
    }
    starts
}

fn subsystem(
    context: &Context,
    program: &Program,
    point: &[f64],
    i: usize,
    q: DVector<f64>,
    zeta: DVector<f64>,
    dz: DVector<f64>,
) -> SubsystemSizing {
    let s = &context.network.subsystems[i];
    let E = Strips { P: program.proofs[i].tube_normals.clone(), q };
    let Sigma = fitted_terminal(context, program, i, program.sigma(point, i), &dz);
    let tightening = Tightening::new(context, program, i, &E);
    let (max, min) = program.y_ends(point, i);
    // An end that the interior-point solver left at 1e-9 of the width is 0.
    let end = |value: f64, other: f64, wanted: f64| {
        if value <= 1e-6 * other { wanted } else { down_to_digits(value, CHOSEN).max(wanted) }
    };
    let cover = |k: usize| s.cover[k].unwrap_or((0.0, 0.0));
    SubsystemSizing {
        X_nom: Polytope { H: s.X.H.clone(), h: tightening.rows(&s.X.h, &tightening.x) },
        U_nom: Polytope { H: s.U.H.clone(), h: tightening.rows(&s.U.h, &tightening.u) },
        Y: Box {
            max: DVector::from_fn(s.p(), |k, _| end(max[k], min[k], cover(k).1)),
            min: DVector::from_fn(s.p(), |k, _| 0.0 - end(min[k], max[k], -cover(k).0)),
        },
        x_ref: DVector::zeros(0),
        u_ref: DVector::zeros(0),
        drift: DVector::zeros(0),
        exposed: Zonotope::default(),
        upset: DVector::zeros(0),
        zeta,
        dz,
        E,
        Sigma,
    }
}

/// Sigma_i with what the solver's tolerance left of (24) and (25a) made good.
fn fitted_terminal(context: &Context, program: &Program, i: usize, sigma: DVector<f64>, dz: &DVector<f64>) -> Strips {
    let (proofs, normals) = (&program.proofs[i], &program.proofs[i].terminal_normals);
    let (s, g) = (&context.network.subsystems[i], &context.gains.subsystems[i]);
    let rounded = context.rounded(i, normals) * (1.0 + ROUNDING_MARGIN);
    let set =
        Strips { P: normals.clone(), q: invariant(&proofs.terminal, sigma, &rounded).map(|v| to_digits(v, DERIVED)) };
    let taken = Bounds::new(&set).all(&proofs.terminal_z, &size_of_z(s, g));
    let room = dz.iter().enumerate().map(|(k, dz)| dz - context.kept_back(i, k, *dz));
    let fits = room.zip(&taken).map(|(room, taken)| room / taken * (1.0 - 1e-9)).fold(1.0, f64::min);
    Strips { q: set.q.map(|v| to_digits(v * fits, DERIVED)), ..set }
}

/// sigma, raised where |Lambda| sigma + `rounded` <= sigma fails by c: |Lambda| v = v - 1 for v = (I - |Lambda|)^-1 1, so that
/// sigma + c v holds.
fn invariant(proofs: &[Multiplier], sigma: DVector<f64>, rounded: &DVector<f64>) -> DVector<f64> {
    let abs = DMatrix::from_fn(proofs.len(), proofs.len(), |r, k| proofs[r].mu[k].abs());
    let lacking = (&abs * &sigma + rounded - &sigma * (1.0 - 0.5 * MARGIN)).max();
    let one = DVector::from_element(proofs.len(), 1.0);
    match (DMatrix::identity(proofs.len(), proofs.len()) - abs).lu().solve(&one) {
        Some(v) if lacking > 0.0 && v.min() > 0.0 => sigma + v * (lacking * (1.0 + 1e-9)),
        _ => sigma,
    }
}

/// Shrinks all Y_i and Sigma_i by one factor, next to 1, where the solver's tolerance let them grow past a row of (25b).
fn fit_outputs(context: &Context, program: &Program, sizing: &mut Sizing) {
    let (mut fits, ends) = (f64::INFINITY, ends(sizing));
    for (i, sets) in context.sets.subsystems.iter().enumerate() {
        let sized = &sizing.subsystems[i];
        let (of_x, of_u) = terminal_rows(context, &program.proofs[i], i, &sized.Sigma);
        let x = sets.x_rows.iter().zip(&sized.X_nom.h).zip(&of_x);
        let u = sets.u_rows.iter().zip(&sized.U_nom.h).zip(&of_u);
        for ((share, room), terminal) in x.chain(u) {
            let fixed = sizing.epsilon * share.rate + share.load + share.rest;
            let shrinks = taken(sizing, &ends, share) - fixed + terminal;
            if shrinks > 0.0 {
                fits = fits.min((room - fixed) / shrinks * (1.0 - 1e-10));
            }
        }
    }
    if fits < 1.0 {
        shrink(context, sizing, fits.max(0.0));
    }
}

fn shrink(context: &Context, sizing: &mut Sizing, factor: f64) {
    for (s, sized) in context.network.subsystems.iter().zip(&mut sizing.subsystems) {
        sized.Sigma.q = sized.Sigma.q.map(|v| to_digits(v * factor, DERIVED));
        for k in 0..s.p() {
            let (low, high) = s.cover[k].unwrap_or((0.0, 0.0));
            let end = |value: f64, wanted: f64| down_to_digits(value * factor, DERIVED).max(wanted);
            sized.Y.max[k] = end(sized.Y.max[k], high);
            sized.Y.min[k] = 0.0 - end(-sized.Y.min[k], -low);
        }
    }
}

/// A start that drifts by a share of the floor: at most a tenth of it, so that W_i has room for it while the references
/// do not follow (7a), and so little that what is left of every row of (25b) absorbs the transient it starts.
pub fn admit_drift(context: &Context, program: &Program, sizing: &mut Sizing) {
    let mut share = MOST_DRIFT;
    for (i, sets) in context.sets.subsystems.iter().enumerate() {
        let sized = &sizing.subsystems[i];
        let (of_x, of_u) = terminal_rows(context, &program.proofs[i], i, &sized.Sigma);
        let x = sets.x_rows.iter().zip(&sized.X_nom.h).zip(&sized.x_ref).zip(&of_x);
        let u = sets.u_rows.iter().zip(&sized.U_nom.h).zip(&sized.u_ref).zip(&of_u);
        for (((row, room), references), terminal) in x.chain(u) {
            if row.drift > 0.0 {
                share = share.min((room - references - terminal).max(0.0) / row.drift);
            }
        }
    }
    for (sets, sized) in context.sets.subsystems.iter().zip(&mut sizing.subsystems) {
        // What single precision rounds is charged together with a drift of its own.
        let drift = if sets.rounding.is_some() { sets.rounding.drift.clone() } else { &sets.floor * share };
        sized.drift = drift.map(|drift| down_to_digits(drift, CHOSEN));
    }
}

/// How far the set goes along each axis.
fn half_axes(set: &Strips) -> DVector<f64> {
    let end = |k: usize| set.P.column(k).iter().zip(&set.q).map(|(p, q)| q / p.abs()).fold(f64::INFINITY, f64::min);
    DVector::from_fn(set.P.ncols(), |k, _| down_to_digits(end(k), CHOSEN))
}

/// (26), rounded down.
fn l_tilde(context: &Context, sizing: &Sizing) -> Vec<f64> {
    let constraints = context.network.coupling_constraints.iter().zip(&context.sets.coupling);
    constraints
        .zip(&context.sets.coupling_loads)
        .map(|((c, rates), load)| {
            let taken: f64 =
                c.Hz.iter()
                    .map(|(j, row)| {
                        let zeta = &sizing.subsystems[*j].zeta;
                        sizing.epsilon * rates[j] + row.iter().zip(zeta).map(|(h, z)| h.abs() * z).sum::<f64>()
                    })
                    .sum();
            down_to_digits(c.l - (taken + load) * (1.0 + 1e-12), DERIVED)
        })
        .collect()
}

fn loop_does_not_close(context: &Context) -> Diagnostic {
    let mut error = Diagnostic::error(code::LOST_SLACK, "the sizes of E_i and Z_i do not close to working accuracy");
    for s in &context.network.subsystems {
        error = error.at(s.places.header.clone(), "one of the subsystems");
    }
    error
        .note(format!("the small-gain radius on the chosen normals is {:.9}: too close to 1", context.sets.rho_on_normals))
        .help("choose gains with a smaller small-gain radius, or keep more facets with a smaller `facet-loss` in [sizing]")
}
