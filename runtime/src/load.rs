//! Measured disturbances: from what is measured now to what the reference and nominal models are driven by.

use super::linear::{clip, shift_in, times};
use super::tables::LoadModel;
use super::{Real, precision};
use crate::refusal::StartError;

/// A load counts as inside its bounds, and its change as inside its rate, up to this, relative to the range.
const INSIDE: Real = precision::KEPT;

/// The measured loads of one subsystem: M d acts on its states.
///
/// The references at t + N take the load at t + N - 1, of which d_t is what is known; so the reference model (7a) and the
/// nominal model (15) at step k are driven by dref_k = d_{k-(N-1)}, confined to the bounds and rates of the design. What the
/// load has changed since is charged to W_i.
#[derive(Debug, Clone)]
pub struct Loads<'a, const ND: usize, const NX: usize, const N: usize> {
    model: &'a LoadModel<ND, NX>,
    /// t of the next call.
    step: i64,
    /// dref of this step, ..., t + N - 1.
    ahead: [[Real; ND]; N],
}

/// What the loads of one step mean for the controller; see [`Loads::admit`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load<const NX: usize> {
    /// t, of the controller's step that this is for; -1 at the start.
    pub step: i64,
    /// M dref_{t+N-1}: what the references at t + N take.
    pub push: [Real; NX],
    /// Whether the load keeps what the design assumes of it: |d_t - dref_t| within what is charged to W_i. Where it does not,
    /// the next state may leave its tube, as under any disturbance outside W_i, and [`Status`](crate::Status) says so; the
    /// references stay admissible.
    pub within: bool,
}

impl<'a, const ND: usize, const NX: usize, const N: usize> Loads<'a, ND, NX, N> {
    /// At rest under the loads `d`, and what they mean for the start of the controller.
    ///
    /// # Errors
    /// A load is beyond the bounds the design was made for.
    pub fn start(model: &'a LoadModel<ND, NX>, d: &[Real; ND]) -> Result<(Self, Load<NX>), StartError> {
        let bounds = model.min.iter().zip(&model.max);
        let inside = |(d, (min, max)): (&Real, (&Real, &Real))| {
            let tolerance = INSIDE * (max - min);
            (min - tolerance..=max + tolerance).contains(d)
        };
        match d.iter().zip(bounds).position(|load| !inside(load)) {
            Some(load) => Err(StartError::LoadOutside { load }),
            None => {
                let load = Load { step: -1, push: times(&model.M, d), within: true };
                Ok((Self { model, step: 0, ahead: [*d; N] }, load))
            }
        }
    }

    /// Takes in the loads measured at this step; once per step, before the controller's. A load that is not a number is taken
    /// to have stayed.
    pub fn admit(&mut self, d: &[Real; ND]) -> Load<NX> {
        let newest = self.confined(d);
        shift_in(&mut self.ahead, newest);
        // The load of the start, or of N - 1 steps ago, is dref_t.
        let within = self.ahead.first().is_some_and(|now| self.keeps(d, now));
        let step = self.step;
        self.step = step.wrapping_add(1);
        Load { step, push: times(&self.model.M, &newest), within }
    }

    /// d within the rates around the newest dref, and within the bounds.
    fn confined(&self, d: &[Real; ND]) -> [Real; ND] {
        let mut newest = self.ahead.last().copied().unwrap_or([0.0; ND]);
        let limits = self.model.rate.iter().zip(self.model.min.iter().zip(&self.model.max));
        for ((entry, d), (rate, (min, max))) in newest.iter_mut().zip(d).zip(limits) {
            let wanted = if d.is_finite() { *d } else { *entry };
            *entry = clip(clip(wanted, *entry - rate, *entry + rate), *min, *max);
        }
        newest
    }

    fn keeps(&self, d: &[Real; ND], now: &[Real; ND]) -> bool {
        let ranges = self.model.max.iter().zip(&self.model.min).map(|(max, min)| max - min);
        let charged = self.model.lag.iter().zip(ranges).map(|(lag, range)| lag + INSIDE * range);
        d.iter().zip(now).zip(charged).all(|((d, now), charged)| (d - now).abs() <= charged)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Real;
    use super::super::tables::LoadModel;
    use super::{Load, Loads};
    use crate::refusal::StartError;

    /// N = 3: the references are two steps ahead.
    const MODEL: LoadModel<1, 2> = LoadModel { M: [[2.0], [0.0]], min: [-1.0], max: [1.0], rate: [0.25], lag: [0.5] };

    fn started() -> Loads<'static, 1, 2, 3> {
        Loads::start(&MODEL, &[0.5]).unwrap().0
    }

    #[test]
    fn a_start_outside_the_bounds_is_refused() {
        let start = |d| Loads::<1, 2, 3>::start(&MODEL, &[d]).map(|(_, load)| load);
        assert_eq!(start(0.5), Ok(Load { step: -1, push: [1.0, 0.0], within: true }));
        assert_eq!(start(1.5), Err(StartError::LoadOutside { load: 0 }));
        assert_eq!(start(Real::NAN), Err(StartError::LoadOutside { load: 0 }));
    }

    #[test]
    fn loads_that_keep_their_rate_are_within_and_pushed_as_they_are() {
        let mut loads = started();
        for (step, d) in (0..).zip([0.5, 0.75, 1.0, 0.75, 0.5, 0.25, 0.0, -0.25]) {
            assert_eq!(loads.admit(&[d]), Load { step, push: [2.0 * d, 0.0], within: true });
        }
    }

    #[test]
    fn a_jump_is_taken_at_its_rate_and_said_until_the_references_have_caught_up() {
        let mut loads = started();
        let pushes: [_; 8] = core::array::from_fn(|_| loads.admit(&[-0.5]));
        assert_eq!(pushes.map(|load| load.push[0]), [0.5, 0.0, -0.5, -1.0, -1.0, -1.0, -1.0, -1.0]);
        // dref_t: 0.5, 0.5, 0.25, 0, ...; the difference to -0.5 must be 0.5 at most.
        assert_eq!(pushes.map(|load| load.within), [false, false, false, true, true, true, true, true]);
    }

    #[test]
    fn a_load_beyond_its_bounds_is_confined_and_one_that_is_no_number_stays() {
        let mut loads = started();
        let pushes: [_; 4] = core::array::from_fn(|_| loads.admit(&[1.75]));
        assert_eq!(pushes.map(|load| load.push[0]), [1.5, 2.0, 2.0, 2.0]);
        assert!(!pushes[3].within);
        assert_eq!(loads.admit(&[Real::NAN]), Load { step: 4, push: [2.0, 0.0], within: false });
    }
}
