//! MAT-files of version 5: MATLAB's `save -v6` and `-v7`, Octave's `save -v7`, `scipy.io.savemat`.
//!
//! "MAT-File Format", The MathWorks: elements of a tag (type, bytes) and data; a matrix is an element of elements.

use miniz_oxide::inflate::decompress_to_vec_zlib_with_limit;

use super::{Array, Contents, LARGEST, Unusable, Variable, entries};

const HEADER: usize = 128;
/// Bytes of all compressed variables together.
const MOST: usize = 16 * LARGEST;
/// Structures in structures.
const DEEPEST: usize = 4;

pub(super) fn read(bytes: &[u8]) -> Result<Contents, Unusable> {
    let swapped = byte_order(bytes)?;
    let mut reader = Reader { rest: &bytes[HEADER..], swapped };
    let (mut variables, mut room) = (Vec::new(), MOST);
    while !reader.rest.is_empty() {
        let element = reader.element()?;
        match element.kind {
            MATRIX => variables.extend(Reader { rest: element.data, swapped }.variable()?.flattened()),
            COMPRESSED => {
                let inflated = decompress_to_vec_zlib_with_limit(element.data, room)
                    .map_err(|error| Unusable::new(format!("has a variable that cannot be unpacked: {error}")))?;
                room -= inflated.len();
                let element = Reader { rest: &inflated, swapped }.element()?;
                if element.kind == MATRIX {
                    variables.extend(Reader { rest: element.data, swapped }.variable()?.flattened());
                }
            }
            _ => {}
        }
    }
    Ok(Contents { variables })
}

/// Whether the bytes of numbers are the other way round than little-endian.
fn byte_order(bytes: &[u8]) -> Result<bool, Unusable> {
    const SAVE: &str = "in MATLAB, save the matrices by: save('plant.mat', 'A', 'B', 'C', '-v7')";
    if bytes.starts_with(b"MATLAB 7.3") || bytes.starts_with(b"\x89HDF") || bytes.get(512..516) == Some(b"\x89HDF") {
        return Err(Unusable::new("is a MAT-file of version 7.3 (HDF5), which is not read").with_help(SAVE));
    }
    if bytes.starts_with(b"# Created by Octave") {
        let help = "in Octave, save the matrices by: save -v7 plant.mat A B C";
        return Err(Unusable::new("is in Octave's own text format").with_help(help));
    }
    // The text that version 5 starts with has no zero among its first bytes; the numbers that version 4 starts with have.
    if bytes.get(..4).is_some_and(|first| first.contains(&0)) {
        return Err(Unusable::new("looks like a MAT-file of version 4, which is not read").with_help(SAVE));
    }
    match bytes.get(HEADER - 2..HEADER) {
        Some(b"IM") => Ok(false),
        Some(b"MI") => Ok(true),
        _ => Err(Unusable::new("is not a MAT-file").with_help(SAVE)),
    }
}

const INT8: u32 = 1;
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;

struct Element<'a> {
    kind: u32,
    data: &'a [u8],
}

#[derive(Clone, Copy)]
struct Reader<'a> {
    rest: &'a [u8],
    swapped: bool,
}

/// A variable, or a field of one.
struct Named {
    name: String,
    content: Content,
}

enum Content {
    Numbers(Result<Array, Unusable>),
    Structure(Vec<Named>),
}

