//! The i-DPC problem (33)-(36) for the parameters of one step.

use crate::linear::{add, dot, finite, largest, shift_in, subtract, times};
use crate::solver::{Row, Rows};
use crate::tables::{DpcProblem, Model, StageRow};

/// A forecast is refuted by more than rounding.
const CREDIBLE: f64 = 1.0 + 1e-9;

/// [`DpcProblem`] with the offsets of its rows for one measured state and one reference trajectory.
#[derive(Debug)]
pub struct Instance<'a, const NV: usize, const NR: usize> {
    normals: &'a [[f64; NV]; NR],
    lower: [f64; NR],
    upper: [f64; NR],
    offset: [f64; NR],
}

/// A trajectory of the nominal deviations dx_k = xhat_k - xref_k, du_k = uhat_k - uref_k over the horizon.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan<const NX: usize, const NU: usize, const N: usize> {
    pub dx: [f64; NX],
    pub du: [[f64; NU]; N],
}

impl<
    const NX: usize,
    const NU: usize,
    const NV: usize,
    const NR: usize,
    const NT: usize,
    const NS: usize,
    const NQ: usize,
> DpcProblem<NX, NU, NV, NR, NT, NS, NQ>
{
    /// The problem for e = x_t - xref_t and the references over the horizon.
    pub fn at<const N: usize>(
        &self,
        e: &[f64; NX],
        x_ref: &[[f64; NX]; N],
        u_ref: &[[f64; NU]; N],
    ) -> Instance<'_, NV, NR> {
        let mut offset = [0.0; NR];
        let mut places = offset.iter_mut();
        for (row, place) in self.tube.iter().zip(places.by_ref()) {
            *place = dot(row, e);
        }
        stage_offsets(&self.state, x_ref, &mut places);
        stage_offsets(&self.input, u_ref, &mut places);
        Instance { normals: &self.V, lower: self.lower, upper: self.upper, offset }
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
        instance: &mut Instance<'_, NV, NR>,
        noise: &[f64; NT],
        e: &[f64; NX],
        forecast: Option<&[f64; NX]>,
    ) -> bool {
        let innovation = forecast.map(|dx| {
            let apart = subtract(e, dx);
            self.tube.each_ref().map(|row| dot(row, &apart))
        });
        let credible = |innovation: &[f64; NT]| {
            let rows = innovation.iter().zip(noise).zip(&self.upper);
            rows.fold(true, |credible, ((i, noise), q)| credible & (i.abs() <= (q + noise) * CREDIBLE))
        };
        let innovation = innovation.filter(credible);
        let relied = innovation.is_some();
        let innovation = innovation.unwrap_or([0.0; NT]);
        let limits = instance.lower.iter_mut().zip(instance.upper.iter_mut());
        for ((lower, upper), (noise, i)) in limits.zip(noise.iter().zip(&innovation)) {
            let room = (*upper - noise).max(0.0);
            *lower = i.min(-room);
            *upper = i.max(room);
        }
        relied
    }

    /// Whether a measured deviation x - xhat keeps the true one in E_i, however the measurement errs.
    pub fn keeps_tube(&self, noise: &[f64; NT], deviation: &[f64; NX]) -> bool {
        let rows = self.tube.iter().zip(noise).zip(&self.upper);
        rows.fold(true, |keeps, ((row, noise), q)| keeps & (dot(row, deviation).abs() <= (q - noise) * CREDIBLE))
    }

    /// v = T w, taken apart into (dx_0, du_0, ..., du_{N-1}).
    pub fn plan<const N: usize>(&self, w: &[f64; NV]) -> Plan<NX, NU, N> {
        let v = times(&self.T, w);
        let mut entries = v.iter().copied();
        let mut plan = Plan::REST;
        for (entry, value) in plan.dx.iter_mut().chain(plan.du.iter_mut().flatten()).zip(entries.by_ref()) {
            *entry = value;
        }
        plan
    }

    /// w = T^-1 v of a plan, by substitution.
    pub fn unknowns<const N: usize>(&self, plan: &Plan<NX, NU, N>) -> [f64; NV] {
        let mut v = [0.0; NV];
        for (place, value) in v.iter_mut().zip(plan.dx.iter().chain(plan.du.iter().flatten())) {
            *place = *value;
        }
        let mut w = [0.0; NV];
        for (k, (row, value)) in self.T.iter().zip(&v).enumerate().rev() {
            let solved = value - dot(row, &w);
            if let (Some(entry), Some(diagonal)) = (w.get_mut(k), row.get(k)) {
                *entry = solved / diagonal;
            }
        }
        w
    }
}

