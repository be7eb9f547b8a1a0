//! What was measured, condensed.

use std::fmt;

use dpc_runtime::tables::DpcProblem;

use crate::record::Parameters;
use crate::timing::Limits;

/// One step of one solver.
#[derive(Debug, Clone, Default)]
pub struct Step {
    /// Of every pass.
    ticks: Vec<u64>,
    iterations: usize,
    w: Vec<f64>,
    solved: bool,
}

impl Step {
    /// One more pass.
    pub fn keep(&mut self, ticks: u64, iterations: usize, w: &[f64], solved: bool) {
        self.ticks.push(ticks);
        (self.iterations, self.solved) = (iterations, solved);
        if self.w.is_empty() {
            self.w = w.to_vec();
        } else {
            self.w.copy_from_slice(w);
        }
    }
}

/// Microseconds at rest and in transients, and how good the answers are.
#[derive(Debug, Clone)]
pub struct Figures {
    pub name: String,
    pub rest: f64,
    pub mean: f64,
    pub high: f64,
    pub most: f64,
    pub iterations: f64,
    pub most_iterations: usize,
    /// Largest |w - truth| / |truth|.
    pub error: f64,
    pub unsolved: usize,
}

impl Step {
    /// Mean of the faster half of the passes: the clock is coarse, so that their minimum would be too small, and whatever else
    /// ran on the machine is in the slower half.
    fn time(&self) -> f64 {
        let mut ticks = self.ticks.clone();
        ticks.sort_unstable();
        ticks.truncate(ticks.len().div_ceil(2));
        ticks.iter().sum::<u64>() as f64 / ticks.len() as f64
    }
}

impl Figures {
    pub fn new(
        name: String,
        steps: &[Step],
        rests: &[bool],
        truth: &[Option<Vec<f64>>],
        (rate, empty): (f64, f64),
    ) -> Self {
        let time = |step: &Step| (step.time() - empty) * rate * 1e-3;
        let part = |resting: bool| -> Vec<&Step> {
            let timed = steps.iter().zip(rests).filter(|(step, rests)| **rests == resting && !step.ticks.is_empty());
            timed.map(|(step, _)| step).collect()
        };
        let (rest, moving) = (part(true), part(false));
        let mut times: Vec<f64> = moving.iter().map(|step| time(step)).collect();
        times.sort_by(f64::total_cmp);
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
        let error = |step: &Step, truth: &Vec<f64>| {
            if step.w.is_empty() {
                return 0.0;
            }
            let size = truth.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
            let far = step.w.iter().zip(truth).fold(0.0, |far: f64, (a, b)| far.max((a - b).abs()));
            if size > 0.0 { far / size } else { far }
        };
        Self {
            name,
            rest: mean(&rest.iter().map(|step| time(step)).collect::<Vec<_>>()),
            mean: mean(&times),
            high: times.get(times.len() * 99 / 100).copied().unwrap_or(f64::NAN),
            most: times.last().copied().unwrap_or(f64::NAN),
            iterations: mean(&moving.iter().map(|step| step.iterations as f64).collect::<Vec<_>>()),
            most_iterations: moving.iter().map(|step| step.iterations).max().unwrap_or(0),
            error: steps.iter().zip(truth).filter_map(|(s, truth)| Some(error(s, truth.as_ref()?))).fold(0.0, f64::max),
            unsolved: steps.iter().filter(|step| !step.ticks.is_empty() && !step.solved).count(),
        }
    }
}

/// Everything about one problem.
#[derive(Debug)]
pub struct Report {
    pub name: String,
    pub unknowns: usize,
    pub rows: usize,
    pub bytes: usize,
    /// Steps not at rest, and those of them whose minimiser is proved.
    pub moving: usize,
    pub proved: usize,
    pub figures: Vec<Figures>,
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, unknowns, rows, bytes, moving, proved, figures } = self;
        writeln!(
            f,
            "{name}: {unknowns} unknowns, {rows} rows, {bytes} bytes of tables; {moving} steps in transients, {proved} proved"
        )?;
        writeln!(f, "  us                rest     mean      99%      max  iterations  error  unsolved")?;
        for x in figures {
            write!(f, "  {:<15}{:>7.3} {:>8.3} {:>8.3} {:>8.3}", x.name, x.rest, x.mean, x.high, x.most)?;
            if x.name == "floor" {
                writeln!(f)?;
            } else {
                writeln!(f, "{:>7.2} /{:>3}  {:.0e}{:>8}", x.iterations, x.most_iterations, x.error, x.unsolved)?;
            }
        }
        Ok(())
    }
}

/// Behind the name of a peer that was timed from the limits to w alone.
pub const ALONE: &str = " alone";

/// Ratios: rest over the floor, and the best peer over ours; then over ours the best peer alone, which is given the limits and
/// not asked for the plan.
pub fn summary(reports: &[Report]) -> String {
    table("best peer / this", reports, |name| !name.ends_with(ALONE))
        + "\n"
        + &table("best peer alone / this", reports, |name| name.ends_with(ALONE))
}

