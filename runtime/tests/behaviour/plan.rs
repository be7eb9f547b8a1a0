//! Does a controller that starts with a plan follow it, hand over without a gap, and refuse what does not fit?

use crate::pair::{self, OTHER, PairController, PairInbox, PairMessage, PairTables, TUBE};
use dpc_runtime::problem::Plan;
use dpc_runtime::{Control, Delivery, Message, PlannedPoint, References, StartError, StartPlan, Step};

type PairPlan<'a> = StartPlan<'a, 1, 1, 1, 2>;
type PairStep = Step<1, 1, 1, 1, 1>;
type Point = PlannedPoint<1, 1>;

/// T.
const END: usize = 6;

/// Both subsystems on any inputs for END steps, then at rest: x+ = 0.9 x + 0.1 u + 0.02 x_j, u = -3 x + e.
struct Plans {
    points: [Vec<Point>; 2],
    e: [f64; 2],
}

impl Plans {
    /// From `x` with inputs that lead both to 0.5 in the last step.
    fn from(mut x: [f64; 2]) -> Self {
        let mut points = [Vec::new(), Vec::new()];
        for step in 0..END {
            let way = (END - step) as f64;
            let next = x.map(|x| x + (0.5 - x) / way);
            let u: [f64; 2] = std::array::from_fn(|i| (next[i] - 0.9 * x[i] - 0.02 * x[1 - i]) / 0.1);
            (0..2).for_each(|i| points[i].push(Point { x: [x[i]], u: [u[i]] }));
            x = std::array::from_fn(|i| 0.9 * x[i] + 0.1 * u[i] + 0.02 * x[1 - i]);
        }
        // 0.1 x = 0.1 u + 0.02 x_j.
        let u: [f64; 2] = std::array::from_fn(|i| x[i] - 0.2 * x[1 - i]);
        (0..2).for_each(|i| points[i].push(Point { x: [x[i]], u: [u[i]] }));
        Self { points, e: std::array::from_fn(|i| u[i] + 3.0 * x[i]) }
    }

    fn part(&self, tables: &PairTables<0, 0>, i: usize) -> PairPlan<'_> {
        let (design, nominal) = (tables.fingerprint(), Plan::REST);
        StartPlan { design, plan: 7, points: &self.points[i], e: [self.e[i]], nominal }
    }
}

/// Both controllers on their plans, against the plant.
struct Loop<'a> {
    controllers: [PairController<'a, 0, 0>; 2],
    inboxes: [PairInbox<0>; 2],
    x: [f64; 2],
}

