//! Random scenarios by the hundred.

use crate::arena::DIAMETER;
use crate::command::{Failure, Fleet};
use crate::rule::Rule;
use crate::run::Run;
use crate::scenario::Scenario;

/// What became of runs with the same number of robots and the same rule.
#[derive(Debug, Clone, PartialEq)]
pub struct Tally {
    pub runs: usize,
    /// Runs in which two robots touched.
    pub collisions: usize,
    /// Runs in which all robots reached their goals; steps until then, added up.
    pub arrived: usize,
    pub steps: usize,
    /// Runs that ended with a deadlock that is told.
    pub deadlocks: usize,
    /// Steps of any robot whose status did not say that the guarantee holds.
    pub unguaranteed: usize,
    /// Steps of any robot at which its centre left the floor.
    pub left: usize,
    /// Steps of any robot at which its motion was not within what the design counts on.
    pub strayed: usize,
    /// Smallest distance of two centres, cm.
    pub closest: f64,
}

impl Default for Tally {
    fn default() -> Self {
        Self {
            runs: 0,
            collisions: 0,
            arrived: 0,
            steps: 0,
            deadlocks: 0,
            unguaranteed: 0,
            left: 0,
            strayed: 0,
            closest: f64::INFINITY,
        }
    }
}

impl Tally {
    /// Of the seeds from 0 to `seeds`.
    ///
    /// # Errors
    /// There is no room for the robots of a seed, or a controller refuses to start.
    pub fn of(fleet: &Fleet, robots: usize, seeds: u64, rule: Rule) -> Result<Self, Failure> {
        let mut tally = Self::default();
        for seed in 0..seeds {
            let scenario = Scenario::random(robots, seed, &fleet.space)?;
            tally.count(&fleet.run(&scenario, rule, None)?);
        }
        Ok(tally)
    }

    fn count(&mut self, run: &Run) {
        let closest = run.smallest_distance();
        self.runs += 1;
        self.collisions += usize::from(closest < DIAMETER);
        self.closest = self.closest.min(closest);
        self.unguaranteed += run.unguaranteed();
        self.left += run.left;
        self.strayed += run.strayed;
        match run.robots_arrive() {
            Some(steps) => (self.arrived, self.steps) = (self.arrived + 1, self.steps + steps),
            None => self.deadlocks += usize::from(!run.deadlocked().is_empty()),
        }
    }

    pub fn head() -> Vec<String> {
        let head =
            ["robots, rule", "runs", "collisions", "closest, cm", "arrived", "steps", "deadlock told", "neither"];
        head.iter().chain(&["no guarantee", "left", "strayed"]).map(|cell| (*cell).to_owned()).collect()
    }

    /// A line of the table.
    pub fn cells(&self, robots: usize, rule: Rule) -> Vec<String> {
        let mean =
            if self.arrived > 0 { format!("{:.0}", self.steps as f64 / self.arrived as f64) } else { "-".into() };
        vec![
            format!("{robots}, {}", rule.name()),
            self.runs.to_string(),
            self.collisions.to_string(),
            format!("{:.2}", self.closest),
            format!("{:.0} %", 100.0 * self.arrived as f64 / self.runs.max(1) as f64),
            mean,
            self.deadlocks.to_string(),
            (self.runs - self.arrived - self.deadlocks).to_string(),
            self.unguaranteed.to_string(),
            self.left.to_string(),
            self.strayed.to_string(),
        ]
    }
}
