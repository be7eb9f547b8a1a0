//! Working sets, and the optimum over each as a function of the parameters.

use std::collections::BTreeMap;
use std::rc::Rc;

use dpc_runtime::solver::Side;
use nalgebra::{DMatrix, DVector};

use super::space::Space;
use crate::problems::DpcProblem;

/// The one-sided inequalities normal . w >= limit . (1, p) of a problem.
pub struct Facets {
    /// Row of the problem, and its side.
    pub of: Vec<(usize, Side)>,
    /// One row each.
    pub normals: DMatrix<f64>,
    pub limits: DMatrix<f64>,
}

impl Facets {
    pub fn new(dpc: &DpcProblem, space: &Space) -> Self {
        let mut of = Vec::new();
        for r in 0..dpc.rows.len() {
            for (side, limits) in [(Side::Lower, &space.lower), (Side::Upper, &space.upper)] {
                if limits[(r, 0)].is_finite() {
                    of.push((r, side));
                }
            }
        }
        let sign = |side: Side| if side == Side::Lower { 1.0 } else { -1.0 };
        let limit = |(r, side): (usize, Side), c: usize| match side {
            Side::Lower => space.lower[(r, c)],
            Side::Upper => -space.upper[(r, c)],
        };
        Self {
            normals: DMatrix::from_fn(of.len(), dpc.V.ncols(), |f, k| sign(of[f].1) * dpc.V[(of[f].0, k)]),
            limits: DMatrix::from_fn(of.len(), 1 + space.dimension(), |f, c| limit(of[f], c)),
            of,
        }
    }

    /// The facet of a row's side.
    pub fn find(&self, row: usize, side: Side) -> Option<usize> {
        self.of.iter().position(|other| *other == (row, side))
    }
}

/// The optimum over a working set: every number of it as a function of (1, p).
pub struct Optimum {
    /// Facets, in ascending order.
    pub set: Vec<usize>,
    /// One row each.
    pub multipliers: DMatrix<f64>,
    /// limit - normal . w of every facet.
    pub violations: DMatrix<f64>,
    /// (N'N)^-1 N'.
    onto: DMatrix<f64>,
}

/// How a facet lies to a working set: normal = N combination + remainder.
pub struct Direction {
    pub combination: DVector<f64>,
    /// |remainder|^2.
    pub pivot: f64,
}

/// A row depends on others when the square of its distance from their span is below this: the solver's `DEPENDENT`.
pub const DEPENDENT: f64 = 1e-14;

impl Optimum {
    /// `None` where the normals are dependent.
    fn new(facets: &Facets, set: &[usize]) -> Option<Self> {
        let N = facets.normals.select_rows(set).transpose();
        let limits = facets.limits.select_rows(set);
        let qr = N.clone().qr();
        let R = qr.r();
        let onto =
            if set.is_empty() { DMatrix::zeros(0, N.nrows()) } else { R.solve_upper_triangular(&qr.q().transpose())? };
        let multipliers =
            if set.is_empty() { limits } else { R.solve_upper_triangular(&R.tr_solve_upper_triangular(&limits)?)? };
        let violations = &facets.limits - &facets.normals * (N * &multipliers);
        Some(Self { set: set.to_vec(), multipliers, violations, onto })
    }

    pub fn direction(&self, facets: &Facets, facet: usize) -> Direction {
        let normal = facets.normals.row(facet).transpose();
        let mut combination = &self.onto * &normal;
        let mut remainder = normal;
        let N = facets.normals.select_rows(&self.set).transpose();
        remainder -= &N * &combination;
        // Once more, for what rounding left along the span.
        let correction = &self.onto * &remainder;
        remainder -= &N * &correction;
        combination += correction;
        Direction { combination, pivot: remainder.norm_squared() }
    }
}

/// All working sets that were asked for.
pub struct Optima<'a> {
    pub facets: &'a Facets,
    known: BTreeMap<Vec<usize>, Option<Rc<Optimum>>>,
}

impl<'a> Optima<'a> {
    pub fn new(facets: &'a Facets) -> Self {
        Self { facets, known: BTreeMap::new() }
    }

    /// The optimum over `set`, in ascending order; `None` where its normals are dependent.
    pub fn over(&mut self, set: &[usize]) -> Option<Rc<Optimum>> {
        let facets = self.facets;
        self.known.entry(set.to_vec()).or_insert_with(|| Optimum::new(facets, set).map(Rc::new)).clone()
    }

    /// The largest independent parts of a set of facets: which of them a start takes depends on the order they stand in.
    pub fn bases(&mut self, set: &[usize]) -> Vec<Vec<usize>> {
        let mut bases = vec![Vec::new()];
        for &facet in set {
            bases = bases.iter().flat_map(|basis| self.exchanged(basis, facet)).collect();
            bases.sort();
            bases.dedup();
        }
        bases
    }

    /// The basis with the facet, or where it depends on the basis, with it in the place of each that it depends on, and without it.
    fn exchanged(&mut self, basis: &[usize], facet: usize) -> Vec<Vec<usize>> {
        let Some(optimum) = self.over(basis) else { return vec![basis.to_vec()] };
        let Direction { combination, pivot } = optimum.direction(self.facets, facet);
        let with = |others: &mut dyn Iterator<Item = usize>| {
            let mut set: Vec<usize> = others.chain([facet]).collect();
            set.sort_unstable();
            set
        };
        if pivot > DEPENDENT && basis.len() < self.facets.normals.ncols() {
            return vec![with(&mut basis.iter().copied())];
        }
        let largest = combination.amax();
        let replaced = (0..basis.len()).filter(|&k| combination[k].abs() > 1e-6 * largest);
        let replaced =
            replaced.map(|out| with(&mut basis.iter().copied().enumerate().filter(|(k, _)| *k != out).map(|(_, f)| f)));
        replaced.chain([basis.to_vec()]).collect()
    }
}
