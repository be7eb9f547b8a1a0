//! The whole network in closed loop, as far as the i-DPC problems see it: the references (7), and x - xref under neighbours that do
//! whatever Z_j allows, disturbances and measurement errors.
#![expect(non_snake_case, reason = "the paper's symbols")]

use dpc_runtime::solver::{Outcome, Solver, WorkingSet};
use nalgebra::DVector;

use super::instance::{Instance, Task, with_room};
use super::sample::{ENOUGH, Random, Seen, shifted};
use super::space::Parameters;
use crate::design::Design;
use crate::network::Norm;

/// Steps from one set-point to the next, and from one upset to the next.
const JUMP: usize = 40;
const UPSET: usize = 17;

/// What `samples` steps of every subsystem show; `None` for those that are too large.
pub fn run(design: &Design, samples: usize) -> Vec<Option<Seen>> {
    let references = references(design, samples);
    let one = |i: usize| {
        with_room(design.problems.subsystems[i].dpc.V.ncols(), Run { design, i, references: &references[i] })
    };
    crate::sharing::spread(references.len(), one)
}

/// xref and uref of one subsystem, step by step.
type Course = Vec<(DVector<f64>, DVector<f64>)>;

/// Of all subsystems, from rest at 0: outputs go at the rate of (30) to set-points that are drawn from Y.
fn references(design: &Design, steps: usize) -> Vec<Course> {
    let (network, sizing) = (&design.network, &design.sizing);
    let mut random = Random(2);
    let zeros = |count: usize| DVector::<f64>::zeros(count);
    let (mut y, mut error): (Vec<_>, Vec<_>) = network.subsystems.iter().map(|s| (zeros(s.p()), zeros(s.p()))).unzip();
    let mut wish = y.clone();
    let mut courses: Vec<Course> = network.subsystems.iter().map(|s| vec![(zeros(s.n()), zeros(s.m()))]).collect();
    for t in 0..steps + network.horizon {
        let wanted = network.subsystems.iter().zip(&sizing.subsystems).enumerate();
        let next = wanted.map(|(i, (s, sized))| {
            if t % JUMP == 0 {
                wish[i] = DVector::from_fn(s.p(), |k, _| {
                    0.5 * (sized.Y.min[k] + sized.Y.max[k] + random.signed() * (sized.Y.max[k] - sized.Y.min[k]))
                });
            }
            let rate = sizing.epsilon
                / match network.reference.norm {
                    Norm::Inf => 1.0,
                    Norm::One => s.p() as f64,
                    Norm::Two => (s.p() as f64).sqrt(),
                };
            DVector::from_fn(s.p(), |k, _| y[i][k] + (wish[i][k] - y[i][k]).clamp(-rate, rate))
        });
        let next: Vec<DVector<f64>> = next.collect();
        let admitted = network
            .coupling_constraints
            .iter()
            .zip(&sizing.l_tilde)
            .all(|(c, l)| c.H.iter().map(|(j, H)| H.dot(&next[*j])).sum::<f64>() <= *l);
        if admitted {
            y = next;
        }
        let z: Vec<_> = network
            .subsystems
            .iter()
            .zip(&courses)
            .map(|(s, course)| &s.Cz * &course[t].0 + &s.Dz * &course[t].1)
            .collect();
        for (i, (s, g)) in network.subsystems.iter().zip(&design.gains.subsystems).enumerate() {
            let (x, u) = &courses[i][t];
            let mut next = &s.A * x + &s.B * u;
            s.L.iter().for_each(|(j, L)| next += &s.E * L * &z[*j]);
            error[i] += &y[i] - &s.C * x;
            let input = &g.Kx * &next + &g.Ke * &error[i];
            courses[i].push((next, input));
        }
    }
    courses
}

struct Run<'a> {
    design: &'a Design,
    i: usize,
    references: &'a Course,
}

