//! One subsystem as its own node sees it: sizes, neighbours, and where their messages go.

use nalgebra::DMatrix;

use crate::design::Design;
use crate::gains::SubsystemGains;
use crate::network::{ChangingConstraint, CouplingConstraint, Loads, Scalar, Signal, Subsystem};
use crate::problems::{RowKind, SubsystemProblems};
use crate::sizing::SubsystemSizing;

/// Subsystem `i` of a design.
pub struct Node<'a> {
    pub design: &'a Design,
    pub i: usize,
    /// Index of each neighbour, by slot: ascending.
    pub neighbours: Vec<Neighbour>,
    /// C_i: the coupling constraints on this subsystem, by index.
    pub constraints: Vec<usize>,
    /// The changing constraints on this subsystem, by index.
    pub changing: Vec<usize>,
    pub sizes: Sizes,
}

/// Whom this node hears.
pub struct Neighbour {
    /// Index of the subsystem.
    pub j: usize,
    /// Its first imported coupling output, where L_ij is not zero.
    pub z: Option<usize>,
    /// Its first imported output, where a coupling constraint joins the two.
    pub y: Option<usize>,
}

/// The constant parameters of the runtime's types.
pub struct Sizes {
    pub nx: usize,
    pub nu: usize,
    pub ny: usize,
    pub nz: usize,
    pub ni: usize,
    pub nj: usize,
    pub nc: usize,
    pub nh: usize,
    pub n: usize,
    pub nv: usize,
    pub nr: usize,
    pub nt: usize,
    pub ns: usize,
    pub nq: usize,
}

impl<'a> Node<'a> {
    pub fn new(design: &'a Design, i: usize) -> Self {
        let (constraints, changing) = (constraints_on(design, i), changing_on(design, i));
        let neighbours = neighbours(design, i, &constraints, &changing);
        let sizes = Sizes::new(design, i, &neighbours, (constraints.len(), changing.len()));
        Self { design, i, neighbours, constraints, changing, sizes }
    }

    /// What this node computes in.
    pub fn scalar(&self) -> Scalar {
        self.design.network.scalar
    }

    pub fn model(&self) -> &'a Subsystem {
        &self.design.network.subsystems[self.i]
    }

    pub fn loads(&self) -> &'a Loads {
        &self.model().loads
    }

    /// Loads of the whole network.
    pub fn network_loads(&self) -> usize {
        self.design.network.subsystems.iter().map(|s| s.loads.len()).sum()
    }

    pub fn gains(&self) -> &'a SubsystemGains {
        &self.design.gains.subsystems[self.i]
    }

    pub fn sets(&self) -> &'a SubsystemSizing {
        &self.design.sizing.subsystems[self.i]
    }

    pub fn problems(&self) -> &'a SubsystemProblems {
        &self.design.problems.subsystems[self.i]
    }

    pub fn other(&self, neighbour: &Neighbour) -> &'a Subsystem {
        &self.design.network.subsystems[neighbour.j]
    }

    pub fn constraint(&self, h: usize) -> &'a CouplingConstraint {
        &self.design.network.coupling_constraints[h]
    }

    pub fn changing_constraint(&self, h: usize) -> &'a ChangingConstraint {
        &self.design.network.changing_constraints[h]
    }

    /// What each imported coupling output is: `right: 0.0206 h4`.
    pub fn imported_z(&self) -> Vec<String> {
        let from = |neighbour: &'_ Neighbour| {
            let other = self.other(neighbour);
            other.coupling_outputs.iter().map(|z| format!("{}: {z}", other.name)).collect::<Vec<_>>()
        };
        self.neighbours.iter().filter(|neighbour| neighbour.z.is_some()).flat_map(from).collect()
    }

    /// What each imported output is: `right: h3 [cm]`.
    pub fn imported_y(&self) -> Vec<String> {
        let from = |neighbour: &'_ Neighbour| {
            let other = self.other(neighbour);
            other.outputs.iter().map(|y| format!("{}: {}", other.name, labelled(y))).collect::<Vec<_>>()
        };
        self.neighbours.iter().filter(|neighbour| neighbour.y.is_some()).flat_map(from).collect()
    }

    /// [E_i L_ij ...] over the imported coupling outputs.
    pub fn import_gain(&self) -> DMatrix<f64> {
        let model = self.model();
        let mut gain = DMatrix::zeros(self.sizes.nx, self.sizes.ni);
        for neighbour in &self.neighbours {
            if let (Some(first), Some(link)) = (neighbour.z, model.L.get(&neighbour.j)) {
                gain.view_mut((0, first), (self.sizes.nx, link.ncols())).copy_from(&(&model.E * link));
            }
        }
        gain
    }
}

