//! Every row of a plan once more, for the numbers as they are emitted.

use nalgebra::{DMatrix, DVector};

use super::limits::Limits;
use super::{MARGIN, StartPlan, SubsystemPlan};
use crate::design::Design;

/// The smallest margin, relative to the bound each row comes from; `None` where a row does not keep [`MARGIN`].
pub fn verify(design: &Design, limits: &Limits, plan: &StartPlan) -> Option<f64> {
    let mut rows = Margins { least: f64::INFINITY };
    for (i, part) in plan.subsystems.iter().enumerate() {
        rows.first_problem(design, limits, plan, i, part);
        rows.references(design, limits, i, part);
        rows.output(design, i, part);
    }
    rows.coupling(design, limits, plan);
    (rows.least >= 0.0).then_some(rows.least + MARGIN)
}

/// What is left of the limits, which have the margin taken off.
struct Margins {
    least: f64,
}

impl Margins {
    fn at_most(&mut self, values: &DVector<f64>, limits: &DVector<f64>, scales: &DVector<f64>) {
        for ((value, limit), scale) in values.iter().zip(limits).zip(scales) {
            let left = (limit - value) / scale.abs().max(f64::MIN_POSITIVE);
            // NaN counts as nothing left.
            self.least = if left >= self.least {
                self.least
            } else if left.is_nan() {
                f64::NEG_INFINITY
            } else {
                left
            };
        }
    }

    fn within(&mut self, P: &DMatrix<f64>, x: &DVector<f64>, limits: &DVector<f64>, scales: &DVector<f64>) {
        self.at_most(&(P * x).abs(), limits, scales);
    }

    /// (35), (36) of step 0, and that (7f) gives the last input.
    fn first_problem(&mut self, design: &Design, limits: &Limits, plan: &StartPlan, i: usize, part: &SubsystemPlan) {
        let (s, own, sized) = (&design.network.subsystems[i], &limits.subsystems[i], &design.sizing.subsystems[i]);
        let off = &plan.start.x0[i] - &part.x[0] - &part.dx;
        self.within(&sized.E.P, &off, &own.tube, &sized.E.q);
        let mut dx = part.dx.clone();
        for (t, du) in part.du.iter().enumerate() {
            let (x, u) = (&part.x[t] - &own.x, &part.u[t] - &own.u);
            self.at_most(&(&s.X.H * (&x + &dx)), &own.nominal[0], &s.X.h);
            self.at_most(&(&s.U.H * (&u + du)), &own.nominal[1], &s.U.h);
            self.at_most(&(&s.X.H * x), &own.first[0], &s.X.h);
            self.at_most(&(&s.U.H * u), &own.first[1], &s.U.h);
            let z = &s.Cz * &dx + &s.Dz * du;
            self.at_most(&z.abs(), &(&sized.dz * (1.0 - MARGIN)), &sized.dz);
            dx = &s.A * dx + &s.B * du;
        }
        self.within(&sized.Sigma.P, &dx, &(&sized.Sigma.q * (1.0 - MARGIN)), &sized.Sigma.q);
    }

    /// The margins of (25b) from N to T - 1.
    fn references(&mut self, design: &Design, limits: &Limits, i: usize, part: &SubsystemPlan) {
        let (s, own) = (&design.network.subsystems[i], &limits.subsystems[i]);
        for t in design.network.horizon..part.x.len() - 1 {
            self.at_most(&(&s.X.H * (&part.x[t] - &own.x)), &own.later[0], &s.X.h);
            self.at_most(&(&s.U.H * (&part.u[t] - &own.u)), &own.later[1], &s.U.h);
        }
    }

    fn output(&mut self, design: &Design, i: usize, part: &SubsystemPlan) {
        let (s, Y) = (&design.network.subsystems[i], &design.sizing.subsystems[i].Y);
        let (y, width) = (&s.C * &part.x[part.x.len() - 1], &Y.max - &Y.min);
        self.at_most(&y, &(&Y.max - &width * (0.5 * MARGIN)), &width);
        self.at_most(&-y, &(-&Y.min - &width * (0.5 * MARGIN)), &width);
    }

    /// (26), (27).
    fn coupling(&mut self, design: &Design, limits: &Limits, plan: &StartPlan) {
        let (N, subsystems) = (design.network.horizon, &design.network.subsystems);
        for (c, [first, later, end]) in design.network.coupling_constraints.iter().zip(&limits.coupling) {
            for t in 0..=plan.steps {
                let limit = if t == plan.steps {
                    end
                } else if t < N {
                    first
                } else {
                    later
                };
                let y = |j: usize| &subsystems[j].C * &plan.subsystems[j].x[t];
                let value: f64 = c.H.iter().map(|(&j, H)| H.dot(&y(j))).sum();
                let one = |value: f64| DVector::from_element(1, value);
                self.at_most(&one(value), &one(*limit), &one(c.l));
            }
        }
    }
}
