//! The network-wide program: a plan over a window as the solution of a quadratic program, or the nearest start that has one as
//! that of a linear program.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::MARGIN;
use super::limits::{Limits, Own};
use crate::design::Design;
use crate::network::{Network, Start, Subsystem};
use crate::optim::conic::Form;
use crate::optim::quadratic::{Answer, Point, QuadraticProgram};

/// What to look for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Goal {
    /// A plan that moves little and leaves the reference as little as it can.
    Plan(Latitude),
    /// The plan that keeps the largest margin in all rows, which may be negative: then there is none.
    Margin(Latitude),
    /// The start nearest to the stated one, in the largest move of a state relative to its range.
    Nearest,
}

/// How far the start may be off the plan's reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Latitude {
    /// 2 (x_0 - xref_0) in E_i: half of it is left for what is measured then.
    HalfTube,
    /// x_0 - xref_0 in E_i: xhat is the reference.
    InTube,
    /// As the first i-DPC problem admits.
    Free,
}

/// What the solver suggests for one subsystem, in coordinates around the rest under the loads of the start.
pub struct Part {
    pub x: Vec<DVector<f64>>,
    pub u: Vec<DVector<f64>>,
    pub e: DVector<f64>,
    /// x_0 - xref_0 - dx_0.
    pub off: DVector<f64>,
    pub dx: DVector<f64>,
    pub du: Vec<DVector<f64>>,
}

pub enum Found {
    Draft(Vec<Part>),
    /// No plan over this window.
    Nothing,
    Failed(String),
}

/// The nearest start.
pub struct NearestFound {
    pub x0: Vec<DVector<f64>>,
    /// No start is nearer: the largest move of a state that is needed, as a share of its range.
    pub bound: f64,
    /// The rows that stop nearer ones, the weightiest first.
    pub rows: Vec<String>,
}

/// The variables of one subsystem.
struct Variables {
    x: Vec<Range<usize>>,
    u: Vec<Range<usize>>,
    e: Range<usize>,
    off: Range<usize>,
    dx: Vec<Range<usize>>,
    du: Vec<Range<usize>>,
    x0: Range<usize>,
}

/// What an inequality is about.
#[derive(Debug, Clone, Copy)]
enum Reason {
    Tube,
    State { row: usize, step: usize },
    Input { row: usize, step: usize },
    CouplingOutput { k: usize, step: usize },
    Terminal,
    Output(usize),
    Coupling { h: usize, step: usize },
    Measure,
}

pub struct Program<'a> {
    design: &'a Design,
    limits: &'a Limits,
    start: &'a Start,
    steps: usize,
    goal: Goal,
    program: QuadraticProgram,
    variables: Vec<Variables>,
    /// The margin that [`Goal::Margin`] maximises, relative to the bounds the rows come from.
    margin: Option<usize>,
    /// Per inequality: subsystem and reason.
    reasons: Vec<(usize, Reason)>,
}

/// How much more starting off the reference, and deviating from it, costs than moving.
const OFF: f64 = 1e2;
/// The linear program's margins, relative to those of the plan that is made from its solution.
const NEAREST_MARGIN: f64 = 4.0;
/// Margins larger than this are not asked for.
const AMPLE: f64 = 0.01;
/// Weight of a reference's state beside that of its input.
const STATE: f64 = 0.01;
/// Weight of the sum of all moves beside the largest.
const ALL_MOVES: f64 = 1e-3;
/// Rows worth less than this share of the weightiest are not named.
const WORTH_NAMING: f64 = 1e-2;
const NAMED: usize = 3;

impl<'a> Program<'a> {
    pub fn new(design: &'a Design, limits: &'a Limits, start: &'a Start, steps: usize, goal: Goal) -> Self {
        let mut program = QuadraticProgram::default();
        let N = design.network.horizon;
        let subsystems = design.network.subsystems.iter().zip(&limits.subsystems);
        let variables = subsystems.map(|(s, own)| Variables::new(s, own, N, steps, goal, &mut program)).collect();
        let margin = matches!(goal, Goal::Margin(_)).then(|| program.variable(1.0, 0.0));
        let mut whole = Self { design, limits, start, steps, goal, program, variables, margin, reasons: Vec::new() };
        for i in 0..limits.subsystems.len() {
            whole.start(i);
            whole.motion(i);
            whole.rest(i);
            whole.first_problem(i);
            whole.references(i);
            whole.latitude(i);
        }
        whole.coupling();
        match (goal, margin) {
            (Goal::Nearest, _) => whole.distance(),
            (_, Some(margin)) => {
                whole.program.linear.push((margin, -1.0));
                whole.measure(0, vec![(margin, -1.0)], AMPLE);
            }
            _ => {}
        }
        whole
    }

