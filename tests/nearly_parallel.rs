//! Rows so nearly parallel that rounding decides: what is called optimal must hold all the same, whichever way products are computed.

use dpc_runtime::solver::{Outcome, Row, Rows, Side, Solver, TOLERANCE, WorkingSet, Worst};
use dpc_tests::{Random, cases_wanted};

const NV: usize = 5;

/// TOLERANCE, and at most this by relaxations and long runs (documented at `TOLERANCE`).
const RELAXED: f64 = 2e-10;

struct Problem {
    rows: Vec<([f64; NV], f64, f64)>,
    /// Products of all rows, where they are looked up.
    gram: Vec<Vec<f64>>,
}

impl Rows<NV> for Problem {
    fn iter(&self) -> impl Iterator<Item = Row<'_>> {
        self.rows.iter().map(|(normal, lower, upper)| Row { normal, lower: *lower, upper: *upper, scale: 1.0 })
    }

    fn products(&self, index: usize) -> Option<&[f64]> {
        self.gram.get(index).map(Vec::as_slice)
    }

    fn worst(&self, _w: &[f64; NV], size: f64, sum: impl Iterator<Item = (usize, f64)>) -> Worst {
        if self.gram.is_empty() {
            return Worst::Unknown;
        }
        let mut values = vec![0.0; self.rows.len()];
        for (row, coefficient) in sum {
            values.iter_mut().zip(&self.gram[row]).for_each(|(value, product)| *value += coefficient * product);
        }
        let (mut worst, mut distance) = (Worst::Kept, 0.5 * TOLERANCE * size);
        for (row, (value, (_, lower, upper))) in values.iter().zip(&self.rows).enumerate() {
            for (side, violation) in [(Side::Lower, lower - value), (Side::Upper, value - upper)] {
                if violation > distance {
                    (worst, distance) = (Worst::Row(row, side), violation);
                }
            }
        }
        worst
    }
}

fn unit(v: [f64; NV]) -> [f64; NV] {
    let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    v.map(|x| x / length)
}

fn dot(a: &[f64; NV], b: &[f64; NV]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Clusters of rows, each within an angle of the one before; limits of either sign, far and near.
fn problem(random: &mut Random) -> Problem {
    let mut rows: Vec<([f64; NV], f64, f64)> = Vec::new();
    let limits = if random.chance(0.3) { 1e-7 } else { 1.0 };
    while rows.len() < 12 {
        let fresh = std::array::from_fn(|_| random.between(-1.0, 1.0));
        let normal = match rows.last() {
            Some((last, ..)) if random.chance(0.6) => {
                let angle = random.magnitude(2e-7, 1e-3);
                std::array::from_fn(|k| last[k] + angle * fresh[k])
            }
            _ => fresh,
        };
        let limit = limits * random.between(-0.3, 1.0);
        let (lower, upper) = if random.chance(0.5) { (f64::NEG_INFINITY, limit) } else { (-limit, f64::INFINITY) };
        rows.push((unit(normal), lower, upper));
    }
    Problem { rows, gram: Vec::new() }
}

#[test]
fn what_is_called_optimal_holds() {
    let mut random = Random(3);
    let mut solver = Solver::<NV>::NEW;
    let (mut optimal, mut worst): (usize, f64) = (0, 0.0);
    let count = cases_wanted(40_000);
    for _ in 0..count {
        let plain = problem(&mut random);
        let gram = plain.rows.iter().map(|(a, ..)| plain.rows.iter().map(|(b, ..)| dot(a, b)).collect()).collect();
        let looked_up = Problem { rows: plain.rows.clone(), gram };
        for problem in [&plain, &looked_up] {
            let Outcome::Optimal { .. } = solver.solve(problem, &WorkingSet::EMPTY, 500) else { continue };
            let w = solver.w();
            let size = w.iter().fold(0.0, |size: f64, w| size.max(w.abs()));
            assert!(size.is_finite() && solver.multipliers().all(|(.., multiplier)| multiplier >= 0.0));
            for (normal, lower, upper) in &problem.rows {
                let value = dot(normal, w);
                let violation = (lower - value).max(value - upper) / (1.0 + size);
                worst = worst.max(violation);
                assert!(violation <= RELAXED, "{violation:e}: {:?}", problem.rows);
            }
            optimal += 1;
        }
    }
    println!("{optimal} of {} solved, the worst violation is {worst:.1e} of (scale + |w|)", 2 * count);
    assert!(optimal > count / 2);
}
