//! States and inputs at rest, as rows over the outputs of the network: (9).

use nalgebra::DMatrix;

use crate::design::Design;
use crate::gains::Proof;
use crate::network::NamedPolytope;
use crate::sets::ReferenceShare;

/// chi = (I - calF)^-1 calG y where the network is small; of a large one what its limits know.
pub struct SteadyStates(Option<DMatrix<f64>>);

/// Coefficients by entry of the collective y.
pub type Row = Vec<(usize, f64)>;

impl SteadyStates {
    pub fn new(design: &Design) -> Self {
        let dense = matches!(design.gains.proof, Proof::Norm(_));
        Self(dense.then(|| design.gains.steady()).flatten())
    }

    /// Of state k of subsystem i; `None` in a large network where no limit reads that state alone.
    pub fn state(&self, design: &Design, i: usize, k: usize) -> Option<Row> {
        match &self.0 {
            Some(chi) => Some(listed(chi, design.gains.chi_offset[i] + k)),
            None => of_limit(&design.network.subsystems[i].X, &design.sets.subsystems[i].x_rows, k),
        }
    }

    /// Of input k of subsystem i, likewise.
    pub fn input(&self, design: &Design, i: usize, k: usize) -> Option<Row> {
        let Some(chi) = &self.0 else {
            return of_limit(&design.network.subsystems[i].U, &design.sets.subsystems[i].u_rows, k);
        };
        let (s, gains) = (&design.network.subsystems[i], &design.gains.subsystems[i]);
        let start = design.gains.chi_offset[i];
        let row = gains.Kx.row(k) * chi.rows(start, s.n()) + gains.Ke.row(k) * chi.rows(start + s.n(), s.p());
        Some(row.iter().copied().enumerate().collect())
    }
}

fn listed(matrix: &DMatrix<f64>, row: usize) -> Row {
    matrix.row(row).iter().copied().enumerate().collect()
}

/// From a limit that reads signal k alone.
fn of_limit(limits: &NamedPolytope, shares: &[ReferenceShare], k: usize) -> Option<Row> {
    let alone = |r: &usize| (0..limits.H.ncols()).all(|j| (limits.H[(*r, j)] != 0.0) == (j == k));
    let r = (0..limits.h.len()).find(alone)?;
    Some(shares[r].steady.iter().map(|&(y, gain)| (y, gain / limits.H[(r, k)])).collect())
}
