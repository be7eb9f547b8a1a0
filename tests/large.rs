//! Do large networks get the same design as small ones, only by sparse matrices?
#![expect(non_snake_case, reason = "the paper's symbols")]

use std::time::{Duration, Instant};

use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::{Diagnostics, Source, code};
use dpc_codegen::emit::Emitted;
use dpc_codegen::gains::{Gains, Proof, SubsystemGains};
use dpc_codegen::network::Network;
use dpc_codegen::optim::lyapunov::spectral_radius;
use dpc_codegen::sets::{ReferenceShare, Sets, SubsystemSets};
use dpc_codegen::summary::Summary;
use dpc_tests::checker::{self, Claim};
use dpc_tests::large_network::{LargeNetwork, Plant, Shape};
use dpc_tests::random_network::RandomNetwork;
use dpc_tests::{cases, lower, sparsely};

/// Every plant in every shape.
fn every(count: usize) -> impl Iterator<Item = LargeNetwork> {
    let shapes = [Shape::Chain, Shape::Grid(5)];
    let plants = [Plant::Rooms, Plant::Tanks, Plant::Masses];
    let pairs = plants.into_iter().flat_map(move |plant| shapes.map(|shape| (plant, shape)));
    pairs.map(move |(plant, shape)| LargeNetwork { plant, shape, count, kinds: 7 })
}

/// Networks that both ways can do: large ones of a moderate size, accepted cases, random ones.
fn networks() -> Vec<Network> {
    let random = (0..60).map(|seed| RandomNetwork::new(seed).source());
    let random = random.chain((0..15).map(|seed| RandomNetwork::changing(2 * seed).source()));
    let sources = every(12).map(|network| network.source()).chain(cases("accept")).chain(random);
    sources.filter_map(|source| lower(source).ok()).collect()
}

#[test]
fn sparse_rows_take_what_dense_ones_take() {
    let (mut compared, mut outputs, mut worst): (usize, usize, f64) = (0, 0, 0.0);
    for network in networks() {
        let (Ok(dense), Ok(sparse)) = (Gains::new(&network), Gains::sparse(&network)) else { continue };
        assert!(matches!(dense.proof, Proof::Norm(_)) && matches!(sparse.proof, Proof::Responses(_)));
        let (Ok(of_dense), Ok(of_sparse)) = (Sets::new(&network, &dense), Sets::new(&network, &sparse)) else {
            continue;
        };
        for (i, (dense, sparse)) in of_dense.subsystems.iter().zip(&of_sparse.subsystems).enumerate() {
            let s = &network.subsystems[i];
            let rows = dense.x_rows.iter().zip(&sparse.x_rows).zip(&s.X.h);
            let rows = rows.chain(dense.u_rows.iter().zip(&sparse.u_rows).zip(&s.U.h));
            for ((dense, sparse), limit) in rows {
                let off = (sparse.rate - dense.rate) / dense.rate.max(1e-9 * limit);
                assert!(off.abs() < 1e-5, "{}: {} {}", network.name, sparse.rate, dense.rate);
                assert!(same_steady(dense, sparse, *limit), "{}: {dense:?} {sparse:?}", network.name);
                assert!((sparse.load - dense.load).abs() <= 1e-5 * dense.load, "{} {}", sparse.load, dense.load);
                worst = worst.max(off);
                compared += 1;
            }
            let all = |sets: &SubsystemSets| [sets.outputs.axes.clone(), sets.outputs.oblique.clone()].concat();
            for (dense, sparse) in all(dense).iter().zip(&all(sparse)) {
                // Rows between the axes are as far from each other as the units they are drawn in.
                let off = (sparse.rate - dense.rate) / dense.rate;
                let load = (sparse.load - dense.load).abs();
                assert!(off.abs() < 1e-5 && load <= 1e-5 * dense.load, "{}: {dense:?} {sparse:?}", network.name);
                worst = worst.max(off);
                outputs += 1;
            }
        }
    }
    println!("{compared} rows; sparse ones take up to {worst:.1e} more");
    assert!(compared > 300 && outputs > 30 && worst < 1e-6, "{compared} {outputs} {worst}");
}

