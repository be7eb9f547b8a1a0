//! A history as files for other tools.

use std::io::{Cursor, Write};

use super::columns::Columns;
use super::history::History;

/// A format of tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Format {
    /// Comma-separated values: a line of names with units, then one per step. The last columns are statuses in words.
    Csv,
    /// [`History`] as it is.
    Json,
    /// An array of 64-bit floats per column, in the format of NumPy: `numpy.load("history.npz")["left.x.h1 [cm]"]`.
    Npz,
}

impl Format {
    pub const ALL: [Self; 3] = [Self::Csv, Self::Json, Self::Npz];

    /// In file names and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Json => "json",
            Self::Npz => "npz",
        }
    }

    /// The bytes of a file. Numbers are written so that they read back to the same bits.
    ///
    /// # Errors
    /// What the writer of the format reports, in words.
    pub fn bytes(self, history: &History) -> Result<Vec<u8>, String> {
        match self {
            Self::Csv => csv(history).map_err(|error| error.to_string()),
            Self::Json => serde_json::to_vec(history).map_err(|error| error.to_string()),
            Self::Npz => npz(history).map_err(|error| error.to_string()),
        }
    }
}

impl std::str::FromStr for Format {
    type Err = &'static str;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        Self::ALL.into_iter().find(|format| format.name() == name).ok_or("csv, json or npz is expected")
    }
}

fn csv(history: &History) -> Result<Vec<u8>, csv::Error> {
    let columns = Columns::of(history);
    let mut writer = csv::Writer::from_writer(Vec::new());
    let names = columns.numbers.iter().map(|(name, _)| name);
    writer.write_record(names.chain(columns.words.iter().map(|(name, _)| name)))?;
    for step in 0..history.steps() {
        let numbers = columns.numbers.iter().map(|(_, values)| values[step].to_string());
        writer.write_record(numbers.chain(columns.words.iter().map(|(_, words)| words[step].clone())))?;
    }
    writer.into_inner().map_err(|error| error.into_error().into())
}

/// Stored, not deflated: readers map it, and a run is small.
fn npz(history: &History) -> zip::result::ZipResult<Vec<u8>> {
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    // Without the date of today, so that the same history gives the same bytes.
    let options = zip::write::SimpleFileOptions::default()
        .compression_method(zip::CompressionMethod::Stored)
        .last_modified_time(zip::DateTime::default());
    for (name, values) in Columns::of(history).numbers {
        archive.start_file(format!("{}.npy", name.replace('/', "|")), options)?;
        archive.write_all(&npy(&values))?;
    }
    Ok(archive.finish()?.into_inner())
}

/// Version 1.0 of the NPY format: magic, version, length of the header, a header that is a Python dictionary padded with spaces so
/// that the data begins at a multiple of 64 bytes, data.
fn npy(values: &[f64]) -> Vec<u8> {
    const FIXED: usize = 10;
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({},), }}", values.len());
    let padded = (FIXED + header.len() + 1).next_multiple_of(64) - FIXED;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((padded as u16).to_le_bytes());
    bytes.extend(format!("{header:<width$}\n", width = padded - 1).bytes());
    values.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
    bytes
}

#[cfg(test)]
mod tests {
    use super::npy;

    #[test]
    fn arrays_begin_at_a_multiple_of_64_bytes() {
        let bytes = npy(&[1.5, -2.0]);
        assert_eq!(bytes.len(), 128 + 16);
        assert_eq!(&bytes[..10], b"\x93NUMPY\x01\x00\x76\x00");
        assert_eq!((bytes[127], &bytes[128..136]), (b'\n', &1.5f64.to_le_bytes()[..]));
    }
}
