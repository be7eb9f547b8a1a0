//! Coupled loops, and what their states may add up to: a proof of stability that is as sparse as the network.
//!
//! ```text
//! x_i+ = D_i x_i + sum over j of B_ij z_j,     z_j = Z_j x_j,     altogether x+ = F x
//! ```
//!
//! Let s_i be the sum over time of |z_i|, entrywise, for some start x(0). Over any finite time
//!
//! ```text
//! s_i <= sum over k of |Z_i D_i^k x_i(0)| + sum over j of S_ij s_j,       S_ij = sum over k of |Z_i D_i^k B_ij|,
//! ```
//!
//! so that s <= (I - S)^-1 s(0) where the spectral radius of S >= 0 is below 1: all sums over time are finite, F is Schur, and
//! sums of |row F^k column| are bounded without any matrix of the size of the network.
#![expect(non_snake_case, reason = "the symbols of the literature")]

use nalgebra::{DMatrix, DVector};

use super::block_lu::BlockLu;
use super::lyapunov::{Contraction, spectral_radius};
use super::perron::Perron;
use super::sparse::Sparse;
use crate::sharing::{Key, shared};

/// One of the loops.
#[derive(Debug, Clone)]
pub struct Loop {
    pub D: DMatrix<f64>,
    pub Z: DMatrix<f64>,
    /// B_ij by j.
    pub imports: Vec<(usize, DMatrix<f64>)>,
}

/// The proof that F is Schur, with what it is good for.
#[derive(Debug, Clone)]
pub struct Responses {
    parts: Vec<Part>,
    S: Sparse,
    lu: BlockLu,
    perron: Perron,
    /// First state and first z of each loop, and the number of all at the end.
    x: Vec<usize>,
    z: Vec<usize>,
}

/// Upper bounds of sums over k of one loop.
#[derive(Debug, Clone)]
struct Part {
    /// |D^k| and |Z D^k|, one below the other.
    of_start: DMatrix<f64>,
    /// |D^k B_j| by j.
    of_imports: Vec<(usize, DMatrix<f64>)>,
}

impl Responses {
    /// # Errors
    /// The spectral radius of S, at least 1; infinite where some D_i is not Schur.
    pub fn new(loops: &[Loop]) -> Result<Self, f64> {
        let (x, z) = (starts(loops.iter().map(|l| l.D.nrows())), starts(loops.iter().map(|l| l.Z.nrows())));
        let sums = sums(loops, 1.0).ok_or(f64::INFINITY)?;
        let S = loop_gains(loops, &sums, &z);
        let perron = Perron::new(&S);
        if perron.radius > MOST_RADIUS {
            return Err(perron.radius);
        }
        let lu = BlockLu::of_identity_minus(&S, &z).ok_or(perron.radius)?;
        let parts = loops.iter().zip(&sums).map(|(l, sums)| Part::new(l, sums)).collect();
        Ok(Self { parts, S, lu, perron, x, z })
    }

    /// Spectral radius of S: how far from 1 the proof is.
    pub fn radius(&self) -> f64 {
        self.perron.radius
    }

    /// For every state j an upper bound of the sum over k of |e_j' F^k| b; b >= 0.
    pub fn to(&self, b: &DVector<f64>) -> DVector<f64> {
        let own: Vec<_> =
            self.parts.iter().enumerate().map(|(i, p)| &p.of_start * b.rows_range(self.states(i))).collect();
        let mut s0 = DVector::zeros(self.S.nrows());
        for (i, own) in own.iter().enumerate() {
            let n = self.states(i).len();
            s0.rows_range_mut(self.z[i]..self.z[i + 1]).copy_from(&own.rows(n, own.len() - n));
        }
        let s = self.sums_of_z(&s0);
        let mut all = DVector::zeros(b.len());
        for (i, part) in self.parts.iter().enumerate() {
            let mut bound = own[i].rows(0, self.states(i).len()).into_owned();
            for (j, gain) in &part.of_imports {
                bound += gain * s.rows_range(self.z[*j]..self.z[j + 1]);
            }
            all.rows_range_mut(self.states(i)).copy_from(&(bound * INFLATE));
        }
        all
    }

    fn states(&self, i: usize) -> std::ops::Range<usize> {
        self.x[i]..self.x[i + 1]
    }

    /// s with s0 + S s <= s: by the approximate solution, raised along w until the inequality holds.
    fn sums_of_z(&self, s0: &DVector<f64>) -> DVector<f64> {
        let s = self.lu.solve(s0).map(|s| s.max(0.0));
        let image = (s0 + self.S.times(&s)) * INFLATE;
        let lacking =
            image.iter().zip(&s).zip(&self.perron.w).map(|((image, s), w)| (image - s) / w).fold(0.0, f64::max);
        s + &self.perron.w * (lacking / (1.0 - self.perron.radius) * 1.001)
    }
}

/// Largest radius of S with which the proof is of use.
const MOST_RADIUS: f64 = 1.0 - 1e-6;
/// Covers the rounding of products of a few thousand terms of one sign.
const INFLATE: f64 = 1.0 + 1e-11;

