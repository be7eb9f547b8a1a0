//! Outlines of convex sets in the plane, of nothing but their extreme points.

#![expect(non_snake_case, reason = "the paper's symbols")]

use nalgebra::{DMatrix, DVector};

use crate::convex::Polytope;

/// A point of the plane.
pub type Point = [f64; 2];

/// A convex set in the plane, counter-clockwise; two points of a segment, one of a point.
///
/// The vertices are extreme points of the set, so the outline is inside it; no point of the set is farther outside than a
/// [`RESOLUTION`]th of the frame it was made for, unless it has more than [`MOST`] vertices.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    pub vertices: Vec<Point>,
}

/// Parts of the frame's width and height below which nothing is drawn.
pub const RESOLUTION: f64 = 2000.0;
/// Vertices at most, about.
pub const MOST: usize = 300;

impl Outline {
    /// Of the set whose point farthest in a direction is `extreme`, where there is one, drawn in a frame of this width and height.
    ///
    /// Between two neighbouring vertices, the farthest point across their edge is a new vertex or proves the edge.
    pub fn new(extreme: impl Fn(Point) -> Option<Point>, size: Point) -> Option<Self> {
        // In units of the frame, in which a direction has to be scaled the other way.
        let farthest = |d: Point| extreme([d[0] / size[0], d[1] / size[1]]).map(|p| [p[0] / size[0], p[1] / size[1]]);
        let corners = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]].map(&farthest);
        let corners: Vec<Point> = corners.into_iter().collect::<Option<_>>()?;
        let mut vertices = Vec::new();
        for k in 0..corners.len() {
            vertices.push(corners[k]);
            between(corners[k], corners[(k + 1) % corners.len()], &farthest, &mut vertices);
        }
        let vertices = distinct(vertices).into_iter().map(|p| [p[0] * size[0], p[1] * size[1]]).collect();
        Some(Self { vertices })
    }

    /// The image of a polytope under the two rows of `map`; it has to be bounded.
    pub fn of_image(set: &Polytope, map: &DMatrix<f64>, size: Point) -> Option<Self> {
        let extreme = |d: Point| {
            let direction = map.row(0).transpose() * d[0] + map.row(1).transpose() * d[1];
            let (_, x) = set.support(&direction)?;
            let image = map * x;
            Some([image[0], image[1]])
        };
        Self::new(extreme, size)
    }

    /// The sum of segments from `low` to `high` times a vector each.
    pub fn of_segments(segments: &[Segment], size: Point) -> Option<Self> {
        let extreme = |d: Point| {
            Some(segments.iter().fold([0.0, 0.0], |sum, segment| {
                let forward = d[0] * segment.along[0] + d[1] * segment.along[1] >= 0.0;
                let share = if forward { segment.high } else { segment.low };
                [sum[0] + share * segment.along[0], sum[1] + share * segment.along[1]]
            }))
        };
        Self::new(extreme, size)
    }

    /// Smallest and largest of both coordinates.
    pub fn ranges(&self) -> [Point; 2] {
        [0, 1].map(|axis| {
            let all = self.vertices.iter().map(|vertex| vertex[axis]);
            all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
        })
    }
}

/// The points `share * along` for `low <= share <= high`.
#[derive(Debug, Clone, Copy)]
pub struct Segment {
    pub along: Point,
    pub low: f64,
    pub high: f64,
}

/// The part of a set whose image under the two rows of `map` lies within `ranges`.
pub fn clipped(set: &Polytope, map: &DMatrix<f64>, ranges: [Point; 2]) -> Polytope {
    let (rows, n) = set.H.shape();
    let sign = |bound: usize| [1.0, -1.0][bound % 2];
    let H = DMatrix::from_fn(rows + 4, n, |r, k| match r.checked_sub(rows) {
        None => set.H[(r, k)],
        Some(bound) => sign(bound) * map[(bound / 2, k)],
    });
    let h = DVector::from_fn(rows + 4, |r, _| match r.checked_sub(rows) {
        None => set.h[r],
        Some(bound) => sign(bound) * ranges[bound / 2][1 - bound % 2],
    });
    Polytope { H, h }
}

