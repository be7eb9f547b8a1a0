//! The i-DPC problem (33)-(36) for the parameters of one step.

use core::iter::repeat;

use super::linear::{add, add_scaled, dot, dot_of, finite, larger, largest, shift_in, subtract, times};
use super::solver::{Glance, Row, Rows, Side, TOLERANCE, WorkingSet, Worst};
use super::tables::{Bounds, DpcProblem, Model, StageRow};
use super::{Real, precision};

/// A forecast is refuted by more than rounding.
const CREDIBLE: Real = 1.0 + precision::KEPT;

/// What a glance by simulation overlooks, relative to a bounded entry plus the largest |w_k|: its rounding errors. The terminal
/// cost makes `next` contract, so that the error of a stage is a few dozen roundings of entries of w, times the norm of a row of T;
/// this is some thousands.
const OVERLOOKED: Real = precision::SUMS;

/// [`DpcProblem`] for one measured state and one reference trajectory.
#[derive(Debug)]
pub struct Instance<
    'a,
    const NX: usize,
    const NU: usize,
    const N: usize,
    const NV: usize,
    const NR: usize,
    const NT: usize,
    const NS: usize,
    const NQ: usize,
> {
    problem: &'a DpcProblem<NX, NU, N, NV, NR, NT, NS, NQ>,
    e: &'a [Real; NX],
    x_ref: &'a [[Real; NX]; N],
    u_ref: &'a [[Real; NU]; N],
    /// Limits less offsets: of the tube rows where violated rows are looked for by simulation, else of all.
    lower: [Real; NR],
    upper: [Real; NR],
}

/// A trajectory of the nominal deviations dx_k = xhat_k - xref_k, du_k = uhat_k - uref_k over the horizon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan<const NX: usize, const NU: usize, const N: usize> {
    pub dx: [Real; NX],
    pub du: [[Real; NU]; N],
}

impl<
    const NX: usize,
    const NU: usize,
    const N: usize,
    const NV: usize,
    const NR: usize,
    const NT: usize,
    const NS: usize,
    const NQ: usize,
