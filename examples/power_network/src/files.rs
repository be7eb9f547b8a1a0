//! The designs' TOML files, written from the model of [`crate::areas`]; `power-network --designs` writes them.

use std::fmt::Write;

use crate::areas::{ANGLE, AREA, AREAS, INPUT_WEIGHT, NX, SAMPLE_TIME, STATE_WEIGHT, neighbours};
use crate::model::Model;
use example_kit::matrix::Matrix;

/// Which model the controllers have, and what they know of the loads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Design {
    pub plant: Plant,
    pub loads: Known,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Plant {
    /// [`Model::angles_held`].
    Held,
    /// [`Model::frequencies_told`], with what it leaves out of [`Model::exact`] as a disturbance.
    Exact,
    /// The same with [`Model::angles_held`], to see what the neighbours' frequencies are worth: there is no such design.
    ExactByAngles,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Known {
    Measured,
    Unknown,
}

/// Bounds of |dtheta|, |domega|, |dPm|, |dPv| in the designs for the exact plant: what the model leaves out is bounded where the
/// states are. The benchmark bounds the angle alone.
const STATE_BOUND: [f64; NX] = [ANGLE, 0.1, 1.4, 1.6];

/// The benchmark's own horizon.
pub const BENCHMARK_HORIZON: usize = 15;

const GAINS: &str = "gain-weights = { Q = [1500.0, 30.0, 0.35, 5.0], R = 1.0 }
reference-weights = { Q = [1.0, 1000.0, 0.1, 1.0], Qe = 300.0, R = 1.0 }
";

impl Design {
    pub const ALL: [Self; 4] = [
        Self { plant: Plant::Held, loads: Known::Measured },
        Self { plant: Plant::Held, loads: Known::Unknown },
        Self { plant: Plant::Exact, loads: Known::Measured },
        Self { plant: Plant::Exact, loads: Known::Unknown },
    ];

    /// In this package.
    pub fn path(self) -> &'static str {
        match (self.plant, self.loads) {
            (Plant::Held, Known::Measured) => "system.toml",
            (Plant::Held, Known::Unknown) => "designs/unknown.toml",
            (_, Known::Measured) => "designs/exact.toml",
            (_, Known::Unknown) => "designs/exact_unknown.toml",
        }
    }

    /// Steps that the controllers look ahead. References are that much ahead of the loads but one, and these jump: with 1 nothing
    /// is left for the tube to hold.
    pub fn horizon(self) -> usize {
        match self.loads {
            Known::Measured => 1,
            Known::Unknown => 5,
        }
    }

    /// What the controllers take for the plant.
    pub fn model(self) -> Model {
        match self.plant {
            Plant::Held | Plant::ExactByAngles => Model::angles_held(),
            Plant::Exact => Model::frequencies_told(),
        }
        .rounded()
    }

    /// The file at the benchmark's loads.
    pub fn text(self) -> String {
        self.scaled(1.0, 1.0, self.horizon())
    }

    /// The file at `share` times the benchmark's loads, and `error` times what the model leaves out.
    pub fn scaled(self, share: f64, error: f64, horizon: usize) -> String {
        let model = self.model();
        let mut text = self.head(horizon);
        for i in 0..AREAS {
            text += &self.area(i, &model, share, error);
            neighbours(i).for_each(|j| text += &link(i, j, &model));
        }
        text
    }

    fn head(self, horizon: usize) -> String {
        let (name, about) = match (self.plant, self.loads) {
            (Plant::Held, Known::Measured) => ("power-network", HELD_MEASURED),
            (Plant::Held, Known::Unknown) => ("power-network-unknown", HELD_UNKNOWN),
            (_, Known::Measured) => ("power-network-exact", EXACT_MEASURED),
            (_, Known::Unknown) => ("power-network-exact-unknown", EXACT_UNKNOWN),
        };
        let step = match self.loads {
            Known::Measured => {
                "N = 1: a load counts from the step that measures it, so it may jump over its whole range"
            }
            Known::Unknown => "N",
        };
        format!(
            "{SOURCE}{about}\nname = \"{name}\"\nsample-time = {SAMPLE_TIME:?}                # s\n\
             horizon = {horizon}                      # {step}\n\n[reference]\nnorm = \"inf\"\n"
        )
    }

    fn area(self, i: usize, model: &Model, share: f64, error: f64) -> String {
        let (own, area) = (NX * i..NX * (i + 1), AREA[i]);
        let mut text = format!(
            "\n[subsystem.area_{}]\nstates = [\"dtheta [rad]\", \"domega [rad/s]\", \"dPm [pu]\", \"dPv [pu]\"]\n\
             inputs = [\"dPref [pu]\"]\noutputs = [\"dtheta [rad]\"]\n",
            i + 1
        );
        let mut line = |key: &str, value: String| writeln!(text, "{key} = {value}").unwrap_or_default();
        line("A", matrix(&model.A.block(own.clone(), own.clone())));
        line("B", matrix(&model.B.block(own.clone(), i..i + 1)));
        line("C", "[[1.0, 0.0, 0.0, 0.0]]".to_owned());
        line("x", self.state_bounds());
        line("u", format!("{{ min = [-{0:?}], max = [{0:?}] }}", area.power));
        line("Q", row(&STATE_WEIGHT));
        line("R", format!("{INPUT_WEIGHT:?}"));
        let [min, max] = area.load.map(|load| share * load);
        let load = model.M.block(own, i..i + 1);
        if self.loads == Known::Measured {
            line("loads", "[\"dPL [pu]\"]".to_owned());
            line("M", matrix(&load));
            line(
                "d",
                format!("{{ min = [{min:?}], max = [{max:?}] }}     # without a d-rate: from end to end in one step"),
            );
        }
        text += &self.disturbance(i, &load, [min, max], error);
        text + GAINS
    }

    fn state_bounds(self) -> String {
        let bounds = match self.plant {
            Plant::Held => [ANGLE, f64::INFINITY, f64::INFINITY, f64::INFINITY],
            Plant::Exact | Plant::ExactByAngles => STATE_BOUND,
        };
        format!("{{ min = {}, max = {} }}", row(&bounds.map(|bound| -bound)), row(&bounds))
    }

    /// The key w: the rest of the exact plant, plus the load where it is unknown.
    fn disturbance(self, i: usize, load: &Matrix, range: [f64; 2], error: f64) -> String {
        let rest = match self.plant {
            Plant::Held => vec![0.0; NX],
            Plant::Exact | Plant::ExactByAngles => {
                self.left_out()[NX * i..NX * (i + 1)].iter().map(|w| error * w).collect()
            }
        };
        match (self.plant, self.loads) {
            (Plant::Held, Known::Measured) => String::new(),
            (_, Known::Measured) => {
                let min: Vec<f64> = rest.iter().map(|w| -w).collect();
                format!("w = {{ min = {}, max = {} }}     # what the model leaves out\n", row(&min), row(&rest))
            }
            (_, Known::Unknown) => {
                let load: Vec<f64> = load.rows.iter().map(|row| row[0]).collect();
                let (rows, limits) = box_plus_segment(&rest, &load, range);
                format!(
                    "# M times an unknown load dPL from {:?} to {:?}, M = {}',\n# plus a box of half-widths {}\n\
                     w = {{ H = {},\n      h = {} }}\n",
                    range[0],
                    range[1],
                    row(&load),
                    row(&rest),
                    matrix(&Matrix { rows }),
                    row(&limits)
                )
            }
        }
    }

    /// Half-widths of the box that holds what the model leaves out of the exact plant, as long as states, inputs and loads keep
    /// their bounds; two digits, rounded up.
    pub fn left_out(self) -> Vec<f64> {
        let x: Vec<f64> = (0..AREAS * NX).map(|k| STATE_BOUND[k % NX]).collect();
        let d = AREA.map(|area| area.load[1].max(-area.load[0]));
        let apart = Model::exact().apart(&self.model(), &x, &AREA.map(|area| area.power), &d);
        apart.into_iter().map(upwards).collect()
    }
}

