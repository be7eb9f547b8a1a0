//! Networks of any size with slowly decaying modes and constraints that matter: rooms, tanks, masses, in chains and grids.

use std::fmt::Write;

use dpc_codegen::diagnostic::Source;

/// What one subsystem is; always two states, one input and one output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Plant {
    /// Air and walls, heated; air mixes with that of the neighbouring rooms. Walls need an hour.
    Rooms,
    /// A lower and an upper tank; a part of every pump's flow, and every upper tank, feeds the neighbours' lower ones, as in the
    /// quadruple-tank process.
    Tanks,
    /// A damped mass on a spring to the ground, with springs to its neighbours, pushed by a force.
    Masses,
}

/// Who is whose neighbour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    Chain,
    /// Rows of this many subsystems.
    Grid(usize),
}

/// A network; the same one for the same values.
#[derive(Debug, Clone, Copy)]
pub struct LargeNetwork {
    pub plant: Plant,
    pub shape: Shape,
    pub count: usize,
    /// How many different parameters there are: 1 makes all subsystems with as many neighbours equal.
    pub kinds: usize,
}

impl LargeNetwork {
    pub fn source(&self) -> Source {
        Source { path: "large.toml".to_owned(), text: self.toml() }
    }

    pub fn toml(&self) -> String {
        let (sample_time, horizon, epsilon) = match self.plant {
            Plant::Rooms => (60.0, 5, 0.02),
            Plant::Tanks => (0.5, 3, 0.02),
            Plant::Masses => (0.1, 5, 0.002),
        };
        let mut text = format!(
            "name = \"large\"\nsample-time = {sample_time:?}\nhorizon = {horizon}\n\n[reference]\nepsilon = {epsilon:?}\n"
        );
        for i in 0..self.count {
            self.subsystem(i, &mut text);
        }
        text
    }

    fn neighbours(&self, i: usize) -> Vec<usize> {
        let width = match self.shape {
            Shape::Chain => self.count,
            Shape::Grid(width) => width,
        };
        let (row, column) = (i / width, i % width);
        let beside = [(column > 0).then(|| i - 1), (column + 1 < width).then_some(i + 1)];
        let above = [(row > 0).then(|| i - width), Some(i + width)];
        beside.into_iter().chain(above).flatten().filter(|j| *j < self.count).collect()
    }

    /// Between 0 and 1, one value for each kind.
    fn variety(&self, i: usize) -> f64 {
        let kind = i % self.kinds.max(1);
        // The golden ratio spreads any number of kinds evenly.
        (kind as f64 * 0.618_033_988_749_895).fract()
    }

    fn subsystem(&self, i: usize, text: &mut String) {
        let (neighbours, v) = (self.neighbours(i), self.variety(i));
        let count = neighbours.len() as f64;
        let (names, own, from) = match self.plant {
            Plant::Rooms => (ROOM, room(v, count), "A = [[0.02, 0.0], [0.0, 0.0]]".to_owned()),
            Plant::Tanks => (
                TANK,
                tank(v),
                format!("A = [[0.0, {:?}], [0.0, 0.0]]\nB = [[{:?}], [0.0]]", 0.02 / count, 0.002 / count),
            ),
            Plant::Masses => (MASS, mass(v, count), format!("A = [[0.0, 0.0], [{:?}, 0.0]]", 0.02)),
        };
        let _ = write!(text, "\n[subsystem.s{i}]\n{names}{own}");
        for j in neighbours {
            let _ = write!(text, "[subsystem.s{i}.from.s{j}]\n{from}\n");
        }
    }
}

const ROOM: &str = "states = [\"air [K]\", \"wall [K]\"]\ninputs = [\"heat [kW]\"]\noutputs = [\"air [K]\"]\n";
const TANK: &str = "states = [\"lower [cm]\", \"upper [cm]\"]\ninputs = [\"pump [V]\"]\noutputs = [\"lower [cm]\"]\n";
const MASS: &str =
    "states = [\"position [m]\", \"speed [m/s]\"]\ninputs = [\"force [N]\"]\noutputs = [\"position [m]\"]\n";

fn room(v: f64, neighbours: f64) -> String {
    let (air, wall) = (0.9 - 0.02 * v - 0.02 * neighbours, 0.983 + 0.004 * v);
    format!(
        "A = [[{air:?}, 0.05], [0.01, {wall:?}]]\nB = [[0.05], [0.0]]\nC = [[1.0, 0.0]]\n\
         x = {{ min = [-5.0, -5.0], max = [5.0, 5.0] }}\nu = {{ min = [-5.0], max = [8.0] }}\n"
    )
}

fn tank(v: f64) -> String {
    let (lower, upper) = (0.991 + 0.004 * v, 0.978 + 0.005 * v);
    format!(
        "A = [[{lower:?}, 0.0], [0.0, {upper:?}]]\nB = [[0.04], [0.016]]\nC = [[1.0, 0.0]]\n\
         x = {{ min = [-12.4, -1.5], max = [27.6, 38.6] }}\nu = {{ min = [-3.0], max = [3.0] }}\ngain-weights = {{ R = 100.0 }}\n"
    )
}

fn mass(v: f64, neighbours: f64) -> String {
    let (spring, damping) = (0.1 + 0.02 * neighbours, 0.9 - 0.05 * v);
    format!(
        "A = [[1.0, 0.1], [{:?}, {damping:?}]]\nB = [[0.005], [0.1]]\nC = [[1.0, 0.0]]\n\
         x = {{ min = [-1.0, -1.0], max = [1.0, 1.0] }}\nu = {{ min = [-2.0], max = [2.0] }}\n",
        -spring
    )
}
