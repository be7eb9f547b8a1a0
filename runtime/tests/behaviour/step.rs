//! Does a controller do in every situation what its status says?

use crate::pair::{
    self, BOUND, DRIFT, OTHER, PARTNER, PairController, PairInbox, PairMessage, PairTables, RESERVE, TUBE,
};
use crate::random::Random;
use dpc_runtime::{
    Control, Controller, Delivery, Link, Load, Message, ReferenceLayer, References, Refused, Share, StartError,
    SteadyState, Step, Tables,
};

const ORIGIN: SteadyState<1, 1> = SteadyState { x: [0.0], u: [0.0] };

type PairStep = Step<1, 1, 1, 1, 1>;

/// One controller whose neighbour is played by the test.
struct Solo<'a> {
    controller: PairController<'a, 0, 0>,
    inbox: PairInbox<0>,
}

impl<'a> Solo<'a> {
    fn new(tables: &'a PairTables<0, 0>) -> Self {
        let (controller, _) = PairController::start(tables, &ORIGIN).unwrap();
        Self { controller, inbox: PairInbox::new() }
    }

    /// A step in which the neighbour rests at the origin.
    fn step(&mut self, x: f64, set_point: f64) -> PairStep {
        let message =
            Message { step: self.controller.steps() - 1, y_ref: [0.0], z_ref: [0.0], certified: true, plan: 0 };
        self.inbox.accept(&OTHER, &message).unwrap();
        self.controller.step(&[x], &[set_point], &mut self.inbox)
    }
}

/// The steady state of both subsystems at the outputs `y`: 0.1 x = 0.1 u + 0.02 x_j.
fn steady(y: f64, y_other: f64) -> SteadyState<1, 1> {
    SteadyState { x: [y], u: [y - 0.2 * y_other] }
}

#[test]
fn rests_at_the_reference() {
    let tables = pair::tables();
    let mut solo = Solo::new(&tables);
    let step = solo.step(0.07, 0.0);
    assert_eq!(step.status.control, Control::AtReference);
    assert_eq!(step.input, [-0.07]);
    assert_eq!((step.telemetry.x_nom, step.telemetry.u_nom), ([0.0], [0.0]));
    assert!(step.status.is_guaranteed());
    assert_eq!(step.status.to_string(), "at reference; references nearest to the set-point");
}

#[test]
fn optimises_away_from_the_reference() {
    let tables = pair::tables();
    let mut solo = Solo::new(&tables);
    let step = solo.step(0.5, 0.0);
    let Control::Optimal { iterations, active } = step.status.control else { panic!("{}", step.status) };
    assert!(iterations >= 1 && active >= 1);
    // The nearest admissible xhat is on the tube's edge; from there the unconstrained optimum is u = K x only if K were
    // optimal, so only the side is known.
    assert!((step.telemetry.x_nom[0] - 0.4).abs() < 1e-12);
    assert!(step.telemetry.u_nom[0] < 0.0);
    assert!((step.input[0] - (step.telemetry.u_nom[0] - 0.1)).abs() < 1e-12);
    assert!(step.status.is_guaranteed());
}

/// The references have to move with the rates that the design charged: a load that was not given in its step, or is another
/// step's, cannot be made up for.
#[test]
fn a_load_that_is_not_given_loses_the_guarantee() {
    let tables = pair::tables();
    let load = |step| Load { step, push: [0.0], within: true };
    let started = || {
        let Solo { controller, inbox } = Solo::new(&tables);
        Solo { controller: controller.under(&load(-1)), inbox }
    };
    let mut given = started();
    for step in 0..3 {
        given.inbox.accept(&OTHER, &Message { step: step - 1, ..REST }).unwrap();
        let step = given.controller.step_under(&[0.0], &[0.0], &load(step), &mut given.inbox);
        assert!(step.status.is_guaranteed(), "{}", step.status);
    }
    let mut forgotten = started();
    assert!(!forgotten.step(0.0, 0.0).status.load_within);
    let mut stale = started();
    stale.inbox.accept(&OTHER, &REST).unwrap();
    assert!(!stale.controller.step_under(&[0.0], &[0.0], &load(1), &mut stale.inbox).status.is_guaranteed());
    for mut late in [forgotten, stale] {
        late.inbox.accept(&OTHER, &Message { step: 0, ..REST }).unwrap();
        let step = late.controller.step_under(&[0.0], &[0.0], &load(1), &mut late.inbox);
        assert!(step.status.load_within && step.status.degraded && !step.status.is_guaranteed(), "{}", step.status);
    }
}

