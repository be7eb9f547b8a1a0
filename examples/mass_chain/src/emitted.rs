//! The controllers that were emitted for ten masses.

use dpc_runtime::StartError;
use example_kit::bus::{Datagram, NotReceived, decode, encode};

use crate::chain::EMITTED;
use crate::node::{Node, Started, control};

/// All of them at rest at q = 0.
///
/// # Errors
/// The first controller that refuses to start there.
pub fn start() -> Result<Vec<Started<'static>>, StartError> {
    STARTS.iter().map(|start| start()).collect()
}

/// A process for one emitted mass; the numbers are those of the masses it hears.
macro_rules! mass {
    ($mass:ident { $($neighbour:literal: $link:ident),* }) => {
        mod $mass {
            use super::{Datagram, EMITTED, Node, NotReceived, StartError, Started, control, decode, encode};
            use crate::controllers::$mass as own;

            struct Process {
                controller: own::Controller,
                inbox: own::Inbox,
            }

            pub fn start() -> Result<Started<'static>, StartError> {
                let (controller, message) = own::start(&own::steady_state(&[0.0; EMITTED]))?;
                Ok((Box::new(Process { controller, inbox: own::Inbox::new() }), encode(&message)))
            }

            impl Node for Process {
                fn receive(&mut self, datagram: &Datagram) -> Result<(), NotReceived> {
                    let message = decode(&datagram.bytes).map_err(NotReceived::WrongLength)?;
                    let accepted = match datagram.from {
                        $($neighbour => self.inbox.accept(&own::$link, &message),)*
                        // Nobody else is a neighbour, and neighbours alone are sent to.
                        _ => Ok(()),
                    };
                    accepted.map_err(NotReceived::Refused)
                }

                control!();
            }
        }
    };
}

mass!(mass_1 { 1: FROM_MASS_2 });
mass!(mass_2 { 0: FROM_MASS_1, 2: FROM_MASS_3 });
mass!(mass_3 { 1: FROM_MASS_2, 3: FROM_MASS_4 });
mass!(mass_4 { 2: FROM_MASS_3, 4: FROM_MASS_5 });
mass!(mass_5 { 3: FROM_MASS_4, 5: FROM_MASS_6 });
mass!(mass_6 { 4: FROM_MASS_5, 6: FROM_MASS_7 });
mass!(mass_7 { 5: FROM_MASS_6, 7: FROM_MASS_8 });
mass!(mass_8 { 6: FROM_MASS_7, 8: FROM_MASS_9 });
mass!(mass_9 { 7: FROM_MASS_8, 9: FROM_MASS_10 });
mass!(mass_10 { 8: FROM_MASS_9 });

type Start = fn() -> Result<Started<'static>, StartError>;

const STARTS: [Start; EMITTED] = [
    mass_1::start,
    mass_2::start,
    mass_3::start,
    mass_4::start,
    mass_5::start,
    mass_6::start,
    mass_7::start,
    mass_8::start,
    mass_9::start,
    mass_10::start,
];
