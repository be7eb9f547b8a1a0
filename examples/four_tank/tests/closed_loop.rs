//! Do the emitted controllers, together on the linear plant, keep every constraint and reach what can be reached?

use four_tank::DESIGN_JSON;
use four_tank::checks::{Checks, NodeChecks};
use four_tank::controllers::{left, right};
use four_tank::plant::{A, B, LinearTanks, NonlinearTanks};
use four_tank::random::Random;
use four_tank::report::End;
use four_tank::runs::{at_rest, from_rest, random};
use four_tank::scenario::Scenario;
use four_tank::sets::Promise;
use four_tank::upset::admitted_state;

fn promise() -> Promise {
    Promise::new(DESIGN_JSON).unwrap()
}

#[test]
fn the_design_is_of_the_printed_system() {
    let nodes = promise().subsystems;
    for (i, limits) in [([-12.4, -1.4], [27.6, 38.6]), ([-12.7, -1.8], [27.3, 38.2])].iter().enumerate() {
        let block = |matrix: &[[f64; 4]; 4]| [0, 1].map(|r| matrix[2 * i + r][2 * i..2 * i + 2].to_vec()).to_vec();
        assert_eq!(nodes[i].A, block(&A));
        assert_eq!(nodes[i].B, [0, 1].map(|r| vec![B[2 * i + r][i]]).to_vec());
        (0..2).for_each(|k| assert_eq!(nodes[i].X.interval(k), [limits.0[k], limits.1[k]]));
        assert_eq!(nodes[i].U.interval(0), [-3.0, 3.0]);
    }
    assert_eq!(left::TABLES.model.A.map(Vec::from).to_vec(), nodes[0].A);
    assert_eq!(right::TABLES.model.A.map(Vec::from).to_vec(), nodes[1].A);
    assert_eq!(left::TABLES.model.EL, [[A[0][3] / right::TABLES.model.Cz[0][1]], [0.0]]);
    assert_eq!(right::TABLES.model.EL, [[A[2][1] / left::TABLES.model.Cz[0][1]], [0.0]]);
}

#[test]
fn nominal_set_points_are_reached() {
    let promise = promise();
    let run = from_rest(&LinearTanks, &promise, &Scenario::nominal()).unwrap();
    assert_eq!(run.checks.violations(), 0, "{:#?}", run.checks);
    for end in End::of(&run, &promise).unwrap() {
        assert!(end.error() < 0.05, "{end:?}");
    }
}

#[test]
fn set_points_outside_lead_to_the_nearest_point_inside() {
    let promise = promise();
    let run = from_rest(&LinearTanks, &promise, &Scenario::clipping()).unwrap();
    assert_eq!(run.checks.violations(), 0);
    let [first, second] = End::of(&run, &promise).unwrap();
    assert!(first.nearest < 8.0 && first.error() < 1e-6 && second.error() < 1e-6, "{first:?} {second:?}");
}

fn all(between: Option<usize>) -> Checks {
    let promise = promise();
    let mut all = Checks::new(&promise);
    for seed in 1000..1010 {
        let run = random(&promise, seed, 400, between).unwrap();
        assert_eq!(run.checks.violations(), 0, "seed {seed}: {:#?}", run.checks);
        all.absorb(&run.checks);
    }
    all
}

#[test]
fn deviations_that_the_design_admits_are_absorbed() {
    assert!(all(None).sum(|node| node.active) >= 20, "constraints must matter for the test to mean anything");
    assert!(all(Some(20)).sum(|node| node.active) >= 400, "constraints must matter for the test to mean anything");
}

/// What the controllers say when the tanks of one subsystem are put `share` of the way to the edge of what is feasible.
fn first_step(share: f64, seed: u64) -> Checks {
    let promise = promise();
    let mut tanks = at_rest(&LinearTanks, &promise).unwrap();
    tanks.upset(0, |node| admitted_state(node, &mut Random::new(seed), share));
    let mut checks = Checks::new(&promise);
    checks.look(tanks.step([0.0; 2]).unwrap().views());
    checks
}

#[test]
fn the_edge_of_what_is_admitted_is_sharp() {
    for seed in 0..50 {
        let (inside, outside) = (first_step(1.0, seed), first_step(1.0 + 1e-6, seed));
        assert_eq!(inside.violations(), 0, "seed {seed}");
        assert_eq!(outside.nodes[0].infeasible, 1, "seed {seed}");
        assert_eq!(outside.nodes[1].infeasible, 0, "seed {seed}");
    }
}

#[test]
fn nonlinear_plant_stays_near_the_linear_one() {
    let promise = promise();
    let linear = from_rest(&LinearTanks, &promise, &Scenario::nominal()).unwrap();
    let nonlinear = from_rest(&NonlinearTanks::new(10), &promise, &Scenario::nominal()).unwrap();
    let pairs = linear.trajectory.samples.iter().zip(&nonlinear.trajectory.samples);
    let apart = pairs.flat_map(|(a, b)| (0..2).map(move |i| (a.nodes[i].x[0] - b.nodes[i].x[0]).abs()));
    assert!(apart.fold(0.0, f64::max) < 0.5);
    let count = |of: fn(&NodeChecks) -> usize| nonlinear.checks.sum(of);
    assert_eq!((count(|node| node.states.violations), count(|node| node.inputs.violations)), (0, 0));
}
