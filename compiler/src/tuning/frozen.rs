//! Gains as lines of the file they were found for.

use std::fmt::Write;

use nalgebra::DMatrix;

use crate::gains::Gains;
use crate::network::Network;

/// `K`, `Kx` and `Ke` of every subsystem, each set of lines to be pasted into its table to make a later design with
/// these gains and without a search. The text is TOML.
pub fn frozen(network: &Network, gains: &Gains) -> String {
    let mut text = format!("# Gains of {}: paste the lines of each subsystem into its table.\n", network.name);
    for (s, g) in network.subsystems.iter().zip(&gains.subsystems) {
        // Writing to a string cannot fail.
        let _ =
            write!(text, "\n[subsystem.{}]\nK = {}\nKx = {}\nKe = {}\n", s.name, rows(&g.K), rows(&g.Kx), rows(&g.Ke));
    }
    text
}

fn rows(matrix: &DMatrix<f64>) -> String {
    let rows: Vec<String> = matrix.row_iter().map(|row| format!("{:?}", row.iter().collect::<Vec<_>>())).collect();
    format!("[{}]", rows.join(", "))
}
