//! Numbers from files as other programs write them; knows neither TOML nor networks.
//!
//! | file | reads |
//! |---|---|
//! | `npy` | one NumPy array |
//! | `npz` | several of them in a ZIP archive, stored or deflated |
//! | `csv` | numbers in rows, with or without names |
//! | `market` | Matrix Market: coordinates or a whole array |
//! | `matlab` | MAT-files of version 5, which MATLAB calls `-v6` and `-v7` |
//!
//! Nothing that a file claims is believed before it is compared with the bytes that are there, and nothing beyond
//! [`LARGEST`] is allocated for.

mod array;
mod csv;
mod market;
mod matlab;
mod npy;
mod npz;

pub use array::Array;

/// Most entries of one matrix, 2048 x 2048: what a dense design can still be computed for.
pub const LARGEST: usize = 1 << 22;

/// Most bytes of one file.
pub const LARGEST_FILE: u64 = 1 << 28;

/// Endings of the names of files that are understood.
pub const ENDINGS: &str = ".npy, .npz, .csv, .tsv, .txt, .mtx, .mat";

/// What one file holds, in its order.
#[derive(Debug, Clone, PartialEq)]
pub struct Contents {
    pub variables: Vec<Variable>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// `None` in files of one matrix.
    pub name: Option<String>,
    pub content: Result<Array, Unusable>,
}

/// Why something cannot be used as a matrix.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unusable {
    /// Continues a sentence on the file or the variable: `line 3 has 2 numbers, line 1 has 4`.
    pub what: String,
    /// What to do about it.
    pub help: Option<String>,
}

/// The matrices in `bytes`, which is the file `name`; its ending tells the format.
///
/// # Errors
/// The format is not known, or the file is malformed.
pub fn read(name: &str, bytes: &[u8]) -> Result<Contents, Unusable> {
    let ending = name.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase()).unwrap_or_default();
    match &*ending {
        "npy" => npy::read(bytes).map(Contents::of_one),
        "npz" => npz::read(bytes),
        "csv" | "tsv" | "txt" => csv::read(text(bytes)?).map(Contents::of_one),
        "mtx" => market::read(text(bytes)?).map(Contents::of_one),
        "mat" => matlab::read(bytes),
        _ => {
            Err(Unusable::new("ends in nothing that tells a format")
                .with_help(format!("the endings known are {ENDINGS}")))
        }
    }
}

fn text(bytes: &[u8]) -> Result<&str, Unusable> {
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let line = 1 + bytes.iter().take(error.valid_up_to()).filter(|byte| **byte == b'\n').count();
        Unusable::new(format!("is not text: line {line} has bytes that are not UTF-8"))
    })?;
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text))
}

impl Contents {
    fn of_one(array: Array) -> Self {
        Self { variables: vec![Variable { name: None, content: Ok(array) }] }
    }

    /// Names of the variables.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.variables.iter().filter_map(|variable| variable.name.as_deref())
    }

    /// `A (4 x 4), B (4 x 2), sys (an object)`.
    pub fn describe(&self) -> String {
        let one = |variable: &Variable| {
            let name = variable.name.as_deref().unwrap_or("a matrix");
            match &variable.content {
                Ok(array) => format!("{name} ({})", array.size()),
                Err(unusable) => format!("{name} ({})", unusable.what),
            }
        };
        match self.variables.len() {
            0 => "nothing".to_owned(),
            _ => self.variables.iter().map(one).collect::<Vec<_>>().join(", "),
        }
    }
}

impl Unusable {
    fn new(what: impl Into<String>) -> Self {
        Self { what: what.into(), help: None }
    }

    /// With what to try.
    pub fn with_help(self, help: impl Into<String>) -> Self {
        Self { help: Some(help.into()), ..self }
    }
}

/// Entries of a matrix of this size, where that is not too many.
fn entries(rows: usize, columns: usize) -> Result<usize, Unusable> {
    let count = rows.checked_mul(columns).filter(|count| *count <= LARGEST);
    count.ok_or_else(|| Unusable::new(format!("{rows} x {columns}, which is more than {LARGEST} numbers")))
}
