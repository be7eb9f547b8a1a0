//! Does the solver find the same minimiser where it looks for violated rows by the simulation, as where it looks by the rows of V?

use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::Source;
use dpc_codegen::problems::{self, RowKind};
use dpc_runtime::solver::{Outcome, Rows, Solver, WorkingSet};
use dpc_runtime::tables::{Bounds, DpcProblem, NO_ROW, Stage, StageRow};
use dpc_tests::{Random, read};
use nalgebra::DMatrix;

/// Of the four-tank with a longer horizon, whose problems have rows of every kind.
const N: usize = 8;
const NV: usize = 2 + N;
/// Room for rows; what is left restricts nothing.
const NT: usize = 8;
const NS: usize = 40;
const NQ: usize = 20;
const NR: usize = 120;

type Problem = DpcProblem<2, 1, N, NV, NR, NT, NS, NQ>;

const SAMPLES: usize = 4000;

#[test]
fn the_simulation_sees_what_the_rows_say() {
    let file = read("../examples/four_tank/system.toml".as_ref());
    let text = file.text.replace("horizon = 3", &format!("horizon = {N}"));
    let design = Design::new(Source { text, ..file }).expect("a design exists");
    for (s, problems) in design.network.subsystems.iter().zip(&design.problems.subsystems) {
        let dpc = &problems.dpc;
        assert!(dpc.boxed, "{}: rows are bounds", s.name);
        let (staged, by_rows) = (tables(dpc, true), tables(dpc, false));
        let reach: Vec<f64> = (0..2).map(|k| s.X.h[s.X.H.column(k).imax()].abs().min(12.0)).collect();
        compare(&staged, &by_rows, &reach);
    }
}

/// Deviations up to where there is no solution, references up to and beyond the limits.
fn compare(staged: &Problem, by_rows: &Problem, reach: &[f64]) {
    let mut random = Random(5);
    let (mut solved, mut refuted, mut constrained) = (0, 0, 0);
    let mut last = WorkingSet::EMPTY;
    for _ in 0..SAMPLES {
        let far = 10f64.powf(random.between(-4.0, -0.5));
        let e = [0, 1].map(|k| far * reach[k] * random.between(-1.0, 1.0));
        let near = random.between(0.0, 1.0).powi(2) * 1.01;
        let x_ref = [(); N].map(|()| [0, 1].map(|k| near * reach[k] * random.between(-1.0, 1.0)));
        // Half of them where inputs leave hardly any room.
        let pressed = random.chance(0.5);
        let u_ref = [(); N].map(|()| {
            let side = if random.chance(0.5) { -1.0 } else { 1.0 };
            [side * if pressed { random.between(2.7, 3.0) } else { near * random.between(0.0, 3.0) }]
        });
        let (one, other) = (staged.at(&e, &x_ref, &u_ref), by_rows.at(&e, &x_ref, &u_ref));
        assert_eq!(one.rests(), other.rests());
        let (mut a, mut b, mut warm) = (Solver::NEW, Solver::NEW, Solver::NEW);
        let outcomes = (a.solve(&one, &WorkingSet::EMPTY, 2000), b.solve(&other, &WorkingSet::EMPTY, 2000));
        match outcomes {
            (Outcome::Optimal { .. }, Outcome::Optimal { .. }) => {
                assert!(matches!(warm.solve(&one, &last, 2000), Outcome::Optimal { .. }));
                for solver in [&a, &b, &warm] {
                    assert!(off(&other, solver.w()) <= 1e-9, "{}", off(&other, solver.w()));
                    assert!(apart(solver.w(), b.w()) <= 1e-8, "{}", apart(solver.w(), b.w()));
                }
                last = a.working_set();
                solved += 1;
                constrained += usize::from(last.len() > 2);
            }
            (Outcome::Infeasible { .. }, Outcome::Infeasible { .. }) => refuted += 1,
            differ => panic!("{differ:?} at e = {e:?}"),
        }
    }
    assert!(solved > SAMPLES / 4 && refuted > SAMPLES / 100, "{solved} solved, {refuted} refuted");
    println!("{solved} solved, {constrained} constrained, {refuted} refuted");
    assert!(constrained > SAMPLES / 20, "{constrained}");
}

/// How far the worst row is from holding, relative to its limit and w.
fn off(rows: &impl Rows<NV>, w: &[f64; NV]) -> f64 {
    let size = w.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
    let off = rows.iter().map(|row| {
        let at: f64 = row.normal.iter().zip(w).map(|(v, w)| v * w).sum();
        (at - row.upper).max(row.lower - at) / (row.scale + size)
    });
    off.fold(0.0, f64::max)
}

