//! The text that mistakes point into, and how it is read.

use std::fmt;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::{Diagnostic, Diagnostics, Place, code};

/// The file a network was read from.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Source {
    /// As the user wrote it; printed in messages, never emitted.
    pub path: String,
    pub text: String,
}

/// Why a file gave no text.
#[derive(Debug, Clone)]
pub enum Unreadable {
    /// What the file system reports, as a sentence for the user.
    System(String),
    /// The file is there but holds no text: what could be read of it, and the mistakes in that.
    NotText(Source, Diagnostics),
}

/// Files beyond this many bytes are no networks; a thousand subsystems take less than one of these 256 MiB.
const LARGEST: u64 = 256 << 20;

impl Source {
    /// Reads `file`.
    ///
    /// # Errors
    /// [`Unreadable`]: the file system refuses, the file is not UTF-8, or it is larger than 256 MiB.
    pub fn read(file: &Path) -> Result<Self, Unreadable> {
        let path = file.display().to_string();
        let bytes = bytes(file).map_err(|error| Unreadable::System(format!("cannot read {path}: {error}")))?;
        Self::of_bytes(path, bytes)
    }

    /// What a file of this name holds.
    ///
    /// # Errors
    /// [`Unreadable::NotText`]: as for [`Source::read`].
    pub fn of_bytes(path: String, bytes: Vec<u8>) -> Result<Self, Unreadable> {
        if bytes.len() as u64 > LARGEST {
            return Err(too_large(path));
        }
        String::from_utf8(bytes).map(|text| Self { path: path.clone(), text }).map_err(|error| not_utf8(path, &error))
    }

    /// Line and column of a byte, both from 1; columns count characters.
    pub fn position(&self, byte: usize) -> (usize, usize) {
        let before = &self.text[..self.text.floor_char_boundary(byte)];
        let line = before.bytes().filter(|byte| *byte == b'\n').count() + 1;
        let start = before.rfind('\n').map_or(0, |end| end + 1);
        (line, before[start..].chars().count() + 1)
    }

    /// `place` cut to the text and to whole characters: a renderer must not fail on a wrong place.
    pub fn within(&self, place: &Place) -> Place {
        let start = self.text.floor_char_boundary(place.start);
        let end = self.text.ceil_char_boundary(place.end.clamp(start, self.text.len().max(start)));
        start..end
    }
}

fn bytes(file: &Path) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(file)?.take(LARGEST + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn not_utf8(path: String, error: &std::string::FromUtf8Error) -> Unreadable {
    let valid = error.utf8_error().valid_up_to();
    let byte = error.as_bytes()[valid];
    let text = String::from_utf8_lossy(error.as_bytes()).into_owned();
    let source = Source { path, text };
    let mistake = Diagnostic::error(code::SYNTAX, "the file is not UTF-8 text")
        .at(valid..valid + char::REPLACEMENT_CHARACTER.len_utf8(), format!("byte {valid} is 0x{byte:02x}"))
        .help("save the file as UTF-8, which TOML asks for");
    Unreadable::NotText(source, mistake.into())
}

fn too_large(path: String) -> Unreadable {
    let mistake = Diagnostic::error(code::SYNTAX, "the file is too large for a network")
        .at(0..0, format!("more than {} MiB", LARGEST >> 20));
    Unreadable::NotText(Source { path, text: String::new() }, mistake.into())
}

/// As the command shows it, without colours.
impl fmt::Display for Unreadable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::System(why) => write!(f, "error: {why}"),
            Self::NotText(source, mistakes) => f.write_str(&mistakes.render(source, false)),
        }
    }
}

impl std::error::Error for Unreadable {}
