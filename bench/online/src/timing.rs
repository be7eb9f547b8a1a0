//! One problem, every solver, step by step.

use crate::peers::Peer;
use crate::statistics::{Figures, Step};

/// Passes over all steps.
pub const PASSES: usize = 30;
/// Gets one pass over a few steps: it takes a thousand times as long.
pub const SLOW: &str = "Clarabel";
/// Every how many steps.
pub const SELDOM: usize = 60;

/// Time stamp counter, behind everything before it.
#[inline]
pub fn ticks() -> u64 {
    // SAFETY: every x86-64 processor has both instructions.
    unsafe {
        std::arch::x86_64::_mm_lfence();
        std::arch::x86_64::_rdtsc()
    }
}

/// Nanoseconds per tick, and the ticks of measuring nothing.
pub fn calibration() -> (f64, f64) {
    let (start, clock) = (ticks(), std::time::Instant::now());
    while clock.elapsed().as_millis() < 50 {}
    let rate = clock.elapsed().as_nanos() as f64 / (ticks() - start) as f64;
    let mut empty: Vec<u64> = (0..10_000)
        .map(|_| {
            let start = ticks();
            ticks() - start
        })
        .collect();
    empty.sort_unstable();
    empty.truncate(5_000);
    (rate, empty.iter().sum::<u64>() as f64 / empty.len() as f64)
}

/// Lower and upper limits of the rows, step by step, and whether the step rests.
pub struct Limits {
    pub lower: Vec<f64>,
    pub upper: Vec<f64>,
    pub rests: bool,
}

/// Times a peer over all steps once, after once without the clock, so that caches hold what belongs to it: `pose` writes the lower and upper limits of a step, `finish` makes
/// of w what is wanted.
pub fn pass(
    peer: &mut dyn Peer,
    pose: impl Fn(usize, &mut [f64], &mut [f64]),
    finish: impl Fn(&[f64]),
    best: &mut [Step],
) {
    let every = if peer.name() == SLOW { SELDOM } else { 1 };
    for timed in [false, true] {
        peer.forget();
        for (step, best) in best.iter_mut().enumerate().step_by(every) {
            let start = ticks();
            let (lower, upper) = peer.limits();
            pose(step, lower, upper);
            let solved = peer.solve();
            finish(peer.w());
            let time = ticks() - start;
            if timed {
                best.keep(time, peer.iterations(), peer.w(), solved);
            }
        }
    }
}

/// Figures of a solver from its best steps.
pub fn figures(
    name: String,
    steps: &[Step],
    limits: &[Limits],
    truth: &[Option<Vec<f64>>],
    clock: (f64, f64),
) -> Figures {
    let rests: Vec<bool> = limits.iter().map(|l| l.rests).collect();
    Figures::new(name, steps, &rests, truth, clock)
}

