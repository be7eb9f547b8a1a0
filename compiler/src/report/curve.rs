//! Fewer points that draw the same curve.

/// At most about `most` points of a curve over time: of each stretch the lowest and the highest, and none that lies on the line
/// between its neighbours.
pub fn thinned(points: &[[f64; 2]], most: usize) -> Vec<[f64; 2]> {
    let finite: Vec<[f64; 2]> = points.iter().copied().filter(|[_, y]| y.is_finite()).collect();
    let stretch = (2 * finite.len()).div_ceil(most.max(2)).max(1);
    if stretch <= 2 {
        return bends(finite);
    }
    let extremes = finite.chunks(stretch).flat_map(|chunk| {
        let by_height = |a: &&[f64; 2], b: &&[f64; 2]| a[1].total_cmp(&b[1]);
        let both = chunk.iter().min_by(by_height).zip(chunk.iter().max_by(by_height));
        let (low, high) = both.map_or(([0.0; 2], [0.0; 2]), |(low, high)| (*low, *high));
        if low[0] <= high[0] { [low, high] } else { [high, low] }
    });
    let mut kept: Vec<[f64; 2]> =
        finite.first().copied().into_iter().chain(extremes).chain(finite.last().copied()).collect();
    kept.dedup();
    bends(kept)
}

/// Each value up to the next one's time, the last one up to `end`.
pub fn held(points: &[[f64; 2]], end: f64) -> Vec<[f64; 2]> {
    let next = |k: usize| points.get(k + 1).map_or(end, |next| next[0]);
    let steps = points.iter().enumerate().flat_map(|(k, [t, y])| [[*t, *y], [next(k), *y]]);
    let mut steps: Vec<[f64; 2]> = steps.collect();
    steps.dedup();
    bends(steps)
}

/// Without points on the line between their neighbours.
fn bends(points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let mut kept: Vec<[f64; 2]> = Vec::new();
    for point in points {
        if let [.., a, b] = kept[..]
            && (b[1] - a[1]) * (point[0] - a[0]) == (point[1] - a[1]) * (b[0] - a[0])
            && b[0] >= a[0]
            && point[0] > b[0]
        {
            kept.pop();
        }
        kept.push(point);
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peaks_stay() {
        let points: Vec<[f64; 2]> =
            (0..10_000).map(|k| [f64::from(k), if k == 4321 { 7.0 } else { (0.01 * f64::from(k)).sin() }]).collect();
        let thin = thinned(&points, 400);
        assert!(thin.len() <= 410 && thin.contains(&[4321.0, 7.0]));
        assert_eq!((thin[0], thin[thin.len() - 1]), (points[0], points[9999]));
        assert!(thin.windows(2).all(|pair| pair[0][0] <= pair[1][0]));
    }

    #[test]
    fn constants_are_two_points_and_steps_are_square() {
        assert_eq!(thinned(&[[0.0, 1.0], [1.0, 1.0], [2.0, 1.0], [3.0, 1.0]], 100), [[0.0, 1.0], [3.0, 1.0]]);
        assert_eq!(held(&[[0.0, 1.0], [1.0, 1.0], [2.0, 3.0]], 3.0), [[0.0, 1.0], [2.0, 1.0], [2.0, 3.0], [3.0, 3.0]]);
    }
}
