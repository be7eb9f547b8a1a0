//! Numbers from a seed.

use crate::scalar::Scalar;

/// Marsaglia's xorshift, 64 bits.
pub struct Random(u64);

impl Random {
    pub const fn new() -> Self {
        Self(0x9e37_79b9_7f4a_7c15)
    }

    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// From -1 to 1, in steps that every scalar can hold.
    pub fn signed<S: Scalar>(&mut self) -> S {
        S::ratio((self.next() >> 48) as i16, 15)
    }

    pub fn direction<S: Scalar, const N: usize>(&mut self) -> [S; N] {
        [(); N].map(|()| self.signed())
    }

    /// From 0 to 1.
    pub fn share<S: Scalar>(&mut self) -> S {
        S::ratio((self.next() >> 49) as i16, 15)
    }

    /// One time out of four.
    pub fn seldom(&mut self) -> bool {
        self.next() >> 62 == 0
    }
}
