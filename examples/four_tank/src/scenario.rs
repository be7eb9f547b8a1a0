//! What is asked of the controllers over time.

use crate::plant::SAMPLE_TIME;
use crate::random::Random;
use crate::sets::Promise;

/// Piecewise constant set-points of (y1, y2), cm.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    pub name: &'static str,
    /// From this time on, in s, these set-points; in order of time, the first at 0 s.
    pub changes: Vec<(f64, [f64; 2])>,
    /// Length in sampling periods.
    pub steps: usize,
}

impl Scenario {
    /// Steps up and down in both outputs; y1 = 2.5 is the one the paper reports as infeasible for its own design, and
    /// y1 = 9 at the end lies outside Y_1. At epsilon = 0.02 cm per step a reference needs 50 s for 2 cm.
    pub fn nominal() -> Self {
        let changes = vec![
            (0.0, [1.0, 1.0]),
            (150.0, [2.0, -1.0]),
            (300.0, [2.5, 1.0]),
            (450.0, [-1.0, 0.5]),
            (600.0, [9.0, 0.5]),
        ];
        Self { name: "nominal", changes, steps: steps(800.0) }
    }

    /// y1 = 9 cm lies outside Y_1: the output must come to rest at the nearest point of Y_1.
    pub fn clipping() -> Self {
        Self { name: "clipping", changes: vec![(0.0, [9.0, 0.5])], steps: steps(1500.0) }
    }

    /// y1 = 2.5 cm, which the paper reports as infeasible for its own design, held for long.
    pub fn held() -> Self {
        Self { name: "held", changes: vec![(0.0, [2.5, 1.0])], steps: steps(1500.0) }
    }

    /// New set-points after 20 to 80 s each time, drawn from the ranges of Y (`[low, high]` per output, cm) stretched
    /// to twice their width, so that about three in four ask for something outside in at least one output.
    pub fn random(random: &mut Random, ranges: [[f64; 2]; 2], steps: usize) -> Self {
        let mut changes = Vec::new();
        let mut step = 0;
        while step < steps {
            let wished = ranges.map(|[low, high]| {
                let margin = (high - low) / 2.0;
                random.between(low - margin, high + margin)
            });
            changes.push((step as f64 * SAMPLE_TIME, wished));
            step += random.integer(40, 160);
        }
        Self { name: "random", changes, steps }
    }

    /// Set-points at step `step`, cm.
    pub fn set_points(&self, step: usize) -> [f64; 2] {
        let now = step as f64 * SAMPLE_TIME;
        let since = self.changes.partition_point(|(time, _)| *time <= now);
        self.changes[since.max(1) - 1].1
    }
}

/// Ends of Y_1 and Y_2, cm.
pub fn output_ranges(promise: &Promise) -> [[f64; 2]; 2] {
    [0, 1].map(|i| promise.subsystems[i].y_set.interval(0))
}

fn steps(seconds: f64) -> usize {
    (seconds / SAMPLE_TIME).round() as usize
}

#[cfg(test)]
mod tests {
    use super::Scenario;
    use crate::random::Random;

    #[test]
    fn set_points_change_when_they_should() {
        let scenario = Scenario::nominal();
        assert_eq!(scenario.steps, 1600);
        assert_eq!(scenario.set_points(0), [1.0, 1.0]);
        assert_eq!(scenario.set_points(299), [1.0, 1.0]);
        assert_eq!(scenario.set_points(300), [2.0, -1.0]);
        assert_eq!(scenario.set_points(1199), [-1.0, 0.5]);
        assert_eq!(scenario.set_points(1200), [9.0, 0.5]);
    }

    #[test]
    fn random_set_points_lie_inside_and_outside() {
        let ranges = [[-1.0, 2.0], [-3.0, 1.0]];
        let scenario = Scenario::random(&mut Random::new(3), ranges, 100_000);
        let inside = |y: &[f64; 2]| y.iter().zip(ranges).all(|(y, [low, high])| (low..=high).contains(y));
        let within = scenario.changes.iter().filter(|(_, y)| inside(y)).count();
        let share = within as f64 / scenario.changes.len() as f64;
        assert!((0.2..0.3).contains(&share), "{share}");
        assert!(scenario.changes.windows(2).all(|pair| (20.0..=80.0).contains(&(pair[1].0 - pair[0].0))));
    }
}
