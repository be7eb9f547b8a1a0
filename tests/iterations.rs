//! Does the solver never change its working set more often than was certified, and as often where the certificate says so?

use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::Source;
use dpc_codegen::emit::Emitted;
use dpc_codegen::iterations::{Certificate, Instance, Space, Uncertified, certify, walk};
use dpc_codegen::problems::{DpcProblem, NO_ROW};
use dpc_codegen::summary::Summary;
use dpc_runtime::solver::{Outcome, Solver, WorkingSet};
use dpc_tests::{Random, read};

const NV: usize = 8;

/// Questions that are enough for these plants.
const WORK: usize = 3_000_000;

const SAMPLES: usize = 100_000;

/// An unstable state under a disturbance, N = 2; two of them in a chain, N = 1; the first with a measurement error.
const PLANTS: [(&str, usize, &str); 3] = [
    (
        "A = [[1.1]]\nB = [[0.5]]\nC = [[1.0]]\nx = { min = [-10.0], max = [10.0] }\nw = { min = [-0.1], max = [0.1] }",
        2,
        "",
    ),
    (
        "A = [[1.05, 0.3], [0.0, 0.8]]\nB = [[0.1], [1.0]]\nC = [[1.0, 0.0]]\nx = { min = [-10.0, -4.0], max = [10.0, 4.0] }\nw = { min = [-0.01, -0.01], max = [0.01, 0.01] }",
        1,
        ", \"x2 [-]\"",
    ),
    (
        "A = [[1.1]]\nB = [[0.5]]\nC = [[1.0]]\nx = { min = [-10.0], max = [10.0] }\nw = { min = [-0.05], max = [0.05] }\nmeasurement-error = { max = [0.02] }",
        1,
        "",
    ),
];

fn plant((model, horizon, more): (&str, usize, &str)) -> Design {
    let text = format!(
        "name = \"plant\"\nsample-time = 1.0\nhorizon = {horizon}\n[reference]\nnorm = \"inf\"\n[subsystem.one]\n\
         states = [\"x1 [-]\"{more}]\ninputs = [\"u1 [-]\"]\noutputs = [\"x1 [-]\"]\n{model}\n\
         u = {{ min = [-3.0], max = [3.0] }}\nQ = 1.0\nR = 1.0\nT = 1.0\n"
    );
    let source = Source { path: "plant.toml".to_owned(), text };
    Design::new(source.clone()).unwrap_or_else(|mistakes| panic!("{}", mistakes.render(&source, false)))
}

fn space(design: &Design, i: usize) -> Space {
    let (s, sized) = (&design.network.subsystems[i], &design.sizing.subsystems[i]);
    Space::new(&design.problems.subsystems[i].dpc, s, sized, &design.network)
}

#[test]
fn a_certified_number_is_attained_and_never_exceeded() {
    let tank = Design::new(read("../examples/four_tank/system.toml".as_ref())).expect("a design exists");
    for design in PLANTS.into_iter().map(plant).chain([tank]) {
        let dpc = &design.problems.subsystems[0].dpc;
        let mut space = space(&design, 0);
        let seen = walk(dpc, &mut space, 2000).expect("there is room");
        let certificate = certify(dpc, &space, WORK).unwrap_or_else(|why| panic!("{why}"));
        println!(
            "{} unknowns, {} rows, {} parameters: at most {} changes, {} without solution; {} starts, {} regions, {} questions; \
             {seen:?}",
            dpc.V.ncols(),
            dpc.rows.len(),
            space.dimension(),
            certificate.most,
            certificate.infeasible.unwrap_or(0),
            certificate.starts,
            certificate.regions,
            certificate.questions,
        );
        assert!(certificate.thickest < 1.1e-5, "{:e}", certificate.thickest);
        attained(dpc, &space, &certificate);
        let most = sampled(dpc, &space, &mut Random(7));
        assert!(most <= certificate.most, "{most} changes, {} certified", certificate.most);
        assert!(seen.cold.max(seen.warm) <= certificate.most);
    }
}

/// The longest run is one that the solver makes.
fn attained(dpc: &DpcProblem, space: &Space, certificate: &Certificate) {
    let extreme = certificate.extreme.as_ref().expect("there is a solution somewhere");
    let mut instance = Instance::<NV>::new(dpc).expect("there is room");
    instance.at(space, &extreme.p);
    let mut from = WorkingSet::EMPTY;
    extreme.start.iter().for_each(|(row, side)| assert!(from.push(*row, *side)));
    let mut solver = Solver::<NV>::NEW;
    let outcome = solver.solve(&instance, &from, 1000);
    assert_eq!(outcome, Outcome::Optimal { iterations: certificate.most }, "radius {:e}", extreme.radius);
}

/// The most changes on parameters of the box, from starts that the solutions before have left.
fn sampled(dpc: &DpcProblem, space: &Space, random: &mut Random) -> usize {
    let mut instance = Instance::<NV>::new(dpc).expect("there is room");
    let (shift, mut solver) = (dpc.shift(), Solver::<NV>::NEW);
    let mut starts = vec![WorkingSet::EMPTY];
    let (mut most, mut solved) = (0, 0);
    while solved < SAMPLES {
        let corner = random.chance(0.3);
        let p: Vec<f64> = (0..space.dimension())
            .map(|_| if corner && random.chance(0.7) { random.sign() } else { random.between(-1.0, 1.0) })
            .collect();
        instance.at(space, &p);
        let from = starts[random.below(starts.len())];
        let Outcome::Optimal { iterations } = solver.solve(&instance, &from, 1000) else { continue };
        solved += 1;
        most = most.max(iterations);
        let mut next = WorkingSet::EMPTY;
        for (row, side) in solver.working_set().iter().filter(|(row, _)| shift[*row] != NO_ROW) {
            assert!(next.push(shift[row], side));
        }
        if !starts.contains(&next) {
            starts.push(next);
        }
    }
    most
}

/// What is too large says so, and rests on what was seen.
#[test]
fn limits_rest_on_what_was_seen() {
    let design = Design::new(read("../examples/four_tank/system.toml".as_ref())).expect("a design exists").counted(100);
    for problems in &design.problems.subsystems {
        let count = problems.iterations.as_ref().expect("it was counted");
        assert!(matches!(count.certificate, Err(Uncertified::Work(_))));
        let (seen, run) = (count.seen.expect("there is room"), count.run.expect("there is room"));
        assert!(seen.undecided + run.undecided == 0 && seen.parameters > 50 && run.parameters > 5);
        assert!(
            seen.cold >= 5 && seen.cold.max(seen.warm).max(run.cold).max(run.warm) * 3 <= problems.dpc.max_iterations
        );
    }
    let emitted = Emitted::new(&design);
    assert!(emitted.files[1].1.contains("--iterations=100") && emitted.files[1].1.contains("// sampled: at most"));
    assert!(Summary::new(&design, &emitted).to_string().contains("sampled: at most"));
}

#[test]
fn a_certified_limit_is_baked_in() {
    let design = plant(PLANTS[0]).counted(10_000);
    let problems = &design.problems.subsystems[0];
    let certificate =
        problems.iterations.as_ref().and_then(|count| count.certificate.as_ref().ok()).expect("it is small");
    let longest = certificate.most.max(certificate.infeasible.unwrap_or(0));
    assert_eq!(problems.dpc.max_iterations, longest + 2 * problems.dpc.V.ncols());
    let text = &Emitted::new(&design).files[1].1;
    assert!(text.contains(&format!("// certified: at most {} changes where", certificate.most)));
}
