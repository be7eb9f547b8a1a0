//! Do the controllers of a design that states disturbances, measurement errors and loads keep every constraint under the worst of
//! all?
#![expect(non_snake_case, reason = "the paper's symbols")]

use four_tank::DISTURBED_DESIGN_JSON;
use four_tank::checks::Checks;
use four_tank::disturbed::{Weather, from_rest, run};
use four_tank::plant;
use four_tank::report::End;
use four_tank::scenario::Scenario;
use four_tank::sets::Promise;
use four_tank::trajectory::NodeSample;
use nalgebra::{DMatrix, DVector};

const STEPS: usize = 500;

fn promise() -> Promise {
    Promise::new(DISTURBED_DESIGN_JSON).unwrap()
}

fn all(seeds: std::ops::Range<u64>, excess: f64) -> Checks {
    let promise = promise();
    let mut all = Checks::new(&promise);
    let weather = Weather { excess, loads_until: STEPS, upset: true, breach: None };
    seeds.for_each(|seed| all.absorb(&run(&promise, seed, STEPS, weather).unwrap().checks));
    all
}

/// Counts, and how much of each set was left at the closest.
fn shown(what: &str, checks: &Checks) {
    println!("{what}: {} steps, {} violations", checks.steps, checks.violations());
    for node in &checks.nodes {
        let [states, inputs, tube, coupling] = [&node.states, &node.inputs, &node.tube, &node.coupling];
        for (what, watch) in [("states", states), ("inputs", inputs), ("tube", tube), ("coupling", coupling)] {
            println!(
                "  {what:<9}{:>6} violations, {:.4} of the closest limit left",
                watch.violations,
                watch.share_left()
            );
        }
        println!("  infeasible {}, fell back {}, active {}", node.infeasible, node.fell_back, node.active);
    }
}

#[test]
fn the_worst_that_is_stated_breaks_nothing() {
    let checks = all(0..120, 1.0);
    shown("at the bounds, 120 seeds", &checks);
    assert_eq!(checks.steps, 120 * STEPS);
    assert_eq!(checks.violations(), 0);
    assert!(checks.sum(|node| node.active) > 500, "constraints must matter for the test to mean anything");
    assert!(checks.nodes.iter().all(|node| node.tube.share_left() < 0.5), "so must the disturbances");
}

#[test]
fn worse_than_stated_breaks_the_tube() {
    let checks = all(0..10, 4.0);
    shown("4 times the bounds, 10 seeds", &checks);
    assert!(checks.nodes.iter().all(|node| node.tube.violations > 0));
}

/// One tank is pushed out of its tube once; from then on everything keeps its bounds again. Where all nodes say that they are
/// guaranteed, they are: a node whose forecast rests on a neighbour that was not must not trust it, however well the
/// measurement fits.
#[test]
fn the_guarantee_that_a_push_takes_comes_back_as_it_says() {
    let promise = promise();
    let (mut lost, mut withdrawn, mut late) = (0, 0, 0);
    for seed in 0..60 {
        let weather = Weather { excess: 1.0, loads_until: STEPS, upset: true, breach: Some(50) };
        let run = run(&promise, seed, STEPS, weather).unwrap();
        for (step, sample) in run.trajectory.samples.iter().enumerate() {
            let guaranteed = sample.nodes.iter().all(|node| node.status.is_guaranteed());
            if guaranteed {
                let mut checks = Checks::new(&promise);
                checks.look(sample.views());
                assert_eq!(checks.violations(), 0, "seed {seed}, step {step}: {sample:?}");
            }
            assert!(guaranteed || step >= 50, "seed {seed}, step {step}");
            lost += usize::from(!guaranteed);
            late = late.max(if guaranteed { 0 } else { step });
            let uncertain = |node: &NodeSample| node.status.control.is_admissible() && !node.status.certified;
            withdrawn += usize::from(sample.nodes.iter().any(uncertain));
        }
    }
    println!("{lost} steps without the guarantee, the last is {late}; {withdrawn} with a certificate withdrawn");
    assert!(lost > 60 && withdrawn > 20 && late < STEPS - 1);
}

