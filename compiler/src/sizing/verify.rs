//! Every inclusion once more, with upper bounds that include rounding. Nothing here trusts the solver.

use nalgebra::{DMatrix, DVector};

use super::program::Program;
use super::{Context, Proofs, Sizing, Slack, SubsystemSizing};
use crate::convex::{Multiplier, Strips};
use crate::diagnostic::{Diagnostic, Diagnostics, code};
use crate::gains::SubsystemGains;
use crate::network::Subsystem;
use crate::optim::rounding::sum_upper;
use crate::sets::{CAP_MARGIN, ReferenceShare, floor_support, import_gain, least_offsets};

/// Upper bounds of the support of E_i in the rows of X_i, and of U_i through K_i with the measurement error.
pub struct Tightening {
    pub x: Vec<f64>,
    pub u: Vec<f64>,
}

impl Tightening {
    pub fn new(context: &Context, program: &Program, i: usize, E: &Strips) -> Self {
        let (s, g) = (&context.network.subsystems[i], &context.gains.subsystems[i]);
        let set = Bounds::new(E);
        let proofs = &program.proofs[i];
        let of_tube = set.all(&proofs.tube_u, &size_of_u(s, g));
        let noise = context.noise(i);
        let u = of_tube.iter().zip(&noise.u).map(|(tube, noise)| with_noise(*tube, *noise)).collect();
        let of_tube = set.all(&proofs.tube_x, &s.X.H.abs());
        let x = of_tube.iter().zip(&noise.x).map(|(tube, noise)| with_noise(*tube, *noise)).collect();
        Self { x, u }
    }

    /// h - support, rounded down.
    pub fn rows(&self, h: &DVector<f64>, support: &[f64]) -> DVector<f64> {
        DVector::from_fn(h.len(), |r, _| (h[r] - support[r]) - 4.0 * f64::EPSILON * (h[r].abs() + support[r]))
    }
}

fn with_noise(tube: f64, noise: f64) -> f64 {
    if noise > 0.0 { sum_upper([tube, noise]) } else { tube }
}

/// A set and its hull: what rigorous support bounds need.
pub struct Bounds<'a> {
    set: &'a Strips,
    hull: DVector<f64>,
}

impl<'a> Bounds<'a> {
    pub fn new(set: &'a Strips) -> Self {
        Self { set, hull: set.hull() }
    }

    /// Bound in the direction of the proof, which itself was rounded when it was formed from terms of this size.
    fn support(&self, proof: &Multiplier, size: impl Iterator<Item = f64>) -> f64 {
        let formed = sum_upper(size.zip(&self.hull).map(|(d, x)| if d == 0.0 { 0.0 } else { 1e-14 * d * x }));
        sum_upper([proof.bound(&self.set.q, &self.hull), formed])
    }

    pub fn all(&self, proofs: &[Multiplier], size: &DMatrix<f64>) -> Vec<f64> {
        proofs.iter().zip(size.row_iter()).map(|(proof, d)| self.support(proof, d.iter().copied())).collect()
    }
}

/// The slack of every inclusion, in the order of the design's steps.
///
/// # Errors
/// E0405 where one is negative, or where epsilon, a width of Y_i or Delta_i^z, or a limit of (26) is not positive: the program's margins did not survive, which is a defect of conditioning and named
/// as such.
pub fn verify(context: &Context, proofs: &[Proofs], sizing: &Sizing) -> Result<Vec<Slack>, Diagnostics> {
    let mut slacks = Vec::new();
    for (i, proofs) in proofs.iter().enumerate() {
        Inclusions { context, sizing, i, proofs, slacks: &mut slacks }.all();
    }
    for (c, l_tilde) in context.network.coupling_constraints.iter().zip(&sizing.l_tilde) {
        slacks.push(Slack { equation: "(26)", what: c.name.clone(), value: *l_tilde });
    }
    slacks.push(Slack { equation: "(6)", what: "epsilon".to_owned(), value: sizing.epsilon });
    let positive = |slack: &Slack| ["(6)", "(22)", "(26)", "(31)"].contains(&slack.equation);
    match slacks.iter().find(|slack| !(slack.value > 0.0 || slack.value == 0.0 && !positive(slack))) {
        Some(slack) => Err(lost(context, slack).into()),
        None => Ok(slacks),
    }
}

struct Inclusions<'a> {
    context: &'a Context<'a>,
    sizing: &'a Sizing,
    i: usize,
    proofs: &'a Proofs,
    slacks: &'a mut Vec<Slack>,
}

