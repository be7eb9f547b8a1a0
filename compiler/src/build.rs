//! For build scripts: the compiler in three lines.
//!
//! In `Cargo.toml` (`dpc-codegen new` writes all of this):
//!
//! ```toml
//! [dependencies]
//! dpc-runtime = "0.1"
//!
//! [build-dependencies]
//! dpc-codegen = { version = "0.1", default-features = false }
//!
//! [profile.dev.build-override] # and [profile.release.build-override]: designs are 25 times faster
//! opt-level = 3
//! ```
//!
//! In `main` of `build.rs`:
//!
//! ```no_run
//! dpc_codegen::Build::new("system.toml").compile();
//! ```
//!
//! In the crate, for a network whose `name` is `four-tank`:
//!
//! ```ignore
//! pub mod controllers {
//!     dpc_runtime::include_controllers!("four_tank");
//! }
//! ```
//!
//! That is a module per subsystem, with the Rust that `dpc-codegen system.toml` writes under `generated/four_tank/`, and the
//! module `network`: all of them together, and the plant. Beside them lie `summary.txt`, what the command prints of the design, and
//! `design.json`. Firmware of one node uses one module; a linker drops the others.
//!
//! # Mistakes
//! A mistake in the file becomes an error of the compiler where the controllers are included, with code, line and column in the
//! file, numbers and what to try, as the command prints them. The build script itself succeeds: what cargo shows of one that fails
//! is buried among its output and is no diagnostic for an editor, which without `OUT_DIR` also loses every name of the module. Only
//! where nothing says which module is meant (the file is missing, or has no `name`) does the build script report errors of its own.
//!
//! # Again
//! Cargo runs the script again when a file that the design is made of changes. Where only its date did, nothing is designed.

mod mistakes;
mod stamp;

use std::fmt;
use std::path::{Path, PathBuf};

use crate::design::{Design, Request};
use crate::diagnostic::{Diagnostic, Diagnostics, Source};
use crate::emit::{Emitted, package_folder, write_all};
use crate::export::design_json;
use crate::network::Scalar;
use crate::spec::{Spec, StartOf};
use crate::summary::Summary;
use crate::tuning::Effort;
use stamp::Stamp;

/// A network to design and emit.
#[derive(Debug, Clone)]
pub struct Build {
    file: PathBuf,
    scalar: Option<Scalar>,
    effort: Option<Effort>,
    start: Option<PathBuf>,
    samples: Option<usize>,
    out: Option<PathBuf>,
}

/// Why there are no controllers: one text for the user per mistake.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Failure(pub Vec<String>);

impl Build {
    /// The network of `file`, a path from the package's folder.
    pub fn new(file: impl Into<PathBuf>) -> Self {
        Self { file: file.into(), scalar: None, effort: None, start: None, samples: None, out: None }
    }

    /// What the controllers compute in, instead of `scalar` in the file.
    pub fn scalar(self, scalar: Scalar) -> Self {
        Self { scalar: Some(scalar), ..self }
    }

    /// How long to search for better gains, 0 to [`Effort::MOST`] (more is the same), instead of `effort` in the file.
    pub fn effort(self, level: u8) -> Self {
        Self { effort: Effort::new(level.min(Effort::MOST)), ..self }
    }

    /// Starts from the states in this file (a table per subsystem, with `x0`) instead of those in the network's.
    pub fn start(self, file: impl Into<PathBuf>) -> Self {
        Self { start: Some(file.into()), ..self }
    }

    /// Counts the solver's iterations on that many problems per subsystem and sets their limits by it; see [`crate::iterations`].
    pub fn iterations(self, samples: usize) -> Self {
        Self { samples: Some(samples.max(1)), ..self }
    }

    /// Where the network's folder goes, instead of `OUT_DIR`.
    pub fn out_dir(self, folder: impl Into<PathBuf>) -> Self {
        Self { out: Some(folder.into()), ..self }
    }

