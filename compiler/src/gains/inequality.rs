//! Gains of one layer by the matrix inequality of [`crate::optim::lmi`].

use nalgebra::DMatrix;

use super::interconnection::{Layer, interconnection};
use super::short;
use crate::network::Network;
use crate::optim::lmi::{Fastest, Interconnection, Search};

/// Where the decay rates on offer lie between 1 (0) and the fastest (1).
const SHARES: [f64; 6] = [0.01, 0.1, 0.3, 0.5, 0.7, 0.9];

/// Why the inequality gives no gains.
pub enum Nothing {
    /// Every solution grows by this per step.
    Grows(f64),
    /// No solution decays faster than this, which is as slow as is looked for.
    Slow(f64),
    /// The solver finds nothing at all.
    Unsolved,
    /// There are solutions of this rate, but none came out that [`Interconnection::shrinks`] confirms.
    Unproved(f64),
}

/// Shows `taken` gains of one layer for several decay rates, slowest and cheapest first, until it has enough (false). Each is
/// proved for the rounded numbers and has one gain per subsystem, the given ones as given.
///
/// # Errors
/// Why there are none.
pub fn offer(network: &Network, layer: Layer, mut taken: impl FnMut(Vec<DMatrix<f64>>) -> bool) -> Result<(), Nothing> {
    let (plant, prices) = interconnection(network, layer);
    let search = Search::new(&plant, &prices).ok_or(Nothing::Unsolved)?;
    let fastest = match search.fastest() {
        Some(Fastest::Decays(rate)) => rate,
        Some(Fastest::Grows(rate)) => return Err(Nothing::Grows(rate)),
        Some(Fastest::Slow(rate)) => return Err(Nothing::Slow(rate)),
        None => return Err(Nothing::Unsolved),
    };
    let rates = SHARES.map(|share| 1.0 - share * (1.0 - fastest));
    let mut proved = rates.iter().filter_map(|&rate| proved(network, layer, &plant, &search, rate)).peekable();
    if proved.peek().is_none() {
        return Err(Nothing::Unproved(fastest));
    }
    while proved.next().is_some_and(&mut taken) {}
    Ok(())
}

/// Gains for one rate, rounded like all gains, if the inequality still holds with them.
fn proved(
    network: &Network,
    layer: Layer,
    plant: &Interconnection,
    search: &Search<'_>,
    rate: f64,
) -> Option<Vec<DMatrix<f64>>> {
    let found = search.gains(rate)?;
    let open: Vec<_> = found.K.into_iter().map(short).collect();
    // Rounding takes something of the rate; what has to be left is a decay.
    if !plant.shrinks(&open, &found.S, 0.5 * (1.0 + rate)) {
        return None;
    }
    let given = network.subsystems.iter().map(|s| layer.given(s).cloned());
    Some(given.zip(open).map(|(given, open)| given.unwrap_or(open)).collect())
}
