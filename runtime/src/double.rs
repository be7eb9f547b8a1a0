//! The runtime in double precision.

/// The number type.
pub type Real = f64;

/// Thresholds of double precision, 1.1e-16: those that come from counting roundings are some dozens of it, the others leave
/// room on both sides. What each is for is said where it is used.
pub(crate) mod precision {
    pub const TOLERANCE: f64 = 2e-14;
    pub const ROUNDING: f64 = 1e-14;
    pub const UNPROVED: f64 = 1e-12;
    pub const SUMMED: f64 = 1e-15;
    pub const NEGATIVE: f64 = 1e-6;
    pub const DEPENDENT: f64 = 1e-14;
    pub const SAFE: f64 = 1e-6;
    pub const NOISE: f64 = 1e-9;
    pub const SETTLED: f64 = 5e-16;
    pub const LOOSEST: f64 = 1e-10;
    /// Rounding errors of sums of a few hundred terms.
    pub const SUMS: f64 = 1e-12;
    /// A limit counts as kept that is exceeded by no more than this share of it: the rounding errors of many steps.
    pub const KEPT: f64 = 1e-9;
    /// Products of numbers below this do not overflow.
    pub const LARGEST: f64 = 1e100;
    pub const HORIZON: f64 = 1e6;

    /// Within 7 % of the root of a positive number that is not subnormal.
    pub fn half_exponent(value: f64) -> f64 {
        f64::from_bits((value.to_bits() >> 1) + 0x1ff8_0000_0000_0000)
    }

    pub fn bits(value: f64) -> u64 {
        value.to_bits()
    }
}

#[expect(clippy::duplicate_mod, reason = "compiled once per scalar type")]
#[path = "any.rs"]
mod any;
pub use any::*;
