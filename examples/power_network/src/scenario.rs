//! What acts on the network over time, and what is asked of it.

use example_kit::random::Random;

use crate::areas::{AREA, AREAS, SAMPLE_TIME};

/// Piecewise constant loads and set-points.
#[derive(Debug, Clone)]
pub struct Scenario {
    /// From this time on, in s, these loads dPL; in order of time, none before the first.
    pub loads: Vec<(f64, [f64; AREAS])>,
    /// The same of the set-points of dtheta, 0 before the first.
    pub set_points: Vec<(f64, [f64; AREAS])>,
    pub steps: usize,
}

impl Scenario {
    /// Scenario 1 of the benchmark, which ends at 100 s; here the last loads stay for 300 s.
    pub fn benchmark() -> Self {
        let loads = vec![
            (5.0, [0.15, 0.0, 0.0, 0.0]),
            (15.0, [0.15, -0.15, 0.0, 0.0]),
            (20.0, [0.15, -0.15, 0.12, 0.0]),
            (40.0, [0.15, -0.15, -0.12, 0.28]),
        ];
        Self { loads, set_points: Vec::new(), steps: (300.0 / SAMPLE_TIME) as usize }
    }

    /// Loads at the ends of their ranges, three times in four, or between them, anew after 1 to 25 steps, each area by itself;
    /// set-points from twice the ranges in `outputs`, anew after 20 to 80 steps.
    pub fn random(random: &mut Random, outputs: &[[f64; 2]], steps: usize) -> Self {
        let mut loads = vec![(0.0, [0.0; AREAS])];
        let mut next = [0; AREAS];
        for step in 0..steps {
            let mut now = loads[loads.len() - 1].1;
            for i in (0..AREAS).filter(|&i| next[i] == step) {
                now[i] = load(random, AREA[i].load);
            }
            next.iter_mut().filter(|next| **next == step).for_each(|next| *next += random.integer(1, 25));
            loads.push((step as f64 * SAMPLE_TIME, now));
        }
        Self { loads, set_points: set_points(random, outputs, steps), steps }
    }

    /// Loads at step `step`.
    pub fn loads(&self, step: usize) -> [f64; AREAS] {
        at(&self.loads, step)
    }

    /// Set-points of dtheta at step `step`, rad.
    pub fn set_points(&self, step: usize) -> [f64; AREAS] {
        at(&self.set_points, step)
    }
}

fn load(random: &mut Random, [low, high]: [f64; 2]) -> f64 {
    match random.integer(0, 3) {
        0 => random.between(low, high),
        1 => 0.0,
        _ if random.integer(0, 1) == 0 => low,
        _ => high,
    }
}

fn set_points(random: &mut Random, outputs: &[[f64; 2]], steps: usize) -> Vec<(f64, [f64; AREAS])> {
    let mut changes = Vec::new();
    let mut step = 0;
    while step < steps {
        let wished = std::array::from_fn(|i| random.between(2.0 * outputs[i][0], 2.0 * outputs[i][1]));
        changes.push((step as f64 * SAMPLE_TIME, wished));
        step += random.integer(20, 80);
    }
    changes
}

fn at(changes: &[(f64, [f64; AREAS])], step: usize) -> [f64; AREAS] {
    let since = changes.partition_point(|(time, _)| *time <= step as f64 * SAMPLE_TIME);
    since.checked_sub(1).map_or([0.0; AREAS], |last| changes[last].1)
}

#[cfg(test)]
mod tests {
    use example_kit::random::Random;

    use super::Scenario;
    use crate::areas::{AREA, AREAS};

    #[test]
    fn loads_come_when_the_benchmark_says() {
        let scenario = Scenario::benchmark();
        assert_eq!(scenario.loads(4), [0.0; 4]);
        assert_eq!(scenario.loads(5), [0.15, 0.0, 0.0, 0.0]);
        assert_eq!(scenario.loads(39), [0.15, -0.15, 0.12, 0.0]);
        assert_eq!(scenario.loads(299), [0.15, -0.15, -0.12, 0.28]);
        assert_eq!(scenario.set_points(299), [0.0; 4]);
    }

    #[test]
    fn random_loads_use_their_ranges_and_keep_them() {
        let scenario = Scenario::random(&mut Random::new(1), &[[-0.01, 0.01]; AREAS], 2000);
        for (i, area) in AREA.iter().enumerate() {
            let loads: Vec<f64> = (0..2000).map(|step| scenario.loads(step)[i]).collect();
            let ends = loads.iter().fold([0.0f64; 2], |[low, high], d| [low.min(*d), high.max(*d)]);
            assert_eq!(ends, area.load, "area {i}");
            let jump = loads.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
            assert_eq!(jump, area.load[1] - area.load[0], "area {i}");
        }
    }
}
