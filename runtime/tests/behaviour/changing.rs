//! Do rows that are redrawn while running keep every pair apart, whatever arrives, and does a status say what holds a body up?

use std::array;

use dpc_runtime::{HalfSpace, NotRedrawn, References};

use crate::planar::{self, BodySpace, DISTANCE, EPSILON, Field, Rule};
use crate::random::Random;

const STARTS: [[f64; 2]; 3] = [[-20.0, -1.0], [20.0, 0.0], [0.0, 20.0]];

fn all<T>(f: impl FnMut(usize) -> T) -> [T; 3] {
    array::from_fn(f)
}

/// Runs until nobody moves, at most 200 steps, and gives the last references.
fn run(field: &mut Field, rule: Rule, goals: [[f64; 2]; 3]) -> [References; 3] {
    let mut last = [References::Nearest; 3];
    for _ in 0..200 {
        field.deliver(|_, _| true);
        last = all(|_| References::Nearest);
        for (body, status) in last.iter_mut().enumerate() {
            let told = field.step(body, rule, goals[body]);
            assert!(told.is_guaranteed(), "{told}");
            *status = told.references;
        }
        assert!(field.distance() >= DISTANCE, "{}", field.distance());
    }
    last
}

/// Two change places, the third crosses: with the tangent everyone arrives.
#[test]
fn tangents_lead_everyone_past_the_others() {
    let tables = all(planar::tables);
    let mut field = planar::field(&tables, STARTS);
    let goals = [[20.0, 0.0], [-20.0, 1.0], [0.0, -20.0]];
    assert_eq!(run(&mut field, Rule::Tangent, goals), [References::Nearest; 3]);
    for (x, goal) in field.x.iter().zip(&goals) {
        assert!((x[0] - goal[0]).abs() < 1e-6 && (x[1] - goal[1]).abs() < 1e-6, "{x:?}");
    }
}

/// Head on, the line of centres is a wall between the two: a deadlock, which names the row. The third has arrived.
#[test]
fn lines_of_centres_end_in_a_deadlock_that_is_told() {
    let tables = all(planar::tables);
    let mut field = planar::field(&tables, [[-20.0, 0.0], [20.0, 0.0], [0.0, 40.0]]);
    let goals = [[20.0, 0.0], [-20.0, 0.0], [0.0, 40.0]];
    let told = run(&mut field, Rule::Centres, goals);
    assert_eq!(told, [References::Deadlock { row: 0 }, References::Deadlock { row: 0 }, References::Nearest]);
    let distance = field.x[1][0] - field.x[0][0];
    assert!((distance - DISTANCE - 2.0 * EPSILON).abs() < 1e-6, "{distance}");
    // A deadlock ends when a set-point changes.
    field.deliver(|_, _| true);
    assert_eq!(field.step(0, Rule::Centres, [-30.0, 0.0]).references, References::Nearest);
}

/// Who is held up while another still moves is not in a deadlock.
#[test]
fn who_is_held_up_by_one_who_moves_is_blocked() {
    let tables = all(planar::tables);
    let mut field = planar::field(&tables, [[-2.5, 0.0], [2.5001, 0.0], [0.0, 40.0]]);
    field.deliver(|_, _| true);
    let told = [field.step(0, Rule::Centres, [9.0, 0.0]), field.step(1, Rule::Centres, [-9.0, 0.0])];
    assert!(told.iter().all(|told| told.references == References::Blocked { row: 0 }), "{told:?}");
    field.step(2, Rule::Centres, [0.0, -40.0]);
    field.deliver(|_, _| true);
    assert_eq!(field.step(0, Rule::Centres, [9.0, 0.0]).references, References::Blocked { row: 0 });
}

/// Messages get lost at random, one way or both: nobody comes too near to anyone, and when messages arrive again, everyone
/// arrives or says what holds it up.
#[test]
fn lost_messages_stop_bodies_and_bring_nobody_too_near() {
    let mut arrived = 0;
    for seed in 0..200 {
        let mut random = Random::new(seed);
        let tables = all(planar::tables);
        let mut field = planar::field(&tables, STARTS);
        let goals = [[20.0, 0.0], [-20.0, 1.0], [0.0, -20.0]];
        let loss = random.between(0.0, 0.7);
        let mut waited = 0;
        let mut last = [References::Nearest; 3];
        for step in 0..600 {
            field.deliver(|_, _| step >= 300 || random.between(0.0, 1.0) >= loss);
            // A body that hears nothing must not rest on what the others did before.
            for body in 0..3 {
                let told = field.step(body, Rule::Tangent, goals[body]);
                waited += usize::from(told.references == References::Waiting);
                last[body] = told.references;
            }
            assert!(field.distance() >= DISTANCE, "seed {seed}, step {step}: {}", field.distance());
        }
        assert!(loss < 0.05 || waited > 0, "seed {seed}");
        for (body, (x, goal)) in field.x.iter().zip(&goals).enumerate() {
            let there = (x[0] - goal[0]).hypot(x[1] - goal[1]) < 1e-6;
            arrived += usize::from(there);
            let held_up = matches!(last[body], References::Deadlock { .. } | References::Blocked { .. });
            assert!(there != held_up, "seed {seed}, body {body}: {:?} at {x:?}", last[body]);
        }
    }
    assert!(arrived > 500, "{arrived} of 600");
}