/// The neighbour's message of the start, at the origin.
const REST: PairMessage = Message { step: -1, y_ref: [0.0], z_ref: [0.0], certified: true, plan: 0 };

/// Two controllers, exchanging messages, against the plant, which starts away from the references.
struct Loop<'a> {
    controllers: [PairController<'a, 0, 0>; 2],
    inboxes: [PairInbox<0>; 2],
    x: [f64; 2],
}

impl<'a> Loop<'a> {
    fn new(tables: &'a PairTables<0, 0>, y: [f64; 2], deviation: [f64; 2]) -> Self {
        let start = |i: usize| PairController::start(tables, &steady(y[i], y[1 - i])).unwrap();
        let [(first, from_first), (second, from_second)] = [start(0), start(1)];
        let mut inboxes = [PairInbox::new(), PairInbox::new()];
        inboxes[0].accept(&OTHER, &from_second).unwrap();
        inboxes[1].accept(&OTHER, &from_first).unwrap();
        Self { controllers: [first, second], inboxes, x: [y[0] + deviation[0], y[1] + deviation[1]] }
    }

    fn step(&mut self, set_points: [f64; 2]) -> [PairStep; 2] {
        let steps: [PairStep; 2] =
            std::array::from_fn(|i| self.controllers[i].step(&[self.x[i]], &[set_points[i]], &mut self.inboxes[i]));
        self.inboxes[0].accept(&OTHER, &steps[1].message).unwrap();
        self.inboxes[1].accept(&OTHER, &steps[0].message).unwrap();
        self.x = std::array::from_fn(|i| 0.9 * self.x[i] + 0.1 * steps[i].input[0] + 0.02 * self.x[1 - i]);
        steps
    }
}

/// Theorem 1 as the controllers see it: whatever the set-points and the (admissible) start, nothing is ever infeasible,
/// no constraint is violated, x - xhat stays in E and z - zref in Z, and the outputs get there.
#[test]
fn keeps_what_theorem_1_promises() {
    let tables = pair::tables();
    let mut random = Random::new(1);
    let mut optimised = 0;
    for _ in 0..100 {
        let mut run = Loop::new(
            &tables,
            [random.between(-2.0, 2.0), random.between(-2.0, 2.0)],
            [random.between(-1.0, 1.0), random.between(-1.0, 1.0)],
        );
        let mut goals = [0.0, 0.0];
        for t in 0..1000 {
            if t % 250 == 0 {
                goals = [random.between(-3.0, 3.0), random.between(-3.0, 3.0)];
            }
            let x = run.x;
            let steps = run.step(goals);
            for i in 0..2 {
                assert!(steps[i].status.is_guaranteed(), "{}", steps[i].status);
                optimised += usize::from(steps[i].status.control != Control::AtReference);
                assert_within_bounds(x[i], &steps[i]);
            }
            if t % 250 == 249 {
                (0..2).for_each(|i| assert!((run.x[i] - goals[i].clamp(-2.0, 2.0)).abs() < 1e-6, "{:?}", run.x));
            }
        }
    }
    assert!(optimised > 300, "only {optimised} steps with an optimisation");
}

fn assert_within_bounds(x: f64, step: &PairStep) {
    let slack = 1e-11;
    assert!((x - step.telemetry.x_nom[0]).abs() <= TUBE + slack, "x - xhat leaves E");
    assert!((x - step.telemetry.x_ref[0]).abs() <= TUBE + RESERVE + slack, "z - zref leaves Z");
    assert!(x.abs() <= BOUND + slack && step.input[0].abs() <= BOUND + slack);
}

