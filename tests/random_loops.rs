//! Do the controllers of random networks keep every constraint, on the true plant and against the worst neighbours, and
//! do their outputs arrive?

use dpc_codegen::design::Design;
use dpc_codegen::problems::RowKind;
use dpc_tests::host_loop::{HostLoop, Mission, Neighbours, Tally, Weather, nearest_feasible};
use dpc_tests::random_network::{Kind, RandomNetwork};
use dpc_tests::{Random, cases_wanted};
use nalgebra::DVector;

const STEPS: usize = 190;

/// The random networks that can be designed.
fn designs(cases: usize) -> impl Iterator<Item = (RandomNetwork, Design)> {
    designs_of(cases, RandomNetwork::new)
}

/// The same with disturbances, measurement errors and loads.
fn disturbed_designs(cases: usize) -> impl Iterator<Item = (RandomNetwork, Design)> {
    designs_of(cases, RandomNetwork::disturbed)
}

fn designs_of(cases: usize, network: fn(u64) -> RandomNetwork) -> impl Iterator<Item = (RandomNetwork, Design)> {
    // The seeds of the invariants' default campaign are looked at there.
    let first = std::env::var("DPC_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(10_000_u64);
    (first..first + cases as u64).filter_map(move |seed| {
        let case = network(seed);
        let design = Design::new(case.source()).ok()?;
        Some((case, design))
    })
}

/// A row of X or U to drive to its limit, of a subsystem that has one.
fn target(design: &Design, random: &mut Random) -> Option<Mission> {
    let rows = |i: &usize| design.network.subsystems[*i].X.h.len() + design.network.subsystems[*i].U.h.len();
    let subsystem = random.order(design.network.subsystems.len()).into_iter().find(|i| rows(i) > 0)?;
    Some(Mission::BangBang { subsystem, row: random.below(rows(&subsystem)) })
}

/// Jumping set-points and bang-bang references, on the plant and against adversarial neighbours.
fn run_all(case: &RandomNetwork, design: &Design) -> Tally {
    let random = &mut Random(case.seed);
    let mut tally = Tally::default();
    for neighbours in [Neighbours::True, Neighbours::Adversarial] {
        for mission in [Some(Mission::Jumps), target(design, random)].into_iter().flatten() {
            let mut network = HostLoop::start(design, &case.plant, neighbours, 1.0, random).compare(5);
            network.run(&mission, STEPS, random);
            network.compare_loads();
            let violations = &network.tally.violations;
            assert!(violations.is_empty(), "seed {}, {mission:?}, {neighbours:?}: {violations:?}", case.seed);
            tally.add(network.tally);
        }
    }
    tally
}

#[test]
fn every_constraint_is_kept() {
    let (mut tally, mut networks) = (Tally::default(), 0);
    for (case, design) in designs(cases_wanted(30)) {
        tally.add(run_all(&case, &design));
        networks += 1;
    }
    println!("{networks} networks, {} steps of a subsystem, 0 violations", tally.steps);
    println!("{} problems solved, {} with rows other than (35a) active", tally.solved, tally.constrained);
    println!("{} minimisers as Clarabel's to {:.1e}", tally.compared, tally.difference);
    println!("at most {} iterations", tally.most_iterations);
    tally.nearest.iter().for_each(|(what, near)| println!("{what}: {near:.9} of the limit"));
    assert!(tally.solved > 100 * networks && tally.constrained > 10 * networks && tally.compared > 10 * networks);
    assert!(tally.difference < 1e-8);
    assert!(tally.nearest.values().all(|near| *near > 0.5), "a limit that nothing comes near is not tested");
}

/// Disturbances and measurement errors at the worst corners, loads at their bounds and rates.
#[test]
fn every_constraint_is_kept_under_the_worst_that_is_stated() {
    let (mut tally, mut networks) = (Tally::default(), 0);
    for (case, design) in disturbed_designs(cases_wanted(20)) {
        tally.add(run_all(&case, &design));
        networks += 1;
    }
    println!("{networks} disturbed networks, {} steps of a subsystem, 0 violations", tally.steps);
    println!("{} problems solved, {} with rows other than (35a) active", tally.solved, tally.constrained);
    println!("in {} the forecast allowed more than the measurement", tally.forecasts);
    println!("{} numbers as the runtime's", tally.twins);
    println!("{} minimisers as Clarabel's to {:.1e}", tally.compared, tally.difference);
    tally.nearest.iter().for_each(|(what, near)| println!("{what}: {near:.9} of the limit"));
    assert!(tally.solved > 100 * networks && tally.constrained > 10 * networks && tally.compared > 10 * networks);
    assert!(tally.forecasts > networks && tally.twins > 1000 * networks && tally.difference < 1e-8);
    let worst = ["X", "U", "(35a) x - xhat in E", "(18) x - forecast in E", "(25b) references"];
    assert!(worst.iter().all(|what| tally.nearest[what] > 0.9), "a limit that nothing comes near is not tested");
}

/// Loads that jump, also beyond their bounds: references stay admissible whatever they do, and where a step alone shows that
/// x - xhat is in E_i, everything else holds again.
#[test]
fn loads_that_break_their_word_cost_no_more_than_is_said() {
    let (mut tally, mut networks) = (Tally::default(), 0);
    for (case, design) in disturbed_designs(cases_wanted(20)) {
        if case.plant.parts.iter().all(|part| part.unknowns.loads.is_empty()) {
            continue;
        }
        let random = &mut Random(case.seed);
        let start = HostLoop::start(&design, &case.plant, Neighbours::True, 0.5, random);
        let mut network = start.under(Weather::Breaking);
        network.run(&Mission::Jumps, 2 * STEPS, random);
        network.compare_loads();
        let violations = &network.tally.violations;
        assert!(violations.is_empty(), "seed {}: {violations:?}", case.seed);
        tally.add(network.tally);
        networks += 1;
    }
    println!("{networks} networks, {} steps of a subsystem: {} recovered", tally.steps, tally.recovered);
    println!("{} without a promise, {} numbers as the runtime's", tally.unsure, tally.twins);
    assert!(networks > 3 && tally.recovered > 100 * networks && tally.unsure > 10 * networks);
}

/// What a run under the worst weather violates.
fn violations_of_the_unaware(case: &RandomNetwork, design: &Design) -> Vec<String> {
    let random = &mut Random(case.seed);
    let mut all = Vec::new();
    for mission in [Some(Mission::Jumps), target(design, random)].into_iter().flatten() {
        let mut network = HostLoop::start(design, &case.plant, Neighbours::Adversarial, 1.0, random);
        network.run(&mission, STEPS, random);
        all.extend(network.tally.violations.into_keys());
    }
    all
}

/// The checks see what acts: a design that was not told of a kind of unknowns leaves its sets.
#[test]
fn a_controller_that_was_not_told_is_caught() {
    for kind in [Kind::Disturbance, Kind::Error, Kind::Loads] {
        let (mut caught, mut all) = (0, 0);
        for (case, informed) in disturbed_designs(20) {
            let unaware = RandomNetwork::unaware(case.seed, kind);
            let Ok(mut design) = Design::new(unaware.source()) else { continue };
            if unaware.text == case.text {
                continue;
            }
            // The controller is the unaware one's; the checks and the plant know.
            for (s, other) in design.network.subsystems.iter_mut().zip(&informed.network.subsystems) {
                s.loads.clone_from(&other.loads);
            }
            let found = violations_of_the_unaware(&case, &design);
            caught += usize::from(found.iter().any(|what| what.contains("in E") || what.contains("(25b)")));
            all += 1;
        }
        println!("{kind:?}: {caught} of {all} caught");
        // What is symmetric in E_i only, and neighbours that do less than they may, leave room for a small error.
        assert!(3 * caught > all, "{kind:?}: {caught} of {all} caught");
    }
}

/// Steps that the references need to `goal`, then until all modes have decayed by 1e-10; `None` where that is too long.
fn steps_to(design: &Design, start: &DVector<f64>, goal: &DVector<f64>) -> Option<usize> {
    let way = (goal - start).iter().map(|way| way.abs()).sum::<f64>() / design.sizing.epsilon;
    let rho =
        design.gains.subsystems.iter().map(|g| g.rho_F).fold(design.gains.rho_calF.max(design.gains.rho_F), f64::max);
    let decay = 1e-10_f64.ln() / rho.ln();
    // Straight for one output; with several, limits and weights bend the way.
    let steps = 2.0 * way + decay;
    (steps < 8000.0).then_some(steps as usize + design.network.horizon + 300)
}

/// Theorem 1, part 2: without coupling constraints every output goes to the point of Y_i nearest to its set-point.
#[test]
fn outputs_converge_to_the_nearest_feasible_set_points() {
    let (mut arrived, mut too_far, mut worst) = (0, 0, 0.0_f64);
    for (case, design) in designs(cases_wanted(25)).filter(|(_, design)| design.network.coupling_constraints.is_empty())
    {
        let random = &mut Random(case.seed);
        let mut network = HostLoop::start(&design, &case.plant, Neighbours::True, 0.9, random);
        let start = network.references();
        let reach = design.sizing.epsilon * 150.0;
        let set_point = start.map(|y| y + random.between(-reach, reach));
        let goal = nearest_feasible(&design, &set_point);
        let Some(steps) = steps_to(&design, &start, &goal) else {
            too_far += 1;
            continue;
        };
        network.settle(&Mission::Constant(set_point), steps, random);
        assert!(network.tally.violations.is_empty(), "seed {}: {:?}", case.seed, network.tally.violations);
        let error = (network.outputs() - &goal).amax() / (1.0 + goal.amax());
        assert!(error < 1e-6, "seed {}: {error:e} off after {steps} steps", case.seed);
        worst = worst.max(error);
        arrived += 1;
    }
    println!("{arrived} networks arrived, the worst {worst:.1e} off; {too_far} are too slow to wait for");
    assert!(arrived > 4 * too_far);
}

/// The same after loads have moved and come to rest: the integrators of (7b) leave no error.
#[test]
fn outputs_converge_where_loads_come_to_rest() {
    let (mut arrived, mut worst) = (0, 0.0_f64);
    for (case, design) in disturbed_designs(cases_wanted(20)) {
        let loaded = case.plant.parts.iter().any(|part| !part.unknowns.loads.is_empty());
        if !loaded || !design.network.coupling_constraints.is_empty() {
            continue;
        }
        let random = &mut Random(case.seed);
        let mut network = HostLoop::start(&design, &case.plant, Neighbours::True, 0.9, random);
        network.run(&Mission::Jumps, STEPS, random);
        let start = network.references();
        let reach = design.sizing.epsilon * 150.0;
        let set_point = start.map(|y| y + random.between(-reach, reach));
        let goal = nearest_feasible(&design, &set_point);
        let Some(steps) = steps_to(&design, &start, &goal) else { continue };
        network.settle(&Mission::Constant(set_point), steps, random);
        assert!(network.tally.violations.is_empty(), "seed {}: {:?}", case.seed, network.tally.violations);
        let error = (network.outputs() - &goal).amax() / (1.0 + goal.amax());
        assert!(error < 1e-6, "seed {}: {error:e} off after {steps} steps", case.seed);
        worst = worst.max(error);
        arrived += 1;
    }
    println!("{arrived} networks arrived, the worst {worst:.1e} off");
    assert!(arrived > 1);
}

/// What a run with jumping set-points on the true plant violates.
fn violations(case: &RandomNetwork, design: &Design) -> Vec<String> {
    let random = &mut Random(case.seed);
    let mut network = HostLoop::start(design, &case.plant, Neighbours::True, 1.0, random);
    network.run(&Mission::Jumps, STEPS, random);
    network.tally.violations.into_keys().collect()
}

/// (35a) and (35d) a tenth too wide.
fn widen(design: &mut Design) {
    for dpc in design.problems.subsystems.iter_mut().map(|problem| &mut problem.dpc) {
        let widened = |kind: RowKind| matches!(kind, RowKind::Tube | RowKind::Input(_));
        for r in (0..dpc.rows.len()).filter(|&r| widened(dpc.rows[r].kind)) {
            dpc.upper[r] *= 1.1;
            dpc.lower[r] *= 1.1;
        }
    }
}

/// The checks see what the controllers do: wider rows break U in most networks.
#[test]
fn a_controller_that_allows_too_much_is_caught() {
    let (mut caught, mut all) = (0, 0);
    for (case, mut design) in designs(10) {
        assert!(violations(&case, &design).is_empty());
        widen(&mut design);
        caught += usize::from(violations(&case, &design).iter().any(|what| what == "U"));
        all += 1;
    }
    println!("{caught} of {all} spoilt controllers left U");
    assert!(2 * caught > all);
}
