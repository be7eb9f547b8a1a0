//! The program itself: variables, inequalities, objective.

use std::ops::Range;

use nalgebra::DVector;

use super::{Context, Proofs};
use crate::convex::Multiplier;
use crate::network::{ExposedOutput, Subsystem};
use crate::optim::conic::{Answer, LogProgram};
use crate::sets::{CAP, OutputShare, ReferenceShare, floor_support, import_gain, least_offsets};

/// What is asked of the program beyond the network's wishes.
#[derive(Debug, Clone, Default)]
pub struct Asks {
    /// Epsilon, instead of the network's.
    pub epsilon: Option<f64>,
    /// Delta_i^z, fixed.
    pub dz: Option<Vec<DVector<f64>>>,
    /// The wanted reserve, instead of the network's.
    pub reserve: Option<Vec<DVector<f64>>>,
    /// Replace the logarithms by one linear goal.
    pub goal: Goal,
}

/// What to maximise.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Goal {
    /// The weighted logarithms of the network's wishes.
    #[default]
    Wishes,
    /// A common factor (at most 1) on disturbances, measurement errors and loads; epsilon is free, reserve and cover are dropped.
    Disturbance,
    /// The same logarithms without those of Y_i and Delta_i^z: the largest epsilon that leaves cover and reserve.
    Speed,
    /// Epsilon; reserve, cover and margins are dropped.
    Epsilon,
    /// Margins: one less than this (at most 1) is the common share by which they are exceeded. Reserve and cover are dropped.
    Margin,
    /// A common factor (at most 1) on the wanted reserve; cover is dropped.
    Reserve,
    /// A common factor (at most 1) on the set-points to cover.
    Cover,
    /// A common factor (at most 1) on reserve and cover.
    All,
}

/// The variables of one subsystem.
#[derive(Debug, Clone)]
struct Variables {
    zeta: Range<usize>,
    dz: Range<usize>,
    q: Range<usize>,
    sigma: Range<usize>,
    upset: Range<usize>,
    /// max of Y_i, and -min of Y_i (the same where Y_i is to be symmetric).
    y_max: Range<usize>,
    y_min: Range<usize>,
}

pub struct Program {
    pub proofs: Vec<Proofs>,
    problem: LogProgram,
    variables: Vec<Variables>,
    /// Ends of Y_i, (max, -min), by entry of the collective y.
    ends: Vec<(usize, usize)>,
    epsilon: Epsilon,
    /// The factor that the goals `Disturbance`, `Reserve`, `Cover` and `All` maximise.
    factor: Option<usize>,
    goal: Goal,
    /// Per (25b) row: subsystem, name, index of its inequality.
    pub rows: Vec<(usize, String, usize)>,
}

/// What takes room of one row of X_i x U_i, (25b).
struct Taken<'a> {
    share: &'a ReferenceShare,
    tube: &'a Multiplier,
    terminal: &'a Multiplier,
    /// Support of K_i V, and rounding.
    noise: f64,
}

#[derive(Debug, Clone, Copy)]
enum Epsilon {
    Given(f64),
    Free(usize),
}

/// What inequalities keep back, relative to their right side, so that the solver's tolerance and the rounding of the
/// results stay inside.
pub const MARGIN: f64 = 1e-6;
/// Extra disturbance the tubes are made for, relative: it pays for the rounding of their offsets. The program takes
/// twice as much, so that what is settled from it fits.
pub const TUBE_MARGIN: f64 = 1e-6;
/// Extra room for rounding, relative: what is settled from the program fits.
pub const ROUNDING_MARGIN: f64 = 1e-3;
/// Smallest half-width of Delta_i^z and half-axis of Sigma_i, relative to the signal's natural size: they keep the sets
/// solid.
const LEAST: f64 = 1e-7;
/// Delta^z of an output in changing constraints, as a share of what moving references take of it.
const SHARE_OF_RESERVE: f64 = 0.1;

