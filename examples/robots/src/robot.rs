//! One robot's controller with its inbox, whether its tables were emitted or made at run time.

use dpc_planar::Clearance;
use dpc_runtime::{NotRedrawn, Status, Telemetry};
use example_kit::bus::{Datagram, NotReceived};

use crate::arena::Point;
use crate::rule::Rule;

/// What the closed loop needs of any robot's controller. Positions count from the centre.
pub trait Robot {
    /// Takes in what another robot sent.
    ///
    /// # Errors
    /// It is no message that was expected.
    fn receive(&mut self, datagram: &Datagram) -> Result<(), NotReceived>;

    /// One sampling period: redraws the rows with all others, then decides. `x`: (px, vx, py, vy).
    fn step(&mut self, x: &[f64; 4], goal: &Point, rule: Rule, clearance: &Clearance) -> Answer;
}

/// What a step gives, and the message as it crosses the bus.
#[derive(Debug, Clone)]
pub struct Answer {
    /// (ax, ay) for the period, cm/s^2.
    pub acceleration: [f64; 2],
    pub message: Vec<u8>,
    /// yref_{t+N}.
    pub y_ref: Point,
    pub verdict: Verdict,
    pub telemetry: Telemetry<4, 2, 2>,
    /// Rows that were refused, with the other robot's place among the others.
    pub refused: Vec<(usize, NotRedrawn)>,
}

/// [`Status`] without the number of neighbours in its type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Verdict {
    pub control: dpc_runtime::Control,
    pub references: dpc_runtime::References,
    pub guaranteed: bool,
}

impl<const NB: usize> From<Status<NB>> for Verdict {
    fn from(status: Status<NB>) -> Self {
        Self { control: status.control, references: status.references, guaranteed: status.is_guaranteed() }
    }
}

/// A controller and what it sends first.
pub type Started<'a> = (Box<dyn Robot + 'a>, Vec<u8>);

/// The step of a process with a `controller` and an `inbox`.
macro_rules! step {
    ($rows:expr) => {
        fn step(
            &mut self,
            x: &[f64; 4],
            goal: &$crate::arena::Point,
            rule: $crate::rule::Rule,
            clearance: &dpc_planar::Clearance,
        ) -> $crate::robot::Answer {
            let mut refused = Vec::new();
            for row in 0..$rows {
                if let Err(why) = self.controller.redraw(row, &self.inbox, |meeting| rule.draw(meeting, clearance)) {
                    refused.push((row, why));
                }
            }
            let step = self.controller.step(x, goal, &mut self.inbox);
            $crate::robot::Answer {
                acceleration: step.input,
                message: example_kit::bus::encode(&step.message),
                y_ref: step.message.y_ref,
                verdict: step.status.into(),
                telemetry: step.telemetry,
                refused,
            }
        }
    };
}
pub(crate) use step;