    pub fn solve(&self) -> Found {
        match self.program.solve() {
            Answer::Point(point) if self.margin.is_some_and(|margin| point.x[margin] < MARGIN) => Found::Nothing,
            Answer::Point(point) => Found::Draft(self.variables.iter().map(|v| v.part(&point.x)).collect()),
            Answer::Infeasible => Found::Nothing,
            Answer::Failed(why) => Found::Failed(why),
        }
    }

    pub fn nearest(&self) -> Option<NearestFound> {
        let Answer::Point(point) = self.program.solve() else { return None };
        let rests = self.variables.iter().zip(&self.limits.subsystems);
        let x0 = rests.map(|(v, own)| taken(&point.x, &v.x0) + &own.x).collect();
        Some(NearestFound { x0, bound: point.bound / (1.0 + ALL_MOVES), rows: self.stopping(&point) })
    }

    fn stopping(&self, point: &Point) -> Vec<String> {
        let mut rows: Vec<Stopping> = Vec::new();
        for ((i, reason), worth) in self.reasons.iter().zip(&point.multipliers) {
            let Some((name, step)) = reason.name(&self.design.network, *i) else { continue };
            match rows.iter_mut().find(|known| known.name == name) {
                Some(known) => known.add(*worth, step),
                None => rows.push(Stopping { name, step, most: *worth, worth: *worth }),
            }
        }
        rows.sort_by(|a, b| b.worth.total_cmp(&a.worth));
        let most = rows.first().map_or(0.0, |row| row.worth);
        rows.iter().filter(|row| row.worth > WORTH_NAMING * most).take(NAMED).map(Stopping::words).collect()
    }

    fn own(&self, i: usize) -> (&'a Subsystem, &'a Own) {
        (&self.design.network.subsystems[i], &self.limits.subsystems[i])
    }

    /// x_0 = xref_0 + dx_0 + (x_0 - xhat_0).
    fn start(&mut self, i: usize) {
        let (s, own) = self.own(i);
        let v = &self.variables[i];
        let wanted = &self.start.x0[i] - &own.x;
        for k in 0..s.n() {
            let parts = [v.x[0].start + k, v.dx[0].start + k, v.off.start + k];
            let mut terms: Vec<_> = parts.iter().map(|part| (*part, 1.0)).collect();
            let mut constant = 0.0;
            match self.goal {
                Goal::Plan(_) | Goal::Margin(_) => constant = -wanted[k],
                Goal::Nearest => terms.push((v.x0.start + k, -1.0)),
            }
            self.program.zero(terms, constant);
        }
    }

    /// (7a) with the planned sref, and the deviations' own motion.
    fn motion(&mut self, i: usize) {
        let (s, _) = self.own(i);
        for t in 0..self.steps {
            for k in 0..s.n() {
                let mut terms = vec![(self.variables[i].x[t + 1].start + k, -1.0)];
                terms.extend(self.successor(i, k, t, &self.variables[i].u[t]));
                self.program.zero(terms, 0.0);
            }
        }
        let v = &self.variables[i];
        for (t, du) in v.du.iter().enumerate() {
            for k in 0..s.n() {
                let mut terms = vec![(v.dx[t + 1].start + k, -1.0)];
                terms.extend(row(&s.A, k, &v.dx[t]).chain(row(&s.B, k, du)));
                self.program.zero(terms, 0.0);
            }
        }
    }