impl Inclusions<'_> {
    fn all(&mut self) {
        let sized = &self.sizing.subsystems[self.i];
        let (tube, terminal) = (Bounds::new(&sized.E), Bounds::new(&sized.Sigma));
        self.invariance(&tube, &terminal);
        self.coupling_outputs(&tube, &terminal);
        self.references(sized);
        self.margins(sized);
        for (k, output) in self.context.network.subsystems[self.i].outputs.iter().enumerate() {
            self.record("(31)", format!("Y of {}", output.name), sized.Y.max[k] - sized.Y.min[k]);
            let cap = self.context.sets.subsystems[self.i].scales.y_cap[k] * (1.0 + CAP_MARGIN);
            let farthest = sized.Y.max[k].max(-sized.Y.min[k]);
            if farthest > cap {
                self.record("(31)", format!("Y of {} within {cap:e}", output.name), cap - farthest);
            }
        }
    }

    /// (18): |Lambda| q + h_W <= q, the floor of W_i taken twice. (35a'): q >= 2 h_V. (24): |Lambda| sigma <= sigma.
    fn invariance(&mut self, tube: &Bounds, terminal: &Bounds) {
        let s = &self.context.network.subsystems[self.i];
        let sets = &self.context.sets.subsystems[self.i];
        let K = &self.context.gains.subsystems[self.i].K;
        let F = s.A.abs() + s.B.abs() * K.abs();
        let floor = floor_support(&tube.set.P, &sets.floor);
        let (exogenous, least) = (sets.exogenous.support(&tube.set.P), least_offsets(&tube.set.P, s));
        let imports: Vec<_> = s.L.keys().map(|&j| (j, import_gain(&tube.set.P, s, j))).collect();
        let image = tube.set.P.abs() * &F;
        for (r, proof) in self.proofs.tube.iter().enumerate() {
            // Twice the floor: one for the rounding of the on-line step, one for a start that drifts.
            let mut parts = vec![tube.support(proof, image.row(r).iter().copied()), 2.0 * floor[r], exogenous[r]];
            for (j, gain) in &imports {
                let zeta = &self.sizing.subsystems[*j].zeta;
                parts.extend(gain.row(r).iter().zip(zeta).map(|(g, z)| g * z));
            }
            self.record("(18)", format!("E invariant, normal {}", r + 1), tube.set.q[r] - sum_upper(parts));
            if least[r] > 0.0 {
                self.record(
                    "(35a)",
                    format!("E against measurement errors, normal {}", r + 1),
                    tube.set.q[r] - least[r],
                );
            }
        }
        let image = terminal.set.P.abs() * &F;
        let rounded = self.context.rounded(self.i, &terminal.set.P);
        for (r, proof) in self.proofs.terminal.iter().enumerate() {
            let bound = terminal.support(proof, image.row(r).iter().copied());
            let kept = terminal.set.q[r] - with_noise(bound, rounded[r]);
            self.record("(24)", format!("Sigma invariant, normal {}", r + 1), kept);
        }
    }

    /// (21) with (22), and (25a).
    fn coupling_outputs(&mut self, tube: &Bounds, terminal: &Bounds) {
        let s = &self.context.network.subsystems[self.i];
        let sized = &self.sizing.subsystems[self.i];
        let rows = size_of_z(s, &self.context.gains.subsystems[self.i]);
        let noise = self.context.noise(self.i).z;
        for (k, row) in rows.row_iter().enumerate() {
            let name = &s.coupling_outputs[k];
            let of_tube = tube.support(&self.proofs.tube_z[k], row.iter().copied());
            self.record("(21)", format!("z = {name}"), sized.zeta[k] - sum_upper([of_tube, noise[k], sized.dz[k]]));
            self.record("(22)", format!("Delta^z of {name}"), sized.dz[k]);
            let of_terminal = terminal.support(&self.proofs.terminal_z[k], row.iter().copied());
            let kept_back = self.context.kept_back(self.i, k, sized.dz[k]);
            self.record("(25a)", format!("z = {name}"), sized.dz[k] - with_noise(of_terminal, kept_back));
        }
    }

    /// (25b), against the tightened sets.
    fn references(&mut self, sized: &SubsystemSizing) {
        let s = &self.context.network.subsystems[self.i];
        let (of_x, of_u) = terminal_rows(self.context, self.proofs, self.i, &sized.Sigma);
        for (r, name) in s.X.rows.iter().enumerate() {
            self.record("(25b)", name.clone(), sized.X_nom.h[r] - sum_upper([sized.x_ref[r], of_x[r]]));
        }
        for (r, name) in s.U.rows.iter().enumerate() {
            self.record("(25b)", name.clone(), sized.U_nom.h[r] - sum_upper([sized.u_ref[r], of_u[r]]));
        }
    }

    /// (26'): the segments reach as far as was proved, and no farther than the margin.
    fn margins(&mut self, sized: &SubsystemSizing) {
        let s = &self.context.network.subsystems[self.i];
        let Some(exposed) = &s.exposed else { return };
        let taken = sized.exposed.half_widths(s.p());
        for (k, margin) in exposed.margin.iter().flat_map(|margin| (0..s.p()).map(move |k| (k, margin))) {
            self.record("(26')", format!("margin of {}", s.outputs[k].name), margin.value - taken[k]);
        }
        let shares = &self.context.sets.subsystems[self.i].outputs;
        for share in shares.axes.iter().chain(&shares.oblique) {
            let tube = exposed
                .outputs
                .iter()
                .zip(&share.row)
                .map(|(output, h)| (h * output.factor).abs() * sized.zeta[output.z]);
            let taken = sum_upper([share.taken(self.sizing.epsilon)].into_iter().chain(tube));
            let lacking = taken * (1.0 + ACCEPTANCE) - sized.exposed.support(&share.row) * (1.0 - SUMMED);
            if lacking > 0.0 {
                self.record("(26')", "segments of the outputs".to_owned(), -lacking);
            }
        }
    }

    fn record(&mut self, equation: &'static str, what: String, value: f64) {
        let name = &self.context.network.subsystems[self.i].name;
        self.slacks.push(Slack { equation, what: format!("{name}: {what}"), value });
    }
}

