//! What happens between two samples.

/// How far a double integrator under a constant acceleration of at most `acceleration` per axis leaves, within a sampling
/// period, the chord between its positions at the two ends; per axis, in the unit of positions.
///
/// Proof. With p(0), p(tau) at the ends and p'' = a, p(t) = (1 - t / tau) p(0) + (t / tau) p(tau) - a t (tau - t) / 2: both sides
/// have the same second derivative and the same ends. And 0 <= t (tau - t) <= tau^2 / 4. So |p - chord| <= |a| tau^2 / 8 per axis,
/// and in direction n by no more than |n_1| s_1 + |n_2| s_2, where s is what is returned here.
///
/// A row n'(p_first - p_second) >= need(n) + n-weighted sags of *both* bodies that holds at two samples (with the same n)
/// holds for the chords, being linear, and hence n'(p_first - p_second) >= need(n) in between. Where n changes at a sample, the row
/// in force during the period must hold at both of its ends.
pub fn sag(acceleration: [f64; 2], period: f64) -> [f64; 2] {
    acceleration.map(|a| a.abs() * (period * period) / 8.0)
}

#[cfg(test)]
mod tests {
    use super::sag;

    #[test]
    fn is_reached_in_the_middle_and_never_exceeded() {
        let (p, v, a, tau) = (3.0, -2.0, 1.5, 2.0);
        let position = |t: f64| p + v * t + 0.5 * a * t * t;
        let [bound, _] = sag([-a, 0.0], tau);
        let from_chord = |t: f64| position(t) - ((1.0 - t / tau) * position(0.0) + t / tau * position(tau));
        assert!((0..=100).all(|k| from_chord(0.01 * tau * f64::from(k)).abs() <= bound + 1e-12));
        assert!((from_chord(0.5 * tau).abs() - bound).abs() < 1e-12);
    }
}
