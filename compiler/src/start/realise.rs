//! From the solver's suggestion to numbers that hold.

use nalgebra::DVector;

use super::limits::Limits;
use super::program::Part;
use super::verify::verify;
use super::{StartPlan, SubsystemPlan};
use crate::design::Design;
use crate::emit::fingerprint;
use crate::network::{Network, Start};
use crate::optim::quadratic::{Answer, QuadraticProgram};
use crate::optim::rounding::to_digits;

/// Digits of the inputs.
const DIGITS: usize = 12;
/// Deviations below this share of their natural size are the solver's tolerance, and left out.
const NOTHING: f64 = 1e-5;
/// How often what is left of the rest at T is solved for again: each time leaves a millionth of it.
const PASSES: usize = 4;

/// The plan, or `None` where it does not keep its margins or does not come to rest.
pub fn realise(design: &Design, limits: &Limits, start: &Start, mut draft: Vec<Part>) -> Option<StartPlan> {
    draft
        .iter_mut()
        .zip(&limits.subsystems)
        .for_each(|(part, own)| part.leave_out_nothing(&own.off_unit, &own.dx_unit));
    for (part, own) in draft.iter_mut().zip(&limits.subsystems) {
        part.x.iter_mut().for_each(|x| *x += &own.x);
        part.u.iter_mut().for_each(|u| *u += &own.u);
        part.e += &own.e;
    }
    for _ in 0..PASSES {
        let run = Run::new(design, limits, start, &draft);
        if run.rests(design) {
            let plan = run.plan(design, start, draft);
            let margin = verify(design, limits, &plan)?;
            return Some(StartPlan { margin, ..plan });
        }
        correct(design, limits, &run, &mut draft)?;
    }
    None
}

impl Part {
    fn leave_out_nothing(&mut self, off_unit: &DVector<f64>, dx_unit: &DVector<f64>) {
        let tiny = |values: &DVector<f64>, units: &DVector<f64>| {
            values.iter().zip(units).all(|(value, unit)| value.abs() <= NOTHING * unit)
        };
        if tiny(&self.off, off_unit) {
            self.off.fill(0.0);
        }
        let sizes = |du: &DVector<f64>| du.amax();
        let largest = self.u.iter().map(sizes).fold(1e-3, f64::max);
        if tiny(&self.dx, dx_unit) && self.du.iter().all(|du| sizes(du) <= NOTHING * largest) {
            self.dx.fill(0.0);
            self.du.iter_mut().for_each(|du| du.fill(0.0));
        }
        self.dx.apply(|x| *x = to_digits(*x, DIGITS));
        self.du.iter_mut().for_each(|du| du.apply(|u| *u = to_digits(*u, DIGITS)));
    }
}

/// (7a) forward from xref_0, under the suggested inputs and the local gains K_i around the suggested states, which keep the
/// solver's residuals from growing.
struct Run {
    /// By step, then by subsystem.
    x: Vec<Vec<DVector<f64>>>,
    u: Vec<Vec<DVector<f64>>>,
    e: Vec<DVector<f64>>,
    /// What the network would move at T: x_{T+1} - x_T.
    left: Vec<DVector<f64>>,
}

impl Run {
    fn new(design: &Design, limits: &Limits, start: &Start, draft: &[Part]) -> Self {
        let (network, gains) = (&design.network, &design.gains.subsystems);
        let push: Vec<_> = limits.subsystems.iter().map(|own| &own.push).collect();
        let steps = draft.first().map_or(0, |part| part.x.len() - 1);
        let (mut x, mut u): (Vec<Vec<DVector<f64>>>, Vec<_>) = (Vec::new(), Vec::new());
        x.push(draft.iter().zip(&start.x0).map(|(part, x0)| x0 - &part.dx - &part.off).collect());
        for t in 0..steps {
            let input = |i: usize| {
                let part: &Part = &draft[i];
                let wanted = &part.u[t] + &gains[i].K * (&x[t][i] - &part.x[t]);
                wanted.map(|u| to_digits(u, DIGITS))
            };
            u.push((0..draft.len()).map(input).collect::<Vec<_>>());
            x.push(successor(network, &x[t], &u[t], &push));
        }
        let e: Vec<_> = draft.iter().map(|part| part.e.clone()).collect();
        let end = |i: usize| &gains[i].Kx * &x[steps][i] + &gains[i].Ke * &e[i];
        u.push((0..draft.len()).map(end).collect());
        let next = successor(network, &x[steps], &u[steps], &push);
        let left = next.iter().zip(&x[steps]).map(|(next, x)| next - x).collect();
        Self { x, u, e, left }
    }

    /// Whether every node could have been started at the end of the plan.
    fn rests(&self, design: &Design) -> bool {
        let drifts = design.sizing.subsystems.iter().map(|sized| &sized.drift);
        let still = |(left, drift): (&DVector<f64>, &DVector<f64>)| {
            left.iter().zip(drift).all(|(left, drift)| left.abs() <= 0.5 * drift)
        };
        self.left.iter().zip(drifts).all(still)
    }

