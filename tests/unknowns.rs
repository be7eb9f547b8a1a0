//! What acts on a subsystem besides its inputs and neighbours: disturbances, measurement errors, loads. Worst cases by corners.
#![expect(non_snake_case, reason = "the paper's symbols")]

use dpc_codegen::network::Subsystem;
use nalgebra::{DMatrix, DVector};

use crate::Random;
use crate::random_network::Region;

/// x+ = A x + B u + E s + w + M d; the controller is given x + v and d.
#[derive(Debug, Clone)]
pub struct Unknowns {
    /// Corners of the set of w; {0} where there is none.
    pub corners: Vec<DVector<f64>>,
    /// |v_k| <= entry k.
    pub error: DVector<f64>,
    /// n x (number of loads).
    pub M: DMatrix<f64>,
    pub loads: Vec<Load>,
}

/// min <= d <= max, |d+ - d| <= rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    pub min: f64,
    pub max: f64,
    pub rate: f64,
}

/// A subsystem's unknowns and the lines of its table that state them.
#[derive(Debug, Clone)]
pub struct Stated {
    pub unknowns: Unknowns,
    pub w: String,
    pub error: String,
    pub loads: String,
}

impl Unknowns {
    /// Of a subsystem with `n` states.
    pub fn none(n: usize) -> Self {
        Self { corners: vec![DVector::zeros(n)], error: DVector::zeros(n), M: DMatrix::zeros(n, 0), loads: Vec::new() }
    }

    /// As the compiler read them.
    pub fn of(s: &Subsystem) -> Self {
        let d = &s.loads;
        let load = |k: usize| Load { min: d.min[k], max: d.max[k], rate: d.rate[k] };
        Self {
            corners: s.w.as_ref().map_or(vec![DVector::zeros(s.n())], |w| corners(&w.set.H, &w.set.h)),
            error: s.measurement_error.clone(),
            M: d.M.clone(),
            loads: (0..d.min.len()).map(load).collect(),
        }
    }

    /// Whether there is nothing that the controller does not know: w and v are 0.
    pub fn is_known(&self) -> bool {
        self.error.amax() == 0.0 && self.corners.iter().all(|w| w.amax() == 0.0)
    }

    /// The w with the largest d'w.
    pub fn worst_w(&self, d: &DVector<f64>) -> &DVector<f64> {
        let best = self.corners.iter().max_by(|a, b| d.dot(a).total_cmp(&d.dot(b)));
        best.expect("a bounded set that holds 0 has a corner")
    }

    /// Largest |d'w|.
    pub fn reach_of_w(&self, d: &DVector<f64>) -> f64 {
        self.corners.iter().map(|w| d.dot(w).abs()).fold(0.0, f64::max)
    }

    /// Largest d'v.
    pub fn reach_of_v(&self, d: &DVector<f64>) -> f64 {
        d.iter().zip(&self.error).map(|(d, v)| d.abs() * v).sum()
    }

    /// Largest d'M (d_t - d_{t-steps}).
    pub fn reach_of_lag(&self, d: &DVector<f64>, steps: usize) -> f64 {
        self.M.tr_mul(d).iter().zip(&self.loads).map(|(m, load)| m.abs() * load.change(steps)).sum()
    }

    /// The v with the signs of d.
    pub fn error_along(&self, d: &DVector<f64>) -> DVector<f64> {
        self.error.zip_map(d, |v, d| if d < 0.0 { -v } else { v })
    }

    /// Largest difference to another description of the same, relative; w by its reach in a few directions.
    pub fn difference(&self, other: &Self, random: &mut Random) -> f64 {
        if self.M.shape() != other.M.shape() {
            return f64::INFINITY;
        }
        let numbers = |one: &Self| {
            let loads = one.loads.iter().flat_map(|d| [d.min, d.max, d.rate]);
            one.error.iter().chain(&one.M).copied().chain(loads).collect::<Vec<_>>()
        };
        let relative = |(a, b): (f64, f64)| if a == b { 0.0 } else { (a - b).abs() / a.abs().max(b.abs()) };
        let plain = numbers(self).into_iter().zip(numbers(other)).map(relative).fold(0.0, f64::max);
        let directions = (0..8).map(|_| random.direction(self.error.len()));
        directions.fold(plain, |worst, d| worst.max(relative((d.dot(self.worst_w(&d)), d.dot(other.worst_w(&d))))))
    }
}

impl Load {
    /// How far it can be from what it was `steps` steps before.
    pub fn change(&self, steps: usize) -> f64 {
        (self.rate * steps as f64).min(self.max - self.min)
    }
}

impl Stated {
    /// Of a subsystem with `n` states, in the names of `subsystem`: each kind or none, about as large as `size`.
    pub fn new(random: &mut Random, subsystem: &str, n: usize, size: f64) -> Self {
        let mut stated =
            Self { unknowns: Unknowns::none(n), w: String::new(), error: String::new(), loads: String::new() };
        if random.chance(0.6) {
            stated.draw_w(random, n, size);
        }
        if random.chance(0.5) {
            stated.draw_error(random, n, size);
        }
        if random.chance(0.5) {
            stated.draw_loads(random, subsystem, n, size);
        }
        stated
    }

    /// Lines of the table.
    pub fn toml(&self) -> String {
        [self.w.as_str(), &self.error, &self.loads].concat()
    }