> DpcProblem<NX, NU, N, NV, NR, NT, NS, NQ>
{
    /// The problem for e = x_t - xref_t and the references over the horizon.
    pub fn at<'a>(
        &'a self,
        e: &'a [Real; NX],
        x_ref: &'a [[Real; NX]; N],
        u_ref: &'a [[Real; NU]; N],
    ) -> Instance<'a, NX, NU, N, NV, NR, NT, NS, NQ> {
        let mut instance = Instance { problem: self, e, x_ref, u_ref, lower: [0.0; NR], upper: [0.0; NR] };
        let places = instance.lower.iter_mut().zip(&mut instance.upper);
        let mut limits = places.zip(self.lower.iter().zip(&self.upper));
        let put = |((lower, upper), (low, high)): ((&mut Real, &mut Real), (&Real, &Real)), offset: Real| {
            (*lower, *upper) = (low - offset, high - offset);
        };
        self.tube.iter().zip(limits.by_ref()).for_each(|(row, limits)| put(limits, dot(row, e)));
        if !self.by_stages() {
            self.state.iter().zip(limits.by_ref()).for_each(|(row, limits)| put(limits, row.offset(x_ref)));
            self.input.iter().zip(limits.by_ref()).for_each(|(row, limits)| put(limits, row.offset(u_ref)));
            limits.for_each(|limits| put(limits, 0.0));
        }
        instance
    }

    /// Whether violated rows are looked for by simulation.
    #[inline(always)]
    fn by_stages(&self) -> bool {
        NV > SHORT && self.staged && self.boxed
    }

    /// [`Instance::rests`] of the problem for these parameters, without making it.
    pub fn rests(&self, e: &[Real; NX], x_ref: &[[Real; NX]; N], u_ref: &[[Real; NU]; N]) -> bool {
        // Without a branch per row the comparisons are done several at a time.
        let tube =
            self.tube.iter().zip(self.lower.iter().zip(&self.upper)).fold(true, |rests, (row, (lower, upper))| {
                let offset = dot(row, e);
                rests & (*lower <= offset) & (offset <= *upper)
            });
        tube & self.references_rest(x_ref, u_ref)
    }

    /// Whether the references alone satisfy the state and input rows.
    #[inline]
    fn references_rest(&self, x_ref: &[[Real; NX]; N], u_ref: &[[Real; NU]; N]) -> bool {
        if self.boxed {
            return self.x.admit(x_ref) & self.u.admit(u_ref);
        }
        let limits = || self.lower.iter().zip(&self.upper);
        let inside = |offset: Real, (lower, upper): (&Real, &Real)| (*lower <= offset) & (offset <= *upper);
        let state = self.state.iter().zip(limits().skip(NT));
        let input = self.input.iter().zip(limits().skip(NT + NS));
        state.fold(true, |all, (row, limits)| all & inside(row.offset(x_ref), limits))
            & input.fold(true, |all, (row, limits)| all & inside(row.offset(u_ref), limits))
    }

    /// The same problem where `e` is measured with an error that moves tube row r by up to `noise[r]`: rows (35a) give
    /// way to
    ///
    /// ```text
    /// min(-(q - noise), i) <= tube . (e - dx_0) <= max(q - noise, i),      i = tube . (e - forecast),
    /// ```
    ///
    /// which says that the true deviation lies in E_i, by the measurement or by the forecast dx of this step, whose own
    /// deviation is known to lie there. `None` where it is not known; a forecast that the measurement refutes, |i| > q +
    /// noise, is not used either. Returns whether it was used.
    pub fn doubt(
        &self,
        instance: &mut Instance<'_, NX, NU, N, NV, NR, NT, NS, NQ>,
        noise: &[Real; NT],
        forecast: Option<&[Real; NX]>,
    ) -> bool {
        let innovation = forecast.map(|dx| {
            let apart = subtract(instance.e, dx);
            self.tube.each_ref().map(|row| dot(row, &apart))
        });
        let credible = |innovation: &[Real; NT]| {
            let rows = innovation.iter().zip(noise).zip(&self.upper);
            rows.fold(true, |credible, ((i, noise), q)| credible & (i.abs() <= (q + noise) * CREDIBLE))
        };
        let innovation = innovation.filter(credible);
        let relied = innovation.is_some();
        let innovation = innovation.unwrap_or([0.0; NT]);
        let limits = instance.lower.iter_mut().zip(instance.upper.iter_mut());
        let rows = self.tube.iter().zip(&self.upper).zip(noise.iter().zip(&innovation));
        for ((lower, upper), ((row, q), (noise, i))) in limits.zip(rows) {
            let (room, offset) = ((q - noise).max(0.0), dot(row, instance.e));
            *lower = i.min(-room) - offset;
            *upper = i.max(room) - offset;
        }
        relied
    }

    /// Whether a measured deviation x - xhat keeps the true one in E_i, however the measurement errs.
    pub fn keeps_tube(&self, noise: &[Real; NT], deviation: &[Real; NX]) -> bool {
        let rows = self.tube.iter().zip(noise).zip(&self.upper);
        rows.fold(true, |keeps, ((row, noise), q)| keeps & (dot(row, deviation).abs() <= (q - noise) * CREDIBLE))
    }

    /// v = T w, taken apart into (dx_0, du_0, ..., du_{N-1}).
    pub fn plan(&self, w: &[Real; NV]) -> Plan<NX, NU, N> {
        let mut plan = Plan::REST;
        let mut inputs = plan.du.iter_mut();
        plan.dx = self.start(w);
        self.simulate(w, |_, du| {
            if let Some(place) = inputs.next() {
                *place = *du;
            }
        });
        plan
    }

    /// w = T^-1 v of a plan, by substitution.
    pub fn unknowns(&self, plan: &Plan<NX, NU, N>) -> [Real; NV] {
        let mut w = [0.0; NV];
        let mut places = w.iter_mut();
        let mut put = |solved: &[Real]| solved.iter().zip(places.by_ref()).for_each(|(value, place)| *place = *value);
        put(&substituted(&self.root, &plan.dx));
        let mut dx = plan.dx;
        for (stage, du) in self.stages.iter().zip(&plan.du) {
            let part = substituted(&stage.spread, &subtract(du, &times(&stage.gain, &dx)));
            put(&part);
            dx = add(&times(&stage.next, &dx), &times(&stage.drive, &part));
        }
        w
    }

    /// The rows of a solution that ask the same at the next step.
    pub fn shifted(&self, active: impl Iterator<Item = (usize, Side)>) -> WorkingSet<NV> {
        let mut next = WorkingSet::EMPTY;
        for (row, side) in active {
            match self.shift.get(row) {
                Some(&to) if usize::from(to) < NR => next.push(usize::from(to), side),
                _ => false,
            };
        }
        next
    }

    /// dx_0.
    #[inline]
    fn start(&self, w: &[Real; NV]) -> [Real; NX] {
        w.first_chunk().map_or([0.0; NX], |part| times(&self.root, part))
    }

    /// Shows dx_k and du_k for k = 0, ..., N - 1, and returns dx_N.
    #[inline]
    fn simulate(&self, w: &[Real; NV], mut show: impl FnMut(&[Real; NX], &[Real; NU])) -> [Real; NX] {
        let mut dx = self.start(w);
        let (parts, _) = w.get(NX..).unwrap_or_default().as_chunks::<NU>();
        for (stage, part) in self.stages.iter().zip(parts) {
            let du = add(&times(&stage.gain, &dx), &times(&stage.spread, part));
            show(&dx, &du);
            dx = add(&times(&stage.next, &dx), &times(&stage.drive, part));
        }
        dx
    }
}

