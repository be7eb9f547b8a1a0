//! One mass's controller with its inbox, whether its tables were emitted or made at run time.

use dpc_runtime::{Control, Input, Telemetry};
use example_kit::bus::{Datagram, NotReceived};

/// What the closed loop needs of any mass's controller.
pub trait Node {
    /// Takes in what a neighbour sent.
    ///
    /// # Errors
    /// It is no message that was expected.
    fn receive(&mut self, datagram: &Datagram) -> Result<(), NotReceived>;

    /// What the controller would answer to the measured state `x` now. The step that follows is none the worse for it.
    fn probe(&mut self, x: &[f64; 2]) -> Input<2, 1, 1>;

    /// One sampling period.
    fn step(&mut self, x: &[f64; 2], set_point: f64) -> Answer;
}

/// What a step gives, and the message as it crosses the bus.
pub struct Answer {
    pub input: f64,
    pub message: Vec<u8>,
    pub control: Control,
    pub unguaranteed: bool,
    pub telemetry: Telemetry<2, 1, 1>,
}

/// A controller and what it sends first.
pub type Started<'a> = (Box<dyn Node + 'a>, Vec<u8>);

/// The step and the probe of a process with a `controller` and an `inbox`.
macro_rules! control {
    () => {
        fn probe(&mut self, x: &[f64; 2]) -> dpc_runtime::Input<2, 1, 1> {
            self.controller.input(x)
        }

        fn step(&mut self, x: &[f64; 2], set_point: f64) -> $crate::node::Answer {
            let step = self.controller.step(x, &[set_point], &mut self.inbox);
            $crate::node::Answer {
                input: step.input[0],
                message: example_kit::bus::encode(&step.message),
                control: step.status.control,
                unguaranteed: !step.status.is_guaranteed(),
                telemetry: step.telemetry,
            }
        }
    };
}
pub(crate) use control;
