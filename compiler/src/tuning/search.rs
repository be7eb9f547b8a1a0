//! The moves of a search, and their order.
#![expect(non_snake_case, reason = "the paper's symbols")]

use nalgebra::DVector;

use super::blocks::{Block, blocks, groups};
use super::candidate::Candidate;
use super::coupling;
use super::figures::Figures;
use super::judge::Judge;
use crate::gains::Layer;
use crate::network::{Network, Subsystem};
use crate::optim::climb::climb;
use crate::sets::Sums;
use crate::sizing::{Aim, Merit, Stage};

pub struct Search<'a> {
    judge: Judge<'a>,
    /// Where it started first, then each better than the one before.
    found: Vec<(Candidate, Merit)>,
    /// Whether the aim is what the user asked for: it may need a design to be stated.
    aimed: bool,
}

pub struct Found {
    pub gains: Candidate,
    /// Of the whole design; how far the gains come where there is none.
    pub merit: Merit,
    /// What they were searched for, once there was a design.
    pub aim: Option<Aim>,
    pub compared: usize,
    /// Of the gains it started from.
    pub start: Figures,
    pub figures: Figures,
}

/// The small-gain radius that is sought before anything else: half of what Assumption 4 allows.
const WANTED_GAIN: f64 = 0.5;
/// Natural logarithm of the first step of a Riccati weight.
const WEIGHT_STEP: f64 = 1.5;
/// Evaluations per common factor of the Riccati weights.
const PER_WEIGHT: usize = 12;
/// First step of the entries of a gain, relative, and the step at which the search ends.
const STEP: f64 = 1.0;
const LEAST_STEP: f64 = 0.01;
/// Evaluations per entry in one round: calK_i matters most, and costs least to compare.
const PER_ENTRY: [(Layer, usize); 2] = [(Layer::Reference, 30), (Layer::Local, 10)];
/// The share of what is left that a round may take, and the least that a simplex of some variables can use.
const SHARE: f64 = 0.5;
const LEAST_PER_ENTRY: f64 = 3.0;
/// What a round of moves must gain for the steps to stay as long as they are.
const GAIN: f64 = 1e-2;

impl<'a> Search<'a> {
    /// From some gains, or from those with a lower small gain or from `shortcut` where these are better. `aim` is that of an
    /// earlier search.
    pub fn new(mut judge: Judge<'a>, start: Candidate, shortcut: Option<&Candidate>, aim: Option<Aim>) -> Self {
        let aimed = aim.is_some();
        judge.aim = aim.unwrap_or(Aim::Wishes);
        let merit = judge.merit(&start);
        let lowered = coupling::lower(judge.network, &start, WANTED_GAIN);
        let mut search = Self { judge, found: vec![(start, merit)], aimed };
        if let Some((lowered, radii)) = lowered {
            let merit = search.judge.merit(&lowered);
            let better = search.accept(lowered, merit);
            search.judge.most_gain = WANTED_GAIN.max(if better { radii.1 } else { radii.0 }) * (1.0 + 1e-6);
        }
        search.settle_aim();
        if let Some(shortcut) = shortcut {
            let merit = search.judge.merit(shortcut);
            search.accept(shortcut.clone(), merit);
            search.settle_aim();
        }
        search
    }

    /// Moves until the budget is spent or the steps are short.
    pub fn run(mut self) -> Found {
        self.weights(Layer::Reference);
        self.weights(Layer::Local);
        let mut step = STEP;
        while self.judge.left() > 0 && step > LEAST_STEP {
            let before = self.best().1;
            self.round(step);
            let after = self.best().1;
            if after.stage == before.stage && after.value - before.value < GAIN {
                step *= 0.5;
            }
        }
        self.chosen()
    }

    fn best(&self) -> &(Candidate, Merit) {
        &self.found[self.found.len() - 1]
    }

    fn accept(&mut self, candidate: Candidate, merit: Merit) -> bool {
        // Where calF is to blame for both of two unstable designs, the later one has the lower small gain.
        let best = self.best().1;
        let better = merit > best || (merit == best && merit.stage == Stage::Unstable);
        if better {
            self.found.push((candidate, merit));
        }
        better
    }

    /// Once there is a design: where epsilon is free and all set-points are covered, the largest epsilon at its reserve.
    fn settle_aim(&mut self) {
        if self.aimed || self.best().1.stage < Stage::Designed {
            return;
        }
        self.aimed = true;
        if !wants_speed(self.judge.network) {
            return;
        }
        let plain = self.found.iter().find(|(_, merit)| merit.stage == Stage::Designed);
        let design = plain.and_then(|(candidate, _)| self.judge.design(candidate, Sums::Estimated).ok());
        let Some(design) = design else { return };
        let reserve: Vec<DVector<f64>> = design.sizing.subsystems.into_iter().map(|s| s.dz).collect();
        self.judge.aim = Aim::Speed { reserve };
        self.judge.forget();
        for k in 0..self.found.len() {
            self.found[k].1 = self.judge.merit(&self.found[k].0.clone());
        }
    }

