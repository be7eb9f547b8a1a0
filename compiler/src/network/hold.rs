//! From continuous to discrete time: each subsystem by zero-order hold, what couples it held over the period.
//!
//! x_i+ = e^{A_ii h} x_i + (integral of e^{A_ii s} ds) (B_ii u_i + E_i s_i + M_i d_i): the coupling inputs s_i stay what
//! they were at the sampling instant, so that every neighbour is still a neighbour, and nobody else is. What that leaves
//! out, against the exact discretisation of the whole network, is bounded here.

use std::collections::VecDeque;

use nalgebra::{DMatrix, DVector, RowDVector};

use super::{NamedPolytope, Signal, Subsystem};
use crate::convex::{Bounded, Polytope};
use crate::diagnostic::{Diagnostic, Diagnostics, Place, code};
use crate::optim::exponential::{Enclosure, sampled};
use crate::optim::lyapunov::eigenvalues;
use crate::optim::rounding::{sum_upper, up_to_digits};

/// More states than this have no exact discretisation here: it is dense, and takes about ten seconds for as many.
const MOST_STATES: usize = 500;
/// Sampled models that are not known to this share of their largest entry are none: far less than the rounding floor of the tubes,
/// 1e-8 of each state's bounds.
const LEAST_ACCURACY: f64 = 1e-11;

/// How a continuous-time model was sampled.
#[derive(Debug, Clone, PartialEq)]
pub struct Hold {
    /// Whether the errors are part of every w.
    pub charged: bool,
    /// Per subsystem and state, where the network is small enough for its exact discretisation.
    pub errors: Option<Vec<Vec<HoldError>>>,
    /// Per subsystem, of the continuous-time A_ii.
    pub fastest: Vec<Fastest>,
}

/// How far x+ of the exact discretisation may be from that with held coupling, in one state.
#[derive(Debug, Clone, PartialEq)]
pub enum HoldError {
    /// -below <= exact - held <= above, for all states, inputs and loads that the constraints allow.
    Within { below: f64, above: f64 },
    /// Signals that it depends on and that nothing bounds: `h2 of left`.
    Unbounded(Vec<String>),
}

/// The fastest modes of a subsystem by itself.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Fastest {
    /// Largest rate at which a mode dies out, 1/s.
    pub decay: f64,
    /// Largest rate at which one grows, 1/s.
    pub growth: f64,
    /// Largest angular frequency, rad/s.
    pub turn: f64,
}

/// What the file says about sampling.
pub(super) struct Sampling {
    /// Seconds.
    pub period: f64,
    /// Where the errors are to be part of w.
    pub charged: Option<Place>,
}

/// The same subsystems in discrete time; A, B, E and M of `continuous` are those of x' = A x + B u + E s + M d.
pub(super) fn sample(continuous: Vec<Subsystem>, sampling: &Sampling) -> Result<(Vec<Subsystem>, Hold), Diagnostics> {
    let mut errors = Diagnostics::default();
    let all: Vec<_> = continuous.iter().map(|s| local(s, sampling.period, &mut errors)).collect();
    let discrete = errors.finish(all.into_iter().collect::<Option<Vec<_>>>())?;
    let hold = Hold {
        charged: sampling.charged.is_some(),
        errors: hold_errors(&continuous, &discrete, sampling.period),
        fastest: continuous.iter().map(fastest).collect(),
    };
    match &sampling.charged {
        None => Ok((discrete, hold)),
        Some(place) => charged(discrete, &hold, place).map(|subsystems| (subsystems, hold)),
    }
}

/// One subsystem under inputs, coupling inputs and loads that are constant over a period.
fn local(s: &Subsystem, period: f64, errors: &mut Diagnostics) -> Option<Subsystem> {
    let from = stacked(&[&s.B, &s.E, &s.loads.M]);
    let after = sampled(&Enclosure::exactly(s.A.clone()), &Enclosure::exactly(from), period);
    let inaccurate = |e: &Enclosure| e.radius.amax() > LEAST_ACCURACY * e.middle.amax();
    match after {
        Some((A, from)) if !inaccurate(&A) && !inaccurate(&from) => {
            let part = |first: usize, count: usize| from.middle.columns(first, count).into_owned();
            let (m, e) = (s.m(), s.E.ncols());
            let (B, E, M) = (part(0, m), part(m, e), part(m + e, s.loads.len()));
            Some(Subsystem { A: A.middle, B, E, loads: super::Loads { M, ..s.loads.clone() }, ..s.clone() })
        }
        _ => {
            errors.push(not_sampled(s, period));
            None
        }
    }
}

