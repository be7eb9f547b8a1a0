//! What keeps the ends of Y_i where they are.

use super::Sizing;
use crate::network::Network;
use crate::sets::{ReferenceShare, Sets};

/// The row of (25b), of any subsystem, that the set-points meet first when one end of Y_i moves on by itself.
///
/// The program weighs ends, reserves and epsilon against each other, so another design may well be limited elsewhere; of the
/// design as it is, this is what is in the way.
#[derive(Debug, Clone, PartialEq)]
pub struct EndLimit {
    /// In the user's names: `` `v1 <= 3 V` of `left` ``.
    pub row: String,
    /// How far the end could move before that, in units of the output; 0 up to rounding where the row is tight.
    pub room: f64,
}

/// Both ends of one output's range.
#[derive(Debug, Clone, PartialEq)]
pub struct EndLimits {
    pub low: EndLimit,
    pub high: EndLimit,
}

/// Per subsystem and output.
pub fn end_limits(network: &Network, sets: &Sets, sizing: &Sizing) -> Vec<Vec<EndLimits>> {
    let mut ends = caps(network, sets, sizing);
    for ((share, slack), row) in rows(network, sets, sizing) {
        for &(y, gain) in &share.steady {
            let end = if gain > 0.0 { &mut ends[y].high } else { &mut ends[y].low };
            let room = slack / gain.abs();
            if room < end.room {
                *end = EndLimit { row: row.clone(), room };
            }
        }
    }
    if network.wishes.symmetric {
        ends.iter_mut().for_each(pool);
    }
    let mut ends = ends.into_iter();
    network.subsystems.iter().map(|s| ends.by_ref().take(s.p()).collect()).collect()
}

/// Rows over the references with the slack of (25b) and their names, in the order in which the slacks were recorded.
fn rows<'a>(
    network: &'a Network,
    sets: &'a Sets,
    sizing: &'a Sizing,
) -> impl Iterator<Item = ((&'a ReferenceShare, f64), String)> {
    let slacks = sizing.slacks.iter().filter(|slack| slack.equation == "(25b)").map(|slack| slack.value);
    let parts = network.subsystems.iter().zip(&sets.subsystems);
    let rows = parts.flat_map(|(s, sets)| {
        let names = s.X.rows.iter().chain(&s.U.rows).map(|row| format!("`{row}` of `{}`", s.name));
        sets.x_rows.iter().chain(&sets.u_rows).zip(names)
    });
    rows.zip(slacks).map(|((share, name), slack)| ((share, slack), name))
}

/// No end goes farther than the output can be where its states keep their bounds.
fn caps(network: &Network, sets: &Sets, sizing: &Sizing) -> Vec<EndLimits> {
    let parts = network.subsystems.iter().zip(&sets.subsystems).zip(&sizing.subsystems);
    let of = parts.flat_map(|((s, sets), sized)| {
        (0..s.p()).map(move |k| {
            let row = format!("the range of `{}` in x of `{}`", s.outputs[k].name, s.name);
            let end = |reached: f64| EndLimit { row: row.clone(), room: sets.scales.y_cap[k] - reached };
            EndLimits { low: end(-sized.Y.min[k]), high: end(sized.Y.max[k]) }
        })
    });
    of.collect()
}

/// Ends that move together stop together.
fn pool(ends: &mut EndLimits) {
    let nearer = if ends.low.room < ends.high.room { &ends.low } else { &ends.high };
    *ends = EndLimits { low: nearer.clone(), high: nearer.clone() };
}
