//! Numbers in rows: separated by semicolons, tabs, commas or blanks; names above and beside them are understood, and
//! lines that start with `#`, `%` or `//` left out.

use super::{Array, LARGEST, Unusable};

pub(super) fn read(text: &str) -> Result<Array, Unusable> {
    let mut lines = lines(text);
    let first = *lines.first().ok_or_else(|| Unusable::new("has no numbers"))?;
    let separator = Separator::of(first.text);
    let column_names = separator.header(first);
    if column_names.is_some() {
        lines.remove(0);
    }
    let named = rows_are_named(&lines, separator, column_names.as_deref());
    let mut table = Table { names: Vec::new(), entries: Vec::new(), columns: None };
    lines.iter().try_for_each(|line| table.push(*line, separator, named))?;
    let (columns, _) = table.columns.ok_or_else(|| Unusable::new("has names, but no numbers"))?;
    let rows = table.entries.len() / columns.max(1);
    let column_names = column_names.unwrap_or_default();
    // A table with names beside its rows may have one above them.
    let beside = column_names.len().saturating_sub(columns);
    if !column_names.is_empty() && (column_names.len() < columns || beside > usize::from(named)) {
        let what = format!(
            "has {} names of columns above {columns} columns of numbers",
            column_names.len() - usize::from(named && beside == 1)
        );
        return Err(Unusable::new(what));
    }
    let column_names = column_names.into_iter().skip(beside).collect();
    Ok(Array::new(rows, columns, table.entries)?.named(table.names, column_names))
}

#[derive(Clone, Copy)]
struct Line<'a> {
    /// Counted from 1, as editors do.
    number: usize,
    text: &'a str,
}

fn lines(text: &str) -> Vec<Line<'_>> {
    let all = text.lines().enumerate().map(|(k, text)| Line { number: k + 1, text: text.trim() });
    all.filter(|line| !line.text.is_empty() && !["#", "%", "//"].iter().any(|mark| line.text.starts_with(mark)))
        .collect()
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Separator {
    At(char),
    Blanks,
}

impl Separator {
    fn of(line: &str) -> Self {
        [';', '\t', ','].into_iter().find(|mark| line.contains(*mark)).map_or(Self::Blanks, Self::At)
    }

    /// Without quotes and the blanks around them.
    fn cells(self, line: &str) -> Vec<&str> {
        match self {
            Self::At(mark) => line.split(mark).map(unquoted).collect(),
            Self::Blanks => line.split_whitespace().map(unquoted).collect(),
        }
    }

    /// Where semicolons separate, commas may be decimal ones.
    fn number(self, cell: &str) -> Option<f64> {
        let decimal = self == Self::At(';') && cell.matches(',').count() == 1 && !cell.contains('.');
        if decimal { cell.replace(',', ".").parse().ok() } else { cell.parse().ok() }
    }

    /// The names in `line`, where nothing in it is a number.
    fn header(self, line: Line<'_>) -> Option<Vec<String>> {
        let cells = self.cells(line.text);
        let names = cells.iter().all(|cell| self.number(cell).is_none()) && cells.iter().any(|cell| !cell.is_empty());
        names.then(|| cells.into_iter().map(str::to_owned).collect())
    }
}

fn unquoted(cell: &str) -> &str {
    let cell = cell.trim();
    let inside = ['"', '\''].iter().find_map(|quote| cell.strip_prefix(*quote)?.strip_suffix(*quote));
    inside.unwrap_or(cell).trim()
}

/// Names may be numbers, where nothing stands above them in the corner.
fn rows_are_named(lines: &[Line<'_>], separator: Separator, column_names: Option<&[String]>) -> bool {
    let Some(first) = lines.first() else { return false };
    let cells = separator.cells(first.text);
    let corner =
        column_names.is_some_and(|names| names.first().is_some_and(String::is_empty) || names.len() + 1 == cells.len());
    let beside = matches!(&cells[..], [name, numbers @ ..] if !name.is_empty() && !is_meant_as_number(name)
        && !numbers.is_empty() && numbers.iter().all(|cell| separator.number(cell).is_some()));
    corner || beside
}

/// Whether a cell begins like a number: `1d-1` and `1.234,5` are mistakes, not names.
fn is_meant_as_number(cell: &str) -> bool {
    cell.trim_start_matches(['+', '-', '\u{2212}', '.', ',']).starts_with(|c: char| c.is_ascii_digit())
}

struct Table {
    names: Vec<String>,
    /// Row by row.
    entries: Vec<f64>,
    /// How many there are, and the line that says so.
    columns: Option<(usize, usize)>,
}

impl Table {
    fn push(&mut self, line: Line<'_>, separator: Separator, named: bool) -> Result<(), Unusable> {
        let mut cells = separator.cells(line.text);
        if named {
            self.names.push(cells.remove(0).to_owned());
        }
        let (columns, first) = *self.columns.get_or_insert((cells.len(), line.number));
        if cells.len() != columns {
            let what = format!("line {} has {} numbers, line {first} has {columns}", line.number, cells.len());
            return Err(
                Unusable::new(what).with_help("write each row of the matrix on a line of its own, zeros included")
            );
        }
        if self.entries.len() + columns > LARGEST {
            return Err(Unusable::new(format!("has more than {LARGEST} numbers")));
        }
        for (k, cell) in cells.into_iter().enumerate() {
            let column = k + 1 + usize::from(named);
            self.entries.push(separator.number(cell).ok_or_else(|| no_number(line.number, column, cell))?);
        }
        Ok(())
    }
}

fn no_number(line: usize, column: usize, cell: &str) -> Unusable {
    match cell {
        "" => {
            Unusable::new(format!("line {line}, column {column} is empty")).with_help("write 0 where there is nothing")
        }
        _ => {
            let shown: String = cell.chars().take(30).collect();
            let what = format!("line {line}, column {column}: `{shown}` is not a number");
            Unusable::new(what)
                .with_help("write numbers such as 0.5 or 1e-3; names may stand in the first line and the first column")
        }
    }
}
