//! What the design promises, read from its `design.json` and not from the controllers that have to keep it.

use serde::Deserialize;

/// The part of `design.json` that the checks and the pictures need; deviation variables, in the user's units.
#[derive(Debug, Clone, Deserialize)]
pub struct Promise {
    /// Largest step of the references.
    #[serde(default)]
    pub epsilon: f64,
    pub subsystems: Vec<Subsystem>,
}

#[derive(Debug, Clone, Deserialize)]
#[expect(non_snake_case, reason = "the paper's symbols")]
pub struct Subsystem {
    pub name: String,
    /// A_ii.
    pub A: Vec<Vec<f64>>,
    /// B_ii.
    pub B: Vec<Vec<f64>>,
    /// C_zi of (1c).
    pub Cz: Vec<Vec<f64>>,
    /// D_zi of (1c).
    pub Dz: Vec<Vec<f64>>,
    /// K_i of (17); read by those who choose disturbances.
    #[serde(default)]
    pub K: Vec<Vec<f64>>,
    /// X_i.
    pub X: Polytope,
    /// U_i.
    pub U: Polytope,
    /// E_i of (18): x - xhat stays inside.
    pub rpi: Polytope,
    /// Z_i: z - zref stays inside.
    pub z_set: Polytope,
    /// Y_i.
    pub y_set: Polytope,
    /// What may be added to the next state, where the design knows of anything.
    #[serde(default)]
    pub disturbance: Option<Polytope>,
    /// Largest error of each measured state.
    #[serde(default)]
    pub measurement_error: Vec<f64>,
    /// From measured loads to the next state, their bounds and largest changes per step.
    #[serde(default)]
    pub M: Vec<Vec<f64>>,
    #[serde(default)]
    pub load_set: Option<Polytope>,
    #[serde(default)]
    pub load_rate: Vec<f64>,
}

/// {v : H v <= h}.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[expect(non_snake_case, reason = "the keys of design.json")]
pub struct Polytope {
    pub H: Vec<Vec<f64>>,
    pub h: Vec<f64>,
}

impl Promise {
    /// # Errors
    /// What is wrong with `json` as a `design.json`.
    pub fn new(json: &str) -> Result<Self, serde_json::Error> {
        serde_json::from_str(json)
    }

    /// Ends of Y_i per subsystem, of networks with one output each and Y_i an interval.
    pub fn output_ranges(&self) -> Vec<[f64; 2]> {
        self.subsystems.iter().map(|subsystem| subsystem.y_set.interval(0)).collect()
    }
}

impl Subsystem {
    /// z = Cz x + Dz u.
    pub fn coupling_output(&self, x: &[f64], u: &[f64]) -> Vec<f64> {
        self.Cz.iter().zip(&self.Dz).map(|(of_x, of_u)| dot(of_x, x) + dot(of_u, u)).collect()
    }

    /// M d.
    pub fn push(&self, d: &[f64]) -> Vec<f64> {
        self.M.iter().map(|row| dot(row, d)).collect()
    }
}

impl Polytope {
    /// Per row, how much is left: h - H v.
    pub fn margins(&self, v: &[f64]) -> impl Iterator<Item = f64> {
        self.H.iter().zip(&self.h).map(move |(row, limit)| limit - dot(row, v))
    }

    /// Smallest and largest value of one coordinate of a box, infinite where it has none.
    pub fn interval(&self, coordinate: usize) -> [f64; 2] {
        let ends = self.H.iter().zip(&self.h).map(|(row, limit)| (row[coordinate], limit / row[coordinate]));
        ends.fold([f64::NEG_INFINITY, f64::INFINITY], |[low, high], (side, end)| match side {
            side if side > 0.0 => [low, high.min(end)],
            side if side < 0.0 => [low.max(end), high],
            _ => [low, high],
        })
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
