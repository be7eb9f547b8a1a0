//! Does every start have a plan that keeps all constraints, or a reason that another program confirms?
#![expect(non_snake_case, reason = "the paper's symbols")]

use std::path::Path;

use dpc_codegen::convex::Polytope;
use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::Source;
use dpc_codegen::network::{Start, Subsystem};
use dpc_codegen::start::{LONGEST, Nearest, NoPlan, StartPlan};
use dpc_tests::host_loop::{HostLoop, Mission};
use dpc_tests::random_network::RandomNetwork;
use dpc_tests::start_checker::violation;
use dpc_tests::{Random, cases_wanted, read};
use nalgebra::DVector;

/// Steps after the plan is through.
const AFTER: usize = 300;

/// The other program's objective below which it calls a start possible: its solver's tolerance, in units of the bounds.
const NOTHING: f64 = 1e-6;

/// Starts this near to one with a plan, as a share of a state's range, may be called either way: margins.
const BORDERLINE: f64 = 1e-4;

/// The design of a text, with all rows that starts anywhere need.
fn anywhere(source: Source) -> Option<Design> {
    let text = format!("start-anywhere = true\n{}", source.text);
    Design::new(Source { text, ..source }).ok()
}

/// A point of every X_i: towards a random corner of its hull (3 natural sizes away where there is none), half of them next to the
/// boundary.
fn state(design: &Design, random: &mut Random) -> Vec<DVector<f64>> {
    let parts = design.network.subsystems.iter().zip(&design.sets.subsystems);
    // All full, or all empty, is what no start-up gets out of.
    let all = random.chance(0.3).then(|| random.sign());
    let set = |s: &Subsystem| Polytope { H: s.X.H.clone(), h: s.X.h.clone() };
    parts.map(|(s, sets)| point(&set(s), &sets.scales.x, all, random)).collect()
}

fn point(X: &Polytope, natural: &DVector<f64>, all: Option<f64>, random: &mut Random) -> DVector<f64> {
    let mut reach = |k: usize| {
        let axis =
            DVector::from_fn(natural.len(), |j, _| if j == k { all.unwrap_or_else(|| random.sign()) } else { 0.0 });
        let end = X.support(&axis).map_or(3.0 * natural[k], |(end, _)| end);
        axis[k] * end * random.between(if all.is_some() { 0.9 } else { 0.2 }, 1.0)
    };
    let corner = DVector::from_fn(natural.len(), |k, _| reach(k));
    let ways = (&X.H * &corner).iter().zip(&X.h).map(|(way, h)| h / way).filter(|way| *way > 0.0).collect::<Vec<_>>();
    let edge = ways.into_iter().fold(1.0, f64::min);
    corner * (edge * if random.chance(0.5) { 1.0 - 1e-4 } else { random.between(0.0, 1.0) })
}

/// What a campaign has seen.
#[derive(Debug, Default)]
struct Seen {
    plans: usize,
    none: usize,
    borderline: usize,
    unknown: usize,
    longest: usize,
}

/// `share` of the way from the start to the nearest one with a plan.
fn part_of_the_way(nearest: &Nearest, x0: &[DVector<f64>], share: f64) -> Vec<DVector<f64>> {
    x0.iter().zip(&nearest.x0).map(|(x, near)| x + (near - x) * share).collect()
}

/// No plan: another program agrees, for the start and for one next to the nearest with a plan, which has one.
fn confirm_none(design: &Design, x0: &[DVector<f64>], refusal: &NoPlan, seen: &mut Seen) {
    let NoPlan::NoneFound { nearest: Some(nearest), .. } = refusal else { panic!("{refusal}") };
    let start = Start::at(x0.to_vec(), &design.network);
    let distance = nearest.distance(&start);
    assert!(design.plan(&nearest.x0).is_ok(), "the nearest start has no plan: {refusal}");
    assert!(!nearest.rows.is_empty() && nearest.bound <= distance * (1.0 + 1e-6) + BORDERLINE, "{refusal}");
    if distance < BORDERLINE {
        seen.borderline += 1;
        return;
    }
    let next_to_it = part_of_the_way(nearest, x0, 1.0 - (0.02_f64).max(BORDERLINE / distance));
    for start in [x0, &next_to_it] {
        match violation(design, start, LONGEST) {
            Some(sum) => assert!(sum > NOTHING, "a plan of {sum:e} in violations, {distance} away: {refusal}"),
            None => seen.unknown += 1,
        }
    }
    seen.none += 1;
}

fn confirm_plan(design: &Design, x0: &[DVector<f64>], plan: &StartPlan, seen: &mut Seen) {
    assert!(plan.margin > 0.0 && plan.steps >= design.network.horizon);
    match violation(design, x0, plan.steps) {
        Some(sum) => assert!(sum < NOTHING, "{sum:e} in violations, but a plan of {} steps", plan.steps),
        None => seen.unknown += 1,
    }
    seen.plans += 1;
    seen.longest = seen.longest.max(plan.steps);
}