/// An upper bound of the spectral radius of F: the least of a few that the proof gives for F / bound; 1 where it gives none below.
pub fn radius_bound(loops: &[Loop]) -> f64 {
    let slowest = loops.iter().map(|l| spectral_radius(&l.D)).fold(0.0, f64::max);
    let tried = [0.5, 0.25, 0.1, 0.03, 0.01].map(|share| 1.0 - share * (1.0 - slowest));
    let z = starts(loops.iter().map(|l| l.Z.nrows()));
    let proved = |bound: &f64| {
        sums(loops, *bound).is_some_and(|sums| Perron::new(&loop_gains(loops, &sums, &z)).radius <= MOST_RADIUS)
    };
    tried.into_iter().find(proved).unwrap_or(1.0)
}

impl Part {
    fn new(l: &Loop, sums: &DMatrix<f64>) -> Self {
        let n = l.D.nrows();
        let of_start = sums.columns(0, n).into_owned();
        let mut column = n;
        let mut import = |(j, B): &(usize, DMatrix<f64>)| {
            column += B.ncols();
            (*j, sums.view((0, column - B.ncols()), (n, B.ncols())).into_owned())
        };
        Self { of_start, of_imports: l.imports.iter().map(&mut import).collect() }
    }
}

/// Of every loop the sums of |\[I; Z\] (D / scale)^k \[I B_1 B_2 ...\]|, the B over `scale`; `None` where some D / scale is not Schur.
fn sums(loops: &[Loop], scale: f64) -> Option<Vec<DMatrix<f64>>> {
    let key = |i: usize| {
        let Loop { D, Z, imports } = &loops[i];
        imports.iter().fold(Key::default().matrix(D).matrix(Z), |key, (_, B)| key.matrix(B))
    };
    let sum = |i: usize| {
        let Loop { D, Z, imports } = &loops[i];
        let (n, D) = (D.nrows(), D / scale);
        let contraction = Contraction::new(&D)?;
        let rows = DMatrix::from_fn(n + Z.nrows(), n, |r, c| if r < n { f64::from(r == c) } else { Z[(r - n, c)] });
        let mut columns = DMatrix::identity(n, n);
        for (_, B) in imports {
            let width = columns.ncols();
            columns = columns.resize_horizontally(width + B.ncols(), 0.0);
            columns.columns_mut(width, B.ncols()).copy_from(&(B / scale));
        }
        Some(power_sum(&rows, &D, &contraction, &columns, Accuracy::LOOSE))
    };
    shared(loops.len(), key, sum).into_iter().collect()
}

fn loop_gains(loops: &[Loop], sums: &[DMatrix<f64>], z: &[usize]) -> Sparse {
    let mut blocks = Vec::new();
    for (i, (l, sums)) in loops.iter().zip(sums).enumerate() {
        let (n, mut column) = (l.D.nrows(), l.D.nrows());
        for (j, B) in &l.imports {
            blocks.push(((z[i], z[*j]), sums.view((n, column), (l.Z.nrows(), B.ncols())).into_owned()));
            column += B.ncols();
        }
    }
    let size = z[loops.len()];
    Sparse::from_blocks(size, size, blocks.iter().map(|(place, block)| (*place, block)))
}

/// First of each, and the number of all at the end.
pub fn starts(sizes: impl Iterator<Item = usize>) -> Vec<usize> {
    let mut starts = vec![0];
    sizes.for_each(|size| starts.push(starts[starts.len() - 1] + size));
    starts
}

/// When a sum over powers ends.
#[derive(Debug, Clone, Copy)]
pub struct Accuracy {
    /// The tail, relative to the sum.
    tail: f64,
    /// With whatever tail is left.
    steps: usize,
}

impl Accuracy {
    pub const FULL: Self = Self { tail: 1e-10, steps: usize::MAX };
    /// For sums that only have to be bounds.
    pub const LOOSE: Self = Self { tail: 1e-3, steps: 20_000 };
}

/// Upper bound of the sum over k of |C F^k B|, entrywise.
pub fn power_sum(
    C: &DMatrix<f64>,
    F: &DMatrix<f64>,
    contraction: &Contraction,
    B: &DMatrix<f64>,
    accuracy: Accuracy,
) -> DMatrix<f64> {
    let columns: Vec<f64> = B.column_iter().map(|b| contraction.norm(&b.into_owned())).collect();
    let geometric = 1.0 / (1.0 - contraction.lambda);
    let tail = |row: &DMatrix<f64>| {
        let dual: Vec<f64> = row.row_iter().map(|c| contraction.dual_norm(&c.transpose())).collect();
        DMatrix::from_fn(C.nrows(), B.ncols(), |i, j| dual[i] * columns[j] * geometric)
    };
    // Where B does not reach a row at all its sum stays 0: then the tail ends at what counts as nothing.
    let nothing = tail(C) * (accuracy.tail * accuracy.tail);
    let mut sum = DMatrix::<f64>::zeros(C.nrows(), B.ncols());
    let (mut row, mut step) = (C.clone(), 0);
    loop {
        let tail = tail(&row);
        let least = sum.zip_map(&nothing, |sum, nothing| (accuracy.tail * sum).max(nothing));
        if step >= accuracy.steps || tail.iter().zip(&least).all(|(tail, least)| tail <= least) {
            // The relative rounding of the powers stays far below 1e-9 for every contraction that could be proved.
            return (sum + tail) * (1.0 + 1e-9);
        }
        sum += (&row * B).abs();
        row *= F;
        step += 1;
    }
}