/// The module of one emitted subsystem.
macro_rules! measure {
    ($name:expr, $($module:tt)*) => {{
        use dpc_runtime::solver::{Outcome, Rows, Side, Solver, WorkingSet};
        use $($module)* as node;
        use $crate::statistics::{ALONE, Report, Step, floor, limits_at, truth};
        use $crate::timing::{Limits, PASSES, SLOW, calibration, figures, pass, ticks};

        let recorded = $crate::record::record!($($module)*);
        let problem = std::hint::black_box(&node::TABLES.problem);
        let limits: Vec<Limits> = recorded.iter().map(|at| {
            let instance = problem.at(&at.e, &at.x_ref, &at.u_ref);
            Limits {
                lower: instance.iter().map(|row| row.lower).collect(),
                upper: instance.iter().map(|row| row.upper).collect(),
                rests: instance.rests(),
            }
        }).collect();
        let rows: Vec<Vec<f64>> = problem.V.iter().map(|row| row.to_vec()).collect();
        let mut peers = $crate::peers::all(&rows);
        let clock = calibration();
        let mut best: Vec<Vec<Step>> = vec![vec![Step::default(); recorded.len()]; 2 * peers.len() + 2];
        let mut sets: Vec<Vec<(usize, bool)>> = vec![Vec::new(); recorded.len()];
        for number in 0..PASSES {
            // Ours: parameters to plan.
            let mut solver = Solver::<{ node::NV }>::NEW;
            for timed in [false, true] {
                let mut warm = WorkingSet::<{ node::NV }>::EMPTY;
                for ((at, best), set) in recorded.iter().zip(&mut best[0]).zip(&mut sets) {
                    let at = std::hint::black_box(at);
                    let start = ticks();
                    if problem.rests(&at.e, &at.x_ref, &at.u_ref) {
                        warm = WorkingSet::EMPTY;
                        let time = ticks() - start;
                        if timed {
                            best.keep(time, 0, &[0.0; node::NV], true);
                        }
                        continue;
                    }
                    let instance = problem.at(&at.e, &at.x_ref, &at.u_ref);
                    let outcome = solver.solve(&instance, &warm, problem.max_iterations);
                    let plan = problem.plan(solver.w());
                    std::hint::black_box(&plan);
                    warm = problem.shifted(solver.rows());
                    let time = ticks() - start;
                    if timed {
                        let iterations = if let Outcome::Optimal { iterations } = outcome { iterations } else { 0 };
                        best.keep(time, iterations, solver.w(), matches!(outcome, Outcome::Optimal { .. }));
                        *set = solver.rows().map(|(row, side)| (row, side == Side::Upper)).collect();
                    }
                }
            }
            // The floor: every bound of the references, stage by stage, and the rows of the tube.
            let (low, high) = ([[-1e9; node::NX]; node::N], [[1e9; node::NX]; node::N]);
            let (below, above) = ([[-1e9; node::NU]; node::N], [[1e9; node::NU]; node::N]);
            for (at, best) in recorded.iter().zip(&mut best[1]) {
                let (at, low, high) = (std::hint::black_box(at), std::hint::black_box(&low), std::hint::black_box(&high));
                let (below, above) = (std::hint::black_box(&below), std::hint::black_box(&above));
                let start = ticks();
                let inside = floor(&problem.tube, &at.e, &problem.lower, &problem.upper)
                    & $crate::statistics::between(low.as_flattened(), at.x_ref.as_flattened(), high.as_flattened())
                    & $crate::statistics::between(below.as_flattened(), at.u_ref.as_flattened(), above.as_flattened());
                std::hint::black_box(inside);
                let time = ticks() - start;
                best.keep(time, 0, &[0.0; node::NV], true);
            }
            // Peers, from the parameters to the plan, then from the limits to w.
            let pose = |step: usize, lower: &mut [f64], upper: &mut [f64]| {
                limits_at(problem, std::hint::black_box(&recorded[step]), lower, upper);
            };
            let plan = |w: &[f64]| {
                std::hint::black_box(problem.plan(w.first_chunk().expect("as many unknowns")));
            };
            let given = |step: usize, lower: &mut [f64], upper: &mut [f64]| {
                lower.copy_from_slice(&limits[step].lower);
                upper.copy_from_slice(&limits[step].upper);
            };
            for (peer, best) in peers.iter_mut().zip(best[2..].chunks_exact_mut(2)) {
                if peer.name() != SLOW || number == 0 {
                    pass(peer.as_mut(), pose, plan, &mut best[0]);
                    pass(peer.as_mut(), given, |_| {}, &mut best[1]);
                }
            }
        }
        let truths: Vec<Option<Vec<f64>>> = limits.iter().zip(&sets).map(|(l, set)| truth(&rows, l, set)).collect();
        let moving = limits.iter().filter(|l| !l.rests).count();
        let proved = limits.iter().zip(&truths).filter(|(l, truth)| !l.rests && truth.is_some()).count();
        let both = |name: &str| [name.to_owned(), format!("{name}{ALONE}")];
        let own = ["this", "floor"].into_iter().map(str::to_owned);
        let names = own.chain(peers.iter().flat_map(|peer| both(peer.name())));
        let all = names.zip(&best).map(|(name, steps)| figures(name, steps, &limits, &truths, clock)).collect();
        Report { name: $name.to_owned(), unknowns: node::NV, rows: node::NR, bytes: std::mem::size_of_val(&node::TABLES) + std::mem::size_of_val(problem.gram) + std::mem::size_of_val(problem.terminal), moving, proved, figures: all }
    }};
}
pub(crate) use measure;