impl Program {
    pub fn new(context: &Context, proofs: Vec<Proofs>, asks: &Asks) -> Self {
        let mut problem = LogProgram::default();
        let variables = context.network.subsystems.iter().enumerate();
        let variables: Vec<_> = variables.map(|(i, _)| Variables::new(context, i, &proofs[i], &mut problem)).collect();
        let ends = variables.iter().flat_map(|v| v.y_max.clone().zip(v.y_min.clone())).collect();
        let epsilon = match asks.epsilon.or(context.network.reference.epsilon) {
            Some(epsilon) if !matches!(asks.goal, Goal::Epsilon | Goal::Disturbance) => Epsilon::Given(epsilon),
            _ => Epsilon::Free(problem.variable(most_epsilon(context))),
        };
        let scaled = !matches!(asks.goal, Goal::Wishes | Goal::Speed | Goal::Epsilon);
        let factor = scaled.then(|| problem.variable(1.0));
        let mut program = Self { proofs, problem, variables, ends, epsilon, factor, goal: asks.goal, rows: Vec::new() };
        for i in 0..context.network.subsystems.len() {
            program.tube(context, i);
            program.terminal(context, i);
            program.references(context, i);
            program.wanted(context, i, asks);
            program.margins(context, i, asks);
        }
        program.coupling(context, asks.goal);
        program.goal(context, asks.goal);
        program
    }

    pub fn solve(&self) -> Answer {
        self.problem.solve()
    }

    /// Sum of weight times log at a point; minus infinity outside its domain.
    pub fn objective(&self, point: &[f64]) -> f64 {
        self.problem.logs.iter().map(|(weight, form)| weight * form.at(point).max(0.0).ln()).sum()
    }

    pub fn zeta(&self, point: &[f64], i: usize) -> DVector<f64> {
        take(point, &self.variables[i].zeta)
    }

    pub fn dz(&self, point: &[f64], i: usize) -> DVector<f64> {
        take(point, &self.variables[i].dz)
    }

    pub fn sigma(&self, point: &[f64], i: usize) -> DVector<f64> {
        take(point, &self.variables[i].sigma)
    }

    /// (max, -min) of Y_i.
    pub fn y_ends(&self, point: &[f64], i: usize) -> (DVector<f64>, DVector<f64>) {
        (take(point, &self.variables[i].y_max), take(point, &self.variables[i].y_min))
    }

    pub fn epsilon(&self, point: &[f64]) -> f64 {
        match self.epsilon {
            Epsilon::Given(value) => value,
            Epsilon::Free(k) => point[k],
        }
    }

    pub fn factor(&self, point: &[f64]) -> Option<f64> {
        self.factor.map(|k| point[k])
    }

    pub fn y_volume(&self, point: &[f64]) -> f64 {
        let volume = |i: usize| {
            let (max, min) = self.y_ends(point, i);
            (max + min).product()
        };
        (0..self.variables.len()).map(volume).product()
    }

    /// What is left of inequality `k` at a point, relative to its scale.
    pub fn left(&self, k: usize, point: &[f64]) -> f64 {
        self.problem.inequalities[k].at(point)
    }

    /// (18) and (21), (22): E_i is invariant under what Z_j let in, and fits into Z_i with Delta_i^z.
    fn tube(&mut self, context: &Context, i: usize) {
        let (s, sets) = (&context.network.subsystems[i], &context.sets.subsystems[i]);
        let floor = floor_support(&sets.tube.normals, &sets.floor);
        let (exogenous, least) = (sets.exogenous.support(&sets.tube.normals), least_offsets(&sets.tube.normals, s));
        let imports: Vec<_> = s.L.keys().map(|&j| (j, import_gain(&sets.tube.normals, s, j))).collect();
        let v = self.variables[i].clone();
        for (r, proof) in self.proofs[i].tube.clone().iter().enumerate() {
            let mut terms = vec![(v.q.start + r, 1.0)];
            minus(&mut terms, &v.q, proof);
            for (j, gain) in &imports {
                let zeta = self.variables[*j].zeta.clone();
                terms.extend(
                    zeta.enumerate().map(|(k, variable)| (variable, -gain[(r, k)] * (1.0 + 2.0 * TUBE_MARGIN))),
                );
            }
            let constant = -2.5 * floor[r] - self.charge(&mut terms, exogenous[r] * (1.0 + 2.0 * TUBE_MARGIN));
            self.at_least_zero(terms, constant);
            if least[r] > 0.0 {
                let mut terms = vec![(v.q.start + r, 1.0)];
                let constant = -self.charge(&mut terms, least[r] * (1.0 + 2.0 * TUBE_MARGIN));
                self.at_least_zero(terms, constant);
            }
        }
        let noise = context.noise(i).z;
        for (k, proof) in self.proofs[i].tube_z.clone().iter().enumerate() {
            let mut terms = vec![(v.zeta.start + k, 1.0), (v.dz.start + k, -1.0 - 2.0 * TUBE_MARGIN)];
            minus(&mut terms, &v.q, proof);
            let constant = -self.charge(&mut terms, noise[k] * (1.0 + 2.0 * TUBE_MARGIN));
            self.at_least_zero(terms, constant);
        }
    }