    /// A box, perhaps flat, or with corners cut off; or a slanted polytope alone.
    fn draw_w(&mut self, random: &mut Random, n: usize, size: f64) {
        let mut end = || (0..n).map(|_| extent(random, size)).collect::<Vec<_>>();
        let (mut min, mut max) = (end(), end());
        let mut rows = Vec::new();
        match random.below(3) {
            0 => {
                let cut = |random: &mut Random| (0..n).map(|_| short(random.between(-1.0, 1.0))).collect();
                rows =
                    (0..1 + random.below(2)).map(|_| (cut(random), short(size * random.between(0.1, 1.0)))).collect();
            }
            1 => {
                rows = slanted(random, n, size);
                (min, max) = (vec![f64::INFINITY; n], vec![f64::INFINITY; n]);
            }
            _ => {}
        }
        let region = Region { min: min.iter().map(|end| 0.0 - end).collect(), max, rows };
        let (H, h) = region.halfspaces();
        self.unknowns.corners = corners(&H, &h);
        self.w = format!("w = {}\n", region.toml());
    }

    fn draw_error(&mut self, random: &mut Random, n: usize, size: f64) {
        let every = random.chance(0.3);
        let first = extent(random, size);
        let ends: Vec<f64> = (0..n).map(|_| if every { first } else { extent(random, size) }).collect();
        let written = if every { format!("{first:?}") } else { format!("{ends:?}") };
        self.error = format!("measurement-error = {{ max = {written} }}\n");
        self.unknowns.error = DVector::from_vec(ends);
    }

    fn draw_loads(&mut self, random: &mut Random, subsystem: &str, n: usize, size: f64) {
        let count = 1 + random.below(2);
        let M = DMatrix::from_fn(n, count, |_, _| match random.chance(0.6) {
            true => short(random.sign() * random.between(0.2, 1.0)),
            false => 0.0,
        });
        let loads: Vec<Load> = (0..count).map(|_| load(random, size)).collect();
        let names: Vec<String> = (1..=count).map(|k| format!("d{subsystem}{k}")).collect();
        let [min, max, rate] =
            [|d: &Load| d.min, |d: &Load| d.max, |d: &Load| d.rate].map(|of| loads.iter().map(of).collect::<Vec<_>>());
        let rows: Vec<Vec<f64>> = M.row_iter().map(|row| row.iter().copied().collect()).collect();
        self.loads = format!("loads = {names:?}\nM = {rows:?}\nd = {{ min = {min:?}, max = {max:?} }}\n");
        if random.chance(0.8) {
            self.loads += &format!("d-rate = {rate:?}\n");
            self.unknowns.loads = loads.iter().map(|d| Load { rate: d.rate.min(d.max - d.min), ..*d }).collect();
        } else {
            self.unknowns.loads = loads.iter().map(|d| Load { rate: d.max - d.min, ..*d }).collect();
        }
        self.unknowns.M = M;
    }
}

/// The half-width of something about as large as `size`; sometimes 0.
fn extent(random: &mut Random, size: f64) -> f64 {
    if random.chance(0.2) { 0.0 } else { short(size * random.between(0.1, 1.0)) }
}

/// Loads are a few times larger than what is unknown, and slow, or they could be as well unknown.
fn load(random: &mut Random, size: f64) -> Load {
    let [low, high] = [3.0, 3.0].map(|times| extent(random, times * size));
    let rate = short((low + high) * random.magnitude(2e-3, 2.0));
    Load { min: 0.0 - low, max: high, rate }
}

/// A simplex around 0 in random axes.
fn slanted(random: &mut Random, n: usize, size: f64) -> Vec<(Vec<f64>, f64)> {
    let axes = DMatrix::from_fn(n, n, |r, k| f64::from(r == k) + short(random.between(-0.4, 0.4) / n as f64));
    let mut rows: Vec<DVector<f64>> = axes.row_iter().map(|row| -row.transpose()).collect();
    rows.push(axes.row_sum().transpose().map(short));
    rows.into_iter().map(|row| (row.iter().copied().collect(), short(size * random.between(0.1, 1.0)))).collect()
}

/// Three significant digits, as a person would write.
fn short(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// The corners of {H w <= h} by trying every choice of n rows.
///
/// # Panics
/// The set is not bounded or does not hold 0.
pub fn corners(H: &DMatrix<f64>, h: &DVector<f64>) -> Vec<DVector<f64>> {
    let n = H.ncols();
    let size = h.amax();
    let mut found: Vec<DVector<f64>> = Vec::new();
    for rows in choices(H.nrows(), n) {
        let chosen = H.select_rows(&rows);
        let Some(w) = chosen.full_piv_lu().solve(&h.select_rows(&rows)) else { continue };
        let inside = (H * &w).iter().zip(h).all(|(value, limit)| *value <= limit + 1e-11 * size);
        if inside && found.iter().all(|other| (other - &w).amax() > 1e-12 * size) {
            found.push(w);
        }
    }
    assert!(!found.is_empty(), "a bounded polytope that holds 0 has a corner");
    found
}

/// All ways to choose `k` of 0, ..., `n` - 1.
fn choices(n: usize, k: usize) -> Vec<Vec<usize>> {
    if k == 0 {
        return vec![Vec::new()];
    }
    let with_last = |last: usize| {
        choices(last, k - 1).into_iter().map(move |mut rest| {
            rest.push(last);
            rest
        })
    };
    (k - 1..n).flat_map(with_last).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corners_of_a_cut_square() {
        let H = DMatrix::from_row_slice(5, 2, &[1.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, -1.0, 1.0, 1.0]);
        let h = DVector::from_vec(vec![1.0, 1.0, 1.0, 0.0, 1.5]);
        let found = corners(&H, &h);
        assert_eq!(found.len(), 5);
        let farthest = found.iter().map(|w| w[0] + w[1]).fold(0.0, f64::max);
        assert!((farthest - 1.5).abs() < 1e-15);
    }

    #[test]
    fn a_point_has_one_corner() {
        let H = DMatrix::from_row_slice(2, 1, &[1.0, -1.0]);
        assert_eq!(corners(&H, &DVector::zeros(2)), [DVector::zeros(1)]);
    }
}
