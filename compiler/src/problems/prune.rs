//! Rows that no admissible parameter can make active are left out, each with a linear program as its proof.

use nalgebra::{DMatrix, DVector};

use super::RowKind;
use super::condense::{Condensed, TwoSided};
use crate::convex::Polytope;
use crate::network::Subsystem;
use crate::sizing::SubsystemSizing;

/// Drops, one after the other, every facet that the facets still there, with what may be beyond their limits, imply for all v and all references inside
/// what (25b) leaves them. Tube rows stay: e is any deviation for which the problem has a solution, and each of
/// them can stop that. Nothing else depends on e, so it does not enter. A problem of very many rows is left as it is. With `anywhere` the references may be any: those of
/// start-up plans go beyond (25b).
pub fn prune(condensed: Condensed, s: &Subsystem, sized: &SubsystemSizing, N: usize, anywhere: bool) -> Condensed {
    let space = Space { s, N };
    if !is_tried(&condensed, s, N) {
        return condensed;
    }
    let (tube, mut rows): (Vec<_>, Vec<_>) = condensed.rows.into_iter().partition(|row| row.kind == RowKind::Tube);
    let references = if anywhere { Vec::new() } else { space.references(sized) };
    // What is left out is implied by what stays, so the hull of all facets remains one.
    let hull = space.polytope(&rows, None, &references).hull();
    for r in (0..rows.len()).rev() {
        for side in [Side::Upper, Side::Lower] {
            if side.limit(&rows[r]).is_finite() && space.implied(&rows, (r, side), &references, &hull) {
                *side.limit_mut(&mut rows[r]) = f64::INFINITY * side.sign();
            }
        }
    }
    rows.retain(|row| row.facets() > 0);
    Condensed { H: condensed.H, rows: tube.into_iter().chain(rows).collect() }
}

/// Whether the problem is small enough for it.
pub fn is_tried(condensed: &Condensed, s: &Subsystem, N: usize) -> bool {
    condensed.rows.len() * Space { s, N }.dimension() <= MOST_WORK
}

/// Rows times unknowns of the largest problem that is pruned: the work grows with the square of it, and takes some seconds here.
const MOST_WORK: usize = 30_000;

#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Lower,
    Upper,
}

impl Side {
    fn sign(self) -> f64 {
        if self == Self::Upper { 1.0 } else { -1.0 }
    }
    fn limit(self, row: &TwoSided) -> f64 {
        self.sign() * if self == Self::Upper { row.upper } else { row.lower }
    }
    fn limit_mut(self, row: &mut TwoSided) -> &mut f64 {
        if self == Self::Upper { &mut row.upper } else { &mut row.lower }
    }
}

/// The space of (v, xref_0, uref_0, ..., xref_{N-1}, uref_{N-1}).
struct Space<'a> {
    s: &'a Subsystem,
    N: usize,
}

impl Space<'_> {
    fn unknowns(&self) -> usize {
        self.s.n() + self.N * self.s.m()
    }

    fn dimension(&self) -> usize {
        self.unknowns() + self.N * (self.s.n() + self.s.m())
    }

    fn x_ref(&self, k: usize) -> usize {
        self.unknowns() + k * (self.s.n() + self.s.m())
    }

    fn u_ref(&self, k: usize) -> usize {
        self.x_ref(k) + self.s.n()
    }

    /// What (25b) leaves the references: H xref_k <= x_ref, H uref_k <= u_ref.
    fn references(&self, sized: &SubsystemSizing) -> Vec<(DVector<f64>, f64)> {
        let mut facets = Vec::new();
        for k in 0..self.N {
            for (H, h, start) in
                [(&self.s.X.H, &sized.x_ref, self.x_ref(k)), (&self.s.U.H, &sized.u_ref, self.u_ref(k))]
            {
                facets.extend((0..h.len()).map(|r| (self.place(&H.row(r).transpose(), start), h[r])));
            }
        }
        facets
    }

    fn place(&self, part: &DVector<f64>, start: usize) -> DVector<f64> {
        let mut whole = DVector::zeros(self.dimension());
        whole.rows_mut(start, part.len()).copy_from(part);
        whole
    }

    /// A row over the whole space.
    fn direction(&self, row: &TwoSided) -> DVector<f64> {
        let mut whole = self.place(&row.g, 0);
        match row.kind {
            RowKind::State(k) => whole += self.place(&row.offset, self.x_ref(k)),
            RowKind::Input(k) => whole += self.place(&row.offset, self.u_ref(k)),
            _ => {}
        }
        whole
    }

    /// Whether every point that satisfies the other facets satisfies this one, by an upper bound of its support value.
    fn implied(
        &self,
        rows: &[TwoSided],
        facet: (usize, Side),
        references: &[(DVector<f64>, f64)],
        hull: &DVector<f64>,
    ) -> bool {
        let (r, side) = facet;
        let wanted = self.direction(&rows[r]) * side.sign();
        let size = wanted.norm();
        let bound = self.polytope(rows, Some(facet), references).bound(&(wanted / size), hull);
        bound.is_some_and(|bound| bound <= side.limit(&rows[r]) / size * (1.0 - 1e-9))
    }

    /// All facets but one, and what (25b) leaves the references.
    fn polytope(
        &self,
        rows: &[TwoSided],
        without: Option<(usize, Side)>,
        references: &[(DVector<f64>, f64)],
    ) -> Polytope {
        let mut facets: Vec<(DVector<f64>, f64)> = references.to_vec();
        for (r, row) in rows.iter().enumerate() {
            let direction = self.direction(row);
            for side in [Side::Upper, Side::Lower] {
                if Some((r, side)) != without && side.limit(row).is_finite() {
                    facets.push((&direction * side.sign(), side.limit(row) + row.reserve.exact));
                }
            }
        }
        scaled(&facets, self.dimension())
    }
}

/// Facets with unit normals.
fn scaled(facets: &[(DVector<f64>, f64)], dimension: usize) -> Polytope {
    let H = DMatrix::from_fn(facets.len(), dimension, |r, j| facets[r].0[j] / facets[r].0.norm());
    let h = DVector::from_fn(facets.len(), |r, _| facets[r].1 / facets[r].0.norm());
    Polytope { H, h }
}
