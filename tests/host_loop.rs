//! The paper's Section IV-B on the host, for any design: references, i-DPC, control law, and the true plant. Of the
//! runtime it uses the solver only.
#![expect(non_snake_case, reason = "the paper's symbols")]

use std::collections::BTreeMap;

use dpc_codegen::design::Design;
use dpc_codegen::network::{Network, Norm};
use dpc_codegen::start::{StartPlan, SubsystemPlan};
use dpc_runtime::solver::{Outcome, Rows, Solver, WorkingSet};
use nalgebra::{DMatrix, DVector};

use crate::Random;
use crate::checker::{Collective, Rates};
use crate::least_distance::{Instance, Parameters, Truth};
use crate::load_shares::LoadShares;
use crate::problem_checker::Problem;
use crate::random_network::{Part, Plant};
use crate::runtime_twin;
use crate::unknowns::Unknowns;
use crate::weather::{Adversary, Course, Inflow, Nuisance};

/// Unknowns of the largest problem: 4 states, 6 steps of 2 inputs.
pub const NV: usize = 16;

/// What counts as a violation, relative to the limit: rounding over a whole run, and nothing else.
pub const EXACT: f64 = 1e-9;

/// Where set-points come from, step by step.
#[derive(Debug, Clone)]
pub enum Mission {
    /// New ones now and then, half of them outside of Y.
    Jumps,
    /// The rate of (30) used in full, with the signs that drive one row of X or U to its worst value at the end of each
    /// window.
    BangBang { subsystem: usize, row: usize },
    /// The same ones for ever.
    Constant(DVector<f64>),
}

/// Where the neighbours' deviations z_j - zref_j come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Neighbours {
    /// The plant as a whole.
    True,
    /// Each subsystem alone, what it imports being anything that Z_j allows.
    Adversarial,
}

/// What w, v and the loads do, as far as the plant has them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weather {
    /// The worst that is stated; loads drive the row of [`Mission::BangBang`] too.
    Worst,
    /// Loads break their bounds and rates.
    Breaking,
    /// Nothing happens: loads are at rest where they are.
    Calm,
}

/// What a run counted.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    /// Steps times subsystems.
    pub steps: usize,
    /// Of these, problems that were solved because v = 0 was not feasible.
    pub solved: usize,
    /// Of these, problems with a row other than (35a) active.
    pub constrained: usize,
    pub most_iterations: usize,
    /// Solutions compared with Clarabel's, and the largest relative difference.
    pub compared: usize,
    pub difference: f64,
    /// Problems in which (35a') took the forecast where the measurement alone would have allowed less.
    pub forecasts: usize,
    /// What the runtime's own code was asked too: (35a') and loads.
    pub twins: usize,
    /// After a load broke its bounds or rates: steps of a subsystem for which something is promised, and for which nothing is.
    pub recovered: usize,
    pub unsure: usize,
    /// By kind: how often, and the worst relative amount.
    pub violations: BTreeMap<String, (usize, f64)>,
    /// How near every kind of limit came, as a share of it: 1 is at the limit.
    pub nearest: BTreeMap<&'static str, f64>,
}

impl Tally {
    /// `value` must not exceed `limit`.
    fn at_most(&mut self, what: &'static str, value: f64, limit: f64, scale: f64) {
        let excess = (value - limit) / scale.abs().max(f64::MIN_POSITIVE);
        let near = self.nearest.entry(what).or_insert(f64::NEG_INFINITY);
        *near = near.max(1.0 + excess);
        if excess.is_nan() || excess > EXACT {
            self.violation(what, excess);
        }
    }

    fn violation(&mut self, what: &str, amount: f64) {
        let entry = self.violations.entry(what.to_owned()).or_insert((0, 0.0));
        *entry = (entry.0 + 1, entry.1.max(amount));
    }

    /// The sum of two runs.
    pub fn add(&mut self, other: Self) {
        self.steps += other.steps;
        self.solved += other.solved;
        self.constrained += other.constrained;
        self.most_iterations = self.most_iterations.max(other.most_iterations);
        self.compared += other.compared;
        self.forecasts += other.forecasts;
        self.twins += other.twins;
        self.recovered += other.recovered;
        self.unsure += other.unsure;
        self.difference = self.difference.max(other.difference);
        for (what, (count, worst)) in other.violations {
            let entry = self.violations.entry(what).or_insert((0, 0.0));
            *entry = (entry.0 + count, entry.1.max(worst));
        }
        for (what, near) in other.nearest {
            let entry = self.nearest.entry(what).or_insert(f64::NEG_INFINITY);
            *entry = entry.max(near);
        }
    }
}

/// One controller: the references from now to the horizon, and the last working set.
struct Node<'a> {
    problem: Problem<'a>,
    unknowns: &'a Unknowns,
    BK: DMatrix<f64>,
    adversary: Adversary,
    /// What acts in this step.
    nuisance: Nuisance,
    inflow: Inflow,
    /// dref of this step, ..., t + N - 1.
    d_ref: Vec<DVector<f64>>,
    /// What the loads were at the start, and then what was made of them: M dref_{t+N-1}, and whether they kept what is assumed.
    first_d: DVector<f64>,
    admitted: Vec<(DVector<f64>, DVector<f64>, bool)>,
    /// The last plan, one step on: (47).
    candidate: DVector<f64>,
    /// Whether the true state is known to lie within E_i of the candidate's first state.
    forecast: bool,
    /// Whether this step's problem has a solution; whether that alone, whatever was before, puts x - xhat into E_i.
    feasible: bool,
    alone: bool,
    x_ref: Vec<DVector<f64>>,
    u_ref: Vec<DVector<f64>>,
    y_ref: Vec<DVector<f64>>,
    /// Before the end of a start-up plan, de of its replay.
    e_ref: DVector<f64>,
    plan: Option<&'a SubsystemPlan>,
    /// The step of the newest reference.
    newest: usize,
    warm: WorkingSet<NV>,
    /// Optimal cost of the last step.
    cost: f64,
}

