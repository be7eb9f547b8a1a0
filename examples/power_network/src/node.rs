//! One area's controller with its inbox and what it knows of its load, as a process of its own would hold them.

use dpc_runtime::{Control, Input, StartError, Telemetry};
use example_kit::bus::{Datagram, NotReceived, decode, encode};

use crate::areas::{AREAS, NX};
use crate::files::{Design, Known, Plant};

/// What the closed loop needs of any area's controller.
pub trait Node {
    /// Takes in what a neighbour sent.
    ///
    /// # Errors
    /// It is no message that was expected.
    fn receive(&mut self, datagram: &Datagram) -> Result<(), NotReceived>;

    /// What the controller would answer to the measured state `x` now. The step that follows is none the worse for it.
    fn probe(&mut self, x: &[f64; NX]) -> Input<NX, 1, 1>;

    /// One sampling period; `load` is looked at by those who measure it.
    fn step(&mut self, x: &[f64; NX], load: f64, set_point: f64) -> Answer;
}

/// What a step gives, and the message as it crosses the bus.
pub struct Answer {
    pub input: f64,
    pub message: Vec<u8>,
    pub control: Control,
    pub unguaranteed: bool,
    /// Whether the load keeps what the design assumes of it.
    pub within: bool,
    pub telemetry: Telemetry<NX, 1, 1>,
}

/// A controller and what it sends first.
pub type Started = (Box<dyn Node>, Vec<u8>);

/// All controllers of a design with their references at rest at the angles `y`, under the loads `d` where these are measured.
///
/// # Errors
/// The first controller that refuses to start there.
pub fn start(design: Design, y: &[f64; AREAS], d: &[f64; AREAS]) -> Result<Vec<Started>, StartError> {
    match (design.plant, design.loads) {
        (Plant::Held, Known::Measured) => measured::start(y, d),
        (Plant::Held, Known::Unknown) => unknown::start(y),
        (_, Known::Measured) => exact::start(y, d),
        (_, Known::Unknown) => exact_unknown::start(y),
    }
}

/// A process for one emitted area; `$neighbour` are the numbers of those it hears, `$link` where their messages go.
macro_rules! area {
    (measured $design:ident $area:ident $index:literal { $($neighbour:literal: $link:ident),* }) => {
        mod $area {
            use crate::$design::$area as own;
            area!(common own { $($neighbour: $link),* });

            pub struct Process {
                controller: own::Controller,
                inbox: own::Inbox,
                loads: own::Loads,
            }

            pub fn start(y: &[f64; AREAS], d: &[f64; AREAS]) -> Result<Started, StartError> {
                let (controller, loads, message) = own::start(&own::steady_state(y, d), &[d[$index]])?;
                Ok((Box::new(Process { controller, inbox: own::Inbox::new(), loads }), encode(&message)))
            }

            impl Process {
                fn control(&mut self, x: &[f64; NX], load: f64, set_point: f64) -> (own::Step, bool) {
                    let load = self.loads.admit(&[load]);
                    (self.controller.step_under(x, &[set_point], &load, &mut self.inbox), load.within)
                }
            }
        }
    };
    (unknown $design:ident $area:ident $index:literal { $($neighbour:literal: $link:ident),* }) => {
        mod $area {
            use crate::$design::$area as own;
            area!(common own { $($neighbour: $link),* });

            pub struct Process {
                controller: own::Controller,
                inbox: own::Inbox,
            }

            pub fn start(y: &[f64; AREAS]) -> Result<Started, StartError> {
                let (controller, message) = own::start(&own::steady_state(y))?;
                Ok((Box::new(Process { controller, inbox: own::Inbox::new() }), encode(&message)))
            }

            impl Process {
                fn control(&mut self, x: &[f64; NX], _load: f64, set_point: f64) -> (own::Step, bool) {
                    (self.controller.step(x, &[set_point], &mut self.inbox), true)
                }
            }
        }
    };
    (common $own:ident { $($neighbour:literal: $link:ident),* }) => {
        use super::{AREAS, Answer, Datagram, Input, NX, Node, NotReceived, StartError, Started, decode, encode};

        impl Node for Process {
            fn receive(&mut self, datagram: &Datagram) -> Result<(), NotReceived> {
                let accepted = match datagram.from {
                    $($neighbour => {
                        let message = decode(&datagram.bytes).map_err(NotReceived::WrongLength)?;
                        self.inbox.accept(&$own::$link, &message)
                    })*
                    // Nobody else is a neighbour, and neighbours alone are sent to.
                    _ => return Ok(()),
                };
                accepted.map_err(NotReceived::Refused)
            }

            fn probe(&mut self, x: &[f64; NX]) -> Input<NX, 1, 1> {
                self.controller.input(x)
            }

            fn step(&mut self, x: &[f64; NX], load: f64, set_point: f64) -> Answer {
                let (step, within) = self.control(x, load, set_point);
                Answer {
                    input: step.input[0],
                    message: encode(&step.message),
                    control: step.status.control,
                    unguaranteed: !step.status.is_guaranteed(),
                    within,
                    telemetry: step.telemetry,
                }
            }
        }
    };
}

/// The four areas of one design.
macro_rules! network {
    ($known:ident $design:ident ($($argument:ident),*)) => {
        mod $design {
            use super::{AREAS, Answer, Datagram, Input, NX, Node, NotReceived, StartError, Started, decode, encode};

            area!($known $design area_1 0 { 1: FROM_AREA_2 });
            area!($known $design area_2 1 { 0: FROM_AREA_1, 2: FROM_AREA_3 });
            area!($known $design area_3 2 { 1: FROM_AREA_2, 3: FROM_AREA_4 });
            area!($known $design area_4 3 { 2: FROM_AREA_3 });

            pub fn start($($argument: &[f64; AREAS]),*) -> Result<Vec<Started>, StartError> {
                Ok(vec![
                    area_1::start($($argument),*)?,
                    area_2::start($($argument),*)?,
                    area_3::start($($argument),*)?,
                    area_4::start($($argument),*)?,
                ])
            }
        }
    };
}

network!(measured measured(y, d));
network!(unknown unknown(y));
network!(measured exact(y, d));
network!(unknown exact_unknown(y));
