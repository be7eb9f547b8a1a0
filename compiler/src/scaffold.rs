//! A crate of the user's own, to begin with: `dpc-codegen new`.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::dependency::{COMPILER, RUNTIME, dependency};
use crate::emit::{folder_of, write_all};

/// A plant to begin with.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Template {
    /// Three tanks, joined by pipes, with pumps and a wall that bears little
    #[default]
    Tanks,
    /// Three vehicles in a row that keep their distance
    Vehicles,
    /// Three rooms with heaters, doors and measured weather
    Rooms,
}

impl Template {
    pub const ALL: [Self; 3] = [Self::Tanks, Self::Vehicles, Self::Rooms];

    pub fn name(self) -> &'static str {
        match self {
            Self::Tanks => "tanks",
            Self::Vehicles => "vehicles",
            Self::Rooms => "rooms",
        }
    }

    fn what(self) -> &'static str {
        match self {
            Self::Tanks => "Three tanks in a row, each with a pump, joined by pipes.",
            Self::Vehicles => "Three vehicles in a row that keep their distance.",
            Self::Rooms => "Three rooms with a heater each, doors between them, and the weather, which is measured.",
        }
    }

    fn network(self) -> &'static str {
        match self {
            Self::Tanks => include_str!("scaffold/files/tanks/system.toml"),
            Self::Vehicles => include_str!("scaffold/files/vehicles/system.toml"),
            Self::Rooms => include_str!("scaffold/files/rooms/system.toml"),
        }
    }
}

/// Names and texts of the crate `name`, a valid one; see [`check_name`].
pub fn files(name: &str, template: Template) -> Vec<(&'static str, String)> {
    let texts = [
        ("Cargo.toml", include_str!("scaffold/files/Cargo.toml.txt")),
        ("build.rs", include_str!("scaffold/files/build.rs.txt")),
        ("system.toml", template.network()),
        ("src/lib.rs", include_str!("scaffold/files/lib.rs.txt")),
        ("src/closed_loop.rs", include_str!("scaffold/files/closed_loop.rs.txt")),
        ("src/main.rs", include_str!("scaffold/files/main.rs.txt")),
        ("tests/closed_loop.rs", include_str!("scaffold/files/test.rs.txt")),
        ("README.md", include_str!("scaffold/files/README.md.txt")),
        (".gitignore", include_str!("scaffold/files/gitignore.txt")),
    ];
    let places = [
        ("@@NAME@@", name.to_owned()),
        ("@@CRATE@@", name.replace('-', "_")),
        ("@@FOLDER@@", folder_of(name, None, None)),
        ("@@WHAT@@", template.what().to_owned()),
        ("@@RUNTIME@@", dependency(RUNTIME, "")),
        ("@@COMPILER@@", dependency(COMPILER, "default-features = false")),
    ];
    let filled = |text: &str| places.iter().fold(text.to_owned(), |text, (place, value)| text.replace(place, value));
    texts.map(|(file, text)| (file, filled(text))).into()
}

/// Writes a crate into `folder`, which is made, or is empty. Its name is `name`, or the folder's.
///
/// # Errors
/// A sentence for the user; then nothing has been written.
pub fn create(folder: &Path, name: Option<&str>, template: Template) -> Result<Vec<PathBuf>, String> {
    let shown = folder.display();
    let failed = |error: io::Error| format!("error: cannot make {shown}: {error}");
    let whole = std::path::absolute(folder).map_err(failed)?;
    // `.` and `..` have names too.
    let whole = whole.canonicalize().unwrap_or(whole);
    let named = whole.file_name().unwrap_or_default().to_string_lossy();
    let name = name.unwrap_or(&named);
    check_name(name)?;
    check_free(&whole).map_err(|why| format!("error: {shown} {why}\nhelp: choose another folder"))?;
    let files = files(name, template);
    let paths: Vec<(PathBuf, &str)> = files.iter().map(|(file, text)| (whole.join(file), text.as_str())).collect();
    let there = whole.exists();
    let made = write_all(&paths);
    if made.is_err() {
        // Folders without anything in them; the first error is the one to report.
        let inner = paths.iter().filter_map(|(path, _)| path.parent()).filter(|parent| *parent != whole);
        inner.chain((!there).then_some(whole.as_path())).for_each(|empty| drop(fs::remove_dir(empty)));
    }
    made.map_err(|error| format!("error: {error}"))?;
    Ok(files.iter().map(|(file, _)| folder.join(file)).collect())
}

fn check_free(folder: &Path) -> Result<(), &'static str> {
    match fs::read_dir(folder) {
        Ok(mut entries) => match entries.next() {
            None => Ok(()),
            Some(_) => Err("is not empty, and nothing in it is to be lost"),
        },
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        Err(_) => Err("is no folder that can be written to"),
    }
}

/// Names that cargo, or a program on the way, keeps for itself; and those of the dependencies.
const TAKEN: [&str; 14] = [
    "alloc",
    "build",
    "core",
    "deps",
    "examples",
    "incremental",
    "proc-macro",
    "proc_macro",
    "std",
    "test",
    "dpc-runtime",
    "dpc_runtime",
    "dpc-codegen",
    "dpc_codegen",
];

/// Whether cargo takes `name` for a package and Rust for a crate.
///
/// # Errors
/// A sentence for the user.
pub fn check_name(name: &str) -> Result<(), String> {
    let refused = |why: &str| {
        Err(format!("error: {name:?} cannot be the name of a crate: {why}\nhelp: state another with --name"))
    };
    let first = name.chars().next();
    if !first.is_some_and(|c| c.is_ascii_alphabetic()) {
        return refused("it must begin with a letter");
    }
    if let Some(odd) = name.chars().find(|c| !c.is_ascii_alphanumeric() && !matches!(c, '-' | '_')) {
        return refused(&format!("{odd:?} is no letter, digit, - or _"));
    }
    if name.len() > 64 {
        return refused("it is longer than 64 characters");
    }
    if TAKEN.contains(&name.to_lowercase().as_str()) {
        return refused("it is taken");
    }
    // A module name that differs is one that Rust or Windows keeps for itself.
    match folder_of(name, None, None).ends_with('_') && !name.ends_with(['-', '_']) {
        true => refused("it is a word of the language, or of the system"),
        false => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::check_name;

    #[test]
    fn names_that_cargo_or_rust_refuse_are_refused() {
        for name in
            ["", "1st", "-a", "my demo", "grün", "fn", "type", "con", "std", "test", "dpc-runtime", "a.b", "a/b"]
        {
            assert!(check_name(name).is_err(), "{name}");
        }
        for name in ["demo", "my-plant", "my_plant", "Tanks2", "network"] {
            assert_eq!(check_name(name), Ok(()), "{name}");
        }
    }
}
