//! Sums of segments: sets whose support function a small processor evaluates in any direction.

use std::f64::consts::PI;

use nalgebra::DVector;

use crate::optim::rounding::{sum_upper, to_digits, up_to_digits};

/// Directions in a half-turn in which a planar set is bounded. A circle is exceeded by 1 / cos(pi / 16), 2 %, at most.
pub const ANGLES: usize = 8;

/// The sum of the segments from -g to g over its generators g.
#[derive(Debug, Clone, Default)]
pub struct Zonotope {
    pub generators: Vec<DVector<f64>>,
}

/// Generators smaller than this share of their sum are left out, and the rest made to hold what they held.
const LITTLE: f64 = 1e-7;
/// Digits of generators.
const DIGITS: usize = 11;
/// Bound of an entry's rounding to these digits, and of what it and its direction have suffered before, relative.
const ROUNDING: f64 = 1e-10;

impl Zonotope {
    /// Holds all y with |y_a| <= half_a.
    pub fn boxed(half: &[f64]) -> Self {
        Self::default().with_box(half)
    }

    /// Holds the planar symmetric set with these supports in the directions (cos / units_1, sin / units_2) at the angles k pi /
    /// [`ANGLES`]; no set around it with these supports is smaller, but for rounding.
    ///
    /// A planar symmetric polygon is the sum of its edges: with redundant supports lowered to what the others leave, the half-length
    /// of edge k is (h_{k-1} + h_{k+1} - 2 h_k cos d) / (2 sin d) for directions d apart. That the sum of those that are kept
    /// reaches every kept support is checked; then it holds the set, as its facets are perpendicular to its generators.
    pub fn around(supports: &[f64; ANGLES], units: [f64; 2]) -> Self {
        let outer = [supports[0] * units[0], supports[ANGLES / 2] * units[1]];
        let supports = irredundant(*supports);
        let edges = half_edges(&supports);
        let little = LITTLE * edges.iter().sum::<f64>();
        let kept: Vec<(usize, f64)> = edges.into_iter().enumerate().filter(|(_, edge)| *edge > little).collect();
        let lacking = |(k, _): &(usize, f64)| supports[*k] / reach(&kept, *k);
        let factor = kept.iter().map(lacking).fold(1.0, f64::max) * (1.0 + 1e-12);
        if kept.len() < 2 || !factor.is_finite() || factor > MOST_FACTOR {
            return Self::boxed(&outer);
        }
        let generator = |(k, edge): &(usize, f64)| {
            let (sin, cos) = sin_cos(*k);
            DVector::from_vec(vec![-sin * edge * factor * units[0], cos * edge * factor * units[1]])
        };
        Self { generators: kept.iter().map(generator).collect() }.rounded()
    }

    /// Upper bound of the support in direction d.
    pub fn support(&self, d: &DVector<f64>) -> f64 {
        sum_upper(self.generators.iter().map(|g| sum_upper(g.iter().zip(d).map(|(g, d)| g * d)).abs()))
    }

    /// The half-width in each coordinate.
    pub fn half_widths(&self, coordinates: usize) -> DVector<f64> {
        DVector::from_fn(coordinates, |k, _| sum_upper(self.generators.iter().map(|g| g[k].abs())))
    }

    /// The sum with a box: segments along the axes are merged, and come first.
    pub fn with_box(self, half: &[f64]) -> Self {
        let is_along = |g: &DVector<f64>, k: usize| g.iter().enumerate().all(|(r, entry)| r == k || *entry == 0.0);
        let (mut along, mut others) = (half.to_vec(), Vec::new());
        for g in self.generators {
            match (0..half.len()).find(|k| is_along(&g, *k)) {
                Some(k) => along[k] = sum_upper([along[k], g[k].abs()]),
                None => others.push(g),
            }
        }
        let axis = |(k, length): (usize, f64)| {
            let length = up_to_digits(length, DIGITS);
            (length > 0.0).then(|| DVector::from_fn(half.len(), |r, _| if r == k { length } else { 0.0 }))
        };
        Self { generators: along.into_iter().enumerate().filter_map(axis).chain(others).collect() }
    }

    /// The set times a factor >= 1 + 1e-9, up to half of what the factor adds.
    pub fn enlarged(self, factor: f64) -> Self {
        Self { generators: self.generators.iter().map(|g| g.map(|entry| to_digits(entry * factor, DIGITS))).collect() }
    }

    /// With short decimals; a box makes up for what that takes in any direction.
    fn rounded(self) -> Self {
        let coordinates = self.generators.first().map_or(0, DVector::len);
        let lost = self.half_widths(coordinates) * ROUNDING;
        Self { generators: self.generators.iter().map(|g| g.map(|entry| to_digits(entry, DIGITS))).collect() }
            .with_box(lost.as_slice())
    }
}

