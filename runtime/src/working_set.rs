//! Rows by their numbers: those that hold with equality, and those that a quick look has found violated.

/// What a quick look at all rows has found: a few that are violated, the worst last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Glance {
    found: [(u16, Side); Self::MOST],
    len: usize,
}

impl Glance {
    const MOST: usize = 4;
    /// Nothing is violated.
    pub const NOTHING: Self = Self { found: [(0, Side::Lower); Self::MOST], len: 0 };

    /// A row that is worse than all before. The first of too many is forgotten.
    #[inline]
    pub fn push(&mut self, row: usize, side: Side) {
        let Ok(row) = u16::try_from(row) else { return };
        if self.len == Self::MOST {
            self.found.rotate_left(1);
            self.len -= 1;
        }
        if let Some(place) = self.found.get_mut(self.len) {
            *place = (row, side);
            self.len += 1;
        }
    }

    /// Whether no row is violated.
    #[inline]
    pub fn is_nothing(&self) -> bool {
        self.len == 0
    }

    /// The rows, the worst last.
    pub fn iter(&self) -> impl Iterator<Item = (usize, Side)> {
        self.found.iter().map(|&(row, side)| (usize::from(row), side)).take(self.len)
    }
}

/// What a look at all rows together has found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Worst {
    /// Every row holds.
    Kept,
    /// The row that is violated most.
    Row(usize, Side),
    /// There is no such look.
    Unknown,
}

/// The side of a row that holds with equality.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    Lower,
    Upper,
}

/// Rows, with their sides, that hold with equality at a solution: all a warm start needs to know.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WorkingSet<const NV: usize> {
    entries: [(u16, Side); NV],
    len: usize,
}

impl<const NV: usize> WorkingSet<NV> {
    /// No row: a cold start.
    pub const EMPTY: Self = Self { entries: [(0, Side::Lower); NV], len: 0 };

    /// Appends a row; false if all `NV` places are taken, or the row is none of the first 65536.
    pub fn push(&mut self, row: usize, side: Side) -> bool {
        match (self.entries.get_mut(self.len), u16::try_from(row)) {
            (Some(place), Ok(row)) => {
                *place = (row, side);
                self.len += 1;
                true
            }
            _ => false,
        }
    }

    pub fn iter(&self) -> impl Iterator<Item = (usize, Side)> {
        self.entries.iter().map(|&(row, side)| (usize::from(row), side)).take(self.len)
    }

    pub fn len(&self) -> usize {
        self.len
    }

    pub fn is_empty(&self) -> bool {
        self.len == 0
    }
}
