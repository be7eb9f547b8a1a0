//! What a design may count on.

use crate::class::Class;
use crate::following::Deviation;

/// How far an e-puck may stray from its double integrator in the motions of a class: the largest deviations that a search over
/// the class has found, and a quarter more. They are measured, not proved: nothing says that the search found the worst.
///
/// In one period after the other, started from the measured state each time, position and velocity at the samples are the
/// disturbance of the predictive controller's model; the position in between is part of the distance to keep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Declared {
    pub class: Class,
    pub bound: Deviation,
}

/// Of robots whose references move by 5 cm per step.
pub const FAST: Declared = Declared {
    class: Class { period: 2.0, velocity: 4.0, acceleration: 3.5 },
    bound: Deviation { position: 0.14, velocity: 0.32, between: 0.39 },
};

/// Of robots whose references move by 2 cm per step.
pub const SLOW: Declared = Declared {
    class: Class { period: 2.0, velocity: 2.0, acceleration: 1.5 },
    bound: Deviation { position: 0.11, velocity: 0.26, between: 0.19 },
};

/// All classes that are measured.
pub const DECLARED: [Declared; 7] = [
    FAST,
    SLOW,
    Declared {
        class: Class { period: 2.0, velocity: 5.0, acceleration: 2.5 },
        bound: Deviation { position: 0.18, velocity: 0.45, between: 0.42 },
    },
    Declared {
        class: Class { period: 2.0, velocity: 5.0, acceleration: 5.0 },
        bound: Deviation { position: 0.18, velocity: 0.46, between: 0.49 },
    },
    Declared {
        class: Class { period: 1.0, velocity: 5.0, acceleration: 2.5 },
        bound: Deviation { position: 0.36, velocity: 0.66, between: 0.42 },
    },
    Declared {
        class: Class { period: 1.0, velocity: 5.0, acceleration: 5.0 },
        bound: Deviation { position: 0.55, velocity: 1.63, between: 0.93 },
    },
    Declared {
        class: Class { period: 5.0, velocity: 5.0, acceleration: 2.0 },
        bound: Deviation { position: 0.14, velocity: 0.26, between: 0.19 },
    },
];