const SOURCE: &str = "\
# Load-frequency control of four areas, scenario 1 of S. Riverso and G. Ferrari-Trecate, \"Hycon2 benchmark: power network
# system\" (arXiv 1207.2000). Deviations from the operating point: angle dtheta, frequency domega, mechanical power dPm, valve
# position dPv; input: reference power dPref; load dPL. The angle is the tracked output: it is at rest only where the frequency
# deviation is 0, and with the frequency itself as output Assumption 2 fails. Written by `power-network --designs`.
#
";

const HELD_MEASURED: &str = "\
# The model of each area is its exact discretisation with the neighbours' angles held over the sampling period. Loads are
# measured.
";

const HELD_UNKNOWN: &str = "\
# The model of each area is its exact discretisation with the neighbours' angles held over the sampling period. Loads are
# unknown: any sequence within the benchmark's bounds.
";

const EXACT_MEASURED: &str = "\
# For the exact discretisation of the whole network: each area's model knows its own part and its neighbours' angles and
# frequencies; w bounds the rest of the plant, for which all states are bounded. Loads are measured.
";

const EXACT_UNKNOWN: &str = "\
# For the exact discretisation of the whole network: each area's model knows its own part and its neighbours' angles and
# frequencies; w bounds the rest of the plant, for which all states are bounded, and the loads, which are unknown.
";

