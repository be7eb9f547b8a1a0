//! Does every file end in a design or in mistakes with their places, whatever is wrong with it?

use dpc_tests::mutations::{Mutations, extremes};
use dpc_tests::refusal::{Tally, outcome};
use dpc_tests::{cases_wanted, networks};

#[test]
fn mutated_networks_are_designed_or_refused_with_a_place() {
    let texts = networks().into_iter().map(|source| source.text).collect();
    let mut mutations = Mutations::new(1, texts);
    let mut tally = Tally::default();
    for k in 0..cases_wanted(600) {
        let mutant = mutations.draw();
        tally.add(format!("file {k} ({})", mutant.kind), outcome(&mutant));
    }
    println!("{tally}");
    assert!(tally.failed.is_empty(), "{:#?}", tally.failed);
    // Mutations must reach past the reader, and some must leave a network.
    assert!(20 * tally.designed >= tally.files && tally.codes.len() >= 20, "{tally}");
}

#[test]
fn files_beyond_all_measure_are_refused_with_a_place() {
    let four_tank = dpc_tests::read("../examples/four_tank/system.toml".as_ref());
    let mut tally = Tally::default();
    for mutant in extremes(&four_tank.text) {
        tally.add(mutant.kind.to_owned(), outcome(&mutant));
    }
    println!("{tally}");
    assert!(tally.failed.is_empty(), "{:#?}", tally.failed);
    assert!(tally.refused > tally.designed, "{tally}");
}