    /// Writes the controllers to `$OUT_DIR/<name of the network>/`, or what is wrong in their place, and tells cargo when to run
    /// the script again. To be called by a build script.
    pub fn compile(&self) {
        let Some(out) = self.out.clone().or_else(|| std::env::var_os("OUT_DIR").map(PathBuf::from)) else {
            return complain("only cargo can run a build script: OUT_DIR is not set");
        };
        [Some(&self.file), self.start.as_ref()].into_iter().flatten().for_each(|file| rerun_if_changed(file));
        let imported = self.imported();
        imported.iter().for_each(|file| rerun_if_changed(file));
        if let Some(stamp) = Stamp::current(&out, self).filter(|_| imported.is_empty()) {
            return stamp.inputs().for_each(rerun_if_changed);
        }
        match self.attempt(&out) {
            Ok((folder, sources)) => {
                sources.iter().for_each(|source| rerun_if_changed(source.path.as_ref()));
                let outdated = mistakes::outdate(&out, &self.file, &folder);
                if let Err(error) = outdated.and_then(|()| Stamp::write(&out, self, &folder, &sources)) {
                    complain(&error.to_string());
                }
            }
            Err(failure) => {
                if !mistakes::leave(&out, self, &failure) {
                    failure.0.iter().for_each(|mistake| complain(mistake));
                }
            }
        }
    }

    /// Writes the controllers to `<out_dir>/<name of the network>/`, which is returned, and tells nobody. Without
    /// [`Build::out_dir`] that is in `OUT_DIR`, or where there is none, here.
    ///
    /// # Errors
    /// The mistakes in the file, or what the file system reports; then nothing is written.
    pub fn write(&self) -> Result<PathBuf, Failure> {
        let out = self.out.clone().or_else(|| std::env::var_os("OUT_DIR").map(PathBuf::from)).unwrap_or_default();
        Ok(self.attempt(&out)?.0)
    }

    /// Folder that was written, and the files that were read.
    fn attempt(&self, out: &Path) -> Result<(PathBuf, Vec<Source>), Failure> {
        let sources = self.sources()?;
        let design = self.designed(&sources)?;
        let folder = out.join(package_folder(&design.network));
        let emitted = Emitted::new(&design);
        let (summary, json) = (Summary::new(&design, &emitted).to_string(), design_json(&design));
        let mut files = emitted.paths(&folder);
        files.extend([(folder.join("summary.txt"), &*summary), (folder.join("design.json"), &*json)]);
        write_all(&files)?;
        Ok((folder, sources))
    }

    /// The design, without writing anything.
    ///
    /// # Errors
    /// The mistakes in the file, or that it cannot be read.
    pub fn design(&self) -> Result<Design, Failure> {
        self.designed(&self.sources()?)
    }

    /// Files that are named in those.
    fn imported(&self) -> Vec<PathBuf> {
        let mut imported = located(&self.file).map(|source| Spec::files(&source)).unwrap_or_default();
        let starts = self.start.as_ref().and_then(|file| located(file).ok());
        imported.extend(starts.iter().flat_map(StartOf::files));
        imported
    }

    /// Every file that a design is made of: the network's first, then that of starts. What was read is what counts, whatever
    /// becomes of the files meanwhile.
    fn sources(&self) -> Result<Vec<Source>, Failure> {
        [Some(&self.file), self.start.as_ref()].into_iter().flatten().map(|file| located(file)).collect()
    }

    fn designed(&self, sources: &[Source]) -> Result<Design, Failure> {
        let [source, starts @ ..] = sources else { return Err(Failure(Vec::new())) };
        let failed = |source: &Source| {
            let source = source.clone();
            move |mistakes: Diagnostics| Failure::new(&mistakes, &source)
        };
        let request = Request { scalar: self.scalar, effort: self.effort, anywhere: !starts.is_empty() };
        let design = Design::requested(source.clone(), &request, &mut ()).map_err(failed(source))?;
        let design = match starts {
            [starts, ..] => design.started(starts).map_err(failed(starts))?,
            [] => design,
        };
        Ok(match self.samples {
            Some(samples) => design.counted(samples),
            None => design,
        })
    }
}

impl Failure {
    fn new(mistakes: &Diagnostics, source: &Source) -> Self {
        let alone = |mistake: Diagnostic| Diagnostics::from(mistake).render(source, false);
        Self(mistakes.0.iter().cloned().map(alone).collect())
    }
}

impl From<std::io::Error> for Failure {
    fn from(error: std::io::Error) -> Self {
        Self(vec![format!("error: {error}")])
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.join("\n\n"))
    }
}

impl std::error::Error for Failure {}

/// The text of `file`, under its whole path: who reads an error may be in another folder.
fn located(file: &Path) -> Result<Source, Failure> {
    let path = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
    Source::read(&path).map_err(|why| Failure(vec![why.to_string()]))
}

fn rerun_if_changed(file: &Path) {
    println!("cargo::rerun-if-changed={}", file.display());
}

/// Cargo shows these lines, and fails.
fn complain(message: &str) {
    message.trim_start_matches("error: ").lines().for_each(|line| println!("cargo::error={line}"));
}