    fn plan(self, design: &Design, start: &Start, draft: Vec<Part>) -> StartPlan {
        let of = |steps: &[Vec<DVector<f64>>], i: usize| steps.iter().map(|step| step[i].clone()).collect();
        let part = |(i, part): (usize, Part)| SubsystemPlan {
            design: fingerprint(design, i),
            x: of(&self.x, i),
            u: of(&self.u, i),
            e: self.e[i].clone(),
            dx: part.dx,
            du: part.du,
        };
        let subsystems = draft.into_iter().enumerate().map(part).collect();
        StartPlan { start: start.clone(), steps: self.x.len() - 1, subsystems, margin: 0.0 }
    }
}

/// (7a) of all subsystems.
pub fn successor(
    network: &Network,
    x: &[DVector<f64>],
    u: &[DVector<f64>],
    push: &[&DVector<f64>],
) -> Vec<DVector<f64>> {
    let next = |i: usize| {
        let s = &network.subsystems[i];
        let mut next = &s.A * &x[i] + &s.B * &u[i] + push[i];
        for (&j, L) in &s.L {
            let other = &network.subsystems[j];
            next += &s.E * (L * (&other.Cz * &x[j] + &other.Dz * &u[j]));
        }
        next
    };
    (0..x.len()).map(next).collect()
}

/// Adds the smallest moves after which nothing is left at T, solved for in units of what is left.
fn correct(design: &Design, limits: &Limits, run: &Run, draft: &mut [Part]) -> Option<()> {
    let network = &design.network;
    let units = limits.subsystems.iter().map(|own| &own.x_unit);
    let relative = |(left, unit): (&DVector<f64>, &DVector<f64>)| left.component_div(unit).amax();
    let size = run.left.iter().zip(units).map(relative).fold(0.0, f64::max);
    let steps = run.x.len() - 1;
    let mut program = QuadraticProgram::default();
    let take = |unit: &DVector<f64>, square: f64, program: &mut QuadraticProgram| -> Vec<usize> {
        unit.iter().map(|unit| program.variable(*unit, square)).collect()
    };
    let (mut x, mut u): (Vec<Vec<Vec<usize>>>, Vec<Vec<Vec<usize>>>) = (Vec::new(), Vec::new());
    for _ in 0..=steps {
        x.push(limits.subsystems.iter().map(|own| take(&own.x_unit, 0.0, &mut program)).collect());
        u.push(limits.subsystems.iter().map(|own| take(&own.u_unit, 1.0, &mut program)).collect());
    }
    let e: Vec<_> = limits.subsystems.iter().map(|own| take(&own.e_unit, 0.0, &mut program)).collect();
    for (i, s) in network.subsystems.iter().enumerate() {
        let g = &design.gains.subsystems[i];
        for k in 0..s.n() {
            program.zero([(x[0][i][k], 1.0)], 0.0);
            for t in 0..=steps {
                let mut terms = vec![(if t < steps { x[t + 1][i][k] } else { x[t][i][k] }, -1.0)];
                terms.extend(x[t][i].iter().zip(s.A.row(k).iter()).map(|(place, a)| (*place, *a)));
                terms.extend(u[t][i].iter().zip(s.B.row(k).iter()).map(|(place, b)| (*place, *b)));
                for (&j, L) in &s.L {
                    let (gain, other) = (s.E.row(k) * L, &network.subsystems[j]);
                    let (on_x, on_u) = (&gain * &other.Cz, &gain * &other.Dz);
                    terms.extend(x[t][j].iter().zip(on_x.iter()).map(|(place, a)| (*place, *a)));
                    terms.extend(u[t][j].iter().zip(on_u.iter()).map(|(place, b)| (*place, *b)));
                }
                let left = if t < steps { 0.0 } else { run.left[i][k] / size };
                terms.retain(|(_, a)| *a != 0.0);
                program.zero(terms, left);
            }
        }
        for k in 0..s.m() {
            let mut terms = vec![(u[steps][i][k], -1.0)];
            terms.extend(x[steps][i].iter().zip(g.Kx.row(k).iter()).map(|(place, a)| (*place, *a)));
            terms.extend(e[i].iter().zip(g.Ke.row(k).iter()).map(|(place, a)| (*place, *a)));
            program.zero(terms, 0.0);
        }
    }
    let Answer::Point(point) = program.solve() else { return None };
    let found = |places: &[usize]| DVector::from_iterator(places.len(), places.iter().map(|k| point.x[*k] * size));
    for (i, part) in draft.iter_mut().enumerate() {
        for t in 0..=steps {
            part.x[t] = &run.x[t][i] + found(&x[t][i]);
            part.u[t] = &run.u[t][i] + found(&u[t][i]);
        }
        part.e += found(&e[i]);
    }
    Some(())
}
