//! Is the nonlinear plant the one whose linearisation the paper prints, and is it integrated well enough?

use four_tank::plant::{A, B, Levels, NonlinearTanks, Plant, QuadrupleTank, SAMPLE_TIME};
use nalgebra::{SMatrix, SVector};

/// Johansson's printed working levels, in the paper's order of tanks, cm.
const PRINTED_LEVELS: Levels = [12.4, 1.4, 12.7, 1.8];

/// Time constants and pump paths of Johansson's equation (2), written out here once more and not taken from the code
/// under test: T = (area / hole) sqrt(2 h / g).
fn linearised() -> (SMatrix<f64, 4, 4>, SMatrix<f64, 4, 2>) {
    let tank = QuadrupleTank::MINIMUM_PHASE;
    let constant = |i: usize| tank.area[i] / tank.hole[i] * (2.0 * PRINTED_LEVELS[i] / tank.gravity).sqrt();
    let mut a = SMatrix::zeros();
    (0..4).for_each(|i| a[(i, i)] = -1.0 / constant(i));
    a[(0, 3)] = tank.area[3] / (tank.area[0] * constant(3));
    a[(2, 1)] = tank.area[1] / (tank.area[2] * constant(1));
    let mut b = SMatrix::zeros();
    b[(0, 0)] = tank.split[0] * tank.pump[0] / tank.area[0];
    b[(1, 0)] = (1.0 - tank.split[0]) * tank.pump[0] / tank.area[1];
    b[(2, 1)] = tank.split[1] * tank.pump[1] / tank.area[2];
    b[(3, 1)] = (1.0 - tank.split[1]) * tank.pump[1] / tank.area[3];
    (a, b)
}

/// Exact zero-order hold: the exponential of [a b; 0 0] times the sampling period is [A B; 0 I].
fn zero_order_hold(a: &SMatrix<f64, 4, 4>, b: &SMatrix<f64, 4, 2>) -> (SMatrix<f64, 4, 4>, SMatrix<f64, 4, 2>) {
    let mut generator = SMatrix::<f64, 6, 6>::zeros();
    generator.fixed_view_mut::<4, 4>(0, 0).copy_from(&(a * SAMPLE_TIME));
    generator.fixed_view_mut::<4, 2>(0, 4).copy_from(&(b * SAMPLE_TIME));
    let exponential = generator.exp();
    (exponential.fixed_view::<4, 4>(0, 0).into_owned(), exponential.fixed_view::<4, 2>(0, 4).into_owned())
}

/// Half a unit of the last digit the paper prints: four decimals, but three significant digits where that is finer.
fn half_a_unit(printed: f64) -> f64 {
    match printed {
        0.0 => 1e-12,
        small if small < 1e-3 => 0.5e-6,
        _ => 0.5e-4,
    }
}

#[test]
fn printed_matrices_are_the_zero_order_hold_of_the_minimum_phase_plant() {
    let (a, b) = linearised();
    let (a, b) = zero_order_hold(&a, &b);
    for i in 0..4 {
        for j in 0..4 {
            let off = (a[(i, j)] - A[i][j]).abs();
            assert!(off <= half_a_unit(A[i][j]), "A[{i}][{j}]: {} is printed as {}", a[(i, j)], A[i][j]);
        }
        for j in 0..2 {
            let off = (b[(i, j)] - B[i][j]).abs();
            assert!(off <= half_a_unit(B[i][j]), "B[{i}][{j}]: {} is printed as {}", b[(i, j)], B[i][j]);
        }
    }
}

#[test]
fn pump_gains_in_johanssons_order_do_not_give_the_printed_matrices() {
    let (a, mut b) = linearised();
    b.column_mut(0).scale_mut(3.33 / 3.35);
    b.column_mut(1).scale_mut(3.35 / 3.33);
    let (_, b) = zero_order_hold(&a, &b);
    let misfit = |i: usize, j: usize| (b[(i, j)] - B[i][j]).abs() / half_a_unit(B[i][j]);
    assert!(misfit(0, 0) > 1.0 && misfit(0, 1) > 1.0, "{b}");
}

