//! From the solver's suggestion to numbers that hold.

use nalgebra::DVector;

use super::correction::Correction;
use super::limits::Limits;
use super::program::Part;
use super::verify::verify;
use super::{StartPlan, SubsystemPlan};
use crate::design::Design;
use crate::emit::{fingerprint, plan_number};
use crate::network::{Network, Start};
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
        let moves = Correction::new(design, limits, &run.left, run.x.len() - 1)?;
        draft.iter_mut().enumerate().for_each(|(i, part)| {
            part.x = (0..run.x.len()).map(|t| &run.x[t][i] + moves.x(t, i)).collect();
            part.u = (0..run.u.len()).map(|t| &run.u[t][i] + moves.u(t, i)).collect();
            part.e += moves.e(i);
        });
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
            plan: 0,
            x: of(&self.x, i),
            u: of(&self.u, i),
            e: self.e[i].clone(),
            dx: part.dx,
            du: part.du,
        };
        let mut subsystems: Vec<_> = draft.into_iter().enumerate().map(part).collect();
        let plan = plan_number(&subsystems);
        subsystems.iter_mut().for_each(|part| part.plan = plan);
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
