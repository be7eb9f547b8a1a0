//! Do the ways to state a network mean the same, and does lowering keep what was stated?
#![expect(non_snake_case, reason = "the paper's symbols")]

use std::collections::BTreeMap;
use std::path::Path;

use dpc_codegen::diagnostic::Source;
use dpc_codegen::network::{CouplingConstraint, Network, Norm, Subsystem};
use dpc_tests::{Random, cases, lower, read};
use nalgebra::{DMatrix, DVector, dmatrix, dvector};

fn network(case: &str) -> Network {
    let source = read(&Path::new("cases/accept").join(case).with_extension("toml"));
    accept(source)
}

fn accept(source: Source) -> Network {
    let text = source.clone();
    lower(source).unwrap_or_else(|errors| panic!("{}", errors.render(&text, false)))
}

#[test]
fn every_accepted_case_is_accepted() {
    let cases = cases("accept");
    assert!(cases.len() >= 4);
    cases.into_iter().for_each(|case| drop(accept(case)));
}

#[test]
fn three_ways_to_state_the_four_tank_lower_to_the_same_network() {
    let blocks = network("four_tank_blocks");
    for other in ["four_tank_collective", "four_tank_interaction"].map(network) {
        assert_eq!(summary(&other), summary(&blocks));
        blocks.subsystems.iter().zip(&other.subsystems).for_each(|(one, other)| assert_same(one, other));
    }
}

#[test]
fn the_example_is_the_case() {
    let example = read(Path::new("../examples/four_tank/system.toml"));
    let case = network("four_tank_blocks");
    accept(example).subsystems.iter().zip(&case.subsystems).for_each(|(one, other)| assert_same(one, other));
}

#[test]
fn the_four_tank_has_the_printed_numbers() {
    let network = network("four_tank_blocks");
    assert_eq!((network.sample_time, network.horizon), (0.5, 3));
    assert_eq!(
        (network.reference.epsilon, network.reference.norm, network.reference.gamma),
        (Some(0.02), Norm::Inf, 1e-6)
    );
    let [left, right] = &network.subsystems[..] else { panic!("two subsystems") };
    assert_eq!((&*left.name, &*right.name), ("left", "right"));
    assert_eq!(left.A, dmatrix![0.9921, 0.0; 0.0, 0.9835]);
    assert_eq!(right.B, dmatrix![0.0311; 0.0235]);
    assert_eq!(left.E, dmatrix![1.0; 0.0]);
    assert_eq!((&left.Cz, &left.Dz), (&dmatrix![0.0, 0.0165], &dmatrix![1.30e-4]));
    assert_eq!((&right.Cz, &right.Dz), (&dmatrix![0.0, 0.0206], &dmatrix![2.47e-4]));
    assert_eq!(left.L, BTreeMap::from([(1, dmatrix![1.0])]));
    assert_eq!(right.L, BTreeMap::from([(0, dmatrix![1.0])]));
    assert_eq!(left.coupling_outputs, ["0.0165 h2 + 0.00013 v1"]);
    assert_eq!(right.coupling_outputs, ["0.0206 h4 + 0.000247 v2"]);
    assert_eq!(left.X.rows, ["h1 <= 27.6 cm", "h1 >= -12.4 cm", "h2 <= 38.6 cm", "h2 >= -1.4 cm"]);
    assert_eq!(left.X.H, dmatrix![1.0, 0.0; -1.0, 0.0; 0.0, 1.0; 0.0, -1.0]);
    assert_eq!(left.X.h, dvector![27.6, 12.4, 38.6, 1.4]);
    assert_eq!(right.U.h, dvector![3.0, 3.0]);
    assert_eq!(left.gains.reference_weights.0, DMatrix::from_diagonal(&dvector![1.0, 1.0, 0.1]));
}

#[test]
fn subsystems_keep_the_order_of_the_file() {
    let names: Vec<_> = network("three_carts").subsystems.into_iter().map(|subsystem| subsystem.name).collect();
    assert_eq!(names, ["middle", "first", "last"]);
}

#[test]
fn multiples_of_a_row_share_one_coupling_output() {
    let [_, _, last] = &network("three_carts").subsystems[..] else { panic!("three subsystems") };
    // What `last` reads is -1 times what `middle` is read by `first`, and `middle` exports it once.
    let moved = &last.E * &last.L[&0] * &network("three_carts").subsystems[0].Cz;
    assert!((moved - dmatrix![0.0, 0.0; -0.1, -0.02]).amax() <= 1e-12 * 0.1);
}

