//! What several test files share: the cases, and the pipeline they go through.

use std::fs;
use std::path::{Path, PathBuf};

use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::{Diagnostics, Source};
use dpc_codegen::network::Network;
use dpc_codegen::spec::Spec;
use nalgebra::DMatrix;

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

    /// Small decimal numbers of either sign, some of them 0.
    pub fn matrix(&mut self, rows: usize, columns: usize) -> DMatrix<f64> {
        DMatrix::from_fn(rows, columns, |_, _| (self.below(21) as f64 - 10.0) / 10.0)
    }
}