/// After one solution the budget is gone: from then on only the shifted candidate is left, whose constraints hold at every
/// step, whatever the disturbances in W are.
#[test]
fn falls_back_on_a_feasible_candidate_when_the_budget_runs_out() {
    let tables = pair::tables();
    let mut random = Random::new(2);
    let mut candidates = 0;
    for _ in 0..200 {
        let mut solo = Solo::new(&tables);
        let mut x = random.between(-1.0, 1.0);
        for _ in 0..40 {
            let before = x;
            let step = solo.step(x, 0.0);
            solo.controller.limit_iterations(0);
            candidates += usize::from(step.status.control == Control::Candidate);
            assert!(step.status.is_guaranteed(), "{}", step.status);
            assert_within_bounds(before, &step);
            // The neighbour's coupling output jumps between the ends of Z.
            let z = if random.below(2) == 0 { 1.0 } else { -1.0 };
            x = 0.9 * x + 0.1 * step.input[0] + 0.02 * z;
        }
    }
    assert!(candidates > 500, "only {candidates} candidates");
}

#[test]
fn says_infeasible_and_shifts_the_last_plan_on() {
    let tables = pair::tables();
    let mut solo = Solo::new(&tables);
    let first = solo.step(0.6, 0.0);
    let (dx, du) = (first.telemetry.x_nom[0], first.telemetry.u_nom[0]);
    let step = solo.step(3.0, 0.0);
    let Control::Infeasible { row } = step.status.control else { panic!("{}", step.status) };
    assert!([0, 5, 6, 7].contains(&row), "row {row} is neither tube nor reserve nor terminal set");
    assert!(!step.status.is_guaranteed() && !step.status.degraded);
    let candidate = 0.9 * dx + 0.1 * du;
    assert!((step.telemetry.x_nom[0] - candidate).abs() < 1e-15);
    let u = step.telemetry.u_nom[0] - (3.0 - candidate);
    assert!((step.input[0] - u.clamp(-BOUND, BOUND)).abs() < 1e-14);
    let far = solo.step(1e6, 0.0);
    assert_eq!(far.input, [-BOUND]);
    assert!(solo.step(0.0, 0.0).status.is_guaranteed(), "the guarantee comes back with feasibility");
}

/// The tube asks for dx_0 >= `gap`, the reserve for dx_0 <= 0: a contradiction, which the candidate dx = 0 leaves standing
/// by no more than `gap`.
#[test]
fn keeps_a_feasible_candidate_when_the_solver_finds_the_problem_infeasible() {
    let mut tables = pair::tables();
    tables.problem.upper[5] = 0.0;
    let control = |gap: f64| {
        let mut solo = Solo::new(&tables);
        let step = solo.step(TUBE + gap, 0.0);
        assert_eq!((step.telemetry.x_nom, step.telemetry.u_nom), ([0.0], [0.0]));
        assert_eq!(step.input, [-(TUBE + gap)]);
        (step.status.control, step.status.is_guaranteed())
    };
    assert_eq!(control(1e-11), (Control::Candidate, true));
    assert!(matches!(control(1e-6), (Control::Infeasible { .. }, false)));
}

/// Whatever was asked before in the same period, the answer is that of the last call alone, in this period and in those
/// that follow.
#[test]
fn input_forgets_earlier_calls_of_the_period() {
    let tables = pair::tables();
    let mut random = Random::new(3);
    let mut kinds = [0; 4];
    for _ in 0..1000 {
        let (mut once, mut again) = (Solo::new(&tables), Solo::new(&tables));
        for _ in 0..6 {
            // A new budget forgets the warm start: so only now and then.
            let budget = [Some(0), Some(3), None, None, None, None].get(random.below(6)).copied().flatten();
            for solo in [&mut once, &mut again] {
                budget.into_iter().for_each(|budget| solo.controller.limit_iterations(budget));
            }
            let [tried, x] = [(); 2].map(|()| measurement(&mut random));
            again.controller.input(&[tried]);
            let (once, again) = (once.step(x, 0.0), again.step(x, 0.0));
            assert_eq!((once.input, once.status, once.telemetry), (again.input, again.status, again.telemetry));
            match once.status.control {
                Control::Optimal { .. } => kinds[0] += 1,
                Control::Candidate => kinds[1] += 1,
                Control::Infeasible { .. } | Control::IterationLimit => kinds[2] += 1,
                Control::AtReference | Control::NotFinite => kinds[3] += 1,
            }
        }
    }
    assert!(kinds.iter().all(|count| *count > 50), "{kinds:?}");
}