    /// Entry k of A_ii x + B_ii u + E_i sum of L_ij z_j at step t; `u` are the inputs' variables.
    fn successor(&self, i: usize, k: usize, t: usize, u: &Range<usize>) -> Vec<(usize, f64)> {
        let (s, v) = (&self.design.network.subsystems[i], &self.variables[i]);
        let mut terms: Vec<_> = row(&s.A, k, &v.x[t]).chain(row(&s.B, k, u)).collect();
        for (&j, L) in &s.L {
            let (other, its) = (&self.design.network.subsystems[j], &self.variables[j]);
            let gain = s.E.row(k) * L;
            let (on_x, on_u) = (&gain * &other.Cz, &gain * &other.Dz);
            terms.extend(places(on_x.iter(), &its.x[t]).chain(places(on_u.iter(), &its.u[t])));
        }
        terms
    }

    /// At T nothing moves, the input is that of (7f), and the output lies in Y_i.
    fn rest(&mut self, i: usize) {
        let (s, _) = self.own(i);
        let (g, sized) = (&self.design.gains.subsystems[i], &self.design.sizing.subsystems[i]);
        let (end, input) = (self.variables[i].x[self.steps].clone(), self.variables[i].u[self.steps].clone());
        for k in 0..s.n() {
            let mut terms = vec![(end.start + k, -1.0)];
            terms.extend(self.successor(i, k, self.steps, &input));
            self.program.zero(terms, 0.0);
        }
        for k in 0..s.m() {
            let mut terms = vec![(input.start + k, -1.0)];
            terms.extend(row(&g.Kx, k, &end).chain(row(&g.Ke, k, &self.variables[i].e)));
            self.program.zero(terms, 0.0);
        }
        for k in 0..s.p() {
            let (low, high) = (sized.Y.min[k], sized.Y.max[k]);
            let margin = MARGIN * (high - low);
            let y: Vec<_> = row(&s.C, k, &end).collect();
            self.at_most(i, y.clone(), high, margin, Reason::Output(k));
            self.at_most(i, negated(y), -low, margin, Reason::Output(k));
        }
    }

    /// (35), (36) of step 0.
    fn first_problem(&mut self, i: usize) {
        let (s, own) = self.own(i);
        let sized = &self.design.sizing.subsystems[i];
        for r in 0..own.tube.len() {
            let terms = row(&sized.E.P, r, &self.variables[i].off).collect();
            let half = matches!(self.goal, Goal::Plan(Latitude::HalfTube) | Goal::Margin(Latitude::HalfTube));
            self.between(i, terms, own.tube[r] * if half { 0.5 } else { 1.0 }, Reason::Tube);
        }
        for t in 0..self.variables[i].du.len() {
            let v = &self.variables[i];
            let (x, dx, u, du) = (v.x[t].clone(), v.dx[t].clone(), v.u[t].clone(), v.du[t].clone());
            for r in 0..s.X.h.len() {
                let both = row(&s.X.H, r, &x).chain(row(&s.X.H, r, &dx)).collect();
                let reason = Reason::State { row: r, step: t };
                self.at_most(i, both, own.nominal[0][r], MARGIN * s.X.h[r], reason);
                self.at_most(i, row(&s.X.H, r, &x).collect(), own.first[0][r], MARGIN * s.X.h[r], reason);
            }
            for r in 0..s.U.h.len() {
                let both = row(&s.U.H, r, &u).chain(row(&s.U.H, r, &du)).collect();
                let reason = Reason::Input { row: r, step: t };
                self.at_most(i, both, own.nominal[1][r], MARGIN * s.U.h[r], reason);
                self.at_most(i, row(&s.U.H, r, &u).collect(), own.first[1][r], MARGIN * s.U.h[r], reason);
            }
            for k in 0..s.nz() {
                let terms = row(&s.Cz, k, &dx).chain(row(&s.Dz, k, &du)).collect();
                self.between(i, terms, sized.dz[k] * (1.0 - MARGIN), Reason::CouplingOutput { k, step: t });
            }
        }
        let last = self.variables[i].dx[self.variables[i].du.len()].clone();
        for r in 0..sized.Sigma.q.len() {
            let terms = row(&sized.Sigma.P, r, &last).collect();
            self.between(i, terms, sized.Sigma.q[r] * (1.0 - MARGIN), Reason::Terminal);
        }
    }

