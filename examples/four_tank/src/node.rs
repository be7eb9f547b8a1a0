//! One subsystem's controller with its inbox, as a process of its own would hold them.

use dpc_runtime::{Controller, Inbox, Input, Link, ReferenceLayer, Step};

pub use crate::bus::NotReceived;
use crate::bus::{Datagram, decode};

/// What the closed loop needs of a controller of two tanks and one pump that hears one neighbour.
pub trait Node {
    /// Takes in what the neighbour sent.
    ///
    /// # Errors
    /// It is no message that was expected.
    fn receive(&mut self, datagram: &Datagram) -> Result<(), NotReceived>;

    /// Takes in the loads of this step, before it; most nodes have none.
    fn measure(&mut self, _loads: &[f64]) {}

    /// What the controller would answer to the measured state `x` now. The step that follows is none the worse for it.
    fn probe(&mut self, x: &[f64; 2]) -> Input<2, 1, 1>;

    /// One sampling period.
    fn step(&mut self, x: &[f64; 2], set_point: f64) -> Step<2, 1, 1, 1, 1>;
}

/// A [`Node`] made of emitted tables.
pub struct Process<
    R: 'static,
    const N: usize,
    const NV: usize,
    const NR: usize,
    const NT: usize,
    const NS: usize,
    const NQ: usize,
> {
    controller: Controller<'static, R, 2, 1, 1, 1, 1, 0, 0, 1, N, NV, NR, NT, NS, NQ>,
    inbox: Inbox<1, 0, 1>,
    neighbour: Link<1, 1>,
}

impl<R, const N: usize, const NV: usize, const NR: usize, const NT: usize, const NS: usize, const NQ: usize>
    Process<R, N, NV, NR, NT, NS, NQ>
{
    /// A process that has heard nothing yet; `neighbour` says where what it hears belongs.
    pub fn new(
        controller: Controller<'static, R, 2, 1, 1, 1, 1, 0, 0, 1, N, NV, NR, NT, NS, NQ>,
        neighbour: Link<1, 1>,
    ) -> Self {
        Self { controller, inbox: Inbox::new(), neighbour }
    }
}

impl<
    R: ReferenceLayer<1, 0, 0>,
    const N: usize,
    const NV: usize,
    const NR: usize,
    const NT: usize,
    const NS: usize,
    const NQ: usize,
> Node for Process<R, N, NV, NR, NT, NS, NQ>
{
    fn receive(&mut self, datagram: &Datagram) -> Result<(), NotReceived> {
        let message = decode(&datagram.bytes).map_err(NotReceived::WrongLength)?;
        self.inbox.accept(&self.neighbour, &message).map_err(NotReceived::Refused)
    }

    fn probe(&mut self, x: &[f64; 2]) -> Input<2, 1, 1> {
        self.controller.input(x)
    }

    fn step(&mut self, x: &[f64; 2], set_point: f64) -> Step<2, 1, 1, 1, 1> {
        self.controller.step(x, &[set_point], &mut self.inbox)
    }
}
