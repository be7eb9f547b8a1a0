//! The runtime in single precision: the same types over `f32`, for processors without double precision in hardware. No `f64`
//! occurs in it. `dpc-codegen` emits for it where the file says `scalar = "f32"`, and has then tightened the sets by what
//! this arithmetic rounds.

/// The number type.
pub type Real = f32;

/// Thresholds of single precision, 6.0e-8: those that come from counting roundings are as many of it as in double precision.
/// What each is for is said where it is used.
pub(crate) mod precision {
    pub const TOLERANCE: f32 = 5e-6;
    pub const ROUNDING: f32 = 3e-6;
    pub const UNPROVED: f32 = 2e-5;
    pub const SUMMED: f32 = 5e-7;
    pub const NEGATIVE: f32 = 1e-3;
    pub const DEPENDENT: f32 = 5e-6;
    pub const SAFE: f32 = 1e-3;
    pub const NOISE: f32 = 1e-5;
    pub const SETTLED: f32 = 3e-7;
    pub const LOOSEST: f32 = 2e-5;
    /// Rounding errors of sums of a few hundred terms.
    pub const SUMS: f32 = 2e-5;
    /// A limit counts as kept that is exceeded by no more than this share of it: the rounding errors of many steps.
    pub const KEPT: f32 = 2e-6;
    /// The rows of an i-DPC problem have tables of their own for it: [`slack`](super::tables::DpcProblem::slack).
    pub const CANDIDATE: f32 = 0.0;
    /// Whether a solution is looked at once more before it is used: what the design has in reserve is worked out for that look.
    pub const CHECKED: bool = true;
    /// Products of numbers below this do not overflow.
    pub const LARGEST: f32 = 1e12;
    pub const HORIZON: f32 = 30.0;
    /// What a step of references keeps off its limits and off epsilon, relative, so that rounding does not take it beyond.
    pub const AIM: f32 = 1e-6;

    /// Within 7 % of the root of a positive number that is not subnormal.
    pub fn half_exponent(value: f32) -> f32 {
        f32::from_bits((value.to_bits() >> 1) + 0x1fc0_0000)
    }

    pub fn bits(value: f32) -> u64 {
        value.to_bits().into()
    }
}

#[expect(clippy::duplicate_mod, reason = "compiled once per scalar type")]
#[path = "any.rs"]
mod any;
pub use any::*;