impl Task for Run<'_> {
    type Output = Seen;

    fn run<const NV: usize>(self) -> Seen {
        let Self { design, i, references } = self;
        let (s, g, dpc) =
            (&design.network.subsystems[i], &design.gains.subsystems[i], &design.problems.subsystems[i].dpc);
        let (N, n, m) = (design.network.horizon, s.n(), s.m());
        let (mut random, mut seen, mut warm) = (Random(3 + i as u64), Seen::default(), WorkingSet::EMPTY);
        let Some(mut instance) = Instance::<NV>::new(dpc) else { return seen };
        let (mut solver, shift) = (Box::new(Solver::<NV>::NEW), dpc.shift());
        let mut e = DVector::<f64>::zeros(n);
        let mut forecast: Option<DVector<f64>> = None;
        for (t, window) in references.windows(N).enumerate() {
            let (x_ref, u_ref) = window.iter().cloned().unzip();
            let mut at = Parameters { e: e.clone(), x_ref, u_ref, tube: Vec::new() };
            let mut solved = |at: &mut Parameters,
                              forecast: Option<&DVector<f64>>,
                              from: &WorkingSet<NV>,
                              solver: &mut Solver<NV>| {
                at.tube = tube(dpc, &at.e, forecast);
                instance.put(dpc, at);
                (instance.rests(), solver.solve(&instance, from, ENOUGH))
            };
            if t % UPSET == UPSET - 1 {
                let direction = DVector::from_fn(n, |_, _| random.signed());
                let fits =
                    |far: f64,
                     solver: &mut Solver<NV>,
                     at: &mut Parameters,
                     solved: &mut dyn FnMut(&mut Parameters, &mut Solver<NV>) -> bool| {
                        at.e = &e + &direction * far;
                        solved(at, solver)
                    };
                let mut feasible = |at: &mut Parameters, solver: &mut Solver<NV>| {
                    matches!(solved(at, None, &WorkingSet::EMPTY, solver).1, Outcome::Optimal { .. })
                };
                let (mut low, mut high) = (0.0, 1e-3);
                while high < 1e6 && fits(high, &mut solver, &mut at, &mut feasible) {
                    (low, high) = (high, 4.0 * high);
                }
                for _ in 0..30 {
                    let middle = 0.5 * (low + high);
                    *(if fits(middle, &mut solver, &mut at, &mut feasible) { &mut low } else { &mut high }) = middle;
                }
                e += direction * (low * (0.75 + 0.25 * random.signed()));
                forecast = None;
            }
            at.e = DVector::from_fn(n, |k, _| e[k] + random.sign() * s.measurement_error[k]);
            let (rests, outcome) = solved(&mut at, forecast.as_ref(), &warm, &mut solver);
            let w = match outcome {
                _ if rests => {
                    warm = WorkingSet::EMPTY;
                    DVector::zeros(dpc.T.ncols())
                }
                Outcome::Optimal { iterations } => {
                    seen.warm = seen.warm.max(iterations);
                    warm = shifted(&solver.working_set(), &shift);
                    DVector::from_column_slice(&solver.w()[..dpc.T.ncols()])
                }
                // After an upset at the very edge, by rounding: back to the reference.
                Outcome::Infeasible { .. } | Outcome::IterationLimit => {
                    seen.undecided += usize::from(outcome == Outcome::IterationLimit);
                    (e, forecast, warm) = (DVector::zeros(n), None, WorkingSet::EMPTY);
                    continue;
                }
            };
            seen.parameters += usize::from(!rests);
            if let (_, Outcome::Optimal { iterations }) =
                solved(&mut at, forecast.as_ref(), &WorkingSet::EMPTY, &mut solver)
            {
                seen.cold = seen.cold.max(iterations);
            }
            let v = &dpc.T * w;
            let (dx, du) = (v.rows(0, n).into_owned(), v.rows(n, m).into_owned());
            let mut next = &s.A * &e + &s.B * (&du + &g.K * (&at.e - &dx));
            for (j, L) in &s.L {
                let zeta = &design.sizing.subsystems[*j].zeta;
                next += &s.E * L * DVector::from_fn(zeta.len(), |k, _| random.sign() * zeta[k]);
            }
            if let Some(disturbance) = &s.w {
                let direction = DVector::from_fn(n, |_, _| random.signed());
                next += disturbance.set.support(&direction).map_or(DVector::zeros(n), |(_, farthest)| farthest);
            }
            forecast = Some(&s.A * dx + &s.B * du);
            e = next;
        }
        seen
    }
}

/// Limits of the tube rows (35a'), as the runtime's `DpcProblem::doubt` sets them.
fn tube(dpc: &crate::problems::DpcProblem, e: &DVector<f64>, forecast: Option<&DVector<f64>>) -> Vec<(f64, f64)> {
    let rows = || dpc.noise.iter().enumerate();
    let apart = forecast.map(|dx| rows().map(|(r, _)| dpc.rows[r].offset.dot(&(e - dx))).collect::<Vec<_>>());
    let apart = apart.filter(|apart| rows().all(|(r, noise)| apart[r].abs() <= (dpc.upper[r] + noise) * (1.0 + 1e-9)));
    let one = |(r, noise): (usize, &f64)| match noise {
        0.0 => (dpc.lower[r], dpc.upper[r]),
        _ => {
            let (room, i) = ((dpc.upper[r] - noise).max(0.0), apart.as_ref().map_or(0.0, |apart| apart[r]));
            (i.min(-room), i.max(room))
        }
    };
    rows().map(one).collect()
}
