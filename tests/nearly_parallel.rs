//! Rows so nearly parallel that rounding decides: what is called optimal must hold all the same, whichever way products are computed.

use dpc_runtime::solver::{Outcome, Rows, Solver, WorkingSet};
use dpc_tests::adversarial::{LookedUp, Problem};
use dpc_tests::{Random, cases_wanted, read};

/// TOLERANCE, and at most this by relaxations and long runs (documented at `TOLERANCE`).
const RELAXED: f64 = 2e-10;

fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    v.map(|x| x / length)
}

/// Five rows, most of them within an angle of the one before, whose limits hold at a point or miss it by little.
fn problem(random: &mut Random) -> Problem<3> {
    let mut rows: Vec<([f64; 3], f64, f64)> = Vec::new();
    while rows.len() < 5 {
        let fresh = std::array::from_fn(|_| random.between(-1.0, 1.0));
        let normal = match rows.last() {
            Some((last, ..)) if random.chance(0.5) => {
                let angle = random.magnitude(2e-7, 1e-5);
                std::array::from_fn(|k| last[k] + angle * fresh[k])
            }
            _ => fresh,
        };
        let limit = random.magnitude(1e-3, 0.3) * random.sign();
        let (lower, upper) = if random.chance(0.5) { (f64::NEG_INFINITY, limit) } else { (limit, f64::INFINITY) };
        rows.push((unit(normal), lower, upper));
    }
    Problem { rows }
}

#[test]
fn what_is_called_optimal_holds() {
    let (mut random, count) = (Random(3), cases_wanted(200_000));
    let (mut optimal, mut worst): (usize, f64) = (0, 0.0);
    for _ in 0..count {
        let problem = problem(&mut random);
        for violation in [violation(&problem), violation(&LookedUp::new(&problem))].into_iter().flatten() {
            assert!(violation <= RELAXED, "{violation:e}: {problem:?}");
            (optimal, worst) = (optimal + 1, worst.max(violation));
        }
    }
    println!("{optimal} of {} solved, the worst violation is {worst:.1e} of (scale + |w|)", 2 * count);
    assert!(optimal > count / 10);
}

/// A hundred rows that nearly meet in one point of eight dimensions: multipliers grow beyond all numbers where the factor is off.
#[test]
fn what_is_not_a_number_is_not_optimal() {
    let text = read("cases/rows/pencil.txt".as_ref()).text;
    let row = |line: &str| {
        let numbers: Vec<f64> = line.split(' ').map(|number| number.parse().expect("a number")).collect();
        (std::array::from_fn(|k| numbers[k]), f64::NEG_INFINITY, numbers[8])
    };
    let problem = Problem::<8> { rows: text.lines().map(row).collect() };
    for violation in [violation(&problem), violation(&LookedUp::new(&problem))].into_iter().flatten() {
        assert!(violation <= RELAXED, "{violation:e}");
    }
}

/// By how much of (its scale + the largest |w_k|) a row is violated at what is called optimal.
fn violation<const NV: usize>(rows: &impl Rows<NV>) -> Option<f64> {
    let mut solver = Solver::<NV>::NEW;
    let Outcome::Optimal { .. } = solver.solve(rows, &WorkingSet::EMPTY, 500) else { return None };
    let size = solver.w().iter().fold(0.0, |size: f64, w| size.max(w.abs()));
    assert!(solver.w().iter().all(|w| w.is_finite()));
    assert!(solver.multipliers().all(|(.., multiplier)| multiplier >= 0.0));
    let of = |row: dpc_runtime::solver::Row<'_>| {
        let value: f64 = row.normal.iter().zip(solver.w()).map(|(a, w)| a * w).sum();
        (row.lower - value).max(value - row.upper) / (row.scale + size)
    };
    Some(rows.iter().map(of).fold(0.0, f64::max))
}