impl<
    const NX: usize,
    const NU: usize,
    const N: usize,
    const NV: usize,
    const NR: usize,
    const NT: usize,
    const NS: usize,
    const NQ: usize,
> Instance<'_, NX, NU, N, NV, NR, NT, NS, NQ>
{
    /// Whether w = 0 satisfies every row, and therefore is optimal: xhat = xref and uhat = uref.
    pub fn rests(&self) -> bool {
        if self.problem.by_stages() {
            let tube = |limits: &[Real; NR]| limits.first_chunk().copied().unwrap_or([0.0; NT]);
            around_zero(&tube(&self.lower), &tube(&self.upper)) & self.problem.references_rest(self.x_ref, self.u_ref)
        } else {
            around_zero(&self.lower, &self.upper)
        }
    }

    /// Whether every parameter is a number whose products do not overflow. A solver cannot be asked otherwise.
    pub fn is_finite(&self) -> bool {
        let small = |values: &[Real]| values.iter().fold(true, |small, value| small & (value.abs() < LARGEST));
        small(self.e) & small(self.x_ref.as_flattened()) & small(self.u_ref.as_flattened())
    }

    /// [`Self::admits`] of a plan.
    #[inline(never)]
    pub fn admits_plan(&self, plan: &Plan<NX, NU, N>, tolerance: Real) -> bool {
        self.admits(&self.problem.unknowns(plan), tolerance)
    }

    /// Whether `w` is finite and violates no row by more than its [`slack`](DpcProblem::slack) plus `tolerance` times (its scale +
    /// the largest |w_k|).
    pub fn admits(&self, w: &[Real; NV], tolerance: Real) -> bool {
        let size = largest(w);
        let slack = self.problem.slack.iter().copied().chain(repeat(0.0));
        let satisfied = |(row, slack): (Row<'_>, Real)| {
            let value = dot_of(row.normal, w);
            (row.lower - value).max(value - row.upper) <= slack + tolerance * (row.scale + size)
        };
        finite(w) && self.iter().zip(slack).all(satisfied)
    }

    /// What makes the constraint of row `index` past the tube rows one on deviations.
    #[inline]
    fn offset(&self, index: usize) -> Option<Real> {
        let index = index.wrapping_sub(NT);
        if index < NS {
            self.problem.state.get(index).map(|row| row.offset(self.x_ref))
        } else {
            let input = self.problem.input.get(index.wrapping_sub(NS));
            Some(input.map_or(0.0, |row| row.offset(self.u_ref)))
        }
    }

    /// The limits of row `index`, less its offset.
    #[inline]
    fn limits(&self, index: usize) -> Option<(Real, Real)> {
        if index < NT || !self.problem.by_stages() {
            return Some((*self.lower.get(index)?, *self.upper.get(index)?));
        }
        let offset = self.offset(index)?;
        Some((*self.problem.lower.get(index)? - offset, *self.problem.upper.get(index)? - offset))
    }
}

impl<
    const NX: usize,
    const NU: usize,
    const N: usize,
    const NV: usize,
    const NR: usize,
    const NT: usize,
    const NS: usize,
    const NQ: usize,
