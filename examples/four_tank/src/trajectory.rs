//! What was measured and decided, step by step; all values are deviations from the working point, in cm and V.

use dpc_runtime::{Control, Status};

use crate::checks::View;
use crate::plant::{Levels, SAMPLE_TIME, Voltages};

/// One subsystem (two tanks, one pump) at one step.
#[derive(Debug, Clone)]
pub struct NodeSample {
    /// State of the plant: lower tank, which is the output y_i, and upper tank.
    pub x: [f64; 2],
    /// Input to the plant.
    pub u: [f64; 1],
    pub set_point: f64,
    /// yref_t.
    pub y_ref: f64,
    /// xhat_{t|t}.
    pub x_nom: [f64; 2],
    /// zref_t.
    pub z_ref: Vec<f64>,
    pub status: Status<1>,
}

/// Both subsystems at one step.
#[derive(Debug, Clone)]
pub struct Sample {
    pub nodes: [NodeSample; 2],
}

impl Sample {
    /// What the checks look at.
    pub fn views(&self) -> impl Iterator<Item = View<'_>> {
        self.nodes.iter().map(|node| View {
            x: &node.x,
            u: &node.u,
            x_nom: &node.x_nom,
            z_ref: &node.z_ref,
            control: node.status.control,
            unguaranteed: !node.status.is_guaranteed(),
        })
    }

    pub fn levels(&self) -> Levels {
        let [left, right] = &self.nodes;
        [left.x[0], left.x[1], right.x[0], right.x[1]]
    }

    pub fn voltages(&self) -> Voltages {
        self.nodes.each_ref().map(|node| node.u[0])
    }
}

/// Samples from step 0 on.
#[derive(Debug, Clone, Default)]
pub struct Trajectory {
    pub samples: Vec<Sample>,
}

impl Trajectory {
    /// Duration in s.
    pub fn end(&self) -> f64 {
        self.samples.len() as f64 * SAMPLE_TIME
    }

    /// (time in s, value) of one signal of subsystem `node`.
    pub fn signal(&self, node: usize, of: impl Fn(&NodeSample) -> f64) -> Vec<(f64, f64)> {
        let values = self.samples.iter().map(|sample| of(&sample.nodes[node]));
        values.enumerate().map(|(step, value)| (step as f64 * SAMPLE_TIME, value)).collect()
    }

    /// Comma-separated values, one line per step, units in the head.
    pub fn to_csv(&self) -> String {
        let mut csv = String::from("time_s");
        for (node, [lower, upper]) in [(1, [1, 2]), (2, [3, 4])] {
            csv += &format!(",h{lower}_cm,h{upper}_cm,v{node}_V,y{node}_set_point_cm,y{node}_ref_cm");
            csv += &format!(",h{lower}_nom_cm,h{upper}_nom_cm,active_{node}");
        }
        csv.push('\n');
        for (step, sample) in self.samples.iter().enumerate() {
            csv += &(step as f64 * SAMPLE_TIME).to_string();
            sample.nodes.iter().for_each(|node| node.append_csv(&mut csv));
            csv.push('\n');
        }
        csv
    }
}

impl NodeSample {
    fn append_csv(&self, csv: &mut String) {
        let numbers = [self.x[0], self.x[1], self.u[0], self.set_point, self.y_ref, self.x_nom[0], self.x_nom[1]];
        numbers.iter().for_each(|number| csv.push_str(&format!(",{number}")));
        match self.status.control {
            Control::AtReference => csv.push_str(",0"),
            Control::Optimal { active, .. } => csv.push_str(&format!(",{active}")),
            other => csv.push_str(&format!(",{other}").replace(", ", "; ")),
        }
    }
}
