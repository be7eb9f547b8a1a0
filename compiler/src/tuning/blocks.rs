//! Which entries are searched together.

use super::candidate::Candidate;
use crate::gains::Layer;
use crate::network::{Network, Subsystem};

/// Subsystems with equal own dynamics, limits and gains: they share variables.
pub type Group = Vec<usize>;

/// The gains of one layer of some groups, searched together.
#[derive(Debug, Clone)]
pub struct Block {
    pub groups: Vec<Group>,
    pub layer: Layer,
}

/// Blocks of more variables than this make the simplex search slow.
const MOST_VARIABLES: usize = 8;

/// Subsystems whose gains the file leaves open, equal ones together.
pub fn groups(network: &Network, candidate: &Candidate, layer: Layer) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    let same = |i: usize, j: usize| {
        let (one, other) = (&network.subsystems[i], &network.subsystems[j]);
        alike(one, other) && candidate.0[i] == candidate.0[j]
    };
    for i in (0..network.subsystems.len()).filter(|&i| is_open(&network.subsystems[i], layer)) {
        match groups.iter_mut().find(|group| same(group[0], i)) {
            Some(group) => group.push(i),
            None => groups.push(vec![i]),
        }
    }
    groups
}

/// Whether the gain is ours to choose.
pub fn is_open(s: &Subsystem, layer: Layer) -> bool {
    layer.given(s).is_none()
}

/// One block where the variables are few, else one per group.
pub fn blocks(groups: Vec<Group>, candidate: &Candidate, layer: Layer) -> Vec<Block> {
    let variables: usize = groups.iter().map(|group| candidate.get(group[0], layer).len()).sum();
    if groups.is_empty() {
        return Vec::new();
    }
    if variables <= MOST_VARIABLES {
        return vec![Block { groups, layer }];
    }
    groups.into_iter().map(|group| Block { groups: vec![group], layer }).collect()
}

impl Block {
    /// Number of variables.
    pub fn len(&self, candidate: &Candidate) -> usize {
        self.groups.iter().map(|group| candidate.get(group[0], self.layer).len()).sum()
    }

    /// `candidate` with each entry k of the block moved by x_k times its scale; the scale is `step` of the entry, and at
    /// least that share of a tenth of the largest entry beside it.
    pub fn moved(&self, candidate: &Candidate, step: f64, x: &[f64]) -> Candidate {
        let mut moved = candidate.clone();
        let mut x = x.iter();
        for group in &self.groups {
            let gain = candidate.get(group[0], self.layer);
            let least = 0.1 * gain.amax().max(1e-3);
            let new = gain.map(|entry| entry + step * entry.abs().max(least) * x.next().copied().unwrap_or_default());
            group.iter().for_each(|&i| moved.set(i, self.layer, new.clone()));
        }
        moved
    }
}

fn alike(one: &Subsystem, other: &Subsystem) -> bool {
    one.A == other.A && one.B == other.B && one.C == other.C && one.X.h == other.X.h && one.U.h == other.U.h
}
