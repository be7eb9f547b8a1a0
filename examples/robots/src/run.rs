//! Robots, controllers and bus, one sampling period after the other.

use std::fmt;

use dpc_runtime::References;
use example_kit::bus::{Bus, Datagram, NotReceived};

use crate::arena::{Point, distance, from_centre, is_on_floor, on_floor};
use crate::epuck::Epuck;
use crate::pace::Pace;
use crate::robot::{Answer, Robot, Started};
use crate::rule::Rule;
use crate::scenario::{Mission, Scenario};
use crate::track::Track;

/// Who is where within this of its goal has arrived, cm.
pub const ARRIVED: f64 = 0.5;

/// References that move by less than this in a step are still, cm, ...
const STILL: f64 = 1e-9;
/// ... and after this many still steps the robots are at rest too.
const AT_REST: usize = 10;

/// A robot whose radio or motors fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fault {
    pub robot: usize,
    /// First step at which it fails.
    pub from: usize,
    pub kind: FaultKind,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaultKind {
    /// Others do not hear it.
    Mute,
    /// It does not hear others.
    Deaf,
    /// Both.
    Silent,
    /// Both, and its wheels stand still.
    Dead,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match self.kind {
            FaultKind::Mute => "mute",
            FaultKind::Deaf => "deaf",
            FaultKind::Silent => "mute and deaf",
            FaultKind::Dead => "dead",
        };
        write!(f, "robot {} {what} from step {}", self.robot + 1, self.from)
    }
}

/// One robot at one step.
#[derive(Debug, Clone)]
pub struct Moment {
    /// On the floor.
    pub position: Point,
    pub heading: Point,
    pub goal: Point,
    /// yref_t and yref_{t+N}, on the floor.
    pub y_ref: Point,
    pub newest: Point,
    pub answer: Answer,
}

/// What happened.
#[derive(Debug, Clone)]
pub struct Run {
    pub scenario: Scenario,
    pub rule: Rule,
    pub pace: Pace,
    /// How many stops of its way the leader has reached.
    pub stops: usize,
    /// By step, then robot.
    pub steps: Vec<Vec<Moment>>,
    /// Smallest distance of any two centres within each period, looked at every millisecond, cm.
    pub closest: Vec<f64>,
    /// By step, then robot: where it went after it, on the floor, every 50 ms.
    pub tracks: Vec<Vec<Vec<Point>>>,
    /// N.
    pub horizon: usize,
    /// Times that a robot's centre left the floor within a period.
    pub left: usize,
    /// Times that a robot was further off its double integrator than the design counts on.
    pub strayed: usize,
    pub fault: Option<Fault>,
    /// Of all robots at every step.
    pub deviation: crate::following::Deviation,
}

impl Run {
    /// # Errors
    /// A message got lost in the bus.
    pub fn new(
        started: Vec<Started<'_>>,
        scenario: &Scenario,
        rule: Rule,
        pace: Pace,
        fault: Option<Fault>,
    ) -> Result<Self, NotReceived> {
        let mut field = Field::new(started, scenario, fault, pace);
        let mut run = Self {
            scenario: scenario.clone(),
            rule,
            pace,
            stops: 0,
            steps: Vec::new(),
            closest: Vec::new(),
            tracks: Vec::new(),
            horizon: crate::controllers::robot_1::N,
            left: 0,
            strayed: 0,
            fault,
            deviation: Default::default(),
        };
        for step in 0..scenario.steps {
            run.steps.push(field.decide(step, rule)?);
            let tracks = field.drive(step, &run.steps[step]);
            run.closest.push(closest(&tracks));
            run.tracks.push(tracks.iter().map(Track::thinned).collect());
            run.left += tracks.iter().filter(|track| !track.positions.iter().all(|at| is_on_floor(*at))).count();
            run.strayed += tracks.iter().filter(|track| !track.deviation.is_within(&pace.declared.bound)).count();
            run.deviation = tracks.iter().fold(run.deviation, |worst, track| worst.max(track.deviation));
            run.stops = field.stop;
            if run.is_at_rest() {
                break;
            }
        }
        Ok(run)
    }

    /// What was run, in words.
    pub fn name(&self) -> String {
        let fault = self.fault.map_or(String::new(), |fault| format!(", {fault}"));
        format!("{}, {}, {} cm a step{fault}", self.scenario.name, self.rule.name(), self.pace.epsilon)
    }

    /// Whether nothing will change any more: goals stay, and so did all references for some steps.
    fn is_at_rest(&self) -> bool {
        let still = |moments: &[Vec<Moment>]| {
            let pairs = moments[0].iter().zip(&moments[1]);
            pairs.into_iter().all(|(before, after)| distance(before.newest, after.newest) < STILL)
        };
        let last = self.steps.len().saturating_sub(AT_REST);
        matches!(self.scenario.mission, Mission::Goals(_)) && last > 0 && self.steps[last..].windows(2).all(still)
    }

    /// Largest distance of a newest reference from its place: where goals stay at the end of the run, where they move in stops
    /// at the end of each, cm.
    pub fn off_goal(&self) -> f64 {
        let leg = match &self.scenario.mission {
            Mission::Formation { leg, .. } => *leg,
            Mission::Goals(_) | Mission::Follow { .. } => self.steps.len(),
        };
        let ends = self.steps.iter().skip(leg - 1).step_by(leg);
        let off = ends.flatten().map(|moment| distance(moment.newest, moment.goal));
        off.fold(0.0, f64::max)
    }