impl Named {
    /// `sys.A` for the field A of the structure sys. What has no name is MATLAB's own.
    fn flattened(self) -> Vec<Variable> {
        match self.content {
            _ if self.name.is_empty() => Vec::new(),
            Content::Numbers(content) => vec![Variable { name: Some(self.name), content }],
            Content::Structure(fields) => {
                let whole = |field: Self| Self { name: format!("{}.{}", self.name, field.name), ..field };
                fields.into_iter().flat_map(|field| whole(field).flattened()).collect()
            }
        }
    }
}

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], Unusable> {
        let (taken, rest) = self.rest.split_at_checked(count).ok_or_else(cut_off)?;
        self.rest = rest;
        Ok(taken)
    }

    fn word(&mut self) -> Result<u32, Unusable> {
        let word = self.take(4)?;
        let word = [word[0], word[1], word[2], word[3]];
        Ok(if self.swapped { u32::from_be_bytes(word) } else { u32::from_le_bytes(word) })
    }

    fn element(&mut self) -> Result<Element<'a>, Unusable> {
        let word = self.word()?;
        // Up to four bytes of data stand in the tag itself, whose upper half then says how many.
        if word >> 16 != 0 {
            let bytes = (word >> 16) as usize;
            let data = self.take(4)?.get(..bytes).ok_or_else(cut_off)?;
            return Ok(Element { kind: word & 0xffff, data });
        }
        let bytes = self.word()? as usize;
        let data = self.take(bytes)?;
        if word != COMPRESSED {
            // The last one of a file may lack what would fill it up to 8 bytes.
            let padding = bytes.next_multiple_of(8) - bytes;
            self.take(padding.min(self.rest.len()))?;
        }
        Ok(Element { kind: word, data })
    }

    fn variable(mut self) -> Result<Named, Unusable> {
        self.matrix(DEEPEST)
    }

    /// The parts of a matrix element.
    fn matrix(&mut self, depth: usize) -> Result<Named, Unusable> {
        if self.rest.is_empty() {
            let nothing = Unusable::new("is empty");
            return Ok(Named { name: String::new(), content: Content::Numbers(Err(nothing)) });
        }
        let mut flags = Self { rest: self.element()?.data, swapped: self.swapped };
        let flags = flags.word()?;
        let class = Class::of(flags);
        // An object has no size, and its name comes first.
        if class == Class::Opaque {
            let name = text(self.element()?.data);
            return Ok(Named { name, content: Content::Numbers(Err(no_matrix("an object"))) });
        }
        let dimensions = self.element()?;
        let dimensions = self.integers(&dimensions)?;
        let name = text(self.element()?.data);
        let content = match class {
            Class::Numbers if flags & COMPLEX != 0 => Content::Numbers(Err(complex())),
            Class::Numbers => Content::Numbers(self.whole(&dimensions)),
            Class::Sparse if flags & COMPLEX != 0 => Content::Numbers(Err(complex())),
            Class::Sparse => Content::Numbers(self.sparse(&dimensions)),
            Class::Structure if depth > 0 && dimensions.iter().all(|size| *size == 1) => self.structure(depth)?,
            Class::Structure => Content::Numbers(Err(no_matrix("a list of structures"))),
            Class::Other(what) => Content::Numbers(Err(no_matrix(what))),
            Class::Opaque => Content::Numbers(Err(no_matrix("an object"))),
        };
        Ok(Named { name, content })
    }

    fn whole(&mut self, dimensions: &[usize]) -> Result<Array, Unusable> {
        let (rows, columns) = size(dimensions)?;
        let count = entries(rows, columns)?;
        let element = self.element()?;
        let numbers = self.numbers(&element)?;
        match numbers.len() == count {
            true => Array::by_columns(rows, columns, &numbers),
            false => Err(Unusable::new(format!("{rows} x {columns}, but has {} numbers", numbers.len()))),
        }
    }

    /// Row indices, where each column begins, values.
    fn sparse(&mut self, dimensions: &[usize]) -> Result<Array, Unusable> {
        let (rows, columns) = size(dimensions)?;
        let mut whole = vec![0.0; entries(rows, columns)?];
        let [at, begins, values] = [self.element()?, self.element()?, self.element()?];
        let (at, begins, values) = (self.integers(&at)?, self.integers(&begins)?, self.numbers(&values)?);
        let damaged = || Unusable::new("sparse, with indices that do not fit its size");
        if begins.len() != columns + 1 {
            return Err(damaged());
        }
        for (c, ends) in begins.windows(2).enumerate() {
            let (rows_of, values) = (at.get(ends[0]..ends[1]), values.get(ends[0]..ends[1]));
            for (r, value) in rows_of.ok_or_else(damaged)?.iter().zip(values.ok_or_else(damaged)?) {
                *whole.get_mut(r * columns + c).filter(|_| *r < rows).ok_or_else(damaged)? += *value;
            }
        }
        Array::new(rows, columns, whole)
    }

    /// Length of a field's name, the names, the fields.
    fn structure(&mut self, depth: usize) -> Result<Content, Unusable> {
        let length = self.element()?;
        let length = self.integers(&length)?.first().copied().filter(|length| *length > 0).ok_or_else(cut_off)?;
        let names: Vec<String> = self.element()?.data.chunks(length).map(text).collect();
        let field = |name: String| {
            let element = self.element()?;
            let field = Self { rest: element.data, swapped: self.swapped }.matrix(depth - 1)?;
            Ok(Named { name, ..field })
        };
        Ok(Content::Structure(names.into_iter().map(field).collect::<Result<_, Unusable>>()?))
    }

    fn numbers(&self, element: &Element<'_>) -> Result<Vec<f64>, Unusable> {
        let (bytes, number) = self.reading(element.kind).ok_or_else(|| Unusable::new("holds no numbers"))?;
        Ok(element.data.chunks_exact(bytes).map(number).collect())
    }

    /// Sizes and indices.
    fn integers(&self, element: &Element<'_>) -> Result<Vec<usize>, Unusable> {
        let whole = |number: f64| (number >= 0.0 && number <= f64::from(u32::MAX)).then_some(number as usize);
        let all: Option<Vec<usize>> = self.numbers(element)?.into_iter().map(whole).collect();
        all.ok_or_else(|| Unusable::new("has a size below 0"))
    }

    /// Bytes of a number of this kind, and what they mean.
    #[expect(clippy::cast_precision_loss, reason = "an integer beyond 2^53 means the nearest number")]
    fn reading(&self, kind: u32) -> Option<(usize, impl Fn(&[u8]) -> f64)> {
        let bytes = match kind {
            INT8 | 2 => 1,
            3 | 4 => 2,
            5..=7 => 4,
            9 | 12 | 13 => 8,
            _ => return None,
        };
        let swapped = self.swapped;
        let number = move |raw: &[u8]| {
            let mut word = [0; 8];
            raw.iter().enumerate().for_each(|(k, byte)| word[if swapped { bytes - 1 - k } else { k }] = *byte);
            let (bits, unused) = (u64::from_le_bytes(word), 64 - 8 * bytes);
            match kind {
                7 => f64::from(f32::from_bits(bits as u32)),
                9 => f64::from_bits(bits),
                2 | 4 | 6 | 13 => bits as f64,
                _ => ((bits << unused) as i64 >> unused) as f64,
            }
        };
        Some((bytes, number))
    }
}