    /// Takes `amount`, which disturbances, measurement errors or loads cause, out of an inequality: as a constant, which is
    /// returned, or in proportion to the factor where that is the goal.
    fn charge(&self, terms: &mut Vec<(usize, f64)>, amount: f64) -> f64 {
        match self.factor.filter(|_| self.goal == Goal::Disturbance) {
            Some(factor) => {
                terms.push((factor, -amount));
                0.0
            }
            None => amount,
        }
    }

    /// (24) and (25a), and the half-axes: the points +-upset_k e_k lie in Sigma_i.
    fn terminal(&mut self, context: &Context, i: usize) {
        let scale = context.sets.subsystems[i].scales.x.clone();
        let normals = self.proofs[i].terminal_normals.clone();
        let rounded = context.rounded(i, &normals);
        let v = self.variables[i].clone();
        for (r, proof) in self.proofs[i].terminal.clone().iter().enumerate() {
            let mut terms = vec![(v.sigma.start + r, 1.0 - MARGIN)];
            minus(&mut terms, &v.sigma, proof);
            self.at_least_zero(terms, -rounded[r] * (1.0 + 2.0 * ROUNDING_MARGIN));
            let reach: f64 = normals.row(r).iter().zip(&scale).map(|(p, x)| p.abs() * x).sum();
            self.at_least_zero([(v.sigma.start + r, -1.0)], CAP * reach);
            for (k, upset) in v.upset.clone().enumerate() {
                let reach = normals[(r, k)].abs();
                if reach > 0.0 {
                    self.at_least_zero([(v.sigma.start + r, 1.0), (upset, -reach)], 0.0);
                }
            }
        }
        for (k, proof) in self.proofs[i].terminal_z.clone().iter().enumerate() {
            // Affine in the half-width.
            let (least, slope) =
                (context.kept_back(i, k, 0.0), context.kept_back(i, k, 1.0) - context.kept_back(i, k, 0.0));
            let mut terms = vec![(v.dz.start + k, 1.0 - MARGIN - slope)];
            minus(&mut terms, &v.sigma, proof);
            self.at_least_zero(terms, -least * (1.0 + 2.0 * ROUNDING_MARGIN));
        }
        for (upset, x) in v.upset.zip(&scale) {
            self.at_least_zero([(upset, 1.0)], -LEAST * x);
            self.at_least_zero([(upset, -1.0)], CAP * x);
        }
    }

    /// (25b): steady states, Delta^chi, Sigma_i and E_i share every row of X_i x U_i.
    fn references(&mut self, context: &Context, i: usize) {
        let (s, sets) = (&context.network.subsystems[i], &context.sets.subsystems[i]);
        let proofs = self.proofs[i].clone();
        let noise = context.noise(i);
        for r in 0..s.X.h.len() {
            let taken = Taken {
                share: &sets.x_rows[r],
                tube: &proofs.tube_x[r],
                terminal: &proofs.terminal_x[r],
                noise: noise.x[r],
            };
            self.row(i, &s.X.rows[r], s.X.h[r], &taken);
        }
        for r in 0..s.U.h.len() {
            let (share, tube, terminal) = (&sets.u_rows[r], &proofs.tube_u[r], &proofs.terminal_u[r]);
            self.row(i, &s.U.rows[r], s.U.h[r], &Taken { share, tube, terminal, noise: noise.u[r] });
        }
    }