fn apart(a: &[f64; NV], b: &[f64; NV]) -> f64 {
    let size = b.iter().fold(1e-9, |size: f64, x| size.max(x.abs()));
    a.iter().zip(b).fold(0.0, |apart: f64, (a, b)| apart.max((a - b).abs())) / size
}

/// What an emitted file would hold; (36) at the end, what restricts nothing before it.
fn tables(dpc: &problems::DpcProblem, staged: bool) -> Problem {
    let places = places(dpc);
    let of_kind =
        |is: fn(RowKind) -> Option<usize>| dpc.rows.iter().filter_map(move |row| is(row.kind).map(|k| (k, row)));
    let state: Vec<_> = of_kind(|kind| if let RowKind::State(k) = kind { Some(k) } else { None }).collect();
    let input: Vec<_> = of_kind(|kind| if let RowKind::Input(k) = kind { Some(k) } else { None }).collect();
    let terminal: Vec<[f64; 2]> =
        dpc.rows.iter().filter(|row| row.kind == RowKind::Terminal).map(|row| [row.end[0], row.end[1]]).collect();
    let mut problem = Problem {
        V: [[0.0; NV]; NR],
        gram: &[],
        extent: [0; NR],
        slack: &[],
        lower: [f64::NEG_INFINITY; NR],
        upper: [f64::INFINITY; NR],
        tube: [[0.0; 2]; NT],
        state: std::array::from_fn(|k| match state.get(k) {
            Some((stage, row)) => StageRow { stage: *stage, row: [row.offset[0], row.offset[1]] },
            None => StageRow { stage: 0, row: [0.0; 2] },
        }),
        input: std::array::from_fn(|k| match input.get(k) {
            Some((stage, row)) => StageRow { stage: *stage, row: [row.offset[0]] },
            None => StageRow { stage: 0, row: [0.0] },
        }),
        terminal: if staged { terminal.leak() } else { &[] },
        shift: [NO_ROW; NR],
        root: array(&dpc.root),
        stages: std::array::from_fn(|k| Stage {
            next: array(&dpc.stages[k].next),
            drive: array(&dpc.stages[k].drive),
            gain: array(&dpc.stages[k].gain),
            spread: array(&dpc.stages[k].spread),
        }),
        x: bounds(|k, c| dpc.stages[k].x[c], &places),
        u: bounds(|k, c| dpc.stages[k].u[c], &places),
        boxed: dpc.boxed,
        staged,
        max_iterations: 2000,
    };
    for (r, (row, &at)) in dpc.rows.iter().zip(&places).enumerate() {
        problem.V[at] = std::array::from_fn(|c| dpc.V[(r, c)]);
        problem.extent[at] = row.extent as u16;
        (problem.lower[at], problem.upper[at]) = (dpc.lower[r], dpc.upper[r]);
        if row.kind == RowKind::Tube {
            problem.tube[at] = [row.offset[0], row.offset[1]];
        }
    }
    problem
}

/// Where each row of the design stands.
fn places(dpc: &problems::DpcProblem) -> Vec<usize> {
    let terminal = dpc.rows.iter().filter(|row| row.kind == RowKind::Terminal).count();
    let mut next = [0, NT, NT + NS, NT + NS + NQ, NR - terminal];
    let ends = [NT, NT + NS, NT + NS + NQ, NR - terminal, NR];
    let place = |row: &problems::Row| {
        let group = match row.kind {
            RowKind::Tube => 0,
            RowKind::State(_) => 1,
            RowKind::Input(_) => 2,
            RowKind::CouplingOutput(_) => 3,
            RowKind::Terminal => 4,
        };
        let at = next[group];
        assert!(at < ends[group], "room for rows");
        next[group] += 1;
        at
    };
    dpc.rows.iter().map(place).collect()
}

fn bounds<const COUNT: usize>(of: impl Fn(usize, usize) -> problems::Bound, places: &[usize]) -> Bounds<COUNT, N> {
    let all = |value: &dyn Fn(problems::Bound) -> f64| -> [[f64; COUNT]; N] {
        std::array::from_fn(|k| std::array::from_fn(|c| value(of(k, c))))
    };
    Bounds {
        low: all(&|bound| bound.low),
        high: all(&|bound| bound.high),
        unit: all(&|bound| bound.unit),
        row: std::array::from_fn(|k| {
            std::array::from_fn(|c| places.get(of(k, c).row).map_or(NO_ROW, |&row| row as u16))
        }),
    }
}

fn array<const R: usize, const C: usize>(matrix: &DMatrix<f64>) -> [[f64; C]; R] {
    std::array::from_fn(|r| std::array::from_fn(|c| matrix[(r, c)]))
}
