//! The pipeline on one page; read this first.

use crate::diagnostic::{Diagnostics, Source};
use crate::gains::{Gains, Settled};
use crate::network::Network;
use crate::problems::Problems;
use crate::sets::Sets;
use crate::sizing::Sizing;
use crate::spec::Spec;

/// Everything the compiler knows about one network, stage by stage. Nothing in it changes after it is made.
#[derive(Debug)]
pub struct Design {
    pub network: Network,
    pub gains: Gains,
    pub sets: Sets,
    pub sizing: Sizing,
    pub problems: Problems,
}

impl Design {
    /// Off-line design, Section IV-A of the paper: steps 1 to 4, then the on-line problems.
    ///
    /// # Errors
    /// The mistakes of the first stage that finds any, each with its place in the file.
    pub fn new(source: Source) -> Result<Self, Diagnostics> {
        Self::observed(source, |_| ())
    }

    /// [`Design::new`], which calls `done` with the name of each stage when it ends: for clocks.
    ///
    /// # Errors
    /// As [`Design::new`].
    pub fn observed(source: Source, mut done: impl FnMut(&'static str)) -> Result<Self, Diagnostics> {
        let spec = Spec::parse(&source)?;
        done("Spec");
        let network = Network::new(&spec, source.clone())?;
        done("Network");
        let Settled { network, gains, sets } = Settled::new(network)?;
        done("Gains, Sets");
        let sizing = Sizing::new(&network, &gains, &sets)?;
        done("Sizing");
        let problems = Problems::new(&network, &gains, &sizing)?;
        done("Problems");
        Ok(Self { network, gains, sets, sizing, problems })
    }
}
