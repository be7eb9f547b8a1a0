//! Do the reference-output layers find the optimum of (29)-(31), (28), and never leave its limits?

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettingsBuilder, DefaultSolver, IPSolver, NonnegativeConeT, SecondOrderConeT, SolverStatus,
};
use dpc_runtime::ReferenceLayer;
use dpc_runtime::tables::{Clamp, Nearest};

use crate::random::Random;

const EPSILON: f64 = 0.1;
const GAMMA: f64 = 1e-3;

fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[test]
fn clamp_moves_at_the_rate_and_stops_at_the_limits() {
    let layer = Clamp {
        weight: [1.0, 0.5],
        epsilon: 0.1,
        y_min: [-1.0, -1.0],
        y_max: [1.0, 0.25],
        rows: [(1, -2.0), (0, 1.0)],
    };
    let free = [f64::INFINITY; 2];
    assert_eq!(layer.next(&[0.0, 0.0], &[5.0, 0.1], &free, &[]), Some([0.1, 0.05]));
    assert_eq!(layer.next(&[0.95, 0.2], &[5.0, 5.0], &free, &[]), Some([1.0, 0.25]));
    assert_eq!(layer.next(&[0.0, 0.0], &[-5.0, -5.0], &free, &[]), Some([-0.1, -0.1]));
    // -2 y_2 <= 0.1 is y_2 >= -0.05; y_1 <= 0.03.
    assert_eq!(layer.next(&[0.0, 0.0], &[5.0, -5.0], &[0.1, 0.03], &[]), Some([0.03, -0.05]));
    // A limit that is already exceeded counts as reached: back is open, further is not.
    assert_eq!(layer.next(&[0.5, 0.0], &[5.0, 0.0], &[1.0, 0.4], &[]), Some([0.5, 0.0]));
    assert_eq!(layer.next(&[0.5, 0.0], &[-5.0, 0.0], &[1.0, 0.4], &[]), Some([0.4, 0.0]));
    assert_eq!(layer.next(&[0.0, 0.0], &[f64::NAN, 0.0], &free, &[]), Some([-0.1, 0.0]));
    assert!(layer.contains(&[1.0, 0.25]) && !layer.contains(&[1.0, 0.26]) && !layer.contains(&[-1.1, 0.0]));
}

/// T = U diag(weights) U', Y the octagon |y_k| <= 1, |y_1 +- y_2| <= 1.6, two coupling rows.
fn nearest<const NB: usize>(angle: f64, rate: [[f64; 2]; NB]) -> Nearest<2, 8, NB, 2> {
    let (sin, cos) = angle.sin_cos();
    let set = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];
    Nearest {
        basis: [[cos, -sin], [sin, cos]],
        weights: [0.3, 2.0],
        gamma: GAMMA,
        set,
        set_limit: [1.0, 1.0, 1.0, 1.0, 1.6, 1.6, 1.6, 1.6],
        rate,
        epsilon: EPSILON,
        euclidean: NB == 0,
        coupling: [[0.7, -0.2], [-0.3, -1.0]],
    }
}

/// Objective (29) as a quadratic form in y: (matrix, vector) of 1/2 y'Py + q'y.
fn objective<const NB: usize>(
    layer: &Nearest<2, 8, NB, 2>,
    previous: &[f64; 2],
    set_point: &[f64; 2],
) -> ([[f64; 2]; 2], [f64; 2]) {
    let T: [[f64; 2]; 2] = std::array::from_fn(|i| {
        std::array::from_fn(|j| (0..2).map(|k| layer.basis[i][k] * layer.weights[k] * layer.basis[j][k]).sum())
    });
    let P = std::array::from_fn(|i| std::array::from_fn(|j| 2.0 * (T[i][j] + if i == j { GAMMA } else { 0.0 })));
    let q = std::array::from_fn(|i| -2.0 * (GAMMA * previous[i] + dot(&T[i], set_point)));
    (P, q)
}

fn interior_point<const NB: usize>(
    layer: &Nearest<2, 8, NB, 2>,
    previous: &[f64; 2],
    set_point: &[f64; 2],
    coupling: &[f64; 2],
) -> [f64; 2] {
    let (P, q) = objective(layer, previous, set_point);
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let mut limits = Vec::new();
    let mut push = |row: &[f64; 2], limit: f64| {
        rows.push(row.to_vec());
        limits.push(limit);
    };
    layer.set.iter().zip(&layer.set_limit).for_each(|(row, limit)| push(row, *limit));
    layer.rate.iter().for_each(|row| push(row, EPSILON + dot(row, previous)));
    layer.coupling.iter().zip(coupling).for_each(|(row, limit)| push(row, *limit));
    let mut cones = vec![NonnegativeConeT(8 + NB + 2)];
    if layer.euclidean {
        push(&[0.0, 0.0], EPSILON);
        push(&[-1.0, 0.0], -previous[0]);
        push(&[0.0, -1.0], -previous[1]);
        cones.push(SecondOrderConeT(3));
    }
    let settings = DefaultSettingsBuilder::default()
        .verbose(false)
        .tol_gap_abs(1e-14)
        .tol_gap_rel(1e-14)
        .tol_feas(1e-14)
        .build()
        .unwrap();
    let upper = CscMatrix::from(&[[P[0][0], P[0][1]], [0.0, P[1][1]]]);
    let mut solver = DefaultSolver::new(&upper, &q, &CscMatrix::from(&rows), &limits, &cones, settings).unwrap();
    solver.solve();
    assert!(
        !matches!(solver.solution.status, SolverStatus::PrimalInfeasible | SolverStatus::DualInfeasible),
        "{:?}",
        solver.solution.status
    );
    [solver.solution.x[0], solver.solution.x[1]]
}

