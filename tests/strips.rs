//! Support values of {x : |P x| <= q} by a dual simplex method of our own, each with primal and dual proof.
#![expect(non_snake_case, reason = "the symbols of the literature")]

use nalgebra::{DMatrix, DVector};

/// {x : |P x| <= q}, q > 0, bounded, in coordinates in which its widest basis of rows is the unit box.
#[derive(Debug, Clone)]
pub struct SymmetricSet {
    /// Rows a_k: the set is {y : |a_k . y| <= 1}.
    rows: DMatrix<f64>,
    /// x = `back` y.
    back: DMatrix<f64>,
    basis: Vec<usize>,
}

/// Largest d'x over the set, from both sides: they differ by rounding only, or the method did not end.
#[derive(Debug, Clone, Copy)]
pub struct Support {
    /// Value at a point of the set.
    pub attained: f64,
    /// Value of a dual certificate.
    pub proved: f64,
}

const PIVOTS: usize = 500;
const VIOLATED: f64 = 1e-12;

/// Directions that are parallel to a row leave multipliers at zero, whose signs would be rounding noise: they are tilted
/// by this much. The certificate pays for it.
const TILT: f64 = 1e-12;

impl SymmetricSet {
    /// `None` where q is not positive or the rows do not bound the set.
    pub fn new(P: &DMatrix<f64>, q: &DVector<f64>) -> Option<Self> {
        if !q.iter().all(|q| *q > 0.0 && q.is_finite()) {
            return None;
        }
        let scaled = DMatrix::from_fn(P.nrows(), P.ncols(), |r, k| P[(r, k)] / q[r]);
        let basis = widest_basis(&scaled)?;
        let back = scaled.select_rows(&basis).try_inverse()?;
        Some(Self { rows: &scaled * &back, back, basis })
    }

    /// Largest d'x. Both values are infinite where the method does not end.
    pub fn support(&self, d: &DVector<f64>) -> Support {
        let wanted = self.back.tr_mul(d);
        let size = wanted.amax();
        if size == 0.0 {
            return Support { attained: 0.0, proved: 0.0 };
        }
        let unit = self.solve(&(wanted / size));
        Support { attained: unit.attained * size, proved: unit.proved * size }
    }

    /// The dual simplex method: a basis is dual feasible once its rows have the signs of their multipliers; the most
    /// violated row enters until none is left.
    fn solve(&self, d: &DVector<f64>) -> Support {
        let (mut basis, mut signs) = (self.basis.clone(), vec![1.0; self.basis.len()]);
        let tilted = DVector::from_fn(d.len(), |k, _| d[k] + TILT * (k as f64 + 2.0).sqrt().fract());
        for _ in 0..PIVOTS {
            let Some(inverse) = self.rows.select_rows(&basis).try_inverse() else { break };
            let raw = inverse.tr_mul(&tilted);
            for (sign, mu) in signs.iter_mut().zip(&raw) {
                *sign = if *mu != 0.0 { mu.signum() } else { *sign };
            }
            let x = &inverse * DVector::from_column_slice(&signs);
            let values = &self.rows * &x;
            let worst = values.icamax();
            if values[worst].abs() <= 1.0 + VIOLATED {
                return self.certified(d, &basis, &raw, &x);
            }
            let entering = self.rows.row(worst).transpose() * values[worst].signum();
            let rates = inverse.tr_mul(&entering);
            let ratio = |k: usize| (raw[k] / rates[k]).abs();
            let Some(leaving) = (0..basis.len())
                .filter(|&k| rates[k] * signs[k] > 1e-13)
                .min_by(|&a, &b| ratio(a).total_cmp(&ratio(b)))
            else {
                break;
            };
            basis[leaving] = worst;
            signs[leaving] = values[worst].signum();
        }
        Support { attained: f64::NEG_INFINITY, proved: f64::INFINITY }
    }

