//! Gains to compare.

use nalgebra::DMatrix;

use crate::gains::{Gains, Layer, Radii, SubsystemGains, short};
use crate::network::{FoundBy, FoundGain, Network, Subsystem};

/// K_i and calK_i of every subsystem, rounded as those of a design are: what is compared is what is used.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate(pub Vec<(DMatrix<f64>, DMatrix<f64>)>);

impl Candidate {
    pub fn of(gains: &Gains) -> Self {
        Self(gains.subsystems.iter().map(|g| (g.K.clone(), g.calK())).collect())
    }

    /// By the Riccati equations of each subsystem, or as given; `None` where one has no solution.
    pub fn local(subsystems: &[Subsystem]) -> Option<Self> {
        subsystems.iter().map(|s| SubsystemGains::local(s).ok()).collect::<Option<Vec<_>>>().map(Self)
    }

    /// The network with these gains.
    pub fn network(&self, network: &Network) -> Network {
        let mut network = network.clone();
        for (s, (K, calK)) in network.subsystems.iter_mut().zip(&self.0) {
            for (layer, gain) in [(Layer::Local, K), (Layer::Reference, calK)] {
                layer.put(s, Some(FoundGain { gain: gain.clone(), by: FoundBy::Search }));
            }
        }
        network
    }

    pub fn radii(&self, network: &Network) -> Radii {
        Radii::new(network, &self.0)
    }

    pub fn get(&self, i: usize, layer: Layer) -> &DMatrix<f64> {
        match layer {
            Layer::Local => &self.0[i].0,
            Layer::Reference => &self.0[i].1,
        }
    }

    /// Another gain for subsystem i.
    pub fn set(&mut self, i: usize, layer: Layer, gain: DMatrix<f64>) {
        let gain = short(gain);
        match layer {
            Layer::Local => self.0[i].0 = gain,
            Layer::Reference => self.0[i].1 = gain,
        }
    }

    /// With the gains of one layer from `other`.
    pub fn with(&self, layer: Layer, other: &Self) -> Self {
        let pairs = self.0.iter().zip(&other.0).map(|((K, calK), (other_K, other_calK))| match layer {
            Layer::Local => (other_K.clone(), calK.clone()),
            Layer::Reference => (K.clone(), other_calK.clone()),
        });
        Self(pairs.collect())
    }

    pub fn same_local(&self, other: &Self) -> bool {
        self.0.iter().zip(&other.0).all(|((K, _), (other, _))| K == other)
    }
}