const COMPLEX: u32 = 0x800;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Class {
    Numbers,
    Sparse,
    Structure,
    Opaque,
    Other(&'static str),
}

impl Class {
    fn of(flags: u32) -> Self {
        match flags & 0xff {
            6..=15 => Self::Numbers,
            5 => Self::Sparse,
            2 => Self::Structure,
            17 => Self::Opaque,
            1 => Self::Other("a cell array"),
            3 => Self::Other("an object"),
            4 => Self::Other("text"),
            16 => Self::Other("a function"),
            _ => Self::Other("of a class that is not known"),
        }
    }
}

fn size(dimensions: &[usize]) -> Result<(usize, usize), Unusable> {
    match *dimensions {
        [rows, columns] => Ok((rows, columns)),
        _ => Err(Unusable::new(format!("has {} dimensions, a matrix has 2", dimensions.len()))),
    }
}

fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).into_owned()
}

fn cut_off() -> Unusable {
    Unusable::new("is a MAT-file that is cut off or damaged")
}

fn complex() -> Unusable {
    Unusable::new("complex").with_help("save the real part: A = real(A)")
}

fn no_matrix(what: &str) -> Unusable {
    let error = Unusable::new(what);
    match what {
        "an object" => error.with_help(
            "take a model apart before it is saved: [A, B, C] = ssdata(sys); save('plant.mat', 'A', 'B', 'C', '-v7')",
        ),
        _ => error,
    }
}
