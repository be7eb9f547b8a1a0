//! Does the least-distance solver find the minimiser, or prove that there is none?

use crate::random::Random;
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettingsBuilder, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus};
use dpc_runtime::solver::{Outcome, Row, Rows, Side, Solver, WorkingSet};

const BUDGET: usize = 1000;

/// Rows of a test problem.
#[derive(Debug, Clone)]
struct Problem<const NV: usize> {
    rows: Vec<([f64; NV], f64, f64)>,
}

impl<const NV: usize> Rows<NV> for Problem<NV> {
    fn iter(&self) -> impl Iterator<Item = Row<'_>> {
        self.rows.iter().map(|(normal, lower, upper)| {
            let finite = |value: f64| if value.is_finite() { value.abs() } else { 0.0 };
            Row { normal, lower: *lower, upper: *upper, scale: finite(*lower).max(finite(*upper)) }
        })
    }
}

impl<const NV: usize> Problem<NV> {
    /// (normal, limit) of every finite side, as normal . w <= limit.
    fn halfspaces(&self) -> Vec<([f64; NV], f64)> {
        let upper = self.rows.iter().map(|(v, _, upper)| (*v, *upper));
        let lower = self.rows.iter().map(|(v, lower, _)| (v.map(|x| -x), -lower));
        upper.chain(lower).filter(|(_, limit)| limit.is_finite()).collect()
    }

    /// A side as normal . w >= limit.
    fn side(&self, row: usize, side: Side) -> ([f64; NV], f64) {
        let (v, lower, upper) = self.rows[row];
        match side {
            Side::Lower => (v, lower),
            Side::Upper => (v.map(|x| -x), -upper),
        }
    }

    fn scale(&self) -> f64 {
        self.halfspaces().iter().fold(1e-300, |scale: f64, (_, limit)| scale.max(limit.abs()))
    }
}

