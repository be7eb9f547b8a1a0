//! Messages as bytes: one fixed layout, the same on every machine.

use super::Real;
use super::message::{Inbox, Message};
use super::tables::Link;
use crate::delivery::Refused;
use crate::header::{HEADER_BYTES, Header, Sender, take};

/// Bytes of a number: what tells the scalar types apart.
const REAL: u8 = size_of::<Real>() as u8;

impl<const NY: usize, const NZ: usize> Message<NY, NZ> {
    /// Length of the message as bytes.
    pub const BYTES: usize = HEADER_BYTES + size_of::<Real>() * (NY + NZ);

    /// The message of `sender` as bytes. `BYTES` must be [`Self::BYTES`], or it does not compile; an emitted file has a
    /// function that knows both. The layout is in the crate's documentation.
    pub fn to_bytes<const BYTES: usize>(&self, sender: &Sender) -> [u8; BYTES] {
        const {
            assert!(BYTES == Self::BYTES, "a message has Message::BYTES bytes");
            assert!(NY <= 65535 && NZ <= 65535, "outputs are counted in 16 bits");
        }
        let header = Header {
            real: REAL,
            certified: self.certified,
            sender: *sender,
            step: self.step,
            plan: self.plan,
            outputs: NY as u16,
            coupling_outputs: NZ as u16,
        };
        let numbers = self.y_ref.iter().chain(&self.z_ref).flat_map(|number| number.to_le_bytes());
        let mut bytes = [0; BYTES];
        bytes.iter_mut().zip(header.to_bytes().into_iter().chain(numbers)).for_each(|(place, byte)| *place = byte);
        bytes
    }

    /// The message that `sender` wrote.
    ///
    /// # Errors
    /// The bytes are no message of that sender: of another layout, scalar type, design or subsystem, in this order, or of the wrong
    /// length. Whether the numbers are finite, [`Inbox::accept`] asks.
    pub fn from_bytes(sender: &Sender, bytes: &[u8]) -> Result<Self, Refused> {
        let header = Header::read(bytes)?;
        header.check(REAL, sender)?;
        if bytes.len() != Self::BYTES {
            return Err(Refused::Length { expected: Self::BYTES, got: bytes.len() });
        }
        if (usize::from(header.outputs), usize::from(header.coupling_outputs)) != (NY, NZ) {
            return Err(Refused::Malformed);
        }
        let mut rest = bytes.get(HEADER_BYTES..).unwrap_or_default();
        let (mut y_ref, mut z_ref) = ([0.0; NY], [0.0; NZ]);
        y_ref.iter_mut().chain(&mut z_ref).for_each(|number| *number = Real::from_le_bytes(take(&mut rest)));
        Ok(Self { step: header.step, y_ref, z_ref, certified: header.certified, plan: header.plan })
    }
}

impl<const NI: usize, const NJ: usize, const NB: usize> Inbox<NI, NJ, NB> {
    /// [`Self::accept`] of a neighbour's message as bytes.
    ///
    /// # Errors
    /// As [`Self::accept`], or the bytes are no message of this neighbour in this design; the status of the step that needed it
    /// then says [`OtherDesign`](crate::Delivery::OtherDesign) or [`Unreadable`](crate::Delivery::Unreadable).
    pub fn accept_bytes<const NYJ: usize, const NZJ: usize>(
        &mut self,
        link: &Link<NYJ, NZJ>,
        bytes: &[u8],
    ) -> Result<(), Refused> {
        match Message::from_bytes(&link.sender, bytes) {
            Ok(message) => self.accept(link, &message),
            Err(refused) => {
                self.refuse(link.slot, refused.delivery());
                Err(refused)
            }
        }
    }
}