/// `h1 [cm]`, as in the file.
pub fn labelled(signal: &Signal) -> String {
    match &signal.unit {
        Some(unit) => format!("{} [{unit}]", signal.name),
        None => signal.name.clone(),
    }
}

pub fn labels(signals: &[Signal]) -> Vec<String> {
    signals.iter().map(labelled).collect()
}

fn constraints_on(design: &Design, i: usize) -> Vec<usize> {
    let all = design.network.coupling_constraints.iter().enumerate();
    all.filter(|(_, constraint)| constraint.H.contains_key(&i)).map(|(h, _)| h).collect()
}

fn changing_on(design: &Design, i: usize) -> Vec<usize> {
    let all = design.network.changing_constraints.iter().enumerate();
    all.filter(|(_, constraint)| constraint.members.contains(&i)).map(|(h, _)| h).collect()
}

fn neighbours(design: &Design, i: usize, constraints: &[usize], changing: &[usize]) -> Vec<Neighbour> {
    let network = &design.network;
    let shares = |j: usize| {
        constraints.iter().any(|&h| network.coupling_constraints[h].H.contains_key(&j))
            || changing.iter().any(|&h| network.changing_constraints[h].members.contains(&j))
    };
    let (mut z, mut y) = (0, 0);
    let mut neighbours = Vec::new();
    for (j, other) in network.subsystems.iter().enumerate().filter(|&(j, _)| j != i) {
        let dynamic = network.subsystems[i].L.contains_key(&j);
        let neighbour = Neighbour { j, z: dynamic.then_some(z), y: shares(j).then_some(y) };
        z += if neighbour.z.is_some() { other.nz() } else { 0 };
        y += if neighbour.y.is_some() { other.p() } else { 0 };
        if neighbour.z.is_some() || neighbour.y.is_some() {
            neighbours.push(neighbour);
        }
    }
    neighbours
}

impl Sizes {
    fn new(design: &Design, i: usize, neighbours: &[Neighbour], (nc, nh): (usize, usize)) -> Self {
        let network = &design.network;
        let model = &network.subsystems[i];
        let dpc = &design.problems.subsystems[i].dpc;
        let rows = |of_kind: fn(&RowKind) -> bool| dpc.rows.iter().filter(|row| of_kind(&row.kind)).count();
        let others = |chosen: fn(&Neighbour) -> bool, size: fn(&Subsystem) -> usize| {
            neighbours.iter().filter(|n| chosen(n)).map(|n| size(&network.subsystems[n.j])).sum()
        };
        Self {
            nx: model.n(),
            nu: model.m(),
            ny: model.p(),
            nz: model.nz(),
            ni: others(|n| n.z.is_some(), Subsystem::nz),
            nj: others(|n| n.y.is_some(), Subsystem::p),
            nc,
            nh,
            n: network.horizon,
            nv: dpc.H.nrows(),
            nr: dpc.rows.len(),
            nt: rows(|kind| matches!(kind, RowKind::Tube)),
            ns: rows(|kind| matches!(kind, RowKind::State(_))),
            nq: rows(|kind| matches!(kind, RowKind::Input(_))),
        }
    }
}