> Rows<NV> for Instance<'_, NX, NU, N, NV, NR, NT, NS, NQ>
{
    fn iter(&self) -> impl Iterator<Item = Row<'_>> {
        (0..NR).map_while(|index| self.get(index))
    }

    #[inline]
    fn get(&self, index: usize) -> Option<Row<'_>> {
        let (lower, upper) = self.limits(index)?;
        let scale =
            larger(finite_or_zero(*self.problem.lower.get(index)?), finite_or_zero(*self.problem.upper.get(index)?));
        Some(Row { normal: self.normal(index), lower, upper, scale })
    }

    #[inline]
    fn normal(&self, index: usize) -> &[Real] {
        let (Some(row), Some(extent)) = (self.problem.V.get(index), self.problem.extent.get(index)) else {
            return &[0.0; NV];
        };
        reduced(row, *extent)
    }

    #[inline]
    fn glance(&self, w: &[Real; NV], size: Real) -> Option<Glance> {
        self.problem.by_stages().then(|| self.look(w, size))
    }

    #[inline]
    fn worst(&self, w: &[Real; NV], size: Real, sum: impl Iterator<Item = (usize, Real)>) -> Worst {
        if self.problem.by_stages() { Worst::Unknown } else { self.look_by_rows(w, size, sum) }
    }

    #[inline]
    fn products(&self, index: usize) -> Option<&[Real]> {
        self.problem.gram.get(index).map(<[Real; NR]>::as_slice)
    }
}

/// Rows of no more entries than this are multiplied whole.
const SHORT: usize = 8;

impl<
    const NX: usize,
    const NU: usize,
    const N: usize,
    const NV: usize,
    const NR: usize,
    const NT: usize,
    const NS: usize,
    const NQ: usize,
> Instance<'_, NX, NU, N, NV, NR, NT, NS, NQ>
{
    /// The row violated by the largest distance, by simulation.
    fn look(&self, w: &[Real; NV], size: Real) -> Glance {
        let problem = self.problem;
        let mut worst = Finds::new(OVERLOOKED, size);
        let dx = problem.start(w);
        let tube = problem.tube.iter().zip(self.lower.iter().zip(&self.upper));
        for (row, (tube, (lower, upper))) in tube.enumerate() {
            worst.see(row, -dot(tube, &dx), *lower, *upper);
        }
        let mut stages = (0..N).zip(self.x_ref.iter().zip(self.u_ref));
        let end = problem.simulate(w, |dx, du| {
            if let Some((k, (x_ref, u_ref))) = stages.next() {
                problem.x.look(k, &add(x_ref, dx), &mut worst);
                problem.u.look(k, &add(u_ref, du), &mut worst);
            }
        });
        let first = NR.saturating_sub(problem.terminal.len());
        let limits = problem.lower.iter().zip(&problem.upper);
        let coupling = problem.V.iter().zip(&problem.extent).zip(limits.clone()).enumerate().take(first);
        for (row, ((normal, extent), (lower, upper))) in coupling.skip(NT + NS + NQ) {
            worst.see(row, product(normal, *extent, w), *lower, *upper);
        }
        for (row, (terminal, (lower, upper))) in problem.terminal.iter().zip(limits.skip(first)).enumerate() {
            worst.see(first.wrapping_add(row), dot(terminal, &end), *lower, *upper);
        }
        worst.found
    }

    /// The same by the rows of V, or by the Gram matrix for w = V' sum.
    #[inline]
    fn look_by_rows(&self, w: &[Real; NV], size: Real, sum: impl Iterator<Item = (usize, Real)>) -> Worst {
        let problem = self.problem;
        let mut values = [0.0; NR];
        if problem.gram.is_empty() {
            for (value, (row, extent)) in values.iter_mut().zip(problem.V.iter().zip(&problem.extent)) {
                *value = product(row, *extent, w);
            }
        } else {
            sum.filter_map(|(row, coefficient)| Some((problem.gram.get(row)?, coefficient)))
                .for_each(|(column, coefficient)| spread(&mut values, coefficient, column));
        }
        let kept = 0.5 * TOLERANCE * size;
        let worst = worst_of(&values, &self.lower, &self.upper, kept);
        if worst <= kept {
            return Worst::Kept;
        }
        let mut rows = values.iter().zip(self.lower.iter().zip(&self.upper)).enumerate();
        let found = rows.find_map(|(row, (value, (lower, upper)))| {
            let side = if value < lower { Side::Lower } else { Side::Upper };
            (larger(lower - value, value - upper) >= worst).then_some((row, side))
        });
        found.map_or(Worst::Unknown, |(row, side)| Worst::Row(row, side))
    }
}

/// values += coefficient column. Out of line, so that the values are kept in memory: in registers they would be one by one.
#[inline(never)]
fn spread<const NR: usize>(values: &mut [Real; NR], coefficient: Real, column: &[Real; NR]) {
    add_scaled(values, coefficient, column);
}