/// A network of controllers on its plant.
pub struct HostLoop<'a> {
    design: &'a Design,
    plant: &'a Plant,
    model: Collective,
    rates: Rates,
    nodes: Vec<Node<'a>>,
    /// The true state of each subsystem.
    x: Vec<DVector<f64>>,
    neighbours: Neighbours,
    /// Signs of the adversary's deviations, per subsystem and coupling output.
    signs: Vec<DVector<f64>>,
    set_point: DVector<f64>,
    step: usize,
    /// Part of the largest admitted deviation that is applied every [`CALM`] steps.
    upset: f64,
    /// Every how many solved problems Clarabel is asked too; 0: never.
    compare: usize,
    weather: Weather,
    loads: LoadShares,
    /// Whether no load has broken its bounds or rates so far.
    trusted: bool,
    pub tally: Tally,
}

/// Steps of a window of [`Mission::BangBang`].
const WINDOW: usize = 60;

/// Steps from one upset to the next.
const CALM: usize = 17;

impl<'a> HostLoop<'a> {
    /// Starts at a random steady state of Y, with the largest deviations that every subsystem admits, times `upset`.
    ///
    /// # Panics
    /// calF is not Schur: the design was not checked.
    pub fn start(
        design: &'a Design,
        plant: &'a Plant,
        neighbours: Neighbours,
        upset: f64,
        random: &mut Random,
    ) -> Self {
        let model = Collective::new(design);
        let loads = LoadShares::new(&model, &design.network).expect("I - calF is regular");
        let y = steady_output(design, random);
        let inflows: Vec<_> = plant.parts.iter().map(|part| Inflow::new(&part.unknowns, random)).collect();
        let d = concat(&inflows.iter().map(|inflow| inflow.d.clone()).collect::<Vec<_>>());
        let chi = model.steady().expect("I - calF is regular") * &y + loads.rest(&d);
        let rest = |(i, inflow)| Node::rest(design, plant, i, &chi, &y, inflow);
        let mut nodes: Vec<_> = inflows.into_iter().enumerate().map(rest).collect();
        nodes.iter_mut().for_each(|node| node.choose(&DVector::zeros(node.problem.s.n()), random));
        let x = nodes.iter().map(|node| node.upset_state(random, upset)).collect();
        Self { x, set_point: y, neighbours, upset, ..Self::new(design, plant, model, loads, nodes) }
    }

    /// Undisturbed on the plant, with no state yet and no set-point.
    fn new(design: &'a Design, plant: &'a Plant, model: Collective, loads: LoadShares, nodes: Vec<Node<'a>>) -> Self {
        Self {
            rates: Rates::new(&model, design.network.reference.norm).expect("calF is Schur"),
            signs: design.network.subsystems.iter().map(|s| DVector::from_element(s.nz(), 1.0)).collect(),
            design,
            plant,
            model,
            loads,
            nodes,
            x: Vec::new(),
            neighbours: Neighbours::True,
            set_point: DVector::zeros(0),
            step: 0,
            upset: 0.0,
            compare: 0,
            weather: Weather::Worst,
            trusted: true,
            tally: Tally::default(),
        }
    }

    /// With other weather from now on.
    pub fn under(mut self, weather: Weather) -> Self {
        self.weather = weather;
        self
    }

    /// Starts where a plan was made for.
    pub fn planned(design: &'a Design, plant: &'a Plant, plan: &'a StartPlan) -> Self {
        let model = Collective::new(design);
        let loads = LoadShares::new(&model, &design.network).expect("I - calF is regular");
        let nodes: Vec<_> =
            (0..plant.parts.len()).map(|i| Node::planned(design, plant, i, &plan.subsystems[i])).collect();
        let set_point = concat(&nodes.iter().map(|node| node.newest_y().clone()).collect::<Vec<_>>());
        Self { x: plan.start.x0.clone(), set_point, ..Self::new(design, plant, model, loads, nodes) }
    }

    /// Also asks Clarabel about every `every`-th problem.
    pub fn compare(mut self, every: usize) -> Self {
        self.compare = every;
        self
    }

    /// Runs without further upsets, in calm weather.
    pub fn settle(&mut self, mission: &Mission, steps: usize, random: &mut Random) {
        self.upset = 0.0;
        self.weather = Weather::Calm;
        self.nodes.iter_mut().for_each(|node| node.nuisance = Nuisance::none(node.problem.s.n()));
        self.run(mission, steps, random);
    }

    pub fn run(&mut self, mission: &Mission, steps: usize, random: &mut Random) {
        for _ in 0..steps {
            self.aim(mission, random);
            if self.upset > 0.0 && self.step > 0 && self.step.is_multiple_of(CALM) {
                self.upset(random);
            }
            self.move_loads(mission, random);
            let u: Vec<_> = (0..self.nodes.len()).map(|i| self.control(i)).collect();
            self.check(&u);
            self.advance_plant(&u, random);
            self.advance_references();
            self.expect_next(random);
            self.step += 1;
        }
    }

    fn move_loads(&mut self, mission: &Mission, random: &mut Random) {
        let wanted = match mission {
            Mission::BangBang { subsystem, row } => Some(self.worst_loads(*subsystem, *row)),
            _ => None,
        };
        let mut first = 0;
        for node in &mut self.nodes {
            let count = node.unknowns.loads.len();
            let course = match (self.weather, &wanted) {
                (Weather::Calm, _) => Course::Rest,
                (Weather::Breaking, _) => Course::Breaking,
                (Weather::Worst, Some(wanted)) => Course::Towards(wanted.rows(first, count).into_owned()),
                (Weather::Worst, None) => Course::Free,
            };
            first += count;
            node.inflow.advance(node.unknowns, &course, random);
            node.admit();
        }
    }

