//! Do disturbances, measurement errors and loads stay inside what was charged for them? Random networks, worst cases by linear
//! programs and corners, none of the compiler's proofs.
#![expect(non_snake_case, reason = "the paper's symbols")]

use dpc_codegen::convex::Polytope;
use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::{Source, code};
use dpc_codegen::network::Loads;
use dpc_codegen::sets::loads::collective;
use dpc_tests::{Random, lower, read, sparsely};
use nalgebra::{DMatrix, DVector};

const NETWORKS: u64 = 60;
const STEPS: usize = 60;

/// A number of [low, high).
fn between(random: &mut Random, low: f64, high: f64) -> f64 {
    low + (high - low) * random.below(1 << 30) as f64 / (1u64 << 30) as f64
}

/// 10 to a power of [low, high).
fn magnitude(random: &mut Random, low: f64, high: f64) -> f64 {
    10f64.powf(between(random, low, high))
}

/// The four-tank with random local gains, and disturbances and measurement errors of random shapes and sizes.
fn network(seed: u64) -> Source {
    let mut random = Random(seed);
    let source = read("cases/accept/four_tank_blocks.toml".as_ref());
    let head = "gain-weights = { R = 100 }";
    let mut parts = source.text.split(head);
    let mut text = parts.next().expect("a head").to_owned();
    for rest in parts {
        text += &format!("gain-weights = {{ R = {} }}\n{}", magnitude(&mut random, 0.0, 4.0), unknowns(&mut random));
        text += rest.split_once('\n').expect("a line").1;
    }
    Source { text, ..source }
}

fn unknowns(random: &mut Random) -> String {
    let mut size = || magnitude(random, -4.0, -2.0);
    let [a, b, c, d, e, f] = std::array::from_fn(|_| size());
    let w = match random.below(3) {
        0 => format!("w = {{ min = [-{a:e}, 0.0], max = [{b:e}, {c:e}] }}\n"),
        1 => format!("w = {{ H = [[1, 1], [-1, -1], [2, -1], [-1, 1]], h = [{a:e}, {b:e}, {c:e}, {d:e}] }}\n"),
        _ => String::new(),
    };
    let v = match random.below(3) {
        0 => format!("measurement-error = {{ max = [{:e}, 0.0] }}\n", 10.0 * e),
        1 => format!("measurement-error = {{ max = [{:e}, {:e}] }}\n", 10.0 * e, 10.0 * f),
        _ => String::new(),
    };
    w + &v
}

/// The designs that exist; the others must be refused for their disturbances, or for what these leave.
fn designs() -> Vec<(u64, Design)> {
    let mut found = Vec::new();
    for seed in 0..NETWORKS {
        let source = network(seed);
        match Design::new(source.clone()) {
            Ok(design) => found.push((seed, design)),
            Err(errors) => {
                let known = [code::DISTURBANCE_TOO_LARGE, code::COVER_TOO_LARGE, code::EPSILON];
                let fine = errors.0.iter().all(|error| known.contains(&error.code));
                assert!(fine, "seed {seed}: {}", errors.render(&source, false));
            }
        }
    }
    assert!(found.len() >= 30, "{}", found.len());
    found
}

/// One subsystem as the claims need it.
struct Claims {
    E: Polytope,
    F: DMatrix<f64>,
    BK: DMatrix<f64>,
    K: DMatrix<f64>,
    Cz: DMatrix<f64>,
    Dz: DMatrix<f64>,
    w: Option<Polytope>,
    v: DVector<f64>,
    /// E_i L_ij and the half-widths of Z_j.
    imports: Vec<(DMatrix<f64>, DVector<f64>)>,
}

impl Claims {
    fn new(design: &Design, i: usize) -> Self {
        let (s, g) = (&design.network.subsystems[i], &design.gains.subsystems[i]);
        let import = |(&j, L): (&usize, &DMatrix<f64>)| (&s.E * L, design.sizing.subsystems[j].zeta.clone());
        Self {
            E: design.sizing.subsystems[i].E.to_polytope(),
            F: &s.A + &s.B * &g.K,
            BK: &s.B * &g.K,
            K: g.K.clone(),
            Cz: s.Cz.clone(),
            Dz: s.Dz.clone(),
            w: s.w.as_ref().map(|w| w.set.clone()),
            v: s.measurement_error.clone(),
            imports: s.L.iter().map(import).collect(),
        }
    }

    /// Largest d'eps over E_i.
    fn tube(&self, d: &DVector<f64>) -> f64 {
        self.E.support(d).expect("E is bounded").0
    }

