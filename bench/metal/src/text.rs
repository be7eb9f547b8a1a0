//! Lines without `core::fmt`, whose code can panic.

/// A line that is put together piece by piece; what is too much for it is left out.
pub struct Line {
    bytes: [u8; Self::LENGTH],
    length: usize,
}

impl Line {
    const LENGTH: usize = 512;

    pub const fn new() -> Self {
        Self { bytes: [0; Self::LENGTH], length: 0 }
    }

    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or_default()
    }

    pub fn text(mut self, text: &str) -> Self {
        text.bytes().for_each(|byte| self.push(byte));
        self
    }

    pub fn decimal(mut self, number: u64) -> Self {
        let mut digits = [0; 20];
        let (mut rest, mut count) = (number, 0);
        for digit in &mut digits {
            *digit = b'0' + (rest % 10) as u8;
            rest /= 10;
            count += 1;
            if rest == 0 {
                break;
            }
        }
        digits.iter().take(count).rev().for_each(|digit| self.push(*digit));
        self
    }

    /// All 64 bits.
    pub fn hexadecimal(mut self, number: u64) -> Self {
        for nibble in (0..16).rev().map(|place| (number >> (4 * place)) as u8 & 15) {
            self.push(if nibble < 10 { b'0' + nibble } else { b'a' - 10 + nibble });
        }
        self
    }

    fn push(&mut self, byte: u8) {
        if let Some(place) = self.bytes.get_mut(self.length) {
            *place = byte;
            self.length += 1;
        }
    }
}

impl Default for Line {
    fn default() -> Self {
        Self::new()
    }
}