    /// What the next step starts from: candidates, forecasts, and what w and v will be.
    fn expect_next(&mut self, random: &mut Random) {
        for (node, x) in self.nodes.iter_mut().zip(&self.x) {
            let kept = node.admitted.last().is_none_or(|(_, _, kept)| *kept);
            self.trusted &= kept;
            node.forecast = node.feasible && kept;
            node.candidate = node.shifted();
            let off = x - &node.x_ref[0] - node.candidate.rows(0, x.len());
            if self.weather != Weather::Calm {
                node.choose(&off, random);
            }
        }
        if self.trusted {
            for (node, x) in self.nodes.iter().zip(&self.x) {
                let off = x - &node.x_ref[0] - node.candidate.rows(0, x.len());
                let exact = 1e-3 * (node.problem.sized.E.P.abs() * x.abs()).amax();
                for (value, q) in (&node.problem.sized.E.P * off).iter().zip(&node.problem.sized.E.q) {
                    self.tally.at_most("(18) x - forecast in E", value.abs(), *q, q.max(exact));
                }
            }
        }
    }

    /// New deviations for all at once: Theorem 1 starts anew from any state for which every problem has a solution.
    fn upset(&mut self, random: &mut Random) {
        for (node, x) in self.nodes.iter_mut().zip(&mut self.x) {
            node.forecast = false;
            let share = self.upset * random.between(0.3, 1.0);
            *x = node.upset_state(random, share);
            node.cost = f64::INFINITY;
        }
    }

    /// The rest of what the runtime makes of loads, beside what this loop made of them.
    pub fn compare_loads(&mut self) {
        for node in self.nodes.iter().filter(|node| !node.unknowns.loads.is_empty()) {
            let history: Vec<_> = node.admitted.iter().map(|(d, _, _)| d.clone()).collect();
            let twin = runtime_twin::admitted(node.problem.N, node.unknowns, &node.first_d, &history);
            for ((_, push, kept), (other, within)) in node.admitted.iter().zip(twin) {
                self.tally.twins += 1;
                self.tally.at_most("the runtime's loads", (push - other).amax(), 1e-12 * push.amax(), push.amax());
                if *kept != within {
                    self.tally.violation("the runtime says otherwise of a load", 1.0);
                }
            }
        }
    }

    /// y = C x of all subsystems.
    pub fn outputs(&self) -> DVector<f64> {
        let parts = self.nodes.iter().zip(&self.x).map(|(node, x)| &node.problem.s.C * x);
        concat(&parts.collect::<Vec<_>>())
    }

    /// The newest yref of all subsystems.
    pub fn references(&self) -> DVector<f64> {
        concat(&self.nodes.iter().map(|node| node.newest_y().clone()).collect::<Vec<_>>())
    }

    fn aim(&mut self, mission: &Mission, random: &mut Random) {
        match mission {
            Mission::Constant(set_point) => self.set_point.clone_from(set_point),
            Mission::Jumps if self.step.is_multiple_of(25) => {
                let ends = self.design.sizing.subsystems.iter().flat_map(|s| s.Y.min.iter().zip(&s.Y.max));
                let set_point = ends.map(|(low, high)| random.between(2.0 * low, 2.0 * high)).collect::<Vec<_>>();
                self.set_point = DVector::from_vec(set_point);
            }
            Mission::Jumps => {}
            Mission::BangBang { subsystem, row } => self.set_point = self.worst_signs(*subsystem, *row) * 1e4,
        }
    }

    /// The same for the loads of all subsystems.
    fn worst_loads(&self, i: usize, row: usize) -> DVector<f64> {
        let d = self.over_chi(i, row);
        let (window, left) = (self.step / WINDOW, WINDOW - 1 - self.step % WINDOW);
        match window % 3 {
            0 => self.loads.wanted(&d, left),
            1 => -self.loads.wanted(&d, left),
            _ => self.loads.wanted_at_rest(&d),
        }
    }

    /// Row `row` of X_i and U_i over (x, e).
    fn over_chi(&self, i: usize, row: usize) -> DVector<f64> {
        let s = &self.design.network.subsystems[i];
        match row < s.X.H.nrows() {
            true => self.model.on_x(i, &s.X.H.row(row).into_owned()),
            false => self.model.on_u(i, &s.U.H.row(row - s.X.H.nrows()).into_owned()),
        }
    }

    /// The direction in which each output should move now for the row to be largest at the end of the window. Every other
    /// window drives the steady state instead.
    fn worst_signs(&self, i: usize, row: usize) -> DVector<f64> {
        let d = self.over_chi(i, row);
        let (window, left) = (self.step / WINDOW, WINDOW - 1 - self.step % WINDOW);
        if window % 3 == 2 {
            return self.rates.steady_direction(&d).map(f64::signum);
        }
        let mut later = d;
        (0..left).for_each(|_| later = self.model.calF().tr_mul(&later));
        let push = self.model.calG().tr_mul(&later) - self.rates.steady_direction(&later);
        push.map(|g| if window.is_multiple_of(3) { g.signum() } else { -g.signum() })
    }

    /// (33)-(36), (38).
    fn control(&mut self, i: usize) -> DVector<f64> {
        let compare = self.compare > 0 && self.tally.solved.is_multiple_of(self.compare);
        let node = &mut self.nodes[i];
        let deviation = &self.x[i] - &node.x_ref[0];
        let e = &deviation + &node.nuisance.v;
        let v = node.solve(&e, &mut self.tally, compare, self.trusted);
        let (s, g, sized) = (node.problem.s, node.problem.g, node.problem.sized);
        let dx = v.rows(0, s.n()).into_owned();
        let du = v.rows(s.n(), s.m()).into_owned();
        let off = &sized.E.P * (deviation - &dx);
        // The difference of two states is as exact as they are: E_i may be as small as 1e-8 where nothing disturbs.
        let exact = 1e-3 * (sized.E.P.abs() * (self.x[i].abs() + dx.abs())).amax();
        for (value, q) in off.iter().zip(&sized.E.q).filter(|_| node.is_sure(self.trusted)) {
            self.tally.at_most("(35a) x - xhat in E", value.abs(), *q, q.max(exact));
        }
        let feasible = off.iter().zip(&sized.E.q).zip(sized.E.P.row_iter()).filter(|_| node.feasible);
        for ((value, q), p) in feasible {
            let doubt = q + 2.0 * node.unknowns.reach_of_v(&p.transpose());
            self.tally.at_most("(35a') x - xhat in E up to twice the error", value.abs(), doubt, q.max(exact));
        }
        &node.u_ref[0] + du + &g.K * (e - dx)
    }

