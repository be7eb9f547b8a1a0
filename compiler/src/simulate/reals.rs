//! Numbers in the scalar type that controllers compute in.

use std::ffi::c_void;

use crate::network::Scalar;

/// Numbers at an address.
#[derive(Debug, Clone, PartialEq)]
pub enum Reals {
    Double(Vec<f64>),
    Single(Vec<f32>),
}

impl Reals {
    /// The nearest numbers of that type.
    pub fn new(scalar: Scalar, numbers: &[f64]) -> Self {
        match scalar {
            Scalar::Double => Self::Double(numbers.to_vec()),
            Scalar::Single => Self::Single(numbers.iter().map(|number| *number as f32).collect()),
        }
    }

    pub fn zeros(scalar: Scalar, count: usize) -> Self {
        Self::new(scalar, &vec![0.0; count])
    }

    /// The first numbers of little-endian bytes.
    pub fn read(scalar: Scalar, bytes: &[u8], count: usize) -> Vec<f64> {
        match scalar {
            Scalar::Double => bytes.as_chunks().0.iter().take(count).map(|bytes| f64::from_le_bytes(*bytes)).collect(),
            Scalar::Single => {
                bytes.as_chunks().0.iter().take(count).map(|bytes| f64::from(f32::from_le_bytes(*bytes))).collect()
            }
        }
    }

    pub fn to_f64(&self) -> Vec<f64> {
        match self {
            Self::Double(numbers) => numbers.clone(),
            Self::Single(numbers) => numbers.iter().map(|number| f64::from(*number)).collect(),
        }
    }

    /// For as long as these numbers are there and nobody writes them.
    pub fn ptr(&self) -> *const c_void {
        match self {
            Self::Double(numbers) => numbers.as_ptr().cast(),
            Self::Single(numbers) => numbers.as_ptr().cast(),
        }
    }

    /// The same for writing.
    pub fn mut_ptr(&mut self) -> *mut c_void {
        match self {
            Self::Double(numbers) => numbers.as_mut_ptr().cast(),
            Self::Single(numbers) => numbers.as_mut_ptr().cast(),
        }
    }
}
