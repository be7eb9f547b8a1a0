//! Libraries for C out of a package: cargo builds it, the sizes of its structures are read, and the headers are written with them.

use std::fs;
use std::path::{Path, PathBuf};

use object::read::archive::ArchiveFile;
use object::{Endianness, File, Object, ObjectSection, ObjectSymbol};

use crate::design::Design;
use crate::emit::c::{Package, Sizes};
use crate::emit::{Emitted, write_all};
use crate::footprint::cargo::Cargo;
use crate::footprint::{Target, Workshop};

/// A package with its libraries and headers, somewhere.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Libraries {
    /// Without a standard library: needs nothing but `memcpy` and its like.
    pub fixed: PathBuf,
    /// For the machine that the compiler runs on only.
    pub shared: Option<PathBuf>,
    /// Path in the package and text of each header.
    pub headers: Vec<(String, String)>,
}

/// Builds the libraries of a package in a workshop, and says what their headers are.
///
/// # Errors
/// A sentence for the user: a folder cannot be written, or cargo or the compiler is missing or fails.
pub fn build(design: &Design, package: &Package, target: &Target, workshop: &Workshop) -> Result<Libraries, String> {
    let Workshop { packages, out } = workshop;
    let files: Vec<_> = package.files.iter().map(|(name, text)| (packages.join(name), text.as_str())).collect();
    write_all(&files).map_err(|error| format!("error: {error}"))?;
    let cargo = Cargo { target, flags: "", lto: "fat", out, purpose: "`--emit c`" };
    let made = target.triple.as_ref().map_or(out.clone(), |triple| out.join(triple)).join("release");
    let build = |kind: &str, feature: &str, name: String| {
        cargo.run(packages, &["rustc", "--lib", "--crate-type", kind, "--features", feature])?;
        kept(&made.join(&name), &packages.join("lib").join(name))
    };
    let fixed = build("staticlib", "panic-handler", format!("lib{}.a", package.name))?;
    let sizes = sizes(&fixed, package).map_err(|error| format!("error: {}: {error}", fixed.display()))?;
    let (before, after) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let shared = match target.triple {
        None => Some(build("cdylib", "std", format!("{before}{}{after}", package.name))?),
        Some(_) => None,
    };
    Ok(Libraries { fixed, shared, headers: package.headers(design, &sizes) })
}

/// Writes the package of a design with its libraries and headers into `folder`, and says which files these are; they are built in
/// the workshop first, so that nothing is written where that fails.
///
/// # Errors
/// As [`build`].
pub fn write(
    design: &Design,
    emitted: &Emitted,
    folder: &Path,
    target: &Target,
    workshop: &Workshop,
) -> Result<Vec<PathBuf>, String> {
    let package = Package::new(design, emitted);
    let libraries = build(design, &package, target, workshop)?;
    let texts = package.files.iter().chain(&libraries.headers);
    let texts: Vec<_> = texts.map(|(name, text)| (folder.join(name), text.as_str())).collect();
    write_all(&texts).map_err(|error| format!("error: {error}"))?;
    let mut written: Vec<PathBuf> = texts.into_iter().map(|(path, _)| path).collect();
    for library in [Some(&libraries.fixed), libraries.shared.as_ref()].into_iter().flatten() {
        let name = library.file_name().unwrap_or_default();
        written.push(kept(library, &folder.join("lib").join(name))?);
    }
    Ok(written)
}

/// Copies a library: cargo makes the next one in the same place, and a program may have the old one open.
fn kept(from: &Path, to: &Path) -> Result<PathBuf, String> {
    let copy = || {
        fs::create_dir_all(to.parent().unwrap_or(Path::new("")))?;
        let temporary = to.with_extension(format!("{}.tmp", std::process::id()));
        fs::copy(from, &temporary)?;
        fs::rename(&temporary, to)
    };
    copy().map_err(|error: std::io::Error| format!("error: cannot write {}: {error}", to.display()))?;
    Ok(to.to_owned())
}

/// What the array of sizes in the library says.
fn sizes(library: &Path, package: &Package) -> Result<Vec<Sizes>, String> {
    let bytes = fs::read(library).map_err(|error| error.to_string())?;
    let archive = ArchiveFile::parse(&*bytes).map_err(|error| error.to_string())?;
    for member in archive.members() {
        let data = member.and_then(|member| member.data(&*bytes)).map_err(|error| error.to_string())?;
        let Ok(object) = File::parse(data) else { continue };
        if let Some(words) = words(&object, &package.sizes, 2 * package.prefixes.len()) {
            return Ok(words.chunks(2).map(|pair| Sizes { controller: pair[0], plan: pair[1] }).collect());
        }
    }
    Err(format!("no symbol {}", package.sizes))
}

/// The first numbers of a variable, each as long as an address.
fn words(object: &File, name: &str, count: usize) -> Option<Vec<u64>> {
    // Some systems put an underscore before every name.
    let is_it = |symbol: &str| symbol.strip_prefix('_').unwrap_or(symbol) == name || symbol == name;
    let symbol = object.symbols().find(|symbol| symbol.is_definition() && symbol.name().is_ok_and(is_it))?;
    let section = object.section_by_index(symbol.section_index()?).ok()?;
    let width = if object.is_64() { 8 } else { 4 };
    let data = section.data_range(symbol.address(), (width * count) as u64).ok()??;
    let little = object.endianness() == Endianness::Little;
    let word = |bytes: &[u8]| match little {
        true => bytes.iter().rev().fold(0, |word, byte| word << 8 | u64::from(*byte)),
        false => bytes.iter().fold(0, |word, byte| word << 8 | u64::from(*byte)),
    };
    Some(data.chunks(width).map(word).collect())
}
