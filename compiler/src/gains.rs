//! Step 1 of the off-line design: K_i, calK_i, P_i, and Assumptions 1-3 with their margins.
#![expect(non_snake_case, reason = "the paper's symbols")]

use nalgebra::DMatrix;

/// After this point: A + BK, every F_ii and calF are Schur (proved by a Lyapunov certificate, not by eigenvalues
/// alone), and Assumption 2 holds; the margins are recorded.
#[derive(Debug)]
pub struct Gains {
    pub subsystems: Vec<SubsystemGains>,
    /// calF of Assumption 3, over (chi_1, ..., chi_M), chi_i = (xref_i, eref_i).
    pub calF: DMatrix<f64>,
    /// calG = diag(G_i), (n + p) x p.
    pub calG: DMatrix<f64>,
    /// First row of chi_i in the collective chi.
    pub chi_offset: Vec<usize>,
    /// First row of y_i in the collective y.
    pub y_offset: Vec<usize>,
    /// Spectral radius of F = A + BK (Assumption 1).
    pub rho_F: f64,
    /// Smallest singular value of the matrix of Assumption 2, relative to its largest.
    pub rank_margin: f64,
    /// Spectral radius of calF (Assumption 3).
    pub rho_calF: f64,
}

#[derive(Debug)]
pub struct SubsystemGains {
    /// K_i, m x n.
    pub K: DMatrix<f64>,
    /// K_i^x, m x n.
    pub Kx: DMatrix<f64>,
    /// K_i^e, m x p.
    pub Ke: DMatrix<f64>,
    /// P_i of (37).
    pub P: DMatrix<f64>,
    /// F_ii = A_ii + B_ii K_i.
    pub F: DMatrix<f64>,
    /// Spectral radius of F_ii.
    pub rho_F: f64,
}