/// How far the worst of the values is beyond its limits, if by more than `least`.
#[inline(never)]
fn worst_of<const NR: usize>(values: &[Real; NR], lower: &[Real; NR], upper: &[Real; NR], least: Real) -> Real {
    let (quads, rest) = values.as_chunks::<4>();
    let ((lower, lower_rest), (upper, upper_rest)) = (lower.as_chunks::<4>(), upper.as_chunks::<4>());
    let beyond = |(value, (lower, upper)): (&Real, (&Real, &Real))| larger(lower - value, value - upper);
    let mut lanes = [least; 4];
    for (values, (lower, upper)) in quads.iter().zip(lower.iter().zip(upper)) {
        let rows = values.iter().zip(lower.iter().zip(upper));
        lanes.iter_mut().zip(rows).for_each(|(lane, row)| *lane = larger(beyond(row), *lane));
    }
    let rows = rest.iter().zip(lower_rest.iter().zip(upper_rest));
    lanes.iter_mut().zip(rows).for_each(|(lane, row)| *lane = larger(beyond(row), *lane));
    let [a, b, c, d] = lanes;
    larger(larger(a, b), larger(c, d))
}

#[inline(always)]
fn product<const NV: usize>(row: &[Real; NV], extent: u16, w: &[Real; NV]) -> Real {
    if NV <= SHORT { dot(row, w) } else { dot_of(reduced(row, extent), w) }
}

/// A row without the zeros it ends with. Where all lengths are known to be short, sums over the whole of it are unrolled.
#[inline(always)]
fn reduced<const NV: usize>(row: &[Real; NV], extent: u16) -> &[Real] {
    if NV <= SHORT { row } else { row.get(..usize::from(extent)).unwrap_or(row) }
}

/// The worst row so far: how far beyond its limit it is, less what is overlooked, relative to the value of the row.
struct Finds {
    overlooked: Real,
    excess: Real,
    found: Glance,
}

impl Finds {
    #[inline]
    fn new(overlooked: Real, size: Real) -> Self {
        Self { overlooked, excess: overlooked * size, found: Glance::NOTHING }
    }

    #[inline]
    fn see(&mut self, row: usize, value: Real, lower: Real, upper: Real) {
        let (below, above) = (lower - value, value - upper);
        let excess = larger(below, above) - self.overlooked * value.abs();
        if excess > self.excess {
            let side = if below > above { Side::Lower } else { Side::Upper };
            self.excess = excess;
            self.found.push(row, side);
        }
    }
}

impl<const COUNT: usize, const N: usize> Bounds<COUNT, N> {
    #[inline]
    fn admit(&self, values: &[[Real; COUNT]; N]) -> bool {
        between(self.low.as_flattened(), values.as_flattened(), self.high.as_flattened())
    }

    /// How far each entry is beyond its bounds, in the units of its row.
    #[inline]
    fn excess(&self, k: usize, values: &[Real; COUNT], overlooked: Real) -> [Real; COUNT] {
        let mut excess = *values;
        if let (Some(low), Some(high), Some(unit)) = (self.low.get(k), self.high.get(k), self.unit.get(k)) {
            for (x, ((low, high), unit)) in excess.iter_mut().zip(low.iter().zip(high).zip(unit)) {
                *x = (larger(low - *x, *x - high) - overlooked * x.abs()) * unit.abs();
            }
        }
        excess
    }

    #[inline]
    fn look(&self, k: usize, values: &[Real; COUNT], worst: &mut Finds) {
        let excess = self.excess(k, values, worst.overlooked);
        if excess.iter().fold(Real::NEG_INFINITY, |most, excess| larger(*excess, most)) > worst.excess {
            self.find(k, values, &excess, worst);
        }
    }

    #[inline(never)]
    fn find(&self, k: usize, values: &[Real; COUNT], excess: &[Real; COUNT], worst: &mut Finds) {
        let (Some(low), Some(unit), Some(row)) = (self.low.get(k), self.unit.get(k), self.row.get(k)) else { return };
        for ((value, excess), ((low, unit), row)) in values.iter().zip(excess).zip(low.iter().zip(unit).zip(row)) {
            if *excess > worst.excess {
                let side = if (value < low) == (*unit > 0.0) { Side::Lower } else { Side::Upper };
                worst.excess = *excess;
                worst.found.push(usize::from(*row), side);
            }
        }
    }
}

impl<const COUNT: usize> StageRow<COUNT> {
    #[inline]
    fn offset<const N: usize>(&self, parameters: &[[Real; COUNT]; N]) -> Real {
        parameters.get(self.stage).map_or(Real::NAN, |parameter| dot(&self.row, parameter))
    }
}