fn same_steady(dense: &ReferenceShare, sparse: &ReferenceShare, limit: f64) -> bool {
    let size = dense.steady.iter().fold(0.0, |size: f64, (_, gain)| size.max(gain.abs()));
    let listed = sparse.steady.iter().all(|&(k, gain)| (gain - dense.steady[k].1).abs() <= 1e-9 * size);
    listed && sparse.rest <= 1.0001e-4 * limit
}

/// What is left out and dropped is charged: no inclusion fails by code that knows nothing of it.
#[test]
fn sparse_designs_keep_what_they_promise() {
    let (mut designs, mut overcharge): (usize, f64) = (0, 0.0);
    let grid = LargeNetwork { plant: Plant::Tanks, shape: Shape::Grid(6), count: 36, kinds: 36 };
    let loaded = (0..10).filter_map(|seed| lower(RandomNetwork::changing(2 * seed + 1).source()).ok());
    for network in networks().into_iter().chain(lower(grid.source())).chain(loaded) {
        let name = network.name.clone();
        let Some(design) = sparsely(network) else { continue };
        let claims = checker::claims(&design);
        let broken: Vec<_> = claims.iter().filter(|claim| !claim.holds()).collect();
        assert!(broken.is_empty(), "{name}: {broken:?}");
        overcharge = claims.iter().filter_map(Claim::overcharge).fold(overcharge, f64::max);
        designs += 1;
    }
    println!("{designs} designs; Delta^chi is charged up to {overcharge:.1e} too much");
    assert!(designs > 20 && overcharge < 1e-5, "{designs} {overcharge}");
}

#[test]
fn bounds_of_spectral_radii_are_bounds() {
    for network in networks() {
        let (Ok(dense), Ok(sparse)) = (Gains::new(&network), Gains::sparse(&network)) else { continue };
        let rho_calF = spectral_radius(&sparse.calF.to_dense());
        assert!((sparse.calF.to_dense() - dense.calF.to_dense()).amax() <= 1e-13 * dense.calF.to_dense().amax());
        assert!(rho_calF <= sparse.rho_calF * (1.0 + 1e-12), "{}: {rho_calF} {}", network.name, sparse.rho_calF);
        // Where the loops of the K_i have no small gain, Assumption 4 fails later.
        assert!(dense.rho_F <= sparse.rho_F * (1.0 + 1e-12), "{}: {} {}", network.name, dense.rho_F, sparse.rho_F);
    }
}

/// 300 reference states, from the text to the emitted files.
#[test]
fn a_hundred_subsystems_are_designed_in_seconds() {
    for network in every(100) {
        let start = Instant::now();
        let design = Design::new(network.source()).unwrap_or_else(|mistakes| panic!("{network:?}: {mistakes}"));
        let emitted = Emitted::new(&design);
        let time = start.elapsed();
        println!("{:?} {:?}: {time:.2?}", network.plant, network.shape);
        assert!(cfg!(debug_assertions) || time < Duration::from_secs(10), "{time:?}");
        assert!(matches!(design.gains.proof, Proof::Responses(_)));
        assert!(design.sizing.slacks.iter().all(|slack| slack.value >= 0.0));
        let text: usize = emitted.files.iter().map(|(_, text)| text.len()).sum();
        assert!(emitted.files.len() == 101 && text < 10_000_000, "{text}");
        assert!(Summary::new(&design, &emitted).to_string().lines().count() < 200);
    }
}

#[test]
fn equal_subsystems_get_what_each_would_get_alone() {
    let network = LargeNetwork { plant: Plant::Rooms, shape: Shape::Grid(6), count: 36, kinds: 2 };
    let network = lower(network.source()).expect("a valid network");
    let gains = Gains::new(&network).expect("gains");
    for (s, shared) in network.subsystems.iter().zip(&gains.subsystems) {
        let alone = SubsystemGains::new(s).expect("gains");
        assert_eq!(format!("{alone:?}"), format!("{shared:?}"), "{}", s.name);
    }
}

