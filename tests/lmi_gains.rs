//! Which gains does a design get, and does the matrix inequality reach plants that local Riccati equations do not?
#![expect(non_snake_case, reason = "the paper's symbols")]

use std::fmt::Write;
use std::path::Path;
use std::time::Instant;

use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::{Diagnostics, Source, code};
use dpc_codegen::emit::Emitted;
use dpc_codegen::gains::{Layer, Settled, SubsystemGains, interconnection, origin};
use dpc_codegen::network::Network;
use dpc_codegen::optim::lmi::{Fastest, Search};
use dpc_codegen::optim::lyapunov::{Contraction, spectral_radius};
use dpc_codegen::sets::small_gain_matrix;
use dpc_tests::host_loop::{HostLoop, Mission, Neighbours, nearest_feasible};
use dpc_tests::plants::plant;
use dpc_tests::{Random, lower, read};
use nalgebra::{DMatrix, DVector};

const NON_MINIMUM_PHASE: &str = "cases/accept/four_tank_pplus.toml";

/// The file with `gains = "<way>"`.
fn stated(path: &str, way: &str) -> Source {
    let Source { path, text } = read(Path::new(path));
    let start = text.find("sample-time").expect("every file has a sample time");
    Source { path, text: format!("{}gains = \"{way}\"\n{}", &text[..start], &text[start..]) }
}

fn design(source: Source) -> Design {
    let shown = source.clone();
    Design::new(source).unwrap_or_else(|errors| panic!("{}", errors.render(&shown, false)))
}

fn origins(network: &Network) -> Vec<[&'static str; 2]> {
    network.subsystems.iter().map(|s| [origin(s, Layer::Local), origin(s, Layer::Reference)]).collect()
}

const RICCATI: &str = "local Riccati equation";
const INEQUALITY: &str = "matrix inequality";

#[test]
fn only_the_layer_that_needs_it_leaves_riccati() {
    let Diagnostics(errors) = Design::new(stated(NON_MINIMUM_PHASE, "lqr")).expect_err("calF is not stable");
    assert_eq!(errors[0].code, code::ASSUMPTION_3);
    let design = design(stated(NON_MINIMUM_PHASE, "auto"));
    assert_eq!(origins(&design.network), [[RICCATI, INEQUALITY]; 2]);
    assert!(design.gains.rho_calF < 1.0 && Contraction::new(&design.gains.calF.to_dense()).is_some());
    assert!(design.sets.rho_small_gain < 1.0);
}

#[test]
fn plants_that_riccati_can_do_are_left_as_they_were() {
    for path in ["../examples/four_tank/system.toml", "cases/accept/three_carts.toml"] {
        let written = |way| {
            let design = design(stated(path, way));
            assert!(origins(&design.network).iter().flatten().all(|origin| *origin != INEQUALITY));
            let emitted = Emitted::new(&design);
            let files = emitted.paths(Path::new("")).into_iter().map(|(path, text)| (path, text.to_owned()));
            files.collect::<Vec<_>>()
        };
        assert_eq!(written("auto"), written("lqr"));
    }
}

#[test]
fn given_gains_win_and_the_inequality_finds_the_others() {
    let plain = lower(stated(NON_MINIMUM_PHASE, "lmi")).expect("an accepted case");
    let wanted = Settled::new(plain.clone()).expect("gains").gains.subsystems[0].calK();
    let mut network = plain;
    network.subsystems[0].gains.calK = Some(wanted.clone());
    network.subsystems[0].gains.K = Some(DMatrix::from_row_slice(1, 2, &[-0.1, -0.2]));
    let settled = Settled::new(network).expect("gains");
    let gains = &settled.gains.subsystems;
    assert_eq!(gains[0].K, DMatrix::from_row_slice(1, 2, &[-0.1, -0.2]));
    assert_eq!(gains[0].calK(), wanted);
    assert_eq!(origins(&settled.network), [["given"; 2], [INEQUALITY; 2]]);
}

/// Theorem 1 on the linear plant: constraints are kept under jumping set-points, and outputs arrive.
#[test]
fn the_non_minimum_phase_four_tank_tracks() {
    let design = design(read(Path::new(NON_MINIMUM_PHASE)));
    let plant = plant(&design.network);
    let random = &mut Random(7);
    let mut network = HostLoop::start(&design, &plant, Neighbours::True, 0.9, random).compare(50);
    network.run(&Mission::Jumps, 400, random);
    let epsilon = design.sizing.epsilon;
    let set_point = network.references() + DVector::from_vec(vec![200.0 * epsilon, -150.0 * epsilon]);
    let goal = nearest_feasible(&design, &set_point);
    network.settle(&Mission::Constant(set_point), 4000, random);
    let tally = &network.tally;
    assert!(tally.violations.is_empty(), "{:?}", tally.violations);
    assert!(tally.solved > 0 && tally.compared > 0 && tally.difference < 1e-8);
    let error = (network.outputs() - &goal).amax();
    println!("non-minimum-phase four-tank: y = {:?}, goal {:?}", network.outputs().as_slice(), goal.as_slice());
    assert!(error < 1e-6, "{error:e} off");
}

/// Radii of the loops that the gains of `network` close, whether or not they are small enough.
struct Radii {
    F: f64,
    calF: f64,
    small_gain: f64,
}

