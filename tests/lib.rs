//! What several test files share: the cases, and the pipeline they go through.

pub mod adversarial;
pub mod checker;
pub mod double_double;
pub mod exposed;
pub mod host_loop;
pub mod large_network;
pub mod least_distance;
pub mod load_shares;
pub mod plants;
pub mod problem_checker;
pub mod random_network;
pub mod runtime_twin;
pub mod start_checker;
pub mod strips;
pub mod tank_loop;
pub mod tank_runs;
pub mod unknowns;
pub mod weather;

use std::fs;
use std::path::{Path, PathBuf};

use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::{Diagnostics, Source};
use dpc_codegen::gains::Gains;
use dpc_codegen::network::Network;
use dpc_codegen::problems::Problems;
use dpc_codegen::sets::Sets;
use dpc_codegen::sizing::Sizing;
use dpc_codegen::spec::Spec;
use nalgebra::{DMatrix, DVector};

/// Every stage a case goes through.
///
/// # Errors
/// The mistakes of the first stage that finds any.
pub fn compile(source: Source) -> Result<(), Diagnostics> {
    Design::new(source).map(drop)
}

/// The input stages.
///
/// # Errors
/// The mistakes of the first stage that finds any.
pub fn lower(source: Source) -> Result<Network, Diagnostics> {
    let spec = Spec::parse(&source)?;
    Network::new(&spec, source)
}

/// A design by the proof and the matrices that large networks have, whatever the size; `None` where that proof fails, or a
/// later stage.
pub fn sparsely(network: Network) -> Option<Design> {
    let gains = Gains::sparse(&network).ok()?;
    let sets = Sets::new(&network, &gains).ok()?;
    let sizing = Sizing::new(&network, &gains, &sets).ok()?;
    let problems = Problems::new(&network, &gains, &sets, &sizing).ok()?;
    Some(Design { network, gains, sets, sizing, problems, tuning: None, start: None, samples: None })
}

/// The files of `cases/<folder>` in the order of their names, with paths relative to this package.
///
/// # Panics
/// The folder cannot be read: the checkout is broken.
pub fn cases(folder: &str) -> Vec<Source> {
    let folder = Path::new("cases").join(folder);
    let mut paths: Vec<PathBuf> = fs::read_dir(root().join(&folder))
        .expect("the folder of cases is in the repository")
        .map(|entry| folder.join(entry.expect("a readable folder").file_name()))
        .collect();
    paths.sort();
    paths.iter().map(|path| read(path)).collect()
}

/// The file at `path`, relative to this package.
///
/// # Panics
/// The file cannot be read: the checkout is broken.
pub fn read(path: &Path) -> Source {
    let text = fs::read_to_string(root().join(path)).expect("a case is readable text");
    Source { path: path.to_string_lossy().replace('\\', "/"), text }
}

/// The folder of this package.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// How many random cases a test tries: `default`, or what the environment variable `DPC_CASES` says.
pub fn cases_wanted(default: usize) -> usize {
    std::env::var("DPC_CASES").ok().and_then(|count| count.parse().ok()).unwrap_or(default)
}

/// Pseudo-random numbers (SplitMix64), the same ones for the same seed.
pub struct Random(pub u64);

impl Random {
    /// An integer of 0 to `limit - 1`.
    pub fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % limit as u64) as usize
    }

    /// A number of `[low, high)`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.below(1 << 53) as f64 / (1u64 << 53) as f64)
    }

    /// A number of `[low, high)` whose logarithm is uniform.
    pub fn magnitude(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }

    /// True with probability `share`.
    pub fn chance(&mut self, share: f64) -> bool {
        self.between(0.0, 1.0) < share
    }

    /// 1 or -1.
    pub fn sign(&mut self) -> f64 {
        if self.chance(0.5) { 1.0 } else { -1.0 }
    }

    /// A vector of unit length.
    pub fn direction(&mut self, n: usize) -> DVector<f64> {
        loop {
            let v = DVector::from_fn(n, |_, _| self.between(-1.0, 1.0));
            if v.norm() > 1e-3 && v.norm() <= 1.0 || n == 0 {
                return v.normalize();
            }
        }
    }

    /// 0, ..., n - 1 in some order.
    pub fn order(&mut self, n: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..n).collect();
        (1..n).rev().for_each(|k| order.swap(k, self.below(k + 1)));
        order
    }

    /// Small decimal numbers of either sign, some of them 0.
    pub fn matrix(&mut self, rows: usize, columns: usize) -> DMatrix<f64> {
        DMatrix::from_fn(rows, columns, |_, _| (self.below(21) as f64 - 10.0) / 10.0)
    }
}