impl<const NX: usize, const NU: usize, const N: usize> Plan<NX, NU, N> {
    /// Nominal trajectory on the reference.
    pub const REST: Self = Self { dx: [0.0; NX], du: [[0.0; NU]; N] };

    /// du_0.
    pub fn now(&self) -> [Real; NU] {
        self.du.first().copied().unwrap_or([0.0; NU])
    }

    /// The candidate (47) for the next step: (dx_1, du_1, ..., du_{N-1}, K dx_N).
    pub fn shifted<const NY: usize, const NZ: usize, const NI: usize>(
        &self,
        model: &Model<NX, NU, NY, NZ, NI>,
    ) -> Self {
        let next = |dx: &[Real; NX], du: &[Real; NU]| add(&times(&model.A, dx), &times(&model.B, du));
        let end = self.du.iter().fold(self.dx, |dx, du| next(&dx, du));
        let mut du = self.du;
        shift_in(&mut du, times(&model.K, &end));
        Self { dx: next(&self.dx, &self.now()), du }
    }
}

/// The solution of an upper triangular system.
fn substituted<const COUNT: usize>(matrix: &[[Real; COUNT]; COUNT], right: &[Real; COUNT]) -> [Real; COUNT] {
    let mut solved = [0.0; COUNT];
    for (k, (row, value)) in matrix.iter().zip(right).enumerate().rev() {
        let rest = value - dot(row, &solved);
        if let (Some(entry), Some(diagonal)) = (solved.get_mut(k), row.get(k)) {
            *entry = rest / diagonal;
        }
    }
    solved
}

/// Whether every number lies between its limits.
#[inline]
fn between(low: &[Real], values: &[Real], high: &[Real]) -> bool {
    values.iter().zip(low.iter().zip(high)).fold(true, |inside, (x, (low, high))| inside & (low <= x) & (x <= high))
}

/// Whether zero lies between all limits.
#[inline]
fn around_zero(lower: &[Real], upper: &[Real]) -> bool {
    lower.iter().zip(upper).fold(true, |around, (lower, upper)| around & (*lower <= 0.0) & (0.0 <= *upper))
}

/// Its square, times any number of rows, is finite.
const LARGEST: Real = precision::LARGEST;

