//! What the controllers in a folder were made of, so that nothing is designed twice.

use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;
use std::path::{Path, PathBuf};

use super::Build;
use crate::diagnostic::Source;
use crate::emit::write_all;

/// As text: the network's folder, a number for the program and what was asked, then a number and a path per file that was read.
pub struct Stamp {
    inputs: Vec<PathBuf>,
}

impl Stamp {
    /// The one that lies in `out`, where nothing has changed since.
    pub fn current(out: &Path, build: &Build) -> Option<Self> {
        let text = fs::read_to_string(path(out, &build.file)).ok()?;
        let mut lines = text.lines();
        let folder = Path::new(lines.next()?);
        let asked = lines.next()? == asked(build)?.to_string();
        let inputs: Vec<_> = lines.map(|line| line.split_once(' ')).collect::<Option<_>>()?;
        let unchanged =
            inputs.iter().all(|(number, file)| content(Path::new(file)).is_some_and(|now| now.to_string() == *number));
        let complete = folder.join("mod.rs").is_file();
        (asked && unchanged && complete)
            .then(|| Self { inputs: inputs.iter().map(|(_, file)| PathBuf::from(file)).collect() })
    }

    pub fn inputs(&self) -> impl Iterator<Item = &Path> {
        self.inputs.iter().map(PathBuf::as_path)
    }

    /// To be called when `folder` is complete.
    ///
    /// # Errors
    /// What the file system reports.
    pub fn write(out: &Path, build: &Build, folder: &Path, sources: &[Source]) -> io::Result<()> {
        let Some(asked) = asked(build) else { return Ok(()) };
        let mut text = format!("{}\n{asked}\n", folder.display());
        for source in sources {
            text += &format!("{} {}\n", number(source.text.as_bytes()), source.path);
        }
        write_all(&[(path(out, &build.file), &*text)]).map(drop)
    }
}

/// Where the controllers of `file` were when they were last complete.
pub fn folder(out: &Path, file: &Path) -> Option<PathBuf> {
    fs::read_to_string(path(out, file)).ok()?.lines().next().map(PathBuf::from)
}

/// Keeps the folder in mind, and nothing else.
pub fn remove(out: &Path, file: &Path) {
    if let Some(folder) = folder(out, file) {
        // Where that fails, the number of the program differs at the latest.
        let _ = fs::write(path(out, file), format!("{}\n", folder.display()));
    }
}

fn path(out: &Path, file: &Path) -> PathBuf {
    out.join(format!("dpc-codegen-{:016x}.stamp", number(file)))
}

/// Of this program, bytes and all, and what it is asked to do.
fn asked(build: &Build) -> Option<u64> {
    let program = content(&std::env::current_exe().ok()?)?;
    Some(number((program, format!("{build:?}"))))
}

fn content(file: &Path) -> Option<u64> {
    fs::read(file).ok().map(number)
}

fn number(value: impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    value.hash(&mut hasher);
    hasher.finish()
}
