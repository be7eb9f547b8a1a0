//! One subsystem's controller: the step, and the order of things in it.

use super::changing::{ACCEPTANCE, HalfSpace, Held, InForce, Meeting, NotRedrawn};
use super::linear::{add, clip, dot, finite, largest, subtract, times};
use super::load::Load;
use super::message::{Inbox, Message};
use super::plan::{Passage, StartPlan};
use super::problem::Plan;
use super::reference::{ReferenceLayer, Share};
use super::solver::{Outcome, Solver, WorkingSet};
use super::start::SteadyState;
use super::tables::{ChangingRow, CouplingRow, DpcProblem, Tables};
use super::trajectory::Trajectory;
use super::{Real, precision};
use crate::delivery::Delivery;
use crate::refusal::StartError;
use crate::status::{Control, References, Status};

/// A coupling constraint counts as exceeded above this, relative to the numbers in it.
const EXCEEDED: Real = precision::KEPT;

/// Of a sum of numbers of that size, generously.
const ROUNDING: Real = precision::SUMS;

/// Who moves by less than this, relative to epsilon, stands still; who could move by ten times more if it were alone is held up.
const STANDSTILL: Real = 1e-3;

/// The shifted candidate counts as feasible up to this, as [`Instance::admits`](super::problem::Instance::admits) takes
/// it: it carries the rounding errors of all steps since the last solution.
const CANDIDATE: Real = precision::CANDIDATE;

/// The controller of one subsystem: everything it remembers from step to step.
///
/// `'a` is the life of the tables; an emitted file keeps them in a `static`. See [`Tables`] for the sizes.
#[derive(Debug, Clone)]
pub struct Controller<
    'a,
    R,
    const NX: usize,
    const NU: usize,
    const NY: usize,
    const NZ: usize,
    const NI: usize,
    const NJ: usize,
    const NC: usize,
    const NB: usize,
    const N: usize,
    const NV: usize,
    const NR: usize,
    const NT: usize,
    const NS: usize,
    const NQ: usize,
    const NH: usize = 0,
> {
    tables: &'a Tables<R, NX, NU, NY, NZ, NI, NJ, NC, NB, N, NV, NR, NT, NS, NQ, NH>,
    step: i64,
    trajectory: Trajectory<NX, NU, NY, N>,
    /// What the references follow at first.
    plan: Option<&'a StartPlan<'a, NX, NU, NY, N>>,
    /// The last period's plan, shifted to the present: the candidate (47), this period's fall-back and warm start.
    candidate: Planned<NX, NU, N, NV>,
    /// This period's plan. The candidate stays beside it, because the period may be planned again.
    present: Present<NX, NU, N, NV>,
    /// How far the measurement may move each tube row; `None`: states are measured exactly.
    noise: Option<&'a [Real; NT]>,
    /// What this period's plan says about the true state.
    knowledge: Knowledge,
    /// Whether this period's tube rows took the forecast into account.
    relied: bool,
    /// Whether the true state is known to lie within E_i of the candidate, if all neighbours were certified at the step before.
    forecast: bool,
    /// What the loads add to the newest reference state.
    push: [Real; NX],
    /// Whether there are loads: then every step needs theirs.
    loaded: bool,
    /// What the last message said about start-up plans.
    announced: u32,
    /// The rows of the changing coupling constraints.
    changing: [Held<NY, NJ>; NH],
    /// The imported outputs of the step before.
    y_before: [Real; NJ],
    max_iterations: usize,
    degraded: bool,
    /// Kept for its memory alone.
    solver: Solver<NV>,
}

/// A plan and the rows that hold with equality in it.
#[derive(Debug, Clone)]
struct Planned<const NX: usize, const NU: usize, const N: usize, const NV: usize> {
    plan: Plan<NX, NU, N>,
    active: WorkingSet<NV>,
}

/// What the period is planned to be.
#[derive(Debug, Clone)]
enum Present<const NX: usize, const NU: usize, const N: usize, const NV: usize> {
    /// The shifted candidate: there is nothing better yet, or nothing better was found.
    Candidate,
    /// On the reference.
    Rest,
    Solved(Planned<NX, NU, N, NV>),
}

