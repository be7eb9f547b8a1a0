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
    /// The same of the rows of an i-DPC problem, relative to the magnitude of the limit plus the largest |w_k|. The design has ten
    /// times that in reserve.
    pub const CANDIDATE: f64 = 1e-9;
    /// Whether a solution is looked at once more before it is used: the thresholds above are far below what the design has in
    /// reserve.
    pub const CHECKED: bool = false;
    /// Products of numbers below this do not overflow.
    pub const LARGEST: f64 = 1e100;
    pub const HORIZON: f64 = 1e6;
    /// What a step of references keeps off its limits and off epsilon, relative, so that rounding does not take it beyond.
    pub const AIM: f64 = 0.0;

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