/// E_i L_ij [Cz_j Dz_j] = [A_ij B_ij], with as few coupling outputs as the rank of what is exported.
#[test]
fn lowering_keeps_every_block_with_the_fewest_outputs() {
    let mut random = Random(1);
    for rank in (1..=3).cycle().take(300) {
        let (to, from) = ((1 + random.below(4), 1 + random.below(3)), (1 + random.below(4), 1 + random.below(3)));
        let A = random.matrix(to.0, rank) * random.matrix(rank, from.0);
        let B = A.clone() * random.matrix(from.0, from.1);
        let network = accept(pair(&A, &B, to, from));
        let [receiver, sender] = &network.subsystems[..] else { panic!("two subsystems") };
        let blocks = stacked(&A, &B);
        assert_eq!(sender.nz(), blocks.rank(1e-9 * (1.0 + blocks.amax())), "{blocks}");
        assert_eq!((receiver.nz(), sender.L.len(), receiver.L.len()), (0, 0, usize::from(blocks.amax() > 0.0)));
        if let Some(L) = receiver.L.get(&1) {
            let again = &receiver.E * L * stacked(&sender.Cz, &sender.Dz);
            let wrong =
                blocks.row_iter().zip(again.row_iter()).find(|(one, two)| (one - two).amax() > 1e-12 * one.amax());
            assert!(wrong.is_none(), "{blocks}{again}");
        }
    }
}

/// Two subsystems of the given numbers of states and inputs; the second acts on the first by A and B.
fn pair(A: &DMatrix<f64>, B: &DMatrix<f64>, to: (usize, usize), from: (usize, usize)) -> Source {
    let one = |name: &str, (n, m): (usize, usize)| {
        let names = |letter: &str, k: usize| (0..k).map(|k| format!("{letter}{k}")).collect::<Vec<_>>();
        let C = rows(&DMatrix::identity(1, n));
        let (A, B) = (rows(&(DMatrix::identity(n, n) * 0.5)), rows(&DMatrix::from_element(n, m, 1.0)));
        let (states, inputs) = (names("x", n), names("u", m));
        format!(
            "[subsystem.{name}]\nstates = {states:?}\ninputs = {inputs:?}\noutputs = [\"x0\"]\nA = {A}\nB = {B}\nC = {C}\n"
        )
    };
    let head = "name = \"pair\"\nsample-time = 1\nhorizon = 1\n";
    let coupling = format!("[subsystem.to.from.from]\nA = {}\nB = {}\n", rows(A), rows(B));
    Source { path: "pair.toml".into(), text: [head, &one("to", to), &one("from", from), &coupling].concat() }
}

fn rows(matrix: &DMatrix<f64>) -> String {
    let rows: Vec<Vec<f64>> = matrix.row_iter().map(|row| row.iter().copied().collect()).collect();
    format!("{rows:?}")
}

/// [left right].
fn stacked(left: &DMatrix<f64>, right: &DMatrix<f64>) -> DMatrix<f64> {
    DMatrix::from_columns(&left.column_iter().chain(right.column_iter()).collect::<Vec<_>>())
}

#[test]
fn a_block_of_zeros_makes_no_neighbour() {
    let zeros = |rows, columns| DMatrix::zeros(rows, columns);
    let network = accept(pair(&zeros(2, 3), &zeros(2, 1), (2, 1), (3, 1)));
    let [to, from] = &network.subsystems[..] else { panic!("two subsystems") };
    assert_eq!((to.L.len(), to.E.shape(), from.nz(), from.Dz.shape()), (0, (2, 0), 0, (0, 1)));
}

#[test]
fn bounds_that_are_absent_or_infinite_make_no_row() {
    let network = network("three_carts");
    let middle = &network.subsystems[0];
    assert_eq!(middle.X.rows, ["p <= 1.5 m", "p >= -1 m", "p + 2 v <= 4"]);
    assert_eq!(middle.X.H, dmatrix![1.0, 0.0; -1.0, 0.0; 1.0, 2.0]);
    assert_eq!(middle.U.rows, ["f >= -2 N", "b >= -2 N", "f + b <= 3"]);
    assert_eq!((network.subsystems[1].X.H.shape(), network.subsystems[1].X.rows.len()), ((0, 2), 0));
}

