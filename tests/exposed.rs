//! What changing constraints are charged for the outputs of a subsystem, against its own sums in random directions.

use std::f64::consts::PI;

use dpc_codegen::design::Design;
use nalgebra::DVector;

use crate::Random;
use crate::checker::{Claim, Collective, Rates};
use crate::load_shares::LoadShares;

/// Directions in which the charge is compared with what is taken.
const DIRECTIONS: usize = 40;

/// Directions of a half-turn in which sets of two outputs are bounded.
const ANGLES: usize = 8;

/// What is taken of rows over the outputs of one subsystem.
pub struct Taken<'a> {
    design: &'a Design,
    i: usize,
    model: &'a Collective,
    rates: &'a Rates,
    loads: &'a LoadShares,
}

impl<'a> Taken<'a> {
    pub fn new(design: &'a Design, i: usize, model: &'a Collective, rates: &'a Rates, loads: &'a LoadShares) -> Self {
        Self { design, i, model, rates, loads }
    }

    /// All claims; none where the subsystem is in no changing constraint.
    pub fn claims(&self) -> Vec<Claim> {
        let network = &self.design.network;
        let s = &network.subsystems[self.i];
        let is_member = network.changing_constraints.iter().any(|c| c.members.contains(&self.i));
        let Some(exposed) = s.exposed.as_ref().filter(|_| is_member) else {
            return vec![self.claim(
                "exposed where it is a member, and only there",
                is_member == s.exposed.is_some(),
                0.0,
            )];
        };
        let random = &mut Random(self.i as u64 + 1);
        let mut claims = vec![self.claim("(4) every output is a coupling output", self.is_exported() < 1e-12, 0.0)];
        let drawn: Vec<_> = (0..DIRECTIONS).map(|_| random.direction(s.p())).collect();
        for h in drawn.into_iter().chain(self.touched()) {
            let (taken, charged, most) = (self.least(&h), self.charged(&h), self.most(&h));
            claims.push(self.claim("changing rows are charged in full", true, (charged - taken) / taken));
            claims.push(self.claim("changing rows are charged once", true, (most - charged) / charged));
        }
        if let Some(margin) = &exposed.margin {
            let slack = axes(s.p()).map(|axis| 1.0 - self.charged(&axis) / margin.value).fold(f64::INFINITY, f64::min);
            claims.push(self.claim("(26') within the margin", true, slack));
        }
        claims
    }

    fn claim(&self, what: &str, holds: bool, slack: f64) -> Claim {
        let what = format!("{}: {what}", self.design.network.subsystems[self.i].name);
        Claim { what, slack: if holds && !slack.is_nan() { slack } else { -1.0 } }
    }

    /// Directions in which nothing is to spare.
    fn touched(&self) -> Vec<DVector<f64>> {
        let p = self.design.network.subsystems[self.i].p();
        match &self.design.sets.subsystems[self.i].outputs.axes[..] {
            [one, other] => (0..ANGLES).map(|k| normal(k as f64, [one.rate, other.rate])).collect(),
            _ => axes(p).collect(),
        }
    }

    /// Largest error of y = factor z over states and inputs, relative.
    fn is_exported(&self) -> f64 {
        let s = &self.design.network.subsystems[self.i];
        let outputs = s.exposed.iter().flat_map(|exposed| &exposed.outputs).enumerate();
        let error = outputs.map(|(k, output)| {
            let states = (s.C.row(k) - s.Cz.row(output.z) * output.factor).amax();
            states.max((s.Dz.row(output.z) * output.factor).amax()) / s.C.row(k).amax()
        });
        error.fold(0.0, f64::max)
    }

    /// What the design charges: as the runtime evaluates it.
    pub fn charged(&self, h: &DVector<f64>) -> f64 {
        self.design.sizing.subsystems[self.i].exposed.generators.iter().map(|g| g.dot(h).abs()).sum()
    }

    /// Some references, loads and tubes take this much of a row.
    pub fn least(&self, h: &DVector<f64>) -> f64 {
        let d = self.over_chi(h);
        let loads = self.loads.of(&d).attained.max(self.loads.of(&-&d).attained) - self.at_rest(&d);
        self.design.sizing.epsilon * self.rates.support(&d) + loads.max(0.0) + self.tube(h)
    }

    /// C chi_ss = yref, whatever the loads are.
    fn at_rest(&self, d: &DVector<f64>) -> f64 {
        self.loads.of(d).at_rest.abs().max(self.loads.of(&-d).at_rest.abs())
    }

    fn over_chi(&self, h: &DVector<f64>) -> DVector<f64> {
        self.model.on_x(self.i, &(h.transpose() * &self.design.network.subsystems[self.i].C))
    }

    /// Z_i.
    fn tube(&self, h: &DVector<f64>) -> f64 {
        let exposed = self.design.network.subsystems[self.i].exposed.iter();
        let zeta = &self.design.sizing.subsystems[self.i].zeta;
        exposed.flat_map(|e| &e.outputs).zip(h).map(|(o, h)| (o.factor * h).abs() * zeta[o.z]).sum()
    }

    /// The most that may be charged: for two outputs by the polygon that the supports in equally spaced directions leave, for more
    /// by a box; supports may themselves be charged a little more than they are.
    fn most(&self, h: &DVector<f64>) -> f64 {
        let reach = |h: &DVector<f64>| {
            let d = self.over_chi(h);
            let loads = self.loads.of(&d).bound().max(self.loads.of(&-&d).bound());
            self.design.sizing.epsilon * self.rates.support(&d) + loads
        };
        let shares = &self.design.sets.subsystems[self.i].outputs;
        let charged =
            |share: &dpc_codegen::sets::OutputShare| share.taken(self.design.sizing.epsilon) / reach(&share.row);
        let overcharge = shares.axes.iter().chain(&shares.oblique).map(charged).fold(1.0, f64::max);
        let moving = match &shares.axes[..] {
            [one, other] => {
                let units = [one.rate, other.rate];
                let angle = (h[1] * units[1]).atan2(h[0] * units[0]).rem_euclid(PI);
                let length = (h[0] * units[0]).hypot(h[1] * units[1]);
                let k = (angle / PI * ANGLES as f64).floor();
                let delta = PI / ANGLES as f64;
                let (before, after) = (angle - k * delta, (k + 1.0) * delta - angle);
                length * (after.sin() * reach(&normal(k, units)) + before.sin() * reach(&normal(k + 1.0, units)))
                    / delta.sin()
            }
            _ => axes(h.len()).zip(h).map(|(axis, h)| h.abs() * reach(&axis)).sum(),
        };
        moving * overcharge * (1.0 + 1e-5) + self.tube(h) * (1.0 + 1e-9)
    }
}

fn axes(p: usize) -> impl Iterator<Item = DVector<f64>> {
    (0..p).map(move |k| DVector::from_fn(p, |r, _| f64::from(r == k)))
}

/// At the angle k of [`ANGLES`] to a half-turn, where `units` count as one unit.
fn normal(k: f64, units: [f64; 2]) -> DVector<f64> {
    let (sin, cos) = (k * PI / ANGLES as f64).sin_cos();
    DVector::from_vec(vec![cos / units[0], sin / units[1]])
}
