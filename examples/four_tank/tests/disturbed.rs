//! Do the controllers of a design that states disturbances and measurement errors keep every constraint under the worst of both?

use four_tank::DISTURBED_DESIGN_JSON;
use four_tank::checks::Checks;
use four_tank::disturbed::{from_rest, run};
use four_tank::report::End;
use four_tank::scenario::Scenario;
use four_tank::sets::Promise;

const STEPS: usize = 500;

fn promise() -> Promise {
    Promise::new(DISTURBED_DESIGN_JSON).unwrap()
}

fn all(seeds: std::ops::Range<u64>, excess: f64) -> Checks {
    let promise = promise();
    let mut all = Checks::new(&promise);
    seeds.for_each(|seed| all.absorb(&run(&promise, seed, STEPS, excess).unwrap().checks));
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

/// Nominal trajectories converge to the references, references to the set-points, outputs to what E_i leaves around them.
#[test]
fn outputs_come_into_the_neighbourhood_of_their_set_points() {
    let promise = promise();
    for seed in 0..10 {
        let run = from_rest(&promise, seed, &Scenario::nominal()).unwrap();
        assert_eq!(run.checks.violations(), 0, "seed {seed}");
        for (i, end) in End::of(&run, &promise).unwrap().iter().enumerate() {
            let reach = promise.subsystems[i].rpi.reach(0);
            println!("seed {seed}: {:.3} cm off, E reaches {reach:.3} cm", end.error());
            assert!(end.error() <= reach + 0.01, "seed {seed}: {end:?}, {reach}");
            let last = &run.trajectory.samples.last().unwrap().nodes[i];
            assert!((last.x_nom[0] - last.y_ref).abs() < 0.01, "{last:?}");
        }
    }
}
