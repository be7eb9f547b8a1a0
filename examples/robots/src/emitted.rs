//! The three emitted controllers of `system.toml`.

use dpc_runtime::{StartError, SteadyState};

use crate::arena::Point;
use crate::robot::Started;

macro_rules! robot {
    ($name:ident { $($other:literal: $link:ident),* }) => {
        mod $name {
            use dpc_runtime::{StartError, SteadyState};
            use example_kit::bus::{Datagram, NotReceived, decode, encode};

            use crate::controllers::$name as own;
            use crate::robot::{Robot, Started, step};

            struct Process {
                controller: own::Controller,
                inbox: own::Inbox,
            }

            pub fn start(steady: &SteadyState<4, 2>) -> Result<Started<'static>, StartError> {
                let (controller, message) = own::start(steady)?;
                Ok((Box::new(Process { controller, inbox: own::Inbox::new() }), encode(&message)))
            }

            impl Robot for Process {
                fn receive(&mut self, datagram: &Datagram) -> Result<(), NotReceived> {
                    let message = decode(&datagram.bytes).map_err(NotReceived::WrongLength)?;
                    let accepted = match datagram.from {
                        $($other => self.inbox.accept(&own::$link, &message),)*
                        // A robot does not hear itself, and there are three.
                        _ => return Ok(()),
                    };
                    accepted.map_err(NotReceived::Refused)
                }

                step!(own::NH);
            }
        }
    };
}

robot!(robot_1 { 1: FROM_ROBOT_2, 2: FROM_ROBOT_3 });
robot!(robot_2 { 0: FROM_ROBOT_1, 2: FROM_ROBOT_3 });
robot!(robot_3 { 0: FROM_ROBOT_1, 1: FROM_ROBOT_2 });

/// All controllers with their references at rest at `positions`, counted from the centre.
///
/// # Errors
/// The first controller that refuses to start there.
pub fn start(positions: &[Point; 3]) -> Result<Vec<Started<'static>>, StartError> {
    let at = positions.map(|[x, y]| SteadyState { x: [x, 0.0, y, 0.0], u: [0.0; 2] });
    Ok(vec![robot_1::start(&at[0])?, robot_2::start(&at[1])?, robot_3::start(&at[2])?])
}