/// The same design for the same text, whatever the threads do.
#[test]
fn large_designs_are_the_same_every_time() {
    let network = LargeNetwork { plant: Plant::Tanks, shape: Shape::Grid(6), count: 36, kinds: 5 };
    let files = || Emitted::new(&Design::new(network.source()).expect("a design")).files;
    assert_eq!(files(), files());
}

/// One norm for the whole network would charge every row for its slowest mode.
#[test]
fn a_slow_subsystem_does_not_spoil_the_rows_of_others() {
    let part = |name: &str, more: &str| {
        format!(
            "[subsystem.{name}]\nstates = [\"x\"]\ninputs = [\"u\"]\noutputs = [\"x\"]\nA = [[0.5]]\nB = [[1.0]]\nC = [[1.0]]\n\
             x = {{ min = [-5.0], max = [5.0] }}\nu = {{ min = [-4.0], max = [4.0] }}\n{more}\n"
        )
    };
    let text =
        HEAD.to_owned() + &part("fast", "") + &part("slow", "Kx = [[-0.2]]\nKe = [[1e-7]]\nfrom.fast.A = [[0.01]]");
    let network = lower(Source { path: "slow.toml".to_owned(), text }).expect("a valid network");
    let gains = Gains::new(&network).expect("gains");
    assert!(matches!(gains.proof, Proof::Norm(_)) && gains.rho_calF > 1.0 - 1e-6, "{}", gains.rho_calF);
    let sets = Sets::new(&network, &gains).expect("sets");
    let alone = lower(Source { path: "fast.toml".to_owned(), text: HEAD.to_owned() + &part("fast", "") });
    let alone = alone.expect("a valid network");
    let alone = Sets::new(&alone, &Gains::new(&alone).expect("gains")).expect("sets");
    let rows =
        |sets: &Sets| sets.subsystems[0].x_rows.iter().chain(&sets.subsystems[0].u_rows).map(|row| row.rate).collect();
    let (beside, alone): (Vec<f64>, Vec<f64>) = (rows(&sets), rows(&alone));
    for (beside, alone) in beside.iter().zip(&alone) {
        assert!((beside / alone - 1.0).abs() < 1e-6, "{beside} {alone}");
    }
}

const HEAD: &str = "name = \"slow\"\nsample-time = 1.0\nhorizon = 3\n";

fn refused(text: String) -> (Source, Diagnostics) {
    let source = Source { path: "large.toml".to_owned(), text };
    let mistakes = Design::new(source.clone()).expect_err("no design");
    (source, mistakes)
}

#[test]
fn a_search_for_gains_of_a_large_network_is_refused() {
    let network = LargeNetwork { plant: Plant::Rooms, shape: Shape::Chain, count: 200, kinds: 3 };
    let (source, mistakes) = refused(network.toml() + "\n[sizing]\neffort = 1\n");
    let message = mistakes.render(&source, false);
    assert!(mistakes.0[0].code == code::OUT_OF_RANGE && message.contains("600 reference states"), "{message}");
}

/// Loops that act on each other too strongly end with a name and numbers, in a message of a readable length.
#[test]
fn a_large_network_without_a_sparse_proof_is_refused() {
    let network = LargeNetwork { plant: Plant::Masses, shape: Shape::Chain, count: 200, kinds: 3 };
    for coupling in ["9.0", "0.9"] {
        let text = network.toml().replace("[0.02, 0.0]]", &format!("[{coupling}, 0.0]]"));
        let (source, mistakes) = refused(text);
        let message = mistakes.render(&source, false);
        assert_eq!(mistakes.0[0].code, code::LARGE_REFERENCES, "{message}");
        assert!(message.contains("must be below 1") && message.contains("matrix inequality"), "{message}");
        assert!(message.lines().count() < 80, "{message}");
    }
}
