//! Linear systems of loosely coupled blocks.
#![expect(non_snake_case, reason = "the symbols of the literature")]

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::sparse::Sparse;

/// M = L U of a square matrix in blocks. Blocks of least degree are eliminated first, which keeps the factors of a loosely
/// coupled network sparse; pivoting stays within a block. What is solved with it is a good approximation and no more: whoever
/// needs a bound checks the residual.
#[derive(Debug, Clone)]
pub struct BlockLu {
    size: usize,
    /// In the order of elimination.
    steps: Vec<Step>,
}

/// The elimination of one block.
#[derive(Debug, Clone)]
struct Step {
    place: Range<usize>,
    inverse: DMatrix<f64>,
    /// Blocks of L below the pivot, and of U to the right of it.
    below: Vec<(Range<usize>, DMatrix<f64>)>,
    right: Vec<(Range<usize>, DMatrix<f64>)>,
}

impl BlockLu {
    /// Factors of I - M; `starts` are the first rows of the blocks, and the size of M at the end. `None` where a pivot is
    /// singular.
    pub fn of_identity_minus(M: &Sparse, starts: &[usize]) -> Option<Self> {
        Elimination::new(M, starts).run()
    }

    /// x with (I - M) x = b.
    pub fn solve(&self, b: &DVector<f64>) -> DVector<f64> {
        let mut x = b.clone();
        for Step { place, below, .. } in &self.steps {
            let known = x.rows_range(place.clone()).into_owned();
            for (other, L) in below {
                x.rows_range_mut(other.clone()).gemv(-1.0, L, &known, 1.0);
            }
        }
        for Step { place, inverse, right, .. } in self.steps.iter().rev() {
            let mut own = x.rows_range(place.clone()).into_owned();
            for (other, U) in right {
                own.gemv(-1.0, U, &x.rows_range(other.clone()), 1.0);
            }
            x.rows_range_mut(place.clone()).copy_from(&(inverse * own));
        }
        x
    }

    /// x with x (I - M) = d, for rows.
    pub fn solve_row(&self, d: &DVector<f64>) -> DVector<f64> {
        let mut x = d.clone();
        for Step { place, inverse, right, .. } in &self.steps {
            let own = inverse.tr_mul(&x.rows_range(place.clone()));
            for (other, U) in right {
                x.rows_range_mut(other.clone()).gemv_tr(-1.0, U, &own, 1.0);
            }
            x.rows_range_mut(place.clone()).copy_from(&own);
        }
        for Step { place, below, .. } in self.steps.iter().rev() {
            let mut own = x.rows_range(place.clone()).into_owned();
            for (other, L) in below {
                own.gemv_tr(-1.0, L, &x.rows_range(other.clone()), 1.0);
            }
            x.rows_range_mut(place.clone()).copy_from(&own);
        }
        x
    }

    pub fn size(&self) -> usize {
        self.size
    }
}

/// What is left of the matrix while it is eliminated.
struct Elimination {
    places: Vec<Range<usize>>,
    /// Block rows by block column.
    rows: Vec<BTreeMap<usize, DMatrix<f64>>>,
    /// Block rows with an entry in each block column.
    columns: Vec<BTreeSet<usize>>,
    open: BTreeSet<usize>,
}

impl Elimination {
    fn new(M: &Sparse, starts: &[usize]) -> Self {
        let places: Vec<_> = starts.windows(2).map(|pair| pair[0]..pair[1]).collect();
        let count = places.len();
        let mut owner = vec![0; M.ncols()];
        places.iter().enumerate().for_each(|(k, place)| owner[place.clone()].fill(k));
        let mut rows: Vec<BTreeMap<usize, DMatrix<f64>>> = vec![BTreeMap::new(); count];
        for (k, place) in places.iter().enumerate() {
            rows[k].insert(k, DMatrix::identity(place.len(), place.len()));
            for i in place.clone() {
                for &(j, value) in M.row(i) {
                    let other = owner[j];
                    let zeros = || DMatrix::zeros(place.len(), places[other].len());
                    rows[k].entry(other).or_insert_with(zeros)[(i - place.start, j - places[other].start)] -= value;
                }
            }
        }
        let mut columns = vec![BTreeSet::new(); count];
        rows.iter().enumerate().for_each(|(k, row)| row.keys().for_each(|j| _ = columns[*j].insert(k)));
        Self { places, rows, columns, open: (0..count).collect() }
    }

