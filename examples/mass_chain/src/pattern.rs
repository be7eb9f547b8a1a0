//! Set-points of the whole chain.

use example_kit::sets::Promise;

/// Names of the patterns, in the order they are asked for.
pub const NAMES: [&str; 5] = ["together", "alternating", "ramp", "beyond Y", "rest"];

/// Steps for the transients, after the references have had the time to cross Y.
const SETTLING: f64 = 60.0;
/// Steps per pattern, at most: of slow designs only a part of the way is seen.
const LONGEST: f64 = 1000.0;

/// One pattern after the other, each held for as many steps.
#[derive(Debug, Clone)]
pub struct Patterns {
    patterns: Vec<Vec<f64>>,
    held: usize,
    /// Whether every pattern is held until references have arrived.
    pub arrive: bool,
}

impl Patterns {
    /// Inside Y: all masses to one side, every other one to the other side, from one side to the other along the chain; then all
    /// of them outside of Y, and back to rest. `epsilon` is the largest step of the references.
    pub fn new(promise: &Promise, epsilon: f64) -> Self {
        let ranges = promise.output_ranges();
        let length = ranges.len();
        let along = |i: usize| 2.0 * i as f64 / (length - 1).max(1) as f64 - 1.0;
        let side = |of: &dyn Fn(usize) -> f64| (0..length).map(|i| of(i) * ranges[i][1]).collect();
        let patterns = vec![
            side(&|_| 0.8),
            side(&|i| if i.is_multiple_of(2) { 0.8 } else { -0.8 }),
            side(&|i| 0.8 * along(i)),
            side(&|i| if i.is_multiple_of(3) { -3.0 } else { 3.0 }),
            vec![0.0; length],
        ];
        let widest = ranges.iter().map(|[low, high]| high - low).fold(0.0, f64::max);
        let needed = (widest / epsilon).ceil() + SETTLING;
        Self { patterns, held: needed.min(LONGEST) as usize, arrive: needed <= LONGEST }
    }

    pub fn steps(&self) -> usize {
        self.held * self.patterns.len()
    }

    pub fn set_points(&self, step: usize) -> &[f64] {
        &self.patterns[(step / self.held).min(self.patterns.len() - 1)]
    }

    /// Last step of each pattern.
    pub fn ends(&self) -> impl Iterator<Item = usize> {
        (1..=self.patterns.len()).map(|k| k * self.held - 1)
    }
}
