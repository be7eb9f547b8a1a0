//! Random numbers that are the same on every machine and in every release.

/// SplitMix64: Steele, Lea, Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014.
#[derive(Debug, Clone)]
pub struct Random {
    state: u64,
}

impl Random {
    pub fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.state ^ (self.state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// Uniform in [low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        let unit = (self.bits() >> 11) as f64 / (1u64 << 53) as f64;
        low + unit * (high - low)
    }

    /// Uniform in low..=high; the modulo's bias is below 1e-15 for the small spans it is used for.
    pub fn integer(&mut self, low: usize, high: usize) -> usize {
        low + (self.bits() % (high - low + 1) as u64) as usize
    }

    /// Uniform on the unit sphere.
    pub fn direction<const N: usize>(&mut self) -> [f64; N] {
        loop {
            let point: [f64; N] = std::array::from_fn(|_| self.between(-1.0, 1.0));
            let length = point.iter().map(|x| x * x).sum::<f64>().sqrt();
            if (1e-3..=1.0).contains(&length) {
                return point.map(|x| x / length);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Random;

    #[test]
    fn sequence_is_the_published_one() {
        let mut random = Random::new(1_234_567);
        let expected = [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423];
        assert_eq!(expected, std::array::from_fn(|_| random.bits()));
    }

    #[test]
    fn draws_stay_in_their_ranges_and_reach_both_ends() {
        let mut random = Random::new(1);
        let draws: Vec<f64> = (0..10_000).map(|_| random.between(-2.0, 3.0)).collect();
        assert!(draws.iter().all(|x| (-2.0..3.0).contains(x)));
        assert!(draws.iter().any(|x| *x < -1.99) && draws.iter().any(|x| *x > 2.99));
        let integers: Vec<usize> = (0..1000).map(|_| random.integer(3, 5)).collect();
        assert!([3, 4, 5].iter().all(|n| integers.contains(n)) && integers.iter().all(|n| (3..=5).contains(n)));
    }

    /// The mean of a million draws has a standard deviation of 0.0003; single seeds may be unlucky, all together not.
    #[test]
    fn draws_have_no_preference_over_many_seeds() {
        let mean_of = |seed| (0..10_000).scan(Random::new(seed), |r, _| Some(r.between(0.0, 1.0))).sum::<f64>() / 1e4;
        let mean = (0..100).map(mean_of).sum::<f64>() / 100.0;
        assert!((mean - 0.5).abs() < 0.0012, "{mean}");
    }

    #[test]
    fn directions_have_unit_length_and_no_preference() {
        let mut random = Random::new(2);
        let mut sum = [0.0; 2];
        for _ in 0..10_000 {
            let [x, y] = random.direction();
            assert!((x * x + y * y - 1.0f64).abs() < 1e-12);
            sum = [sum[0] + x, sum[1] + y];
        }
        assert!(sum.iter().all(|s| s.abs() < 300.0), "{sum:?}");
    }
}