fn table(title: &str, reports: &[Report], counts: impl Fn(&str) -> bool) -> String {
    let mut text = format!("{title:<24}{:>12}{:>14}{:>14}{:>14}{:>14}\n", "rest", "mean", "99%", "max", "rest / floor");
    for report in reports {
        let [ours, floor, peers @ ..] = &report.figures[..] else { continue };
        let peers = || peers.iter().filter(|peer| counts(&peer.name));
        let best = |of: fn(&Figures) -> f64| peers().map(of).fold(f64::INFINITY, f64::min) / of(ours);
        text += &format!(
            "{:<24}{:>12.2}{:>14.2}{:>14.2}{:>14.2}{:>14.2}\n",
            report.name,
            best(|x| x.rest),
            best(|x| x.mean),
            best(|x| x.high),
            best(|x| x.most),
            ours.rest / floor.rest
        );
    }
    text
}

/// The limits of the rows, less what the parameters make of their offsets: only what depends on the parameters is computed, and
/// of that only the entries that are there, as whoever calls another solver would have it computed.
#[inline]
pub fn limits_at<
    const NX: usize,
    const NU: usize,
    const N: usize,
    const NV: usize,
    const NR: usize,
    const NT: usize,
    const NS: usize,
    const NQ: usize,
>(
    problem: &DpcProblem<NX, NU, N, NV, NR, NT, NS, NQ>,
    at: &Parameters<NX, NU, N>,
    lower: &mut [f64],
    upper: &mut [f64],
) {
    lower.copy_from_slice(&problem.lower);
    upper.copy_from_slice(&problem.upper);
    let mut rows = lower.iter_mut().zip(upper);
    let mut shift = |offset: f64| {
        if let Some((lower, upper)) = rows.next() {
            *lower -= offset;
            *upper -= offset;
        }
    };
    problem.tube.iter().for_each(|row| shift(inner(row, &at.e)));
    problem.state.iter().for_each(|row| shift(inner(&row.row, &at.x_ref[row.stage])));
    problem.input.iter().for_each(|row| shift(inner(&row.row, &at.u_ref[row.stage])));
}

#[inline]
fn inner<const COUNT: usize>(x: &[f64; COUNT], y: &[f64; COUNT]) -> f64 {
    x.iter().zip(y).map(|(x, y)| x * y).sum()
}

/// Whether `e` lies inside the tube.
#[inline]
pub fn floor<const NX: usize>(tube: &[[f64; NX]], e: &[f64; NX], lower: &[f64], upper: &[f64]) -> bool {
    tube.iter().zip(lower.iter().zip(upper)).fold(true, |inside, (row, (low, high))| {
        let value: f64 = row.iter().zip(e).map(|(a, b)| a * b).sum();
        inside & (*low <= value) & (value <= *high)
    })
}

/// Whether every number lies between its limits.
#[inline]
pub fn between(low: &[f64], values: &[f64], high: &[f64]) -> bool {
    values.iter().zip(low.iter().zip(high)).fold(true, |inside, (x, (low, high))| inside & (low <= x) & (x <= high))
}

/// The minimiser on the rows that `set` says are active, orthogonalised twice, if it satisfies the conditions of Karush, Kuhn
/// and Tucker: however the set was found, they prove it.
pub fn truth(rows: &[Vec<f64>], limits: &Limits, set: &[(usize, bool)]) -> Option<Vec<f64>> {
    let n = rows[0].len();
    let side = |&(r, upper): &(usize, bool)| -> (Vec<f64>, f64) {
        let sign = if upper { -1.0 } else { 1.0 };
        (rows[r].iter().map(|x| sign * x).collect(), sign * if upper { limits.upper[r] } else { limits.lower[r] })
    };
    let active: Vec<(Vec<f64>, f64)> = set.iter().map(side).collect();
    let (w, multipliers) = on_rows(n, &active);
    let size = w.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
    let least = multipliers.iter().copied().fold(0.0, f64::min);
    let most = multipliers.iter().copied().fold(0.0, f64::max);
    let admits = rows.iter().zip(limits.lower.iter().zip(&limits.upper)).all(|(row, (lower, upper))| {
        let (value, slack) = (dot(row, &w), 1e-11 * (1.0 + size));
        lower - slack <= value && value <= upper + slack
    });
    (admits && least >= -1e-9 * most).then_some(w)
}

fn dot(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(x, y)| x * y).sum()
}

/// The shortest w with normal . w = limit for all rows, and its coefficients over their normals.
fn on_rows(n: usize, active: &[(Vec<f64>, f64)]) -> (Vec<f64>, Vec<f64>) {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let mut w = vec![0.0; n];
    for (normal, limit) in active {
        let mut rest = normal.clone();
        for q in basis.iter().chain(&basis) {
            let along = dot(q, &rest);
            rest.iter_mut().zip(q).for_each(|(x, q)| *x -= along * q);
        }
        let length = dot(&rest, &rest).sqrt();
        rest.iter_mut().for_each(|x| *x /= length);
        let step = (limit - dot(normal, &w)) / dot(normal, &rest);
        w.iter_mut().zip(&rest).for_each(|(w, q)| *w += step * q);
        basis.push(rest);
    }
    // N = Q R: R multipliers = Q'w, backwards.
    let mut multipliers = vec![0.0; active.len()];
    for k in (0..active.len()).rev() {
        let later: f64 = (k + 1..active.len()).map(|j| dot(&basis[k], &active[j].0) * multipliers[j]).sum();
        multipliers[k] = (dot(&basis[k], &w) - later) / dot(&basis[k], &active[k].0);
    }
    (w, multipliers)
}
