//! What was measured and decided, step by step, in any network.

use dpc_runtime::Control;

/// One subsystem at one step.
#[derive(Debug, Clone)]
pub struct NodeSample {
    /// State of the plant.
    pub x: Vec<f64>,
    /// Input to the plant.
    pub u: Vec<f64>,
    pub set_point: Vec<f64>,
    /// yref_t.
    pub y_ref: Vec<f64>,
    /// xhat_{t|t}.
    pub x_nom: Vec<f64>,
    /// zref_t.
    pub z_ref: Vec<f64>,
    pub control: Control,
    /// Whether the references have lost the guarantee.
    pub unguaranteed: bool,
}

/// All subsystems at one step.
#[derive(Debug, Clone)]
pub struct Sample {
    pub nodes: Vec<NodeSample>,
}

/// Samples from step 0 on.
#[derive(Debug, Clone)]
pub struct Trajectory {
    /// Sampling period in s.
    pub period: f64,
    pub samples: Vec<Sample>,
}

impl Trajectory {
    pub fn new(period: f64) -> Self {
        Self { period, samples: Vec::new() }
    }

    /// Duration in s.
    pub fn end(&self) -> f64 {
        self.samples.len() as f64 * self.period
    }

    /// (time in s, value) of one signal of subsystem `node`.
    pub fn signal(&self, node: usize, of: impl Fn(&NodeSample) -> f64) -> Vec<(f64, f64)> {
        let values = self.samples.iter().map(|sample| of(&sample.nodes[node]));
        values.enumerate().map(|(step, value)| (step as f64 * self.period, value)).collect()
    }

    /// Comma-separated values: time, then what `columns` names and `values` gives per subsystem, one line per step.
    pub fn to_csv(&self, columns: &[String], values: impl Fn(usize, &Sample) -> Vec<f64>) -> String {
        let mut csv = format!("time_s,{}\n", columns.join(","));
        for (step, sample) in self.samples.iter().enumerate() {
            csv += &(step as f64 * self.period).to_string();
            values(step, sample).iter().for_each(|value| csv.push_str(&format!(",{value}")));
            csv.push('\n');
        }
        csv
    }
}