/// A body that others no longer hear: they stay where they are, and go on when it is heard again.
#[test]
fn waits_for_a_body_that_is_not_heard() {
    let tables = all(planar::tables);
    let mut field = planar::field(&tables, STARTS);
    field.deliver(|_, _| true);
    let goals = [[20.0, 0.0], [-20.0, 1.0], [0.0, -20.0]];
    (0..3).for_each(|body| assert!(field.step(body, Rule::Tangent, goals[body]).is_guaranteed()));
    for silent in [true, true, false] {
        let before = field.sent.clone();
        field.deliver(|from, _| !(silent && from == 2));
        for body in 0..2 {
            let told = field.step(body, Rule::Tangent, goals[body]);
            assert_eq!(told.references == References::Waiting, silent);
            assert_eq!(field.sent[body].y_ref == before[body].y_ref, silent);
            assert!(told.is_guaranteed() && !told.degraded, "{told}");
        }
        field.step(2, Rule::Tangent, goals[2]);
    }
}

/// Before the first messages nothing is promised; the first row that is accepted makes up for it.
#[test]
fn a_first_message_that_is_lost_costs_no_more_than_its_steps() {
    let tables = all(planar::tables);
    let mut field = planar::field(&tables, STARTS);
    for silent in [true, false, false] {
        field.deliver(|from, to| !(silent && from == 2 && to == 0));
        for (body, set_point) in STARTS.into_iter().enumerate() {
            let told = field.step(body, Rule::Tangent, set_point);
            let unsure = silent && body == 0;
            assert_eq!(told.references == References::Undrawn { row: 1 }, unsure, "{told}");
            assert_eq!((told.is_guaranteed(), told.degraded), (!unsure, false), "{told}");
        }
    }
}

/// Nothing acts on it, so it sees alone that it does not rest.
#[test]
fn a_start_that_does_not_rest_is_seen_without_messages() {
    let tables = planar::tables(0);
    let start = dpc_runtime::SteadyState { x: [0.0, 0.0], u: [0.5, 0.0] };
    let (mut body, _) = planar::Body::start(&tables, &start).unwrap();
    let told = body.step(&[0.0, 0.0], &[1.0, 1.0], &mut planar::BodyInbox::new()).status;
    assert!(told.references == References::NotSteady && told.degraded, "{told}");
}

#[test]
fn a_plan_is_refused_where_rows_change() {
    let tables = planar::tables(0);
    let rest = dpc_runtime::PlannedPoint { x: [0.0; 2], u: [0.0; 2] };
    let points = [rest; 4];
    let plan = dpc_runtime::StartPlan {
        design: tables.fingerprint(),
        plan: 1,
        points: &points,
        e: [0.0; 2],
        nominal: dpc_runtime::problem::Plan::REST,
    };
    let refused = planar::Body::start_planned(&tables, &plan, None, &[0.0; 2]).map(|_| ());
    assert_eq!(refused, Err(dpc_runtime::StartError::ChangingConstraints));
}

/// Who does not redraw cannot know what the others drew.
#[test]
fn waits_where_it_did_not_meet_the_others() {
    let tables = all(planar::tables);
    let mut field = planar::field(&tables, STARTS);
    field.deliver(|_, _| true);
    (0..3).for_each(|body| assert_eq!(field.step(body, Rule::Tangent, [5.0, 5.0]).references, References::Nearest));
    field.deliver(|_, _| true);
    let told = field.bodies[0].step(&field.x[0], &[5.0, 5.0], &mut field.inboxes[0]);
    assert_eq!(told.status.references, References::Waiting);
}

/// No row holds for bodies that are too near from the start: nobody moves, and nothing is promised.
#[test]
fn starts_that_are_too_near_are_told() {
    let tables = all(planar::tables);
    let mut field = planar::field(&tables, [[0.0, 0.0], [4.0, 0.0], [0.0, 40.0]]);
    for _ in 0..3 {
        field.deliver(|_, _| true);
        let told = all(|body| field.step(body, Rule::Tangent, [-9.0, 0.0]));
        assert_eq!(told[0].references, References::Undrawn { row: 0 });
        assert!(!told[0].is_guaranteed() && !told[0].degraded);
        assert_eq!(field.x[0], [0.0, 0.0]);
    }
}

