//! What neighbours tell each other, once per period.

use super::Real;
use super::linear::finite;
use super::tables::Link;
use crate::delivery::{Delivery, Refused};

/// What a subsystem tells its neighbours at step t: its references at t + N.
///
/// A neighbour needs it at its own step t + 1: a whole period for one message.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Message<const NY: usize, const NZ: usize> {
    /// t, counted from 0; the message of the start is that of step -1. At 64 bits the count never wraps.
    pub step: i64,
    /// yref_{t+N}.
    pub y_ref: [Real; NY],
    /// zref_{t+N}.
    pub z_ref: [Real; NZ],
    /// Whether the true state of the sender is known to lie within E_i of its plan at step t, so that its z_t is within Z_i of
    /// zref_t. A receiver that measures with errors rests its forecast of the next state on it.
    pub certified: bool,
    /// [`StartPlan::plan`](super::StartPlan::plan) where zref_{t+N} is one of a start-up plan, else 0. Neighbours must be on the same
    /// one.
    pub plan: u32,
}

/// Where a subsystem collects its neighbours' messages between two steps.
///
/// `NI` imported coupling outputs, `NJ` imported outputs, `NB` neighbours. Before step t it takes the messages of step
/// t - 1, which step t needs, and those of step t from neighbours that are ahead. What did not arrive in sequence
/// keeps its last value.
#[derive(Debug, Clone)]
pub struct Inbox<const NI: usize, const NJ: usize, const NB: usize> {
    expected: i64,
    due: Sheet<NI, NJ, NB>,
    early: Sheet<NI, NJ, NB>,
}

/// The neighbours' references at one step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sheet<const NI: usize, const NJ: usize, const NB: usize> {
    pub z: [Real; NI],
    pub y: [Real; NJ],
    pub certified: [bool; NB],
    pub plans: [u32; NB],
    pub deliveries: [Delivery; NB],
}

impl<const NI: usize, const NJ: usize, const NB: usize> Inbox<NI, NJ, NB> {
    /// An inbox that expects the messages of the neighbours' starts. Values that never arrived are zero.
    pub const fn new() -> Self {
        Self { expected: -1, due: Sheet::EMPTY, early: Sheet::EMPTY }
    }

    /// Files a neighbour's message. A link of another shape than the message does not compile.
    ///
    /// # Errors
    /// The message is out of sequence, not finite, or the link is none of this inbox.
    pub fn accept<const NYJ: usize, const NZJ: usize>(
        &mut self,
        link: &Link<NYJ, NZJ>,
        message: &Message<NYJ, NZJ>,
    ) -> Result<(), Refused> {
        let early = self.expected.checked_add(1) == Some(message.step);
        if !early && message.step != self.expected {
            self.due.note(link.slot, Delivery::OutOfSequence(message.step));
            return Err(Refused::OutOfSequence { expected: self.expected, got: message.step });
        }
        let delivery = if message.is_finite() { Delivery::InSequence } else { Delivery::NotFinite };
        let sheet = if early { &mut self.early } else { &mut self.due };
        if delivery == Delivery::NotFinite {
            sheet.note(link.slot, delivery);
            return Err(Refused::NotFinite);
        }
        sheet.write(link, message)?;
        if !early && !self.early.arrived(link.slot) {
            // The later sheet holds the latest values there are, for the case that nothing newer arrives.
            self.early.write(link, message)?;
            self.early.set(link.slot, Delivery::Missing);
        }
        Ok(())
    }

    /// Bytes came that hold no message of neighbour `slot`, of whatever step.
    pub(crate) fn refuse(&mut self, slot: usize, trouble: Delivery) {
        self.due.note(slot, trouble);
    }

    /// Whether the message of the step expected next has arrived from neighbour `slot`.
    pub fn arrived(&self, slot: usize) -> bool {
        self.due.arrived(slot)
    }