    /// Everything Theorem 1 promises about this step.
    fn check(&mut self, u: &[DVector<f64>]) {
        let (plant, tally) = (self.plant, &mut self.tally);
        for (i, node) in self.nodes.iter().enumerate() {
            let (s, sized) = (node.problem.s, node.problem.sized);
            node.check_references(tally);
            let sure = node.is_sure(self.trusted);
            tally.recovered += usize::from(sure && !self.trusted);
            tally.unsure += usize::from(!sure);
            if !sure {
                continue;
            }
            tally.at_most("X", plant.parts[i].X.violation(self.x[i].as_slice()), 0.0, 1.0);
            tally.at_most("U", plant.parts[i].U.violation(u[i].as_slice()), 0.0, 1.0);
            let off = &s.Cz * (&self.x[i] - &node.x_ref[0]) + &s.Dz * (&u[i] - &node.u_ref[0]);
            for (off, zeta) in off.iter().zip(&sized.zeta) {
                tally.at_most("(23) z - zref in Z", off.abs(), *zeta, *zeta);
            }
        }
        let y = self.outputs();
        let sure = self.nodes.iter().all(|node| node.is_sure(self.trusted));
        for (h, (row, l)) in plant.coupling.iter().enumerate() {
            if sure {
                self.tally.at_most("(3) coupling constraint", row.dot(&y), *l, *l);
            }
            if self.nodes.iter().any(Node::follows_plan) {
                continue;
            }
            let newest = self.references();
            let l_tilde = self.design.sizing.l_tilde[h];
            self.tally.at_most("(27) k_h", row.dot(&newest), l_tilde, *l);
        }
    }

    fn advance_plant(&mut self, u: &[DVector<f64>], random: &mut Random) {
        let mut next: Vec<DVector<f64>> = match self.neighbours {
            Neighbours::True => {
                let next = &self.plant.A * concat(&self.x) + &self.plant.B * concat(u);
                let cut = |part: &Part| next.rows(part.x.start, part.x.len()).into_owned();
                self.plant.parts.iter().map(cut).collect()
            }
            Neighbours::Adversarial => {
                self.turn_signs(random);
                (0..u.len()).map(|i| self.alone(i, &u[i])).collect()
            }
        };
        for (node, next) in self.nodes.iter().zip(&mut next) {
            *next += &node.nuisance.w + &node.unknowns.M * &node.inflow.d;
        }
        self.x = next;
    }

    /// Each importing subsystem's worst signs for one of its facets, for a while.
    fn turn_signs(&mut self, random: &mut Random) {
        let subsystems = &self.design.network.subsystems;
        if !self.step.is_multiple_of(7) {
            return;
        }
        let i = random.below(subsystems.len());
        let (s, sized) = (&subsystems[i], &self.design.sizing.subsystems[i]);
        let P = sized.E.P.row(random.below(sized.E.q.len()));
        for (&j, L) in &s.L {
            let towards = random.sign();
            self.signs[j] = (P * &s.E * L).transpose().map(|g| towards * if g < 0.0 { -1.0 } else { 1.0 });
        }
        if random.chance(0.3) {
            self.signs.iter_mut().for_each(|signs| signs.apply(|sign| *sign *= random.sign()));
        }
    }

    /// x+ of subsystem i where neighbour j's coupling output is off its reference by as much as Z_j allows.
    fn alone(&self, i: usize, u: &DVector<f64>) -> DVector<f64> {
        let s = &self.design.network.subsystems[i];
        let mut next = &s.A * &self.x[i] + &s.B * u;
        for (&j, L) in &s.L {
            let zeta = &self.design.sizing.subsystems[j].zeta;
            next += &s.E * L * (self.nodes[j].z_ref(0) + self.signs[j].component_mul(zeta));
        }
        next
    }

    /// (29)-(31), (28), then (7).
    fn advance_references(&mut self) {
        let newest = self.nodes[0].x_ref.len() - 1;
        let z: Vec<_> = self.nodes.iter().map(|node| node.z_ref(newest)).collect();
        let y: Vec<_> = self.nodes.iter().map(|node| node.newest_y().clone()).collect();
        for (i, node) in self.nodes.iter_mut().enumerate() {
            if let Some(plan) = node.plan.filter(|plan| node.newest + 1 < plan.x.len()) {
                node.replay(plan, &z);
                continue;
            }
            let limits = shares(self.design, i, &y);
            let part = &self.plant.parts[i].y;
            let wish = self.set_point.rows(part.start, part.len()).into_owned();
            let next = next_output(self.design, i, &y[i], &wish, &limits);
            node.advance(next, &z);
        }
    }
}

impl<'a> Node<'a> {
    /// At rest at the collective steady state chi, ordered (x_1, ..., x_M, e_1, ..., e_M).
    fn rest(
        design: &'a Design,
        plant: &'a Plant,
        i: usize,
        chi: &DVector<f64>,
        y: &DVector<f64>,
        inflow: Inflow,
    ) -> Self {
        let problem = Problem::new(design, i);
        let part = &plant.parts[i];
        let x = chi.rows(part.x.start, part.x.len()).into_owned();
        let e_ref = chi.rows(plant.A.nrows() + part.y.start, part.y.len()).into_owned();
        let u = &problem.g.Kx * &x + &problem.g.Ke * &e_ref;
        let y = y.rows(part.y.start, part.y.len()).into_owned();
        let N = problem.N;
        let (x_ref, u_ref, y_ref) = (vec![x; N], vec![u; N], vec![y; N]);
        Self { x_ref, u_ref, y_ref, e_ref, ..Self::new(problem, part, inflow) }
    }

