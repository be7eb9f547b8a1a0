//! The pipeline on one page; read this first.

use crate::diagnostic::{Diagnostics, Source};
use crate::gains::{Gains, Settled};
use crate::network::Network;
use crate::problems::Problems;
use crate::sets::Sets;
use crate::sizing::Sizing;
use crate::spec::Spec;
use crate::tuning::{Effort, Tuning, Watch};

/// Everything the compiler knows about one network, stage by stage. Nothing in it changes after it is made.
#[derive(Debug)]
pub struct Design {
    /// With the gains as given ones where they were searched for.
    pub network: Network,
    pub gains: Gains,
    pub sets: Sets,
    pub sizing: Sizing,
    pub problems: Problems,
    /// What a search for gains has brought; `None` without one.
    pub tuning: Option<Tuning>,
}

impl Design {
    /// Off-line design, Section IV-A of the paper: steps 1 to 4, then the on-line problems. Gains are searched for as
    /// long as the file says.
    ///
    /// # Errors
    /// The mistakes of the first stage that finds any, each with its place in the file.
    pub fn new(source: Source) -> Result<Self, Diagnostics> {
        Self::watched(source, None, &mut ())
    }

    /// [`Design::new`] with an effort that wins over the file's.
    ///
    /// # Errors
    /// As [`Design::new`].
    pub fn with_effort(source: Source, effort: Effort) -> Result<Self, Diagnostics> {
        Self::watched(source, Some(effort), &mut ())
    }

    /// [`Design::new`], or [`Design::with_effort`], for clocks and progress bars: `watch` hears when a stage ends.
    ///
    /// # Errors
    /// As [`Design::new`].
    pub fn watched(source: Source, effort: Option<Effort>, watch: &mut dyn Watch) -> Result<Self, Diagnostics> {
        let spec = Spec::parse(&source)?;
        watch.stage("Spec");
        let network = Network::new(&spec, source)?;
        watch.stage("Network");
        let effort = effort.unwrap_or(network.effort);
        effort.fits(&network)?;
        let settled = Settled::watched(network.clone(), watch);
        let start = settled.as_ref().map_or(&network, |settled| &settled.network);
        match Tuning::new(start, effort, watch) {
            Some((tuned, tuning)) => Self::tuned(tuned, tuning, watch),
            None => Self::of(settled?, watch),
        }
    }

    /// The stages after a search for gains.
    fn tuned(network: Network, tuning: Tuning, watch: &mut dyn Watch) -> Result<Self, Diagnostics> {
        watch.stage("Tuning");
        match Settled::new(network).and_then(|settled| Self::of(settled, watch)) {
            Ok(design) => Ok(Self { tuning: Some(tuning), ..design }),
            Err(mistakes) => Err(tuning.explain(mistakes)),
        }
    }

    /// The stages after the gains.
    fn of(Settled { network, gains, sets }: Settled, watch: &mut dyn Watch) -> Result<Self, Diagnostics> {
        let sizing = Sizing::new(&network, &gains, &sets)?;
        watch.stage("Sizing");
        let problems = Problems::new(&network, &gains, &sizing)?;
        watch.stage("Problems");
        Ok(Self { network, gains, sets, sizing, problems, tuning: None })
    }
}