/// Now and then far away, or not a number.
fn measurement(random: &mut Random) -> f64 {
    match random.below(8) {
        0 => f64::NAN,
        1 => random.between(-5.0, 5.0),
        _ => random.between(-1.0, 1.0),
    }
}

#[test]
fn says_iteration_limit_when_even_the_candidate_is_not_feasible() {
    let mut tables = pair::tables();
    tables.problem.max_iterations = 0;
    let mut solo = Solo::new(&tables);
    let step = solo.step(0.5, 0.0);
    assert_eq!(step.status.control, Control::IterationLimit);
    assert_eq!(step.input, [-0.5]);
    assert!(!step.status.is_guaranteed());
}

#[test]
fn uses_the_plan_alone_when_the_measurement_is_not_finite() {
    let tables = pair::tables();
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut solo = Solo::new(&tables);
        let first = solo.step(0.6, 0.0);
        let step = solo.step(bad, 0.0);
        assert_eq!(step.status.control, Control::NotFinite);
        assert_eq!(step.input, step.telemetry.u_nom);
        assert!(step.telemetry.x_nom[0] > 0.0 && step.telemetry.x_nom[0] < first.telemetry.x_nom[0]);
        assert!(!step.status.is_guaranteed());
    }
    let mut solo = Solo::new(&tables);
    let step = solo.step(f64::MAX, 0.0);
    assert!(step.input[0].is_finite() && !step.status.is_guaranteed());
    let after = solo.step(0.5, 0.0);
    assert!(after.status.is_guaranteed() && after.telemetry.x_nom[0].is_finite());
}

#[test]
fn keeps_the_reference_when_the_set_point_is_not_finite() {
    let tables = pair::tables();
    let mut solo = Solo::new(&tables);
    let moved = solo.step(0.0, 1.0).message.y_ref;
    let step = solo.step(0.0, f64::NAN);
    assert_eq!(step.status.references, References::SetPointNotFinite);
    assert_eq!((step.message.y_ref, moved), ([0.05], [0.05]));
    assert!(step.status.is_guaranteed());
}

#[test]
fn marks_lost_messages_and_holds_the_last_values() {
    let tables = pair::tables();
    let mut heard = Solo::new(&tables);
    let mut lost = Solo::new(&tables);
    for solo in [&mut heard, &mut lost] {
        let message = Message { step: -1, y_ref: [0.0], z_ref: [0.0], certified: true, plan: 0 };
        solo.inbox.accept(&OTHER, &message).unwrap();
        solo.controller.step(&[0.0], &[0.0], &mut solo.inbox);
        solo.inbox.accept(&OTHER, &Message { step: 0, y_ref: [0.0], z_ref: [0.5], certified: true, plan: 0 }).unwrap();
        solo.controller.step(&[0.0], &[0.0], &mut solo.inbox);
    }
    heard.inbox.accept(&OTHER, &Message { step: 1, y_ref: [0.0], z_ref: [0.5], certified: true, plan: 0 }).unwrap();
    let good = heard.controller.step(&[0.0], &[0.0], &mut heard.inbox);
    let bad = lost.controller.step(&[0.0], &[0.0], &mut lost.inbox);
    assert_eq!(bad.status.deliveries, [Delivery::Missing]);
    assert_eq!(bad.status.missing().collect::<Vec<_>>(), [0]);
    assert_eq!((bad.message, bad.input), (good.message, good.input));
    assert!(good.status.is_guaranteed() && bad.status.degraded && !bad.status.is_guaranteed());
    assert!(bad.status.to_string().ends_with("; message of neighbour 0 missing; degraded"), "{}", bad.status);

    lost.inbox.accept(&OTHER, &Message { step: 2, y_ref: [0.0], z_ref: [0.5], certified: true, plan: 0 }).unwrap();
    let after = lost.controller.step(&[0.0], &[0.0], &mut lost.inbox);
    assert_eq!(after.status.deliveries, [Delivery::InSequence]);
    assert!(after.status.degraded && lost.controller.is_degraded());
}