/// Why the true state is known to lie within E_i of a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Knowledge {
    /// It is not: the step was not feasible.
    None,
    /// If the forecast, which the step rests on, is to be trusted.
    ByForecast,
    /// The measurement alone says so.
    ByMeasurement,
}

/// What a step gives.
#[derive(Debug, Clone, Copy)]
pub struct Step<const NX: usize, const NU: usize, const NY: usize, const NZ: usize, const NB: usize> {
    /// u_t of (38).
    pub input: [Real; NU],
    /// For all neighbours, who need it at their step t + 1.
    pub message: Message<NY, NZ>,
    pub status: Status<NB>,
    pub telemetry: Telemetry<NX, NU, NY>,
}

/// The first half of a step: what is needed now.
#[derive(Debug, Clone, Copy)]
pub struct Input<const NX: usize, const NU: usize, const NY: usize> {
    /// u_t of (38).
    pub input: [Real; NU],
    pub control: Control,
    pub telemetry: Telemetry<NX, NU, NY>,
}

/// The second half of a step: what is needed in the next period.
#[derive(Debug, Clone, Copy)]
pub struct Outlook<const NY: usize, const NZ: usize, const NB: usize> {
    /// For all neighbours, who need it at their step t + 1.
    pub message: Message<NY, NZ>,
    pub references: References,
    pub deliveries: [Delivery; NB],
    /// See [`Status::certified`].
    pub certified: bool,
    /// See [`Status::load_within`].
    pub load_within: bool,
}

/// The signals inside the controller at time t.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Telemetry<const NX: usize, const NU: usize, const NY: usize> {
    /// xref_t.
    pub x_ref: [Real; NX],
    /// uref_t.
    pub u_ref: [Real; NU],
    /// yref_t.
    pub y_ref: [Real; NY],
    /// xhat_{t|t}.
    pub x_nom: [Real; NX],
    /// uhat_{t|t}.
    pub u_nom: [Real; NU],
}

impl<
    'a,
    R: ReferenceLayer<NY, NC, NH>,
    const NX: usize,
    const NU: usize,
    const NY: usize,
    const NZ: usize,
    const NI: usize,
    const NJ: usize,
    const NC: usize,
    const NB: usize,
    const N: usize,
    const NV: usize,
    const NR: usize,
    const NT: usize,
    const NS: usize,
    const NQ: usize,
    const NH: usize,
