//! Which gains: local Riccati equations, the matrix inequality, or the first that works.

use nalgebra::DMatrix;

use super::inequality::{Nothing, offer};
use super::interconnection::Layer;
use super::pairing::wrong_pairs;
use super::{Collective, Gains, K_i, PAIR_AGAIN, is_wrongly_paired, reference_states};
use crate::diagnostic::{Diagnostic, Diagnostics, code};
use crate::network::{FoundBy, FoundGain, Network, Subsystem};
use crate::optim::lyapunov::spectral_radius;
use crate::sets::{Sets, assembled, small_gain_with, worst_reference_share};
use crate::tuning::Watch;

/// `gains` of the file, for subsystems that state no gains themselves.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum GainChoice {
    /// Local Riccati equations; for a layer of gains that they fail, the matrix inequality.
    #[default]
    Auto,
    /// Local Riccati equations.
    Lqr,
    /// The matrix inequality of [`crate::optim::lmi`].
    Lmi,
}

/// A network whose gains are chosen, with the stages that prove them.
#[derive(Debug)]
pub struct Settled {
    /// With the gains of the matrix inequality where it was used.
    pub network: Network,
    pub gains: Gains,
    pub sets: Sets,
}

impl Settled {
    /// Chooses the gains as the file asks for.
    ///
    /// Of the gains that the inequality offers for the K_i, the cheapest with a small-gain radius of at most one half are
    /// taken, else those with the smallest radius; for the calK_i those that leave the references most room in X_i and U_i.
    ///
    /// # Errors
    /// Those of [`Gains::new`] and [`Sets::new`] for the gains tried first, with what the matrix inequality has to say.
    pub fn new(network: Network) -> Result<Self, Diagnostics> {
        Self::watched(network, &mut ())
    }

    /// [`Settled::new`]; `watch` hears when gains or sets have been made.
    ///
    /// # Errors
    /// As [`Settled::new`].
    pub fn watched(network: Network, watch: &mut dyn Watch) -> Result<Self, Diagnostics> {
        match network.gains {
            GainChoice::Lqr => {
                let tried = network.clone();
                Self::with(network, watch).map_err(|errors| offered(&tried, errors))
            }
            GainChoice::Lmi => Self::by_inequality(network, watch),
            GainChoice::Auto => Self::by_need(network, watch),
        }
    }

    /// With the gains that stand in the network, and Riccati equations for the others.
    ///
    /// # Errors
    /// Those of [`Gains::new`] and [`Sets::new`].
    pub fn with(network: Network, watch: &mut dyn Watch) -> Result<Self, Diagnostics> {
        let (gains, sets) = attempt(&network, watch)?;
        Ok(Self { network, gains, sets })
    }

    /// With the gains of the inequality in both layers, where the file leaves them open.
    ///
    /// # Errors
    /// As [`Settled::new`].
    pub fn by_inequality(mut network: Network, watch: &mut dyn Watch) -> Result<Self, Diagnostics> {
        for layer in [Layer::Local, Layer::Reference] {
            if layer.is_open(&network) {
                network = improved(&network, layer).map_err(|shortfall| refused(&network, &shortfall))?;
            }
        }
        watch.stage("Gains");
        Self::with(network, watch)
    }

    fn by_need(mut network: Network, watch: &mut dyn Watch) -> Result<Self, Diagnostics> {
        let mut tried = Vec::new();
        loop {
            let errors = match attempt(&network, watch) {
                Ok((gains, sets)) => return Ok(Self { network, gains, sets }),
                Err(errors) => errors,
            };
            let layer = blamed(&errors).filter(|layer| !tried.contains(layer) && layer.is_open(&network));
            let Some(layer) = layer else { return Err(errors) };
            tried.push(layer);
            network = match improved(&network, layer) {
                Ok(better) => better,
                Err(shortfall) => return Err(noted(errors, &shortfall)),
            };
        }
    }
}

fn attempt(network: &Network, watch: &mut dyn Watch) -> Result<(Gains, Sets), Diagnostics> {
    let gains = Gains::new(network);
    watch.stage("Gains");
    let gains = gains?;
    let sets = Sets::new(network, &gains);
    watch.stage("Sets");
    Ok((gains, sets?))
}

/// The layer whose gains other gains could repair; no gains repair what is not listed.
fn blamed(Diagnostics(errors): &Diagnostics) -> Option<Layer> {
    match errors.first()?.code {
        code::COLLECTIVE_LOOP | code::SMALL_GAIN | code::NO_INVARIANT_SET | code::FEW_NORMALS => Some(Layer::Local),
        code::ASSUMPTION_3 | code::LARGE_REFERENCES | code::STEADY_STATE => Some(Layer::Reference),
        _ => None,
    }
}

