//! The smallest moves of a network after which it rests at the end of a plan.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::limits::Limits;
use crate::design::Design;
use crate::optim::quadratic::{Answer, QuadraticProgram};

/// Changes of xref_k, uref_k and eref_T by which the network moves less at T, by what it would move. They are solved for in units
/// of it, so that the solver's tolerance is relative to what is left, and each correction leaves a millionth.
pub struct Correction {
    places: Places,
    point: Vec<f64>,
    /// The unit: the largest move relative to a state's natural size.
    size: f64,
}

/// The variables, by step and subsystem.
struct Places {
    x: Vec<Vec<Range<usize>>>,
    u: Vec<Vec<Range<usize>>>,
    e: Vec<Range<usize>>,
}

impl Correction {
    /// For what is `left` at the end of `steps` steps, per subsystem; `None` where the solver finds nothing: modes that no input
    /// reaches have not decayed.
    pub fn new(design: &Design, limits: &Limits, left: &[DVector<f64>], steps: usize) -> Option<Self> {
        let units = limits.subsystems.iter().map(|own| &own.x_unit);
        let relative = |(left, unit): (&DVector<f64>, &DVector<f64>)| left.component_div(unit).amax();
        let size = left.iter().zip(units).map(relative).fold(0.0, f64::max);
        let mut program = QuadraticProgram::default();
        let places = Places::new(limits, steps, &mut program);
        for (i, left) in left.iter().enumerate() {
            places.x[0][i].clone().for_each(|x| program.zero([(x, 1.0)], 0.0));
            places.motion(design, i, steps, &(left / size), &mut program);
            places.last_input(design, i, steps, &mut program);
        }
        match program.solve() {
            Answer::Point(point) => Some(Self { places, point: point.x, size }),
            Answer::Infeasible | Answer::Failed(_) => None,
        }
    }

    pub fn x(&self, t: usize, i: usize) -> DVector<f64> {
        self.taken(&self.places.x[t][i])
    }

    pub fn u(&self, t: usize, i: usize) -> DVector<f64> {
        self.taken(&self.places.u[t][i])
    }

    pub fn e(&self, i: usize) -> DVector<f64> {
        self.taken(&self.places.e[i])
    }

    fn taken(&self, range: &Range<usize>) -> DVector<f64> {
        DVector::from_column_slice(&self.point[range.clone()]) * self.size
    }
}

impl Places {
    fn new(limits: &Limits, steps: usize, program: &mut QuadraticProgram) -> Self {
        let mut take = |units: &DVector<f64>, square: f64| {
            let first = program.units.len();
            for unit in units.iter() {
                program.variable(*unit, square);
            }
            first..first + units.len()
        };
        let own = &limits.subsystems;
        Self {
            x: (0..=steps).map(|_| own.iter().map(|own| take(&own.x_unit, 0.0)).collect()).collect(),
            u: (0..=steps).map(|_| own.iter().map(|own| take(&own.u_unit, 1.0)).collect()).collect(),
            e: own.iter().map(|own| take(&own.e_unit, 0.0)).collect(),
        }
    }

    /// (7a) of subsystem i; at the end its state stays but for `left`.
    fn motion(&self, design: &Design, i: usize, steps: usize, left: &DVector<f64>, program: &mut QuadraticProgram) {
        let (subsystems, s) = (&design.network.subsystems, &design.network.subsystems[i]);
        let foreign: Vec<_> =
            s.L.iter().map(|(&j, L)| (j, &s.E * L * &subsystems[j].Cz, &s.E * L * &subsystems[j].Dz)).collect();
        for (t, k) in (0..=steps).flat_map(|t| (0..s.n()).map(move |k| (t, k))) {
            let mut terms = vec![(self.x[(t + 1).min(steps)][i].start + k, -1.0)];
            terms.extend(on(&s.A, k, &self.x[t][i]).chain(on(&s.B, k, &self.u[t][i])));
            for (j, on_x, on_u) in &foreign {
                terms.extend(on(on_x, k, &self.x[t][*j]).chain(on(on_u, k, &self.u[t][*j])));
            }
            program.zero(terms, if t == steps { left[k] } else { 0.0 });
        }
    }

    /// (7f) at the end.
    fn last_input(&self, design: &Design, i: usize, steps: usize, program: &mut QuadraticProgram) {
        let g = &design.gains.subsystems[i];
        for (k, u) in self.u[steps][i].clone().enumerate() {
            let law = on(&g.Kx, k, &self.x[steps][i]).chain(on(&g.Ke, k, &self.e[i]));
            program.zero(law.chain([(u, -1.0)]), 0.0);
        }
    }
}

/// Row k of a matrix on variables.
fn on<'m>(
    matrix: &'m DMatrix<f64>,
    k: usize,
    variables: &Range<usize>,
) -> impl Iterator<Item = (usize, f64)> + use<'m> {
    variables.clone().zip(matrix.row(k).iter().copied().collect::<Vec<_>>()).filter(|(_, a)| *a != 0.0)
}