    fn row(&mut self, i: usize, name: &str, h: f64, taken: &Taken) {
        let v = self.variables[i].clone();
        let share = taken.share;
        let mut terms = Vec::new();
        minus(&mut terms, &v.q, taken.tube);
        minus(&mut terms, &v.sigma, taken.terminal);
        for &(y, gain) in &share.steady {
            let (max, min) = self.ends[y];
            terms.push(if gain > 0.0 { (max, -gain) } else { (min, gain) });
        }
        let mut constant =
            h * (1.0 - MARGIN) - share.rest - self.charge(&mut terms, (taken.noise + share.load) * (1.0 + TUBE_MARGIN));
        match self.epsilon {
            Epsilon::Given(epsilon) => constant -= epsilon * share.rate,
            Epsilon::Free(k) => terms.push((k, -share.rate)),
        }
        self.rows.push((i, name.to_owned(), self.problem.inequalities.len()));
        self.problem.at_least_zero(terms.into_iter().map(|(k, a)| (k, a / h)), constant / h);
    }

    /// Reserve and cover, as far as the goal keeps them; ends of Y_i on their side of 0.
    fn wanted(&mut self, context: &Context, i: usize, asks: &Asks) {
        let s = &context.network.subsystems[i];
        let v = self.variables[i].clone();
        for (k, dz) in v.dz.enumerate() {
            if let Some(fixed) = &asks.dz {
                self.at_least_zero([(dz, 1.0)], -fixed[i][k]);
                self.at_least_zero([(dz, -1.0)], fixed[i][k] * (1.0 + MARGIN));
                continue;
            }
            let natural = context.sets.subsystems[i].scales.z[k];
            self.at_least_zero([(dz, 1.0)], -LEAST * natural);
            self.at_least_zero([(dz, -1.0)], CAP * natural);
            let reserve = asks.reserve.as_ref().map_or(s.reserve[k], |reserve| reserve[i][k]);
            self.at_least(dz, reserve, asks.goal, Goal::Reserve);
        }
        for (k, (max, min)) in v.y_max.zip(v.y_min).enumerate() {
            let (low, high) = s.cover[k].unwrap_or((0.0, 0.0));
            for (end, wanted) in [(max, high), (min, -low)] {
                self.at_least_zero([(end, 1.0)], 0.0);
                self.at_least_zero([(end, -1.0)], context.sets.subsystems[i].scales.y_cap[k]);
                self.at_least(end, wanted, asks.goal, Goal::Cover);
            }
        }
    }

    /// (26'): what changing constraints ask.
    fn margins(&mut self, context: &Context, i: usize, asks: &Asks) {
        let (s, shares) = (&context.network.subsystems[i], &context.sets.subsystems[i].outputs.axes);
        let Some(exposed) = s.exposed.as_ref().filter(|_| !matches!(asks.goal, Goal::Epsilon | Goal::Disturbance))
        else {
            return;
        };
        for (k, (output, share)) in exposed.outputs.iter().zip(shares).enumerate() {
            if let Some(margin) = &exposed.margin {
                self.margin(i, &s.outputs[k].name, output, share, margin.value);
            }
            if asks.dz.is_none() {
                let natural = context.sets.subsystems[i].scales.z[output.z];
                self.small(i, output, share, (s.reserve[output.z], natural));
            }
        }
    }

    fn margin(&mut self, i: usize, name: &str, output: &ExposedOutput, share: &OutputShare, margin: f64) {
        let zeta = self.variables[i].zeta.start + output.z;
        let mut terms = vec![(zeta, -output.factor.abs())];
        let mut constant = margin * (1.0 - MARGIN) - share.constant();
        match self.epsilon {
            Epsilon::Given(epsilon) => constant -= epsilon * share.rate,
            Epsilon::Free(k) => terms.push((k, -share.rate)),
        }
        if let Some(factor) = self.factor.filter(|_| self.goal == Goal::Margin) {
            terms.push((factor, -margin));
            constant += margin;
        }
        self.rows.push((i, format!("margin of {name}"), self.problem.inequalities.len()));
        self.at_least_zero(terms.into_iter().map(|(k, a)| (k, a / margin)), constant / margin);
    }