/// The rows that take coordinates `axes` out of n.
pub fn selection(n: usize, axes: [usize; 2]) -> DMatrix<f64> {
    DMatrix::from_fn(2, n, |r, k| f64::from(axes[r] == k))
}

/// Adds the vertices between `from` and `to`, in units of the frame.
fn between(from: Point, to: Point, farthest: &impl Fn(Point) -> Option<Point>, vertices: &mut Vec<Point>) {
    let edge = [to[0] - from[0], to[1] - from[1]];
    let length = edge[0].hypot(edge[1]);
    if length < 1.0 / RESOLUTION || vertices.len() >= MOST {
        return;
    }
    let across = [edge[1] / length, -edge[0] / length];
    let Some(middle) = farthest(across) else { return };
    let height = across[0] * (middle[0] - from[0]) + across[1] * (middle[1] - from[1]);
    if height > 1.0 / RESOLUTION {
        between(from, middle, farthest, vertices);
        vertices.push(middle);
        between(middle, to, farthest, vertices);
    }
}

/// Without points that repeat their predecessor.
fn distinct(points: Vec<Point>) -> Vec<Point> {
    let near = |a: &Point, b: &Point| (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-9;
    let mut kept: Vec<Point> = Vec::new();
    for point in points {
        if kept.last().is_none_or(|last| !near(last, &point)) {
            kept.push(point);
        }
    }
    while kept.len() > 1 && near(&kept[0], &kept[kept.len() - 1]) {
        kept.pop();
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube() -> Polytope {
        let H = DMatrix::from_fn(6, 3, |r, k| if r / 2 == k { [1.0, -1.0][r % 2] } else { 0.0 });
        Polytope { H, h: DVector::from_element(6, 1.0) }
    }

    fn area(outline: &Outline) -> f64 {
        let all = &outline.vertices;
        let next = |k: usize| all[(k + 1) % all.len()];
        0.5 * (0..all.len()).map(|k| all[k][0] * next(k)[1] - next(k)[0] * all[k][1]).sum::<f64>()
    }

    #[test]
    fn a_projected_cube_is_the_hexagon_it_is() {
        // Along the diagonal: a regular hexagon with the area 4 sqrt(3).
        let (a, b, c) = (0.5_f64.sqrt(), 6.0_f64.sqrt().recip(), 2.0 / 6.0_f64.sqrt());
        let map = DMatrix::from_row_slice(2, 3, &[a, -a, 0.0, b, b, -c]);
        let outline = Outline::of_image(&cube(), &map, [4.0, 4.0]).unwrap();
        assert_eq!(outline.vertices.len(), 6);
        assert!((area(&outline) - 4.0 * 3.0_f64.sqrt()).abs() < 1e-9);
    }

    #[test]
    fn sums_of_segments_are_as_large_as_their_parallelograms() {
        let segment = |x, y| Segment { along: [x, y], low: -1.0, high: 1.0 };
        let segments = [segment(1.0, 0.0), segment(0.0, 1.0), segment(1.0, 1.0)];
        let outline = Outline::of_segments(&segments, [4.0, 4.0]).unwrap();
        // Four times the sum of the determinants of all pairs.
        assert!((area(&outline) - 12.0).abs() < 1e-9 && outline.vertices.len() == 6);
    }

    #[test]
    fn flat_sets_are_segments_and_open_ones_are_none() {
        let line = Outline::of_segments(&[Segment { along: [2.0, 1.0], low: -1.0, high: 3.0 }], [10.0, 10.0]).unwrap();
        assert_eq!(line.ranges(), [[-2.0, 6.0], [-1.0, 3.0]]);
        let half = Polytope { H: DMatrix::from_row_slice(1, 2, &[1.0, 0.0]), h: DVector::from_element(1, 1.0) };
        let both = selection(2, [0, 1]);
        assert!(Outline::of_image(&half, &both, [1.0, 1.0]).is_none());
        let cut = clipped(&half, &both, [[-3.0, 2.0], [-1.0, 1.0]]);
        assert_eq!(Outline::of_image(&cut, &both, [1.0, 1.0]).unwrap().ranges(), [[-3.0, 1.0], [-1.0, 1.0]]);
    }
}