    /// No deviations dx, du, where xhat is to be the reference.
    fn latitude(&mut self, i: usize) {
        let (Goal::Plan(latitude) | Goal::Margin(latitude)) = self.goal else { return };
        let v = &self.variables[i];
        let deviations = v.dx[0].clone().chain(v.du.iter().cloned().flatten());
        let deviations = deviations.filter(|_| latitude < Latitude::Free);
        for variable in deviations {
            self.program.zeros.push(Form::new([(variable, 1.0)], 0.0));
        }
    }

    /// The margins of (25b) from N to T - 1.
    fn references(&mut self, i: usize) {
        let (s, own) = self.own(i);
        for t in self.design.network.horizon..self.steps {
            let (x, u) = (self.variables[i].x[t].clone(), self.variables[i].u[t].clone());
            for r in 0..s.X.h.len() {
                let reason = Reason::State { row: r, step: t };
                self.at_most(i, row(&s.X.H, r, &x).collect(), own.later[0][r], MARGIN * s.X.h[r], reason);
            }
            for r in 0..s.U.h.len() {
                let reason = Reason::Input { row: r, step: t };
                self.at_most(i, row(&s.U.H, r, &u).collect(), own.later[1][r], MARGIN * s.U.h[r], reason);
            }
        }
    }

    /// (26), (27).
    fn coupling(&mut self) {
        let (N, network) = (self.design.network.horizon, &self.design.network);
        for (h, c) in network.coupling_constraints.iter().enumerate() {
            for t in 0..=self.steps {
                let [first, later, end] = self.limits.coupling[h];
                let limit = if t == self.steps {
                    end
                } else if t < N {
                    first
                } else {
                    later
                };
                let mut terms = Vec::new();
                for (&j, H) in &c.H {
                    let on_x = network.subsystems[j].C.tr_mul(H);
                    terms.extend(places(on_x.iter(), &self.variables[j].x[t]));
                }
                let first_member = *c.H.keys().next().unwrap_or(&0);
                self.at_most(first_member, terms, limit, MARGIN * c.l, Reason::Coupling { h, step: t });
            }
        }
    }

    /// Minimise the largest |x_0 - wanted| relative to the ranges, and a little of their sum.
    fn distance(&mut self) {
        let largest = self.program.variable(1.0, 0.0);
        self.program.linear.push((largest, 1.0));
        let states: usize = self.variables.iter().map(|v| v.x0.len()).sum();
        for i in 0..self.variables.len() {
            let (s, own) = self.own(i);
            let wanted = &self.start.x0[i] - &own.x;
            for k in 0..s.n() {
                let (x0, range) = (self.variables[i].x0.start + k, own.range[k]);
                let moved = self.program.variable(1.0, 0.0);
                self.program.linear.push((moved, ALL_MOVES / states as f64));
                for sign in [1.0, -1.0] {
                    self.measure(i, vec![(moved, 1.0), (x0, -sign / range)], sign * wanted[k] / range);
                }
                self.measure(i, vec![(largest, 1.0), (moved, -1.0)], 0.0);
            }
        }
    }

    fn measure(&mut self, i: usize, terms: Vec<(usize, f64)>, constant: f64) {
        self.program.inequalities.push(Form::new(terms, constant));
        self.reasons.push((i, Reason::Measure));
    }

    fn between(&mut self, i: usize, terms: Vec<(usize, f64)>, limit: f64, reason: Reason) {
        self.at_most(i, terms.clone(), limit, MARGIN * limit, reason);
        self.at_most(i, negated(terms), limit, MARGIN * limit, reason);
    }

    /// terms <= limit, with a margin that grows where the solution is to be rounded and planned from again.
    fn at_most(&mut self, i: usize, terms: Vec<(usize, f64)>, limit: f64, margin: f64, reason: Reason) {
        if limit.is_infinite() || terms.is_empty() {
            return;
        }
        let kept = if self.goal == Goal::Nearest { NEAREST_MARGIN * margin.abs() } else { margin.abs() };
        let mut form = Form::new(negated(terms), limit - kept);
        if let Some(variable) = self.margin {
            form.terms.push((variable, -margin.abs() / MARGIN));
            form.constant = limit;
        }
        self.program.inequalities.push(form);
        self.reasons.push((i, reason));
    }
}