#[test]
fn rates_have_the_linearisation_they_should_have() {
    let tank = QuadrupleTank::MINIMUM_PHASE;
    let (a, b) = linearised();
    let v = NonlinearTanks::WORKING_VOLTAGES;
    let step = 1e-5;
    for j in 0..4 {
        let moved =
            |by: f64| tank.rate(&std::array::from_fn(|i| PRINTED_LEVELS[i] + if i == j { by } else { 0.0 }), &v);
        let slope = (SVector::from(moved(step)) - SVector::from(moved(-step))) / (2.0 * step);
        assert!((slope - a.column(j)).amax() < 1e-9, "column {j} of A: {slope}");
    }
    for j in 0..2 {
        let moved =
            |by: f64| tank.rate(&PRINTED_LEVELS, &std::array::from_fn(|i| v[i] + if i == j { by } else { 0.0 }));
        let slope = (SVector::from(moved(step)) - SVector::from(moved(-step))) / (2.0 * step);
        assert!((slope - b.column(j)).amax() < 1e-9, "column {j} of B: {slope}");
    }
}

#[test]
fn zero_deviation_is_rest_and_near_the_printed_levels() {
    let tanks = NonlinearTanks::new(10);
    let rest = tanks.advance(&[0.0; 4], &[0.0; 2]);
    assert!(rest.iter().all(|x| x.abs() < 1e-13), "{rest:?}");
    for (centre, printed) in tanks.centre().iter().zip(PRINTED_LEVELS) {
        assert!((centre - printed).abs() < 0.2, "{centre} cm, printed {printed} cm");
    }
}

#[test]
fn printed_levels_are_not_rest() {
    let rate = QuadrupleTank::MINIMUM_PHASE.rate(&PRINTED_LEVELS, &NonlinearTanks::WORKING_VOLTAGES);
    assert!(rate.iter().any(|r| r.abs() > 1e-3), "{rate:?}");
}

/// Deviations, cm, and voltages, V, from nearly empty to nearly full.
const CORNERS: [(Levels, [f64; 2]); 5] = [
    ([0.0; 4], [3.0, -3.0]),
    ([-10.0, -1.3, -10.0, -1.5], [-3.0, 3.0]),
    ([-12.0, -1.3, -12.0, -1.5], [3.0, 3.0]),
    ([27.0, 38.0, 27.0, 38.0], [3.0, 3.0]),
    ([10.0, -1.0, -10.0, 30.0], [-3.0, -3.0]),
];

#[test]
fn halved_steps_change_nothing_that_matters() {
    let (coarse, fine) = (NonlinearTanks::new(10), NonlinearTanks::new(20));
    for (x, u) in &CORNERS {
        let (coarse, fine) = (coarse.advance(x, u), fine.advance(x, u));
        let worst = coarse.iter().zip(fine).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-9, "from {x:?} cm at {u:?} V: {worst} cm");
    }
}

#[test]
fn integration_is_of_fourth_order() {
    let from = ([-12.0, -1.3, -12.0, -1.5], [3.0, 3.0]);
    let error = |substeps| {
        let (rough, exact) = (NonlinearTanks::new(substeps), NonlinearTanks::new(1000));
        let (rough, exact) = (rough.advance(&from.0, &from.1), exact.advance(&from.0, &from.1));
        rough.iter().zip(exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let order = (error(2) / error(4)).log2();
    assert!(order > 3.7, "order {order}");
}

#[test]
fn levels_are_never_negative() {
    let tanks = NonlinearTanks::new(10);
    let mut x = [0.0; 4];
    for _ in 0..2000 {
        x = tanks.advance(&x, &[-3.5, -3.5]);
        let lowest = x.iter().zip(tanks.centre()).map(|(x, centre)| x + centre).fold(f64::INFINITY, f64::min);
        assert!(lowest >= -1e-15, "{lowest} cm");
    }
    assert!(x.iter().zip(tanks.centre()).all(|(x, centre)| x + centre < 1e-9), "with the pumps off all tanks empty");
}

#[test]
fn volume_is_kept() {
    let tank = QuadrupleTank::MINIMUM_PHASE;
    let (h, v) = ([20.0, 5.0, 7.0, 3.0], [4.0, 1.0]);
    let stored: f64 = tank.rate(&h, &v).iter().zip(tank.area).map(|(rate, area)| rate * area).sum();
    let pumped = tank.pump[0] * v[0] + tank.pump[1] * v[1];
    let lost: f64 = [0, 2].iter().map(|&i| tank.hole[i] * (2.0 * tank.gravity * h[i]).sqrt()).sum();
    assert!((stored - (pumped - lost)).abs() < 1e-12);
}
