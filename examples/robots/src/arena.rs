//! Where the robots are: on a floor whose lower left corner is the origin of all positions in pictures and scenarios. The
//! controllers count from the centre.

/// Width and height, cm.
pub const SIZE: [f64; 2] = [130.0, 80.0];

/// Diameter of an e-puck, cm.
pub const DIAMETER: f64 = 7.4;

/// A position in the plane, cm.
pub type Point = [f64; 2];

/// As the controllers count.
pub fn from_centre(p: Point) -> Point {
    [p[0] - 0.5 * SIZE[0], p[1] - 0.5 * SIZE[1]]
}

/// As pictures and scenarios count.
pub fn on_floor(p: Point) -> Point {
    [p[0] + 0.5 * SIZE[0], p[1] + 0.5 * SIZE[1]]
}

/// Of positions as pictures and scenarios count.
pub fn is_on_floor([x, y]: Point) -> bool {
    (0.0..=SIZE[0]).contains(&x) && (0.0..=SIZE[1]).contains(&y)
}

pub fn distance(a: Point, b: Point) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}
