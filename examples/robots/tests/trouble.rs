//! What happens when robots start or are sent where they cannot be, or when one fails on the way?

use dpc_runtime::{Delivery, References};
use robots::arena::{DIAMETER, from_centre};
use robots::command::Fleet;
use robots::emitted;
use robots::pace::Pace;
use robots::rule::Rule;
use robots::run::{Fault, FaultKind, Run};
use robots::scenario::{Impossible, Mission, Scenario};

fn fleet(robots: usize) -> Fleet {
    Fleet::new(robots, Pace::FAST).unwrap()
}

fn of_two(starts: [[f64; 2]; 2], goals: [[f64; 2]; 2]) -> Scenario {
    Scenario { name: "two".into(), starts: starts.into(), mission: Mission::Goals(goals.into()), steps: 60 }
}

const APART: [[f64; 2]; 2] = [[30.0, 40.0], [100.0, 40.0]];

#[test]
fn overlapping_starts_are_refused_with_their_distance() {
    let scenario = of_two([[60.0, 40.0], [66.0, 40.0]], APART);
    let refused = scenario.check(&fleet(2).space).unwrap_err();
    assert!(matches!(refused, Impossible::TooClose { what: "start", robots: [0, 1], .. }), "{refused:?}");
    let said = refused.to_string();
    assert!(said.starts_with("the starts of robots 1 and 2 are 6.0 cm apart: no row"), "{said}");
    assert!(fleet(2).run(&scenario, Rule::TANGENT, None).is_err());
    let same = of_two([[60.0, 40.0], [60.0, 40.0]], APART);
    assert!(same.check(&fleet(2).space).is_err());
}

#[test]
fn goals_too_close_to_each_other_or_to_a_wall_are_refused() {
    let space = fleet(2).space;
    let close = of_two(APART, [[60.0, 40.0], [80.0, 45.0]]).check(&space).unwrap_err();
    assert!(matches!(close, Impossible::TooClose { what: "goal", .. }), "{close}");
    let wall = of_two(APART, [[30.0, 40.0], [126.0, 40.0]]).check(&space).unwrap_err();
    assert!(matches!(wall, Impossible::Outside { what: "goal", robot: 1, .. }), "{wall}");
    let unknown = of_two(APART, [[30.0, 40.0], [f64::NAN, 40.0]]).check(&space).unwrap_err();
    assert!(matches!(unknown, Impossible::Outside { robot: 1, .. }), "{unknown}");
    assert_eq!(of_two(APART, APART).check(&space), Ok(()));
}

/// Whoever starts controllers without asking is told by them: no row was ever accepted, and nobody moves.
#[test]
fn controllers_that_start_too_close_say_so_and_stay() {
    let starts = [[60.0, 40.0], [80.0, 40.0], [110.0, 60.0]];
    let goals = vec![[30.0, 40.0], [100.0, 40.0], [110.0, 20.0]];
    let scenario = Scenario { name: "close".into(), starts: starts.into(), mission: Mission::Goals(goals), steps: 20 };
    let started = emitted::start(&starts.map(from_centre)).unwrap();
    let run = Run::new(started, &scenario, Rule::TANGENT, Pace::FAST, None).unwrap();
    for moments in &run.steps {
        let told = moments[..2].iter().map(|moment| moment.answer.verdict);
        assert!(told.into_iter().all(|told| told.references == References::Undrawn { row: 0 } && !told.guaranteed));
        assert_eq!((moments[0].newest, moments[1].newest), (starts[0], starts[1]));
    }
}

#[test]
fn more_robots_than_there_is_room_for_are_refused() {
    let crowd = Scenario::random(12, 1, &fleet(12).space).unwrap_err();
    assert_eq!(crowd, Impossible::NoRoom { robots: 12 });
    assert!(Fleet::new(1, Pace::FAST).is_err() && Fleet::new(13, Pace::FAST).is_err());
}

/// Whichever robot falls silent at whichever step: those who no longer hear it wait where they are, with their guarantee,
/// and nobody touches anybody, in between neither.
#[test]
fn others_wait_for_a_robot_that_is_no_longer_heard() {
    let fleet = fleet(3);
    for robot in 0..3 {
        for from in [1, 2, 4, 7, 10, 13, 16, 19] {
            for kind in [FaultKind::Mute, FaultKind::Deaf, FaultKind::Silent, FaultKind::Dead] {
                let run = fleet.run(&Scenario::paper(), Rule::TANGENT, Some(Fault { robot, from, kind })).unwrap();
                let context = format!("robot {robot} {kind:?} from step {from}");
                assert!(run.smallest_distance() >= DIAMETER, "{context}: {}", run.smallest_distance());
                check_statuses(&run, robot, from, kind, &context);
            }
        }
    }
}

fn check_statuses(run: &Run, failed: usize, from: usize, kind: FaultKind, context: &str) {
    let unheard = kind != FaultKind::Deaf;
    for (step, moments) in run.steps.iter().enumerate().skip(from) {
        for (i, moment) in moments.iter().enumerate() {
            let told = moment.answer.verdict;
            let waits = if i == failed { kind != FaultKind::Mute } else { unheard };
            assert_eq!(told.references == References::Waiting, waits, "{context}, step {step}: {told:?}");
            assert!(kind == FaultKind::Dead && i == failed || told.guaranteed, "{context}, step {step}: {told:?}");
            let moved = moment.newest != run.steps[step - 1][i].newest;
            assert!(!(waits && moved), "{context}, step {step}");
        }
    }
}

/// Where not even the first messages arrive, no row was ever accepted: nobody moves, and nothing is promised.
#[test]
fn a_robot_that_was_never_heard_of_keeps_everyone_in_place() {
    let fault = Fault { robot: 1, from: 0, kind: FaultKind::Mute };
    let run = fleet(3).run(&Scenario::paper(), Rule::TANGENT, Some(fault)).unwrap();
    for moments in &run.steps {
        for (i, moment) in moments.iter().enumerate().filter(|(i, _)| *i != 1) {
            let told = moment.answer.verdict;
            assert!(matches!(told.references, References::Undrawn { .. }) && !told.guaranteed, "{told:?}");
            assert_eq!(moment.newest, run.scenario.starts[i]);
        }
    }
}

/// What the bus lost is told slot by slot.
#[test]
fn a_missing_message_is_told_with_its_sender() {
    let mut inbox = robots::controllers::robot_1::Inbox::new();
    let starts = Scenario::paper().starts;
    let at =
        |p: [f64; 2]| dpc_runtime::SteadyState { x: [from_centre(p)[0], 0.0, from_centre(p)[1], 0.0], u: [0.0; 2] };
    let (mut first, _) = robots::controllers::robot_1::start(&at(starts[0])).unwrap();
    let (_, message) = robots::controllers::robot_2::start(&at(starts[1])).unwrap();
    inbox.accept(&robots::controllers::robot_1::FROM_ROBOT_2, &message).unwrap();
    let x = at(starts[0]).x;
    let step = first.step(&x, &[0.0, 0.0], &mut inbox);
    assert_eq!(step.status.deliveries, [Delivery::InSequence, Delivery::Missing]);
}
