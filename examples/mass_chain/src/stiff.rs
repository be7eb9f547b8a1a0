//! What stiff coupling does to gains: the chain of ten with plain Riccati gains, a matrix inequality, a search, and weights.
#![expect(non_snake_case, reason = "the paper's symbols")]

use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::{Diagnostics, Source};
use dpc_codegen::gains::SubsystemGains;
use dpc_codegen::network::Network;
use dpc_codegen::sets::small_gain_matrix;
use dpc_codegen::spec::Spec;
use dpc_codegen::tuning::Effort;
use example_kit::table::table;

use crate::chain::{EMITTED, Gains, text};

/// One way to gains, and what came of it.
#[derive(Debug, Clone)]
pub struct Way {
    pub name: &'static str,
    /// Spectral radius of S of Assumption 4.
    pub small_gain: f64,
    /// Spectral radius of calF, the smallest range of set-points in m, and epsilon in m per step; or why there is no design.
    pub design: Result<[f64; 3], String>,
}

/// All ways; a search where `effort` is 1 to 3.
///
/// # Errors
/// The network itself has mistakes.
pub fn ways(effort: u8) -> Result<Vec<Way>, Diagnostics> {
    let plain = Effort::default();
    let mut ways =
        vec![way("Riccati, weights 1", Gains::Lqr, plain)?, way("auto: matrix inequality", Gains::Auto, plain)?];
    if let Some(searched) = Effort::new(effort).filter(|effort| *effort != plain) {
        ways.push(way("auto, then a search", Gains::Auto, searched)?);
    }
    ways.push(way("Riccati, stiffer weights", Gains::Weighted, plain)?);
    Ok(ways)
}

fn way(name: &'static str, gains: Gains, effort: Effort) -> Result<Way, Diagnostics> {
    let source = source(EMITTED, gains);
    match Design::with_effort(source.clone(), effort) {
        Ok(design) => {
            let range = |s: &dpc_codegen::sizing::SubsystemSizing| s.Y.max[0] - s.Y.min[0];
            let narrowest = design.sizing.subsystems.iter().map(range).fold(f64::INFINITY, f64::min);
            let figures = [design.gains.rho_calF, narrowest, design.sizing.epsilon];
            Ok(Way { name, small_gain: design.sets.rho_small_gain, design: Ok(figures) })
        }
        Err(mistakes) => {
            let why = mistakes.0.first().map_or_else(String::new, |error| format!("{}: {}", error.code, error.title));
            Ok(Way { name, small_gain: riccati_small_gain(source)?, design: Err(why) })
        }
    }
}

/// Of the gains that the file's weights give, whether or not it is small enough.
fn riccati_small_gain(source: Source) -> Result<f64, Diagnostics> {
    let network = Network::new(&Spec::parse(&source)?, source)?;
    let gains: Result<Vec<_>, _> = network.subsystems.iter().map(SubsystemGains::new).collect();
    Ok(gains.map_or(f64::NAN, |gains| small_gain_matrix(&network, &gains).1))
}

/// The file of a chain.
pub fn source(length: usize, gains: Gains) -> Source {
    Source { path: format!("chain_{length}.toml"), text: text(length, gains) }
}

/// As a table.
pub fn shown(ways: &[Way]) -> String {
    let head = ["gains of the chain of ten", "small gain", "rho(calF)", "narrowest Y", "epsilon"].map(str::to_owned);
    let row = |way: &Way| {
        let figures = match &way.design {
            Ok([calF, range, epsilon]) => {
                vec![format!("{calF:.4}"), format!("{:.1} mm", 1e3 * range), format!("{:.3} mm", 1e3 * epsilon)]
            }
            Err(_) => vec!["refused".to_owned(), "-".to_owned(), "-".to_owned()],
        };
        [way.name.to_owned(), format!("{:.4}", way.small_gain)].into_iter().chain(figures).collect::<Vec<_>>()
    };
    let mut text = table(&head, &ways.iter().map(row).collect::<Vec<_>>());
    for way in ways {
        if let Err(why) = &way.design {
            text += &format!("{} is refused, {why}\n", way.name);
        }
    }
    text
}