    fn run(mut self) -> Option<BlockLu> {
        let mut steps = Vec::new();
        while let Some(pivot) = self.least_degree() {
            steps.push(self.eliminate(pivot)?);
        }
        Some(BlockLu { size: self.places.last().map_or(0, |place| place.end), steps })
    }

    fn least_degree(&self) -> Option<usize> {
        self.open.iter().copied().min_by_key(|&k| self.rows[k].len() * self.columns[k].len())
    }

    fn eliminate(&mut self, pivot: usize) -> Option<Step> {
        self.open.remove(&pivot);
        let mut row = std::mem::take(&mut self.rows[pivot]);
        let inverse = row.remove(&pivot)?.try_inverse()?;
        row.keys().for_each(|j| _ = self.columns[*j].remove(&pivot));
        let mut below = Vec::new();
        for i in std::mem::take(&mut self.columns[pivot]).into_iter().filter(|&i| i != pivot) {
            let Some(entry) = self.rows[i].remove(&pivot) else { continue };
            let L = entry * &inverse;
            for (&j, U) in &row {
                let zeros = || DMatrix::zeros(L.nrows(), U.ncols());
                self.rows[i].entry(j).or_insert_with(zeros).gemm(-1.0, &L, U, 1.0);
                self.columns[j].insert(i);
            }
            below.push((self.places[i].clone(), L));
        }
        let right = row.into_iter().map(|(j, U)| (self.places[j].clone(), U)).collect();
        Some(Step { place: self.places[pivot].clone(), inverse, below, right })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ring of blocks of different sizes, one of them empty.
    fn ring() -> (Sparse, Vec<usize>) {
        let starts = vec![0, 2, 3, 3, 6, 7];
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / (1u64 << 32) as f64 - 0.25
        };
        let mut blocks = Vec::new();
        for k in 0..5 {
            for other in [k, (k + 1) % 5] {
                let shape = (starts[k + 1] - starts[k], starts[other + 1] - starts[other]);
                blocks.push(((starts[k], starts[other]), DMatrix::from_fn(shape.0, shape.1, |_, _| random())));
            }
        }
        (Sparse::from_blocks(7, 7, blocks.iter().map(|(place, block)| (*place, block))), starts)
    }

    #[test]
    fn both_sides_are_solved() {
        let (M, starts) = ring();
        let lu = BlockLu::of_identity_minus(&M, &starts).unwrap();
        let b = DVector::from_fn(lu.size(), |k, _| 1.0 + k as f64);
        let (x, y) = (lu.solve(&b), lu.solve_row(&b));
        assert!((&x - M.times(&x) - &b).amax() < 1e-12 * x.amax());
        assert!((&y - M.row_times(&y) - &b).amax() < 1e-12 * y.amax());
    }

    #[test]
    fn a_chain_stays_sparse() {
        let count = 200;
        let block = DMatrix::from_element(1, 1, 0.3);
        let near = (0..count - 1).flat_map(|k| [(k, k + 1), (k + 1, k)]);
        let M = Sparse::from_blocks(count, count, near.map(|place| (place, &block)));
        let lu = BlockLu::of_identity_minus(&M, &(0..=count).collect::<Vec<_>>()).unwrap();
        assert!(lu.steps.iter().map(|step| step.below.len() + step.right.len()).sum::<usize>() <= 2 * count);
    }
}