    fn planned(design: &'a Design, plant: &'a Plant, i: usize, plan: &'a SubsystemPlan) -> Self {
        let problem = Problem::new(design, i);
        let (N, s, part) = (problem.N, problem.s, &plant.parts[i]);
        let (x_ref, u_ref) = (plan.x[..N].to_vec(), plan.u[..N].to_vec());
        let y_ref = x_ref.iter().map(|x| &s.C * x).collect();
        let inflow = Inflow::new(&part.unknowns, &mut Random(0));
        let e_ref = DVector::zeros(s.p());
        Self { x_ref, u_ref, y_ref, e_ref, plan: Some(plan), ..Self::new(problem, part, inflow) }
    }

    /// Without references yet.
    fn new(problem: Problem<'a>, part: &'a Part, inflow: Inflow) -> Self {
        let (n, N) = (problem.s.n(), problem.N);
        Self {
            unknowns: &part.unknowns,
            BK: &problem.s.B * &problem.g.K,
            adversary: Adversary::NEW,
            nuisance: Nuisance::none(n),
            d_ref: vec![inflow.d.clone(); N],
            first_d: inflow.d.clone(),
            inflow,
            admitted: Vec::new(),
            candidate: DVector::zeros(n + N * problem.s.m()),
            forecast: false,
            feasible: false,
            alone: false,
            x_ref: Vec::new(),
            u_ref: Vec::new(),
            y_ref: Vec::new(),
            e_ref: DVector::zeros(0),
            plan: None,
            newest: N - 1,
            warm: WorkingSet::EMPTY,
            cost: f64::INFINITY,
            problem,
        }
    }

    /// Whether the newest reference is still before the end of a plan.
    fn follows_plan(&self) -> bool {
        self.plan.is_some_and(|plan| self.newest + 1 < plan.x.len())
    }

    /// Whether x - xhat must be in E_i at this step: no assumption was ever broken, or the step alone shows it.
    fn is_sure(&self, trusted: bool) -> bool {
        trusted || self.alone
    }

    /// Whether the controller takes what it measures for the state.
    fn is_exact(&self) -> bool {
        self.problem.s.measurement_error.iter().all(|v| *v == 0.0)
    }

    /// w and v of the next step; `off` is x - xhat as far as it is forecast.
    fn choose(&mut self, off: &DVector<f64>, random: &mut Random) {
        if !self.unknowns.is_known() {
            let normals = &self.problem.sized.E.P;
            self.nuisance = self.adversary.choose(self.unknowns, normals, &self.BK, off, random);
        }
    }

    /// dref_{t+N-1}: d_t, confined to what the design assumes of it.
    fn admit(&mut self) {
        let (d, last) = (&self.inflow.d, &self.d_ref[self.d_ref.len() - 1]);
        let limits = self.unknowns.loads.iter();
        let confined = limits
            .enumerate()
            .map(|(k, load)| d[k].clamp(last[k] - load.rate, last[k] + load.rate).clamp(load.min, load.max));
        let newest = DVector::from_vec(confined.collect::<Vec<_>>());
        let push = &self.unknowns.M * &newest;
        shift(&mut self.d_ref, newest);
        let steps = self.problem.N - 1;
        let behind = d - &self.d_ref[0];
        let kept = behind
            .iter()
            .zip(&self.unknowns.loads)
            .all(|(behind, load)| behind.abs() <= load.change(steps) + 1e-9 * (load.max - load.min));
        self.admitted.push((d.clone(), push, kept));
    }

    /// Limits of (35a') on P (m - xhat), m - xref = e; whether the forecast was used and allows more than the measurement.
    fn tube(&self, e: &DVector<f64>) -> (Vec<(f64, f64)>, bool, bool) {
        let sized = self.problem.sized;
        let rows = sized.E.P.row_iter().zip(&sized.E.q);
        let rows: Vec<_> = rows.map(|(p, q)| (p.transpose(), *q, self.unknowns.reach_of_v(&p.transpose()))).collect();
        let apart = e - self.candidate.rows(0, e.len());
        let innovation: Vec<f64> = rows.iter().map(|(p, _, _)| p.dot(&apart)).collect();
        let credible = innovation.iter().zip(&rows).all(|(i, (_, q, noise))| i.abs() <= (q + noise) * (1.0 + 1e-9));
        let used = self.forecast && credible;
        let side = |((_, q, noise), i): (&(DVector<f64>, f64, f64), &f64)| {
            let (room, i) = (q - noise, if used { *i } else { 0.0 });
            (i.min(-room), i.max(room))
        };
        let limits: Vec<_> = rows.iter().zip(&innovation).map(side).collect();
        let wider = limits.iter().zip(&rows).any(|((low, high), (_, q, noise))| high.max(-low) > q - noise);
        (limits, used, wider)
    }

    /// The problem for the measured deviation e, and whether (35a') takes the forecast into account.
    fn instance(&self, e: &DVector<f64>) -> (Instance<NV>, bool, bool) {
        let (dpc, at) = (self.problem.dpc, self.at(e.clone()));
        let exact = Instance::new(dpc, &at);
        if self.is_exact() {
            return (exact, false, false);
        }
        let (limits, used, wider) = self.tube(e);
        let scaled = limits.iter().enumerate().map(|(r, (low, high))| {
            let scale = dpc.upper[r] / self.problem.sized.E.q[r];
            (low * scale, high * scale)
        });
        (exact.with_tube(dpc, &at, &scaled.collect::<Vec<_>>()), used, wider)
    }

