//! A hash of all bits of a run.

use crate::scalar::Scalar;

/// FNV-1a over the bytes of words, the lowest first.
#[derive(Debug, Clone, Copy)]
pub struct Fingerprint(pub u64);

impl Fingerprint {
    pub const EMPTY: Self = Self(0xcbf2_9ce4_8422_2325);

    pub fn word(&mut self, word: u64) {
        for byte in word.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    pub fn numbers<S: Scalar>(&mut self, numbers: &[S]) {
        numbers.iter().for_each(|number| self.word(number.bits()));
    }
}