/// Nominal trajectories converge to the references, references to the set-points, and levels to what disturbances and
/// measurement errors hold open around them: the sums over |(A + BK)^k|.
#[test]
fn outputs_come_into_the_neighbourhood_of_their_set_points() {
    let promise = promise();
    let reach = neighbourhood(&promise);
    let (mut farthest, mut settled) = ([0.0f64; 2], Scenario::nominal());
    settled.steps += 4000;
    let weather = Weather { excess: 1.0, loads_until: 1200, upset: false, breach: None };
    for seed in 0..10 {
        let run = from_rest(&promise, seed, &settled, weather).unwrap();
        assert_eq!(run.checks.violations(), 0, "seed {seed}");
        for sample in &run.trajectory.samples[settled.steps - 1000..] {
            for (i, node) in sample.nodes.iter().enumerate() {
                assert!((node.x_nom[0] - node.y_ref).abs() < 1e-3, "seed {seed}: {node:?}");
                farthest[i] = farthest[i].max((node.x[0] - node.y_ref).abs());
            }
        }
        let last = run.trajectory.samples.last().unwrap();
        for (end, node) in End::of(&run, &promise).unwrap().iter().zip(&last.nodes) {
            assert!((node.y_ref - end.nearest).abs() < 1e-9, "seed {seed}: {end:?}");
        }
    }
    println!("levels stay within {farthest:.4?} cm of their references, {reach:.4?} cm are possible");
    assert!((0..2).all(|i| farthest[i] < reach[i] * (1.0 + 1e-3) && farthest[i] > 0.3 * reach[i]));
}

/// Loads at their largest rates, then at rest: the integrators of (7b) leave no error, and on the way the tube holds what the
/// references do not know yet.
#[test]
fn loads_that_come_to_rest_leave_no_error() {
    let promise = promise();
    let mut scenario = Scenario::nominal();
    scenario.steps += 8000;
    let weather = Weather { excess: 0.0, loads_until: 1200, upset: false, breach: None };
    let mut moved: f64 = 0.0;
    for seed in 0..10 {
        let run = from_rest(&promise, seed, &scenario, weather).unwrap();
        assert_eq!(run.checks.violations(), 0, "seed {seed}");
        moved = run.trajectory.samples[..1200]
            .iter()
            .fold(moved, |moved, sample| moved.max((sample.nodes[0].x[0] - sample.nodes[0].x_nom[0]).abs()));
        for end in End::of(&run, &promise).unwrap() {
            assert!(end.error() < 1e-6, "seed {seed}: {end:?}");
        }
    }
    println!("loads move h1 by up to {moved:.4} cm from its nominal state");
    assert!(moved > 0.01);
}

/// How far h1 and h3 can be from their references for ever: x+ - xref+ = (A + BK)(x - xref) + BK v + w.
fn neighbourhood(promise: &Promise) -> [f64; 2] {
    let A = DMatrix::from_fn(4, 4, |r, c| plant::A[r][c]);
    let B = DMatrix::from_fn(4, 2, |r, c| plant::B[r][c]);
    let node = |k: usize| &promise.subsystems[k / 2];
    let K = DMatrix::from_fn(2, 4, |r, c| if c / 2 == r { node(c).K[0][c % 2] } else { 0.0 });
    let w = DVector::from_fn(4, |k, _| {
        node(k).disturbance.as_ref().unwrap().interval(k % 2).map(f64::abs).into_iter().fold(0.0, f64::max)
    });
    let v = DVector::from_fn(4, |k, _| node(k).measurement_error[k % 2]);
    let (F, BK) = (A + &B * &K, B * K);
    let (mut power, mut reach) = (DMatrix::<f64>::identity(4, 4), DVector::<f64>::zeros(4));
    for _ in 0..5000 {
        reach += power.abs() * &w + (&power * &BK).abs() * &v;
        power *= &F;
    }
    [reach[0], reach[2]]
}
