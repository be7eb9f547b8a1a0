//! Maximisation without derivatives.

/// Largest merit that the simplex search of Nelder and Mead finds from `start` with about `evaluations` calls, in the
/// variant whose coefficients adapt to the dimension (Gao, Han, "Implementing the Nelder-Mead simplex algorithm with
/// adaptive parameters", Comput. Optim. Appl. 51, 2012). The first simplex reaches 1 along every axis: scale so that
/// this is a sensible step. Ends early where the simplex has shrunk to `tolerance`.
///
/// Only comparisons of merits are used, so that they may be of several kinds, one above the other.
pub fn climb<M: PartialOrd + Copy>(
    start: &[f64],
    evaluations: usize,
    tolerance: f64,
    merit: impl FnMut(&[f64]) -> M,
) -> (Vec<f64>, M) {
    let mut search = Search { merit, left: evaluations };
    let mut simplex = search.first(start);
    while search.left > 0 && start.len() < simplex.len() && width(&simplex) > tolerance {
        search.step(&mut simplex);
        sort(&mut simplex);
    }
    simplex.swap_remove(0)
}

type Vertex<M> = (Vec<f64>, M);

struct Search<F> {
    merit: F,
    left: usize,
}

impl<M: PartialOrd + Copy, F: FnMut(&[f64]) -> M> Search<F> {
    fn vertex(&mut self, x: Vec<f64>) -> Vertex<M> {
        self.left = self.left.saturating_sub(1);
        let merit = (self.merit)(&x);
        (x, merit)
    }

    /// `start` and a step along each axis, as far as the evaluations go; best first.
    fn first(&mut self, start: &[f64]) -> Vec<Vertex<M>> {
        let mut simplex = vec![self.vertex(start.to_vec())];
        for k in 0..start.len() {
            if self.left == 0 {
                break;
            }
            let mut x = start.to_vec();
            x[k] += 1.0;
            simplex.push(self.vertex(x));
        }
        sort(&mut simplex);
        simplex
    }

    /// Replaces the worst vertex, or shrinks towards the best.
    fn step(&mut self, simplex: &mut [Vertex<M>]) {
        let n = simplex.len() - 1;
        let size = (n as f64).max(2.0);
        let (expand, contract) = (1.0 + 2.0 / size, 0.75 - 0.5 / size);
        let centre = centre(&simplex[..n]);
        let along = |t: f64| -> Vec<f64> { centre.iter().zip(&simplex[n].0).map(|(c, w)| c + t * (c - w)).collect() };
        let reflected = self.vertex(along(1.0));
        let next = if reflected.1 > simplex[0].1 {
            let expanded = self.vertex(along(expand));
            if expanded.1 > reflected.1 { expanded } else { reflected }
        } else if reflected.1 > simplex[n - 1].1 {
            reflected
        } else {
            let outside = reflected.1 > simplex[n].1;
            let contracted = self.vertex(along(if outside { contract } else { -contract }));
            if contracted.1 > simplex[n].1 && !(outside && reflected.1 > contracted.1) {
                contracted
            } else {
                return self.shrink(simplex, 1.0 - 1.0 / size);
            }
        };
        simplex[n] = next;
    }

    fn shrink(&mut self, simplex: &mut [Vertex<M>], factor: f64) {
        let (best, others) = simplex.split_at_mut(1);
        for other in others {
            if self.left == 0 {
                return;
            }
            let x = best[0].0.iter().zip(&other.0).map(|(b, o)| b + factor * (o - b)).collect();
            *other = self.vertex(x);
        }
    }
}

/// Best first; equal ones keep their order, so that every run takes the same path.
fn sort<M: PartialOrd>(simplex: &mut [Vertex<M>]) {
    simplex.sort_by(|a, b| b.1.partial_cmp(&a.1).unwrap_or(std::cmp::Ordering::Equal));
}

fn centre<M>(vertices: &[Vertex<M>]) -> Vec<f64> {
    let n = vertices[0].0.len();
    (0..n).map(|k| vertices.iter().map(|(x, _)| x[k]).sum::<f64>() / vertices.len() as f64).collect()
}

/// Largest distance of a vertex from the best, along an axis.
fn width<M>(simplex: &[Vertex<M>]) -> f64 {
    let best = &simplex[0].0;
    let reach = |(x, _): &Vertex<M>| x.iter().zip(best).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    simplex.iter().map(reach).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley, the classical trial.
    #[test]
    fn a_curved_valley_is_followed_to_its_end() {
        let valley = |x: &[f64]| -(100.0 * (x[1] - x[0] * x[0]).powi(2) + (1.0 - x[0]).powi(2));
        let (x, merit) = climb(&[-1.2, 1.0], 400, 1e-9, valley);
        assert!(merit > -1e-12 && (x[0] - 1.0).abs() < 1e-5 && (x[1] - 1.0).abs() < 1e-5, "{x:?} {merit}");
    }

    #[test]
    fn the_budget_is_kept_and_the_start_is_never_lost() {
        for budget in [1, 2, 5, 30] {
            let mut calls = 0;
            let (x, merit) = climb(&[0.0; 6], budget, 0.0, |x| {
                calls += 1;
                -x.iter().map(|v| v * v).sum::<f64>()
            });
            assert!(calls <= budget + 1, "{calls} of {budget}");
            assert_eq!((x, merit), (vec![0.0; 6], 0.0));
        }
    }

    #[test]
    fn kinds_of_merit_come_before_their_values() {
        // Nothing counts to the left of 2 but to get there.
        let merit = |x: &[f64]| if x[0] < 2.0 { (0, x[0]) } else { (1, -(x[0] - 3.0).powi(2)) };
        let (x, merit) = climb(&[-4.0], 100, 1e-9, merit);
        assert!(merit.0 == 1 && (x[0] - 3.0).abs() < 1e-6, "{x:?} {merit:?}");
    }
}
