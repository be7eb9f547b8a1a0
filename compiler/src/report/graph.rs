//! Who acts on whom, how strongly, and around which loop.

#![expect(non_snake_case, reason = "the paper's symbols")]

use crate::design::Design;
use crate::sets::{critical_loop, link_gain};

/// The network as nodes and arrows.
#[derive(Debug, Clone)]
pub struct Graph {
    /// Number of subsystems.
    pub count: usize,
    /// From every neighbour to the subsystem it acts on.
    pub links: Vec<Link>,
    /// Pairs that share a coupling constraint, each once, with the constraints' names.
    pub shared: Vec<(usize, usize, String)>,
    pub critical: Option<Loop>,
}

/// L_ij of (2): what `from` does to `to`.
#[derive(Debug, Clone)]
pub struct Link {
    pub from: usize,
    pub to: usize,
    /// Largest entry of S_ij of Assumption 4.
    pub gain: f64,
    /// The coupling outputs of `from` that reach `to`, each with its row of S_ij.
    pub signals: Vec<(String, f64)>,
}

/// The loop that carries the spectral radius of S.
#[derive(Debug, Clone)]
pub struct Loop {
    /// In the direction of the arrows.
    pub members: Vec<usize>,
    /// Product of the gains along it.
    pub gain: f64,
}

impl Loop {
    /// Whether the arrow is part of it.
    pub fn has(&self, link: &Link) -> bool {
        let next = |k: usize| self.members[(k + 1) % self.members.len()];
        (0..self.members.len()).any(|k| self.members[k] == link.from && next(k) == link.to)
    }

    /// Geometric mean of the gains along it: the radius of the loop by itself.
    pub fn mean(&self) -> f64 {
        self.gain.powf(1.0 / self.members.len() as f64)
    }
}

impl Graph {
    pub fn new(design: &Design) -> Self {
        let parts = &design.network.subsystems;
        let links: Vec<Link> = (0..parts.len())
            .flat_map(|i| parts[i].L.keys().map(move |&j| (i, j)))
            .map(|(i, j)| link(design, i, j))
            .collect();
        let critical = (!links.is_empty()).then(|| loop_of(design)).flatten();
        Self { count: parts.len(), links, shared: shared(design), critical }
    }

    /// Pairs that are drawn near each other, each once.
    pub fn pairs(&self) -> Vec<(usize, usize)> {
        let links = self.links.iter().map(|link| (link.from.min(link.to), link.from.max(link.to)));
        let all = links.chain(self.shared.iter().map(|&(a, b, _)| (a, b)));
        all.collect::<std::collections::BTreeSet<_>>().into_iter().collect()
    }

    pub fn largest_gain(&self) -> f64 {
        self.links.iter().fold(0.0, |largest, link| f64::max(largest, link.gain))
    }
}

fn link(design: &Design, i: usize, j: usize) -> Link {
    let (to, from) = (&design.network.subsystems[i], &design.network.subsystems[j]);
    let sets = &design.sets;
    let gain_of = |k: usize| {
        let column = sets.z_offset[j] + k;
        let rows = sets.z_offset[i]..sets.z_offset[i] + to.nz();
        let entry = |row: usize| sets.small_gain.row(row).iter().find(|(c, _)| *c == column).map_or(0.0, |(_, v)| *v);
        rows.map(entry).fold(0.0, f64::max)
    };
    let L = &to.L[&j];
    let signals = (0..from.nz()).filter(|&k| L.column(k).amax() > 0.0);
    let signals = signals.map(|k| (from.coupling_outputs[k].clone(), gain_of(k))).collect();
    Link { from: j, to: i, gain: link_gain(&design.network, sets, i, j), signals }
}

fn loop_of(design: &Design) -> Option<Loop> {
    // Against the arrows: each is followed by the one that acts on it most.
    let mut members = critical_loop(&design.network, &design.sets);
    members.reverse();
    let gains = (0..members.len()).map(|k| {
        let (from, to) = (members[k], members[(k + 1) % members.len()]);
        link_gain(&design.network, &design.sets, to, from)
    });
    let gain: f64 = gains.product();
    (gain > 0.0).then_some(Loop { members, gain })
}

/// Pairs in the same coupling constraint; of one over many members only those that follow each other.
fn shared(design: &Design) -> Vec<(usize, usize, String)> {
    let network = &design.network;
    let fixed = network.coupling_constraints.iter().map(|c| (&c.name, c.H.keys().copied().collect::<Vec<_>>()));
    let changing = network.changing_constraints.iter().map(|c| (&c.name, c.members.clone()));
    let mut pairs: std::collections::BTreeMap<(usize, usize), Vec<String>> = std::collections::BTreeMap::new();
    for (name, members) in fixed.chain(changing) {
        for pair in members.windows(2) {
            pairs.entry((pair[0], pair[1])).or_default().push(name.clone());
        }
    }
    pairs.into_iter().map(|((a, b), names)| (a, b, names.join(", "))).collect()
}