    /// Largest d'w; the disturbance at which it is.
    fn worst_w(&self, d: &DVector<f64>) -> DVector<f64> {
        self.w.as_ref().map_or(DVector::zeros(d.len()), |w| w.support(d).expect("w is bounded").1)
    }

    /// Largest d'v.
    fn noise(&self, d: &DVector<f64>) -> f64 {
        d.iter().zip(&self.v).map(|(d, v)| d.abs() * v).sum()
    }

    fn neighbours(&self, d: &DVector<f64>) -> f64 {
        let one = |(EL, zeta): &(DMatrix<f64>, DVector<f64>)| EL.tr_mul(d).abs().dot(zeta);
        self.imports.iter().map(one).sum()
    }
}

#[test]
fn every_inclusion_holds_at_its_worst_corner() {
    let mut rows = 0;
    let (mut disturbed, mut noisy) = (0, 0);
    for (seed, design) in designs() {
        for i in 0..2 {
            let (claims, s) = (Claims::new(&design, i), &design.network.subsystems[i]);
            let sized = &design.sizing.subsystems[i];
            disturbed += usize::from(claims.w.is_some());
            noisy += usize::from(claims.v.amax() > 0.0);
            for (row, q) in claims.E.H.row_iter().zip(&claims.E.h) {
                let p = row.transpose();
                let next = claims.tube(&claims.F.tr_mul(&p)) + claims.noise(&claims.BK.tr_mul(&p));
                let next = next + claims.neighbours(&p) + p.dot(&claims.worst_w(&p));
                assert!(next <= q * (1.0 + 1e-9), "seed {seed}, {}: (18') {next} {q}", s.name);
                assert!(2.0 * claims.noise(&p) <= *q, "seed {seed}, {}: (35a')", s.name);
                rows += 2;
            }
            for k in 0..s.nz() {
                let row = claims.Cz.row(k) + claims.Dz.row(k) * &claims.K;
                let through = (claims.Dz.row(k) * &claims.K).transpose();
                let taken = claims.tube(&row.transpose()) + claims.noise(&through) + sized.dz[k];
                assert!(taken <= sized.zeta[k] * (1.0 + 1e-9), "seed {seed}, {}: (21')", s.name);
                rows += 1;
            }
            for (r, row) in s.U.H.row_iter().enumerate() {
                let p = (row * &claims.K).transpose();
                let taken = claims.tube(&p) + claims.noise(&p) + sized.U_nom.h[r];
                assert!(taken <= s.U.h[r] * (1.0 + 1e-9), "seed {seed}, {}: Uhat", s.name);
                rows += 1;
            }
            for (r, row) in s.X.H.row_iter().enumerate() {
                let taken = claims.tube(&row.transpose()) + sized.X_nom.h[r];
                assert!(taken <= s.X.h[r] * (1.0 + 1e-9), "seed {seed}, {}: Xhat", s.name);
                rows += 1;
            }
        }
    }
    println!("{rows} inclusions hold; {disturbed} subsystems with a disturbance, {noisy} with a measurement error");
    assert!(disturbed > 15 && noisy > 15);
}

/// (a) and (b) of (35a'): any nominal state it allows keeps the true deviation in E_i, and the forecast is allowed.
#[test]
fn any_nominal_state_that_the_rows_allow_keeps_the_true_deviation_in_the_tube() {
    let (mut steps, mut beyond) = (0, 0);
    for (seed, design) in designs() {
        let mut random = Random(seed + 1_000_000);
        for i in 0..2 {
            let claims = Claims::new(&design, i);
            let (P, q) = (&design.sizing.subsystems[i].E.P, &design.sizing.subsystems[i].E.q);
            let hbar = P.abs() * &claims.v;
            // Coordinates in which the forecast of the nominal state is 0: only deviations matter.
            let mut x = DVector::zeros(2);
            for _ in 0..STEPS {
                let inside = |x: &DVector<f64>| (P * x).iter().zip(q).all(|(p, q)| p.abs() <= q * (1.0 + 1e-7));
                assert!(inside(&x), "seed {seed}: the forecast's deviation left E");
                let v = DVector::from_fn(2, |k, _| claims.v[k] * if random.below(2) == 0 { 1.0 } else { -1.0 });
                let measured = &x + &v;
                let innovation = P * &measured;
                let upper = DVector::from_fn(q.len(), |r, _| (q[r] - hbar[r]).max(innovation[r]));
                let lower = DVector::from_fn(q.len(), |r, _| (hbar[r] - q[r]).min(innovation[r]));
                assert!((0..q.len()).all(|r| lower[r] <= innovation[r] && innovation[r] <= upper[r]), "(b)");
                beyond += usize::from((0..q.len()).any(|r| innovation[r].abs() > q[r] - hbar[r]));
                // lower <= P (measured - nominal) <= upper, the nominal state farthest in some direction.
                let allowed = Polytope {
                    H: DMatrix::from_rows(
                        &[-P.clone(), P.clone()]
                            .map(|m| m.row_iter().map(|r| r.into_owned()).collect::<Vec<_>>())
                            .concat(),
                    ),
                    h: DVector::from_iterator(
                        2 * q.len(),
                        (&upper - &innovation).iter().copied().chain((&innovation - &lower).iter().copied()),
                    ),
                };
                let direction = DVector::from_fn(2, |_, _| between(&mut random, -1.0, 1.0));
                let nominal = allowed.support(&direction).expect("bounded and not empty").1;
                let deviation = &x - &nominal;
                assert!(inside(&deviation), "seed {seed}: (a) {deviation} of {x}");
                let push = &P.row(random.below(q.len())).transpose() * if random.below(2) == 0 { 1.0 } else { -1.0 };
                let mut next = &claims.F * &deviation + &claims.BK * &v + claims.worst_w(&push);
                for (EL, zeta) in &claims.imports {
                    next += EL * zeta.zip_map(&EL.tr_mul(&push), |zeta, side| zeta * side.signum());
                }
                x = next;
                steps += 1;
            }
        }
    }
    println!("{steps} steps, in {beyond} of them the measurement alone allowed less than the forecast");
    assert!(beyond > 100, "{beyond}");
}

