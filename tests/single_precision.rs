//! Do controllers in single precision keep every constraint, and what does that cost?
#![expect(non_snake_case, reason = "the paper's symbols")]

use dpc_codegen::design::Design;
use dpc_codegen::network::Scalar;
use dpc_codegen::problems::RowKind;
use dpc_generated::four_tank_single::{left, right};
use dpc_runtime::single::problem::Plan;
use dpc_runtime::single::solver::Rows;
use dpc_tests::Random;
use dpc_tests::tank_loop::{Tally, double, single};
use dpc_tests::{cases_wanted, read};
use nalgebra::DVector;

#[test]
fn no_constraint_is_violated_in_a_hundred_seeds() {
    for (name, run) in [("f64", double as fn(u64, usize) -> Tally), ("f32", single)] {
        let mut all = Tally::new();
        for seed in 0..cases_wanted(100) as u64 {
            all.add(&run(seed, 500));
        }
        println!("{name}: {all}");
        assert_eq!((all.violations, all.lost), (0, 0), "{name}: {all}");
        assert!(all.solved > all.steps / 20 && all.upsets > 1000, "{name}: {all}");
    }
}

#[test]
fn rounding_takes_little_of_the_set_points() {
    let design = |scalar: Scalar| {
        let source = read("../examples/four_tank/system.toml".as_ref());
        Design::in_scalar(source, scalar, None, &mut ()).expect("a design exists")
    };
    let area = |design: &Design| design.sizing.subsystems.iter().map(|sized| sized.Y.volume()).product::<f64>();
    let (double, single) = (design(Scalar::Double), design(Scalar::Single));
    assert_eq!(double.sizing.share_of_double, None);
    let stated = single.sizing.share_of_double.expect("a small network");
    let (double, single) = (area(&double), area(&single));
    assert!((stated - single / double).abs() < 1e-9);
    println!(
        "area of Y_1 x Y_2: {double:.3} in f64, {single:.3} in f32, {:.1} % less",
        100.0 * (1.0 - single / double)
    );
    assert!(single < double && single > 0.8 * double);
}

/// A row as the runtime evaluates it from a plan, beside its value in double precision.
#[test]
fn rows_are_evaluated_as_exactly_as_the_design_says() {
    let design = single_design();
    let (dpc, problem) = (&design.problems.subsystems[0].dpc, &left::TABLES.problem);
    let inverse = dpc.T.clone().try_inverse().expect("T is a simulation");
    let mut random = Random(1);
    let mut entry = |size: f64| random.between(-size, size) as f32;
    let mut worst: f64 = 0.0;
    for _ in 0..5_000 {
        // Half the widths of the boxes around X and U, so that the plan stays within them.
        let share = entry(1.0).abs();
        let e = [20.0, 20.0].map(|size| share * entry(size));
        let plan = Plan {
            dx: [20.0, 20.0].map(|size| share * entry(size)),
            du: [[share * entry(3.0)], [share * entry(3.0)], [share * entry(3.0)]],
        };
        let x_ref: [[f32; 2]; 3] = std::array::from_fn(|_| [entry(12.0), entry(1.4)]);
        let u_ref: [[f32; 1]; 3] = std::array::from_fn(|_| [entry(3.0)]);
        let v: Vec<f64> = plan.dx.iter().chain(plan.du.as_flattened()).map(|v| f64::from(*v)).collect();
        let exact = &dpc.V * (&inverse * DVector::from_vec(v));
        let (instance, w) = (problem.at(&e, &x_ref, &u_ref), problem.unknowns(&plan));
        for (r, (row, seen)) in dpc.rows.iter().zip(instance.iter()).enumerate() {
            let value: f32 = seen.normal.iter().zip(&w).map(|(v, w)| v * w).sum();
            let parameter: &[f32] = match row.kind {
                RowKind::Tube => &e,
                RowKind::State(k) => &x_ref[k],
                RowKind::Input(k) => &u_ref[k],
                _ => &[],
            };
            let offset: f64 = row.offset.iter().zip(parameter).map(|(a, p)| a * f64::from(*p)).sum();
            let (limit, off) = match seen.lower.is_finite() {
                true => (f64::from(problem.lower[r]), f64::from(seen.lower - value)),
                false => (f64::from(problem.upper[r]), f64::from(seen.upper - value)),
            };
            let wrong = (off - (limit - offset - exact[r])).abs();
            worst = worst.max(wrong / (row.reserve.exact - row.reserve.slack));
        }
    }
    println!("rows are wrong by up to {worst:.3} of what the design allows");
    assert!(worst <= 1.0 && worst > 0.01);
}