fn not_sampled(s: &Subsystem, period: f64) -> Diagnostic {
    let error = Diagnostic::error(code::SAMPLING, format!("subsystem `{}` cannot be sampled every {period} s", s.name));
    let place = s.places.or_header(&s.places.A);
    let label = format!("e^(A h) is not known to {LEAST_ACCURACY:e} of its largest entry in double precision");
    let Fastest { decay, growth, turn } = fastest(s);
    let modes =
        format!("its modes die out at up to {decay:.3e} 1/s, grow at {growth:.3e} 1/s, turn at {turn:.3e} rad/s");
    error.at(place, label).note(modes).help("shorten `sample-time`, or check the units of time in A: seconds are meant")
}

fn fastest(s: &Subsystem) -> Fastest {
    let modes = eigenvalues(&s.A).unwrap_or_default();
    modes.into_iter().fold(Fastest::default(), |most, (re, im)| Fastest {
        decay: most.decay.max(-re),
        growth: most.growth.max(re),
        turn: most.turn.max(im.abs()),
    })
}

/// The subsystems with the errors as a part of w.
fn charged(subsystems: Vec<Subsystem>, hold: &Hold, place: &Place) -> Result<Vec<Subsystem>, Diagnostics> {
    let Some(all) = &hold.errors else { return Err(no_exact(&subsystems, place).into()) };
    let mut errors = Diagnostics::default();
    let with = |(s, own): (Subsystem, &Vec<HoldError>)| match ends(own) {
        Ok((below, above)) if below.amax().max(above.amax()) == 0.0 => Some(s),
        Ok((below, above)) => Some(disturbed(s, &below, &above, place)),
        Err(signals) => {
            errors.push(unbounded(&s, &signals, place));
            None
        }
    };
    let subsystems: Vec<_> = subsystems.into_iter().zip(all).map(with).collect();
    errors.finish(subsystems.into_iter().collect())
}

fn ends(errors: &[HoldError]) -> Result<(DVector<f64>, DVector<f64>), Vec<String>> {
    let mut ends = (DVector::zeros(errors.len()), DVector::zeros(errors.len()));
    let mut missing = Vec::new();
    for (k, error) in errors.iter().enumerate() {
        match error {
            HoldError::Within { below, above } => (ends.0[k], ends.1[k]) = (*below, *above),
            HoldError::Unbounded(signals) => missing.extend(signals.iter().cloned()),
        }
    }
    missing.sort();
    missing.dedup();
    if missing.is_empty() { Ok(ends) } else { Err(missing) }
}

fn unbounded(s: &Subsystem, signals: &[String], place: &Place) -> Diagnostic {
    let title = format!("what holding the coupling leaves out of `{}` has no bound", s.name);
    Diagnostic::error(code::HOLD_ERROR, title)
        .at(place.clone(), "asks for it as a disturbance")
        .note(format!("it depends on signals without bounds: {}", signals.join(", ")))
        .help("bound them from both sides in `x` or `u` of their subsystem")
}

fn no_exact(subsystems: &[Subsystem], place: &Place) -> Diagnostic {
    let states: usize = subsystems.iter().map(Subsystem::n).sum();
    let why = match states > MOST_STATES {
        true => format!("needs it: {states} states, at most {MOST_STATES}"),
        false => "needs it, and its exponential overflows".to_owned(),
    };
    let error = Diagnostic::error(code::HOLD_ERROR, "the whole network has no exact discretisation here");
    error.at(place.clone(), why).help("state a bound of your own as `w`, and write hold-error = \"report\"")
}

