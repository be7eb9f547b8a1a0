//! What the runtime makes of measurement errors and loads, for designs whose sizes are known at run time only: its types with
//! sizes that hold all of them.
#![expect(non_snake_case, reason = "the paper's symbols")]

use dpc_codegen::problems::DpcProblem;
use dpc_runtime::Loads;
use dpc_runtime::solver::Rows;
use dpc_runtime::tables::{self, Bounds, LoadModel, NO_ROW, Stage};
use nalgebra::DVector;

use crate::unknowns::Unknowns;

const STATES: usize = 4;
const UNKNOWNS: usize = STATES + 1;
const STRIPS: usize = 64;
const MOST_LOADS: usize = 2;

/// Limits of the tube rows after [`tables::DpcProblem::doubt`], less their offsets.
///
/// # Panics
/// There are more states or tube rows than this module allows for.
pub fn doubted(dpc: &DpcProblem, e: &DVector<f64>, forecast: Option<&DVector<f64>>) -> Vec<(f64, f64)> {
    let strips = dpc.noise.len();
    assert!(strips <= STRIPS && e.len() <= STATES, "{strips} rows, {} states", e.len());
    let limit = |r: usize, of: &DVector<f64>, absent: f64| if r < strips { of[r] } else { absent };
    let tube = |r: usize| if r < strips { array(dpc.rows[r].offset.as_slice()) } else { [0.0; STATES] };
    let problem: tables::DpcProblem<STATES, 1, 1, UNKNOWNS, STRIPS, STRIPS, 0, 0> = tables::DpcProblem {
        V: [[1.0; UNKNOWNS]; STRIPS],
        gram: &[],
        extent: [UNKNOWNS as u16; STRIPS],
        slack: &[],
        lower: std::array::from_fn(|r| limit(r, &dpc.lower, f64::NEG_INFINITY)),
        upper: std::array::from_fn(|r| limit(r, &dpc.upper, f64::INFINITY)),
        tube: std::array::from_fn(tube),
        state: [],
        input: [],
        terminal: &[],
        shift: [NO_ROW; STRIPS],
        root: [[0.0; STATES]; STATES],
        stages: [STILL],
        x: Bounds::NONE,
        u: Bounds::NONE,
        boxed: false,
        staged: false,
        max_iterations: 0,
    };
    let noise: [f64; STRIPS] = std::array::from_fn(|r| limit(r, &dpc.noise, 0.0));
    let e = array(e.as_slice());
    let (x_ref, u_ref) = ([[0.0; STATES]], [[0.0]]);
    let mut instance = problem.at(&e, &x_ref, &u_ref);
    problem.doubt(&mut instance, &noise, forecast.map(|dx| array(dx.as_slice())).as_ref());
    instance.iter().take(strips).map(|row| (row.lower, row.upper)).collect()
}

/// A stage that plays no part.
const STILL: Stage<STATES, 1> =
    Stage { next: [[0.0; STATES]; STATES], drive: [[0.0]; STATES], gain: [[0.0; STATES]], spread: [[0.0]] };

/// M dref and whether the load keeps what was assumed, step by step, of loads that were `start` and then `history`.
///
/// # Panics
/// There are more states, loads or steps of horizon than this module allows for.
pub fn admitted(
    N: usize,
    unknowns: &Unknowns,
    start: &DVector<f64>,
    history: &[DVector<f64>],
) -> Vec<(DVector<f64>, bool)> {
    let run = match N {
        1 => run::<1>,
        2 => run::<2>,
        3 => run::<3>,
        4 => run::<4>,
        5 => run::<5>,
        6 => run::<6>,
        _ => panic!("a horizon of {N}"),
    };
    run(unknowns, start, history)
}

fn run<const N: usize>(
    unknowns: &Unknowns,
    start: &DVector<f64>,
    history: &[DVector<f64>],
) -> Vec<(DVector<f64>, bool)> {
    let (n, count) = unknowns.M.shape();
    assert!(n <= STATES && count <= MOST_LOADS, "{n} states, {count} loads");
    let of = |value: &dyn Fn(&crate::unknowns::Load) -> f64| {
        std::array::from_fn(|k| unknowns.loads.get(k).map_or(0.0, value))
    };
    let entry = |r: usize, k: usize| if r < n && k < count { unknowns.M[(r, k)] } else { 0.0 };
    let model: LoadModel<MOST_LOADS, STATES> = LoadModel {
        M: std::array::from_fn(|r| std::array::from_fn(|k| entry(r, k))),
        min: of(&|load| load.min),
        max: of(&|load| load.max),
        rate: of(&|load| load.rate),
        lag: of(&|load| load.change(N - 1)),
    };
    let (mut loads, first) = Loads::<MOST_LOADS, STATES, N>::start(&model, &array(start.as_slice())).expect("inside");
    assert!(first.within);
    let mut step = |d: &DVector<f64>| {
        let load = loads.admit(&array(d.as_slice()));
        (DVector::from_column_slice(&load.push[..n]), load.within)
    };
    history.iter().map(&mut step).collect()
}

/// With zeros where there is nothing.
fn array<const COUNT: usize>(values: &[f64]) -> [f64; COUNT] {
    std::array::from_fn(|k| values.get(k).copied().unwrap_or(0.0))
}
