//! The plants of `cases/plants` and what a closed loop needs of them.

use dpc_codegen::network::{NamedPolytope, Network, Subsystem};

use crate::checker::Lowered;
use crate::random_network::{Part, Plant, Region};
use crate::unknowns::Unknowns;

/// The plant that a network describes, for [`crate::host_loop::HostLoop`].
pub fn plant(network: &Network) -> Plant {
    let Lowered { A, B, C, x, u, y } = Lowered::new(network);
    let parts = network.subsystems.iter().enumerate().map(|(i, s)| part(s, [x[i], u[i], y[i]])).collect();
    Plant { A, B, C, parts, coupling: Vec::new() }
}

fn part(s: &Subsystem, [x, u, y]: [usize; 3]) -> Part {
    let [x, u, y] = [x..x + s.n(), u..u + s.m(), y..y + s.p()];
    Part { x, u, y, X: region(&s.X), U: region(&s.U), unknowns: Unknowns::of(s) }
}

/// The rows alone: a region's ends are left open.
fn region(set: &NamedPolytope) -> Region {
    let rows = set.H.row_iter().zip(&set.h).map(|(row, h)| (row.iter().copied().collect(), *h));
    let n = set.H.ncols();
    Region { min: vec![f64::NEG_INFINITY; n], max: vec![f64::INFINITY; n], rows: rows.collect() }
}