/// w + box, on the rows of w and the axes: the sum itself where w is a box, else a polytope around it.
fn disturbed(s: Subsystem, below: &DVector<f64>, above: &DVector<f64>, place: &Place) -> Subsystem {
    let n = s.n();
    let axis = |k: usize, sign: f64| RowDVector::from_fn(n, |_, c| if c == k { sign } else { 0.0 });
    let mut rows: Vec<(RowDVector<f64>, f64)> = Vec::new();
    let reach = |row: &RowDVector<f64>| {
        let ends = row.iter().enumerate().map(|(k, c)| if *c > 0.0 { c * above[k] } else { -c * below[k] });
        sum_upper(ends.map(|end| end * (1.0 + f64::EPSILON)))
    };
    if let Some(w) = &s.w {
        let stated = w.set.H.row_iter().zip(&w.set.h);
        rows.extend(stated.map(|(row, h)| (row.into_owned(), sum_upper([*h, reach(&row.into_owned())]))));
    }
    for (k, sign) in (0..n).flat_map(|k| [(k, 1.0), (k, -1.0)]) {
        let stated = rows.iter().any(|(row, _)| *row == axis(k, sign));
        if !stated {
            let own = s.w.as_ref().map_or(0.0, |w| w.hull[k]);
            rows.push((axis(k, sign), sum_upper([own, reach(&axis(k, sign))])));
        }
    }
    let H = DMatrix::from_fn(rows.len(), n, |r, c| rows[r].0[c]);
    let set = Polytope { H, h: DVector::from_fn(rows.len(), |r, _| rows[r].1) };
    let w = Bounded::new(set).unwrap_or_else(|_| unreachable!("every axis has its rows"));
    let mut places = s.places.clone();
    places.w.get_or_insert(place.clone());
    Subsystem { w: Some(w), places, ..s }
}

/// The model of all subsystems together, over all states, and inputs and loads of all.
struct Whole {
    A: Enclosure,
    /// Columns: inputs of the first subsystem, its loads, inputs of the second ...
    from: Enclosure,
}

impl Whole {
    fn of(subsystems: &[Subsystem]) -> Self {
        let states = offsets(subsystems, Subsystem::n);
        let inputs = offsets(subsystems, driven);
        let (n, m) = (states[subsystems.len()], inputs[subsystems.len()]);
        let mut whole =
            Self { A: Enclosure::exactly(DMatrix::zeros(n, n)), from: Enclosure::exactly(DMatrix::zeros(n, m)) };
        for (i, s) in subsystems.iter().enumerate() {
            put(&mut whole.A, (states[i], states[i]), &Enclosure::exactly(s.A.clone()));
            put(&mut whole.from, (states[i], inputs[i]), &Enclosure::exactly(stacked(&[&s.B, &s.loads.M])));
            for (&j, L) in &s.L {
                let z = Enclosure::product(&s.E, L);
                let from = |output: &DMatrix<f64>| z.times(&Enclosure::exactly(output.clone()));
                put(&mut whole.A, (states[i], states[j]), &from(&subsystems[j].Cz));
                put(&mut whole.from, (states[i], inputs[j]), &from(&subsystems[j].Dz));
            }
        }
        whole
    }
}

/// Inputs and loads.
fn driven(s: &Subsystem) -> usize {
    s.m() + s.loads.len()
}

fn offsets(subsystems: &[Subsystem], size: fn(&Subsystem) -> usize) -> Vec<usize> {
    let mut offsets = vec![0];
    subsystems.iter().for_each(|s| offsets.push(offsets[offsets.len() - 1] + size(s)));
    offsets
}

fn put(whole: &mut Enclosure, at: (usize, usize), block: &Enclosure) {
    whole.middle.view_mut(at, block.middle.shape()).copy_from(&block.middle);
    whole.radius.view_mut(at, block.radius.shape()).copy_from(&block.radius);
}

fn stacked(matrices: &[&DMatrix<f64>]) -> DMatrix<f64> {
    let rows = matrices[0].nrows();
    let columns: usize = matrices.iter().map(|matrix| matrix.ncols()).sum();
    DMatrix::from_iterator(rows, columns, matrices.iter().flat_map(|matrix| matrix.iter().copied()))
}

/// Bounds of what the exact discretisation of `continuous` adds to `discrete`; `None` for too large networks, and where
/// the network's exponential overflows.
fn hold_errors(continuous: &[Subsystem], discrete: &[Subsystem], period: f64) -> Option<Vec<Vec<HoldError>>> {
    if continuous.iter().map(Subsystem::n).sum::<usize>() > MOST_STATES {
        return None;
    }
    let (whole, held) = (Whole::of(continuous), Whole::of(discrete));
    let (A, from) = sampled(&whole.A, &whole.from, period)?;
    let (A, from) = (difference(&A, &held.A), difference(&from, &held.from));
    let extents: Vec<Extents> = continuous.iter().map(Extents::of).collect();
    let touched = Touched::of(continuous);
    let (states, inputs) = (offsets(continuous, Subsystem::n), offsets(continuous, driven));
    let error = |r: usize| {
        let mut sum = Sum::default();
        for (j, (extents, s)) in extents.iter().zip(continuous).enumerate() {
            let (of_x, of_u) = (&touched.by_states, &touched.by_inputs);
            sum.add(&s.name, &extents.x, &Row::of(&A, of_x, r, states[j], s.n()));
            sum.add(&s.name, &extents.u, &Row::of(&from, of_u, r, inputs[j], s.m()));
            sum.add(&s.name, &extents.d, &Row::of(&from, of_u, r, inputs[j] + s.m(), s.loads.len()));
        }
        sum.finish()
    };
    Some((0..continuous.len()).map(|i| (states[i]..states[i + 1]).map(error).collect()).collect())
}