    /// Delta^z of an output that rows read: what it takes of every row is not worth more reserve than was asked for.
    fn small(&mut self, i: usize, output: &ExposedOutput, share: &OutputShare, (reserve, natural): (f64, f64)) {
        let dz = self.variables[i].dz.start + output.z;
        // More than what `at_least` asks.
        let most = SHARE_OF_RESERVE * share.rate / output.factor.abs();
        match self.epsilon {
            _ if reserve > 0.0 => self.at_least_zero([(dz, -1.0)], reserve * (1.0 + 10.0 * MARGIN)),
            // But not so small that the set is none.
            Epsilon::Given(epsilon) => self.at_least_zero([(dz, -1.0)], (most * epsilon).max(2.0 * LEAST * natural)),
            Epsilon::Free(k) => self.at_least_zero([(dz, -1.0), (k, most)], 2.0 * LEAST * natural),
        }
    }

    /// Sum over the outputs without a margin of the logarithm of what (26) takes of them per unit of epsilon: what gains may be
    /// compared by, since no row says it.
    pub fn exposure(&self, context: &Context, point: &[f64]) -> f64 {
        let epsilon = self.epsilon(point);
        let of = |i: usize| {
            let exposed = context.network.subsystems[i].exposed.as_ref().filter(|exposed| exposed.margin.is_none());
            let zeta = self.zeta(point, i);
            let outputs = exposed.into_iter().flat_map(|exposed| &exposed.outputs);
            let taken = outputs
                .zip(&context.sets.subsystems[i].outputs.axes)
                .map(|(output, share)| (share.taken(epsilon) + output.factor.abs() * zeta[output.z]) / epsilon);
            taken.map(f64::ln).sum::<f64>()
        };
        (0..self.variables.len()).map(of).sum()
    }

    /// variable >= wanted, or >= factor wanted where `scaled_by` is the goal; dropped by the goals that come before.
    fn at_least(&mut self, variable: usize, wanted: f64, goal: Goal, scaled_by: Goal) {
        let dropped = matches!(goal, Goal::Epsilon | Goal::Disturbance | Goal::Margin)
            || (goal == Goal::Reserve && scaled_by == Goal::Cover);
        if wanted <= 0.0 || dropped {
            return;
        }
        let wanted = wanted * (1.0 + MARGIN);
        match self.factor.filter(|_| goal == scaled_by || goal == Goal::All) {
            Some(factor) => self.at_least_zero([(variable, 1.0), (factor, -wanted)], 0.0),
            None => self.at_least_zero([(variable, 1.0)], -wanted),
        }
    }

    /// (26): the tightened limits stay positive, so that 0 remains a set-point.
    fn coupling(&mut self, context: &Context, goal: Goal) {
        let constraints = context.network.coupling_constraints.iter();
        for ((c, rates), load) in constraints.zip(&context.sets.coupling).zip(&context.sets.coupling_loads) {
            let mut terms = Vec::new();
            let mut constant = c.l * (1.0 - MARGIN) - self.charge(&mut terms, *load);
            for (&j, row) in &c.Hz {
                let zeta = self.variables[j].zeta.clone();
                terms.extend(zeta.zip(row).map(|(variable, h)| (variable, -h.abs())));
                match self.epsilon {
                    Epsilon::Given(epsilon) => constant -= epsilon * rates[&j],
                    Epsilon::Free(k) => terms.push((k, -rates[&j])),
                }
            }
            let scaled: Vec<_> = terms.into_iter().map(|(k, a)| (k, a / c.l)).collect();
            self.rows.push((*c.H.keys().next().unwrap_or(&0), c.name.clone(), self.problem.inequalities.len()));
            self.problem.at_least_zero(scaled.clone(), constant / c.l - MARGIN);
            if goal == Goal::Wishes {
                self.problem.maximise_log(context.network.wishes.y_weight, scaled, constant / c.l);
            }
        }
    }