/// More than this is not rounding.
const MOST_FACTOR: f64 = 1.01;

/// Exact where an axis is meant.
fn sin_cos(k: usize) -> (f64, f64) {
    match k % ANGLES {
        0 => (0.0, 1.0),
        k if 2 * k == ANGLES => (1.0, 0.0),
        k => (k as f64 * PI / ANGLES as f64).sin_cos(),
    }
}

/// What the edges reach in direction k.
fn reach(edges: &[(usize, f64)], k: usize) -> f64 {
    edges.iter().map(|(i, edge)| edge * sin_cos(i.abs_diff(k)).0).sum()
}

fn half_edges(h: &[f64; ANGLES]) -> [f64; ANGLES] {
    let (sin, cos) = sin_cos(1);
    // Half a turn leads to the opposite facet, whose support is the same.
    std::array::from_fn(|k| (h[(k + ANGLES - 1) % ANGLES] + h[(k + 1) % ANGLES] - 2.0 * h[k] * cos) / (2.0 * sin))
}

/// The supports of the polygon that has these: a facet that its neighbours cut off is lowered to where they meet.
fn irredundant(mut h: [f64; ANGLES]) -> [f64; ANGLES] {
    let (_, cos) = sin_cos(1);
    for _ in 0..SWEEPS {
        let before = h;
        for k in 0..ANGLES {
            let met = (h[(k + ANGLES - 1) % ANGLES] + h[(k + 1) % ANGLES]) / (2.0 * cos);
            h[k] = h[k].min(met * (1.0 + 1e-15));
        }
        if h == before {
            break;
        }
    }
    h
}

/// More lowering than these do is left to the edges that come out negative: leaving them out makes the set larger.
const SWEEPS: usize = 200;

#[cfg(test)]
mod tests {
    use super::*;

    fn supports(of: impl Fn(f64, f64) -> f64) -> [f64; ANGLES] {
        std::array::from_fn(|k| {
            let (sin, cos) = sin_cos(k);
            of(cos, sin)
        })
    }

    fn excess(zonotope: &Zonotope, units: [f64; 2], of: impl Fn(f64, f64) -> f64) -> (f64, f64) {
        let ratios = (0..1000).map(|k| {
            let (sin, cos) = (k as f64 * PI / 1000.0).sin_cos();
            zonotope.support(&DVector::from_vec(vec![cos / units[0], sin / units[1]])) / of(cos, sin)
        });
        ratios.fold((f64::INFINITY, 0.0), |(least, most), ratio| (least.min(ratio), most.max(ratio)))
    }

    #[test]
    fn a_box_has_two_generators_and_a_circle_eight() {
        let units = [3.0, 0.2];
        let square = |c: f64, s: f64| c.abs() + s.abs();
        let zonotope = Zonotope::around(&supports(square), units);
        assert_eq!(zonotope.generators.len(), 2);
        let (least, most) = excess(&zonotope, units, square);
        assert!(least >= 1.0 && most < 1.0 + 1e-8, "{least} {most}");

        let zonotope = Zonotope::around(&supports(|_, _| 1.0), units);
        assert_eq!(zonotope.generators.len(), ANGLES);
        let (least, most) = excess(&zonotope, units, |_, _| 1.0);
        assert!(least >= 1.0 && most < 1.0 / (PI / 16.0).cos() + 1e-8, "{least} {most}");
    }

    #[test]
    fn thin_and_slanted_sets_fit() {
        for width in [1.0, 0.1, 1e-3, 1e-6] {
            // The sum of a slanted segment and a small disc.
            let thin = |c: f64, s: f64| (0.8 * c - 0.6 * s).abs() + width;
            let (least, _) = excess(&Zonotope::around(&supports(thin), [1.0, 1.0]), [1.0, 1.0], thin);
            assert!(least >= 1.0, "{width}: {least}");
        }
    }

    /// Bounds that are no support function: one facet lies far outside of where its neighbours meet.
    #[test]
    fn redundant_supports_cost_nothing() {
        let mut given = supports(|_, _| 1.0);
        given[3] = 1.5;
        let (least, most) = excess(&Zonotope::around(&given, [1.0, 1.0]), [1.0, 1.0], |_, _| 1.0);
        assert!(least >= 1.0 && most < 1.09, "{least} {most}");
    }

    #[test]
    fn boxes_are_merged() {
        let zonotope = Zonotope::boxed(&[1.0, 2.0]).with_box(&[0.5, 0.0]);
        let expected = [vec![1.5, 0.0], vec![0.0, 2.0]].map(DVector::from_vec);
        zonotope.generators.iter().zip(&expected).for_each(|(one, other)| assert!((one - other).amax() < 1e-9));
        assert_eq!(zonotope.generators.len(), 2);
        assert_eq!(Zonotope::boxed(&[0.0, 1.0]).generators.len(), 1);
    }
}