    /// (35a') as the runtime makes it.
    fn compare_tube(&self, e: &DVector<f64>, instance: &Instance<NV>, tally: &mut Tally) {
        let dpc = self.problem.dpc;
        let dx = self.candidate.rows(0, e.len()).into_owned();
        let twin = runtime_twin::doubted(dpc, e, self.forecast.then_some(&dx));
        for ((low, high), row) in twin.into_iter().zip(instance.iter()) {
            tally.twins += 1;
            let scale = row.scale + row.lower.abs().max(row.upper.abs());
            let difference = (low - row.lower).abs().max((high - row.upper).abs());
            tally.at_most("the runtime's (35a')", difference, 1e-10 * scale, scale);
        }
    }

    /// (47).
    fn shifted(&self) -> DVector<f64> {
        let (s, n) = (self.problem.s, self.problem.s.n());
        let (m, N) = (s.m(), self.problem.N);
        let next = |dx: DVector<f64>, k: usize| &s.A * dx + &s.B * self.candidate.rows(n + k * m, m);
        let dx = self.candidate.rows(0, n).into_owned();
        let end = (0..N).fold(dx.clone(), next);
        let mut shifted = DVector::zeros(self.candidate.len());
        shifted.rows_mut(0, n).copy_from(&next(dx, 0));
        shifted.rows_mut(n, (N - 1) * m).copy_from(&self.candidate.rows(n + m, (N - 1) * m));
        shifted.rows_mut(n + (N - 1) * m, m).copy_from(&(&self.problem.g.K * end));
        shifted
    }

    fn at(&self, e: DVector<f64>) -> Parameters {
        Parameters { e, x_ref: self.x_ref.clone(), u_ref: self.u_ref.clone() }
    }

    /// A state whose measured deviation goes `share` of the way to the largest one, in a random direction, for which the
    /// problem has a solution by the measurement alone.
    fn upset_state(&self, random: &mut Random, share: f64) -> DVector<f64> {
        let direction = random.direction(self.problem.s.n());
        let far = farthest(|t| is_feasible(&self.instance(&(&direction * t)).0, self.problem.dpc.max_iterations));
        &self.x_ref[0] + direction * (far * 0.999 * share) - &self.nuisance.v
    }

    /// v of the optimum; checks that there is one, that the cost falls, and now and then what Clarabel says. Where there
    /// need not be one, the candidate stands in.
    fn solve(&mut self, e: &DVector<f64>, tally: &mut Tally, compare: bool, trusted: bool) -> DVector<f64> {
        let dpc = self.problem.dpc;
        let (instance, used, wider) = self.instance(e);
        if !self.is_exact() {
            self.compare_tube(e, &instance, tally);
            tally.forecasts += usize::from(wider);
            if trusted && self.forecast && !used {
                tally.violation("the forecast is refuted", 1.0);
            }
        }
        tally.steps += 1;
        let mut w = [0.0; NV];
        self.feasible = true;
        if instance.rests() {
            self.warm = WorkingSet::EMPTY;
        } else {
            let mut solver = Solver::<NV>::NEW;
            tally.solved += 1;
            match solver.solve(&instance, &self.warm, dpc.max_iterations) {
                Outcome::Optimal { iterations } => tally.most_iterations = tally.most_iterations.max(iterations),
                Outcome::Infeasible { .. } if !trusted => self.feasible = false,
                Outcome::Infeasible { .. } => tally.violation("(33) is infeasible", 1.0),
                Outcome::IterationLimit => tally.violation("iteration budget", 1.0),
            }
            w = *solver.w();
            self.warm = solver.working_set();
            let tube = self.problem.sized.E.q.len();
            tally.constrained += usize::from(self.warm.iter().any(|(row, _)| row >= tube));
            if compare && self.feasible {
                compare_with_clarabel(&instance, &w, tally);
            }
        }
        self.alone = self.feasible && !used;
        if self.feasible {
            self.candidate = &dpc.T * DVector::from_column_slice(&w[..dpc.T.nrows()]);
        }
        if trusted {
            self.check_cost(&w, tally);
        }
        self.candidate.clone()
    }

    /// The optimal cost falls at least by the stage cost; P_i's nine digits leave a little of it.
    fn check_cost(&mut self, w: &[f64; NV], tally: &mut Tally) {
        let cost = w.iter().map(|w| w * w).sum::<f64>();
        let noise = 1e-12 * self.problem.dpc.upper.iter().filter(|u| u.is_finite()).fold(0.0, |a: f64, u| a.max(u * u));
        if cost > self.cost * (1.0 + 1e-6) + noise {
            tally.violation("the optimal cost rises", cost / self.cost - 1.0);
        }
        self.cost = cost;
    }

    fn check_references(&self, tally: &mut Tally) {
        let Problem { s, sized, N, .. } = self.problem;
        let newest = N - 1;
        if self.follows_plan() {
            return;
        }
        let rows =
            [(&s.X.H, &self.x_ref[newest], &sized.x_ref, &s.X.h), (&s.U.H, &self.u_ref[newest], &sized.u_ref, &s.U.h)];
        for (H, at, limit, h) in rows {
            for ((value, limit), h) in (H * at).iter().zip(limit).zip(h) {
                tally.at_most("(25b) references", *value, *limit, *h);
            }
        }
        let y = &self.y_ref[newest];
        for k in 0..y.len() {
            let width = sized.Y.max[k] - sized.Y.min[k];
            tally.at_most("(31) yref in Y", (y[k] - sized.Y.max[k]).max(sized.Y.min[k] - y[k]), 0.0, width);
        }
    }

    fn newest_y(&self) -> &DVector<f64> {
        &self.y_ref[self.y_ref.len() - 1]
    }

    /// (7c).
    fn z_ref(&self, k: usize) -> DVector<f64> {
        &self.problem.s.Cz * &self.x_ref[k] + &self.problem.s.Dz * &self.u_ref[k]
    }