impl Variables {
    fn new(s: &Subsystem, own: &Own, N: usize, steps: usize, goal: Goal, program: &mut QuadraticProgram) -> Self {
        let weighted = |weight: f64| if matches!(goal, Goal::Plan(_)) { weight } else { 0.0 };
        let mut take = |units: &DVector<f64>, square: f64| {
            let first = program.units.len();
            for unit in units.iter() {
                program.variable(*unit, weighted(square));
            }
            first..first + units.len()
        };
        Self {
            x: (0..=steps).map(|_| take(&own.x_unit, STATE)).collect(),
            u: (0..=steps).map(|_| take(&own.u_unit, 1.0)).collect(),
            e: take(&own.e_unit, 0.0),
            off: take(&own.off_unit, OFF),
            dx: (0..=N).map(|_| take(&own.dx_unit, OFF)).collect(),
            du: (0..N).map(|_| take(&own.u_unit, OFF)).collect(),
            x0: if goal == Goal::Nearest { take(&own.x_unit, 0.0) } else { 0..s.n() },
        }
    }

    fn part(&self, point: &[f64]) -> Part {
        let all = |ranges: &[Range<usize>]| ranges.iter().map(|range| taken(point, range)).collect();
        let (e, off, dx) = (taken(point, &self.e), taken(point, &self.off), taken(point, &self.dx[0]));
        Part { x: all(&self.x), u: all(&self.u), e, off, dx, du: all(&self.du) }
    }
}

/// A row that stops nearer starts, with the step at which it weighs most.
struct Stopping {
    name: String,
    step: Option<usize>,
    most: f64,
    worth: f64,
}

impl Stopping {
    fn add(&mut self, worth: f64, step: Option<usize>) {
        self.worth += worth;
        if worth > self.most {
            (self.most, self.step) = (worth, step);
        }
    }

    fn words(&self) -> String {
        self.step.map_or_else(|| self.name.clone(), |step| format!("{} at step {step}", self.name))
    }
}

impl Reason {
    /// In the user's words, and the step; `None` for what only measures the distance.
    fn name(self, network: &Network, i: usize) -> Option<(String, Option<usize>)> {
        let s = &network.subsystems[i];
        let of = |what: &str| format!("{what} of `{}`", s.name);
        Some(match self {
            Self::Measure => return None,
            Self::Tube => (of("the tube E (35a)"), None),
            Self::State { row, step } => (of(&format!("`{}`", s.X.rows[row])), Some(step)),
            Self::Input { row, step } => (of(&format!("`{}`", s.U.rows[row])), Some(step)),
            Self::CouplingOutput { k, step } => {
                (of(&format!("the reserve Delta^z of `{}`", s.coupling_outputs[k])), Some(step))
            }
            Self::Terminal => (of("the terminal set (36)"), None),
            Self::Output(k) => (of(&format!("the set-points Y of `{}`", s.outputs[k].name)), None),
            Self::Coupling { h, step } => {
                (format!("coupling constraint `{}`", network.coupling_constraints[h].name), Some(step))
            }
        })
    }
}

fn taken(point: &[f64], range: &Range<usize>) -> DVector<f64> {
    DVector::from_column_slice(&point[range.clone()])
}

fn row<'m>(
    matrix: &'m DMatrix<f64>,
    r: usize,
    variables: &Range<usize>,
) -> impl Iterator<Item = (usize, f64)> + use<'m> {
    let variables = variables.clone();
    (0..matrix.ncols()).map(move |c| (variables.start + c, matrix[(r, c)])).filter(|(_, a)| *a != 0.0)
}

fn places<'m>(
    coefficients: impl Iterator<Item = &'m f64>,
    variables: &Range<usize>,
) -> impl Iterator<Item = (usize, f64)> {
    let places = variables.clone().zip(coefficients.copied()).filter(|(_, a)| *a != 0.0);
    places.collect::<Vec<_>>().into_iter()
}

fn negated(mut terms: Vec<(usize, f64)>) -> Vec<(usize, f64)> {
    terms.iter_mut().for_each(|(_, a)| *a = -*a);
    terms
}