#[test]
fn refuses_messages_out_of_sequence_or_not_finite() {
    let tables = pair::tables();
    let mut solo = Solo::new(&tables);
    let message = |step, z| Message { step, y_ref: [0.0], z_ref: [z], certified: true, plan: 0 };
    let late = solo.inbox.accept(&OTHER, &message(-2, 0.0));
    assert_eq!(late, Err(Refused::OutOfSequence { expected: -1, got: -2 }));
    let step = solo.controller.step(&[0.0], &[0.0], &mut solo.inbox);
    assert_eq!(step.status.deliveries, [Delivery::OutOfSequence(-2)]);

    assert_eq!(solo.inbox.accept(&OTHER, &message(0, f64::NAN)), Err(Refused::NotFinite));
    let step = solo.controller.step(&[0.0], &[0.0], &mut solo.inbox);
    assert_eq!(step.status.deliveries, [Delivery::NotFinite]);

    let foreign: Link<1, 1> = Link { slot: 0, z: Some(1), ..OTHER };
    assert_eq!(solo.inbox.accept(&foreign, &message(1, 0.0)), Err(Refused::NoSuchSlot));
    let foreign: Link<1, 1> = Link { slot: 1, z: Some(0), ..OTHER };
    assert_eq!(solo.inbox.accept(&foreign, &message(1, 0.0)), Err(Refused::NoSuchSlot));
}

/// A neighbour that is one step ahead does not overwrite what is still needed, in whichever order its messages come.
#[test]
fn takes_messages_one_step_early() {
    let tables = pair::tables();
    let message = |step, z| Message { step, y_ref: [0.0], z_ref: [z], certified: true, plan: 0 };
    let sent = [message(-1, 0.0), message(0, 0.1), message(1, 0.2)];
    let orders =
        [vec![vec![0], vec![1], vec![2]], vec![vec![0, 1], vec![2], vec![]], vec![vec![1, 0], vec![2], vec![]]];
    let outcomes = orders.map(|order| {
        let mut solo = Solo::new(&tables);
        order
            .iter()
            .map(|batch| {
                batch.iter().for_each(|&k| solo.inbox.accept(&OTHER, &sent[k]).unwrap());
                let step = solo.controller.step(&[0.0], &[0.0], &mut solo.inbox);
                assert!(step.status.is_guaranteed(), "{}", step.status);
                step.message
            })
            .collect::<Vec<PairMessage>>()
    });
    assert_eq!(outcomes[0], outcomes[1]);
    assert_eq!(outcomes[0], outcomes[2]);
    assert_ne!(outcomes[0][1], outcomes[0][2]);
}

/// Messages of this period may arrive before or after the input was computed: it is the same.
#[test]
fn input_depends_on_nothing_received_in_the_period() {
    let tables = pair::tables();
    let mut first = Solo::new(&tables);
    let mut second = Solo::new(&tables);
    let whole = first.step(0.4, 1.0);
    let half = second.controller.input(&[0.4]);
    assert_eq!(second.controller.input(&[0.4]).input, half.input);
    second.inbox.accept(&OTHER, &Message { step: -1, y_ref: [0.0], z_ref: [0.0], certified: true, plan: 0 }).unwrap();
    let outlook = second.controller.references(&[1.0], &mut second.inbox);
    assert_eq!((whole.input, whole.telemetry), (half.input, half.telemetry));
    assert_eq!((whole.message, whole.status.references), (outlook.message, outlook.references));
}