/// Random walks: every answer agrees with the interior-point method's, is at least as good, and violates nothing.
fn walk<const NB: usize>(seed: u64, rate: [[f64; 2]; NB], norm: impl Fn(&[f64; 2]) -> f64) {
    let mut random = Random::new(seed);
    for _ in 0..25 {
        let layer = nearest(random.between(0.0, 3.0), rate);
        let mut y = [0.0, 0.0];
        for _ in 0..25 {
            let set_point = [random.between(-2.0, 2.0), random.between(-2.0, 2.0)];
            let room = [random.between(0.0, 0.3), random.between(0.0, 0.3)];
            let coupling =
                [0, 1].map(|h| dot(&layer.coupling[h], &y) + if random.below(3) == 0 { 0.0 } else { room[h] });
            let next = layer.next(&y, &set_point, &coupling, &[]).unwrap();
            let reference = interior_point(&layer, &y, &set_point, &coupling);
            let (P, q) = objective(&layer, &y, &set_point);
            let cost = |y: &[f64; 2]| 0.5 * (y[0] * dot(&P[0], y) + y[1] * dot(&P[1], y)) + dot(&q, y);
            // The interior-point iterate is good to the root of its gap; in cost it is good to the gap.
            assert!(
                (next[0] - reference[0]).abs().max((next[1] - reference[1]).abs()) < 1e-5,
                "{next:?} {reference:?}"
            );
            assert!(cost(&next) <= cost(&reference) + 1e-10, "{:e}", cost(&next) - cost(&reference));
            let slack = 1e-15;
            assert!(norm(&[next[0] - y[0], next[1] - y[1]]) <= EPSILON + slack);
            assert!(layer.set.iter().zip(&layer.set_limit).all(|(row, limit)| dot(row, &next) <= limit + slack));
            assert!(layer.coupling.iter().zip(&coupling).all(|(row, limit)| dot(row, &next) <= limit + slack));
            y = next;
        }
    }
}

#[test]
fn nearest_agrees_with_an_interior_point_method_in_the_maximum_norm() {
    walk(1, [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]], |d| d[0].abs().max(d[1].abs()));
}

#[test]
fn nearest_agrees_with_an_interior_point_method_in_the_1_norm() {
    walk(2, [[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]], |d| d[0].abs() + d[1].abs());
}

#[test]
fn nearest_agrees_with_an_interior_point_method_in_the_euclidean_norm() {
    walk(3, [], |d| d[0].hypot(d[1]));
}

#[test]
fn nearest_stays_where_it_is_best() {
    let layer = nearest(0.7, []);
    let free = [f64::INFINITY; 2];
    let contains = |y| ReferenceLayer::<2, 2, 0>::contains(&layer, y);
    assert!(contains(&[1.0, 0.6]) && !contains(&[1.0, 0.7]));
    let mut y = [0.0, 0.0];
    for _ in 0..100 {
        y = layer.next(&y, &[3.0, 0.1], &free, &[]).unwrap();
    }
    let again = layer.next(&y, &[3.0, 0.1], &free, &[]).unwrap();
    assert!((again[0] - y[0]).abs() < 1e-12 && (again[1] - y[1]).abs() < 1e-12);
    assert!((y[0] - 1.0).abs() < 1e-12);
    assert_eq!(layer.next(&[0.25, 0.5], &[0.25, 0.5], &free, &[]), Some([0.25, 0.5]));
}

/// A set-point at the end of the number range still gives the step in its direction.
#[test]
fn nearest_bears_any_finite_set_point() {
    let far = nearest(0.0, []).next(&[0.0, 0.0], &[1e300, 0.0], &[f64::INFINITY; 2], &[]).unwrap();
    assert!((far[0] - EPSILON).abs() < 1e-9 && far[1].abs() < 1e-9, "{far:?}");
    // A previous y outside Y_i may come back, but not go further.
    let outside = nearest(0.0, []).next(&[1.2, 0.0], &[2.0, 0.0], &[f64::INFINITY; 2], &[]).unwrap();
    assert!((outside[0] - 1.2).abs() < 1e-12);
    let back = nearest(0.0, []).next(&[1.2, 0.0], &[0.0, 0.0], &[f64::INFINITY; 2], &[]).unwrap();
    assert!((back[0] - 1.1).abs() < 1e-9, "{back:?}");
}
