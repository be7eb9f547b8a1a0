//! Fortran's characters and leading dimensions as types.

use nalgebra::{DMatrixView, DMatrixViewMut, Dyn, U1};

/// A matrix with any distance between its columns. A transpose would be a view with a distance between its rows, but
/// products of these run past the end in nalgebra 0.35 (`axcpy_uninit` counts the slice, not the entries): they are copied.
pub(crate) type View<'a> = DMatrixView<'a, f64, U1, Dyn>;
pub(crate) type ViewMut<'a> = DMatrixViewMut<'a, f64, U1, Dyn>;

/// The triangle of a symmetric matrix that is read or written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Triangle {
    Upper,
    Lower,
}

impl Triangle {
    /// `uplo`
    pub fn of(letter: u8) -> Option<Self> {
        match letter.to_ascii_uppercase() {
            b'U' => Some(Self::Upper),
            b'L' => Some(Self::Lower),
            _ => None,
        }
    }

    pub fn contains(self, i: usize, j: usize) -> bool {
        match self {
            Self::Upper => i <= j,
            Self::Lower => i >= j,
        }
    }
}

/// `trans`: whether the transpose is meant; real matrices make no difference between `T` and `C`.
pub(crate) fn transposed(letter: u8) -> Option<bool> {
    match letter.to_ascii_uppercase() {
        b'N' => Some(false),
        b'T' | b'C' => Some(true),
        _ => None,
    }
}

/// Entries from the first to the last of a matrix of `rows` x `columns` with columns `leading` apart.
pub(crate) fn extent(rows: usize, columns: usize, leading: usize) -> usize {
    if rows == 0 || columns == 0 { 0 } else { leading * (columns - 1) + rows }
}