fn difference(one: &Enclosure, other: &Enclosure) -> Enclosure {
    let middle = &one.middle - &other.middle;
    let radius = (&one.radius + &other.radius) * (1.0 + 4.0 * f64::EPSILON) + middle.abs() * f64::EPSILON;
    Enclosure { middle, radius }
}

/// Which entries of the difference can be other than 0: those with a way from a signal to a state on which the state of
/// one subsystem acts on another one. By any other way nothing is held that is not constant, and what the two computations
/// of the same number differ by is no error of holding.
struct Touched {
    /// (state, state).
    by_states: DMatrix<bool>,
    /// (state, input or load).
    by_inputs: DMatrix<bool>,
}

impl Touched {
    fn of(subsystems: &[Subsystem]) -> Self {
        let (states, inputs) = (offsets(subsystems, Subsystem::n), offsets(subsystems, driven));
        let (n, m) = (states[subsystems.len()], inputs[subsystems.len()]);
        let owner: Vec<usize> = subsystems.iter().enumerate().flat_map(|(i, s)| vec![i; s.n()]).collect();
        let mut acts_on: Vec<Vec<usize>> = vec![Vec::new(); n];
        let mut moved_by: Vec<Vec<usize>> = vec![Vec::new(); m];
        let note = |lists: &mut Vec<Vec<usize>>, row: usize, column: usize, block: &DMatrix<f64>| {
            let present = |(r, c): &(usize, usize)| block[(*r, *c)] != 0.0;
            let entries = (0..block.ncols()).flat_map(|c| (0..block.nrows()).map(move |r| (r, c)));
            entries.filter(present).for_each(|(r, c)| lists[column + c].push(row + r));
        };
        for (i, s) in subsystems.iter().enumerate() {
            note(&mut acts_on, states[i], states[i], &s.A);
            note(&mut moved_by, states[i], inputs[i], &stacked(&[&s.B, &s.loads.M]));
            for (&j, L) in &s.L {
                let through = s.E.abs() * L.abs();
                note(&mut acts_on, states[i], states[j], &(&through * subsystems[j].Cz.abs()));
                note(&mut moved_by, states[i], inputs[j], &(&through * subsystems[j].Dz.abs()));
            }
        }
        let reached = |from: &[usize]| crossed(from, &acts_on, &owner);
        let by = |columns: Vec<Vec<bool>>| DMatrix::from_fn(n, columns.len(), |r, c| columns[c][r]);
        let by_states = by((0..n).map(|c| reached(&[c])).collect());
        Self { by_states, by_inputs: by(moved_by.iter().map(|from| reached(from)).collect()) }
    }
}

/// Which states are reached from these on a way that leaves a subsystem.
fn crossed(from: &[usize], acts_on: &[Vec<usize>], owner: &[usize]) -> Vec<bool> {
    let mut seen = [vec![false; owner.len()], vec![false; owner.len()]];
    let mut queue: VecDeque<(usize, bool)> = VecDeque::new();
    let mut visit = |queue: &mut VecDeque<_>, state: usize, across: bool| {
        if !std::mem::replace(&mut seen[usize::from(across)][state], true) {
            queue.push_back((state, across));
        }
    };
    from.iter().for_each(|state| visit(&mut queue, *state, false));
    while let Some((state, across)) = queue.pop_front() {
        for &next in &acts_on[state] {
            visit(&mut queue, next, across || owner[next] != owner[state]);
        }
    }
    let [_, across] = seen;
    across
}

/// Where the signals of one subsystem may be.
struct Extents {
    x: Extent,
    u: Extent,
    d: Extent,
}

