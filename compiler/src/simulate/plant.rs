//! The true plant: the linear model of the whole network.
#![expect(non_snake_case, reason = "the paper's symbols")]

use nalgebra::{DMatrix, DVector};

use crate::network::Network;

/// x+ = A x + B u + M d, (1) and (2) of all subsystems as the collective model (5a), row by row; zeros are left out.
#[derive(Debug, Clone)]
pub struct Plant {
    A: Vec<Row>,
    B: Vec<Row>,
    M: Vec<DMatrix<f64>>,
    /// First state of each subsystem, and their number.
    starts: Vec<usize>,
}

/// Entries of a row in order of their columns.
type Row = Vec<(usize, f64)>;

impl Plant {
    pub fn new(network: &Network) -> Self {
        let counts = |count: fn(&crate::network::Subsystem) -> usize| {
            let ends = network.subsystems.iter().scan(0, move |end, s| {
                *end += count(s);
                Some(*end)
            });
            std::iter::once(0).chain(ends).collect::<Vec<_>>()
        };
        let (starts, inputs) = (counts(|s| s.n()), counts(|s| s.m()));
        let mut A = Vec::new();
        let mut B = Vec::new();
        for (i, s) in network.subsystems.iter().enumerate() {
            let others = |of: fn(&crate::network::Subsystem) -> &DMatrix<f64>| {
                s.L.iter().map(move |(j, L)| (*j, &s.E * L * of(&network.subsystems[*j])))
            };
            let A_i: Vec<_> = others(|other| &other.Cz).chain([(i, s.A.clone())]).collect();
            let B_i: Vec<_> = others(|other| &other.Dz).chain([(i, s.B.clone())]).collect();
            A.extend((0..s.n()).map(|k| row(&A_i, &starts, k)));
            B.extend((0..s.n()).map(|k| row(&B_i, &inputs, k)));
        }
        let M = network.subsystems.iter().map(|s| s.loads.M.clone()).collect();
        Self { A, B, M, starts }
    }

    /// The states one period later. All are given and returned per subsystem.
    pub fn advance(&self, x: &[DVector<f64>], u: &[Vec<f64>], d: &[Vec<f64>]) -> Vec<DVector<f64>> {
        let x: Vec<f64> = x.iter().flat_map(|x| x.iter().copied()).collect();
        let u: Vec<f64> = u.iter().flatten().copied().collect();
        let next = |i: usize| {
            let first = self.starts[i];
            let own = (first..self.starts[i + 1]).map(|k| dot(&self.A[k], &x) + dot(&self.B[k], &u));
            let next = DVector::from_iterator(self.starts[i + 1] - first, own);
            if d[i].is_empty() { next } else { next + &self.M[i] * DVector::from_column_slice(&d[i]) }
        };
        (0..self.M.len()).map(next).collect()
    }
}

fn row(blocks: &[(usize, DMatrix<f64>)], starts: &[usize], k: usize) -> Row {
    let entries = blocks.iter().flat_map(|(j, block)| {
        let row = block.row(k);
        row.iter().enumerate().map(|(c, entry)| (starts[*j] + c, *entry)).collect::<Vec<_>>()
    });
    let mut row: Row = entries.filter(|(_, entry)| *entry != 0.0).collect();
    row.sort_by_key(|(column, _)| *column);
    row
}

fn dot(row: &Row, x: &[f64]) -> f64 {
    row.iter().map(|(column, entry)| entry * x[*column]).sum()
}