fn finite_or_zero(limit: Real) -> Real {
    if limit.is_finite() { limit.abs() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    #![expect(non_snake_case, reason = "the paper's symbols")]

    use super::super::Real;
    use super::super::solver::{Glance, Rows, Side, Worst};
    use super::super::tables::{Bounds, DpcProblem, NO_ROW, Stage, StageRow};
    use super::Plan;

    /// More unknowns than are looked at by rows in any case.
    type Problem = DpcProblem<2, 2, 4, 10, 5, 1, 1, 1>;

    fn stage() -> Stage<2, 2> {
        let (gain, spread) = ([[-0.3, 0.1], [0.2, -0.4]], [[2.0, 0.5], [0.0, 1.5]]);
        let (next, drive) = ([[0.9, 0.2], [-0.1, 0.8]], [[1.0, 0.0], [0.5, 2.0]]);
        Stage { next, drive, gain, spread }
    }

    /// Two states, two inputs, four stages; a row of each kind, the last of (36).
    fn problem() -> Problem {
        let mut V = [[0.0; 10]; 5];
        for (k, row) in V.iter_mut().enumerate() {
            row[k] = 1.0;
        }
        DpcProblem {
            V,
            gram: &[],
            extent: [10; 5],
            slack: &[],
            lower: [-1.0; 5],
            upper: [1.0, 1.0, 1.0, Real::INFINITY, 1.0],
            tube: [[1.0, 2.0]],
            state: [StageRow { stage: 1, row: [3.0, 0.0] }],
            input: [StageRow { stage: 0, row: [0.0, -5.0] }],
            terminal: &[[1.0, 1.0]],
            shift: [0, NO_ROW, NO_ROW, NO_ROW, 4],
            root: [[2.0, 1.0], [0.0, 3.0]],
            stages: [stage(), stage(), stage(), stage()],
            x: Bounds::NONE,
            u: Bounds::NONE,
            boxed: false,
            staged: false,
            max_iterations: 10,
        }
    }

    /// The same with its state and input row as bounds, whose rows of V do not matter then.
    fn staged() -> Problem {
        let mut problem = problem();
        let (x, u) = (&mut problem.x, &mut problem.u);
        (x.low[1][0], x.high[1][0], x.unit[1][0], x.row[1][0]) = (-1.0 / 3.0, 1.0 / 3.0, 3.0, 1);
        (u.low[0][1], u.high[0][1], u.unit[0][1], u.row[0][1]) = (-0.2, 0.2, -5.0, 2);
        Problem { boxed: true, staged: true, ..problem }
    }

    const REST: [[Real; 2]; 4] = [[0.0; 2]; 4];

    /// Parameters of the first two stages; those of the others do not matter.
    fn window(first: [Real; 2], second: [Real; 2]) -> [[Real; 2]; 4] {
        [first, second, [9.0; 2], [9.0; 2]]
    }

    #[test]
    fn unknowns_are_those_of_the_plan() {
        let plan = Plan { dx: [1.0, -2.0], du: [[3.0, 0.5], [-1.5, 4.0], [2.0, 0.25], [-1.0, 1.0]] };
        let back: Plan<2, 2, 4> = problem().plan(&problem().unknowns(&plan));
        for (a, b) in back.dx.iter().chain(back.du.iter().flatten()).zip(plan.dx.iter().chain(plan.du.iter().flatten()))
        {
            assert!((a - b).abs() < 1e4 * Real::EPSILON);
        }
    }

    /// The tube row is [1 2] with q = 1; the measurement may move it by 0.25.
    #[test]
    fn a_measurement_in_doubt_tightens_the_tube_unless_the_forecast_is_known() {
        let (problem, e) = (problem(), [0.8, 0.0]);
        let rests = |forecast: Option<&[Real; 2]>| {
            let mut instance = problem.at(&e, &REST, &REST);
            problem.doubt(&mut instance, &[0.25], forecast);
            // The offset is 0.8.
            let limits = [instance.lower[0], instance.upper[0]].map(|limit| (100.0 * (limit + 0.8)).round() / 100.0);
            (limits, instance.rests())
        };
        assert_eq!(rests(None), ([-0.75, 0.75], false));
        assert_eq!(rests(Some(&[0.0, 0.0])), ([-0.75, 0.8], true));
        assert_eq!(rests(Some(&[2.0, 0.0])), ([-1.2, 0.75], false), "1.2 apart, 1.25 are possible");
        assert_eq!(rests(Some(&[2.1, 0.0])), ([-0.75, 0.75], false), "1.3 apart: the forecast is refuted");
    }

    #[test]
    fn offsets_come_from_the_stage_of_the_row() {
        let problem = problem();
        let (x_ref, u_ref) = (window([9.0, 9.0], [0.01, 0.02]), window([0.03, 0.04], [9.0, 9.0]));
        let e = [0.1, 0.2];
        let instance = problem.at(&e, &x_ref, &u_ref);
        for (index, expected) in [0.5, 0.03, -0.2, 0.0, 0.0].into_iter().enumerate() {
            let row = instance.get(index).unwrap();
            assert!((row.lower + 1.0 + expected).abs() < 4.0 * Real::EPSILON && row.normal.len() == 10);
        }
        assert!(instance.get(5).is_none() && instance.iter().count() == 5);
        assert!(instance.rests() && instance.is_finite());
        assert!(instance.admits(&full([0.5, 0.97, 1.2, 1e9, 0.0, 0.0]), 1e-9));
        assert!(!instance.admits(&full([0.6, 0.0, 0.0, 0.0, 0.0, 0.0]), 1e-9));
        assert!(!instance.admits(&full([0.0, 0.0, 0.0, -1.1, 0.0, 0.0]), 1e-9));
        assert!(!instance.admits(&full([0.0, 0.0, 0.0, Real::INFINITY, 0.0, 0.0]), 1e-9));
        assert!(!instance.admits(&full([0.0, 0.0, 0.0, 0.0, 0.0, Real::NAN]), 1e-9));
        for (e, finite) in [([1.0, 0.2], true), ([Real::NAN, 0.0], false), ([Real::MAX, Real::MAX], false)] {
            let instance = problem.at(&e, &REST, &REST);
            assert_eq!((instance.rests(), instance.is_finite()), (false, finite));
        }
    }

    #[test]
    fn rests_by_bounds_as_by_rows() {
        let (rows, bounds) = (problem(), staged());
        for x in [-0.34, -0.33, 0.0, 0.33, 0.34] {
            for u in [-0.21, -0.19, 0.19, 0.21, Real::NAN] {
                let (x_ref, u_ref) = (window([9.0, 9.0], [x, 9.0]), window([9.0, u], [9.0, 9.0]));
                for (problem, e) in [(&rows, 0.0), (&bounds, 0.0), (&rows, 0.6), (&bounds, 0.6)] {
                    let rests = problem.rests(&[0.0, e], &x_ref, &u_ref);
                    assert_eq!(rests, x.abs() < 0.335 && u.abs() < 0.2 && e < 0.5);
                    assert_eq!(rests, problem.at(&[0.0, e], &x_ref, &u_ref).rests());
                }
            }
        }
    }

    /// Of rows at right angles.
    static GRAM: [[Real; 5]; 5] = [
        [1.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 0.0, 1.0],
    ];

    /// The first unknowns, and zeros.
    fn full(first: [Real; 6]) -> [Real; 10] {
        core::array::from_fn(|k| first.get(k).copied().unwrap_or(0.0))
    }

    /// The worst row that was found.
    fn last(glance: Option<Glance>) -> Option<(usize, Side)> {
        glance.expect("there is a test").iter().last()
    }

    /// w moves dx_0 by root w_x = (2 w_0 + w_1, 3 w_1).
    #[test]
    fn a_glance_finds_the_row_that_is_violated_most() {
        let problem = staged();
        let look = |e: Real, x: Real, u: Real, w: [Real; 6]| {
            let (e, x_ref, u_ref) = ([e, 0.0], window([9.0, 9.0], [x, 9.0]), window([9.0, u], [9.0, 9.0]));
            last(problem.at(&e, &x_ref, &u_ref).glance(&full(w), 9.0))
        };
        let violated = |row, side| Some((row, side));
        let zero = [0.0; 6];
        assert_eq!(look(0.0, 0.0, 0.0, zero), None);
        assert_eq!(look(1.5, 0.0, 0.0, zero), violated(0, Side::Upper));
        assert_eq!(look(-1.5, 0.0, 0.0, zero), violated(0, Side::Lower));
        // Row 1 is violated by 0.2, row 2 by 0.5; row 2 has the opposite sign of its input.
        assert_eq!(look(0.0, 0.4, 0.3, zero), violated(2, Side::Lower));
        assert_eq!(look(0.0, 0.4, -0.22, zero), violated(1, Side::Upper));
        assert_eq!(look(0.0, -0.4, 0.0, zero), violated(1, Side::Lower));
        assert_eq!(look(0.0, 0.0, -0.3, zero), violated(2, Side::Upper));
        // The fourth entry has a row of V for itself; nothing else about it is bounded above.
        assert_eq!(look(0.0, 0.0, 0.0, [0.0, 0.0, 0.0, 0.0, 0.0, -9.0]), violated(4, Side::Lower));
    }

    /// w_k is the product of row k.
    #[test]
    fn a_look_at_all_rows_finds_the_worst() {
        let by_rows = |w: [Real; 6]| problem().at(&[0.0; 2], &REST, &REST).worst(&full(w), 9.0, [].into_iter());
        let violated = Worst::Row;
        assert_eq!(by_rows([0.0; 6]), Worst::Kept);
        assert_eq!(by_rows([0.0, 0.0, 0.0, 0.0, 1.5, 0.0]), violated(4, Side::Upper));
        assert_eq!(by_rows([-1.2, 0.0, 0.0, 9.0, -1.5, 0.0]), violated(4, Side::Lower));
        assert_eq!(by_rows([-2.0, 1.1, 1.2, 9.0, -1.5, 0.0]), violated(0, Side::Lower));
        assert_eq!(by_rows([0.0, 1.3, -1.2, 0.0, 0.0, 0.0]), violated(1, Side::Upper));
        assert_eq!(by_rows([0.0, 1.3, -1.4, 0.0, 0.0, 0.0]), violated(2, Side::Lower));
        assert_eq!(by_rows([0.0, 1.3, -1.3, 0.0, 1.3, 0.0]), violated(1, Side::Upper), "the first of equals");
        // By the Gram matrix w itself is not looked at: w = 1.5 v_4 - 3 v_2.
        let problem = Problem { gram: &GRAM, ..problem() };
        let sum = [(4, 1.5), (2, -3.0)];
        let found = problem.at(&[0.0; 2], &REST, &REST).worst(&[0.0; 10], 3.0, sum.into_iter());
        assert_eq!(found, violated(2, Side::Lower));
        assert_eq!(problem.at(&[0.0; 2], &REST, &REST).worst(&[9.0; 10], 3.0, [].into_iter()), Worst::Kept);
    }
}
