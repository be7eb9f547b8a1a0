use nalgebra::DVector;

/// {x : min <= x <= max}.
#[derive(Debug, Clone, PartialEq)]
pub struct Box {
    pub min: DVector<f64>,
    pub max: DVector<f64>,
}

impl Box {
    /// Product of the widths.
    pub fn volume(&self) -> f64 {
        self.min.iter().zip(&self.max).map(|(min, max)| max - min).product()
    }

    pub fn contains(&self, x: &DVector<f64>) -> bool {
        (0..x.len()).all(|k| self.min[k] <= x[k] && x[k] <= self.max[k])
    }
}