    fn goal(&mut self, context: &Context, goal: Goal) {
        match (goal, self.epsilon, self.factor) {
            (Goal::Wishes | Goal::Speed, ..) => self.wishes(context, goal),
            (_, _, Some(factor)) => {
                self.at_least_zero([(factor, -1.0)], 1.0);
                self.problem.linear.push((factor, 1.0));
            }
            (_, Epsilon::Free(k), _) => self.problem.linear.push((k, 1.0)),
            _ => {}
        }
        if let Epsilon::Free(k) = self.epsilon {
            self.at_least_zero([(k, 1.0)], 0.0);
            self.at_least_zero([(k, -1.0)], CAP * widest(context));
        }
    }

    fn wishes(&mut self, context: &Context, goal: Goal) {
        let wishes = &context.network.wishes;
        for (v, s) in self.variables.clone().into_iter().zip(&context.network.subsystems) {
            if goal == Goal::Wishes {
                for ((max, min), weight) in v.y_max.zip(v.y_min).zip(&s.y_weights) {
                    self.log(wishes.y_weight * weight, [(max, 1.0), (min, 1.0)]);
                    for end in [max, min] {
                        self.log(wishes.y_weight * weight * wishes.end_weight, [(end, 1.0)]);
                    }
                }
                v.dz.for_each(|dz| self.log(wishes.reserve_weight, [(dz, 1.0)]));
            }
            v.upset.for_each(|upset| self.log(wishes.terminal_weight, [(upset, 1.0)]));
        }
        if let Epsilon::Free(k) = self.epsilon {
            // As often as there are outputs whose ranges it competes with: else it would shrink with the network.
            let outputs: usize = context.network.subsystems.iter().map(Subsystem::p).sum();
            self.log(wishes.epsilon_weight * outputs as f64, [(k, 1.0)]);
        }
    }

    fn log(&mut self, weight: f64, terms: impl IntoIterator<Item = (usize, f64)>) {
        if weight > 0.0 {
            self.problem.maximise_log(weight, terms, 0.0);
        }
    }

    fn at_least_zero(&mut self, terms: impl IntoIterator<Item = (usize, f64)>, constant: f64) {
        self.problem.at_least_zero(terms, constant);
    }
}

impl Variables {
    fn new(context: &Context, i: usize, proofs: &Proofs, problem: &mut LogProgram) -> Self {
        let scales = &context.sets.subsystems[i].scales;
        let mut take = |units: &DVector<f64>| {
            let start = problem.units.len();
            problem.units.extend(units.iter());
            start..start + units.len()
        };
        let (zeta, dz) = (take(&scales.z), take(&scales.z));
        let (q, sigma) =
            (take(&(proofs.tube_normals.abs() * &scales.x)), take(&(proofs.terminal_normals.abs() * &scales.x)));
        let upset = take(&scales.x);
        let y_max = take(&scales.y);
        let y_min = if context.network.wishes.symmetric { y_max.clone() } else { take(&scales.y) };
        Self { zeta, dz, q, sigma, upset, y_max, y_min }
    }
}

/// The epsilon that empties the first row of (25b), but no more than the largest natural size of an output.
fn most_epsilon(context: &Context) -> f64 {
    let parts = context.network.subsystems.iter().zip(&context.sets.subsystems);
    let rows = parts.flat_map(|(s, sets)| s.X.h.iter().zip(&sets.x_rows).chain(s.U.h.iter().zip(&sets.u_rows)));
    rows.filter(|(_, share)| share.rate > 0.0).map(|(h, share)| h / share.rate).fold(widest(context), f64::min)
}

/// The largest natural size of an output.
fn widest(context: &Context) -> f64 {
    let outputs = context.sets.subsystems.iter().flat_map(|sets| sets.scales.y.iter());
    outputs.copied().fold(f64::MIN_POSITIVE, f64::max)
}

/// Subtracts |mu| from the coefficients of `offsets`.
fn minus(terms: &mut Vec<(usize, f64)>, offsets: &Range<usize>, proof: &Multiplier) {
    terms.extend(offsets.clone().zip(proof.mu.iter()).filter(|(_, mu)| **mu != 0.0).map(|(k, mu)| (k, -mu.abs())));
}

fn take(point: &[f64], range: &Range<usize>) -> DVector<f64> {
    DVector::from_column_slice(&point[range.clone()])
}