/// Reference states of the largest network that the matrix inequality is tried for: its work grows with the fourth power or
/// more.
const MOST_STATES: usize = 120;

/// Why the inequality does not help.
struct Shortfall {
    /// As a sentence.
    note: String,
    /// Whether the layer's first assumption fails, or what the sets ask of the K_i.
    code: &'static str,
}

impl Shortfall {
    /// There are no gains for the first assumption of a layer.
    fn of(layer: Layer, note: String) -> Self {
        let code = match layer {
            Layer::Local => code::COLLECTIVE_LOOP,
            Layer::Reference => code::ASSUMPTION_3,
        };
        Self { note, code }
    }
}

/// `network` with gains of the inequality in one layer.
fn improved(network: &Network, layer: Layer) -> Result<Network, Shortfall> {
    let size = reference_states(network);
    if size > MOST_STATES {
        let size = format!("this network has {size} reference states, it is tried up to {MOST_STATES}");
        let note = format!("the matrix inequality over all subsystems is a dense problem: {size}");
        return Err(Shortfall::of(layer, note));
    }
    match layer {
        Layer::Local => quietest(network),
        Layer::Reference => roomiest(network),
    }
}

fn with_gains(network: &Network, layer: Layer, gains: &[DMatrix<f64>]) -> Network {
    let mut network = network.clone();
    for (s, gain) in network.subsystems.iter_mut().zip(gains) {
        layer.put(s, Some(FoundGain { gain: gain.clone(), by: FoundBy::Inequality }));
    }
    network
}

/// The first whose small-gain radius is small, else the one with the smallest radius, of those with the sets that
/// Assumption 4 asks for.
fn quietest(network: &Network) -> Result<Network, Shortfall> {
    let (mut good, mut others) = (None, Vec::new());
    let judge = |gains: Vec<DMatrix<f64>>| {
        let network = with_gains(network, Layer::Local, &gains);
        match small_gain_radius(&network) {
            Some(radius) if radius <= SMALL && stands(&network) => good = Some(network),
            Some(radius) => others.push((radius, network)),
            None => {}
        }
        good.is_none()
    };
    offer(network, Layer::Local, judge).map_err(|why| no_solution(network, Layer::Local, &why))?;
    others.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let best = others.first().map(|(radius, _)| *radius);
    let standing = || others.into_iter().find(|(radius, network)| *radius < 1.0 && stands(network));
    good.or_else(|| standing().map(|(_, network)| network)).ok_or_else(|| loud(best))
}

/// `None` where some F_ii is not stable, or its sums overflow.
fn small_gain_radius(network: &Network) -> Option<f64> {
    let K = network.subsystems.iter().map(|s| K_i(s).ok()).collect::<Option<Vec<_>>>()?;
    let rows = small_gain_with(network, &K)?;
    Some(spectral_radius(&assembled(network, &rows))).filter(|radius| radius.is_finite())
}

/// Whether nothing is left to blame the K_i for.
fn stands(network: &Network) -> bool {
    attempt(network, &mut ()).map_or_else(|errors| blamed(&errors) != Some(Layer::Local), |_| true)
}

fn loud(best: Option<f64>) -> Shortfall {
    let solved = "the matrix inequality for all K_i together has solutions";
    let (note, code) = match best {
        Some(best) if best >= 1.0 => {
            (format!("{solved}, but the small-gain radius is {best:.4} with the best of them"), code::SMALL_GAIN)
        }
        Some(best) => {
            let note =
                format!("{solved} with a small-gain radius of {best:.4}, but the sets were not found for them either");
            (note, code::NO_INVARIANT_SET)
        }
        None => (format!("{solved}, but with none of them every A_ii + B_ii K_i is stable"), code::COLLECTIVE_LOOP),
    };
    Shortfall { note, code }
}

/// Small-gain radii up to here are as good as smaller ones.
const SMALL: f64 = 0.5;

