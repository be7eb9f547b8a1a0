//! Bodies in the plane that must not touch, and unicycle robots that move as double integrators: what Section V of M. Farina,
//! G. Betti, L. Giulioni and R. Scattolini, "An Approach to Distributed Predictive Control for Tracking: Theory and
//! Applications", IEEE Transactions on Control Systems Technology 22(4), 2014, needs beyond a controller. Equation numbers in
//! this documentation are that paper's.
//!
//! The crate is `no_std`, has no dependency, does not allocate, contains no `unsafe` and no panic. It uses additions,
//! multiplications, divisions and comparisons only (its square root is Newton's, and it needs no angles), so the same arguments
//! give the same bits on every machine with IEEE 754 doubles. The number of operations is bounded.
//!
//! # Separation
//! Two bodies are apart if some line has them on either side: n'(p_first - p_second) >= d for one unit normal n. Such a [`Row`] is a
//! coupling constraint (3), linear where the distance is not convex, and n may be another one at every step. On references, the row is
//! n'(y_first - y_second) >= need(n) with a [`Need`] that contains
//!
//! | part | as | where it comes from |
//! |---|---|---|
//! | the distance to keep | [`Clearance`] `distance` | radii; how far the robot strays from its model between samples |
//! | motion between samples | [`Clearance`] `axes`, by [`sag::sag`] | proved there, for double integrators |
//! | the margins of (26) | [`Zonotope`], or a function | the design: how far a position is from its reference |
//!
//! ```
//! use dpc_planar::{Clearance, Rule, Sum, Tangent, Turn, Zonotope, sag::sag};
//!
//! let sags = sag([5.0, 5.0], 2.0).map(|one| 2.0 * one);
//! let clearance = Clearance { distance: 7.4, axes: sags };
//! let need = Sum(clearance, Zonotope { generators: &[[4.0, 0.0], [0.0, 4.0]] });
//! let row = Tangent::new(Turn::CounterClockwise).row(&[90.0, 39.0], &[28.0, 52.0], &need).expect("far apart");
//! assert!(row.normal[0] * 62.0 + row.normal[1] * -13.0 >= row.bound);
//! ```
//!
//! Any n for which the row holds for the references at step t + N - 1 may be used for (28) at step t, and recursive
//! feasibility is kept: the induction of the paper's appendix needs that k_{h,t+N-1} <= l~_h, not that H_h is what it was. So
//! [`Rule`]s differ in how well robots get on, not in what is guaranteed:
//!
//! - [`Tangent`]: the extreme admissible rotation of n, to the same side for all. The line passes the other body's side, and along it the
//!   way is free;
//! - [`LineOfCentres`]: n along y_first - y_second; for two bodies the line between their buffered Voronoi cells. Bodies
//!   that want past one another stop.
//!
//! What a rule returns holds with rounding to spare ([`Rule::row`]); it is a function of its arguments alone, so both bodies
//! of a pair come to the same bits if they call it with the same references in the same order. Where a rule finds no row,
//! that of the step before still holds for the references, by (28).
//!
//! How rules find n: slack(n) = n'(y_first - y_second) - need(n) is concave and positively homogeneous, so the admissible normals are
//! the directions of a convex cone, an arc. Along the segment between two directions slack is concave. An inner point of the arc is the line of centres,
//! or, where the need is longer in one direction than in others, the maximum of slack on one of two quadrants (golden
//! section); the ends of the arc are found by bisection, to the spacing of doubles. An arc is missed only if no normal has more slack than rounding, some
//! 1e-14 of the numbers involved. A call evaluates the need at most 240 times; with a `share` to leave, 470 times.
//!
//! [`Obstacle`]s, [`Wall`]s and an [`Arena`] give rows on one body alone.
//!
//! # Unicycles
//! Module [`unicycle`]: feedback linearisation (42), and an inner loop that drives two wheels through what the double
//! integrators (41) do within a sampling period, with the singularity at v = 0.
#![no_std]
#![forbid(unsafe_code)]

mod cone;
pub mod need;
pub mod obstacle;
pub mod row;
pub mod rule;
pub mod sag;
pub mod unicycle;
mod vector;
pub mod wall;

pub use need::{Clearance, Need, Sum, Zonotope};
pub use obstacle::Obstacle;
pub use row::Row;
pub use rule::{LineOfCentres, Rule, Tangent, Turn};
pub use wall::{Arena, Wall};