> Controller<'a, R, NX, NU, NY, NZ, NI, NJ, NC, NB, N, NV, NR, NT, NS, NQ, NH>
{
    /// A controller whose references stay at `steady`, and its message to all neighbours, which they need at step 0.
    ///
    /// The plant need not be there at step 0: any state will do for which the i-DPC problem is feasible.
    ///
    /// # Errors
    /// `steady` is not finite, its output is outside Y_i, its input outside U_i, or no reference has that input. Whether
    /// it is steady together with the neighbours is seen at step 0, from their messages: see [`References::NotSteady`].
    pub fn start(
        tables: &'a Tables<R, NX, NU, NY, NZ, NI, NJ, NC, NB, N, NV, NR, NT, NS, NQ, NH>,
        steady: &SteadyState<NX, NU>,
    ) -> Result<(Self, Message<NY, NZ>), StartError> {
        let model = &tables.model;
        if !steady.is_finite() {
            return Err(StartError::NotFinite);
        }
        Self::can_rest(tables, steady, &times(&model.C, &steady.x))?;
        let trajectory = Trajectory::constant(model, steady.x, steady.error_sum(model)?);
        let controller = Self::new(tables, trajectory);
        let message = controller.message(-1, false);
        Ok((controller, message))
    }

    /// A controller that starts at the measured state `x` with its part of a start-up plan, and its message to all neighbours,
    /// which they need at step 0. `noise` is that of [`Self::with_measurement_error`], `None` where states are measured exactly.
    ///
    /// # Errors
    /// The plan is not finite, too short, made for other tables, or comes to rest where no controller can; or there are changing
    /// coupling constraints, whose rows no plan knows; or `x` does not fit
    /// it, that is, the first i-DPC problem has no solution.
    pub fn start_planned(
        tables: &'a Tables<R, NX, NU, NY, NZ, NI, NJ, NC, NB, N, NV, NR, NT, NS, NQ, NH>,
        plan: &'a StartPlan<'a, NX, NU, NY, N>,
        noise: Option<&'a [Real; NT]>,
        x: &[Real; NX],
    ) -> Result<(Self, Message<NY, NZ>), StartError> {
        plan.check()?;
        if NH > 0 {
            return Err(StartError::ChangingConstraints);
        }
        if plan.design != tables.fingerprint() {
            return Err(StartError::OtherDesign);
        }
        let (y, u) = plan.end(&tables.model).ok_or(StartError::PlanTooShort)?;
        Self::can_rest(tables, &SteadyState { x: [0.0; NX], u }, &y)?;
        let trajectory = Trajectory::planned(&tables.model, plan.points);
        let candidate = Planned { plan: plan.nominal, active: WorkingSet::EMPTY };
        let announced = plan.plan;
        let mut controller = Self { plan: Some(plan), candidate, noise, announced, ..Self::new(tables, trajectory) };
        match controller.input(x).control {
            Control::Infeasible { row } => Err(StartError::StateDoesNotFit { row }),
            Control::IterationLimit => Err(StartError::Undecided),
            Control::NotFinite => Err(StartError::NotFinite),
            Control::AtReference | Control::Optimal { .. } | Control::Candidate => {
                let message = controller.message(-1, false);
                Ok((controller, message))
            }
        }
    }

    fn new(
        tables: &'a Tables<R, NX, NU, NY, NZ, NI, NJ, NC, NB, N, NV, NR, NT, NS, NQ, NH>,
        trajectory: Trajectory<NX, NU, NY, N>,
    ) -> Self {
        const {
            assert!(N > 0, "the horizon is at least 1");
            assert!(NV == NX + N * NU, "the unknowns are dx_0, du_0, ..., du_{{N-1}}");
            assert!(NR < 65535, "rows are counted in 16 bits");
            assert!(NT + NS + NQ <= NR, "there are at least as many rows as rows with offsets");
        }
        Self {
            tables,
            step: 0,
            trajectory,
            plan: None,
            candidate: Planned::REST,
            present: Present::Candidate,
            noise: None,
            knowledge: Knowledge::None,
            relied: false,
            forecast: false,
            push: [0.0; NX],
            loaded: false,
            announced: 0,
            changing: [Held::UNDRAWN; NH],
            y_before: [0.0; NJ],
            max_iterations: tables.problem.max_iterations,
            degraded: false,
            solver: Solver::NEW,
        }
    }

    /// Whether references may rest at the output `y` with the input of `steady`.
    fn can_rest(
        tables: &Tables<R, NX, NU, NY, NZ, NI, NJ, NC, NB, N, NV, NR, NT, NS, NQ, NH>,
        steady: &SteadyState<NX, NU>,
        y: &[Real; NY],
    ) -> Result<(), StartError> {
        if !tables.reference.contains(y) {
            return Err(StartError::OutputOutside);
        }
        match steady.input_outside(&tables.model.u_min, &tables.model.u_max) {
            Some(input) => Err(StartError::InputOutside { input }),
            None => Ok(()),
        }
    }

    /// The same controller where measured loads add `load` to the steady state's next state: what [`Loads::start`](super::Loads)
    /// gives.
    pub fn under(self, load: &Load<NX>) -> Self {
        Self { push: load.push, loaded: true, ..self }
    }

    /// The same controller for states that are measured with an error which moves tube row r by up to `noise[r]`: the
    /// support of the error's set in that row. Emitted files of such subsystems call it.
    pub fn with_measurement_error(self, noise: &'a [Real; NT]) -> Self {
        Self { noise: Some(noise), ..self }
    }

    /// One period: from the measured state x_t, the set-point and the neighbours' messages of step t - 1 to the input u_t
    /// and the message of step t. The same as [`Self::input`], then [`Self::references`].
    pub fn step(
        &mut self,
        x: &[Real; NX],
        set_point: &[Real; NY],
        inbox: &mut Inbox<NI, NJ, NB>,
    ) -> Step<NX, NU, NY, NZ, NB> {
        let input = self.input(x);
        let outlook = self.references(set_point, inbox);
        self.whole(input, outlook)
    }

    /// [`Self::step`] of a subsystem with measured loads: `load` is what they mean at this step. One of another step is
    /// not used: the references then take the load to have stayed, and have lost the guarantee ([`Status::degraded`]).
    pub fn step_under(
        &mut self,
        x: &[Real; NX],
        set_point: &[Real; NY],
        load: &Load<NX>,
        inbox: &mut Inbox<NI, NJ, NB>,
    ) -> Step<NX, NU, NY, NZ, NB> {
        let input = self.input(x);
        let outlook = self.references_under(set_point, load, inbox);
        self.whole(input, outlook)
    }

    fn whole(&self, now: Input<NX, NU, NY>, next: Outlook<NY, NZ, NB>) -> Step<NX, NU, NY, NZ, NB> {
        let Input { input, control, telemetry } = now;
        let Outlook { message, references, deliveries, certified, load_within } = next;
        let status = Status { control, references, deliveries, certified, load_within, degraded: self.degraded };
        Step { input, message, status, telemetry }
    }

    /// The input of this period. It depends on no message and not on the set-point, so it can be applied before they are
    /// looked at. [`Self::references`] ends the period; until then, calling it again replaces the answer: as if it had
    /// been the only call.
    pub fn input(&mut self, x: &[Real; NX]) -> Input<NX, NU, NY> {
        let reference = self.trajectory.now();
        let e = subtract(x, &reference.x);
        self.present = Present::Candidate;
        let mut control = if finite(&e) { self.control(&e) } else { Control::NotFinite };
        let mut input = self.feedback(&reference.u, &e);
        if control == Control::NotFinite || !finite(&input) {
            control = Control::NotFinite;
            self.present = Present::Candidate;
            input = add(&reference.u, &self.plan().now());
        }
        self.knowledge = self.known(control, &e);
        // An admissible input is inside up to rounding, which this removes.
        self.confine(&mut input);
        let plan = self.plan();
        let telemetry = Telemetry {
            x_ref: reference.x,
            u_ref: reference.u,
            y_ref: reference.y,
            x_nom: add(&reference.x, &plan.dx),
            u_nom: add(&reference.u, &plan.now()),
        };
        Input { input, control, telemetry }
    }

    /// Redraws the row of a changing coupling constraint (`row` counts from 0, in the order of [`Tables::changing`]) for this
    /// step, from what all its members know. To be called at every step between the arrival of the messages and
    /// [`Self::references`], by all members with the same `rule`, which must use nothing but what the [`Meeting`] and the design
    /// say; a rule that gives `None` keeps the row. See [`HalfSpace`] and the crate's documentation.
    ///
    /// # Errors
    /// The row did not qualify, and the one before stays in force; or a message is missing, and yref will stay.
    pub fn redraw(
        &mut self,
        row: usize,
        inbox: &Inbox<NI, NJ, NB>,
        rule: impl FnOnce(&Meeting<'_, NY, NJ>) -> Option<HalfSpace<NY, NJ>>,
    ) -> Result<(), NotRedrawn> {
        let constraint = self.constraint(row, inbox)?;
        let own = self.trajectory.newest().y;
        let meeting = Meeting::new(constraint, &own, inbox.outputs());
        let held = self.changing.get_mut(row).ok_or(NotRedrawn::NoSuchRow)?;
        held.redraw(self.step, &meeting, rule(&meeting))
    }

    /// Looks at what the members of a changing coupling constraint know at this step, and changes nothing: for whoever draws rows
    /// elsewhere.
    ///
    /// # Errors
    /// There is no such constraint, or the message of a member is missing.
    pub fn meet<T>(
        &self,
        row: usize,
        inbox: &Inbox<NI, NJ, NB>,
        look: impl FnOnce(&Meeting<'_, NY, NJ>) -> T,
    ) -> Result<T, NotRedrawn> {
        let constraint = self.constraint(row, inbox)?;
        Ok(look(&Meeting::new(constraint, &self.trajectory.newest().y, inbox.outputs())))
    }

    /// A changing constraint all of whose members have been heard.
    fn constraint(&self, row: usize, inbox: &Inbox<NI, NJ, NB>) -> Result<&'a ChangingRow, NotRedrawn> {
        let tables = self.tables;
        let constraint = tables.changing.get(row).ok_or(NotRedrawn::NoSuchRow)?;
        let mut slots = constraint.members.iter().filter_map(|member| member.import).map(|import| import.slot);
        match slots.find(|slot| !inbox.holds(*slot, self.step.wrapping_sub(1))) {
            Some(slot) => Err(NotRedrawn::NotHeard { slot }),
            None => Ok(constraint),
        }
    }

    /// The references at t + N from the neighbours' at t + N - 1; ends the period.
    pub fn references(&mut self, set_point: &[Real; NY], inbox: &mut Inbox<NI, NJ, NB>) -> Outlook<NY, NZ, NB> {
        // Where there are loads that nobody has asked for, they are taken to have stayed, and the references have lost their rate.
        self.degraded |= self.loaded;
        self.advance(set_point, self.push, !self.loaded, inbox)
    }

    /// [`Self::references`] of a subsystem with measured loads.
    pub fn references_under(
        &mut self,
        set_point: &[Real; NY],
        load: &Load<NX>,
        inbox: &mut Inbox<NI, NJ, NB>,
    ) -> Outlook<NY, NZ, NB> {
        let due = load.step == self.step;
        self.degraded |= !due;
        self.advance(set_point, if due { load.push } else { self.push }, due && load.within, inbox)
    }

    /// Out of line, as [`Self::solve`] is: the two never need their stack together.
    #[inline(never)]
    fn advance(
        &mut self,
        set_point: &[Real; NY],
        push: [Real; NX],
        load_within: bool,
        inbox: &mut Inbox<NI, NJ, NB>,
    ) -> Outlook<NY, NZ, NB> {
        let imports = inbox.collect(self.step.wrapping_sub(1));
        let heard = imports.deliveries.iter().all(|delivery| *delivery == Delivery::InSequence);
        let together = imports.plans.iter().fold(true, |together, plan| together & (*plan == self.announced));
        let passage = self.passage();
        // What the neighbours do to the states is known: there is nothing, or all of it was heard.
        let pushed = heard || NI == 0;
        // Past its end the plan is never looked at again.
        self.plan = passage.and(self.plan);
        self.announced = self.plan.map_or(0, |plan| plan.plan);
        let references = match passage {
            Some(passage) => {
                let fits = (!heard || together) && (!pushed || self.follows(&passage, &imports.z));
                self.trajectory.replay(&self.tables.model, &passage, &imports.z, &push);
                if fits { References::Planned } else { References::OffPlan }
            }
            None => {
                let (y, references) = self.next_output(set_point, &imports.y, heard);
                let references = if pushed && self.departs(&imports.z) { References::NotSteady } else { references };
                self.trajectory.advance(&self.tables.model, y, &imports.z, &push);
                if heard && !together { References::OffPlan } else { references }
            }
        };
        self.y_before = imports.y;
        // Where nothing but coupling constraints joins it to others, who waits loses nothing; but a plan does not wait.
        self.degraded |= (!heard && (NI > 0 || passage.is_some())) || references.lose_the_guarantee();
        self.push = push;
        let certified = match self.knowledge {
            Knowledge::None => false,
            Knowledge::ByForecast => NI == 0 || imports.all_certified(),
            Knowledge::ByMeasurement => true,
        };
        self.shift();
        self.forecast = certified && load_within;
        let message = self.message(self.step, certified);
        self.step = self.step.wrapping_add(1);
        Outlook { message, references, deliveries: imports.deliveries, certified, load_within }
    }

    /// t: how many periods have ended.
    pub fn steps(&self) -> i64 {
        self.step
    }

    /// Whether the references have lost the guarantee; see [`Status::degraded`].
    pub fn is_degraded(&self) -> bool {
        self.degraded
    }

    /// Replaces the iteration budget of the tables and forgets the warm start: for a node that has less time, or, with 0,
    /// to see the shifted candidate at work.
    pub fn limit_iterations(&mut self, max_iterations: usize) {
        self.max_iterations = max_iterations;
        self.candidate.active = WorkingSet::EMPTY;
        if let Present::Solved(solved) = &mut self.present {
            solved.active = WorkingSet::EMPTY;
        }
    }

    /// Solves the i-DPC problem and plans its solution, or leaves the candidate in its place and says why.
    fn control(&mut self, e: &[Real; NX]) -> Control {
        let problem = &self.tables.problem;
        let (x_ref, u_ref) = (&self.trajectory.x, &self.trajectory.u);
        if self.noise.is_none() && problem.rests(e, x_ref, u_ref) {
            self.present = Present::Rest;
            return Control::AtReference;
        }
        self.solve(e)
    }

    /// Out of line: who rests does not need its stack.
    #[inline(never)]
    fn solve(&mut self, e: &[Real; NX]) -> Control {
        let problem = &self.tables.problem;
        let mut instance = problem.at(e, &self.trajectory.x, &self.trajectory.u);
        if let Some(noise) = self.noise {
            let forecast = self.forecast.then_some(&self.candidate.plan.dx);
            self.relied = problem.doubt(&mut instance, noise, forecast);
        }
        if self.noise.is_some() && instance.rests() {
            self.present = Present::Rest;
            return Control::AtReference;
        }
        if !instance.is_finite() {
            return Control::NotFinite;
        }
        let outcome = self.solver.solve(&instance, &self.candidate.active, self.max_iterations);
        if let Outcome::Optimal { iterations } = outcome {
            self.present.keep(problem, &self.solver);
            if !precision::CHECKED || instance.admits_plan(self.plan(), CANDIDATE) {
                return Control::Optimal { iterations, active: self.solver.rows().count() };
            }
            self.present = Present::Candidate;
        }
        match outcome {
            _ if instance.admits_plan(&self.candidate.plan, CANDIDATE) => Control::Candidate,
            Outcome::Infeasible { row } => Control::Infeasible { row },
            Outcome::Optimal { .. } | Outcome::IterationLimit => Control::IterationLimit,
        }
    }

    /// Makes this period's plan the next one's candidate.
    fn shift(&mut self) {
        match &self.present {
            Present::Rest => self.candidate = Planned::REST,
            Present::Candidate => self.candidate.plan = self.candidate.plan.shifted(&self.tables.model),
            Present::Solved(Planned { plan, active }) => {
                let active = self.tables.problem.shifted(active.iter());
                self.candidate = Planned { plan: plan.shifted(&self.tables.model), active };
            }
        }
        self.present = Present::Candidate;
        self.knowledge = Knowledge::None;
    }

    /// What a step with this outcome knows of the true state; `e` is the measured x - xref.
    fn known(&self, control: Control, e: &[Real; NX]) -> Knowledge {
        match self.noise {
            _ if !control.is_admissible() => Knowledge::None,
            Some(noise) if !self.tables.problem.keeps_tube(noise, &subtract(e, &self.plan().dx)) => {
                Knowledge::ByForecast
            }
            _ => Knowledge::ByMeasurement,
        }
    }

    /// This period's plan.
    fn plan(&self) -> &Plan<NX, NU, N> {
        match &self.present {
            Present::Rest => &Plan::REST,
            Present::Candidate => &self.candidate.plan,
            Present::Solved(solved) => &solved.plan,
        }
    }

    /// (38): uref_t + du_0 + K (x - xhat), with x - xhat = (x - xref) - dx_0.
    fn feedback(&self, u_ref: &[Real; NU], deviation: &[Real; NX]) -> [Real; NU] {
        let plan = self.plan();
        let error = subtract(deviation, &plan.dx);
        add(&add(u_ref, &plan.now()), &times(&self.tables.model.K, &error))
    }

    fn confine(&self, input: &mut [Real; NU]) {
        let model = &self.tables.model;
        for (u, (low, high)) in input.iter_mut().zip(model.u_min.iter().zip(&model.u_max)) {
            *u = clip(*u, *low, *high);
        }
    }

    /// yref_{t+N} by the reference-output layer.
    fn next_output(&mut self, set_point: &[Real; NY], y_others: &[Real; NJ], heard: bool) -> ([Real; NY], References) {
        let previous = self.trajectory.newest().y;
        let step = self.step;
        let changing = self.changing.each_mut().map(|held| held.at(step));
        if let Some(row) = changing.iter().position(|row| *row == InForce::Undrawn) {
            return (previous, References::Undrawn { row: NC + row });
        }
        let unsure = changing.contains(&InForce::Unsure);
        if unsure || (NC > 0 && !heard) {
            return (previous, References::Waiting);
        }
        let wanted = finite(set_point);
        let limits = self.tables.coupling.each_ref().map(|row| row.share(&previous, y_others));
        let shares = changing.each_ref().map(|row| row.share(&previous, y_others));
        let next = if wanted { self.tables.reference.next(&previous, set_point, &limits, &shares) } else { None };
        let references = match (self.exceeded(&changing, &previous, y_others), next) {
            (Some(row), _) => References::CouplingExceeded { row },
            (None, Some(next)) => self.progress(set_point, y_others, &next, &limits, &shares),
            (None, None) if wanted => References::Kept,
            (None, None) => References::SetPointNotFinite,
        };
        (next.unwrap_or(previous), references)
    }

    /// The first coupling constraint, then the first changing one, that the references exceed.
    fn exceeded(&self, changing: &[InForce<NY, NJ>; NH], own: &[Real; NY], others: &[Real; NJ]) -> Option<usize> {
        let changing = changing.iter().map(|row| row.exceeded(own, others));
        self.tables.coupling.iter().map(|row| row.exceeded(own, others)).chain(changing).position(|exceeded| exceeded)
    }

    /// Whether a step to `next` is held up by coupling constraints, and whether anyone in them still moves.
    fn progress(
        &self,
        set_point: &[Real; NY],
        y_others: &[Real; NJ],
        next: &[Real; NY],
        limits: &[Real; NC],
        shares: &[Share<NY>; NH],
    ) -> References {
        let previous = self.trajectory.newest().y;
        let still = STANDSTILL * self.tables.reference.epsilon();
        if NC + NH == 0 || largest(&subtract(next, &previous)) > still {
            return References::Nearest;
        }
        let free = self.tables.reference.next(&previous, set_point, &[Real::INFINITY; NC], &[Share::NONE; NH]);
        let way = free.map_or([0.0; NY], |free| subtract(&free, &previous));
        if largest(&way) <= 10.0 * still {
            return References::Nearest;
        }
        let row = self.obstacle(&previous, &way, limits, shares);
        let others_stand = self.step > 0 && largest(&subtract(y_others, &self.y_before)) <= still;
        if others_stand { References::Deadlock { row } } else { References::Blocked { row } }
    }

    /// The coupling row, then changing row, that ends a step along `way` first.
    fn obstacle(&self, from: &[Real; NY], way: &[Real; NY], limits: &[Real; NC], shares: &[Share<NY>; NH]) -> usize {
        let fixed = self.tables.coupling.iter().zip(limits).map(|(row, limit)| (row.own, *limit));
        let rows = fixed.chain(shares.iter().map(|share| (share.own, share.limit)));
        let reach = |(own, limit): ([Real; NY], Real)| {
            let advance = dot(&own, way);
            if advance > 0.0 { (limit - dot(&own, from)) / advance } else { Real::INFINITY }
        };
        let nearest = rows.map(reach).enumerate().min_by(|(_, a), (_, b)| a.total_cmp(b));
        nearest.map_or(0, |(row, _)| row)
    }

    /// Whether this is the first step and the start does not stay where it is under the neighbours' starts: then chi_0 is not
    /// chi_ss, and (7a) does not hold over the first window.
    fn departs(&self, z: &[Real; NI]) -> bool {
        self.step == 0 && !self.trajectory.stays(&self.tables.model, z, &self.push)
    }

    /// What the start-up plan says about t + N; `None` without one, and past its end.
    fn passage(&self) -> Option<Passage<'a, NX, NU, NY>> {
        self.plan?.passage(self.step.wrapping_add(N as i64))
    }

    /// Whether, at the first step, the neighbours' starts lead on to the plan's next state: otherwise (7a) does not hold over the
    /// first window.
    fn follows(&self, passage: &Passage<'_, NX, NU, NY>, z: &[Real; NI]) -> bool {
        // The plan itself may end half of that off its rest.
        self.step != 0 || self.trajectory.arrives(&self.tables.model, &passage.at.x, z, &self.push, 0.5)
    }

    fn message(&self, step: i64, certified: bool) -> Message<NY, NZ> {
        let newest = self.trajectory.newest();
        let z_ref = newest.coupling_output(&self.tables.model);
        Message { step, y_ref: newest.y, z_ref, certified, plan: self.announced }
    }
}