#[test]
fn weights_gains_and_wishes_arrive() {
    let network = network("three_carts");
    let [middle, first, _] = &network.subsystems[..] else { panic!("three subsystems") };
    assert_eq!(middle.Q, dmatrix![10.0, 0.0; 0.0, 1.0]);
    assert_eq!(middle.R, dmatrix![1.0, 0.1; 0.1, 2.0]);
    assert_eq!(middle.T, dmatrix![4.0]);
    assert_eq!(middle.gains.calK, Some(dmatrix![-4.0, -4.0, 0.2; 1.0, 1.0, 0.0]));
    assert_eq!(middle.gains.weights, (middle.Q.clone(), middle.R.clone()));
    assert_eq!(middle.cover, [Some((-0.1, 0.15))]);
    assert_eq!(middle.reserve, [0.0001, 0.0001]);
    assert_eq!((&middle.y_weights[..], &first.y_weights[..]), (&[3.0][..], &[1.0][..]));
    assert_eq!(first.gains.weights, (dmatrix![2.0, 0.0; 0.0, 2.0], dmatrix![0.5]));
    assert_eq!(first.gains.reference_weights, (DMatrix::from_diagonal(&dvector![1.0, 2.0, 0.3]), dmatrix![0.25]));
    assert_eq!(first.reserve, [0.0002, 0.0]);
    assert_eq!((network.wishes.y_weight, network.wishes.terminal_weight, network.wishes.symmetric), (2.0, 0.01, true));
    assert_eq!(network.reference.norm, Norm::Two);
}

/// (4): H_h^[j] y_j = H_h^[j]z z_j.
#[test]
fn outputs_in_coupling_constraints_are_coupling_outputs() {
    let network = network("three_carts");
    let [distance, second] = &network.coupling_constraints[..] else { panic!("two constraints") };
    assert_eq!((&*distance.name, distance.l), ("distance", 0.5));
    assert_eq!(second.H, BTreeMap::from([(0, dvector![2.0]), (2, dvector![-2.0])]));
    network.coupling_constraints.iter().for_each(|constraint| assert_exported(&network, constraint));
}

/// In the order of the network whatever the order of the file, each with the smallest margin that is stated.
#[test]
fn outputs_in_changing_constraints_are_coupling_outputs() {
    let network = network("planar_vehicles");
    let members = network.changing_constraints.iter().map(|c| (&*c.name, c.members.clone()));
    assert_eq!(members.collect::<Vec<_>>(), [("apart", vec![0, 1]), ("carrier", vec![0])]);
    let [carrier, drone, carriage] = &network.subsystems[..] else { panic!("three subsystems") };
    let outputs = |s: &Subsystem| -> Vec<_> {
        s.exposed.iter().flat_map(|e| &e.outputs).map(|output| (output.z, output.factor)).collect()
    };
    assert_eq!((outputs(carrier), outputs(drone)), (vec![(1, 1.0), (0, 0.5)], vec![(1, 1.0), (0, 1.0)]));
    assert_eq!((carrier.nz(), drone.nz(), carriage.exposed.is_none()), (2, 2, true));
    assert_eq!([carrier, drone].map(|s| s.margin().map(|margin| margin.value)), [Some(2.5), Some(3.0)]);
}

fn assert_exported(network: &Network, constraint: &CouplingConstraint) {
    assert_eq!(constraint.H.keys().collect::<Vec<_>>(), constraint.Hz.keys().collect::<Vec<_>>());
    for (j, H) in &constraint.H {
        let (subsystem, Hz) = (&network.subsystems[*j], &constraint.Hz[j]);
        assert_eq!(H.transpose() * &subsystem.C, Hz.transpose() * &subsystem.Cz);
        assert_eq!(Hz.transpose() * &subsystem.Dz, DVector::zeros(subsystem.m()).transpose());
    }
}

/// Every number and name of the file, without its places.
fn summary(network: &Network) -> String {
    let Network { name, sample_time, horizon, reference, wishes, .. } = network;
    format!("{name} {sample_time} {horizon} {reference:?} {wishes:?} {:?}", network.coupling_constraints)
}

fn assert_same(one: &Subsystem, other: &Subsystem) {
    let names = |s: &Subsystem| (s.name.clone(), s.states.clone(), s.inputs.clone(), s.outputs.clone());
    assert_eq!(names(one), names(other));
    assert_eq!((&one.A, &one.B, &one.C, &one.E, &one.L), (&other.A, &other.B, &other.C, &other.E, &other.L));
    assert_eq!((&one.Cz, &one.Dz, &one.coupling_outputs), (&other.Cz, &other.Dz, &other.coupling_outputs));
    assert_eq!((&one.X.H, &one.X.h, &one.X.rows), (&other.X.H, &other.X.h, &other.X.rows));
    assert_eq!((&one.U.H, &one.U.h, &one.U.rows), (&other.U.H, &other.U.h, &other.U.rows));
    assert_eq!((&one.Q, &one.R, &one.T), (&other.Q, &other.R, &other.T));
    assert_eq!(format!("{:?} {:?}", one.gains, one.cover), format!("{:?} {:?}", other.gains, other.cover));
    assert_eq!(one.reserve, other.reserve);
}
