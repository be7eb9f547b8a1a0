//! How long outputs take to their set-points.

use super::history::Track;

/// An output has settled when what is left of the change is this share of it, and stays so.
const SHARE: f64 = 0.05;

/// Changes by less than this share of the range that Y leaves an output are none.
const LITTLE: f64 = 1e-3;

/// What became of one set-point of one output.
#[derive(Debug, Clone, PartialEq)]
pub struct Settling {
    pub output: String,
    pub unit: Option<String>,
    /// The step of the change.
    pub step: usize,
    pub set_point: f64,
    /// Where the output is to go: the set-point, or the end of Y that is nearest to it.
    pub target: f64,
    /// s from the change until the output is within 5 % of it, to stay until the next change; `None`: not before that.
    pub after: Option<f64>,
    /// How far the output is from the target at the end of that time.
    pub off: f64,
}

/// Of all outputs, in order of time for each.
pub fn settlings(track: &Track, period: f64) -> Vec<Settling> {
    let of = |k: usize| {
        let (asked, output) = (&track.set_points[k], &track.outputs[k]);
        let held = held(&asked.values);
        let (low, high) = (output.low.unwrap_or(f64::NEG_INFINITY), output.high.unwrap_or(f64::INFINITY));
        let little = if (high - low).is_finite() { LITTLE * (high - low) } else { 0.0 };
        held.into_iter().filter_map(move |(from, to)| {
            let set_point = asked.values[from];
            let target = set_point.clamp(low, high);
            let y = &output.values[from..to];
            let change = (target - y[0]).abs();
            let away = y.iter().rposition(|y| (y - target).abs() > SHARE * change);
            let settled = away.map_or(0, |last| last + 1);
            let after = (settled < y.len()).then_some(settled as f64 * period);
            let (name, unit) = (output.name.clone(), output.unit.clone());
            let off = y.last().map_or(0.0, |y| (y - target).abs());
            (change > little).then_some(Settling { output: name, unit, step: from, set_point, target, after, off })
        })
    };
    (0..track.outputs.len()).flat_map(of).collect()
}

/// Stretches of steps with one and the same set-point, longer than one step: those of a ramp are none.
fn held(values: &[f64]) -> Vec<(usize, usize)> {
    let mut stretches = Vec::new();
    let mut from = 0;
    for step in 1..=values.len() {
        if step == values.len() || values[step] != values[from] {
            if step - from > 1 {
                stretches.push((from, step));
            }
            from = step;
        }
    }
    stretches
}

#[cfg(test)]
mod tests {
    use super::held;

    #[test]
    fn ramps_are_not_held() {
        assert_eq!(held(&[0.0, 0.0, 0.1, 0.2, 0.3, 0.3, 0.3, 1.0, 1.0]), [(0, 2), (4, 7), (7, 9)]);
        assert_eq!(held(&[1.0, 1.0]), [(0, 2)]);
        assert_eq!(held(&[]), []);
    }
}
