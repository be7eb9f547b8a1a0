//! Starting anywhere: the references of a start-up window, planned for the whole network.

use super::linear::{finite, times};
use super::problem::Plan;
use super::tables::{Model, Tables};
use super::{Real, precision};
use crate::refusal::StartError;

/// One subsystem's part of a start-up plan: xref_0, ..., xref_T with the inputs that bring them about, T >= N.
///
/// The compiler makes one for the whole network (its module `start` says what it keeps); all subsystems must start with
/// their part of the same one. It is plain data: an emitted file holds the plan for the start that `system.toml` states, and
/// a plan that was computed later is filled in the same way.
///
/// The references at step k <= T are
///
/// ```text
/// uref_k = u_k + Kx (xref_k - x_k) + Ke de_k,      de_{k+1} = de_k - C (xref_k - x_k),      de_{N-1} = 0
/// ```
///
/// with xref_{k+1} by (7a) from what the neighbours sent, as always. Where these follow the same plan, loads stay and messages
/// arrive, xref_k is x_k up to rounding, which the feedback keeps from adding up. At T the plan rests: eref_T = e + de_T is
/// what (7f) goes on from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StartPlan<'a, const NX: usize, const NU: usize, const NY: usize, const N: usize> {
    /// [`Tables::fingerprint`] of the tables that the plan was made for.
    pub design: u64,
    /// The number that all parts of one plan for the network share, and those of other plans do not; never 0.
    pub plan: u32,
    /// Steps 0, ..., T.
    pub points: &'a [PlannedPoint<NX, NU>],
    /// eref_T.
    pub e: [Real; NY],
    /// A solution of the first i-DPC problem: xhat_0 - xref_0 and uhat_k - uref_k.
    pub nominal: Plan<NX, NU, N>,
}

/// The planned reference at one step. In memory: x, then u, so that other languages can write one.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct PlannedPoint<const NX: usize, const NU: usize> {
    pub x: [Real; NX],
    /// At T that of (7f).
    pub u: [Real; NU],
}

/// What a plan says about the references at one step k: `before` is k - 1, `end` eref_T where k is T.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Passage<'a, const NX: usize, const NU: usize, const NY: usize> {
    pub before: &'a PlannedPoint<NX, NU>,
    pub at: &'a PlannedPoint<NX, NU>,
    pub end: Option<&'a [Real; NY]>,
}

impl<'a, const NX: usize, const NU: usize, const NY: usize, const N: usize> StartPlan<'a, NX, NU, NY, N> {
    /// # Errors
    /// It has fewer than N + 1 points, or a number in it is not finite.
    pub(crate) fn check(&self) -> Result<(), StartError> {
        if self.points.len() <= N {
            return Err(StartError::PlanTooShort);
        }
        if self.plan == 0 {
            return Err(StartError::NoPlan);
        }
        let nominal = finite(&self.nominal.dx) && self.nominal.du.iter().all(|du| finite(du));
        let points = self.points.iter().all(|point| finite(&point.x) && finite(&point.u));
        if nominal && points && finite(&self.e) { Ok(()) } else { Err(StartError::NotFinite) }
    }

    /// y_T and u_T: where the normal reference layer goes on.
    pub(crate) fn end<const NZ: usize, const NI: usize>(
        &self,
        model: &Model<NX, NU, NY, NZ, NI>,
    ) -> Option<([Real; NY], [Real; NU])> {
        self.points.last().map(|last| (times(&model.C, &last.x), last.u))
    }

    /// `None` where step k is past the plan.
    pub(crate) fn passage(&self, k: i64) -> Option<Passage<'_, NX, NU, NY>> {
        let k = usize::try_from(k).ok()?;
        let (before, at) = (self.points.get(k.checked_sub(1)?)?, self.points.get(k)?);
        let ends = k.checked_add(1) == Some(self.points.len());
        Some(Passage { before, at, end: ends.then_some(&self.e) })
    }
}

impl<
    R,
    const NX: usize,
    const NU: usize,
    const NY: usize,
    const NZ: usize,
    const NI: usize,
    const NJ: usize,
    const NC: usize,
    const NB: usize,
    const N: usize,
    const NV: usize,
    const NR: usize,
    const NT: usize,
    const NS: usize,
    const NQ: usize,
    const NH: usize,
> Tables<R, NX, NU, NY, NZ, NI, NJ, NC, NB, N, NV, NR, NT, NS, NQ, NH>
{
    /// A number that tables of another model, other gains or other sets do not have: what a [`StartPlan`] is recognised by.
    ///
    /// FNV-1a, with its upper half folded in after every number, over the bits of A, B, C, Cz, Dz, EL, K, Kx, Ke, row by row, u_min,
    /// u_max, drift, the limits of the problem and the offsets of its tube rows.
    pub fn fingerprint(&self) -> u64 {
        let model = &self.model;
        let mut hash = 0xcbf2_9ce4_8422_2325;
        let rows = [model.A.as_flattened(), model.B.as_flattened(), model.C.as_flattened()];
        let coupling = [model.Cz.as_flattened(), model.Dz.as_flattened(), model.EL.as_flattened()];
        let gains = [model.K.as_flattened(), model.Kx.as_flattened(), model.Ke.as_flattened()];
        let limits = [&model.u_min[..], &model.u_max, &model.drift];
        let problem = [&self.problem.lower[..], &self.problem.upper, self.problem.tube.as_flattened()];
        let parts = rows.iter().chain(&coupling).chain(&gains).chain(&limits).chain(&problem);
        for number in parts.copied().flatten() {
            // -0.0 and 0.0 are one number.
            hash = (hash ^ precision::bits(number + 0.0)).wrapping_mul(0x0100_0000_01b3);
            // Without this an even number of signs could change unseen: the top bit goes nowhere in a product.
            hash ^= hash >> 32;
        }
        hash
    }
}