#[test]
fn starts_from_a_steady_state_only() {
    let tables = pair::tables();
    let start =
        |x: f64, u: f64| PairController::start(&tables, &SteadyState { x: [x], u: [u] }).map(|(_, message)| message);
    assert_eq!(start(1.0, 0.7), Ok(Message { step: -1, y_ref: [1.0], z_ref: [1.0], certified: false, plan: 0 }));
    assert_eq!(start(f64::NAN, 0.0), Err(StartError::NotFinite));
    assert_eq!(start(0.0, f64::INFINITY), Err(StartError::NotFinite));
    assert_eq!(start(2.1, 2.1), Err(StartError::OutputOutside));
    assert_eq!(start(0.0, 4.1), Err(StartError::InputOutside { input: 0 }));
    assert!(start(2.0 + 1e-12, 1.0).is_ok());
}

#[test]
fn says_at_the_first_step_when_the_starts_do_not_fit_together() {
    let tables = pair::tables();
    // What an import moves the state by is 0.02 of it; x, u and y are of the order of 1.
    let cases = [
        (1.0, References::Nearest),
        (1.0 + 0.9 * DRIFT / 0.02, References::Nearest),
        (1.0 - 0.9 * DRIFT / 0.02, References::Nearest),
        (1.0 + 1.2 * DRIFT / 0.02, References::NotSteady),
        (1.0 - 1.2 * DRIFT / 0.02, References::NotSteady),
        (1.1, References::NotSteady),
        (f64::MAX, References::NotSteady),
    ];
    for (z, references) in cases {
        let (mut controller, _) = PairController::start(&tables, &steady(1.5, 1.0)).unwrap();
        let mut inbox = PairInbox::new();
        inbox.accept(&OTHER, &Message { step: -1, y_ref: [z], z_ref: [z], certified: true, plan: 0 }).unwrap();
        let step = controller.step(&[1.5], &[1.5], &mut inbox);
        assert_eq!(step.status.references, references);
        assert_eq!(step.status.degraded, references == References::NotSteady);
    }
}

/// y_1 + y_2 <= 1 holds for the references at every step, each taking half of the room (28).
#[test]
fn shares_coupling_constraints() {
    let tables = pair::coupled_tables();
    let start = || PairController::start(&tables, &ORIGIN).unwrap();
    let ((mut a, mut from_a), (mut b, mut from_b)) = (start(), start());
    let (mut at_a, mut at_b) = (PairInbox::new(), PairInbox::new());
    for step in 0..100 {
        at_a.accept(&PARTNER, &from_b).unwrap();
        at_b.accept(&PARTNER, &from_a).unwrap();
        let step_a = a.step(&on_reference(&a), &[2.0], &mut at_a);
        let step_b = b.step(&on_reference(&b), &[2.0], &mut at_b);
        // After 10 steps at the rate they are at the constraint, and hear of it one step later.
        let references = match step {
            0..10 => References::Nearest,
            10 => References::Blocked { row: 0 },
            _ => References::Deadlock { row: 0 },
        };
        assert_eq!((step_a.status.references, step_b.status.references), (references, references), "step {step}");
        (from_a, from_b) = (step_a.message, step_b.message);
        assert!(from_a.y_ref[0] + from_b.y_ref[0] <= 1.0 + 1e-15);
    }
    assert!((from_a.y_ref[0] - 0.5).abs() < 1e-9 && (from_b.y_ref[0] - 0.5).abs() < 1e-9);

    at_b.accept(&PARTNER, &from_a).unwrap();
    let waiting = a.step(&on_reference(&a), &[-2.0], &mut at_a);
    assert_eq!((waiting.status.references, waiting.message.y_ref), (References::Waiting, from_a.y_ref));

    at_b = PairInbox::new();
    b = start().0;
    at_b.accept(&PARTNER, &Message { step: -1, y_ref: [1.5], z_ref: [0.0], certified: true, plan: 0 }).unwrap();
    let exceeded = b.step(&[0.0], &[2.0], &mut at_b);
    assert_eq!(exceeded.status.references, References::CouplingExceeded { row: 0 });
    assert!(exceeded.status.degraded);
    assert_eq!(exceeded.message.y_ref, [0.0]);
}

