//! Do the controllers keep every constraint under the benchmark's loads and under worse ones, and do frequencies return to zero?

use example_kit::checks::{Checks, NodeChecks};
use power_network::areas::{ANGLE, AREA};
use power_network::files::{Design, Known, Plant};
use power_network::model::Model;
use power_network::report::Outcome;
use power_network::runs::{Run, from_rest, guaranteed, promise, random};
use power_network::scenario::Scenario;

fn benchmark(design: Design, plant: &Model) -> Run {
    from_rest(design, plant, &Scenario::benchmark()).unwrap()
}

#[test]
fn the_benchmarks_loads_break_nothing_and_frequencies_return() {
    for design in Design::ALL {
        let run = benchmark(design, &guaranteed(design));
        let outcome = Outcome::of(&run);
        assert_eq!((run.checks.violations(), run.outside), (0, 0), "{design}");
        assert!(outcome.frequency > 0.01 && outcome.frequency_left < 1e-9, "{design}: {outcome:?}");
        // Integrators of the references know measured loads; nothing knows unknown ones.
        match design.loads {
            Known::Measured => assert!(outcome.angle_left < 1e-9, "{design}: {outcome:?}"),
            Known::Unknown => assert!((1e-3..0.4 * ANGLE).contains(&outcome.angle_left), "{design}: {outcome:?}"),
        }
    }
}

/// Nothing is promised here, but the benchmark's own constraints are kept all the same.
#[test]
fn designs_for_the_model_do_on_the_exact_plant() {
    for design in Design::ALL.into_iter().filter(|design| design.plant == Plant::Held) {
        let run = benchmark(design, &Model::exact());
        let (states, inputs) = (run.checks.sum(|n| n.states.violations), run.checks.sum(|n| n.inputs.violations));
        assert_eq!((states, inputs), (0, 0), "{design}");
        assert!(Outcome::of(&run).frequency_left < 1e-9, "{design}");
    }
}

#[test]
fn random_loads_and_upsets_break_nothing() {
    for design in Design::ALL {
        let mut all = Checks::new(&promise(design).unwrap());
        for seed in 0..8 {
            let run = random(design, &guaranteed(design), seed, 400, 40).unwrap();
            assert_eq!((run.checks.violations(), run.outside), (0, 0), "{design}, seed {seed}: {:#?}", run.checks);
            all.absorb(&run.checks);
        }
        assert!(all.sum(|node| node.active) > 50, "{design}: constraints must matter for the test to mean anything");
        let nearest = |of: fn(&NodeChecks) -> f64| all.nodes.iter().map(of).fold(f64::INFINITY, f64::min);
        let closest = nearest(|node| node.inputs.share_left()).min(nearest(|node| node.states.share_left()));
        assert!(closest < 0.02, "{design}: so must the limits of states and inputs");
    }
}

/// The checks see what happens: loads three times as large leave the tubes of a design that does not know them.
#[test]
fn loads_beyond_the_design_are_seen() {
    let design = Design { plant: Plant::Held, loads: Known::Unknown };
    let mut scenario = Scenario::benchmark();
    scenario.loads.iter_mut().for_each(|(_, loads)| *loads = loads.map(|load| 3.0 * load));
    let run = from_rest(design, &guaranteed(design), &scenario).unwrap();
    assert!(run.checks.sum(|node| node.tube.violations) > 0);
    let measured = Design { plant: Plant::Held, loads: Known::Measured };
    let run = from_rest(measured, &guaranteed(measured), &scenario).unwrap();
    assert!(run.outside > 100, "{}", run.outside);
    assert!(AREA.iter().all(|area| area.load[0] <= 0.0 && area.load[1] >= 0.0));
}
