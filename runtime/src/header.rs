//! What the bytes of every message begin with, in either scalar type.

use crate::delivery::Refused;

/// Version of the layout that this runtime writes and reads.
pub const LAYOUT: u8 = 1;

/// Bytes before the numbers of a message.
pub const HEADER_BYTES: usize = 32;

const CERTIFIED: u16 = 1;

/// Whose messages: a subsystem of a network, in one design of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sender {
    /// A number that other designs of the network, and other networks, do not have.
    pub design: u64,
    /// Place of the subsystem in the network, counted from 0.
    pub place: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Header {
    /// Bytes of a number.
    pub real: u8,
    pub certified: bool,
    pub sender: Sender,
    pub step: i64,
    pub plan: u32,
    pub outputs: u16,
    pub coupling_outputs: u16,
}

impl Sender {
    /// Place of the subsystem that a message is from, by its bytes: for a receiver that gets those of all neighbours over one line.
    ///
    /// # Errors
    /// The message is too short, or of another layout.
    pub fn place_in(bytes: &[u8]) -> Result<u32, Refused> {
        Header::read(bytes).map(|header| header.sender.place)
    }

    /// Why a message is refused whose [`place_in`](Self::place_in) is that of no neighbour of this subsystem.
    pub fn stranger(&self, bytes: &[u8]) -> Refused {
        match Header::read(bytes).map(|header| header.sender) {
            Err(refused) => refused,
            Ok(sender) if sender.design != self.design => {
                Refused::OtherDesign { expected: self.design, got: sender.design }
            }
            Ok(sender) => Refused::NotHeard { sender: sender.place },
        }
    }
}

impl Header {
    pub fn to_bytes(self) -> [u8; HEADER_BYTES] {
        let flags = if self.certified { CERTIFIED } else { 0 };
        let mut bytes = [0; HEADER_BYTES];
        let written = [LAYOUT, self.real]
            .into_iter()
            .chain(flags.to_le_bytes())
            .chain(self.sender.place.to_le_bytes())
            .chain(self.sender.design.to_le_bytes())
            .chain(self.step.to_le_bytes())
            .chain(self.plan.to_le_bytes())
            .chain(self.outputs.to_le_bytes())
            .chain(self.coupling_outputs.to_le_bytes());
        bytes.iter_mut().zip(written).for_each(|(place, byte)| *place = byte);
        bytes
    }

    /// # Errors
    /// There are too few bytes, or they are of another layout.
    pub fn read(bytes: &[u8]) -> Result<Self, Refused> {
        // The layout is told by the first byte, however long the rest is.
        if let Some(got) = bytes.first().copied().filter(|layout| *layout != LAYOUT) {
            return Err(Refused::OtherLayout { expected: LAYOUT, got });
        }
        if bytes.len() < HEADER_BYTES {
            return Err(Refused::Length { expected: HEADER_BYTES, got: bytes.len() });
        }
        let mut rest = bytes;
        let [_, real] = take(&mut rest);
        let flags = u16::from_le_bytes(take(&mut rest));
        let place = u32::from_le_bytes(take(&mut rest));
        let design = u64::from_le_bytes(take(&mut rest));
        let header = Self {
            real,
            certified: flags & CERTIFIED != 0,
            sender: Sender { design, place },
            step: i64::from_le_bytes(take(&mut rest)),
            plan: u32::from_le_bytes(take(&mut rest)),
            outputs: u16::from_le_bytes(take(&mut rest)),
            coupling_outputs: u16::from_le_bytes(take(&mut rest)),
        };
        if flags & !CERTIFIED != 0 { Err(Refused::Malformed) } else { Ok(header) }
    }

    /// Whether it is what `sender` writes, with numbers of `real` bytes.
    pub fn check(&self, real: u8, sender: &Sender) -> Result<(), Refused> {
        if self.real != real {
            return Err(Refused::OtherScalar { expected: real, got: self.real });
        }
        if self.sender.design != sender.design {
            return Err(Refused::OtherDesign { expected: sender.design, got: self.sender.design });
        }
        if self.sender.place != sender.place {
            return Err(Refused::OtherSender { expected: sender.place, got: self.sender.place });
        }
        Ok(())
    }
}

/// The first bytes, which are there.
pub(crate) fn take<const COUNT: usize>(bytes: &mut &[u8]) -> [u8; COUNT] {
    let Some((first, rest)) = bytes.split_first_chunk() else { return [0; COUNT] };
    *bytes = rest;
    *first
}