/// A start beyond the tightened limit is no start of Theorem 1, whether or not there is a set-point, and is found out as
/// soon as the neighbours are heard.
#[test]
fn says_that_a_coupling_constraint_is_exceeded_without_a_set_point() {
    let tables = pair::coupled_tables();
    let heard = Message { step: -1, y_ref: [0.5], z_ref: [0.5], certified: true, plan: 0 };
    for (y, references) in [(0.75, References::CouplingExceeded { row: 0 }), (0.5, References::SetPointNotFinite)] {
        for set_point in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let (mut controller, _) = PairController::start(&tables, &steady(y, 0.5)).unwrap();
            let mut inbox = PairInbox::new();
            inbox.accept(&PARTNER, &heard).unwrap();
            let step = controller.step(&[y], &[set_point], &mut inbox);
            assert_eq!((step.status.references, step.message.y_ref), (references, [y]));
            assert_eq!(step.status.is_guaranteed(), references == References::SetPointNotFinite);
        }
    }
    let (mut controller, _) = PairController::start(&tables, &steady(0.75, 0.5)).unwrap();
    let mut inbox = PairInbox::new();
    let step = controller.step(&[0.75], &[f64::NAN], &mut inbox);
    assert_eq!(step.status.references, References::Waiting);
    assert!(step.status.degraded && !step.status.is_guaranteed());
    inbox.accept(&PARTNER, &Message { step: 0, ..heard }).unwrap();
    let step = controller.step(&[0.75], &[f64::NAN], &mut inbox);
    assert_eq!(step.status.references, References::CouplingExceeded { row: 0 });
}

/// A state on the reference: what the first half of a step would show.
fn on_reference(controller: &PairController<'_, 1, 1>) -> [f64; 1] {
    controller.clone().input(&[0.0]).telemetry.x_ref
}

/// A layer that never finds an answer.
struct Speechless;

impl ReferenceLayer<1, 0, 0> for Speechless {
    fn next(&self, _: &[f64; 1], _: &[f64; 1], _: &[f64; 0], _: &[Share<1>; 0]) -> Option<[f64; 1]> {
        None
    }

    fn epsilon(&self) -> f64 {
        0.05
    }

    fn contains(&self, _: &[f64; 1]) -> bool {
        true
    }
}

#[test]
fn keeps_the_reference_when_the_layer_has_no_answer() {
    let Tables { model, coupling, changing, problem, .. } = pair::tables();
    let tables: Tables<Speechless, 1, 1, 1, 1, 1, 0, 0, 1, 2, 3, 8, 1, 2, 2> =
        Tables { model, coupling, changing, reference: Speechless, problem };
    let (mut controller, sent) = Controller::start(&tables, &steady(1.0, 0.0)).unwrap();
    let mut inbox = PairInbox::new();
    inbox.accept(&OTHER, &Message { step: -1, y_ref: [0.0], z_ref: [0.0], certified: true, plan: 0 }).unwrap();
    let step = controller.step(&[1.0], &[0.0], &mut inbox);
    assert_eq!((step.status.references, step.message.y_ref), (References::Kept, sent.y_ref));
    assert!(step.status.is_guaranteed());
}

/// An inbox that is made anew while the controller runs misses one period and is in step again.
#[test]
fn inbox_falls_into_step_again() {
    let tables = pair::tables();
    let mut solo = Solo::new(&tables);
    (0..5).for_each(|_| assert!(solo.step(0.0, 0.0).status.is_guaranteed()));
    solo.inbox = PairInbox::new();
    let step = solo.controller.step(&[0.0], &[0.0], &mut solo.inbox);
    assert_eq!(step.status.deliveries, [Delivery::OutOfSequence(-1)]);
    assert_eq!(solo.inbox.expected(), 5);
    let step = solo.step(0.0, 0.0);
    assert_eq!(step.status.deliveries, [Delivery::InSequence]);
    assert!(step.status.degraded);
}
