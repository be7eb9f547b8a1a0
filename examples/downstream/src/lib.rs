//! Firmware of the eastern greenhouse: what runs between its sensor, its valve and the bus.
//!
//! Outside of the compiler's workspace, as a crate of a user's is. Three lines bring the controllers in: the one in `build.rs`, the
//! dependency on the compiler, and the macro below.
#![no_std]
#![forbid(unsafe_code)]
#![warn(clippy::pedantic, missing_docs)]

use controllers::east;
use dpc_runtime::{Refused, StartError};

/// What the compiler makes of `system.toml`.
pub mod controllers {
    dpc_runtime::include_controllers!("greenhouses");
}

/// The node: a controller, and what has arrived for it.
#[derive(Debug)]
pub struct Node {
    controller: east::Controller,
    inbox: east::Inbox,
}

/// What a period gives: the valve's position, the message for the neighbour, and whether the guarantee holds.
#[derive(Debug, Clone, Copy)]
pub struct Period {
    /// Percent, as deviation.
    pub heating: f64,
    /// Due at the neighbour before its next period.
    pub message: [u8; east::MESSAGE_BYTES],
    /// Otherwise the status says what broke.
    pub guaranteed: bool,
}

impl Node {
    /// At the operating point, with the first message.
    ///
    /// # Errors
    /// The operating point is no start; see [`StartError`].
    pub fn start() -> Result<(Self, [u8; east::MESSAGE_BYTES]), StartError> {
        let (controller, message) = east::start(&east::steady_state(&[0.0; east::NETWORK_NY]))?;
        Ok((Self { controller, inbox: east::Inbox::new() }, east::to_bytes(&message)))
    }

    /// A message from the bus.
    ///
    /// # Errors
    /// It is none that this node hears; see [`Refused`].
    pub fn hear(&mut self, bytes: &[u8]) -> Result<(), Refused> {
        east::accept_bytes(&mut self.inbox, bytes)
    }

    /// One period: measured temperatures of air and soil, and the set-point of the air.
    pub fn period(&mut self, measured: [f64; east::NX], set_point: f64) -> Period {
        let step = self.controller.step(&measured, &[set_point], &mut self.inbox);
        let [heating] = step.input;
        Period { heating, message: east::to_bytes(&step.message), guaranteed: step.status.is_guaranteed() }
    }
}

#[cfg(test)]
mod tests {
    use super::Node;
    use super::controllers::{network, west};

    /// The node and its neighbour, by bytes, on the plant.
    #[test]
    fn it_heats_to_the_set_point_and_keeps_its_limits() {
        let (mut east, mut from_east) = Node::start().unwrap();
        let (mut other, message) = west::start(&west::steady_state(&[0.0; west::NETWORK_NY])).unwrap();
        let (mut inbox, mut from_west) = (west::Inbox::new(), west::to_bytes(&message));
        let mut x = [0.0; network::NX];
        for _ in 0..400 {
            east.hear(&from_west).unwrap();
            west::accept_bytes(&mut inbox, &from_east).unwrap();
            let period = east.period([x[0], x[1]], 0.8);
            let step = other.step(&[x[2], x[3]], &[-0.8], &mut inbox);
            assert!(period.guaranteed && step.status.is_guaranteed());
            let u = [period.heating, step.input[0]];
            assert!(network::margins(&x, &u).iter().all(|margin| *margin >= 0.0));
            (from_east, from_west) = (period.message, west::to_bytes(&step.message));
            x = network::plant(&x, &u, &[]);
        }
        let [y, z] = network::outputs(&x);
        assert!((y - 0.8).abs() < 0.01 && (z + 0.8).abs() < 0.01, "{y} {z}");
    }

    #[test]
    fn it_refuses_what_is_no_message() {
        let (mut east, own) = Node::start().unwrap();
        assert!(east.hear(&[1, 2, 3]).is_err());
        assert!(east.hear(&own).is_err(), "its own");
    }
}
