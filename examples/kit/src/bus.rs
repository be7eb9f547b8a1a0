//! An in-process bus: what is sent in one period is there for the next, as bytes, as on a wire.

use dpc_runtime::{Message, Refused};

/// Datagrams on their way. Nodes are known by number.
#[derive(Debug, Clone, Default)]
pub struct Bus {
    datagrams: Vec<Datagram>,
}

/// A message as it crosses the bus: the step as `i64`, then yref and zref as `f64`, all with the lowest byte first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Datagram {
    pub from: usize,
    pub to: usize,
    pub bytes: Vec<u8>,
}

/// A datagram that is not `NY` outputs and `NZ` coupling outputs long.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WrongLength {
    pub expected: usize,
    pub got: usize,
}

/// Why a datagram was not filed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NotReceived {
    WrongLength(WrongLength),
    Refused(Refused),
}

impl Bus {
    pub fn send<const NY: usize, const NZ: usize>(&mut self, from: usize, to: usize, message: &Message<NY, NZ>) {
        self.pass(Datagram { from, to, bytes: encode(message) });
    }

    /// The same of a message that is encoded already.
    pub fn pass(&mut self, datagram: Datagram) {
        self.datagrams.push(datagram);
    }

    /// Takes what has been sent to `node` off the bus, in the order it was sent.
    pub fn receive(&mut self, node: usize) -> impl Iterator<Item = Datagram> {
        self.datagrams.extract_if(.., move |datagram| datagram.to == node)
    }
}

pub fn encode<const NY: usize, const NZ: usize>(message: &Message<NY, NZ>) -> Vec<u8> {
    let numbers = message.y_ref.iter().chain(&message.z_ref).flat_map(|number| number.to_le_bytes());
    message
        .step
        .to_le_bytes()
        .into_iter()
        .chain(numbers)
        .chain([u8::from(message.certified)])
        .chain(message.plan.to_le_bytes())
        .collect()
}

/// # Errors
/// The bytes are not as long as such a message.
pub fn decode<const NY: usize, const NZ: usize>(bytes: &[u8]) -> Result<Message<NY, NZ>, WrongLength> {
    let (words, rest) = bytes.as_chunks::<8>();
    let wrong = WrongLength { expected: 8 * (1 + NY + NZ) + 5, got: bytes.len() };
    match (words, rest) {
        ([step, numbers @ ..], [certified, plan @ ..]) if plan.len() == 4 && numbers.len() == NY + NZ => {
            let number = |k: usize| f64::from_le_bytes(numbers[k]);
            let (y_ref, z_ref) = (std::array::from_fn(number), std::array::from_fn(|k| number(NY + k)));
            Ok(Message {
                step: i64::from_le_bytes(*step),
                y_ref,
                z_ref,
                certified: *certified == 1,
                plan: plan.iter().rev().fold(0, |plan, byte| plan << 8 | u32::from(*byte)),
            })
        }
        _ => Err(wrong),
    }
}

impl std::fmt::Display for WrongLength {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "message of {} bytes, expected {}", self.got, self.expected)
    }
}

impl std::error::Error for WrongLength {}

impl std::fmt::Display for NotReceived {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::WrongLength(wrong) => wrong.fmt(f),
            Self::Refused(refused) => refused.fmt(f),
        }
    }
}

impl std::error::Error for NotReceived {}

#[cfg(test)]
mod tests {
    use super::{Bus, decode};
    use dpc_runtime::Message;

    const MESSAGE: Message<1, 2> =
        Message { step: -1, y_ref: [0.1], z_ref: [-2.5e-300, 7.0], certified: true, plan: 0x1234_5678 };

    #[test]
    fn messages_survive_the_wire_bit_by_bit() {
        let mut bus = Bus::default();
        bus.send(0, 1, &MESSAGE);
        let arrived: Vec<_> = bus.receive(1).collect();
        assert_eq!((arrived.len(), arrived[0].from, arrived[0].bytes.len()), (1, 0, 37));
        assert_eq!(decode::<1, 2>(&arrived[0].bytes), Ok(MESSAGE));
    }

    #[test]
    fn messages_reach_whom_they_are_for_once() {
        let mut bus = Bus::default();
        [(0, 1), (0, 2), (2, 1)].iter().for_each(|&(from, to)| bus.send(from, to, &MESSAGE));
        assert_eq!(bus.receive(1).map(|datagram| datagram.from).collect::<Vec<_>>(), [0, 2]);
        assert_eq!((bus.receive(1).count(), bus.receive(0).count(), bus.receive(2).count()), (0, 0, 1));
    }

    #[test]
    fn other_lengths_are_refused() {
        let lengths = [0, 24, 32, 36, 38, 45].map(|length| decode::<1, 2>(&vec![0; length]).is_err());
        assert_eq!(lengths, [true; 6]);
    }
}
