//! Writing files so that no reader ever sees half of one.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Writes `files`; folders are made where they are missing. Every text goes to a temporary name first; only when all
/// are on disk are they renamed, one by one. A file that already holds its text is not touched, so that its date
/// stays. Returns, in the order of the files, whether each changed.
///
/// # Errors
/// What the file system reports, with the path; then no file has been written or changed under its final name,
/// unless a rename itself failed half way through.
pub fn write_all<T: AsRef<[u8]>>(files: &[(PathBuf, T)]) -> io::Result<Vec<bool>> {
    let mut staged = Staged::default();
    let mut changed = Vec::new();
    if let Some((path, _)) = files.iter().find(|(path, _)| path.is_dir()) {
        return Err(with_path(io::ErrorKind::IsADirectory.into(), path));
    }
    for (path, text) in files {
        let text = text.as_ref();
        let changes = fs::read(path).ok().as_deref() != Some(text);
        if changes {
            staged.add(path, text).map_err(|error| with_path(error, path))?;
        }
        changed.push(changes);
    }
    staged.publish()?;
    Ok(changed)
}

/// Temporary files and the names they are meant for; what is not published is removed.
#[derive(Default)]
struct Staged(Vec<(PathBuf, PathBuf)>);

impl Staged {
    fn add(&mut self, path: &Path, text: &[u8]) -> io::Result<()> {
        fs::create_dir_all(path.parent().unwrap_or(Path::new("")))?;
        let mut name = path.file_name().unwrap_or_default().to_owned();
        // Two runs at the same time must not write into one temporary file.
        name.push(format!(".{}.tmp", std::process::id()));
        let temporary = path.with_file_name(name);
        self.0.push((temporary.clone(), path.to_owned()));
        fs::write(&temporary, text)
    }

    fn publish(mut self) -> io::Result<()> {
        for (temporary, path) in std::mem::take(&mut self.0) {
            let renamed = fs::rename(&temporary, &path).map_err(|error| with_path(error, &path));
            if renamed.is_err() {
                let _ = fs::remove_file(&temporary);
                return renamed;
            }
        }
        Ok(())
    }
}

impl Drop for Staged {
    fn drop(&mut self) {
        for (temporary, _) in &self.0 {
            // The error that led here is the one to report.
            let _ = fs::remove_file(temporary);
        }
    }
}

fn with_path(error: io::Error, path: &Path) -> io::Error {
    io::Error::new(error.kind(), format!("cannot write {}: {error}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> PathBuf {
        std::env::temp_dir().join(format!("dpc-codegen-{name}-{}", std::process::id()))
    }

    #[test]
    fn unchanged_files_are_left_alone_and_nothing_else_remains() {
        let folder = folder("disk");
        let (a, b) = (folder.join("a.rs"), folder.join("b.rs"));
        assert_eq!(write_all(&[(a.clone(), "1"), (b.clone(), "2")]).unwrap(), [true, true]);
        assert_eq!(write_all(&[(a, "1"), (b.clone(), "3")]).unwrap(), [false, true]);
        assert_eq!(fs::read_to_string(b).unwrap(), "3");
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 2);
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_file_that_cannot_be_written_leaves_the_others_as_they_were() {
        let folder = folder("halt");
        let a = folder.join("a.rs");
        write_all(&[(a.clone(), "old")]).unwrap();
        let error = write_all(&[(a.clone(), "new"), (a.join("b.rs"), "new")]).unwrap_err();
        assert!(error.to_string().contains("b.rs"), "{error}");
        assert_eq!(fs::read_to_string(a).unwrap(), "old");
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
        fs::remove_dir_all(folder).unwrap();
    }
}
