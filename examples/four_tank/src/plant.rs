//! The four-tank itself: linear as the paper prints it, and nonlinear as physics has it.
//!
//! Tanks stand in the paper's order: 1 lower left, 2 upper (feeds tank 3), 3 lower right, 4 upper (feeds tank 1).
//! K. H. Johansson, "The quadruple-tank process: a multivariable laboratory process with an adjustable zero", IEEE
//! Transactions on Control Systems Technology 8(3), 2000, numbers the same tanks 1, 4, 2, 3.

/// Sampling period, s.
pub const SAMPLE_TIME: f64 = 0.5;

/// Levels of the four tanks, or their deviations from the working point, cm.
pub type Levels = [f64; 4];

/// Voltages of the two pumps, or their deviations from the working point, V.
pub type Voltages = [f64; 2];

/// The matrix **A** of Section VI, as printed.
pub const A: [[f64; 4]; 4] =
    [[0.9921, 0.0, 0.0, 0.0206], [0.0, 0.9835, 0.0, 0.0], [0.0, 0.0165, 0.9945, 0.0], [0.0, 0.0, 0.0, 0.9793]];

/// The matrix **B** of Section VI, as printed, cm/V.
pub const B: [[f64; 2]; 4] = [[0.0417, 2.47e-4], [0.0156, 0.0], [1.30e-4, 0.0311], [0.0, 0.0235]];

/// A four-tank in the controllers' deviation variables.
pub trait Plant {
    /// Deviations one sampling period later, the inputs being held.
    fn advance(&self, x: &Levels, u: &Voltages) -> Levels;
}

/// The collective model (5a) with the printed matrices: the plant that the guarantee is about.
#[derive(Debug, Clone, Copy)]
pub struct LinearTanks;

impl Plant for LinearTanks {
    fn advance(&self, x: &Levels, u: &Voltages) -> Levels {
        std::array::from_fn(|i| dot(&A[i], x) + dot(&B[i], u))
    }
}

/// Johansson's quadruple tank about the equilibrium that belongs to its working voltages.
///
/// The printed working levels (12.4, 1.4, 12.7, 1.8) cm do not balance the flows at 3 V exactly. The deviations here
/// are therefore from the levels that do, within 0.2 cm of the printed ones, so that rest at zero is rest.
#[derive(Debug, Clone, Copy)]
pub struct NonlinearTanks {
    tank: QuadrupleTank,
    centre: Levels,
    voltages: Voltages,
    substeps: u32,
}

impl NonlinearTanks {
    /// Pump voltages of the working point, V.
    pub const WORKING_VOLTAGES: Voltages = [3.0, 3.0];

    /// With `substeps` Runge-Kutta steps per sampling period. Ten leave an error below 1e-9 cm over a period while
    /// every level is above 0.1 cm.
    pub fn new(substeps: u32) -> Self {
        let tank = QuadrupleTank::MINIMUM_PHASE;
        let voltages = Self::WORKING_VOLTAGES;
        Self { tank, centre: tank.equilibrium(&voltages), voltages, substeps }
    }

    /// Levels at zero deviation, cm.
    pub fn centre(&self) -> &Levels {
        &self.centre
    }
}

impl Plant for NonlinearTanks {
    fn advance(&self, x: &Levels, u: &Voltages) -> Levels {
        let v = add(&self.voltages, u);
        let dt = SAMPLE_TIME / f64::from(self.substeps);
        let h = (0..self.substeps).fold(add(&self.centre, x), |h, _| self.tank.runge_kutta(&h, &v, dt));
        std::array::from_fn(|i| h[i] - self.centre[i])
    }
}

/// Four tanks that empty through a hole in the bottom under gravity, two pumps, each split between two tanks.
#[derive(Debug, Clone, Copy)]
pub struct QuadrupleTank {
    /// Cross-sections, cm^2.
    pub area: [f64; 4],
    /// Outlet holes, cm^2.
    pub hole: [f64; 4],
    /// Flow per voltage of each pump, cm^3/(V s).
    pub pump: [f64; 2],
    /// Share of each pump's flow that goes to its lower tank.
    pub split: [f64; 2],
    /// Gravity, cm/s^2.
    pub gravity: f64,
}

impl QuadrupleTank {
    /// Johansson's minimum-phase setting P-, with the two pump gains exchanged: so do the printed matrices follow.
    pub const MINIMUM_PHASE: Self = Self {
        area: [28.0, 32.0, 32.0, 28.0],
        hole: [0.071, 0.057, 0.057, 0.071],
        pump: [3.35, 3.33],
        split: [0.7, 0.6],
        gravity: 981.0,
    };

    /// Change of the levels, cm/s, at levels `h` in cm and pump voltages `v` in V. Empty tanks let nothing out, and
    /// pumps do not suck.
    pub fn rate(&self, h: &Levels, v: &Voltages) -> Levels {
        let out: Levels = std::array::from_fn(|i| self.hole[i] * (2.0 * self.gravity * h[i].max(0.0)).sqrt());
        let pumped = self.pumped(v);
        let from_above = [out[3], 0.0, out[1], 0.0];
        std::array::from_fn(|i| (pumped[i] + from_above[i] - out[i]) / self.area[i])
    }

    /// Levels in cm at which every tank lets out what comes in at pump voltages `v`: the flows follow from the
    /// voltages alone, the levels from the flows by Torricelli's law.
    pub fn equilibrium(&self, v: &Voltages) -> Levels {
        let pumped = self.pumped(v);
        let flow = [pumped[0] + pumped[3], pumped[1], pumped[2] + pumped[1], pumped[3]];
        std::array::from_fn(|i| (flow[i] / self.hole[i]).powi(2) / (2.0 * self.gravity))
    }

    /// Flow from the pumps into each tank, cm^3/s.
    fn pumped(&self, v: &Voltages) -> [f64; 4] {
        let flow: [f64; 2] = std::array::from_fn(|p| self.pump[p] * v[p].max(0.0));
        let [left, right] = self.split;
        [left * flow[0], (1.0 - left) * flow[0], right * flow[1], (1.0 - right) * flow[1]]
    }

    /// Classical fourth-order step of `dt` seconds. A level that a step takes below the bottom is at the bottom.
    fn runge_kutta(&self, h: &Levels, v: &Voltages, dt: f64) -> Levels {
        let along = |slope: &Levels, by: f64| -> Levels { std::array::from_fn(|i| h[i] + by * slope[i]) };
        let k1 = self.rate(h, v);
        let k2 = self.rate(&along(&k1, dt / 2.0), v);
        let k3 = self.rate(&along(&k2, dt / 2.0), v);
        let k4 = self.rate(&along(&k3, dt), v);
        std::array::from_fn(|i| (h[i] + dt / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i])).max(0.0))
    }
}

fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn add<const N: usize>(a: &[f64; N], b: &[f64; N]) -> [f64; N] {
    std::array::from_fn(|i| a[i] + b[i])
}