/// The reference system (7) of the whole network, run under loads that do their worst at their bounds and rates, stays below what
/// every row was charged for them, and not far below.
#[test]
fn references_under_loads_take_no_more_than_was_charged() {
    let source = read("../examples/four_tank/designs/disturbed.toml".as_ref());
    let design = Design::new(source.clone()).expect("a design exists");
    let by_sparse_rows = sparsely(lower(source).expect("a valid network")).expect("a design exists");
    [design, by_sparse_rows].iter().for_each(references_take_no_more_than_was_charged);
}

fn references_take_no_more_than_was_charged(design: &Design) {
    let (calF, Mcal) = (&design.gains.calF.to_dense(), collective(&design.network, &design.gains));
    let loads = &design.network.subsystems[0].loads;
    let mut closest: f64 = 0.0;
    for (i, (s, g)) in design.network.subsystems.iter().zip(&design.gains.subsystems).enumerate() {
        let first = design.gains.chi_offset[i];
        let on_x = s.X.H.clone().resize_horizontally(s.n() + s.p(), 0.0);
        let rows = on_x.row_iter().chain((&s.U.H * g.calK()).row_iter()).map(|row| row.transpose()).collect::<Vec<_>>();
        let sets = &design.sets.subsystems[i];
        for (row, share) in rows.iter().zip(sets.x_rows.iter().chain(&sets.u_rows)) {
            let mut d = DVector::zeros(calF.nrows());
            d.rows_mut(first, row.len()).copy_from(row);
            let taken = worst(&d, calF, &Mcal, loads);
            assert!(taken <= share.load, "{}: {taken} {}", s.name, share.load);
            closest = closest.max(taken / share.load);
        }
    }
    println!("loads take up to {closest:.4} of what was charged");
    assert!(closest > 0.8, "{closest}");
}

/// Largest value found of d'chi under loads that keep bounds and rates: at rest at one corner, then at full rate to another,
/// and the sequence that the impulse response asks for, followed as far as the rates allow.
fn worst(d: &DVector<f64>, calF: &DMatrix<f64>, Mcal: &DMatrix<f64>, loads: &Loads) -> f64 {
    const LONG: usize = 3000;
    let mut response = Vec::new();
    let mut row = d.clone();
    for _ in 0..LONG {
        response.push(Mcal.tr_mul(&row));
        row = calF.tr_mul(&row);
    }
    let ends =
        |side: &DVector<f64>| side.zip_zip_map(&loads.min, &loads.max, |s, low, high| if s > 0.0 { high } else { low });
    let total: DVector<f64> = response.iter().sum();
    let steady = ends(&total).dot(&total);
    // What response[k] wants is what acted k steps ago: the past is run through from its far end.
    let mut now = ends(&response[LONG - 1]);
    let mut wanted = 0.0;
    for impulse in response.iter().rev() {
        let goal = ends(impulse);
        now = DVector::from_fn(now.len(), |k, _| goal[k].clamp(now[k] - loads.rate[k], now[k] + loads.rate[k]));
        wanted += now.dot(impulse);
    }
    steady.max(wanted)
}