fn link(i: usize, j: usize, model: &Model) -> String {
    let block = model.A.block(NX * i..NX * (i + 1), NX * j..NX * (j + 1));
    format!("\n[subsystem.area_{}.from.area_{}]\nA = {}\n", i + 1, j + 1, matrix(&block))
}

/// Rows and limits of {b + m d : |b_k| <= half_k, low <= d <= high}: its facets are parallel to all axes but one, or to the segment
/// and all axes but two.
fn box_plus_segment(half: &[f64], m: &[f64], [low, high]: [f64; 2]) -> (Vec<Vec<f64>>, Vec<f64>) {
    let mut facets = Vec::new();
    for k in 0..NX {
        for sign in [1.0, -1.0] {
            let mut normal = vec![0.0; NX];
            normal[k] = sign;
            facets.push((normal, half[k] + (sign * m[k] * low).max(sign * m[k] * high)));
        }
    }
    for (k, l) in (0..NX).flat_map(|k| (0..k).map(move |l| (k, l))) {
        for sign in [1.0, -1.0] {
            let mut normal = vec![0.0; NX];
            (normal[k], normal[l]) = (sign * m[l], -sign * m[k]);
            facets.push((normal, m[l].abs() * half[k] + m[k].abs() * half[l]));
        }
    }
    facets.into_iter().unzip()
}

/// The next larger number with two significant digits.
fn upwards(value: f64) -> f64 {
    let near = crate::model::significant(value, 2);
    if near >= value || value == 0.0 { near } else { crate::model::significant(value * 1.06, 2).max(near) }
}

fn matrix(matrix: &Matrix) -> String {
    format!("[{}]", matrix.rows.iter().map(|r| row(r)).collect::<Vec<_>>().join(", "))
}

fn row(row: &[f64]) -> String {
    // -0.0 says nothing that 0.0 does not.
    let number = |x: &f64| if *x == 0.0 { "0.0".to_owned() } else { format!("{x:?}") };
    format!("[{}]", row.iter().map(number).collect::<Vec<_>>().join(", "))
}

impl std::fmt::Display for Design {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let loads = match self.loads {
            Known::Measured => "loads measured",
            Known::Unknown => "loads unknown",
        };
        let plant = match self.plant {
            Plant::Held => "the model",
            Plant::Exact => "the exact plant",
            Plant::ExactByAngles => "the exact plant, by angles alone",
        };
        write!(f, "for {plant}, {loads}")
    }
}