/// What the runtime's acceptance of rows rests on: ten times what it takes. Supports that others make redundant are lowered
/// by less than the rest of what segments are enlarged by.
const ACCEPTANCE: f64 = 1e-8;
/// Bound of the rounding of a sum of segments.
const SUMMED: f64 = 1e-13;

/// Upper bounds of the support of Sigma_i in the rows of X_i, and of U_i through K_i.
pub fn terminal_rows(context: &Context, proofs: &Proofs, i: usize, Sigma: &Strips) -> (Vec<f64>, Vec<f64>) {
    let (s, g) = (&context.network.subsystems[i], &context.gains.subsystems[i]);
    let set = Bounds::new(Sigma);
    (set.all(&proofs.terminal_x, &s.X.H.abs()), set.all(&proofs.terminal_u, &size_of_u(s, g)))
}

/// Size of the terms that U.H K_i is the sum of.
fn size_of_u(s: &Subsystem, g: &SubsystemGains) -> DMatrix<f64> {
    s.U.H.abs() * g.K.abs()
}

/// Size of the terms that C_zi + D_zi K_i is the sum of.
pub fn size_of_z(s: &Subsystem, g: &SubsystemGains) -> DMatrix<f64> {
    s.Cz.abs() + s.Dz.abs() * g.K.abs()
}

/// Upper bound of a row on the references: support of the steady states over the product of Y_j, plus Delta^chi, plus loads.
/// `ends` as of [`ends`].
pub fn taken(sizing: &Sizing, ends: &[(f64, f64)], share: &ReferenceShare) -> f64 {
    let mut parts = vec![sizing.epsilon * share.rate];
    parts.extend([share.load, share.rest].into_iter().filter(|part| *part > 0.0));
    for &(y, gain) in &share.steady {
        let (max, min) = ends[y];
        parts.push((gain * max).max(gain * min) + share.steady_error * max.max(-min));
    }
    sum_upper(parts)
}

/// (max, min) of Y_i by entry of the collective y.
pub fn ends(sizing: &Sizing) -> Vec<(f64, f64)> {
    sizing.subsystems.iter().flat_map(|s| s.Y.max.iter().copied().zip(s.Y.min.iter().copied())).collect()
}

fn lost(context: &Context, slack: &Slack) -> Diagnostic {
    let mut error =
        Diagnostic::error(code::LOST_SLACK, format!("{} does not survive rounding: {}", slack.equation, slack.what));
    for s in &context.network.subsystems {
        error = error.at(s.places.header.clone(), "one of the subsystems");
    }
    let error = error.note(format!("what is left of it is {:.3e}, it must not be negative", slack.value));
    if slack.equation == "(26')" {
        return error
            .help("a margin that is only just possible does not survive: state margins that are one percent larger");
    }
    error
        .help("the sizes of this design differ by too many orders of magnitude: scale the units, bound the states that are free, or choose faster gains")
}