impl<const NV: usize, const NR: usize> Instance<'_, NV, NR> {
    /// Whether w = 0 satisfies every row, and therefore is optimal: xhat = xref and uhat = uref.
    pub fn rests(&self) -> bool {
        let rows = self.offset.iter().zip(&self.lower).zip(&self.upper);
        // Without a branch per row the comparisons are done several at a time.
        rows.fold(true, |rests, ((offset, lower), upper)| rests & (lower <= offset) & (offset <= upper))
    }

    /// Whether every offset is a number whose products do not overflow. A solver cannot be asked otherwise.
    pub fn is_finite(&self) -> bool {
        self.offset.iter().all(|offset| offset.abs() < LARGEST)
    }

    /// Whether `w` is finite and violates no row by more than `tolerance` times (the row's scale + the largest |w_k|).
    pub fn admits(&self, w: &[f64; NV], tolerance: f64) -> bool {
        let size = largest(w);
        let satisfied = |row: Row<'_, NV>| {
            let value = dot(row.normal, w);
            (row.lower - value).max(value - row.upper) <= tolerance * (row.scale + size)
        };
        finite(w) && self.iter().all(satisfied)
    }
}

impl<const NV: usize, const NR: usize> Rows<NV> for Instance<'_, NV, NR> {
    fn iter(&self) -> impl Iterator<Item = Row<'_, NV>> {
        let limits = self.lower.iter().zip(&self.upper).zip(&self.offset);
        self.normals.iter().zip(limits).map(|(normal, ((lower, upper), offset))| Row {
            normal,
            lower: lower - offset,
            upper: upper - offset,
            scale: finite_or_zero(*lower).max(finite_or_zero(*upper)),
        })
    }
}

impl<const NX: usize, const NU: usize, const N: usize> Plan<NX, NU, N> {
    /// Nominal trajectory on the reference.
    pub const REST: Self = Self { dx: [0.0; NX], du: [[0.0; NU]; N] };

    /// du_0.
    pub fn now(&self) -> [f64; NU] {
        self.du.first().copied().unwrap_or([0.0; NU])
    }

    /// The candidate (47) for the next step: (dx_1, du_1, ..., du_{N-1}, K dx_N).
    pub fn shifted<const NY: usize, const NZ: usize, const NI: usize>(
        &self,
        model: &Model<NX, NU, NY, NZ, NI>,
    ) -> Self {
        let next = |dx: &[f64; NX], du: &[f64; NU]| add(&times(&model.A, dx), &times(&model.B, du));
        let end = self.du.iter().fold(self.dx, |dx, du| next(&dx, du));
        let mut du = self.du;
        shift_in(&mut du, times(&model.K, &end));
        Self { dx: next(&self.dx, &self.now()), du }
    }
}

fn stage_offsets<'a, const NP: usize, const N: usize>(
    rows: &[StageRow<NP>],
    parameters: &[[f64; NP]; N],
    places: &mut impl Iterator<Item = &'a mut f64>,
) {
    for (row, place) in rows.iter().zip(places) {
        *place = parameters.get(row.stage).map_or(f64::NAN, |parameter| dot(&row.row, parameter));
    }
}

/// Its square, times any number of rows, is finite.
const LARGEST: f64 = 1e100;

