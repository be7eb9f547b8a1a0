//! How much of the benchmark's loads a design exists for.

use dpc_codegen::diagnostic::{Diagnostics, Source};
use dpc_codegen::gains::Settled;
use dpc_codegen::network::Network;
use dpc_codegen::sizing::Sizing;
use dpc_codegen::spec::Spec;
use example_kit::table::table;

use crate::files::{BENCHMARK_HORIZON, Design, Known, Plant};

/// Halvings of an interval of length 4: to 0.001.
const HALVINGS: u32 = 12;
const MOST: f64 = 4.0;

/// The largest share of the benchmark's loads, to 0.001, for which `design` exists with its gains and this horizon, loads jumping
/// over their whole range from one step to the next; `None`: it does not exist without loads either.
pub fn largest(design: Design, horizon: usize) -> Option<f64> {
    bisect(|share| exists(&design.scaled(share, 1.0, horizon)))
}

/// The largest share of what the design's model leaves out of the exact plant, to 0.001, for which it exists without loads.
pub fn largest_error(design: Design, horizon: usize) -> Option<f64> {
    bisect(|error| exists(&design.scaled(0.0, error, horizon)))
}

/// The largest value that is `possible`; smaller ones are.
fn bisect(possible: impl Fn(f64) -> bool) -> Option<f64> {
    let (mut inside, mut outside) = (0.0, MOST);
    if !possible(inside) {
        return None;
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (inside + outside);
        if possible(middle) { inside = middle } else { outside = middle }
    }
    Some(inside)
}

/// Whether sets of positive size exist for the file; the on-line problems follow from these.
fn exists(text: &str) -> bool {
    sized(Source { path: "share.toml".to_owned(), text: text.to_owned() }).is_ok()
}

fn sized(source: Source) -> Result<Sizing, Diagnostics> {
    let network = Network::new(&Spec::parse(&source)?, source)?;
    let settled = Settled::new(network)?;
    Sizing::new(&settled.network, &settled.gains, &settled.sets)
}

/// The largest shares of all designs, at their own horizon and at the benchmark's, and of the model errors.
pub fn shares() -> String {
    let head = ["largest share with a design", "N", "of the loads"].map(str::to_owned);
    let line = |design: Design, horizon: usize| {
        vec![design.to_string(), horizon.to_string(), percent(largest(design, horizon))]
    };
    let rows = Design::ALL.iter().flat_map(|design| [(*design, design.horizon()), (*design, BENCHMARK_HORIZON)]);
    let loads = table(&head, &rows.map(|(design, horizon)| line(design, horizon)).collect::<Vec<_>>());
    let head = ["largest share with a design", "of what the model leaves out, without loads"].map(str::to_owned);
    let plants = [Plant::ExactByAngles, Plant::Exact].map(|plant| Design { plant, loads: Known::Measured });
    let line = |design: Design| vec![design.to_string(), percent(largest_error(design, design.horizon()))];
    format!("{loads}\n{}", table(&head, &plants.map(line)))
}

fn percent(share: Option<f64>) -> String {
    share.map_or("none".to_owned(), |share| format!("{:.1} %", 100.0 * share))
}
