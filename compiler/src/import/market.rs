//! Matrix Market: a matrix by its non-zero entries or as a whole.
//!
//! <https://math.nist.gov/MatrixMarket/formats.html>

use super::{Array, Unusable, entries};

pub(super) fn read(text: &str) -> Result<Array, Unusable> {
    let mut lines = text.lines().enumerate().map(|(k, line)| (k + 1, line.trim()));
    let kind = Kind::parse(lines.next().map_or("", |(_, line)| line))?;
    let mut lines = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('%'));
    let (number, line) = lines.next().ok_or_else(|| Unusable::new("ends before the line with its size"))?;
    let wanted = if kind.by_coordinates { 3 } else { 2 };
    let sizes: Option<Vec<usize>> = line.split_whitespace().map(|size| size.parse().ok()).collect();
    let sizes = sizes.filter(|sizes| sizes.len() == wanted).ok_or_else(|| {
        let expected = if kind.by_coordinates { "rows, columns and entries" } else { "rows and columns" };
        Unusable::new(format!("line {number} does not say how many {expected} there are: `{}`", short(line)))
    })?;
    let mut matrix = Matrix::new(sizes[0], sizes[1], kind)?;
    match kind.by_coordinates {
        true => matrix.coordinates(lines, sizes[2])?,
        false => matrix.whole(lines)?,
    }
    Array::new(matrix.rows, matrix.columns, matrix.entries)
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Symmetry {
    General,
    Symmetric,
    Skew,
}

#[derive(Clone, Copy)]
struct Kind {
    by_coordinates: bool,
    symmetry: Symmetry,
}

impl Kind {
    /// `%%MatrixMarket matrix coordinate real general`.
    fn parse(line: &str) -> Result<Self, Unusable> {
        let words: Vec<String> = line.split_whitespace().map(str::to_ascii_lowercase).collect();
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let ["%%matrixmarket", "matrix", format, field, symmetry] = words[..] else {
            let error = Unusable::new("line 1 is not that of a Matrix Market file");
            return Err(error.with_help("it reads %%MatrixMarket matrix coordinate real general"));
        };
        if !["real", "double", "integer"].contains(&field) {
            return Err(Unusable::new(format!("holds {field} entries, real or integer ones are needed")));
        }
        let by_coordinates = match format {
            "coordinate" => true,
            "array" => false,
            _ => {
                return Err(Unusable::new(format!(
                    "is in the format `{}`, coordinate and array are known",
                    short(format)
                )));
            }
        };
        let symmetry = match symmetry {
            "general" => Symmetry::General,
            "symmetric" => Symmetry::Symmetric,
            "skew-symmetric" => Symmetry::Skew,
            _ => {
                return Err(Unusable::new(format!(
                    "has the symmetry `{}`, general, symmetric and skew-symmetric are known",
                    short(symmetry)
                )));
            }
        };
        Ok(Self { by_coordinates, symmetry })
    }
}

struct Matrix {
    rows: usize,
    columns: usize,
    entries: Vec<f64>,
    symmetry: Symmetry,
}

impl Matrix {
    fn new(rows: usize, columns: usize, kind: Kind) -> Result<Self, Unusable> {
        if kind.symmetry != Symmetry::General && rows != columns {
            return Err(Unusable::new(format!("is said to be symmetric, but is {rows} x {columns}")));
        }
        Ok(Self { rows, columns, entries: vec![0.0; entries(rows, columns)?], symmetry: kind.symmetry })
    }

    fn coordinates<'a>(&mut self, lines: impl Iterator<Item = (usize, &'a str)>, count: usize) -> Result<(), Unusable> {
        let mut stated = vec![false; self.entries.len()];
        let mut found = 0;
        for (number, line) in lines {
            let words: Vec<&str> = line.split_whitespace().collect();
            let read = match words[..] {
                [r, c, value] => r.parse().ok().zip(c.parse().ok()).zip(value.parse().ok()),
                _ => None,
            };
            let ((r, c), value): ((usize, usize), f64) = read
                .ok_or_else(|| Unusable::new(format!("line {number} is not `row column value`: `{}`", short(line))))?;
            if r == 0 || c == 0 || r > self.rows || c > self.columns {
                let what = format!("line {number}: there is no entry ({r}, {c}) in {} x {}", self.rows, self.columns);
                return Err(Unusable::new(what).with_help("rows and columns are counted from 1"));
            }
            let (r, c) = (r - 1, c - 1);
            if std::mem::replace(&mut stated[r * self.columns + c], true) {
                return Err(Unusable::new(format!("line {number} states entry ({}, {}) again", r + 1, c + 1)));
            }
            self.put(r, c, value).map_err(|what| Unusable::new(format!("line {number}: {what}")))?;
            found += 1;
        }
        match found == count {
            true => Ok(()),
            false => Err(Unusable::new(format!("has {found} entries, its size line says {count}"))),
        }
    }

    /// Column by column; of a symmetric matrix what is on and below the diagonal, of a skew one what is below.
    fn whole<'a>(&mut self, lines: impl Iterator<Item = (usize, &'a str)>) -> Result<(), Unusable> {
        let (rows, columns, symmetry) = (self.rows, self.columns, self.symmetry);
        let top = |c: usize| match symmetry {
            Symmetry::General => 0,
            Symmetry::Symmetric => c,
            Symmetry::Skew => c + 1,
        };
        let mut places = (0..columns).flat_map(|c| (top(c)..rows).map(move |r| (r, c)));
        for (number, word) in lines.flat_map(|(number, line)| line.split_whitespace().map(move |word| (number, word))) {
            let value =
                word.parse().map_err(|_| Unusable::new(format!("line {number}: `{}` is not a number", short(word))))?;
            let (r, c) = places
                .next()
                .ok_or_else(|| Unusable::new(format!("line {number}: more numbers than {rows} x {columns} take")))?;
            self.put(r, c, value).map_err(|what| Unusable::new(format!("line {number}: {what}")))?;
        }
        match places.count() {
            0 => Ok(()),
            missing => Err(Unusable::new(format!("ends {missing} numbers before {rows} x {columns} are complete"))),
        }
    }

    fn put(&mut self, r: usize, c: usize, value: f64) -> Result<(), &'static str> {
        let mirrored = match self.symmetry {
            Symmetry::General => None,
            Symmetry::Symmetric if r >= c => Some(value),
            Symmetry::Skew if r > c => Some(-value),
            Symmetry::Symmetric => return Err("only entries on and below the diagonal belong into a symmetric matrix"),
            Symmetry::Skew => return Err("only entries below the diagonal belong into a skew-symmetric matrix"),
        };
        if let Some(mirrored) = mirrored {
            self.entries[c * self.columns + r] = mirrored;
        }
        self.entries[r * self.columns + c] = value;
        Ok(())
    }
}

fn short(text: &str) -> String {
    text.chars().take(30).collect()
}
