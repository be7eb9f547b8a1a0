//! Do the emitted controllers do what Section V shows, on nonlinear robots?

use dpc_runtime::References;
use robots::arena::DIAMETER;
use robots::command::Fleet;
use robots::fleet::{EMITTED, text};
use robots::pace::Pace;
use robots::page::{page, verdict};
use robots::rule::Rule;
use robots::run::Run;
use robots::scenario::{Mission, Scenario};

fn paper(rule: Rule) -> Run {
    let run = Fleet::new(EMITTED, Pace::FAST).unwrap().run(&Scenario::paper(), rule, None).unwrap();
    assert!(run.smallest_distance() >= DIAMETER, "{}", run.smallest_distance());
    assert_eq!((run.unguaranteed(), run.left, run.strayed), (0, 0, 0));
    run
}

#[test]
fn tangents_lead_the_robots_to_their_goals() {
    for rule in [Rule::TANGENT, Rule::PLAIN] {
        let run = paper(rule);
        assert!(run.references_arrive().is_some_and(|steps| steps <= 20), "{}", verdict(&run));
        assert!(run.robots_arrive().is_some_and(|steps| steps <= 25), "{}", verdict(&run));
        assert!(run.deadlocked().is_empty());
    }
}

#[test]
fn lines_of_centres_end_in_a_deadlock_that_all_tell() {
    let run = paper(Rule::LineOfCentres);
    assert_eq!((run.references_arrive(), run.robots_arrive()), (None, None));
    assert_eq!(run.deadlocked(), [0, 1, 2]);
    assert!(verdict(&run).contains("Deadlock, told by robot 1, 2, 3."), "{}", verdict(&run));
    // From the first step on at which it is told, nobody moves.
    let told = |moment: &robots::run::Moment| matches!(moment.answer.verdict.references, References::Deadlock { .. });
    let first = run.steps.iter().position(|moments| moments.iter().all(told)).unwrap();
    for moments in &run.steps[first..] {
        for (now, then) in moments.iter().zip(&run.steps[first]) {
            assert!(robots::arena::distance(now.newest, then.newest) < 0.1);
        }
    }
}

/// The page holds the picture, the steps and the distances, and loads nothing.
#[test]
fn the_page_is_complete_in_itself() {
    let run = paper(Rule::TANGENT);
    let page = page(&run).unwrap();
    assert!(page.matches("<svg").count() == 3 && page.contains("const RUN={") && page.contains(&verdict(&run)));
    let outside = ["src=", "href=", "@import", "url("].map(|load| page.contains(load));
    assert_eq!(outside, [false; 4]);
}

#[test]
fn followers_keep_their_places_and_formations_their_shape() {
    let fleet = Fleet::new(EMITTED, Pace::SLOW).unwrap();
    let run = fleet.run(&Scenario::leader(), Rule::LineOfCentres, None).unwrap();
    assert!(run.stops >= 4 && run.off_goal() < 1.0, "{}", verdict(&run));
    let formation = fleet.run(&Scenario::formation(), Rule::LineOfCentres, None).unwrap();
    assert!(formation.off_goal() < 0.01, "{}", verdict(&formation));
    for run in [run, formation] {
        assert!(run.smallest_distance() >= DIAMETER && run.unguaranteed() == 0 && run.strayed == 0);
    }
}

#[test]
fn the_committed_design_is_that_of_three_robots() {
    assert_eq!(include_str!("../system.toml"), text(EMITTED, Pace::FAST));
}

/// Tables that are made at run time are those that were emitted: the same runs, bit for bit.
#[test]
fn tables_made_at_run_time_are_the_emitted_ones() {
    let fleet = Fleet::new(EMITTED, Pace::FAST).unwrap();
    let scenario = Scenario::paper();
    let starts: Vec<_> = scenario.starts.iter().map(|start| robots::arena::from_centre(*start)).collect();
    let made = robots::tables::start(&fleet.design, &starts).unwrap();
    let made = Run::new(made, &scenario, Rule::TANGENT, Pace::FAST, None).unwrap();
    let emitted = fleet.run(&scenario, Rule::TANGENT, None).unwrap();
    assert_eq!(made.steps.len(), emitted.steps.len());
    for (a, b) in made.steps.iter().flatten().zip(emitted.steps.iter().flatten()) {
        assert_eq!((a.position, a.newest, a.answer.acceleration), (b.position, b.newest, b.answer.acceleration));
    }
}

/// What is asked of the goals is asked of the scenario's own.
#[test]
fn the_scenario_is_the_papers() {
    let scenario = Scenario::paper();
    assert_eq!(scenario.starts, [[28.0, 52.0], [39.0, 16.0], [90.0, 39.0]]);
    assert_eq!(scenario.mission, Mission::Goals(vec![[86.0, 13.0], [77.0, 55.0], [20.0, 39.0]]));
}
