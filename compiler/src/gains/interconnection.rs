//! What the matrix inequality has to find gains for: the network as the K_i see it, and as the calK_i do.

use std::collections::BTreeMap;

use nalgebra::DMatrix;

use super::augmented;
use crate::network::{FoundGain, Network, Subsystem};
use crate::optim::lmi::{Interconnection, Price};

/// One of the two layers of gains.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layer {
    /// K_i of (17): Assumptions 1 and 4.
    Local,
    /// calK_i = [K_i^x K_i^e] of (7f): Assumption 3.
    Reference,
}

impl Layer {
    /// The gain that the file states.
    pub fn given(self, subsystem: &Subsystem) -> Option<&DMatrix<f64>> {
        match self {
            Self::Local => subsystem.gains.K.as_ref(),
            Self::Reference => subsystem.gains.calK.as_ref(),
        }
    }

    /// Whether the file leaves a gain of this layer to be chosen.
    pub fn is_open(self, network: &Network) -> bool {
        network.subsystems.iter().any(|s| self.given(s).is_none())
    }

    /// The gain that was found and takes the place of the Riccati equation's.
    pub fn found(self, subsystem: &Subsystem) -> Option<&FoundGain> {
        match self {
            Self::Local => subsystem.gains.K_found.as_ref(),
            Self::Reference => subsystem.gains.calK_found.as_ref(),
        }
    }

    /// The gain, unless the Riccati equation has to give it.
    pub fn fixed(self, subsystem: &Subsystem) -> Option<&DMatrix<f64>> {
        self.given(subsystem).or_else(|| self.found(subsystem).map(|found| &found.gain))
    }

    /// Puts a found gain into the place of the Riccati equation's; a given one stays what it is.
    pub fn put(self, subsystem: &mut Subsystem, found: Option<FoundGain>) {
        match self {
            Self::Local => subsystem.gains.K_found = found,
            Self::Reference => subsystem.gains.calK_found = found,
        }
    }

    fn price(self, subsystem: &Subsystem) -> Price {
        let (Q, R) = match self {
            Self::Local => subsystem.gains.weights.clone(),
            Self::Reference => subsystem.gains.reference_weights.clone(),
        };
        // A gain that is given has no input left to choose.
        let R = if self.given(subsystem).is_some() { DMatrix::zeros(0, 0) } else { R };
        Price { Q, R }
    }

    /// A_ii, B_ii, or calA_ii, calB_ii.
    fn own(self, subsystem: &Subsystem) -> (DMatrix<f64>, DMatrix<f64>) {
        match self {
            Self::Local => (subsystem.A.clone(), subsystem.B.clone()),
            Self::Reference => augmented(subsystem),
        }
    }

    /// A_ij, B_ij, or calA_ij, calB_ij of (7e), for a neighbour j.
    fn imported(self, to: &Subsystem, j: usize, from: &Subsystem) -> (DMatrix<f64>, DMatrix<f64>) {
        let EL = &to.E * &to.L[&j];
        let (A, B) = (&EL * &from.Cz, EL * &from.Dz);
        match self {
            Self::Local => (A, B),
            Self::Reference => {
                let (rows, columns) = (to.n() + to.p(), from.n() + from.p());
                (A.resize(rows, columns, 0.0), B.resize_vertically(rows, 0.0))
            }
        }
    }
}

/// The network with the given gains of `layer` closed, and what is to be paid for the others.
pub fn interconnection(network: &Network, layer: Layer) -> (Interconnection, Vec<Price>) {
    let parts = &network.subsystems;
    let (mut A, mut B) = (BTreeMap::new(), BTreeMap::new());
    let mut insert = |i: usize, j: usize, (a, b): (DMatrix<f64>, DMatrix<f64>)| {
        let closed = layer.given(&parts[j]).map(|K| (a.clone() + &b * K, DMatrix::zeros(b.nrows(), 0)));
        let (a, b) = closed.unwrap_or((a, b));
        A.insert((i, j), a);
        B.insert((i, j), b);
    };
    for (i, s) in parts.iter().enumerate() {
        insert(i, i, layer.own(s));
        s.L.keys().for_each(|&j| insert(i, j, layer.imported(s, j, &parts[j])));
    }
    (Interconnection { A, B }, parts.iter().map(|s| layer.price(s)).collect())
}
