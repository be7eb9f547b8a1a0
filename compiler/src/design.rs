//! The pipeline on one page; read this first.

use crate::diagnostic::{Diagnostic, Diagnostics, Source, code};
use crate::gains::{Gains, Settled};
use crate::iterations;
use crate::network::{Network, Scalar, Start};
use crate::problems::Problems;
use crate::rounding::{asked, largest_share};
use crate::sets::Sets;
use crate::sizing::Sizing;
use crate::spec::Spec;
use crate::start::StartPlan;
use crate::tuning::{Effort, Tuning, Watch, offered};

/// Everything the compiler knows about one network, stage by stage. Nothing in it changes after it is made.
#[derive(Debug)]
pub struct Design {
    /// With the gains that were found, where these are not the Riccati equations'.
    pub network: Network,
    pub gains: Gains,
    pub sets: Sets,
    pub sizing: Sizing,
    pub problems: Problems,
    /// What a search for gains has brought; `None` without one.
    pub tuning: Option<Tuning>,
    /// From the start that the file states; `None` without one.
    pub start: Option<StartPlan>,
    /// How many problems per subsystem the iteration limits rest on; `None` where they rest on its size.
    pub samples: Option<usize>,
}

/// What the caller of a design says instead of the file.
#[derive(Debug, Clone, Copy, Default)]
pub struct Request {
    /// What the controllers compute in.
    pub scalar: Option<Scalar>,
    /// How long to search for better gains.
    pub effort: Option<Effort>,
    /// As with `start-anywhere = true` in the file, and without a plan for the start that it states: for [`Design::started`].
    pub anywhere: bool,
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
        Self::requested(source, &Request { effort, ..Request::default() }, watch)
    }

    /// [`Design::watched`] with a scalar type that wins over the file's.
    ///
    /// # Errors
    /// As [`Design::new`].
    pub fn in_scalar(
        source: Source,
        scalar: Scalar,
        effort: Option<Effort>,
        watch: &mut dyn Watch,
    ) -> Result<Self, Diagnostics> {
        Self::requested(source, &Request { scalar: Some(scalar), effort, anywhere: false }, watch)
    }

    /// [`Design::watched`] as with `start-anywhere = true` in the file, and without a plan for the start that it states: for
    /// [`Design::started`].
    ///
    /// # Errors
    /// As [`Design::new`].
    pub fn anywhere(source: Source, effort: Option<Effort>, watch: &mut dyn Watch) -> Result<Self, Diagnostics> {
        Self::requested(source, &Request { scalar: None, effort, anywhere: true }, watch)
    }

    /// [`Design::new`] with what wins over the file's words.
    ///
    /// # Errors
    /// As [`Design::new`].
    pub fn requested(source: Source, request: &Request, watch: &mut dyn Watch) -> Result<Self, Diagnostics> {
        let network = read(source, watch)?;
        let scalar = request.scalar.unwrap_or(network.scalar);
        let mut network = Network { scalar, ..network };
        if request.anywhere {
            network.check_plannable()?;
            network = Network { start_anywhere: true, start: None, ..network };
        }
        Self::of_network(network, request.effort, watch)
    }

    /// The same design with a plan for the start that the file of starts `source` states.
    ///
    /// # Errors
    /// The mistakes in that file, into whose text they point; E0504 where no plan leads from there.
    pub fn started(self, source: &Source) -> Result<Self, Diagnostics> {
        let start = Start::of_starts(source, &self.network)?;
        let plan = self.plan_from(&start).map_err(|refusal| refusal.diagnostic(&self.network, &start))?;
        Ok(Self { start: Some(plan), ..self })
    }

    /// The same design with iteration limits from about `samples` problems per subsystem, and from certificates where problems are
    /// small; see [`crate::iterations`].
    pub fn counted(mut self, samples: usize) -> Self {
        let counts = iterations::count(&self, samples);
        for (problems, count) in self.problems.subsystems.iter_mut().zip(counts) {
            problems.dpc.max_iterations = count.limit(&problems.dpc);
            problems.iterations = Some(count);
        }
        self.samples = Some(samples);
        self
    }

    fn of_network(network: Network, effort: Option<Effort>, watch: &mut dyn Watch) -> Result<Self, Diagnostics> {
        let effort = effort.unwrap_or(network.effort);
        let network = Network { effort, ..network };
        effort.fits(&network)?;
        match network.scalar {
            Scalar::Double => Self::searched(network, watch),
            Scalar::Single => Self::searched(network.clone(), watch).map_err(|mistakes| too_coarse(&network, mistakes)),
        }
    }

    /// The stages after the network, and a search for gains among them.
    fn searched(network: Network, watch: &mut dyn Watch) -> Result<Self, Diagnostics> {
        let effort = network.effort;
        let settled = Settled::watched(network.clone(), watch);
        match Tuning::new(&network, settled.as_ref().ok(), effort, watch) {
            Some((tuned, tuning)) => Self::tuned(tuned, tuning, watch),
            None => {
                settled.and_then(|settled| Self::of(settled, watch)).map_err(|mistakes| offered(&network, mistakes))
            }
        }
    }

    /// The stages after a search for gains.
    fn tuned(network: Network, tuning: Tuning, watch: &mut dyn Watch) -> Result<Self, Diagnostics> {
        watch.stage("Tuning");
        match Settled::with(network, watch).and_then(|settled| Self::of(settled, watch)) {
            Ok(design) => Ok(Self { tuning: Some(tuning), ..design }),
            Err(mistakes) => Err(tuning.explain(mistakes)),
        }
    }

    /// The stages after the gains.
    fn of(Settled { network, gains, sets }: Settled, watch: &mut dyn Watch) -> Result<Self, Diagnostics> {
        let sizing = Sizing::new(&network, &gains, &sets)?;
        watch.stage("Sizing");
        let problems = Problems::new(&network, &gains, &sets, &sizing)?;
        watch.stage("Problems");
        let design = Self { network, gains, sets, sizing, problems, tuning: None, start: None, samples: None };
        let planned = design.network.start.as_ref().map(|start| {
            let planned = design.plan_from(start);
            planned.map_err(|refusal| Diagnostics::from(refusal.diagnostic(&design.network, start)))
        });
        let start = planned.transpose()?;
        if start.is_some() {
            watch.stage("Start");
        }
        Ok(Self { start, ..design })
    }
}

/// The mistakes of a design in single precision: where the same exists in double precision, rounding is to blame.
fn too_coarse(network: &Network, mistakes: Diagnostics) -> Diagnostics {
    let Some(first) = mistakes.0.first().filter(|first| first.code != code::SINGLE_PRECISION) else { return mistakes };
    let double = Network { scalar: Scalar::Double, ..network.clone() };
    let Ok(double) = Design::searched(double, &mut ()) else { return mistakes };
    let (place, label, way_out) = asked(network);
    let error = Diagnostic::error(code::SINGLE_PRECISION, "this network needs double precision").at(place, label);
    let error = largest_share(network, &double.gains).into_iter().fold(error, Diagnostic::note);
    let error = error.note(format!("in single precision {}", first.title));
    let error = first.notes.iter().fold(error, |error, note| error.note(note.clone()));
    error.help(format!("{way_out}, or bound states and inputs no more generously than they need")).into()
}

fn read(source: Source, watch: &mut dyn Watch) -> Result<Network, Diagnostics> {
    let (spec, mistakes) = Spec::read(&source);
    watch.stage("Spec");
    let network = Network::after(spec.as_ref(), mistakes, source)?;
    watch.stage("Network");
    Ok(network)
}