fn finite_or_zero(limit: f64) -> f64 {
    if limit.is_finite() { limit.abs() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    #![expect(non_snake_case, reason = "the paper's symbols")]

    use super::Plan;
    use crate::tables::{DpcProblem, StageRow};

    /// Two states, two inputs, two stages; a row of each kind.
    fn problem() -> DpcProblem<2, 2, 6, 4, 1, 1, 1> {
        let mut T = [[0.0; 6]; 6];
        let mut V = [[0.0; 6]; 4];
        for (i, row) in T.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate().skip(i) {
                *entry = 1.0 + i as f64 - 0.5 * j as f64;
            }
            row[i] = 2.0 + i as f64;
        }
        for (k, row) in V.iter_mut().enumerate() {
            row[k] = 1.0;
        }
        DpcProblem {
            V,
            lower: [-1.0; 4],
            upper: [1.0, 1.0, 1.0, f64::INFINITY],
            tube: [[1.0, 2.0]],
            state: [StageRow { stage: 1, row: [3.0, 4.0] }],
            input: [StageRow { stage: 0, row: [5.0, 6.0] }],
            T,
            max_iterations: 10,
        }
    }

    #[test]
    fn unknowns_are_those_of_the_plan() {
        let plan = Plan { dx: [1.0, -2.0], du: [[3.0, 0.5], [-1.5, 4.0]] };
        let back: Plan<2, 2, 2> = problem().plan(&problem().unknowns(&plan));
        for (a, b) in back.dx.iter().chain(back.du.iter().flatten()).zip(plan.dx.iter().chain(plan.du.iter().flatten()))
        {
            assert!((a - b).abs() < 1e-12);
        }
    }

    /// The tube row is [1 2] with q = 1; the measurement may move it by 0.25.
    #[test]
    fn a_measurement_in_doubt_tightens_the_tube_unless_the_forecast_is_known() {
        let (problem, e, rest) = (problem(), [0.8, 0.0], [[0.0; 2]; 2]);
        let rests = |forecast: Option<&[f64; 2]>| {
            let mut instance = problem.at(&e, &rest, &rest);
            problem.doubt(&mut instance, &[0.25], &e, forecast);
            (instance.lower[0], instance.upper[0], instance.rests())
        };
        assert_eq!(rests(None), (-0.75, 0.75, false));
        assert_eq!(rests(Some(&[0.0, 0.0])), (-0.75, 0.8, true));
        assert_eq!(rests(Some(&[2.0, 0.0])), (-1.2, 0.75, false), "1.2 apart, 1.25 are possible");
        assert_eq!(rests(Some(&[2.1, 0.0])), (-0.75, 0.75, false), "1.3 apart: the forecast is refuted");
    }

    #[test]
    fn offsets_come_from_the_stage_of_the_row() {
        let problem = problem();
        let instance = problem.at(&[0.1, 0.2], &[[9.0, 9.0], [0.01, 0.02]], &[[0.03, 0.04], [9.0, 9.0]]);
        for (offset, expected) in instance.offset.iter().zip([0.5, 0.11, 0.39, 0.0]) {
            assert!((offset - expected).abs() < 1e-15);
        }
        assert!(instance.rests() && instance.is_finite());
        assert!(instance.admits(&[0.5, 0.89, 0.6, 1e9, 0.0, 0.0], 1e-9));
        assert!(!instance.admits(&[0.6, 0.0, 0.0, 0.0, 0.0, 0.0], 1e-9));
        assert!(!instance.admits(&[0.0, 0.0, 0.0, -1.1, 0.0, 0.0], 1e-9));
        assert!(!instance.admits(&[0.0, 0.0, 0.0, f64::INFINITY, 0.0, 0.0], 1e-9));
        assert!(!instance.admits(&[0.0, 0.0, 0.0, 0.0, 0.0, f64::NAN], 1e-9));
        assert!(!problem.at(&[1.0, 0.2], &[[0.0; 2]; 2], &[[0.0; 2]; 2]).rests());
        assert!(!problem.at(&[f64::NAN, 0.0], &[[0.0; 2]; 2], &[[0.0; 2]; 2]).rests());
        assert!(!problem.at(&[f64::MAX, f64::MAX], &[[0.0; 2]; 2], &[[0.0; 2]; 2]).is_finite());
    }
}