    /// (7a), (7b), (7f).
    fn advance(&mut self, y: DVector<f64>, z: &[DVector<f64>]) {
        let (s, g, newest) = (self.problem.s, self.problem.g, self.x_ref.len() - 1);
        let mut x = &s.A * &self.x_ref[newest] + &s.B * &self.u_ref[newest];
        s.L.iter().for_each(|(&j, L)| x += &s.E * L * &z[j]);
        x += &self.unknowns.M * &self.d_ref[newest];
        self.e_ref += &y - &s.C * &self.x_ref[newest];
        let u = &g.Kx * &x + &g.Ke * &self.e_ref;
        self.shift(x, u, y);
    }

    /// (7a) around the plan: calK acts on what the reference is off it.
    fn replay(&mut self, plan: &SubsystemPlan, z: &[DVector<f64>]) {
        let (s, g, newest, k) = (self.problem.s, self.problem.g, self.x_ref.len() - 1, self.newest + 1);
        let mut x = &s.A * &self.x_ref[newest] + &s.B * &self.u_ref[newest];
        s.L.iter().for_each(|(&j, L)| x += &s.E * L * &z[j]);
        self.e_ref -= &s.C * (&self.x_ref[newest] - &plan.x[k - 1]);
        let u = &plan.u[k] + &g.Kx * (&x - &plan.x[k]) + &g.Ke * &self.e_ref;
        if k + 1 == plan.x.len() {
            self.e_ref += &plan.e;
        }
        self.shift(x, u, &s.C * &plan.x[k]);
    }

    fn shift(&mut self, x: DVector<f64>, u: DVector<f64>, y: DVector<f64>) {
        self.newest += 1;
        shift(&mut self.x_ref, x);
        shift(&mut self.u_ref, u);
        shift(&mut self.y_ref, y);
    }
}

fn shift<T>(window: &mut Vec<T>, newest: T) {
    window.remove(0);
    window.push(newest);
}

fn compare_with_clarabel(instance: &Instance<NV>, w: &[f64; NV], tally: &mut Tally) {
    let w = DVector::from_column_slice(w);
    match instance.truth() {
        Truth::Minimiser(truth) => {
            tally.compared += 1;
            // A minimiser may be 0 up to what either method counts as a violation, 1e-12 of the limits.
            let size = truth.norm().max(1e-4 * instance.scale());
            tally.difference = tally.difference.max((&truth - &w).norm() / size);
        }
        Truth::Infeasible => tally.violation("Clarabel calls (33) infeasible", 1.0),
        Truth::Unknown => {}
    }
}

/// How far e may go in a direction before the problem loses its solution; at most a million.
pub fn edge(problem: &Problem, direction: &DVector<f64>, at: &Parameters) -> f64 {
    let feasible = |t: f64| {
        let instance = Instance::new(problem.dpc, &Parameters { e: direction * t, ..at.clone() });
        is_feasible(&instance, problem.dpc.max_iterations)
    };
    farthest(feasible)
}

fn is_feasible(instance: &Instance<NV>, budget: usize) -> bool {
    let mut solver = Solver::<NV>::NEW;
    instance.rests() || matches!(solver.solve(instance, &WorkingSet::EMPTY, budget), Outcome::Optimal { .. })
}

/// Largest t for which `feasible` holds, as it does at 0; at most a million.
fn farthest(feasible: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, 1e-3);
    while feasible(high) && high < 1e6 {
        (low, high) = (high, 4.0 * high);
    }
    for _ in 0..45 {
        let middle = 0.5 * (low + high);
        *(if feasible(middle) { &mut low } else { &mut high }) = middle;
    }
    low
}

/// An output in the product of the Y_i, often in a corner, that obeys (28).
fn steady_output(design: &Design, random: &mut Random) -> DVector<f64> {
    let corner = random.chance(0.5);
    let ends = design.sizing.subsystems.iter().flat_map(|s| s.Y.min.iter().zip(&s.Y.max));
    let inside = |(low, high): (&f64, &f64)| match corner {
        true => *(if random.chance(0.5) { low } else { high }),
        false => random.between(*low, *high),
    };
    let mut y = DVector::from_vec(ends.map(inside).collect());
    let rows = coupling_rows(&design.network);
    for (row, l_tilde) in rows.iter().zip(&design.sizing.l_tilde) {
        let k = row.dot(&y);
        y *= if k > *l_tilde { l_tilde / k * (1.0 - 1e-12) } else { 1.0 };
    }
    y
}

/// (3) over the collective y.
fn coupling_rows(network: &Network) -> Vec<DVector<f64>> {
    let row = |c: &dpc_codegen::network::CouplingConstraint| {
        let parts = network.subsystems.iter().enumerate();
        concat(&parts.map(|(j, s)| c.H.get(&j).cloned().unwrap_or(DVector::zeros(s.p()))).collect::<Vec<_>>())
    };
    network.coupling_constraints.iter().map(row).collect()
}

/// Right-hand sides of (28) for subsystem i, with the rows they belong to.
fn shares(design: &Design, i: usize, y: &[DVector<f64>]) -> Vec<(DVector<f64>, f64)> {
    let constraints = design.network.coupling_constraints.iter().zip(&design.sizing.l_tilde);
    let share = |(c, l_tilde): (&dpc_codegen::network::CouplingConstraint, &f64)| {
        let own = c.H.get(&i)?;
        let n_h = c.H.len() as f64;
        let others: f64 = c.H.iter().filter(|(j, _)| **j != i).map(|(j, H)| H.dot(&y[*j])).sum();
        let k_h = others + own.dot(&y[i]);
        Some((own.clone(), l_tilde - others - (n_h - 1.0) / n_h * (l_tilde - k_h)))
    };
    constraints.filter_map(share).collect()
}

