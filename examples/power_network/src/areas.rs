//! The four areas: scenario 1 of S. Riverso and G. Ferrari-Trecate, "Hycon2 benchmark: power network system"
//! (arXiv 1207.2000), with the numbers of `dataSim.mat` that S. Riverso published with MPT3.
//!
//! Area i, deviations from the operating point, time in s, angles in rad, powers per unit:
//!
//! ```text
//! dtheta' = domega
//! 2 H domega' = -D domega + dPm - dPL - sum over j of P_ij (dtheta_i - dtheta_j)
//! Tt dPm' = dPv - dPm
//! Tg dPv' = dPref - dPv - domega / R
//! ```

/// States per area: dtheta, domega, dPm, dPv.
pub const NX: usize = 4;
pub const AREAS: usize = 4;
/// s.
pub const SAMPLE_TIME: f64 = 1.0;

/// One area and its turbine.
#[derive(Debug, Clone, Copy)]
#[expect(non_snake_case, reason = "the benchmark's symbols")]
pub struct Area {
    /// Inertia.
    pub H: f64,
    /// Speed regulation.
    pub R: f64,
    /// Damping: change of load per change of frequency.
    pub D: f64,
    /// Time constant of the prime mover, s.
    pub Tt: f64,
    /// Time constant of the governor, s.
    pub Tg: f64,
    /// |dPref| stays below.
    pub power: f64,
    /// Smallest and largest load of the benchmark's profile.
    pub load: [f64; 2],
}

pub const AREA: [Area; AREAS] = [
    Area { H: 12.0, R: 0.05, D: 0.7, Tt: 0.65, Tg: 0.1, power: 0.5, load: [0.0, 0.15] },
    Area { H: 10.0, R: 0.0625, D: 0.9, Tt: 0.4, Tg: 0.1, power: 0.65, load: [-0.15, 0.0] },
    Area { H: 8.0, R: 0.08, D: 0.9, Tt: 0.3, Tg: 0.1, power: 0.65, load: [-0.12, 0.12] },
    Area { H: 8.0, R: 0.08, D: 0.7, Tt: 0.6, Tg: 0.1, power: 0.55, load: [0.0, 0.28] },
];

/// |dtheta| stays below, in every area.
pub const ANGLE: f64 = 0.1;

/// P_ij: slope of the tie-line power between areas i and j.
pub const TIE: [[f64; AREAS]; AREAS] =
    [[0.0, 4.0, 0.0, 0.0], [4.0, 0.0, 2.0, 0.0], [0.0, 2.0, 0.0, 2.0], [0.0, 0.0, 2.0, 0.0]];

/// Weights of the benchmark's figure eta, and of the controllers: states, input.
pub const STATE_WEIGHT: [f64; NX] = [500.0, 0.01, 0.01, 10.0];
pub const INPUT_WEIGHT: f64 = 10.0;

/// Areas that share a tie line with area `i`.
pub fn neighbours(i: usize) -> impl Iterator<Item = usize> {
    (0..AREAS).filter(move |&j| TIE[i][j] != 0.0)
}
