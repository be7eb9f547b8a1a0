//! Gains of one layer by the matrix inequality of [`crate::optim::lmi`].

use nalgebra::DMatrix;

use super::interconnection::{Layer, interconnection};
use super::short;
use crate::network::Network;
use crate::optim::lmi::{Interconnection, Search};

/// Where the decay rates on offer lie between 1 (0) and the fastest (1).
const SHARES: [f64; 6] = [0.01, 0.1, 0.3, 0.5, 0.7, 0.9];

/// Shows `taken` gains of one layer for several decay rates, slowest and cheapest first, until it has enough (false). Each is
/// proved for the rounded numbers and has one gain per subsystem, the given ones as given.
///
/// # Errors
/// The fastest rate the inequality has a solution for, where it is not below 1, or `None` where the solver finds nothing at all.
pub fn offer(
    network: &Network,
    layer: Layer,
    mut taken: impl FnMut(Vec<DMatrix<f64>>) -> bool,
) -> Result<(), Option<f64>> {
    let (plant, prices) = interconnection(network, layer);
    let search = Search::new(&plant, &prices).ok_or(None)?;
    let fastest = search.fastest().ok_or(None)?;
    if fastest >= 1.0 {
        return Err(Some(fastest));
    }
    let rates = SHARES.map(|share| 1.0 - share * (1.0 - fastest));
    let mut proved = rates.iter().filter_map(|&rate| proved(network, layer, &plant, &search, rate));
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
