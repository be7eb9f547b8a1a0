//! Do the emitted controllers start anywhere they have a plan for, emitted or made by the compiler's library while they run, and
//! refuse what does not fit?

use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::Source;
use dpc_codegen::start::SubsystemPlan;
use dpc_runtime::{PlannedPoint, StartError, StartPlan};
use four_tank::STARTED_DESIGN_JSON;
use four_tank::random::Random;
use four_tank::runs::{Plan, planned, planned_from};
use four_tank::scenario::{Scenario, output_ranges};
use four_tank::sets::Promise;
use four_tank::started_controllers::{left, right};
use nalgebra::DVector;

fn promise() -> Promise {
    Promise::new(STARTED_DESIGN_JSON).unwrap()
}

fn design() -> Design {
    let text = include_str!("../designs/started.toml").to_owned();
    Design::new(Source { path: "started.toml".into(), text }).unwrap()
}

/// What a host sends to a node, in the node's types.
fn received(part: &SubsystemPlan) -> Plan {
    let point = |(x, u): (&DVector<f64>, &DVector<f64>)| PlannedPoint { x: [x[0], x[1]], u: [u[0]] };
    let points: Vec<_> = part.x.iter().zip(&part.u).map(point).collect();
    let nominal = dpc_runtime::problem::Plan { dx: [part.dx[0], part.dx[1]], du: [0, 1, 2].map(|k| [part.du[k][0]]) };
    StartPlan { design: part.design, plan: part.plan, points: points.leak(), e: [part.e[0]], nominal }
}

#[test]
fn tanks_that_are_empty_and_full_are_led_to_the_set_points() {
    let run = planned(&promise(), &Scenario::nominal()).unwrap();
    assert_eq!(run.checks.violations(), 0, "{:#?}", run.checks);
    let last = run.trajectory.samples.last().unwrap();
    assert!(
        (last.nodes[0].x[0] - promise().output_ranges()[0][1]).abs() < 1e-3 && (last.nodes[1].x[0] - 0.5).abs() < 1e-3
    );
}

/// References are the plan's up to its end, and rest there where the set-point is; the emitted plan is that of the library.
#[test]
fn references_are_the_plans() {
    let plan = design().start.unwrap();
    let parts = [received(&plan.subsystems[0]), received(&plan.subsystems[1])];
    assert_eq!((parts[0], parts[1]), (left::START, right::START));
    let scenario = Scenario { name: "start-up", changes: vec![(0.0, [0.0, 0.0])], steps: plan.steps };
    let run = planned(&promise(), &scenario).unwrap();
    let (promise, mut worst) = (promise(), 0.0_f64);
    for (t, sample) in run.trajectory.samples.iter().enumerate() {
        for (i, (node, part)) in sample.nodes.iter().zip(&parts).enumerate() {
            let PlannedPoint { x, u } = part.points[t];
            let z = promise.subsystems[i].coupling_output(&x, &u);
            worst = worst.max((node.z_ref[0] - z[0]).abs()).max((node.y_ref - x[0]).abs());
        }
    }
    assert!(worst < 1e-12, "{worst:e}");
}

#[test]
fn a_state_that_does_not_fit_is_refused_and_so_is_the_other_sides_plan() {
    assert!(left::start_planned(&left::START, &left::START_X).is_ok());
    let [h1, h2] = left::START_X;
    for x in [[h1, h2 + 1.0], [h1 + 28.0, h2], [0.0, 0.0], [27.0, 38.0]] {
        let refused = left::start_planned(&left::START, &x).map(|_| ());
        let Err(StartError::StateDoesNotFit { row }) = refused else { panic!("{x:?}: {refused:?}") };
        assert!(!left::ROWS[row].is_empty());
    }
    let other = left::start_planned(&right::START, &left::START_X).map(|_| ());
    assert_eq!(other, Err(StartError::OtherDesign));
    assert_eq!(left::start_planned(&left::START, &[f64::NAN, 0.0]).map(|_| ()), Err(StartError::NotFinite));
}

/// Levels from all over X: plans made now, and closed loops with set-points that jump.
#[test]
fn plans_made_later_start_the_same_controllers() {
    let (design, promise, mut random) = (design(), promise(), Random::new(11));
    let ranges = [0, 1].map(|i| [0, 1].map(|k| promise.subsystems[i].X.interval(k)));
    let (mut started, mut refused) = (0, 0);
    for case in 0..30 {
        let share = if case % 3 == 0 { 0.999 } else { random.between(0.0, 1.0) };
        let levels = ranges.map(|range| range.map(|[low, high]| share * random.between(low, high)));
        let x0 = levels.map(|levels| DVector::from_vec(levels.to_vec()));
        let Ok(plan) = design.plan(&x0) else {
            refused += 1;
            continue;
        };
        let parts = [0, 1].map(|i| &*Box::leak(Box::new(received(&plan.subsystems[i]))));
        let scenario = Scenario::random(&mut random, output_ranges(&promise), plan.steps + 300);
        let [[h1, h2], [h3, h4]] = levels;
        let run = planned_from(&promise, parts, [h1, h2, h3, h4], &scenario).unwrap();
        assert_eq!(run.checks.violations(), 0, "{levels:?}: {:#?}", run.checks);
        started += 1;
    }
    println!("{started} starts without a violation, {refused} without a plan");
    assert!(started > 15);
}