/// Random networks: plans lead into closed loops without a violation, on the true plant, with set-points that jump.
#[test]
fn random_networks_start_anywhere_or_say_why_not() {
    let mut seen = Seen::default();
    let mut steps = 0;
    for seed in 20_000..20_000 + cases_wanted(8) as u64 {
        let case = RandomNetwork::new(seed);
        let Some(design) = anywhere(case.source()) else { continue };
        let random = &mut Random(seed);
        for _ in 0..3 {
            let x0 = state(&design, random);
            match design.plan(&x0) {
                Ok(plan) => {
                    confirm_plan(&design, &x0, &plan, &mut seen);
                    let mut network = HostLoop::planned(&design, &case.plant, &plan);
                    network.run(&Mission::Jumps, plan.steps + AFTER, random);
                    steps += network.tally.steps;
                    assert!(network.tally.violations.is_empty(), "seed {seed}: {:?}", network.tally.violations);
                }
                Err(refusal) => confirm_none(&design, &x0, &refusal, &mut seen),
            }
        }
    }
    println!("{seen:?}, {steps} steps of a subsystem in closed loop, 0 violations");
    assert!(seen.plans > 3 && seen.none > 3 && seen.unknown * 5 < seen.plans + 2 * seen.none, "{seen:?}");
}

fn four_tank() -> Design {
    anywhere(read(Path::new("../examples/four_tank/system.toml"))).expect("a design exists")
}

/// The four-tank, from all over X: both programs agree.
#[test]
fn the_four_tank_starts_anywhere_or_says_why_not() {
    let (design, random, mut seen) = (four_tank(), &mut Random(7), Seen::default());
    for _ in 0..cases_wanted(24) {
        let x0 = state(&design, random);
        match design.plan(&x0) {
            Ok(plan) => confirm_plan(&design, &x0, &plan, &mut seen),
            Err(refusal) => confirm_none(&design, &x0, &refusal, &mut seen),
        }
    }
    println!("{seen:?}");
    assert!(seen.plans > 5 && seen.none > 1 && seen.unknown < 4, "{seen:?}");
}

/// A plan states a trajectory of the model, to the last bit but for the sum's order, that ends at rest.
#[test]
fn plans_follow_the_model() {
    let design = four_tank();
    let x0 = [DVector::from_vec(vec![-12.0, -1.3]), DVector::from_vec(vec![20.0, 25.0])];
    let plan = design.plan(&x0).unwrap();
    let subsystems = &design.network.subsystems;
    let z = |j: usize, t: usize| {
        &subsystems[j].Cz * &plan.subsystems[j].x[t] + &subsystems[j].Dz * &plan.subsystems[j].u[t]
    };
    for t in 0..=plan.steps {
        for (i, (s, part)) in subsystems.iter().zip(&plan.subsystems).enumerate() {
            let mut next = &s.A * &part.x[t] + &s.B * &part.u[t];
            s.L.iter().for_each(|(&j, L)| next += &s.E * (L * z(j, t)));
            let (planned, exact) = match part.x.get(t + 1) {
                Some(planned) => (planned, 1e-14 * (1.0 + next.amax())),
                None => (&part.x[t], design.sizing.subsystems[i].drift.min()),
            };
            assert!((next - planned).amax() <= exact, "step {t} of {}", s.name);
        }
    }
    for (g, part) in design.gains.subsystems.iter().zip(&plan.subsystems) {
        assert_eq!(part.u[plan.steps], &g.Kx * &part.x[plan.steps] + &g.Ke * &part.e);
    }
}

/// The same text gives the same plan.
#[test]
fn plans_are_reproducible() {
    let x0 = [DVector::from_vec(vec![5.0, 1.0]), DVector::from_vec(vec![-2.0, 1.0])];
    assert_eq!(four_tank().plan(&x0).unwrap(), four_tank().plan(&x0).unwrap());
}

/// Without `start-anywhere` references stay where the rows that were left out cannot become active.
#[test]
fn designs_with_pruned_rows_plan_within_them() {
    let design = Design::new(read(Path::new("../examples/four_tank/system.toml"))).unwrap();
    let near = [DVector::from_vec(vec![4.5, 0.5]), DVector::from_vec(vec![0.0, 0.0])];
    let plan = design.plan(&near).unwrap();
    for (i, part) in plan.subsystems.iter().enumerate() {
        let (s, sized) = (&design.network.subsystems[i], &design.sizing.subsystems[i]);
        for (x, u) in part.x.iter().zip(&part.u) {
            let inside = Polytope { H: s.X.H.clone(), h: sized.x_ref.clone() }.violation(x);
            let admitted = Polytope { H: s.U.H.clone(), h: sized.u_ref.clone() }.violation(u);
            assert!(inside <= 1e-9 && admitted <= 1e-9, "{inside:e} {admitted:e}");
        }
    }
    let far = [DVector::from_vec(vec![-12.0, -1.3]), DVector::from_vec(vec![20.0, 25.0])];
    assert!(matches!(design.plan(&far), Err(NoPlan::NoneFound { .. })));
    assert!(four_tank().plan(&far).is_ok());
}

#[test]
fn what_is_no_state_is_refused() {
    let design = four_tank();
    let zero = || DVector::zeros(2);
    assert_eq!(design.plan(&[zero()]), Err(NoPlan::WrongShape { subsystem: 1 }));
    assert_eq!(design.plan(&[zero(), DVector::zeros(3)]), Err(NoPlan::WrongShape { subsystem: 1 }));
    assert_eq!(design.plan(&[DVector::from_vec(vec![f64::NAN, 0.0]), zero()]), Err(NoPlan::Outside { subsystem: 0 }));
    assert_eq!(design.plan(&[zero(), DVector::from_vec(vec![0.0, 38.3])]), Err(NoPlan::Outside { subsystem: 1 }));
}