fn dot<const NV: usize>(a: &[f64; NV], b: &[f64; NV]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn largest<const NV: usize>(a: &[f64; NV]) -> f64 {
    a.iter().fold(0.0, |largest: f64, x| largest.max(x.abs()))
}

fn normalised<const NV: usize>(v: [f64; NV]) -> [f64; NV] {
    let length = dot(&v, &v).sqrt();
    v.map(|x| x / length)
}

fn unit<const NV: usize>(random: &mut Random) -> [f64; NV] {
    normalised(std::array::from_fn(|_| random.normal()))
}

/// A problem that contains a random point, with the kinds of rows that make solvers stumble: repeated, opposite and
/// nearly parallel ones, equalities, and rows the point lies on.
fn feasible<const NV: usize>(random: &mut Random, count: usize) -> Problem<NV> {
    let size = 10f64.powf(random.between(-3.0, 3.0));
    let inside: [f64; NV] = std::array::from_fn(|_| size * random.normal());
    let mut rows: Vec<([f64; NV], f64, f64)> = Vec::new();
    while rows.len() < count {
        let fresh = unit(random);
        let v = match (random.below(6), rows.last()) {
            (0, Some((last, ..))) => *last,
            (1, Some((last, ..))) => last.map(|x| -x),
            (2, Some((last, ..))) => normalised(std::array::from_fn(|k| last[k] + 1e-3 * fresh[k])),
            _ => fresh,
        };
        let value = dot(&v, &inside);
        let gap = |random: &mut Random| match random.below(5) {
            0 => 0.0,
            1 => f64::INFINITY,
            _ => size * random.between(0.0, 1.0),
        };
        rows.push((v, value - gap(random), value + gap(random)));
    }
    Problem { rows }
}

/// A problem as they occur when nothing is special: two-sided rows in random directions around a random point.
fn ordinary<const NV: usize>(random: &mut Random, count: usize) -> Problem<NV> {
    let inside: [f64; NV] = std::array::from_fn(|_| random.between(0.0, 1.0) * random.normal());
    let row = |_| {
        let v = unit(random);
        let value = dot(&v, &inside);
        (v, value - random.between(0.1, 1.0), value + random.between(0.1, 1.0))
    };
    Problem { rows: (0..count).map(row).collect() }
}

/// Checks the optimality conditions, which prove that `w` is the minimiser: w is a non-negative combination of the
/// normals of rows that hold with equality, and no row is violated.
fn assert_optimal<const NV: usize>(problem: &Problem<NV>, solver: &Solver<NV>) {
    let w = solver.w();
    let size = problem.scale() + largest(w);
    for (normal, limit) in problem.halfspaces() {
        assert!(dot(&normal, w) - limit <= 1.01e-12 * size, "violated by {:e}", dot(&normal, w) - limit);
    }
    let mut sum = [0.0; NV];
    let mut weight = 0.0;
    for (row, side, multiplier) in solver.multipliers() {
        let (normal, limit) = problem.side(row, side);
        assert!(multiplier >= 0.0);
        assert!((dot(&normal, w) - limit).abs() <= 1e-12 * size, "active row is off by {:e}", dot(&normal, w) - limit);
        sum = std::array::from_fn(|k| sum[k] + multiplier * normal[k]);
        weight += multiplier;
    }
    let error = (0..NV).fold(0.0, |m: f64, k| m.max((sum[k] - w[k]).abs()));
    assert!(error <= 1e-14 * (weight + size), "w is not N multipliers: {error:e}");
}

/// Farkas: the weighted sum of the inequalities reads 0 >= something positive.
fn assert_refuted<const NV: usize>(problem: &Problem<NV>, solver: &Solver<NV>) {
    let mut sum = [0.0; NV];
    let mut limits = 0.0;
    let mut size = 0.0;
    for (row, side, weight) in solver.certificate() {
        let (normal, limit) = problem.side(row, side);
        assert!(weight >= 0.0);
        sum = std::array::from_fn(|k| sum[k] + weight * normal[k]);
        limits += weight * limit;
        size += weight;
    }
    let error = dot(&sum, &sum).sqrt();
    assert!(error <= 1e-6 * size, "normals do not cancel: {error:e}");
    assert!(limits > 0.0, "limits do not contradict: {limits:e}");
}

/// The minimiser by trying every working set.
fn enumerate<const NV: usize>(problem: &Problem<NV>) -> Option<[f64; NV]> {
    let halfspaces = problem.halfspaces();
    let size = problem.scale();
    let mut best: Option<[f64; NV]> = None;
    for mask in 0u32..1 << halfspaces.len() {
        if mask.count_ones() as usize > NV {
            continue;
        }
        let chosen: Vec<_> = (0..halfspaces.len()).filter(|k| mask >> k & 1 == 1).map(|k| halfspaces[k]).collect();
        let w = equality_minimiser(&chosen);
        let feasible = halfspaces.iter().all(|(normal, limit)| dot(normal, &w) <= limit + 1e-12 * size);
        if feasible && best.is_none_or(|best| dot(&w, &w) < dot(&best, &best)) {
            best = Some(w);
        }
    }
    best
}

/// The shortest w with normal . w = limit for all rows but those that depend on earlier ones, by orthogonalising the
/// normals (twice, for accuracy).
fn equality_minimiser<const NV: usize>(rows: &[([f64; NV], f64)]) -> [f64; NV] {
    let mut basis: Vec<[f64; NV]> = Vec::new();
    let mut w = [0.0; NV];
    for (normal, limit) in rows {
        let mut direction = *normal;
        for q in basis.iter().chain(&basis) {
            let along = dot(q, &direction);
            direction = std::array::from_fn(|k| direction[k] - along * q[k]);
        }
        if dot(&direction, &direction) < 1e-14 {
            continue;
        }
        let q = normalised(direction);
        let step = (limit - dot(normal, &w)) / dot(normal, &q);
        w = std::array::from_fn(|k| w[k] + step * q[k]);
        basis.push(q);
    }
    w
}

/// The minimiser by an interior-point method: it tells which rows are active (multiplier larger than slack), which
/// gives the minimiser to full accuracy; its own iterate is only good to the root of the duality gap.
fn interior_point<const NV: usize>(problem: &Problem<NV>) -> Option<[f64; NV]> {
    let halfspaces = problem.halfspaces();
    let scale = problem.scale();
    let rows: Vec<Vec<f64>> = halfspaces.iter().map(|(normal, _)| normal.to_vec()).collect();
    let limits: Vec<f64> = halfspaces.iter().map(|(_, limit)| limit / scale).collect();
    let settings = DefaultSettingsBuilder::default()
        .verbose(false)
        .tol_gap_abs(1e-13)
        .tol_gap_rel(1e-13)
        .tol_feas(1e-12)
        .max_iter(200)
        .build()
        .unwrap();
    let cones = [NonnegativeConeT(rows.len())];
    let (quadratic, rows) = (CscMatrix::identity(NV), CscMatrix::from(&rows));
    let mut solver = DefaultSolver::new(&quadratic, &[0.0; NV], &rows, &limits, &cones, settings).unwrap();
    solver.solve();
    let solution = &solver.solution;
    let active: Vec<_> =
        (0..halfspaces.len()).filter(|k| solution.z[*k] > solution.s[*k]).map(|k| halfspaces[k]).collect();
    (solution.status == SolverStatus::Solved).then(|| equality_minimiser(&active))
}

fn assert_close<const NV: usize>(a: &[f64; NV], b: &[f64; NV], tolerance: f64) {
    let error = largest(&std::array::from_fn::<f64, NV, _>(|k| a[k] - b[k]));
    let size = largest(a).max(largest(b)).max(1e-300);
    assert!(error <= tolerance * size, "{a:?} differs from {b:?} by {:e}", error / size);
}

fn cold<const NV: usize>(problem: &Problem<NV>) -> (Solver<NV>, Outcome) {
    let mut solver = Solver::NEW;
    let outcome = solver.solve(problem, &WorkingSet::EMPTY, BUDGET);
    (solver, outcome)
}

/// Cold, warm from the solution's own working set, and warm from a random one all end at the same point. Returns whether the
/// solution's own working set needed no change, which rows that hold up to rounding only may cause.
fn assert_warm_equals_cold<const NV: usize>(random: &mut Random, problem: &Problem<NV>, cold: &Solver<NV>) -> bool {
    let mut warm = Solver::NEW;
    let again = warm.solve(problem, &cold.working_set(), BUDGET);
    assert!(matches!(again, Outcome::Optimal { .. }), "{again:?}");
    assert_close(warm.w(), cold.w(), 1e-8);

    let mut set = WorkingSet::EMPTY;
    for _ in 0..random.below(NV + 1) {
        let side = if random.below(2) == 0 { Side::Lower } else { Side::Upper };
        set.push(random.below(problem.rows.len()), side);
    }
    assert!(matches!(warm.solve(problem, &set, BUDGET), Outcome::Optimal { .. }));
    assert_optimal(problem, &warm);
    assert_close(warm.w(), cold.w(), 1e-8);
    again == Outcome::Optimal { iterations: 0 }
}

fn sweep<const NV: usize>(seed: u64, cases: usize, most_rows: usize, mut check: impl FnMut(&Problem<NV>, &Solver<NV>)) {
    let mut random = Random::new(seed);
    let mut unchanged = 0;
    for case in 0..cases {
        let count = 1 + random.below(most_rows);
        let problem = feasible::<NV>(&mut random, count);
        let (solver, outcome) = cold(&problem);
        assert!(matches!(outcome, Outcome::Optimal { .. }), "case {case}: {outcome:?}");
        assert_optimal(&problem, &solver);
        unchanged += usize::from(assert_warm_equals_cold(&mut random, &problem, &solver));
        check(&problem, &solver);
    }
    assert!(unchanged * 20 >= cases * 18, "only {unchanged} of {cases} working sets were kept");
}

#[test]
fn agrees_with_enumeration() {
    let mut active = 0;
    sweep::<1>(1, 2000, 4, |problem, solver| assert_close(solver.w(), &enumerate(problem).unwrap(), 1e-8));
    sweep::<2>(2, 4000, 5, |problem, solver| assert_close(solver.w(), &enumerate(problem).unwrap(), 1e-8));
    sweep::<3>(3, 2000, 6, |problem, solver| {
        active += usize::from(!solver.working_set().is_empty());
        assert_close(solver.w(), &enumerate(problem).unwrap(), 1e-8);
    });
    assert!(active > 1000, "only {active} cases with active rows");
}

#[test]
fn agrees_with_an_interior_point_method() {
    let mut random = Random::new(4);
    let (mut compared, mut active) = (0, 0);
    for _ in 0..1500 {
        let problem = ordinary::<5>(&mut random, 25);
        let (solver, outcome) = cold(&problem);
        assert!(matches!(outcome, Outcome::Optimal { .. }), "{outcome:?}");
        assert_warm_equals_cold(&mut random, &problem, &solver);
        if let Some(reference) = interior_point(&problem) {
            compared += 1;
            active += usize::from(!solver.working_set().is_empty());
            assert_close(solver.w(), &reference, 1e-8);
        }
    }
    println!("{compared} of 1500 compared, {active} with active rows");
    assert!(compared > 1490 && active > 1000, "{compared} compared, {active} active");
}

#[test]
fn solves_larger_problems() {
    sweep::<12>(5, 400, 60, |_, _| ());
    sweep::<30>(6, 60, 200, |_, _| ());
}

/// Rows that all pass through one point, many more than there are unknowns.
#[test]
fn solves_degenerate_vertices() {
    let mut random = Random::new(7);
    for _ in 0..3000 {
        let vertex: [f64; 4] = std::array::from_fn(|_| random.normal());
        let rows = (0..12).map(|_| {
            let v: [f64; 4] = unit(&mut random);
            let v = v.map(|x| x * dot(&v, &vertex).signum());
            (v, dot(&v, &vertex), f64::INFINITY)
        });
        let problem = Problem { rows: rows.collect() };
        let (solver, outcome) = cold(&problem);
        assert!(matches!(outcome, Outcome::Optimal { .. }), "{outcome:?}");
        assert_optimal(&problem, &solver);
        assert_warm_equals_cold(&mut random, &problem, &solver);
    }
}

#[test]
fn refutes_contradictions() {
    let mut random = Random::new(8);
    let mut refuted = 0;
    for _ in 0..4000 {
        let mut problem = feasible::<3>(&mut random, 5);
        let beyond = problem.scale() * random.between(0.5, 2.0);
        problem.rows.push((unit(&mut random), beyond, f64::INFINITY));
        problem.rows.push((unit(&mut random), f64::NEG_INFINITY, -beyond));
        let (solver, outcome) = cold(&problem);
        match outcome {
            Outcome::Infeasible { row } => {
                refuted += 1;
                assert_refuted(&problem, &solver);
                assert!(solver.certificate().any(|(other, ..)| other == row));
                assert_eq!(enumerate(&problem), None);
            }
            _ => assert_optimal(&problem, &solver),
        }
    }
    assert!(refuted > 500, "only {refuted} contradictions");
}

/// Two parallel rows at distance `gap`: feasible if it is positive, refuted if negative, however small.
#[test]
fn tells_nearly_infeasible_from_infeasible() {
    let mut random = Random::new(9);
    for exponent in 1..=9 {
        let gap = 10f64.powi(-exponent);
        for _ in 0..200 {
            let v: [f64; 3] = unit(&mut random);
            let equality = (unit(&mut random), 0.3, 0.3);
            let level = random.between(0.5, 2.0);
            let (below, above) = ((v, f64::NEG_INFINITY, level), (v.map(|x| -x), f64::NEG_INFINITY, -level - gap));
            let contradiction = Problem { rows: vec![equality, below, above] };
            let (solver, outcome) = cold(&contradiction);
            assert!(matches!(outcome, Outcome::Infeasible { .. }), "gap {gap:e}: {outcome:?}");
            assert_refuted(&contradiction, &solver);
            let problem = Problem { rows: vec![equality, (v, level - gap, level)] };
            let (solver, outcome) = cold(&problem);
            assert!(matches!(outcome, Outcome::Optimal { .. }), "gap {gap:e}: {outcome:?}");
            assert_optimal(&problem, &solver);
        }
    }
}

#[test]
fn rests_at_zero_without_a_change() {
    let problem = Problem { rows: vec![([1.0, 0.0], -1.0, 1.0), ([0.0, 1.0], f64::NEG_INFINITY, 0.0)] };
    let (solver, outcome) = cold(&problem);
    assert_eq!((outcome, solver.w()), (Outcome::Optimal { iterations: 0 }, &[0.0, 0.0]));
}

#[test]
fn stops_at_the_budget() {
    let problem = Problem { rows: vec![([1.0, 0.0], 1.0, 2.0), ([0.0, 1.0], 1.0, 2.0)] };
    let mut solver = Solver::NEW;
    assert_eq!(solver.solve(&problem, &WorkingSet::EMPTY, 1), Outcome::IterationLimit);
    assert_eq!(solver.solve(&problem, &WorkingSet::EMPTY, 2), Outcome::Optimal { iterations: 2 });
    assert_eq!(solver.w(), &[1.0, 1.0]);
}

/// The answer scales with the data: no tolerance is absolute.
#[test]
fn has_no_absolute_tolerance() {
    for size in [1e-12, 1.0, 1e12] {
        let (a, b) = ([0.6, 0.8], [0.8, -0.6]);
        let problem = Problem { rows: vec![(a, 0.5 * size, size), (b, -size, -0.25 * size)] };
        let (solver, outcome) = cold(&problem);
        assert_eq!(outcome, Outcome::Optimal { iterations: 2 });
        assert_close(solver.w(), &[0.1 * size, 0.55 * size], 1e-14);
    }
}

/// Rows normal . w >= limit.
fn at_least<const NV: usize>(rows: &[([f64; NV], f64)]) -> Problem<NV> {
    Problem { rows: rows.iter().map(|(normal, limit)| (*normal, *limit, f64::INFINITY)).collect() }
}

/// How far the worst row is from holding, relative to its limit and w.
fn off<const NV: usize>(problem: &Problem<NV>, w: &[f64; NV]) -> f64 {
    let size = largest(w);
    let off = |(normal, limit): ([f64; NV], f64)| (dot(&normal, w) - limit) / (limit.abs() + size);
    problem.halfspaces().into_iter().map(off).fold(0.0, f64::max)
}

/// Rows within 1e-5 to 1e-7 of each other, whose working set no refinement makes hold: that is no solution.
#[test]
fn calls_nothing_optimal_that_does_not_hold() {
    let hand_made = at_least(&[
        ([1.0, 0.0, 0.0, 0.0], 0.9749002926780441),
        ([0.9953711700939267, -0.09610532630604929, 1.2061687186563002e-6, 0.0], 0.1553366409117516),
        ([-0.9999999999999907, 1.3738775012262227e-7, 0.0, 0.0], -0.5708505635195038),
        ([0.995401707051562, 1.1524926917820529e-5, -0.09578852470810614, 5.072034935851988e-7], 0.21603717730486816),
    ]);
    let mut random = Random::new(11);
    let mut optimal = 0;
    for case in 0..5000 {
        let count = 3 + case % 2;
        let base = unit::<4>(&mut random);
        let rows: Vec<_> = (0..count)
            .map(|_| {
                let near = 10f64.powf(random.between(-7.0, -5.0));
                let side = if random.between(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
                let beside = unit::<4>(&mut random);
                let normal: [f64; 4] = std::array::from_fn(|k| side * (base[k] + near * beside[k]));
                (normalised(normal), random.between(-1.0, 1.0))
            })
            .collect();
        let problem = if case == 0 { hand_made.clone() } else { at_least(&rows) };
        let (solver, outcome) = cold(&problem);
        if let Outcome::Optimal { .. } = outcome {
            assert!(off(&problem, solver.w()) <= 1e-9, "case {case}: {}", off(&problem, solver.w()));
            optimal += 1;
        }
    }
    assert!(optimal > 1000, "{optimal}");
}

/// The noise of large multipliers hides the third row at the first look.
#[test]
fn looks_again_where_noise_hid_a_row() {
    let small = 2f64.powi(-23);
    let problem = at_least(&[([1.0, 0.0, 0.0], 1.0), ([-1.0, small, 0.0], 1.0), ([0.0, 0.0, 1.0], 0.1)]);
    let (solver, outcome) = cold(&problem);
    assert!(matches!(outcome, Outcome::Optimal { .. }), "{outcome:?}");
    assert_close(solver.w(), &[1.0, 2f64.powi(24), 0.1], 1e-15);
    assert_eq!(solver.w()[2], 0.1);
}

/// A problem whose rows say that their limits are usually much smaller.
struct Understated<const NV: usize>(Problem<NV>, f64);

impl<const NV: usize> Rows<NV> for Understated<NV> {
    fn iter(&self) -> impl Iterator<Item = Row<'_>> {
        self.0.iter().map(|row| Row { scale: self.1, ..row })
    }
}

/// w = (0.99833, 1.52, 0.99833) satisfies all rows; it is not far from where the contradiction seems to be.
#[test]
fn proves_nothing_by_a_scale_that_is_too_small() {
    let (limit, angle) = (0.9983337467303341, 4.614189210527822e-8_f64);
    let rows = [
        ([1.0, 0.0, 0.0], limit),
        ([-angle.cos(), angle.sin(), 0.0], -limit + 6.970672123744962e-8),
        ([0.0, 0.0, 1.0], limit),
    ];
    let mut solver = Solver::NEW;
    let outcome = solver.solve(&Understated(at_least(&rows), 1e-3), &WorkingSet::EMPTY, BUDGET);
    assert!(!matches!(outcome, Outcome::Infeasible { .. }), "{outcome:?}");
}
