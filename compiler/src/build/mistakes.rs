//! What is included in the place of controllers that do not exist: errors of the compiler.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::{Build, Failure, stamp};
use crate::emit::{folder_of, write_all};
use crate::spec::Heading;

/// Puts the mistakes of `build` where its controllers would be. Whether it is known where that is.
pub fn leave(out: &Path, build: &Build, failure: &Failure) -> bool {
    let Some(folder) = folder(out, build) else { return false };
    // After a change of the name the crate may still include the old one.
    let old = stamp::folder(out, &build.file).filter(|old| *old != folder && old.is_dir());
    let left = std::iter::once(&folder).chain(&old).all(|folder| write(folder, failure));
    stamp::remove(out, &build.file);
    left
}

fn write(folder: &Path, failure: &Failure) -> bool {
    let texts: Vec<(PathBuf, String)> =
        failure.0.iter().enumerate().map(|(k, mistake)| (name(folder, k), shown(mistake))).collect();
    let errors: String =
        (1..=texts.len()).map(|k| format!("compile_error!(include_str!(\"mistake-{k}.txt\"));\n")).collect();
    let mut files: Vec<(PathBuf, &str)> = texts.iter().map(|(path, text)| (path.clone(), text.as_str())).collect();
    files.extend(modules(folder).into_iter().map(|module| (module, errors.as_str())));
    write_all(&files).is_ok()
}

/// A network that was renamed leaves a folder that is no longer kept: whoever includes it is told the new name.
pub fn outdate(out: &Path, file: &Path, folder: &Path) -> io::Result<()> {
    let Some(old) = stamp::folder(out, file).filter(|old| old != folder && old.is_dir()) else { return Ok(()) };
    let name = folder.file_name().unwrap_or_default().display();
    let message = format!("the network of {} is now included by {name:?}", file.display());
    let error = format!("compile_error!({message:?});\n");
    let files: Vec<(PathBuf, &str)> = modules(&old).into_iter().map(|module| (module, error.as_str())).collect();
    write_all(&files).map(drop)
}

/// By the file's `name`, however broken the rest is, or where its controllers were before.
fn folder(out: &Path, build: &Build) -> Option<PathBuf> {
    let text = fs::read_to_string(&build.file).ok()?;
    let heading = Heading::of(&text);
    let named = heading.name.as_ref().map(|name| out.join(folder_of(name, build.scalar, heading.scalar)));
    named.or_else(|| stamp::folder(out, &build.file))
}

/// Everything that may be included: `mod.rs`, and what else is there.
fn modules(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut modules: Vec<PathBuf> = entries.filter(|path| path.extension().is_some_and(|end| end == "rs")).collect();
    let root = folder.join("mod.rs");
    if !modules.contains(&root) {
        modules.push(root);
    }
    modules.sort();
    modules
}

fn name(folder: &Path, k: usize) -> PathBuf {
    folder.join(format!("mistake-{}.txt", k + 1))
}

/// `E0110: ...` instead of `error[E0110]: ...`, since the compiler says `error: ` before it.
fn shown(mistake: &str) -> String {
    let Some(rest) = mistake.strip_prefix("error") else { return mistake.to_owned() };
    match rest.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
        Some((code, rest)) => format!("{code}{rest}"),
        None => rest.trim_start_matches(": ").to_owned(),
    }
}