/// (29)-(31), (28), solved by trying every set of active rows.
fn next_output(
    design: &Design,
    i: usize,
    y: &DVector<f64>,
    wish: &DVector<f64>,
    limits: &[(DVector<f64>, f64)],
) -> DVector<f64> {
    let (s, sized, reference) =
        (&design.network.subsystems[i], &design.sizing.subsystems[i], &design.network.reference);
    let p = s.p();
    let epsilon = design.sizing.epsilon;
    let mut rows: Vec<(DVector<f64>, f64)> = Vec::new();
    for k in 0..p {
        let axis = DVector::from_fn(p, |j, _| f64::from(j == k));
        rows.push((axis.clone(), sized.Y.max[k] - y[k]));
        rows.push((-&axis, y[k] - sized.Y.min[k]));
    }
    rows.extend(limits.iter().map(|(row, limit)| (row.clone(), limit - row.dot(y))));
    rows.extend(rate_rows(reference.norm, p).into_iter().map(|row| (row, epsilon)));
    rows.iter_mut().for_each(|(_, room)| *room = room.max(0.0));
    let towards = |damping: f64| {
        let M = &s.T + DMatrix::identity(p, p) * (reference.gamma + damping);
        nearest(&M, &(&s.T * (wish - y)), &rows)
    };
    let mut step = towards(0.0);
    if reference.norm == Norm::Two && step.norm() > epsilon {
        step = on_ball(towards, epsilon, (&s.T * (wish - y)).norm() / epsilon);
    }
    y + trimmed(step, &rows)
}

/// Rows of the unit ball of (6), but for the round one.
fn rate_rows(norm: Norm, p: usize) -> Vec<DVector<f64>> {
    let signs = |r: usize| DVector::from_fn(p, |k, _| if r >> k & 1 == 0 { 1.0 } else { -1.0 });
    let axis = |r: usize| DVector::from_fn(p, |k, _| f64::from(r == 2 * k) - f64::from(r == 2 * k + 1));
    match norm {
        Norm::One => (0..1 << p).map(signs).collect(),
        Norm::Two => Vec::new(),
        Norm::Inf => (0..2 * p).map(axis).collect(),
    }
}

/// The d that minimises 1/2 d'Md - g'd over {row d <= room}, p at most 2: of all candidates with up to p active rows the
/// best feasible one; d = 0 is feasible.
fn nearest(M: &DMatrix<f64>, g: &DVector<f64>, rows: &[(DVector<f64>, f64)]) -> DVector<f64> {
    let p = g.len();
    let mut sets: Vec<Vec<usize>> = vec![vec![]];
    sets.extend((0..rows.len()).map(|a| vec![a]));
    if p > 1 {
        sets.extend((0..rows.len()).flat_map(|a| (0..a).map(move |b| vec![a, b])));
    }
    let cost = |d: &DVector<f64>| 0.5 * d.dot(&(M * d)) - g.dot(d);
    // A row without room is met to the rounding of the others, which [`trimmed`] removes.
    let rounding = 1e-12 * rows.iter().fold(0.0, |most: f64, (_, room)| most.max(*room));
    let inside = |d: &DVector<f64>| rows.iter().all(|(row, room)| row.dot(d) <= room + rounding);
    let candidates = sets.iter().filter_map(|set| stationary(M, g, set, rows)).filter(inside);
    candidates.min_by(|a, b| cost(a).total_cmp(&cost(b))).unwrap_or_else(|| DVector::zeros(p))
}

/// The minimiser with the rows of `set` held with equality.
fn stationary(M: &DMatrix<f64>, g: &DVector<f64>, set: &[usize], rows: &[(DVector<f64>, f64)]) -> Option<DVector<f64>> {
    let (p, a) = (g.len(), set.len());
    let mut kkt = DMatrix::zeros(p + a, p + a);
    kkt.view_mut((0, 0), (p, p)).copy_from(M);
    let mut right = DVector::zeros(p + a);
    right.rows_mut(0, p).copy_from(g);
    for (k, &r) in set.iter().enumerate() {
        kkt.view_mut((p + k, 0), (1, p)).copy_from(&rows[r].0.transpose());
        kkt.view_mut((0, p + k), (p, 1)).copy_from(&rows[r].0);
        right[p + k] = rows[r].1;
    }
    let solution = kkt.full_piv_lu().solve(&right)?;
    solution.iter().all(|v| v.is_finite()).then(|| solution.rows(0, p).into_owned())
}

/// The step on the round ball, by bisection of its multiplier.
fn on_ball(towards: impl Fn(f64) -> DVector<f64>, epsilon: f64, most: f64) -> DVector<f64> {
    let (mut low, mut high) = (0.0, most);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        *(if towards(middle).norm() > epsilon { &mut low } else { &mut high }) = middle;
    }
    let step = towards(high);
    let length = step.norm();
    if length > epsilon { step * (epsilon / length) } else { step }
}

/// The step without what it exceeds a room by: rounding. Shortening it instead could keep it at 0 for ever.
fn trimmed(mut step: DVector<f64>, rows: &[(DVector<f64>, f64)]) -> DVector<f64> {
    for (row, room) in rows.iter().chain(rows) {
        let excess = row.dot(&step) - room;
        if excess > 0.0 {
            step -= row * (excess / row.norm_squared());
        }
    }
    step
}

fn concat(parts: &[DVector<f64>]) -> DVector<f64> {
    DVector::from_iterator(
        parts.iter().map(|part| part.len()).sum(),
        parts.iter().flat_map(|part| part.iter().copied()),
    )
}

/// The nearest point of Y to a set-point in the norm of T, (39), for every subsystem.
pub fn nearest_feasible(design: &Design, set_point: &DVector<f64>) -> DVector<f64> {
    let mut start = 0;
    let mut all = Vec::new();
    for (s, sized) in design.network.subsystems.iter().zip(&design.sizing.subsystems) {
        let wish = set_point.rows(start, s.p()).into_owned();
        start += s.p();
        let mut rows = Vec::new();
        for k in 0..s.p() {
            let axis = DVector::from_fn(s.p(), |j, _| f64::from(j == k));
            rows.push((axis.clone(), sized.Y.max[k]));
            rows.push((-axis, -sized.Y.min[k]));
        }
        all.push(nearest(&s.T, &(&s.T * wish), &rows));
    }
    concat(&all)
}