impl<const NX: usize, const NU: usize, const N: usize, const NV: usize> Present<NX, NU, N, NV> {
    /// Plans what was solved.
    #[inline(never)]
    fn keep<const NR: usize, const NT: usize, const NS: usize, const NQ: usize>(
        &mut self,
        problem: &DpcProblem<NX, NU, N, NV, NR, NT, NS, NQ>,
        solver: &Solver<NV>,
    ) {
        *self = Self::Solved(Planned { plan: problem.plan(solver.w()), active: solver.working_set() });
    }
}

impl<const NX: usize, const NU: usize, const N: usize, const NV: usize> Planned<NX, NU, N, NV> {
    const REST: Self = Self { plan: Plan::REST, active: WorkingSet::EMPTY };
}

impl<const NY: usize, const NJ: usize> CouplingRow<NY, NJ> {
    /// Right-hand side of (28).
    fn share(&self, own: &[Real; NY], others: &[Real; NJ]) -> Real {
        let foreign = dot(&self.others, others);
        let slack = self.l_tilde - (dot(&self.own, own) + foreign);
        self.l_tilde - foreign - (self.members - 1.0) / self.members * slack
    }

    /// Whether k_h of (27) is above the tightened limit, by more than rounding.
    fn exceeded(&self, own: &[Real; NY], others: &[Real; NJ]) -> bool {
        let (own, foreign) = (dot(&self.own, own), dot(&self.others, others));
        own + foreign - self.l_tilde > EXCEEDED * (own.abs() + foreign.abs() + self.l_tilde.abs())
    }
}

impl<const NY: usize, const NJ: usize> InForce<NY, NJ> {
    /// (28); nothing where there is no row, which is not asked for then.
    fn share(&self, own: &[Real; NY], others: &[Real; NJ]) -> Share<NY> {
        match self {
            Self::Row { row, .. } => Share { own: row.own, limit: row.share(own, others) },
            Self::Undrawn | Self::Unsure => Share::NONE,
        }
    }

    /// Whether k_h is above the tightened limit by more than acceptance and rounding allow, and less than the margin has in
    /// reserve.
    fn exceeded(&self, own: &[Real; NY], others: &[Real; NJ]) -> bool {
        let Self::Row { row, margin } = self else { return false };
        let (own, foreign) = (dot(&row.own, own), dot(&row.others, others));
        let rounding = 5.0 * ACCEPTANCE * margin + ROUNDING * (own.abs() + foreign.abs() + row.l_tilde.abs());
        own + foreign - row.l_tilde > rounding
    }
}