fn radii(network: &Network) -> Radii {
    let gains: Vec<_> = network.subsystems.iter().map(SubsystemGains::new).collect::<Result<_, _>>().expect("gains");
    let closed =
        |layer, gains: Vec<DMatrix<f64>>| spectral_radius(&interconnection(network, layer).0.closed_loop(&gains));
    Radii {
        F: closed(Layer::Local, gains.iter().map(|g| g.K.clone()).collect()),
        calF: closed(Layer::Reference, gains.iter().map(SubsystemGains::calK).collect()),
        small_gain: small_gain_matrix(network, &gains).1,
    }
}

/// What the two ways do to published plants. Both of the paper's conditions are radii below 1; the last column is the step
/// that the references of the finished design may take.
#[test]
fn published_plants_by_both_ways() {
    let plants = [
        ("four-tank", "../examples/four_tank/system.toml"),
        ("four-tank P+", NON_MINIMUM_PHASE),
        ("power network", "cases/plants/power_network.toml"),
        ("stiff chain", "cases/plants/chain_eth10.toml"),
    ];
    println!("{:<15}{:<6}{:>9}{:>11}{:>12}{:>11}", "plant", "gains", "rho(F)", "rho(calF)", "small gain", "eps");
    for (name, path) in plants {
        for way in ["lqr", "lmi"] {
            let design = Design::new(stated(path, way)).ok();
            let epsilon = design.as_ref().map_or("none".into(), |design| format!("{:.2e}", design.sizing.epsilon));
            let plain = lower(stated(path, way)).expect("a network");
            let Radii { F, calF, small_gain } = radii(&design.map_or(plain, |design| design.network));
            println!("{name:<15}{way:<6}{F:>9.4}{calF:>11.4}{small_gain:>12.4}{epsilon:>11}");
            if way == "lmi" {
                assert!(F < 1.0 && calF < 1.0 && small_gain < 1.0 && epsilon != "none", "{name}");
            }
            if (name, way) == ("stiff chain", "lmi") {
                assert!(small_gain < 0.6, "{small_gain}");
            }
            let fails = way == "lqr" && ["four-tank P+", "stiff chain"].contains(&name);
            assert_eq!(fails, calF >= 1.0 || small_gain >= 1.0, "{name}");
        }
    }
}

/// A line of areas of four states each, coupled through their angles.
fn line(areas: usize) -> Source {
    let own = "[[0.89036516840966, 0.7752238912910319, 0.011158705069180437, 0.0033150510437699797], \
               [-0.19380597282275797, 0.43237744405329515, 0.011255809641755462, 0.004045173126235029], \
               [1.65752552188499, -8.090346252470061, -0.11316735455268294, -0.030016992648621538], \
               [2.2643014908202104, -6.330926778570664, -0.15169399223381358, -0.053133369255439315]]";
    let from = "[[0.054817415795168245, 0.0, 0.0, 0.0], [0.09690298641137918, 0.0, 0.0, 0.0], \
                [-0.8287627609424961, 0.0, 0.0, 0.0], [-1.132150745410107, 0.0, 0.0, 0.0]]";
    let input = "[[0.012934951784634033], [0.033150510437699836], [0.7288029667300704], [0.6387519887841916]]";
    let mut text = "name = \"line\"\nsample-time = 1.0\nhorizon = 5\n".to_owned();
    for i in 0..areas {
        let names = "states = [\"angle\", \"frequency\", \"mechanical\", \"valve\"]\ninputs = [\"power\"]\noutputs = [\"angle\"]";
        let sets =
            "x = { min = [-0.1, -inf, -inf, -inf], max = [0.1, inf, inf, inf] }\nu = { min = -0.65, max = 0.65 }";
        let weights = "Q = [500.0, 0.01, 0.01, 10.0]\nR = 10.0";
        let area =
            format!("[subsystem.area_{i}]\n{names}\nA = {own}\nB = {input}\nC = [[1, 0, 0, 0]]\n{sets}\n{weights}\n");
        text += &area;
        for j in (0..areas).filter(|j| i.abs_diff(*j) == 1) {
            write!(text, "[subsystem.area_{i}.from.area_{j}]\nA = {from}\n").expect("writing to a string");
        }
    }
    Source { path: format!("line_{areas}.toml"), text }
}

/// Cost of the inequality by size: what sparse couplings are worth. The growth is printed, not timed against a limit.
#[test]
fn the_inequality_by_size() {
    println!("{:<24}{:<11}{:>8}{:>12}{:>12}{:>10}", "network", "gains", "states", "fastest", "search", "one gain");
    let sizes = [("four-tank P+".to_owned(), read(Path::new(NON_MINIMUM_PHASE)))];
    let lines = [4, 10].map(|areas| (format!("line of {areas} areas"), line(areas)));
    for (name, source) in sizes.into_iter().chain(lines) {
        let network = lower(source).expect("a network");
        for layer in [Layer::Local, Layer::Reference] {
            let (plant, prices) = interconnection(&network, layer);
            let start = Instant::now();
            let search = Search::new(&plant, &prices).expect("local regulators");
            let fastest = search.fastest().expect("a rate");
            let searched = start.elapsed();
            let Fastest::Decays(fastest) = fastest else { panic!("{name}: {fastest:?}") };
            let rate = 0.5 * (1.0 + fastest);
            let found = search.gains(rate).expect("gains");
            let solved = start.elapsed() - searched;
            assert!(plant.shrinks(&found.K, &found.S, rate), "{name}");
            assert!(spectral_radius(&plant.closed_loop(&found.K)) <= rate, "{name}");
            let states: usize = prices.iter().map(|price| price.Q.nrows()).sum();
            let layer = format!("{layer:?}");
            println!("{name:<24}{layer:<11}{states:>8}{fastest:>12.4}{searched:>12.1?}{solved:>10.1?}");
        }
    }
}
