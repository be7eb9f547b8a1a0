//! The command line.

use clap::{Parser, ValueEnum};

use crate::arena::{Point, from_centre};
use crate::emitted;
use crate::fleet::{EMITTED, design, source, space};
use crate::pace::Pace;
use crate::robot::Started;
use crate::rule::Rule;
use crate::run::{Fault, FaultKind, Run};
use crate::scenario::{Scenario, Space};
use crate::tables;
use dpc_codegen::design::Design;

/// What went wrong.
pub type Failure = Box<dyn std::error::Error + Send + Sync>;

/// Robots that avoid each other, each with its own controller; without options the runs of Section V of the paper.
#[derive(Debug, Clone, Parser)]
#[command(name = "robots")]
pub struct Command {
    /// How many robots: 3 fast ones run emitted controllers, others are designed now
    #[arg(long)]
    pub robots: Option<usize>,
    /// What they do
    #[arg(long, value_enum)]
    pub scenario: Option<Kind>,
    /// Of a random scenario, 1 where nothing is said
    #[arg(long)]
    pub seed: Option<u64>,
    /// How the half-plane between two robots is drawn; by the tangent where nothing is said, across the line of centres for a leader
    /// and a formation
    #[arg(long, value_enum)]
    pub rule: Option<RuleName>,
    /// How fast references move: 5 or 2 cm per step; a leader and a formation are slow unless told otherwise
    #[arg(long, value_enum)]
    pub pace: Option<PaceName>,
    /// A robot that fails from a step on: ROBOT:STEP:mute, deaf, silent or dead
    #[arg(long, value_name = "ROBOT:STEP:KIND", value_parser = fault)]
    pub fault: Option<Fault>,
    /// Run random scenarios of 2 to 8 robots with this many seeds, and count
    #[arg(long, value_name = "SEEDS", value_parser = clap::value_parser!(u64).range(1..), conflicts_with_all = ["robots", "scenario", "seed", "rule", "fault"])]
    pub campaign: Option<u64>,
    /// Renew the picture beside the README
    #[arg(long, conflicts_with_all = ["robots", "scenario", "seed", "rule", "pace", "fault", "campaign"])]
    pub picture: bool,
    /// Write system.toml anew
    #[arg(long, exclusive = true)]
    pub design: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Kind {
    /// The three robots of Section V
    Paper,
    /// All on an ellipse, each to the opposite side
    Antipodal,
    /// Starts and goals anywhere
    Random,
    /// Three robots: one on a round, the others keep their offsets from it
    Leader,
    /// Three robots in a triangle that moves and turns
    Formation,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum RuleName {
    /// The tangent, keeping a fifth of the room there is
    Tangent,
    /// The tangent as the paper draws it
    Plain,
    /// Across the line of centres (buffered Voronoi cells)
    Centres,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum PaceName {
    /// 5 cm per step, as in Section V
    Fast,
    /// 2 cm per step: robots may come nearer to each other
    Slow,
}

impl From<PaceName> for Pace {
    fn from(name: PaceName) -> Self {
        match name {
            PaceName::Fast => Self::FAST,
            PaceName::Slow => Self::SLOW,
        }
    }
}

impl From<RuleName> for Rule {
    fn from(name: RuleName) -> Self {
        match name {
            RuleName::Tangent => Self::TANGENT,
            RuleName::Plain => Self::PLAIN,
            RuleName::Centres => Self::LineOfCentres,
        }
    }
}

/// Robots that can be started: a design, and its controllers.
pub struct Fleet {
    pub design: Design,
    pub space: Space,
    pub pace: Pace,
}

impl Fleet {
    /// # Errors
    /// What the compiler says of so many robots.
    pub fn new(robots: usize, pace: Pace) -> Result<Self, Failure> {
        if !(2..=tables::MOST).contains(&robots) {
            return Err(tables::Unfit::Count(robots).into());
        }
        let design = design(robots, pace).map_err(|mistakes| mistakes.render(&source(robots, pace), false))?;
        Ok(Self { space: space(&design, pace), design, pace })
    }

    /// The controllers of a scenario, at rest at its starts: emitted ones where there are.
    ///
    /// # Errors
    /// A start or a goal is impossible, or a controller refuses.
    pub fn start(&self, scenario: &Scenario) -> Result<Vec<Started<'static>>, Failure> {
        scenario.check(&self.space)?;
        let starts: Vec<Point> = scenario.starts.iter().map(|start| from_centre(*start)).collect();
        match <[Point; EMITTED]>::try_from(&starts[..]) {
            Ok(three) if self.pace == Pace::FAST => Ok(emitted::start(&three)?),
            _ => Ok(tables::start(&self.design, &starts)?),
        }
    }

    /// # Errors
    /// As [`Self::start`], or a message got lost in the bus.
    pub fn run(&self, scenario: &Scenario, rule: Rule, fault: Option<Fault>) -> Result<Run, Failure> {
        Ok(Run::new(self.start(scenario)?, scenario, rule, self.pace, fault)?)
    }
}

impl Command {
    /// What a single run was asked to be; `None`: none was asked for.
    pub fn kind(&self) -> Option<Kind> {
        let unsaid = match (self.robots, self.seed) {
            (None, None) => (self.rule.is_some() || self.pace.is_some() || self.fault.is_some()).then_some(Kind::Paper),
            _ => Some(Kind::Random),
        };
        self.scenario.or(unsaid)
    }

    /// The pace that was asked for, or that suits the scenario.
    pub fn pace(&self) -> Pace {
        match (self.pace, self.scenario) {
            (Some(name), _) => name.into(),
            (None, Some(Kind::Leader | Kind::Formation)) => Pace::SLOW,
            (None, _) => Pace::FAST,
        }
    }

    /// The rule that was asked for, or that suits the scenario: who keeps a formation need not get past anyone.
    pub fn rule(&self) -> Rule {
        match (self.rule, self.scenario) {
            (Some(name), _) => name.into(),
            (None, Some(Kind::Leader | Kind::Formation)) => Rule::LineOfCentres,
            (None, _) => Rule::TANGENT,
        }
    }

    /// The scenario that was asked for.
    ///
    /// # Errors
    /// It is one of another number of robots, or there is no room.
    pub fn scenario(&self, kind: Kind, space: &Space) -> Result<Scenario, Failure> {
        let robots = self.robots.unwrap_or(EMITTED);
        let of_three = |scenario: Scenario| {
            let fits = robots == scenario.robots();
            fits.then_some(scenario).ok_or_else(|| format!("the scenario is one of 3 robots, not of {robots}"))
        };
        match kind {
            Kind::Paper => Ok(of_three(Scenario::paper())?),
            Kind::Leader => Ok(of_three(Scenario::leader())?),
            Kind::Formation => Ok(of_three(Scenario::formation())?),
            Kind::Antipodal => Ok(Scenario::antipodal(robots, space)),
            Kind::Random => Ok(Scenario::random(robots, self.seed.unwrap_or(1), space)?),
        }
    }
}

fn fault(text: &str) -> Result<Fault, String> {
    let usage = || format!("`{text}` is not ROBOT:STEP:KIND, for instance 2:10:mute");
    let [robot, from, kind] = text.split(':').collect::<Vec<_>>()[..] else { return Err(usage()) };
    let kind = match kind {
        "mute" => FaultKind::Mute,
        "deaf" => FaultKind::Deaf,
        "silent" => FaultKind::Silent,
        "dead" => FaultKind::Dead,
        _ => return Err(format!("`{kind}` is none of mute, deaf, silent, dead")),
    };
    let robot = robot.parse::<usize>().ok().filter(|robot| *robot > 0).ok_or_else(usage)?;
    Ok(Fault { robot: robot - 1, from: from.parse().map_err(|_| usage())?, kind })
}
