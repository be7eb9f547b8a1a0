//! What a design is worth a second look for: nothing is wrong, but it is probably not what was meant.
#![expect(non_snake_case, reason = "the paper's symbols")]

use std::f64::consts::PI;

use crate::design::Design;
use crate::gains::{GainChoice, Layer};
use crate::network::{Hold, HoldError};
use crate::sets::CAP;
use crate::summary::short;

/// Less of the room that its bounds leave an output than this is conspicuous.
const LITTLE: f64 = 0.05;
/// More steps than this from one end of Y_i to the other are conspicuous.
const MANY_STEPS: f64 = 5000.0;
/// So many times epsilon charged for references that move is conspicuous. Less than once is not possible.
const MANY_EPSILON: f64 = 3.0;

/// A mode that decays by so many time constants within a period, to 1 %, is conspicuous.
const DIED_OUT: f64 = 4.6;

/// One sentence each: what is asked for in vain first, then in the order of the file.
pub fn notices(design: &Design) -> Vec<String> {
    let subsystems = 0..design.network.subsystems.len();
    let outputs =
        subsystems.flat_map(|i| (0..design.network.subsystems[i].p()).filter_map(move |k| output(design, i, k)));
    let limits = design.network.coupling_constraints.iter().zip(&design.sizing.l_tilde);
    let constraints = limits.filter(|(c, l_tilde)| **l_tilde < 0.5 * c.l).map(|(c, l_tilde)| {
        format!(
            "references keep `{}` below {} of its {}; the rest covers what the tubes and moving references do",
            c.name,
            short(*l_tilde),
            short(c.l)
        )
    });
    let constraints = constraints.chain(uncovered(design));
    let exposed = (0..design.network.subsystems.len()).flat_map(|i| charges(design, i));
    in_vain(design).into_iter().chain(held(design)).chain(outputs).chain(constraints).chain(exposed).collect()
}

/// Coupling constraints that set-points to cover break together.
fn uncovered(design: &Design) -> impl Iterator<Item = String> {
    let subsystems = &design.network.subsystems;
    let limits = design.network.coupling_constraints.iter().zip(&design.sizing.l_tilde);
    limits.filter_map(move |(c, l_tilde)| {
        let rows = c.H.iter().flat_map(|(j, H)| H.iter().zip(&subsystems[*j].cover));
        let most: f64 = rows.map(|(h, cover)| cover.map_or(0.0, |(low, high)| (h * low).max(h * high))).sum();
        (most > *l_tilde).then(|| {
            format!(
                "set-points inside `cover` add up to {} in `{}`, of which references keep {}: not all of them can be reached at once",
                short(most),
                c.name,
                short(*l_tilde)
            )
        })
    })
}

/// Outputs in changing constraints that are charged many times what references move.
fn charges(design: &Design, i: usize) -> impl Iterator<Item = String> {
    let (s, epsilon) = (&design.network.subsystems[i], design.sizing.epsilon);
    let shares = s.outputs.iter().zip(&design.sets.subsystems[i].outputs.axes);
    shares.filter(move |(_, share)| share.taken(epsilon) > MANY_EPSILON * epsilon).map(move |(output, share)| {
        format!(
            "a changing row is charged {} times epsilon for moving references of {} of `{}`; reference gains whose outputs stay closer to yref (see `reference-weights`, effort) charge less",
            short(share.taken(epsilon) / epsilon),
            output.name,
            s.name
        )
    })
}

/// What sampling makes of a model in continuous time.
fn held(design: &Design) -> Vec<String> {
    let network = &design.network;
    let Some(hold) = &network.hold else { return Vec::new() };
    let h = network.sample_time;
    let modes = network.subsystems.iter().zip(&hold.fastest).filter_map(|(s, fastest)| {
        if fastest.turn * h > PI {
            let period = short(2.0 * PI / fastest.turn);
            Some(format!("`{}` oscillates within {period} s, less than two samples; sample faster", s.name))
        } else if fastest.decay * h > DIED_OUT {
            let time = short(1.0 / fastest.decay);
            Some(format!("a mode of `{}` (time constant {time} s) dies out between samples; sample faster, or put its steady state in its place", s.name))
        } else {
            None
        }
    });
    modes.chain(uncharged(hold)).collect()
}

/// Errors that the design knows nothing of.
fn uncharged(hold: &Hold) -> Option<String> {
    let all = hold.errors.as_ref()?.iter().flatten();
    let counts = all.clone().any(|error| !matches!(error, HoldError::Within { below: 0.0, above: 0.0 }));
    let mut unbounded: Vec<&String> = all
        .filter_map(|error| match error {
            HoldError::Unbounded(signals) => Some(signals),
            HoldError::Within { .. } => None,
        })
        .flatten()
        .collect();
    unbounded.sort();
    unbounded.dedup();
    let named: Vec<&str> = unbounded.iter().take(6).map(|signal| signal.as_str()).collect();
    let more = if unbounded.len() > named.len() { ", .." } else { "" };
    match (hold.charged, counts, named.is_empty()) {
        (true, ..) | (_, false, _) => None,
        (false, true, true) => Some("the guarantee is for the model with held coupling; hold-error = \"disturbance\" extends it to the exact discretisation".to_owned()),
        (false, true, false) => Some(format!("the guarantee is for the model with held coupling, and its error has no bound: {}{more} have none", named.join(", "))),
    }
}

/// What says how to choose gains, where the file leaves none to be chosen.
fn in_vain(design: &Design) -> Vec<String> {
    let network = &design.network;
    if Layer::Local.is_open(network) || Layer::Reference.is_open(network) || design.tuning.is_some() {
        return Vec::new();
    }
    let effort = (network.effort.budget() > 0).then(|| format!("effort {}", network.effort.level()));
    let choice = match network.gains {
        GainChoice::Auto => None,
        GainChoice::Lqr => Some("gains = \"lqr\""),
        GainChoice::Lmi => Some("gains = \"lmi\""),
    };
    let says = |what: String| format!("{what} changes nothing: the file states all gains itself (K, Kx and Ke)");
    effort.into_iter().chain(choice.map(|choice| format!("`{choice}`"))).map(says).collect()
}

/// The first thing that is conspicuous about output k of subsystem i.
fn output(design: &Design, i: usize, k: usize) -> Option<String> {
    let (s, Y) = (&design.network.subsystems[i], &design.sizing.subsystems[i].Y);
    let name = format!("{} of `{}`", s.outputs[k].name, s.name);
    let (min, max, natural) = (Y.min[k], Y.max[k], design.sets.subsystems[i].scales.y[k]);
    let width = max - min;
    let steps = width / design.sizing.epsilon;
    if max.max(-min) > 0.99 * CAP * natural {
        Some(format!("nothing limits {name}: its set-points end at {CAP:e} times its natural size; bound x or u"))
    } else if min == 0.0 || max == 0.0 {
        let side = if min == 0.0 { "above" } else { "below" };
        Some(format!("set-points of {name} lie {side} 0 only; `symmetric = true` or `cover` asks for both sides"))
    } else if width < LITTLE * natural {
        let share = short(100.0 * width / (2.0 * natural));
        Some(format!("set-points of {name} use {share} % of its bounds; check units, sample time and input limits"))
    } else if steps > MANY_STEPS {
        let time = short(steps * design.network.sample_time);
        Some(format!(
            "{name} needs {} steps ({time} s) to cross its set-points; `epsilon-weight` makes it faster",
            short(steps)
        ))
    } else {
        None
    }
}
