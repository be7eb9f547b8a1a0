//! How far apart two bodies must be along a normal.

use crate::vector::{dot, length};

/// need(n): what n'(y_first - y_second) must at least be, a convex and positively homogeneous function of n, that is the
/// support function of a set: the relative positions that are too near. In the unit of positions for unit normals.
///
/// Any `Fn(&[f64; 2]) -> f64` is one. The rules call it with unit normals only. What they return is admissible whatever the function;
/// that it is the extreme or the nearest normal, and that one is found wherever there is one, rests on convexity and on need(n) > 0.
pub trait Need {
    /// need(n) for a unit normal n. What is not a number counts as unattainable.
    fn need(&self, normal: &[f64; 2]) -> f64;
}

impl<F: Fn(&[f64; 2]) -> f64> Need for F {
    fn need(&self, normal: &[f64; 2]) -> f64 {
        self(normal)
    }
}

/// d |n| + s_1 |n_1| + s_2 |n_2|: what the true positions at the samples must keep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clearance {
    /// d: sum of the radii, and of what moves the bodies by an unknown amount in any direction.
    pub distance: f64,
    /// s: per axis, for instance the [`sag`](crate::sag::sag) of both bodies, added.
    pub axes: [f64; 2],
}

impl Need for Clearance {
    fn need(&self, normal: &[f64; 2]) -> f64 {
        self.distance * length(*normal) + dot(self.axes, normal.map(f64::abs))
    }
}

/// Sum of |g'n| over generators g: the support function of the zonotope of all sums of t_g g with |t_g| <= 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Zonotope<'a> {
    pub generators: &'a [[f64; 2]],
}

impl Need for Zonotope<'_> {
    fn need(&self, normal: &[f64; 2]) -> f64 {
        self.generators.iter().fold(0.0, |sum, generator| sum + dot(*generator, *normal).abs())
    }
}

/// Two needs, one on top of the other: the support function of the sum of two sets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sum<A, B>(pub A, pub B);

impl<A: Need, B: Need> Need for Sum<A, B> {
    fn need(&self, normal: &[f64; 2]) -> f64 {
        self.0.need(normal) + self.1.need(normal)
    }
}

#[cfg(test)]
mod tests {
    use super::{Clearance, Need, Sum, Zonotope};

    #[test]
    fn needs_add_up() {
        let clearance = Clearance { distance: 7.0, axes: [1.0, 2.0] };
        let zonotope = Zonotope { generators: &[[1.0, 0.0], [1.0, 1.0]] };
        assert_eq!(clearance.need(&[0.0, -1.0]), 9.0);
        assert_eq!(zonotope.need(&[-1.0, 0.0]), 2.0);
        assert_eq!(Sum(clearance, zonotope).need(&[0.0, 1.0]), 10.0);
        assert_eq!(Sum(clearance, |normal: &[f64; 2]| normal[0]).need(&[1.0, 0.0]), 9.0);
    }
}