    /// Smallest distance of two centres at any time, cm.
    pub fn smallest_distance(&self) -> f64 {
        self.closest.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// The first step from which on all references are at the goals, to stay.
    pub fn references_arrive(&self) -> Option<usize> {
        self.arrive(|moment| moment.newest)
    }

    /// The same of the robots.
    pub fn robots_arrive(&self) -> Option<usize> {
        self.arrive(|moment| moment.position)
    }

    /// The robots that say at the last step that nobody moves though they are not at their goals.
    pub fn deadlocked(&self) -> Vec<usize> {
        let last = self.steps.last().map(Vec::as_slice).unwrap_or_default();
        let stuck = |moment: &Moment| matches!(moment.answer.verdict.references, References::Deadlock { .. });
        (0..last.len()).filter(|&i| stuck(&last[i])).collect()
    }

    /// Steps of any robot at which its status does not say that the guarantee holds.
    pub fn unguaranteed(&self) -> usize {
        self.steps.iter().flatten().filter(|moment| !moment.answer.verdict.guaranteed).count()
    }

    fn arrive(&self, place: impl Fn(&Moment) -> Point) -> Option<usize> {
        let there = |moments: &Vec<Moment>| moments.iter().all(|m| distance(place(m), m.goal) <= ARRIVED);
        let away = self.steps.iter().rposition(|moments| !there(moments));
        let first = away.map_or(0, |step| step + 1);
        (first < self.steps.len()).then_some(first)
    }
}

/// The robots and their controllers.
struct Field<'a> {
    robots: Vec<Box<dyn Robot + 'a>>,
    bodies: Vec<Epuck>,
    bus: Bus,
    fault: Option<Fault>,
    pace: Pace,
    mission: Mission,
    /// yref_{t+N-1} of all, on the floor.
    references: Vec<Point>,
    stop: usize,
}

impl<'a> Field<'a> {
    fn new(started: Vec<Started<'a>>, scenario: &Scenario, fault: Option<Fault>, pace: Pace) -> Self {
        let mut field = Self {
            robots: Vec::new(),
            bodies: scenario.starts.iter().map(|start| Epuck::at(from_centre(*start), [1.0, 0.0])).collect(),
            bus: Bus::default(),
            fault,
            pace,
            mission: scenario.mission.clone(),
            references: scenario.starts.clone(),
            stop: 0,
        };
        let all = started.len();
        for (i, (robot, message)) in started.into_iter().enumerate() {
            field.robots.push(robot);
            field.send(0, i, all, &message);
        }
        field
    }

    fn send(&mut self, step: usize, from: usize, all: usize, message: &[u8]) {
        let reached: Vec<usize> = (0..all).filter(|&to| to != from && self.is_heard(step, from, to)).collect();
        for to in reached {
            self.bus.pass(Datagram { from, to, bytes: message.to_vec() });
        }
    }

    fn is_heard(&self, step: usize, from: usize, to: usize) -> bool {
        let fails = |robot: usize, kinds: &[FaultKind]| {
            self.fault.is_some_and(|fault| fault.robot == robot && step >= fault.from && kinds.contains(&fault.kind))
        };
        !fails(from, &[FaultKind::Mute, FaultKind::Silent, FaultKind::Dead])
            && !fails(to, &[FaultKind::Deaf, FaultKind::Silent, FaultKind::Dead])
    }

    /// Everyone reads its messages, then everyone takes its step.
    fn decide(&mut self, step: usize, rule: Rule) -> Result<Vec<Moment>, NotReceived> {
        for (i, robot) in self.robots.iter_mut().enumerate() {
            self.bus.receive(i).try_for_each(|datagram| robot.receive(&datagram))?;
        }
        let clearance = self.pace.clearance();
        let goals = self.mission.goals(step, &self.references, &mut self.stop);
        let mut moments = Vec::new();
        for (i, goal) in goals.into_iter().enumerate() {
            let motion = self.bodies[i].motion();
            let answer = self.robots[i].step(&motion.state(), &from_centre(goal), rule, &clearance);
            self.send(step + 1, i, self.bodies.len(), &answer.message);
            self.references[i] = on_floor(answer.y_ref);
            moments.push(Moment {
                position: on_floor(motion.position),
                heading: motion.heading,
                goal,
                y_ref: on_floor(answer.telemetry.y_ref),
                newest: on_floor(answer.y_ref),
                answer,
            });
        }
        Ok(moments)
    }

    /// The period after it.
    fn drive(&mut self, step: usize, moments: &[Moment]) -> Vec<Track> {
        let dead = |i: usize| {
            self.fault.is_some_and(|fault| fault.kind == FaultKind::Dead && fault.robot == i && step >= fault.from)
        };
        let period = self.pace.period();
        let tracks = self.bodies.iter_mut().zip(moments).enumerate();
        tracks
            .map(|(i, (body, moment))| match dead(i) {
                true => Track::of_a_stop(body, period),
                false => Track::of(body, moment.answer.acceleration, period),
            })
            .collect()
    }
}

/// Smallest distance of any two over a period.
fn closest(tracks: &[Track]) -> f64 {
    let pairs = tracks.iter().enumerate().flat_map(|(i, a)| tracks[..i].iter().map(move |b| (a, b)));
    let apart = pairs.flat_map(|(a, b)| a.positions.iter().zip(&b.positions).map(|(a, b)| distance(*a, *b)));
    apart.fold(f64::INFINITY, f64::min)
}
