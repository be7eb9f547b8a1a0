//! The loops that are run.
//!
//! A network that is emitted in another scalar type is one more module in `emitted` and one more loop here, with that type.

use crate::Board;
use crate::closed_loop::closed_loop;

closed_loop! {
    four_tank: f64, 600 steps, set 4.0;
    left { right: FROM_RIGHT }
    right { left: FROM_LEFT }
}

closed_loop! {
    four_tank_single: f32, 600 steps, set 4.0;
    left { right: FROM_RIGHT }
    right { left: FROM_LEFT }
}

closed_loop! {
    mass_chain: f64, 200 steps, set 0.02;
    mass_1 { mass_2: FROM_MASS_2 }
    mass_2 { mass_1: FROM_MASS_1, mass_3: FROM_MASS_3 }
    mass_3 { mass_2: FROM_MASS_2, mass_4: FROM_MASS_4 }
    mass_4 { mass_3: FROM_MASS_3, mass_5: FROM_MASS_5 }
    mass_5 { mass_4: FROM_MASS_4, mass_6: FROM_MASS_6 }
    mass_6 { mass_5: FROM_MASS_5, mass_7: FROM_MASS_7 }
    mass_7 { mass_6: FROM_MASS_6, mass_8: FROM_MASS_8 }
    mass_8 { mass_7: FROM_MASS_7, mass_9: FROM_MASS_9 }
    mass_9 { mass_8: FROM_MASS_8, mass_10: FROM_MASS_10 }
    mass_10 { mass_9: FROM_MASS_9 }
}

/// Runs all of them, and reports each.
pub fn run_all(board: &mut impl Board) {
    four_tank(board).report("four_tank, f64", board);
    four_tank_single(board).report("four_tank, f32", board);
    mass_chain(board).report("mass_chain, f64", board);
}
