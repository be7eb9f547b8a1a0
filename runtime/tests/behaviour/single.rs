//! Does the reference layer keep its limits in single precision, however long it slides along them?

use dpc_runtime::single::ReferenceLayer;
use dpc_runtime::single::tables::Nearest;

use crate::random::Random;

/// 2^-24.
const UNIT: f64 = f32::EPSILON as f64 / 2.0;

fn dot(a: &[f32; 2], b: &[f32; 2]) -> f64 {
    a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum()
}

/// What rounding may do to a row in one evaluation.
fn rounding(row: &[f32; 2], limit: f32, y: &[f32; 2]) -> f64 {
    let terms: f64 = row.iter().zip(y).map(|(a, b)| f64::from((a * b).abs())).sum();
    UNIT * (4.0 * terms + 2.0 * f64::from(limit.abs()))
}

/// Y is a box cut by two oblique rows, which slide it along; two coupling rows are as oblique.
fn layer<const NB: usize>(random: &mut Random, rate: [[f32; 2]; NB], epsilon: f32) -> Nearest<2, 6, NB, 2> {
    let (sin, cos) = (random.between(-1.0, 1.0) as f32 * 3.0).sin_cos();
    let mut oblique = || [random.between(-1.0, 1.0) as f32, random.between(-1.0, 1.0) as f32];
    let (first, second) = (oblique(), oblique());
    let coupling = [oblique(), oblique()];
    Nearest {
        basis: [[cos, -sin], [sin, cos]],
        weights: [0.3, 2.0],
        gamma: 1e-3,
        set: [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0], first, second],
        set_limit: [5.0, 5.0, 5.0, 5.0, 2.0, 1.5],
        rate,
        epsilon,
        euclidean: NB == 0,
        coupling,
    }
}

fn slides<const NB: usize>(rate: [[f32; 2]; NB]) {
    let mut random = Random::new(7);
    let mut kept = 0;
    for epsilon in [1e-4, 3e-3, 0.3, 1.0, 3.0] {
        for _ in 0..20 {
            let layer = layer(&mut random, rate, epsilon);
            let limits = [1.2, 0.9];
            let mut y = [0.0_f32; 2];
            for step in 0..4000 {
                let far = [100.0 * random.between(-1.0, 1.0) as f32, 100.0 * random.between(-1.0, 1.0) as f32];
                let set_point = if step % 200 < 100 { [90.0, 60.0] } else { far };
                let Some(next) = layer.next(&y, &set_point, &limits, &[]) else {
                    kept += 1;
                    continue;
                };
                let rows = layer.set.iter().zip(&layer.set_limit).chain(layer.coupling.iter().zip(&limits));
                for (row, limit) in rows {
                    let excess = dot(row, &next) - f64::from(*limit);
                    assert!(excess <= rounding(row, *limit, &next), "{epsilon}: {row:?} by {excess:e} at {next:?}");
                }
                let way = [0, 1].map(|k| f64::from(next[k]) - f64::from(y[k]));
                let length = if NB == 0 { way[0].hypot(way[1]) } else { way[0].abs().max(way[1].abs()) };
                let size = f64::from(y[0].abs() + y[1].abs());
                assert!(
                    length <= f64::from(epsilon) * (1.0 + 2.0 * UNIT) + 2.0 * UNIT * size,
                    "{length:e} > {epsilon}"
                );
                y = next;
            }
        }
    }
    assert!(kept < 5 * 20 * 4000 / 10, "{kept} steps were none");
}

#[test]
fn sliding_along_oblique_rows_does_not_add_up() {
    slides([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]]);
    slides([]);
}

/// The nearest point of a corner of Y, which is reached along a face.
#[test]
fn references_still_arrive() {
    let set = [[1.0, 1.0], [1.0, -0.3], [-1.0, 0.0], [0.0, -1.0]];
    for epsilon in [1e-3_f32, 0.05, 1.0] {
        let layer = Nearest {
            basis: [[1.0, 0.0], [0.0, 1.0]],
            weights: [1.0, 1.0],
            gamma: 1e-6,
            set,
            set_limit: [3.0, 1.0, 9.0, 9.0],
            rate: [],
            epsilon,
            euclidean: true,
            coupling: [],
        };
        let mut y = [-2.0_f32, 1.0];
        for _ in 0..20_000 {
            y = layer.next(&y, &[9.0, 4.0], &[], &[]).unwrap_or(y);
        }
        // x + y = 3 and x - 0.3 y = 1.
        let corner = [1.9 / 1.3, 2.0 / 1.3];
        let off = [0, 1].map(|k| (f64::from(y[k]) - corner[k]).abs());
        assert!(off.iter().all(|off| *off < 1e-4), "{epsilon}: {y:?}, not {corner:?}");
    }
}