    /// What is left of d after the multipliers is paid for in the unit box that holds the set.
    fn certified(&self, d: &DVector<f64>, basis: &[usize], mu: &DVector<f64>, x: &DVector<f64>) -> Support {
        let residual = d - self.rows.select_rows(basis).tr_mul(mu);
        let proved = mu.iter().map(|mu| mu.abs()).sum::<f64>() + residual.iter().map(|r| r.abs()).sum::<f64>();
        let outside = (&self.rows * x).amax().max(1.0);
        Support { attained: d.dot(x) / outside, proved }
    }
}

/// Rows of (locally) largest determinant: the others have entries of at most 1 in their coordinates.
fn widest_basis(rows: &DMatrix<f64>) -> Option<Vec<usize>> {
    let n = rows.ncols();
    let mut basis = greedy_basis(rows)?;
    for _ in 0..100 {
        let coordinates = rows * rows.select_rows(&basis).try_inverse()?;
        let (r, k) = largest_entry(&coordinates);
        if coordinates[(r, k)].abs() <= 1.0 + 1e-9 {
            break;
        }
        basis[k] = r;
    }
    (basis.len() == n).then_some(basis)
}

fn largest_entry(matrix: &DMatrix<f64>) -> (usize, usize) {
    let places = (0..matrix.nrows()).flat_map(|r| (0..matrix.ncols()).map(move |k| (r, k)));
    places.max_by(|&a, &b| matrix[a].abs().total_cmp(&matrix[b].abs())).unwrap_or((0, 0))
}

/// The longest row, then always the one farthest from the span of those chosen.
fn greedy_basis(rows: &DMatrix<f64>) -> Option<Vec<usize>> {
    let mut left = rows.clone();
    let mut basis = Vec::new();
    for _ in 0..rows.ncols() {
        let lengths: Vec<f64> = left.row_iter().map(|row| row.norm()).collect();
        let next = (0..lengths.len()).max_by(|&a, &b| lengths[a].total_cmp(&lengths[b]))?;
        if lengths[next] <= 1e-13 * rows.row(next).norm() {
            return None;
        }
        let axis = left.row(next).normalize().transpose();
        left -= &left * &axis * axis.transpose();
        basis.push(next);
    }
    Some(basis)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Random;

    /// The largest d'x over all vertices.
    fn by_vertices(P: &DMatrix<f64>, q: &DVector<f64>, d: &DVector<f64>) -> f64 {
        let (r, n) = P.shape();
        let mut best = f64::NEG_INFINITY;
        for chosen in 0usize..1 << r {
            if chosen.count_ones() as usize != n {
                continue;
            }
            let rows: Vec<usize> = (0..r).filter(|k| chosen >> k & 1 == 1).collect();
            let Some(inverse) = P.select_rows(&rows).try_inverse() else { continue };
            for signs in 0usize..1 << n {
                let ends = DVector::from_fn(n, |k, _| q[rows[k]] * if signs >> k & 1 == 1 { 1.0 } else { -1.0 });
                let x = &inverse * ends;
                if (P * &x).iter().zip(q).all(|(v, q)| v.abs() <= q * (1.0 + 1e-9) + 1e-12 * x.amax()) {
                    best = best.max(d.dot(&x));
                }
            }
        }
        best
    }

    #[test]
    fn agrees_with_the_best_vertex_also_of_flat_sets() {
        let random = &mut Random(7);
        for _ in 0..2000 {
            let n = 1 + random.below(4);
            let r = n + random.below(5);
            let P = DMatrix::from_fn(r, n, |_, _| random.between(-1.0, 1.0));
            let q = DVector::from_fn(r, |_, _| random.magnitude(1e-5, 1.0));
            let d = if random.chance(0.3) { P.row(random.below(r)).transpose() } else { random.direction(n) };
            let set = SymmetricSet::new(&P, &q).expect("random rows bound the set");
            let Support { attained, proved } = set.support(&d);
            let best = by_vertices(&P, &q, &d);
            assert!(attained <= proved * (1.0 + 1e-12) && proved - attained <= 1e-9 * proved, "{attained} {proved}");
            assert!((proved - best).abs() <= 1e-6 * best, "{proved} {best}");
        }
    }

    #[test]
    fn an_unbounded_set_is_refused() {
        let P = DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 4.0]);
        assert!(SymmetricSet::new(&P, &DVector::from_element(2, 1.0)).is_none());
    }
}