/// The one that takes the smallest share of X_i and U_i for references that move.
fn roomiest(network: &Network) -> Result<Network, Shortfall> {
    let (mut best, mut judged): (Option<(f64, Network)>, Vec<Diagnostics>) = (None, Vec::new());
    let judge = |gains: Vec<DMatrix<f64>>| {
        let network = with_gains(network, Layer::Reference, &gains);
        match reference_share(&network) {
            Ok(share) if best.as_ref().is_none_or(|(least, _)| share < *least) => best = Some((share, network)),
            Ok(_) => {}
            Err(errors) => judged.push(errors),
        }
        true
    };
    offer(network, Layer::Reference, judge).map_err(|why| no_solution(network, Layer::Reference, &why))?;
    let why = || judged.first().and_then(|errors| errors.0.first()).map_or(String::new(), |error| error.title.clone());
    best.map(|(_, network)| network).ok_or_else(|| {
        let note =
            format!("the matrix inequality for all calK_i together has solutions, but no design follows: {}", why());
        Shortfall::of(Layer::Reference, note)
    })
}

fn reference_share(network: &Network) -> Result<f64, Diagnostics> {
    let gains = Gains::new(network)?;
    worst_reference_share(network, &gains)
}

/// A factor above 1.
fn growth(rate: f64) -> String {
    if rate > 1.0005 { format!("{rate:.4}") } else { format!("1 + {:.1e}", rate - 1.0) }
}

fn no_solution(network: &Network, layer: Layer, why: &Nothing) -> Shortfall {
    let gains = match layer {
        Layer::Local => "K_i",
        Layer::Reference => "calK_i",
    };
    let given: Vec<&str> =
        network.subsystems.iter().filter(|s| layer.given(s).is_some()).map(|s| s.name.as_str()).collect();
    let (all, beside) = match &given[..] {
        [] => (format!("no {gains} at all have"), String::new()),
        given => (format!("no {gains} have"), format!(" beside the stated gains of {}", given.join(", "))),
    };
    let note = match why {
        Nothing::Grows(rate) => format!(
            "{all} a block-diagonal Lyapunov matrix{beside}, as far as the solver can tell: the matrix inequality for all {gains} together needs a growth of {} per step, must be below 1",
            growth(*rate)
        ),
        Nothing::Slow(rate) => format!(
            "{all} a block-diagonal Lyapunov matrix that decays by more than {:.1e} per step{beside}, as far as the solver can tell",
            1.0 - rate
        ),
        Nothing::Unsolved => {
            format!("the matrix inequality for all {gains} together{beside} has no solution that could be computed")
        }
        Nothing::Unproved(fastest) => format!(
            "the matrix inequality for all {gains} together{beside} has solutions down to {fastest:.6} per step, but the solver found none that plain arithmetic could confirm"
        ),
    };
    Shortfall::of(layer, note)
}

/// `gains = "lqr"` where other gains might do.
fn offered(network: &Network, mut errors: Diagnostics) -> Diagnostics {
    let helps = blamed(&errors).is_some() && !is_wrongly_paired(network);
    if let Some(error) = errors.0.first_mut().filter(|_| helps) {
        error.helps.push("gains = \"auto\" goes on to a matrix inequality over all subsystems".to_owned());
    }
    errors
}

fn noted(Diagnostics(mut errors): Diagnostics, shortfall: &Shortfall) -> Diagnostics {
    if let Some(error) = errors.first_mut() {
        error.notes.push(shortfall.note.clone());
    }
    Diagnostics(errors)
}

/// `gains = "lmi"` where the inequality gives no gains that do.
fn refused(network: &Network, shortfall: &Shortfall) -> Diagnostics {
    let title = match shortfall.code {
        code::ASSUMPTION_3 => "no gains for Assumption 3 come out of the matrix inequality",
        code::COLLECTIVE_LOOP => "no gains for Assumption 1 come out of the matrix inequality",
        code::SMALL_GAIN => "no gains for Assumption 4 come out of the matrix inequality",
        _ => "no gains with invariant sets come out of the matrix inequality",
    };
    let place = network.places.gains.clone().unwrap_or_default();
    let error = Diagnostic::error(shortfall.code, title).at(place, "asked for here").note(shortfall.note.clone());
    let pairs = wrong_pairs(network, &Collective::new(network));
    let error = pairs.iter().cloned().fold(error, Diagnostic::note);
    let help = "leave `gains` out: local Riccati equations may do where the inequality does not";
    error.help(if pairs.is_empty() { help } else { PAIR_AGAIN }).into()
}

/// Where the gains of a subsystem came from, for people.
pub fn origin(subsystem: &Subsystem, layer: Layer) -> &'static str {
    match (layer.given(subsystem), layer.found(subsystem).map(|found| found.by)) {
        (Some(_), _) => "given",
        (None, Some(FoundBy::Inequality)) => "matrix inequality",
        (None, Some(FoundBy::Search)) => "search",
        (None, None) => "local Riccati equation",
    }
}