    /// The Riccati weights of one layer, of all subsystems by common factors: R and Q_e for calK_i, R for K_i.
    fn weights(&mut self, layer: Layer) {
        let (network, start) = (self.judge.network, self.best().0.clone());
        if !layer.is_open(network) {
            return;
        }
        let variables = if layer == Layer::Local { 1 } else { 2 };
        let evaluations = (PER_WEIGHT * variables).min(self.judge.left() / 2);
        let gains = |x: &[f64]| {
            let factors: Vec<f64> = x.iter().map(|x| (WEIGHT_STEP * x).exp()).collect();
            let subsystems: Vec<_> = network.subsystems.iter().map(|s| reweighed(s, layer, &factors)).collect();
            Candidate::local(&subsystems).map(|local| start.with(layer, &local))
        };
        self.judge.forget();
        let judge = &mut self.judge;
        let (x, merit) = climb(&vec![0.0; variables], evaluations, 0.05, |x| match gains(x) {
            Some(candidate) => judge.merit(&candidate),
            None => Merit { stage: Stage::Unstable, value: f64::NEG_INFINITY },
        });
        if let Some(candidate) = gains(&x) {
            self.accept(candidate, merit);
        }
        self.settle_aim();
    }

    /// Every block of entries once.
    fn round(&mut self, step: f64) {
        let all: Vec<_> = PER_ENTRY.into_iter().map(|(layer, per_entry)| (self.blocks(layer), per_entry)).collect();
        let entries = |block: &Block| block.len(&self.found[0].0);
        let wanted: usize =
            all.iter().map(|(blocks, per_entry)| blocks.iter().map(entries).sum::<usize>() * per_entry).sum();
        let share = (SHARE * self.judge.left() as f64 / wanted.max(1) as f64).min(1.0);
        for (blocks, per_entry) in all {
            for block in blocks {
                self.entries(&block, step, (share * per_entry as f64).max(LEAST_PER_ENTRY));
                self.settle_aim();
            }
        }
    }

    fn blocks(&self, layer: Layer) -> Vec<Block> {
        let candidate = &self.best().0;
        blocks(groups(self.judge.network, candidate, layer), candidate, layer)
    }

    fn entries(&mut self, block: &Block, step: f64, per_entry: f64) {
        let start = self.best().0.clone();
        let variables = block.len(&start);
        if self.judge.left() < 2 * variables {
            return;
        }
        self.judge.forget();
        let evaluations = ((per_entry * (variables + 1) as f64) as usize).min(self.judge.left());
        let judge = &mut self.judge;
        let merit = |x: &[f64]| judge.merit(&block.moved(&start, step, x));
        let (x, merit) = climb(&vec![0.0; variables], evaluations, 0.02, merit);
        self.accept(block.moved(&start, step, &x), merit);
    }

    /// The best gains whose design also survives the whole pipeline, and is not behind the first one there.
    fn chosen(self) -> Found {
        let judged = |candidate| self.judge.design(candidate, Sums::Proved);
        let (start, start_merit) = &self.found[0];
        let first = judged(start);
        let merit = first.as_ref().ok().map(|design| design.merit);
        let figures = |candidate: &Candidate, design| Figures::new(candidate, self.judge.network, design);
        let found = |gains: &Candidate, merit: Merit, tuned| Found {
            start: figures(start, &first),
            figures: tuned,
            gains: gains.clone(),
            merit,
            aim: self.aimed.then(|| self.judge.aim.clone()),
            compared: self.judge.compared,
        };
        for (candidate, expected) in self.found.iter().skip(1).rev() {
            let design = judged(candidate);
            let proved = design.as_ref().ok().map(|design| design.merit).filter(|proved| Some(*proved) >= merit);
            if expected.stage < Stage::Designed || proved.is_some() {
                return found(candidate, proved.unwrap_or(*expected), figures(candidate, &design));
            }
        }
        // Gains that only seemed to give a design come after all that do.
        let short_of_it = Merit { stage: start_merit.stage.min(Stage::Cover), ..*start_merit };
        found(start, merit.unwrap_or(short_of_it), figures(start, &first))
    }
}

fn wants_speed(network: &Network) -> bool {
    let covered = network.subsystems.iter().all(|s| s.cover.iter().all(Option::is_some));
    covered && network.reference.epsilon.is_none() && network.wishes.epsilon_weight > 0.0
}

fn reweighed(s: &Subsystem, layer: Layer, factors: &[f64]) -> Subsystem {
    let (n, p) = (s.n(), s.p());
    let mut s = s.clone();
    match layer {
        Layer::Local => s.gains.weights.1 *= factors[0],
        Layer::Reference => {
            s.gains.reference_weights.1 *= factors[0];
            let mut Qe = s.gains.reference_weights.0.view_mut((n, n), (p, p));
            Qe *= factors[1];
        }
    }
    s
}