impl<'a> Loop<'a> {
    fn new(tables: &'a PairTables<0, 0>, plans: &'a [PairPlan<'a>; 2], x: [f64; 2]) -> Self {
        let start = |i: usize| PairController::start_planned(tables, &plans[i], None, &[x[i]]).unwrap();
        let [(first, from_first), (second, from_second)] = [start(0), start(1)];
        let mut inboxes = [PairInbox::new(), PairInbox::new()];
        inboxes[0].accept(&OTHER, &from_second).unwrap();
        inboxes[1].accept(&OTHER, &from_first).unwrap();
        Self { controllers: [first, second], inboxes, x }
    }

    /// One period; the message to `deaf` gets lost.
    fn step(&mut self, set_points: [f64; 2], deaf: Option<usize>) -> [PairStep; 2] {
        let steps: [PairStep; 2] =
            std::array::from_fn(|i| self.controllers[i].step(&[self.x[i]], &[set_points[i]], &mut self.inboxes[i]));
        for i in (0..2).filter(|i| Some(*i) != deaf) {
            self.inboxes[i].accept(&OTHER, &steps[1 - i].message).unwrap();
        }
        self.x = std::array::from_fn(|i| 0.9 * self.x[i] + 0.1 * steps[i].input[0] + 0.02 * self.x[1 - i]);
        steps
    }
}

/// (7) of both subsystems, with yref given: what the references are to be, step by step.
fn network(plans: &Plans, y: &[[f64; 2]]) -> Vec<[(f64, f64); 2]> {
    let point = |i: usize, k: usize| (plans.points[i][k].x[0], plans.points[i][k].u[0]);
    let mut all: Vec<_> = (0..=END).map(|k| [point(0, k), point(1, k)]).collect();
    let mut e = plans.e;
    for y in y {
        let now = all[all.len() - 1];
        let x: [f64; 2] = std::array::from_fn(|i| 0.9 * now[i].0 + 0.1 * now[i].1 + 0.02 * now[1 - i].0);
        e = std::array::from_fn(|i| e[i] + y[i] - now[i].0);
        all.push(std::array::from_fn(|i| (x[i], -3.0 * x[i] + e[i])));
    }
    all
}

#[test]
fn replays_the_plan_and_hands_over_without_a_gap() {
    let tables = pair::tables();
    let plans = Plans::from([2.5, -1.0]);
    let parts = [plans.part(&tables, 0), plans.part(&tables, 1)];
    let mut run = Loop::new(&tables, &parts, [2.55, -1.02]);
    let steps: Vec<_> = (0..60).map(|_| run.step([1.5, -0.7], None)).collect();
    let sent: Vec<[f64; 2]> = steps.iter().map(|pair| [pair[0].message.y_ref[0], pair[1].message.y_ref[0]]).collect();
    // The message of step t is about t + 2: the layer's own outputs begin after END.
    let expected = network(&plans, &sent[END - 1..]);
    for (t, pair) in steps.iter().enumerate() {
        for (i, step) in pair.iter().enumerate() {
            let (x, u) = expected[t][i];
            assert!((step.telemetry.x_ref[0] - x).abs() < 1e-13 && (step.telemetry.u_ref[0] - u).abs() < 1e-12, "{t}");
            let planned = t + 2 <= END;
            assert_eq!(step.status.references, if planned { References::Planned } else { References::Nearest });
            assert!(step.status.is_guaranteed(), "{t}: {}", step.status);
            assert_eq!(step.message.step, t as i64);
            assert!((step.message.z_ref[0] - expected[t + 2][i].0).abs() < 1e-13);
        }
    }
    // From rest at 0.5, at 0.05 a step.
    assert!((sent[END - 1][0] - 0.55).abs() < 1e-9 && (sent[END - 1][1] - 0.45).abs() < 1e-9);
    assert!((run.x[0] - 1.5).abs() < 0.1 && (run.x[1] + 0.7).abs() < 0.1, "{:?}", run.x);
}

fn refusal(tables: &PairTables<0, 0>, plan: &PairPlan<'_>, x: f64) -> Option<StartError> {
    PairController::start_planned(tables, plan, None, &[x]).err()
}

#[test]
fn a_state_or_a_plan_that_does_not_fit_is_refused() {
    let tables = pair::tables();
    let plans = Plans::from([2.5, -1.0]);
    let plan = plans.part(&tables, 0);
    assert_eq!(refusal(&tables, &plan, 2.5 + 0.99 * TUBE), None);
    // Beyond the tube the i-DPC problem decides: here up to the reserve.
    assert_eq!(refusal(&tables, &plan, 3.4), None);
    assert!(matches!(refusal(&tables, &plan, 3.6), Some(StartError::StateDoesNotFit { .. })));
    assert!(matches!(refusal(&tables, &plan, 1.4), Some(StartError::StateDoesNotFit { .. })));
    assert_eq!(refusal(&tables, &plan, f64::NAN), Some(StartError::NotFinite));
    assert_eq!(refusal(&tables, &PairPlan { design: plan.design ^ 1, ..plan }, 2.5), Some(StartError::OtherDesign));
    let short = PairPlan { points: &plan.points[..2], ..plan };
    assert_eq!(refusal(&tables, &short, 2.5), Some(StartError::PlanTooShort));
    assert_eq!(refusal(&tables, &PairPlan { e: [f64::NAN], ..plan }, 2.5), Some(StartError::NotFinite));
    // Its end is no place to rest at.
    let outside = [plan.points, &[Point { x: [2.1], u: [0.0] }]].concat();
    assert_eq!(refusal(&tables, &PairPlan { points: &outside, ..plan }, 2.5), Some(StartError::OutputOutside));
    let saturated = [plan.points, &[Point { x: [0.0], u: [4.1] }]].concat();
    let saturated = PairPlan { points: &saturated, ..plan };
    assert_eq!(refusal(&tables, &saturated, 2.5), Some(StartError::InputOutside { input: 0 }));
    let other = PairTables { problem: tables.problem.clone(), ..pair::tables() };
    assert_eq!(other.fingerprint(), tables.fingerprint());
    let mut other = pair::tables();
    other.problem.upper[0] *= 1.0 + f64::EPSILON;
    assert_eq!(refusal(&other, &plan, 2.5), Some(StartError::OtherDesign));
}

/// The plan's own solution of the first problem stands in where there is no time to solve it.
#[test]
fn the_plan_brings_its_first_solution() {
    let mut tables = pair::tables();
    tables.problem.max_iterations = 0;
    let plans = Plans::from([2.5, -1.0]);
    let plan = plans.part(&tables, 0);
    assert_eq!(refusal(&tables, &plan, 3.0), Some(StartError::Undecided));
    // 0.45 off the reference, and from there on by K.
    let nominal = Plan { dx: [0.45], du: [[-0.45], [-0.36]] };
    let plan = PairPlan { nominal, ..plan };
    let (mut controller, _) = PairController::start_planned(&tables, &plan, None, &[3.0]).unwrap();
    assert_eq!(controller.input(&[3.0]).control, Control::Candidate);
}

/// A neighbour that was not started with the plan is found out at the first step.
#[test]
fn a_neighbour_that_is_off_the_plan_is_seen() {
    let tables = pair::tables();
    let plans = Plans::from([2.5, -1.0]);
    let plan = plans.part(&tables, 0);
    let heard = plans.points[1][1].x[0];
    for (z, number, references) in [
        (heard, 7, References::Planned),
        (heard + 1e-6, 7, References::OffPlan),
        (heard, 8, References::OffPlan),
        (heard, 0, References::OffPlan),
    ] {
        let (mut controller, _) = PairController::start_planned(&tables, &plan, None, &[2.5]).unwrap();
        let mut inbox = PairInbox::new();
        let message: PairMessage = Message { step: -1, y_ref: [z], z_ref: [z], certified: false, plan: number };
        inbox.accept(&OTHER, &message).unwrap();
        let step = controller.step(&[2.5], &[0.0], &mut inbox);
        assert_eq!(step.status.references, references);
        assert_eq!(step.status.is_guaranteed(), references == References::Planned);
    }
}

/// A message lost while the plan runs has the consequences it has at any other time; the feedback around the plan brings the
/// references back to it.
#[test]
fn a_message_lost_while_the_plan_runs_is_said_and_mended() {
    let tables = pair::tables();
    let plans = Plans::from([2.5, -1.0]);
    let parts = [plans.part(&tables, 0), plans.part(&tables, 1)];
    let mut run = Loop::new(&tables, &parts, [2.5, -1.0]);
    let whole = network(&plans, &[]);
    let mut off = Vec::new();
    for (t, expected) in whole.iter().enumerate().take(END) {
        let [step, other] = run.step([0.5, 0.5], (t == 1).then_some(0));
        let lost = if t == 2 { Delivery::Missing } else { Delivery::InSequence };
        assert_eq!(step.status.deliveries, [lost]);
        assert_eq!(step.status.degraded, t >= 2);
        assert!(!other.status.degraded && step.status.control.is_admissible());
        let planned = if t + 2 <= END { References::Planned } else { References::Nearest };
        assert_eq!(step.status.references, planned);
        off.push((step.telemetry.x_ref[0] - expected[0].0).abs());
    }
    // What was heard last stood for z at step 3, first used for xref at step 4.
    assert!(off[3] < 1e-13 && off[4] > 1e-3 && off[4] < 0.02, "{off:?}");
    let last = (0..80).map(|_| run.step([0.5, 0.5], None)).last().unwrap();
    assert!(last.iter().all(|step| (step.telemetry.x_ref[0] - 0.5).abs() < 1e-3));
}

/// Messages of the wrong step while the plan runs, too.
#[test]
fn a_late_message_while_the_plan_runs_is_refused_and_said() {
    let tables = pair::tables();
    let plans = Plans::from([2.5, -1.0]);
    let parts = [plans.part(&tables, 0), plans.part(&tables, 1)];
    let mut run = Loop::new(&tables, &parts, [2.5, -1.0]);
    let [_, late] = run.step([0.5, 0.5], Some(0));
    let [step, _] = run.step([0.5, 0.5], Some(0));
    assert_eq!(step.status.deliveries, [Delivery::Missing]);
    assert!(run.inboxes[0].accept(&OTHER, &late.message).is_err());
    let [step, _] = run.step([0.5, 0.5], None);
    assert_eq!(step.status.deliveries, [Delivery::OutOfSequence(0)]);
    assert!(step.status.degraded && step.status.references == References::Planned);
}
