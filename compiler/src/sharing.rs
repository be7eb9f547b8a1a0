//! Work that equal parts of a network share, and that is spread over the processor's cores.
//!
//! The results are those of plain loops: equal means equal bit by bit in everything that enters, and every result is put in
//! its own place.

use std::collections::HashMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use nalgebra::{DMatrix, DVector};

/// Everything that a piece of work depends on, bit by bit.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub struct Key(Vec<u64>);

impl Key {
    pub fn matrix(mut self, matrix: &DMatrix<f64>) -> Self {
        self.0.extend([matrix.nrows() as u64, matrix.ncols() as u64]);
        self.0.extend(matrix.iter().map(|value| value.to_bits()));
        self
    }

    pub fn vector(mut self, vector: &DVector<f64>) -> Self {
        self.0.push(vector.len() as u64);
        self.0.extend(vector.iter().map(|value| value.to_bits()));
        self
    }

    pub fn number(mut self, value: f64) -> Self {
        self.0.push(value.to_bits());
        self
    }

    /// What may be there or not.
    pub fn maybe(self, matrix: Option<&DMatrix<f64>>) -> Self {
        match matrix {
            Some(matrix) => self.number(1.0).matrix(matrix),
            None => self.number(0.0),
        }
    }
}

/// `make(i)` for every i below `count`, made once for all i with the same key.
pub fn shared<T: Clone + Send>(count: usize, key: impl Fn(usize) -> Key, make: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let (mut first, mut known) = (Vec::new(), HashMap::new());
    let of: Vec<usize> = (0..count)
        .map(|i| {
            *known.entry(key(i)).or_insert_with(|| {
                first.push(i);
                first.len() - 1
            })
        })
        .collect();
    let made = spread(first.len(), |k| make(first[k]));
    of.into_iter().map(|k| made[k].clone()).collect()
}

/// `make(i)` for every i below `count`, on all cores.
pub fn spread<T: Send>(count: usize, make: impl Fn(usize) -> T + Sync) -> Vec<T> {
    spread_with(count, || (), |(), i| make(i))
}

/// [`spread`] with a work space per thread, which must not carry anything from one i to the next.
pub fn spread_with<S, T: Send>(
    count: usize,
    space: impl Fn() -> S + Sync,
    make: impl Fn(&mut S, usize) -> T + Sync,
) -> Vec<T> {
    let threads = thread::available_parallelism().map_or(1, usize::from).min(count / FEWEST);
    if threads < 2 {
        let mut space = space();
        return (0..count).map(|i| make(&mut space, i)).collect();
    }
    let next = AtomicUsize::new(0);
    let work = || {
        let (mut space, mut made) = (space(), Vec::new());
        loop {
            let i = next.fetch_add(1, Ordering::Relaxed);
            if i >= count {
                return made;
            }
            made.push((i, make(&mut space, i)));
        }
    };
    let mut all: Vec<(usize, T)> = thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        workers
            .into_iter()
            .flat_map(|worker| worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
            .collect()
    });
    all.sort_by_key(|(i, _)| *i);
    all.into_iter().map(|(_, value)| value).collect()
}

/// Pieces of work that a thread of its own is worth.
const FEWEST: usize = 8;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_keys_are_made_once_and_every_result_is_in_its_place() {
        let made = AtomicUsize::new(0);
        let make = |i: usize| {
            made.fetch_add(1, Ordering::Relaxed);
            i % 7
        };
        let all = shared(100, |i| Key::default().number((i % 7) as f64), make);
        assert_eq!(all, (0..100).map(|i| i % 7).collect::<Vec<_>>());
        assert_eq!(made.into_inner(), 7);
    }

    #[test]
    fn work_is_spread_without_loss() {
        assert_eq!(spread(1000, |i| i * i), (0..1000).map(|i| i * i).collect::<Vec<_>>());
    }

    #[test]
    fn keys_tell_shapes_and_signs_of_zero_apart() {
        let key = |rows, columns| Key::default().matrix(&DMatrix::zeros(rows, columns));
        assert_ne!(key(1, 2), key(2, 1));
        assert_ne!(Key::default().number(0.0), Key::default().number(-0.0));
    }
}
