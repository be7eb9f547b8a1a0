//! The solver's run on all parameters at once.

use std::collections::BTreeSet;
use std::rc::Rc;

use nalgebra::{DVector, RowDVector};

use super::region::{Ball, Region, THIN};
use super::space::Space;
use super::working::{DEPENDENT, Direction, Facets, Optima, Optimum};
use super::{Certificate, Extreme, Uncertified};
use crate::problems::DpcProblem;

/// The most changes of the working set that the solver makes, from any start that a shift can produce.
///
/// # Errors
/// The problem is too large for that: see [`Uncertified`].
pub fn certify(dpc: &DpcProblem, space: &Space, work: usize) -> Result<Certificate, Uncertified> {
    if dpc.V.ncols() > FEW {
        return Err(Uncertified::Unknowns(dpc.V.ncols()));
    }
    let facets = Facets::new(dpc, space);
    match space.dimension() {
        0..=8 => Certifier::<8>::new(dpc, space, &facets, work).run(),
        9..=12 => Certifier::<12>::new(dpc, space, &facets, work).run(),
        13..=16 => Certifier::<16>::new(dpc, space, &facets, work).run(),
        17..=24 => Certifier::<24>::new(dpc, space, &facets, work).run(),
        parameters => Err(Uncertified::Parameters(parameters)),
    }
}

/// Up to so many unknowns the solver looks at all rows at each change, and what enters is the one that is violated most: its
/// `FEW`. With more it goes on with rows it has seen before, and a working set does not say which.
pub const FEW: usize = 8;

/// Multipliers fall with an entering one where it is more than this times the largest share: the solver's `NOISE`.
const NOISE: f64 = 1e-9;

/// Violations that do not come nearer to zero than this, relative to the limits, are none.
const NEGLIGIBLE: f64 = 1e-12;

struct Certifier<'a, const D: usize> {
    dpc: &'a DpcProblem,
    optima: Optima<'a>,
    facets: &'a Facets,
    /// Magnitude of the limits.
    size: f64,
    region: Region<D>,
    starts: BTreeSet<Vec<usize>>,
    waiting: Vec<Vec<usize>>,
    /// The rows it was given.
    start: Vec<usize>,
    /// Working sets looked at on the way here. None comes back: |w| grows with every change, but on parameters without interior.
    passed: Vec<Vec<usize>>,
    certificate: Certificate,
    work: usize,
}

/// On the way to the optimum over the working set and one row more.
struct Entering {
    facet: usize,
    set: Vec<usize>,
    /// As functions of (1, p): of the working set, and how far the row still is from holding.
    multipliers: Vec<RowDVector<f64>>,
    violation: RowDVector<f64>,
    changes: usize,
}

impl<'a, const D: usize> Certifier<'a, D> {
    fn new(dpc: &'a DpcProblem, space: &Space, facets: &'a Facets, work: usize) -> Self {
        let mut region = Region::new(space.dimension());
        space.facets.iter().for_each(|facet| region.add(facet[0], &facet.as_slice()[1..], facet.amax()));
        region.simplify();
        Self {
            dpc,
            optima: Optima::new(facets),
            facets,
            size: facets.limits.amax(),
            region,
            starts: BTreeSet::from([Vec::new()]),
            waiting: vec![Vec::new()],
            start: Vec::new(),
            passed: Vec::new(),
            certificate: Certificate::default(),
            work,
        }
    }

    fn run(mut self) -> Result<Certificate, Uncertified> {
        let base = self.region.mark();
        while let Some(start) = self.waiting.pop() {
            self.region.back(base);
            self.start.clone_from(&start);
            self.begin(&start)?;
        }
        let Self { mut certificate, region, starts, .. } = self;
        (certificate.starts, certificate.questions) = (starts.len(), region.questions);
        certificate.thickest = region.thickest;
        Ok(certificate)
    }

    /// What is left of a start when it has dropped the rows of the most negative multipliers, one after the other: any part of it
    /// whose multipliers are not negative. Which parameters lead to which part is not asked.
    fn begin(&mut self, set: &[usize]) -> Result<(), Uncertified> {
        self.count()?;
        let Some(optimum) = self.optima.over(set) else { return Ok(()) };
        optimum.multipliers.row_iter().for_each(|multiplier| self.require(&multiplier.into_owned()));
        let mark = Region::<D>::NOWHERE;
        match self.region.probe(&Ball { centre: [0.0; D], radius: 1.0 }, mark) {
            Some(point) => self.look(&optimum, 0, &point),
            None => Ok(()),
        }
    }

    /// The optimum over a working set: final, or some row is violated most. This is the solver's `most_violated`.
    fn look(&mut self, optimum: &Rc<Optimum>, changes: usize, near: &Ball<D>) -> Result<(), Uncertified> {
        self.count()?;
        if self.passed.contains(&optimum.set) {
            return Ok(());
        }
        self.passed.push(optimum.set.clone());
        let holds = |f: usize| optimum.set.iter().any(|&g| self.facets.of[g].0 == self.facets.of[f].0);
        let rest: Vec<usize> = (0..self.facets.of.len()).filter(|&f| !holds(f)).collect();
        let violations: Vec<RowDVector<f64>> = rest.iter().map(|&f| optimum.violations.row(f).into_owned()).collect();
        // Where nothing can be violated there is nothing to tell apart.
        let open: Vec<usize> = (0..rest.len()).filter(|&k| most(&violations[k]) > -NEGLIGIBLE * self.size).collect();
        let mark = self.region.mark();
        open.iter().for_each(|&k| self.require(&-&violations[k]));
        if let Some(point) = self.region.probe(near, mark) {
            self.optimal(optimum, changes, &point);
        }
        self.region.back(mark);
        for &k in &open {
            self.require(&violations[k]);
            for &j in open.iter().filter(|&&j| j != k) {
                self.require(&(&violations[k] - &violations[j]));
            }
            if let Some(point) = self.region.probe(near, mark) {
                let entering = Entering {
                    facet: rest[k],
                    set: optimum.set.clone(),
                    multipliers: optimum.multipliers.row_iter().map(|row| row.into_owned()).collect(),
                    violation: violations[k].clone(),
                    changes,
                };
                self.enter(entering, &point)?;
            }
            self.region.back(mark);
        }
        self.passed.pop();
        Ok(())
    }

