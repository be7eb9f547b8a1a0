#![expect(non_snake_case, reason = "the symbols of the literature")]

use nalgebra::{DMatrix, DVector};

use super::Polytope;
use crate::optim::lp::{self, Outcome};
use crate::optim::rounding::{dot_upper, sum_upper};

/// {x : |P x| <= q}, symmetric about 0; q >= 0. Two facets per row.
#[derive(Debug, Clone, PartialEq)]
pub struct Strips {
    pub P: DMatrix<f64>,
    pub q: DVector<f64>,
}

impl Strips {
    /// Number of facets: two per strip.
    pub fn facets(&self) -> usize {
        2 * self.q.len()
    }

    /// Smallest q - |P x|: not negative where x is inside.
    pub fn slack(&self, x: &DVector<f64>) -> f64 {
        (&self.P * x).iter().zip(&self.q).map(|(v, q)| q - v.abs()).fold(f64::INFINITY, f64::min)
    }

    /// Half-widths of a box that contains the set; infinite where the set is unbounded.
    pub fn hull(&self) -> DVector<f64> {
        let n = self.P.ncols();
        let proofs: Vec<_> =
            (0..n).map(|k| multiplier(&self.P, &self.q, &DVector::from_fn(n, |j, _| f64::from(j == k)))).collect();
        let first = |k: usize| proofs[k].as_ref().map_or(f64::INFINITY, |proof| proof.on(&self.q));
        // The residuals act on the hull itself, and are far too small to double it: twice the first bound is a hull,
        // and with it they are accounted for.
        let twice = DVector::from_fn(n, |k, _| 2.0 * first(k));
        DVector::from_fn(n, |k, _| proofs[k].as_ref().map_or(f64::INFINITY, |proof| proof.bound(&self.q, &twice)))
    }

    /// The same set as {H x <= h}, H = [P; -P].
    pub fn to_polytope(&self) -> Polytope {
        let (r, n) = self.P.shape();
        Polytope {
            H: DMatrix::from_fn(2 * r, n, |i, j| if i < r { self.P[(i, j)] } else { -self.P[(i - r, j)] }),
            h: DVector::from_fn(2 * r, |i, _| self.q[i % r]),
        }
    }
}

/// A row mu with mu P = d: the proof that d'x <= |mu| q wherever |P x| <= q.
#[derive(Debug, Clone, PartialEq)]
pub struct Multiplier {
    pub mu: DVector<f64>,
    /// |d - mu P|, what rounding left.
    residual: DVector<f64>,
}

impl Multiplier {
    /// The same proof on the strips `kept`; the others must have no part in it.
    pub fn select(&self, kept: &[usize]) -> Self {
        Self { mu: self.mu.select_rows(kept), residual: self.residual.clone() }
    }

    /// |mu| q: the bound, but for the residual.
    pub fn on(&self, q: &DVector<f64>) -> f64 {
        self.mu.iter().zip(q).map(|(mu, q)| mu.abs() * q).sum()
    }

    /// Rigorous upper bound of d'x over {|P x| <= q}, whose hull is `hull`.
    pub fn bound(&self, q: &DVector<f64>, hull: &DVector<f64>) -> f64 {
        let main = sum_upper(self.mu.iter().zip(q).map(|(mu, q)| mu.abs() * q));
        sum_upper([main, self.residual_on(hull)])
    }

    /// What the residual adds to the bound.
    pub fn residual_on(&self, hull: &DVector<f64>) -> f64 {
        // 0 * inf: an unbounded hull does no harm where the residual is exactly zero.
        sum_upper(self.residual.iter().zip(hull).map(|(r, x)| if *r == 0.0 { 0.0 } else { r * x }))
    }
}

/// The multiplier of direction d that is best for offsets q: minimise |mu| q subject to mu P = d. `None` where the
/// strips do not bound d'x.
pub fn multiplier(P: &DMatrix<f64>, q: &DVector<f64>, d: &DVector<f64>) -> Option<Multiplier> {
    let (r, n) = P.shape();
    let offset = q.iter().copied().fold(0.0, f64::max);
    let cost = DVector::from_fn(2 * r, |j, _| if offset > 0.0 { q[j % r] / offset } else { 1.0 });
    // The solver's tolerances are absolute: it sees coordinates in which P has entries up to 1, and a direction of size 1.
    let unit = DVector::from_fn(n, |k, _| if P.column(k).amax() > 0.0 { P.column(k).amax() } else { 1.0 });
    let size = d.component_div(&unit).amax();
    if size == 0.0 {
        return Some(Multiplier { mu: DVector::zeros(r), residual: DVector::zeros(n) });
    }
    let signed = DMatrix::from_fn(n, 2 * r, |i, j| if j < r { P[(j, i)] / unit[i] } else { -P[(j - r, i)] / unit[i] });
    let wanted = d.component_div(&unit) / size;
    let Outcome::Optimal(solution) = lp::minimise(&cost, &signed, &wanted) else { return None };
    let mu = DVector::from_fn(r, |j, _| (solution.y[j] - solution.y[j + r]) * size);
    let residual = residual_bound(P, &mu, d);
    (residual.component_div(&unit).amax() <= 1e-9 * size).then_some(Multiplier { mu, residual })
}

/// [`multiplier`] for every row of D, stacked: (rows of D) multipliers.
pub fn multipliers(P: &DMatrix<f64>, q: &DVector<f64>, D: &DMatrix<f64>) -> Option<Vec<Multiplier>> {
    (0..D.nrows()).map(|i| multiplier(P, q, &D.row(i).transpose())).collect()
}

/// Upper bound of |d - mu P| over the real numbers.
fn residual_bound(P: &DMatrix<f64>, mu: &DVector<f64>, d: &DVector<f64>) -> DVector<f64> {
    DVector::from_fn(P.ncols(), |j, _| {
        let column: Vec<f64> = P.column(j).iter().copied().chain([-1.0]).collect();
        let weights: Vec<f64> = mu.iter().copied().chain([d[j]]).collect();
        let negated: Vec<f64> = weights.iter().map(|w| -w).collect();
        dot_upper(column.iter().zip(&weights)).max(dot_upper(column.iter().zip(&negated))).max(0.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hexagon() -> Strips {
        let P = DMatrix::from_row_slice(3, 2, &[1.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
        Strips { P, q: DVector::from_vec(vec![1.0, 1.0, 1.5]) }
    }

    #[test]
    fn multiplier_proves_the_support_value() {
        let set = hexagon();
        let d = DVector::from_vec(vec![2.0, 1.0]);
        let m = multiplier(&set.P, &set.q, &d).unwrap();
        let (value, _) = set.to_polytope().support(&d).unwrap();
        assert!((m.on(&set.q) - 2.5).abs() < 1e-12 && (value - 2.5).abs() < 1e-12);
        assert!(m.bound(&set.q, &set.hull()) >= 2.5);
    }

    #[test]
    fn an_unbounded_direction_has_no_multiplier() {
        let P = DMatrix::from_row_slice(1, 2, &[1.0, 0.0]);
        assert!(multiplier(&P, &DVector::from_element(1, 1.0), &DVector::from_vec(vec![0.0, 1.0])).is_none());
    }
}
