//! Do chains of any length keep every constraint and arrive, and are tables made at run time those that are emitted?
#![expect(non_snake_case, reason = "the paper's symbols")]

use std::path::Path;

use dpc_codegen::design::Design;
use dpc_codegen::export::design_json;
use example_kit::checks::Checks;
use example_kit::sets::Promise;
use example_kit::trajectory::Trajectory;
use mass_chain::chain::{EMITTED, Gains, from_neighbour, mass, text};
use mass_chain::closed_loop::{from_rest, upset};
use mass_chain::pattern::Patterns;
use mass_chain::report::errors;
use mass_chain::stiff::{source, ways};
use mass_chain::{DESIGN_JSON, emitted, tables};

fn design(length: usize) -> Design {
    let source = source(length, Gains::Weighted);
    Design::new(source.clone()).unwrap_or_else(|mistakes| panic!("{}", mistakes.render(&source, false)))
}

#[test]
fn the_committed_file_is_what_the_chain_says() {
    let committed = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("system.toml")).unwrap();
    assert!(committed == text(EMITTED, Gains::Weighted), "stale: cargo run --release -p mass-chain -- --design");
}

/// Numbers of the exact hold at 0.1 s with the neighbours held, known from elsewhere.
#[test]
fn the_masses_move_as_they_should() {
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-11, "{a} {b}");
    let (A, B) = mass();
    close(A.rows[0][0], 0.913515347581107);
    close(A.rows[1][0], -1.5941438633037033);
    close(A.rows[1][1], 0.5946865749203657);
    close(B.rows[0][0], 0.004324232620944649);
    close(B.rows[1][0], 0.07970719316518515);
    close(from_neighbour().rows[1][0], 0.7970719316518518);
    close(from_neighbour().rows[0][1], 0.008648465241889298);
}

/// All that was decided, bit by bit.
fn decisions(trajectory: &Trajectory) -> Vec<u64> {
    let nodes = trajectory.samples.iter().flat_map(|sample| &sample.nodes);
    nodes.flat_map(|node| [node.u[0], node.x[0], node.x[1], node.y_ref[0], node.x_nom[0]]).map(f64::to_bits).collect()
}

#[test]
fn tables_made_at_run_time_are_the_emitted_ones() {
    let promise = Promise::new(DESIGN_JSON).unwrap();
    let patterns = Patterns::new(&promise, promise.epsilon);
    let design = design(EMITTED);
    assert_eq!(design_json(&design), DESIGN_JSON);
    let masses = tables::tables(&design).unwrap();
    for seed in 0..2 {
        let baked = upset(emitted::start().unwrap(), &promise, &patterns, 25, seed).unwrap();
        let made = upset(tables::start(&masses).unwrap(), &promise, &patterns, 25, seed).unwrap();
        assert!(decisions(&baked.trajectory) == decisions(&made.trajectory), "seed {seed}");
        assert!(baked.checks.sum(|node| node.active) > 100, "constraints must matter for the test to mean anything");
    }
}

#[test]
fn chains_of_any_length_keep_every_constraint_and_arrive() {
    for length in [2, 3, 7, 16] {
        let design = design(length);
        let promise = Promise::new(&design_json(&design)).unwrap();
        let patterns = Patterns::new(&promise, promise.epsilon);
        let masses = tables::tables(&design).unwrap();
        let run = from_rest(tables::start(&masses).unwrap(), &promise, &patterns).unwrap();
        assert_eq!(run.checks.violations(), 0, "{length} masses");
        let errors = errors(&run, &promise, &patterns);
        assert!(patterns.arrive && errors.iter().all(|error| *error < 1e-5), "{length} masses: {errors:?}");
        let mut all = Checks::new(&promise);
        for seed in 0..5 {
            all.absorb(&upset(tables::start(&masses).unwrap(), &promise, &patterns, 25, seed).unwrap().checks);
        }
        assert_eq!(all.violations(), 0, "{length} masses");
        let left = all.nodes.iter().map(|node| node.inputs.share_left()).fold(f64::INFINITY, f64::min);
        assert!(left < 0.3, "{length} masses: forces must come near their limits, {left}");
    }
}

#[test]
fn stiff_coupling_defeats_plain_riccati_gains_alone() {
    let ways = ways(1).unwrap();
    let [plain, inequality, searched, weighted] = &ways[..] else { panic!("four ways") };
    assert!(
        plain.small_gain > 1.5 && plain.design.as_ref().is_err_and(|why| why.contains("Assumption 3")),
        "{plain:?}"
    );
    for way in [inequality, searched, weighted] {
        assert!(way.small_gain < 0.6 && way.design.is_ok(), "{way:?}");
    }
}
