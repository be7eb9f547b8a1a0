//! Straight walls.

use crate::need::Need;
use crate::row::Row;
use crate::vector::{length, unit};

/// The free side is normal'p >= offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wall {
    /// Any length but 0.
    pub normal: [f64; 2],
    pub offset: f64,
}

/// A rectangle that is not left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arena {
    pub low: [f64; 2],
    pub high: [f64; 2],
}

impl Wall {
    /// The row normal'y >= offset + need(normal), for a unit normal, on the reference position y of one body. It does not
    /// depend on y and need never be redrawn. `None` if the wall has no direction, or if something is not finite.
    pub fn row(&self, need: &impl Need) -> Option<Row> {
        let normal = unit(self.normal)?;
        let bound = self.offset / length(self.normal) + need.need(&normal);
        bound.is_finite().then_some(Row { normal, bound })
    }
}

impl Arena {
    /// Left, right, lower and upper wall.
    pub fn walls(&self) -> [Wall; 4] {
        let ([left, low], [right, high]) = (self.low, self.high);
        [
            Wall { normal: [1.0, 0.0], offset: left },
            Wall { normal: [-1.0, 0.0], offset: -right },
            Wall { normal: [0.0, 1.0], offset: low },
            Wall { normal: [0.0, -1.0], offset: -high },
        ]
    }

    /// Where the reference position may be: the rectangle less the need at every wall, which can be stated as limits of
    /// outputs, (31), in place of rows. `None` if it is empty or not finite.
    pub fn within(&self, need: &impl Need) -> Option<Self> {
        let ([left, low], [right, high]) = (self.low, self.high);
        let room = Self {
            low: [left + need.need(&[1.0, 0.0]), low + need.need(&[0.0, 1.0])],
            high: [right - need.need(&[-1.0, 0.0]), high - need.need(&[0.0, -1.0])],
        };
        let finite = [room.low, room.high].as_flattened().iter().all(|end| end.is_finite());
        (finite && room.low.iter().zip(&room.high).all(|(low, high)| low <= high)).then_some(room)
    }
}

#[cfg(test)]
mod tests {
    use super::{Arena, Wall};
    use crate::need::Clearance;

    const ROBOT: Clearance = Clearance { distance: 3.7, axes: [0.5, 1.0] };

    #[test]
    fn arena_leaves_a_box_which_is_what_its_walls_leave() {
        let arena = Arena { low: [0.0, 0.0], high: [130.0, 80.0] };
        let room = arena.within(&ROBOT).unwrap();
        assert_eq!(room, Arena { low: [4.2, 4.7], high: [125.8, 75.3] });
        let bounds = arena.walls().map(|wall| wall.row(&ROBOT).unwrap().bound);
        assert_eq!(bounds, [4.2, -125.8, 4.7, -75.3]);
        assert!(Arena { high: [8.0, 80.0], ..arena }.within(&ROBOT).is_none());
        assert!(Arena { high: [f64::NAN, 80.0], ..arena }.within(&ROBOT).is_none());
        assert!(arena.within(&|_: &[f64; 2]| f64::INFINITY).is_none());
    }

    #[test]
    fn walls_may_be_given_at_any_scale() {
        let row = Wall { normal: [3.0, 4.0], offset: 10.0 }.row(&Clearance { distance: 1.0, axes: [0.0; 2] }).unwrap();
        assert!((row.normal[0] - 0.6).abs() < 1e-15 && (row.bound - 3.0).abs() < 1e-15);
        assert!(Wall { normal: [0.0; 2], offset: 1.0 }.row(&ROBOT).is_none());
        assert!(Wall { normal: [1.0, 0.0], offset: f64::NAN }.row(&ROBOT).is_none());
    }
}