#[test]
fn refuses_rows_that_do_not_qualify_and_keeps_the_one_before() {
    let tables = all(planar::tables);
    let mut field = planar::field(&tables, [[-4.0, 0.0], [4.0, 0.0], [0.0, 40.0]]);
    let redraw = |field: &mut Field, row: usize, drawn: Option<BodySpace>| {
        field.bodies[0].redraw(row, &field.inboxes[0], |_| drawn)
    };
    assert_eq!(redraw(&mut field, 0, None), Err(NotRedrawn::NotHeard { slot: 0 }));
    field.deliver(|_, _| true);
    let apart = |distance: f64| HalfSpace { own: [1.0, 0.0], others: [-1.0, 0.0, 0.0, 0.0], l: -distance };
    assert_eq!(redraw(&mut field, 2, Some(apart(3.0))), Err(NotRedrawn::NoSuchRow));
    assert_eq!(redraw(&mut field, 0, None), Err(NotRedrawn::NoneDrawn));
    let infinite = HalfSpace { l: f64::INFINITY, ..apart(3.0) };
    assert_eq!(redraw(&mut field, 0, Some(infinite)), Err(NotRedrawn::NotFinite));
    let foreign = HalfSpace { others: [-1.0, 0.0, 0.0, 1.0], ..apart(3.0) };
    assert_eq!(redraw(&mut field, 0, Some(foreign)), Err(NotRedrawn::NotMember));
    let exceeded = |l_tilde| Err(NotRedrawn::Exceeded { k: -8.0, l_tilde });
    assert_eq!(redraw(&mut field, 0, Some(apart(7.0))), exceeded(-7.0 - planar::MARGIN_OF_TWO));
    assert_eq!(redraw(&mut field, 0, Some(apart(5.9999))), Ok(()));
    assert_eq!(redraw(&mut field, 0, Some(apart(6.125))), exceeded(-6.125 - planar::MARGIN_OF_TWO));
    assert_eq!(redraw(&mut field, 1, Some(HalfSpace::NONE)), Ok(()));
    // What can only be a mistake leaves the others with a row that this one does not know: it waits.
    let mut lost = planar::field(&tables, [[-4.0, 0.0], [4.0, 0.0], [0.0, 40.0]]);
    lost.deliver(|_, _| true);
    assert_eq!(redraw(&mut lost, 0, Some(apart(5.9999))), Ok(()));
    assert_eq!(redraw(&mut lost, 1, Some(HalfSpace::NONE)), Ok(()));
    lost.sent[0] = lost.bodies[0].step(&[-4.0, 0.0], &[-4.0, 0.0], &mut lost.inboxes[0]).message;
    for other in 1..3 {
        lost.step(other, Rule::Centres, lost.x[other]);
    }
    lost.deliver(|_, _| true);
    assert_eq!(redraw(&mut lost, 0, Some(infinite)), Err(NotRedrawn::NotFinite));
    assert_eq!(redraw(&mut lost, 1, None), Err(NotRedrawn::NoneDrawn));
    let step = lost.bodies[0].step(&[-4.0, 0.0], &[40.0, 40.0], &mut lost.inboxes[0]);
    assert_eq!(step.status.references, References::Waiting);
    // The row with 5.9999 is in force, with next to no room; the other restricts nothing.
    let step = field.bodies[0].step(&[-4.0, 0.0], &[40.0, 40.0], &mut field.inboxes[0]);
    let [x, y] = step.message.y_ref;
    assert!((x + 4.0).abs() < 1e-4 && y == 1.0, "{x} {y}");
}

/// Members see the same numbers to the last bit, whoever computes them.
#[test]
fn both_members_compute_the_same() {
    let mut random = Random::new(7);
    let tables = all(planar::tables);
    for _ in 0..1000 {
        let x = all(|_| [random.between(-40.0, 40.0), random.between(-40.0, 40.0)]);
        let mut field = planar::field(&tables, x);
        field.deliver(|_, _| true);
        let (angle, distance) = (random.between(0.0, 7.0), random.between(0.0, 9.0));
        let mut seen = Vec::new();
        // Row 1 of body 0 and row 0 of body 2 are the same constraint.
        for (body, row) in [(0, 1), (2, 0)] {
            let _ = field.bodies[body].redraw(row, &field.inboxes[body], |meeting| {
                let pair = meeting.pair()?;
                let normal = [angle.cos(), angle.sin()];
                let drawn = pair.apart(&normal, distance);
                seen.push((pair.first, pair.second, meeting.k(&drawn), meeting.l_tilde(&drawn)));
                assert_eq!(pair.margin(&normal), meeting.margin(&drawn));
                Some(drawn)
            });
        }
        assert_eq!(seen[0], seen[1]);
        assert_eq!(seen[0].0, x[0]);
    }
}