    /// Whether the message of step `step` from neighbour `slot` is the one at hand.
    pub(crate) fn holds(&self, slot: usize, step: i64) -> bool {
        self.expected == step && self.due.arrived(slot)
    }

    /// yref of the neighbours: what is at hand for the step that comes next.
    pub(crate) fn outputs(&self) -> &[Real; NJ] {
        &self.due.y
    }

    /// The step whose messages are expected next.
    pub fn expected(&self) -> i64 {
        self.expected
    }

    /// Hands over what there is of step `step` and goes on to expect the messages of the step after.
    pub(crate) fn collect(&mut self, step: i64) -> Sheet<NI, NJ, NB> {
        let mut sheet = self.due;
        if self.expected != step {
            sheet.deliveries = [Delivery::OutOfSequence(self.expected); NB];
        }
        self.due = self.early;
        self.early.deliveries = [Delivery::Missing; NB];
        if self.expected != step {
            self.due.deliveries = [Delivery::Missing; NB];
        }
        self.expected = step.wrapping_add(1);
        sheet
    }
}

impl<const NI: usize, const NJ: usize, const NB: usize> Default for Inbox<NI, NJ, NB> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const NY: usize, const NZ: usize> Message<NY, NZ> {
    /// Whether every number in it is finite.
    pub fn is_finite(&self) -> bool {
        finite(&self.y_ref) && finite(&self.z_ref)
    }
}

impl<const NI: usize, const NJ: usize, const NB: usize> Sheet<NI, NJ, NB> {
    const EMPTY: Self = Self {
        z: [0.0; NI],
        y: [0.0; NJ],
        certified: [false; NB],
        plans: [0; NB],
        deliveries: [Delivery::Missing; NB],
    };

    fn arrived(&self, slot: usize) -> bool {
        self.deliveries.get(slot) == Some(&Delivery::InSequence)
    }

    /// Whether every neighbour's message has arrived and says that the sender is certified.
    pub fn all_certified(&self) -> bool {
        let neighbours = self.deliveries.iter().zip(&self.certified);
        neighbours.fold(true, |all, (delivery, certified)| all & (*delivery == Delivery::InSequence) & certified)
    }

    fn set(&mut self, slot: usize, delivery: Delivery) {
        if let Some(place) = self.deliveries.get_mut(slot) {
            *place = delivery;
        }
    }

    /// Keeps trouble in mind unless the right message has arrived.
    fn note(&mut self, slot: usize, trouble: Delivery) {
        if !self.arrived(slot) {
            self.set(slot, trouble);
        }
    }

    fn write<const NYJ: usize, const NZJ: usize>(
        &mut self,
        link: &Link<NYJ, NZJ>,
        message: &Message<NYJ, NZJ>,
    ) -> Result<(), Refused> {
        let z = places::<NZJ>(&mut self.z, link.z)?;
        let y = places::<NYJ>(&mut self.y, link.y)?;
        let delivery = self.deliveries.get_mut(link.slot).ok_or(Refused::NoSuchSlot)?;
        let certified = self.certified.get_mut(link.slot).ok_or(Refused::NoSuchSlot)?;
        let plan = self.plans.get_mut(link.slot).ok_or(Refused::NoSuchSlot)?;
        z.iter_mut()
            .zip(&message.z_ref)
            .chain(y.iter_mut().zip(&message.y_ref))
            .for_each(|(place, value)| *place = *value);
        *delivery = Delivery::InSequence;
        *certified = message.certified;
        *plan = message.plan;
        Ok(())
    }
}

/// The places of `count` values from `first` on; none where the link does not import them.
fn places<const COUNT: usize>(values: &mut [Real], first: Option<usize>) -> Result<&mut [Real], Refused> {
    match first {
        None => Ok(&mut []),
        Some(first) => {
            let end = first.checked_add(COUNT).ok_or(Refused::NoSuchSlot)?;
            values.get_mut(first..end).ok_or(Refused::NoSuchSlot)
        }
    }
}