struct Extent {
    signals: Vec<Signal>,
    /// Of a box around it, perhaps infinite.
    min: DVector<f64>,
    max: DVector<f64>,
    /// The set itself with its hull, where it is no box.
    set: Option<(Polytope, DVector<f64>)>,
}

impl Extents {
    fn of(s: &Subsystem) -> Self {
        let d =
            Extent { signals: s.loads.signals.clone(), min: s.loads.min.clone(), max: s.loads.max.clone(), set: None };
        Self { x: Extent::of(&s.states, &s.X), u: Extent::of(&s.inputs, &s.U), d }
    }
}

impl Extent {
    fn of(signals: &[Signal], set: &NamedPolytope) -> Self {
        let n = signals.len();
        let mut min = DVector::from_element(n, f64::NEG_INFINITY);
        let mut max = DVector::from_element(n, f64::INFINITY);
        let mut is_box = true;
        for (row, &h) in set.H.row_iter().zip(&set.h) {
            let mut entries = row.iter().enumerate().filter(|(_, c)| **c != 0.0);
            match (entries.next(), entries.next()) {
                (Some((k, c)), None) if *c > 0.0 => max[k] = max[k].min((h / c).next_up()),
                (Some((k, c)), None) => min[k] = min[k].max((h / c).next_down()),
                _ => is_box = false,
            }
        }
        if is_box {
            return Self { signals: signals.to_vec(), min, max, set: None };
        }
        let set = Polytope { H: set.H.clone(), h: set.h.clone() };
        let hull = set.hull();
        let (min, max) = (min.sup(&-&hull), max.inf(&hull));
        Self { signals: signals.to_vec(), min, max, set: Some((set, hull)) }
    }

    fn is_open(&self, k: usize) -> bool {
        self.min[k].is_infinite() || self.max[k].is_infinite()
    }

    /// Upper bound of d' x over it, where d is 0 in open directions.
    fn support(&self, d: &DVector<f64>) -> f64 {
        let end = |k: usize| if d[k] > 0.0 { d[k] * self.max[k] } else { d[k] * self.min[k] };
        let ends = (0..d.len()).filter(|k| d[*k] != 0.0).map(|k| end(k) + end(k).abs() * f64::EPSILON);
        let by_box = sum_upper(ends);
        let by_set = self.set.as_ref().and_then(|(set, hull)| set.bound(d, hull));
        by_set.map_or(by_box, |by_set| by_set.min(by_box))
    }
}

/// A part of a row of the difference.
struct Row {
    middle: DVector<f64>,
    radius: DVector<f64>,
    /// Which entries are not 0 by the structure of the network.
    touched: Vec<bool>,
}

impl Row {
    fn of(whole: &Enclosure, touched: &DMatrix<bool>, r: usize, first: usize, count: usize) -> Self {
        let is_touched = |c: usize| touched[(r, first + c)];
        let entry = |matrix: &DMatrix<f64>, c: usize| if is_touched(c) { matrix[(r, first + c)] } else { 0.0 };
        let part = |matrix: &DMatrix<f64>| DVector::from_fn(count, |c, _| entry(matrix, c));
        Self { middle: part(&whole.middle), radius: part(&whole.radius), touched: (0..count).map(is_touched).collect() }
    }
}

/// Of the parts of one row.
#[derive(Default)]
struct Sum {
    above: Vec<f64>,
    below: Vec<f64>,
    unbounded: Vec<String>,
}

impl Sum {
    fn add(&mut self, owner: &str, extent: &Extent, row: &Row) {
        let mut d = row.middle.clone();
        for (k, signal) in extent.signals.iter().enumerate() {
            if !extent.is_open(k) {
                let rounding = row.radius[k] * extent.max[k].abs().max(extent.min[k].abs());
                self.above.push(rounding);
                self.below.push(rounding);
            } else {
                if row.touched[k] {
                    self.unbounded.push(format!("{} of {owner}", signal.name));
                }
                d[k] = 0.0;
            }
        }
        self.above.push(extent.support(&d));
        self.below.push(extent.support(&-d));
    }

    fn finish(mut self) -> HoldError {
        if !self.unbounded.is_empty() {
            self.unbounded.sort();
            self.unbounded.dedup();
            return HoldError::Unbounded(self.unbounded);
        }
        let end = |terms: Vec<f64>| up_to_digits(sum_upper(terms).max(0.0), 6);
        HoldError::Within { below: end(self.below), above: end(self.above) }
    }
}
