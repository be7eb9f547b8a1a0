//! Assumptions 1 to 3 of a network that is too large for collective matrices: by the local loops and what they send each
//! other, [`crate::optim::responses`].

use nalgebra::DMatrix;

use super::{Gains, SubsystemGains, augmented};
use crate::diagnostic::{Diagnostic, code};
use crate::network::Network;
use crate::optim::responses::{Loop, Responses, radius_bound, starts};
use crate::optim::sparse::Sparse;

/// Up to so many reference states, the sum of the n_i + p_i, everything collective is dense.
pub const DENSE: usize = 90;
/// Beyond, dense matrices are formed only where the sparse proof fails, and up to here.
pub const MOST_DENSE: usize = 450;

/// Sum of the n_i + p_i.
pub fn reference_states(network: &Network) -> usize {
    network.subsystems.iter().map(|s| s.n() + s.p()).sum()
}

/// Whether no collective matrix of the network may be dense.
pub fn is_too_large_for_dense(network: &Network) -> bool {
    reference_states(network) > MOST_DENSE
}

impl Gains {
    /// The proof of large networks for one that has another; `None` where it fails.
    pub fn responses(&self, network: &Network) -> Option<Responses> {
        Responses::new(&reference_loops(network, &self.subsystems)).ok()
    }

    /// The margins are bounds. The full rank that Assumption 2 asks for follows from calF being Schur: a left null vector (v, w)
    /// of \[I - A, -B; C, 0\] is a left eigenvector of calF at 1, whatever calK is (Hautus).
    ///
    /// # Errors
    /// The loop gain of the references where that proof fails, with the gains.
    pub(super) fn large(
        network: &Network,
        subsystems: Vec<SubsystemGains>,
    ) -> Result<Self, (f64, Vec<SubsystemGains>)> {
        let loops = reference_loops(network, &subsystems);
        let responses = match Responses::new(&loops) {
            Ok(responses) => responses,
            Err(radius) => return Err((radius, subsystems)),
        };
        let chi = starts(network.subsystems.iter().map(|s| s.n() + s.p()));
        let y = starts(network.subsystems.iter().map(|s| s.p()));
        Ok(Self {
            calF: sparse_calF(&loops, &chi),
            calG: sparse_calG(network, &chi, &y),
            rho_F: radius_bound(&local_loops(network, &subsystems)),
            rho_calF: radius_bound(&loops),
            proof: super::Proof::Responses(responses),
            chi_offset: chi[..subsystems.len()].to_vec(),
            y_offset: y[..subsystems.len()].to_vec(),
            rank_margin: None,
            subsystems,
        })
    }
}

/// F_ii, C_zi + D_zi K_i, E_i L_ij.
fn local_loops(network: &Network, subsystems: &[SubsystemGains]) -> Vec<Loop> {
    let parts = network.subsystems.iter().zip(subsystems);
    let one = |(s, g): (&crate::network::Subsystem, &SubsystemGains)| Loop {
        D: g.F.clone(),
        Z: &s.Cz + &s.Dz * &g.K,
        imports: s.L.iter().map(|(&j, L)| (j, &s.E * L)).collect(),
    };
    parts.map(one).collect()
}

/// calF_ii, \[C_zi + D_zi K_i^x, D_zi K_i^e\], \[E_i L_ij; 0\].
fn reference_loops(network: &Network, subsystems: &[SubsystemGains]) -> Vec<Loop> {
    let parts = network.subsystems.iter().zip(subsystems);
    let one = |(s, g): (&crate::network::Subsystem, &SubsystemGains)| {
        let (A, B) = augmented(s);
        let size = s.n() + s.p();
        Loop {
            D: A + B * g.calK(),
            Z: s.Cz.clone().resize_horizontally(size, 0.0) + &s.Dz * g.calK(),
            imports: s.L.iter().map(|(&j, L)| (j, (&s.E * L).resize_vertically(size, 0.0))).collect(),
        }
    };
    parts.map(one).collect()
}

fn sparse_calF(loops: &[Loop], chi: &[usize]) -> Sparse {
    let mut blocks = Vec::new();
    for (i, l) in loops.iter().enumerate() {
        blocks.push(((chi[i], chi[i]), l.D.clone()));
        blocks.extend(l.imports.iter().map(|(j, B)| ((chi[i], chi[*j]), B * &loops[*j].Z)));
    }
    let size = chi[loops.len()];
    Sparse::from_blocks(size, size, blocks.iter().map(|(place, block)| (*place, block)))
}

fn sparse_calG(network: &Network, chi: &[usize], y: &[usize]) -> Sparse {
    let ones: Vec<DMatrix<f64>> = network.subsystems.iter().map(|s| DMatrix::identity(s.p(), s.p())).collect();
    let place = |i: usize| (chi[i] + network.subsystems[i].n(), y[i]);
    let count = ones.len();
    Sparse::from_blocks(chi[count], y[count], ones.iter().enumerate().map(|(i, one)| (place(i), one)))
}

/// Where the sparse proof fails on a network that is too large for another.
pub(super) fn no_sparse_proof(network: &Network, radius: f64) -> Diagnostic {
    let mut error = Diagnostic::error(
        code::LARGE_REFERENCES,
        "the references of this large network act on each other too strongly for a sparse proof of Assumption 3",
    );
    for s in &network.subsystems {
        error = error.at(s.places.header.clone(), "one of the subsystems");
    }
    error
        .note(format!(
            "the loop gain between the references is {radius:.4} (sum over time, worst signs), must be below 1; calF, with {} states, is not tested as one matrix above {MOST_DENSE}",
            reference_states(network)
        ))
        .help("choose gains that let less through to the neighbours (a smaller Qe or a larger R in `reference-weights`), or merge the subsystems that are coupled most")
}
