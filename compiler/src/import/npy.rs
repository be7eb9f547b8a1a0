//! One NumPy array: a header that is a Python dictionary, then the numbers.
//!
//! <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>

use super::{Array, Unusable, entries};

const MAGIC: &[u8] = b"\x93NUMPY";

pub(super) fn read(bytes: &[u8]) -> Result<Array, Unusable> {
    let (header, data) = split(bytes).ok_or_else(|| Unusable::new("is not a NumPy file: the header is cut off"))??;
    let header = Header::parse(header)?;
    let (rows, columns) = header.size()?;
    let count = entries(rows, columns)?;
    let (kind, swapped) = Kind::of(&header.descr)?;
    let needed = count * kind.bytes();
    if data.len() != needed {
        return Err(Unusable::new(format!("has {} bytes of numbers, {rows} x {columns} take {needed}", data.len())));
    }
    let numbers: Vec<f64> = data.chunks_exact(kind.bytes()).map(|number| kind.number(number, swapped)).collect();
    let array = match header.fortran_order {
        true => Array::by_columns(rows, columns, &numbers)?,
        false => Array::new(rows, columns, numbers)?,
    };
    Ok(if header.shape.len() == 1 { array.into_list() } else { array })
}

/// Header and data; `None` where the file ends too early.
fn split(bytes: &[u8]) -> Option<Result<(&str, &[u8]), Unusable>> {
    let Some(rest) = bytes.strip_prefix(MAGIC) else {
        return Some(Err(Unusable::new("is not a NumPy file: it does not start with \\x93NUMPY")));
    };
    let (version, rest) = rest.split_at_checked(2)?;
    let (length, rest) = match version[0] {
        1 => {
            rest.split_at_checked(2).map(|(length, rest)| (u16::from_le_bytes([length[0], length[1]]).into(), rest))?
        }
        2 | 3 => rest.split_at_checked(4).map(|(l, rest)| (u32::from_le_bytes([l[0], l[1], l[2], l[3]]), rest))?,
        other => return Some(Err(Unusable::new(format!("is of version {other} of NumPy's format, 1 to 3 are known")))),
    };
    let (header, data) = rest.split_at_checked(usize::try_from(length).ok()?)?;
    let text = std::str::from_utf8(header).map_err(|_| Unusable::new("has a header that is not text"));
    Some(text.map(|header| (header, data)))
}

struct Header {
    descr: String,
    fortran_order: bool,
    shape: Vec<usize>,
}

impl Header {
    /// `{'descr': '<f8', 'fortran_order': False, 'shape': (3, 4), }`.
    fn parse(text: &str) -> Result<Self, Unusable> {
        let after = |key: &str| {
            let found =
                [format!("'{key}'"), format!("\"{key}\"")].into_iter().find_map(|quoted| text.split_once(&quoted));
            let value = found.and_then(|(_, rest)| rest.trim_start().strip_prefix(':'));
            value.map(str::trim_start).ok_or_else(|| Unusable::new(format!("has a header without {key}")))
        };
        let (descr, order, shape) = (after("descr")?, after("fortran_order")?, after("shape")?);
        let quoted = descr.strip_prefix(['\'', '"']).and_then(|rest| rest.split(['\'', '"']).next());
        let descr = quoted.ok_or_else(|| {
            Unusable::new("is an array of records, not of numbers").with_help("save its fields one by one")
        })?;
        let shape = shape.strip_prefix('(').and_then(|rest| rest.split_once(')')).map(|(inside, _)| inside);
        let sizes = shape.map(|inside| inside.split(',').map(str::trim).filter(|size| !size.is_empty()));
        let sizes = sizes.and_then(|sizes| sizes.map(|size| size.parse().ok()).collect::<Option<Vec<usize>>>());
        let shape = sizes.ok_or_else(|| Unusable::new("has a header whose shape cannot be read"))?;
        Ok(Self { descr: descr.to_owned(), fortran_order: order.starts_with("True"), shape })
    }

    /// A list is taken as a row here, which does not matter to [`Array::flat`].
    fn size(&self) -> Result<(usize, usize), Unusable> {
        match self.shape[..] {
            [] => Ok((1, 1)),
            [length] => Ok((1, length)),
            [rows, columns] => Ok((rows, columns)),
            _ => Err(Unusable::new(format!("has {} dimensions, a matrix has 2", self.shape.len()))),
        }
    }
}

#[derive(Clone, Copy)]
enum Kind {
    Float(usize),
    Signed(usize),
    Unsigned(usize),
}

impl Kind {
    /// `<f8`, `>i4`, `|b1`; and whether the bytes are the other way round than on this machine's.
    fn of(descr: &str) -> Result<(Self, bool), Unusable> {
        let plain = descr.trim_start_matches(['<', '>', '|', '=']);
        let kind = match plain {
            "f8" => Self::Float(8),
            "f4" => Self::Float(4),
            "i8" => Self::Signed(8),
            "i4" => Self::Signed(4),
            "i2" => Self::Signed(2),
            "i1" => Self::Signed(1),
            "u8" => Self::Unsigned(8),
            "u4" => Self::Unsigned(4),
            "u2" => Self::Unsigned(2),
            "u1" | "b1" => Self::Unsigned(1),
            _ => return Err(refused(descr)),
        };
        Ok((kind, descr.starts_with('>')))
    }

    fn bytes(self) -> usize {
        let (Self::Float(bytes) | Self::Signed(bytes) | Self::Unsigned(bytes)) = self;
        bytes
    }

    #[expect(clippy::cast_precision_loss, reason = "an integer beyond 2^53 means the nearest number")]
    fn number(self, bytes: &[u8], swapped: bool) -> f64 {
        let mut word = [0; 8];
        let little = bytes.iter().copied().enumerate();
        little.for_each(|(k, byte)| word[if swapped { bytes.len() - 1 - k } else { k }] = byte);
        let bits = u64::from_le_bytes(word);
        let unused = 64 - 8 * bytes.len();
        match self {
            Self::Float(4) => f64::from(f32::from_bits(bits as u32)),
            Self::Float(_) => f64::from_bits(bits),
            Self::Signed(_) => ((bits << unused) as i64 >> unused) as f64,
            Self::Unsigned(_) => bits as f64,
        }
    }
}

fn refused(descr: &str) -> Unusable {
    let error = Unusable::new(format!("holds numbers of type {descr}, which is not real"));
    match descr.trim_start_matches(['<', '>', '|', '=']).chars().next() {
        Some('c') => error.with_help("save np.real(..) of it"),
        Some('O') => error.with_help("save an array of numbers: np.asarray(.., dtype=float)"),
        _ => error.with_help("save it as float64: np.asarray(.., dtype=float)"),
    }
}