/// The references that are stored and sent, beside what (7) makes of the ones before.
#[test]
fn references_obey_their_model_as_exactly_as_the_design_says() {
    let design = single_design();
    let mut random = Random(2);
    let started = "rest at 0 is admissible";
    let (mut a, mut from_a) = left::start(&left::steady_state(&[0.0; 2])).expect(started);
    let (mut b, mut from_b) = right::start(&right::steady_state(&[0.0; 2])).expect(started);
    let (mut to_a, mut to_b) = (left::Inbox::new(), right::Inbox::new());
    let mut set_points = [[0.0]; 2];
    let mut worst: f64 = 0.0;
    // xref and uref of both, and what they sent about that step.
    let mut history: Vec<[([f64; 2], f64); 2]> = Vec::new();
    let mut sent: Vec<[f64; 2]> = Vec::new();
    for _ in 0..20_000 {
        if random.chance(0.005) {
            set_points = [[random.between(-1.0, 3.5) as f32], [random.between(-1.0, 3.5) as f32]];
        }
        to_a.accept(&left::FROM_RIGHT, &from_b).expect("the message of the step before");
        to_b.accept(&right::FROM_LEFT, &from_a).expect("the message of the step before");
        let (x_a, x_b) = (a.clone().input(&[0.0; 2]).telemetry, b.clone().input(&[0.0; 2]).telemetry);
        let one = a.step(&x_a.x_ref, &set_points[0], &mut to_a);
        let two = b.step(&x_b.x_ref, &set_points[1], &mut to_b);
        let point = |t: &dpc_runtime::single::Telemetry<2, 1, 1>| (t.x_ref.map(f64::from), f64::from(t.u_ref[0]));
        history.push([point(&one.telemetry), point(&two.telemetry)]);
        (from_a, from_b) = (one.message, two.message);
        sent.push([f64::from(from_a.z_ref[0]), f64::from(from_b.z_ref[0])]);
    }
    // The message of step t is about t + N.
    let N = design.network.horizon;
    for (t, pair) in history.windows(2).enumerate().skip(N) {
        for i in 0..2 {
            let (s, rounding) = (&design.network.subsystems[i], &design.sets.subsystems[i].rounding);
            let ((x, u), z) = (pair[0][i], sent[t - N][1 - i]);
            for k in 0..2 {
                let imported = (&s.E * &s.L[&(1 - i)])[(k, 0)] * z;
                let next = s.A[(k, 0)] * x[0] + s.A[(k, 1)] * x[1] + s.B[(k, 0)] * u + imported;
                worst = worst.max((pair[1][i].0[k] - next).abs() / (0.5 * rounding.drift[k]));
            }
            let z = s.Cz[(0, 0)] * x[0] + s.Cz[(0, 1)] * x[1] + s.Dz[(0, 0)] * u;
            worst = worst.max((sent[t - N][i] - z).abs() / rounding.z[0]);
        }
    }
    println!("references are wrong by up to {worst:.3} of what the design allows");
    assert!(worst <= 1.0 && worst > 0.01);
}

fn single_design() -> Design {
    let source = read("../examples/four_tank/system.toml".as_ref());
    Design::in_scalar(source, Scalar::Single, None, &mut ()).expect("a design exists")
}