    /// A row comes in, and on the way others go: the solver's `enter`.
    fn enter(&mut self, at: Entering, near: &Ball<D>) -> Result<(), Uncertified> {
        self.count()?;
        let Some(optimum) = self.optima.over(&at.set) else { return Ok(()) };
        let Direction { combination, pivot } = optimum.direction(self.facets, at.facet);
        let independent = pivot > DEPENDENT && at.set.len() < self.facets.normals.ncols();
        let noise = NOISE * combination.amax().max(1.0);
        let falling: Vec<(usize, RowDVector<f64>)> = (0..at.set.len())
            .filter(|&k| combination[k] > noise)
            .map(|k| (k, &at.multipliers[k] / combination[k]))
            .collect();
        let mark = self.region.mark();
        let full = independent.then(|| &at.violation / pivot);
        if let Some(full) = &full {
            falling.iter().for_each(|(_, step)| self.require(&(step - full)));
            if let Some(point) = self.region.probe(near, mark) {
                let mut set = at.set.clone();
                set.push(at.facet);
                set.sort_unstable();
                if let Some(optimum) = self.optima.over(&set) {
                    self.look(&optimum, at.changes + 1, &point)?;
                }
            }
            self.region.back(mark);
        } else if falling.is_empty() {
            self.certificate.infeasible = self.certificate.infeasible.max(Some(at.changes));
        }
        for (k, step) in &falling {
            for (_, other) in falling.iter().filter(|(j, _)| j != k) {
                self.require(&(other - step));
            }
            if let Some(full) = &full {
                self.require(&(full - step));
            }
            if let Some(point) = self.region.probe(near, mark) {
                self.enter(at.without(*k, step, &combination, pivot), &point)?;
            }
            self.region.back(mark);
        }
        Ok(())
    }

    /// A run has ended.
    fn optimal(&mut self, optimum: &Optimum, changes: usize, near: &Ball<D>) {
        self.note_extreme(changes, near);
        self.certificate.sets.insert(optimum.set.clone());
        let shift = self.dpc.shift();
        let shifted = optimum.set.iter().filter_map(|&f| {
            let (row, side) = self.facets.of[f];
            self.facets.find(shift[row], side)
        });
        let shifted: Vec<usize> = shifted.collect();
        for start in self.optima.bases(&shifted) {
            self.await_parts(start);
        }
    }

    /// A start, and what it may drop its rows to.
    fn await_parts(&mut self, start: Vec<usize>) {
        if !self.starts.insert(start.clone()) {
            return;
        }
        for k in 0..start.len() {
            let mut part = start.clone();
            part.remove(k);
            self.await_parts(part);
        }
        self.certificate.dropped = self.certificate.dropped.max(start.len());
        self.waiting.push(start);
    }

    /// Keeps the longest run, and of all that are as long the one that is least near to another.
    fn note_extreme(&mut self, changes: usize, near: &Ball<D>) {
        self.certificate.most = self.certificate.most.max(changes);
        let than = match &self.certificate.extreme {
            Some(known) if known.changes > changes => return,
            Some(known) if known.changes == changes => 2.0 * known.radius,
            _ => THIN,
        };
        if let Some(ball) = self.region.widest(near, than) {
            let start = self.start.iter().map(|&f| self.facets.of[f]).collect();
            self.certificate.extreme = Some(Extreme { changes, start, p: ball.centre.to_vec(), radius: ball.radius });
        }
    }

    /// Cuts off where a function of (1, p) is negative.
    fn require(&mut self, value: &RowDVector<f64>) {
        self.region.add(value[0], &value.as_slice()[1..], self.size);
    }

    fn count(&mut self) -> Result<(), Uncertified> {
        self.certificate.regions += 1;
        match self.region.is_lost() {
            true => Err(Uncertified::Undecided),
            false if self.region.questions > self.work => Err(Uncertified::Work(self.work)),
            false => Ok(()),
        }
    }
}

impl Entering {
    /// After the row at `k` was dropped: the entering multiplier has grown by `step`.
    fn without(&self, k: usize, step: &RowDVector<f64>, combination: &DVector<f64>, pivot: f64) -> Self {
        let mut set = self.set.clone();
        set.remove(k);
        let others = self.multipliers.iter().enumerate().filter(|(j, _)| *j != k);
        Self {
            facet: self.facet,
            set,
            multipliers: others.map(|(j, multiplier)| multiplier - step * combination[j]).collect(),
            violation: &self.violation - step * pivot,
            changes: self.changes + 1,
        }
    }
}

/// The largest value on the box.
fn most(value: &RowDVector<f64>) -> f64 {
    value[0] + value.iter().skip(1).map(|slope| slope.abs()).sum::<f64>()
}
